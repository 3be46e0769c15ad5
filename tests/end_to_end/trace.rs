//! `trace`: rays in, hits out.

use crate::models::{Mesh, PAINTS};
use crate::rays::{self, Hit, Ray, ray};
use crate::support::{Folder, assert_keys};

const SIZE: [f64; 3] = [1.0, 2.0, 3.0];

/// A folder with `box.rsp`: the box of [`SIZE`] in two materials of six triangles each.
fn folder_with_box(options: &str) -> Folder {
    let folder = Folder::new();
    folder.write("box.obj", Mesh::cuboid(SIZE).obj(&[(0, "red"), (6, "green")]));
    folder.write("paints.mtl", PAINTS);
    folder.run(&format!("convert box.obj -o box.rsp {options}")).done();
    folder
}

/// A folder with `hills.rsp`, many pages, and `rays`.
fn folder_with_hills(mesh: &Mesh, rays: &[Ray]) -> Folder {
    let folder = Folder::new();
    folder.write("hills.ply", mesh.ply());
    folder.write("rays", rays::encode(rays));
    folder.run("convert hills.ply -o hills.rsp --keep-ids --page-size 4K").done();
    folder
}

fn traced(folder: &Folder, pack: &str, rays: &[Ray]) -> Vec<Hit> {
    folder.write("rays", rays::encode(rays));
    folder.run(&format!("trace {pack} --rays rays -o hits")).done();
    rays::decode(&folder.read("hits"))
}

/// The point at weights `u` of the second and `v` of the third corner.
fn point(corners: [[f64; 3]; 3], u: f64, v: f64) -> [f64; 3] {
    [0, 1, 2].map(|k| (1.0 - u - v) * corners[0][k] + u * corners[1][k] + v * corners[2][k])
}

/// For each triangle of the box a ray from outside, two units above the point with u = 1/4 and v = 1/2.
fn rays_onto_box() -> Vec<Ray> {
    let mesh = Mesh::cuboid(SIZE);
    let onto = |i: usize| {
        let target = point(mesh.corners(i), 0.25, 0.5);
        // Sides come in the order -x, +x, -y, +y, -z, +z, two triangles each.
        let outward = [0, 1, 2].map(|k| if i / 4 != k { 0.0 } else { [-1.0, 1.0][i / 2 % 2] });
        ray([0, 1, 2].map(|k| target[k] + 2.0 * outward[k]), outward.map(|c| -c))
    };
    (0..12).map(onto).collect()
}

#[test]
fn hits_of_a_box_are_known() {
    let folder = folder_with_box("--keep-ids");
    for (i, hit) in traced(&folder, "box.rsp", &rays_onto_box()).into_iter().enumerate() {
        assert_eq!(hit.triangle, i as u64, "{hit:?}");
        assert_eq!(hit.geometry, i as u32 / 6, "{hit:?}");
        for (got, expected) in [(hit.t, 2.0), (hit.u, 0.25), (hit.v, 0.5)] {
            assert!((got - expected).abs() < 1e-6, "triangle {i}: {hit:?}");
        }
    }
}

#[test]
fn distances_count_in_directions_and_end_at_tnear_and_tfar() {
    let folder = folder_with_box("");
    let base = ray([0.3, 0.4, 5.0], [0.0, 0.0, -2.0]);
    let with = |tnear, tfar| {
        let mut ray = base;
        (ray[3], ray[7]) = (tnear, tfar);
        ray
    };
    // The top is at t = 1, the bottom at t = 2.5.
    let rays = [base, with(1.25, f32::INFINITY), with(0.0, 0.75), with(2.75, f32::INFINITY), with(1.0, 1.0)];
    let t: Vec<f32> = traced(&folder, "box.rsp", &rays).iter().map(|hit| hit.t).collect();
    assert_eq!(t, [1.0, 2.5, f32::INFINITY, f32::INFINITY, 1.0]);
}

#[test]
fn misses_and_invalid_rays() {
    let folder = folder_with_box("");
    let hit = ray([0.5, 0.5, 9.0], [0.0, 0.0, -1.0]);
    let broken = |place: usize, value: f32| {
        let mut ray = hit;
        ray[place] = value;
        ray
    };
    let mut rays = vec![
        ray([5.0, 5.0, 9.0], [0.0, 0.0, -1.0]),
        ray([0.5, 0.5, 9.0], [0.0, 0.0, 1.0]),
        ray([0.5, 0.5, 9.0], [0.0; 3]),
    ];
    rays.extend((0..8).map(|place| broken(place, f32::NAN)));
    rays.extend([0, 4].map(|place| broken(place, f32::INFINITY)));
    let all_miss =
        |hits: &[Hit]| hits.iter().all(|hit| hit.t == f32::INFINITY && hit.u == 0.0 && hit.v == 0.0);
    assert!(all_miss(&traced(&folder, "box.rsp", &rays)));
    rays.push(hit);
    assert!(traced(&folder, "box.rsp", &rays).last().unwrap().t == 6.0);
    let told = folder.run("trace box.rsp --rays rays --json").done().json();
    assert_eq!((told["rays"].as_u64(), told["hits"].as_u64()), (Some(rays.len() as u64), Some(1)));
    folder.run("trace box.rsp --rays rays --occluded -o occluded").done();
    let expected: Vec<u8> = (0..rays.len()).map(|i| u8::from(i + 1 == rays.len())).collect();
    assert_eq!(folder.read("occluded"), expected);
}

