//! The paper's Tables 3 and 4: camera rays a second, one by one and in packets of 2 x 2.

use super::contestants::{BASE, Contestants, OURS};
use super::models::{self, Model};
use crate::clock::{Times, thread_time};
use crate::paper::published::{self, PICTURE_SIDE, million_rays};
use crate::paper::structure::Structure;
use crate::rays::{in_blocks, picture};
use anyhow::{Result, ensure};
use raystrips_geom::{Hit, Ray};
use raystrips_tracer::Tracer;

/// Rounds in which every structure traces the picture once.
const ROUNDS: usize = 9;

/// Which of the tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Table 3.
    Single,
    /// Table 4.
    Packet,
}

/// Traces rays and counts hits.
type CountHits<'a> = Box<dyn Fn(&[Ray]) -> usize + 'a>;

/// A structure that traces the picture and counts hits.
struct Contestant<'a> {
    name: &'static str,
    trace: CountHits<'a>,
    times: Times,
}

/// Prints a row for each model and structure.
pub fn print(paths: &[String], kind: Kind) -> Result<()> {
    println!(
        "| model | triangles | structure | Mrays/s, median | best | of BVH |\n|---|---|---|---|---|---|"
    );
    models::each(paths, |model| {
        rows(model, kind)?;
        model.published().into_iter().for_each(|model| published_rows(model, kind));
        Ok(())
    })?;
    models::unmatched(paths).into_iter().for_each(|model| published_rows(model, kind));
    let order = match kind {
        Kind::Single => "one by one in scan-line order",
        Kind::Packet => {
            "in packets of 2 x 2 pixels; a multi-BVH has none and traces the same rays one by one in that order"
        }
    };
    let about = format!(
        "Camera rays of a picture of {PICTURE_SIDE} x {PICTURE_SIDE}, {order}; million a second of one thread's \
         processor time, closest hit, {ROUNDS} rounds of all structures in turn. The last column is \
         the median speed beside the first row's in the same round."
    );
    models::print_notes(paths, &about);
    Ok(())
}

fn rows(model: &Model, kind: Kind) -> Result<()> {
    let built = Contestants::build(&model.mesh);
    let single_triangles = built.single_triangles();
    let mut contestants = Vec::new();
    let mut add = |name, trace| contestants.push(Contestant { name, trace, times: Times::default() });
    built.for_each(|name, structure| {
        add(
            name,
            match kind {
                Kind::Single => Box::new(|rays: &[Ray]| structure.count_hits(rays)),
                Kind::Packet => Box::new(|rays: &[Ray]| structure.count_hits_of_packets(rays)),
            },
        );
    });
    if kind == Kind::Single {
        add("multi-BVH, single triangles", Box::new(|rays| single_triangles.count_hits(rays)));
    }
    add(OURS, Box::new(|rays| ours(model, kind, rays)));
    compete(model, kind, &mut contestants)?;
    let rays = (PICTURE_SIDE * PICTURE_SIDE) as f64 / 1e6;
    let base = contestants.iter().find(|c| c.name == BASE).map(|c| c.times.clone()).unwrap_or_default();
    for Contestant { name, times, .. } in &contestants {
        println!(
            "| {} | {} | {name} | {:.2} | {:.2} | {:.2} |",
            model.name,
            model.triangles(),
            rays / times.median(),
            rays / times.best(),
            base.ratio_to(times),
        );
    }
    Ok(())
}

/// Lets all trace the picture in turn.
fn compete(model: &Model, kind: Kind, contestants: &mut [Contestant]) -> Result<()> {
    let rays = picture(&model.scene, PICTURE_SIDE);
    let rays = if kind == Kind::Packet { in_blocks(&rays, PICTURE_SIDE, 2) } else { rays };
    let expected = ours(model, Kind::Single, &rays);
    for _ in 0..ROUNDS {
        for contestant in &mut *contestants {
            let begin = thread_time();
            let hits = (contestant.trace)(&rays);
            contestant.times.push(thread_time() - begin);
            // All but some at borders: a structure that loses hits is no match.
            let allowed = 10 + rays.len() / 1000;
            ensure!(hits.abs_diff(expected) <= allowed, "{}: {hits} hits, not {expected}", contestant.name);
        }
    }
    Ok(())
}

/// How many of `rays` hit in our own structure.
fn ours(model: &Model, kind: Kind, rays: &[Ray]) -> usize {
    let mut tracer = Tracer::new(&model.scene);
    let mut hits = vec![Hit::MISS; rays.len()];
    match kind {
        Kind::Single => tracer.intersect_batch(rays, &mut hits),
        Kind::Packet => tracer.intersect_packet(rays, &mut hits),
    }
    hits.iter().filter(|hit| hit.is_hit()).count()
}

fn published_rows(model: &published::Model, kind: Kind) {
    let [strips, bvh] = if kind == Kind::Single { model.single_fps } else { model.packet_fps };
    for (name, fps) in [("BVH", bvh), ("Ray-Strips", strips)] {
        println!(
            "| paper: {} | {} | {name} | {:.2} | | {:.2} |",
            model.name,
            model.triangles,
            million_rays(fps),
            fps / bvh
        );
    }
}
