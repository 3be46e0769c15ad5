//! What a tracer tells of what it reads.
#![allow(clippy::unwrap_used, reason = "a test")]

mod support;

use glam::Vec3;
use raystrips_geom::Ray;
use raystrips_tracer::{Access, Part, Tracer, page_of};
use std::fmt::Write;
use support::{Model, Random};

/// Vertices along a side of the wavy square.
const SIDE: usize = 120;

#[test]
fn what_a_ray_needs_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("waves.obj");
    std::fs::write(&path, waves()).unwrap();
    for max_windows in [1, 5] {
        let model = Model::convert(&path, max_windows).unwrap();
        let directory = &model.scene.pack().directory;
        assert!(directory.len() > 1);
        let mut tracer = Tracer::new(&model.scene);
        for i in 0..1000 {
            let mut random = Random(i);
            let org = Vec3::new(0.5, 0.5, 0.3) + random.direction();
            let ray = Ray::new(org, Vec3::new(0.5, 0.5, 0.0) + random.direction() * 0.6 - org);
            let mut accesses: Vec<Access> = Vec::new();
            let hit = tracer.intersect_observed(&ray, &mut |access| accesses.push(access));
            assert_eq!(hit, tracer.intersect(&ray));
            assert_eq!(tracer.occluded_observed(&ray, &mut |_| ()), hit.is_hit());
            assert_eq!(accesses[0].part, Part::Upper);
            let in_page = |access: &Access, page: usize| {
                let begin = directory[page].offset;
                (begin..begin + u64::from(directory[page].bytes)).contains(&access.place)
            };
            for access in &accesses {
                let pages = (0..directory.len()).filter(|&page| in_page(access, page)).count();
                assert_eq!(pages, usize::from(access.part != Part::Upper), "{access:?}");
            }
            if hit.is_hit() {
                let there: Vec<Part> = accesses
                    .iter()
                    .filter(|access| in_page(access, page_of(&hit) as usize))
                    .map(|access| access.part)
                    .collect();
                assert!([Part::Lower, Part::Strips, Part::Vertices].iter().all(|part| there.contains(part)));
            }
        }
    }
}

fn waves() -> String {
    let mut obj = String::new();
    for i in 0..SIDE * SIDE {
        let (x, y) = ((i % SIDE) as f32 / SIDE as f32, (i / SIDE) as f32 / SIDE as f32);
        writeln!(obj, "v {x} {y} {}", 0.1 * (20.0 * x).sin() * (14.0 * y).cos()).unwrap();
    }
    for (x, y) in (1..SIDE).flat_map(|y| (1..SIDE).map(move |x| (x, y))) {
        let corner = |dx: usize, dy: usize| (y - dy) * SIDE + x - dx + 1;
        writeln!(obj, "f {} {} {} {}", corner(1, 1), corner(0, 1), corner(0, 0), corner(1, 0)).unwrap();
    }
    obj
}