#[test]
fn kept_ids_are_those_of_the_input() {
    let mesh = Mesh::hills(40);
    let rays = rays::onto(40, 4000);
    let folder = folder_with_hills(&mesh, &rays);
    folder.run("trace hills.rsp --rays rays -o hits").done();
    let hits = rays::decode(&folder.read("hits"));
    let mut hit_triangles = vec![false; mesh.triangles.len()];
    for (ray, hit) in rays.iter().zip(&hits).filter(|(_, hit)| hit.t.is_finite()) {
        let corners = mesh.corners(hit.triangle as usize);
        let on_triangle = point(corners, f64::from(hit.u), f64::from(hit.v));
        let number = |i: usize| f64::from(ray[i]);
        let on_ray = [0, 1, 2].map(|k| number(k) + f64::from(hit.t) * number(k + 4));
        let is_near = on_ray.iter().zip(on_triangle).all(|(a, b)| (a - b).abs() < 2e-5);
        assert!(is_near, "{ray:?} {hit:?} {corners:?}");
        hit_triangles[hit.triangle as usize] = true;
    }
    assert!(hits.iter().filter(|hit| hit.t.is_finite()).count() > 3800);
    assert!(hit_triangles.iter().filter(|hit| **hit).count() > 1500, "rays meet most triangles");

    // Numbers of the pack are others, but the same triangles at the same places.
    folder.run("convert hills.ply -o bare.rsp --page-size 4K").done();
    folder.run("trace bare.rsp --rays rays -o bare-hits").done();
    let bare = rays::decode(&folder.read("bare-hits"));
    assert!(hits.iter().zip(&bare).all(|(kept, bare)| kept.t == bare.t));
    assert!(hits.iter().zip(&bare).any(|(kept, bare)| kept.triangle != bare.triangle));
}

#[test]
fn threads_and_kernels_change_no_byte() {
    let rays = rays::onto(40, 10_000);
    let folder = folder_with_hills(&Mesh::hills(40), &rays);
    for what in ["", "--occluded"] {
        folder.run(&format!("trace hills.rsp --rays rays {what} -o expected")).done();
        for how in ["--threads 2", "--kernel portable", "--kernel portable --threads 3 --repeat 2"] {
            folder.run(&format!("trace hills.rsp --rays rays {what} {how} -o hits")).done();
            assert!(folder.read("hits") == folder.read("expected"), "{what} {how}");
        }
    }
    assert_eq!(folder.read("expected").len(), rays.len());
    let occluded = folder.read("expected").iter().filter(|byte| **byte == 1).count();
    let told = folder.run("trace hills.rsp --rays rays --json").done().json();
    assert_eq!(told["hits"].as_u64(), Some(occluded as u64));
}

#[test]
fn packets_change_no_byte() {
    let eye = [0.4, 0.3, 5.0];
    let aim = |i: usize| [(i % 16) as f64 * 0.05, (i / 16) as f64 * 0.05, 0.0];
    let mut rays: Vec<Ray> = (0..256).map(|i| ray(eye, [0, 1, 2].map(|k| aim(i)[k] - eye[k]))).collect();
    // One that does not keep together with the others.
    rays[200] = ray([9.0, 9.0, 9.0], [0.0, -1.0, -1.0]);
    let folder = folder_with_hills(&Mesh::hills(40), &rays);
    folder.run("trace hills.rsp --rays rays -o single").done();
    folder.run("trace hills.rsp --rays rays -o packets --packets").done();
    assert!(folder.read("single") == folder.read("packets"));
    assert!(rays::decode(&folder.read("single")).iter().any(|hit| hit.t.is_finite()));
}

#[test]
fn json_has_the_promised_keys() {
    let folder = folder_with_box("");
    folder.write("rays", rays::encode(&rays_onto_box()));
    let told = folder.run("trace box.rsp --rays rays --threads 2 --kernel portable --json").done().json();
    let keys = ["seconds", "seconds_cpu", "mrays_per_second", "mrays_per_second_cpu"];
    assert_keys(&told, &keys);
    assert_eq!(told["rays"], 12);
    assert_eq!(told["hits"], 12);
    assert_eq!(told["threads"], 2);
    assert_eq!(told["kernel"], "portable");
    assert!(keys.iter().all(|key| told[*key].as_f64().is_some_and(|x| x > 0.0 && x.is_finite())), "{told:#}");
    let text = folder.run("trace box.rsp --rays rays").done().stdout;
    assert!(text.contains("12 rays, 12 hits"), "{text}");
}

#[test]
fn ray_files_are_checked() {
    let folder = folder_with_box("");
    let mut bytes = rays::encode(&rays_onto_box());
    bytes.pop();
    folder.write("short", &bytes);
    folder.run("trace box.rsp --rays short -o hits").failed(&["short", "383 bytes"]);
    folder.run("trace box.rsp --rays missing -o hits").failed(&["missing"]);
    folder.run("trace box.rsp --rays short --kernel abacus").failed(&["abacus", "portable"]);
    assert!(!folder.path("hits").exists());
    folder.write("none", "");
    let told = folder.run("trace box.rsp --rays none -o hits --json").done().json();
    assert_eq!(told["rays"], 0);
    assert_eq!(folder.read("hits"), b"");
}
