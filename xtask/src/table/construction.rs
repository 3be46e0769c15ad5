//! The paper's Table 5: time of construction.

use super::contestants::{BASE, RAY_STRIPS, TUNED_RAY_STRIPS};
use super::models::{self, Model};
use crate::clock::{Times, process_time};
use crate::paper::bvh::{Optimized, PlainBvh};
use crate::paper::multi_bvh::MultiBvh;
use crate::paper::published;
use crate::paper::ray_strip::{Params, RayStrips};
use anyhow::{Context, Result};
use raystrips_convert::{ConvertParams, Unobserved, convert};
use std::hint::black_box;
use std::path::Path;

/// Rounds in which everything is built once.
const ROUNDS: usize = 5;

/// Something that is built over a model.
type Build = fn(&Model, &Path) -> Result<()>;

/// All that is built, in the order of rows.
const BUILDS: [(&str, Build); 6] = [
    (BASE, |model, _| {
        black_box(PlainBvh::<Optimized>::build(&model.mesh, 1));
        Ok(())
    }),
    (RAY_STRIPS, |model, _| {
        black_box(RayStrips::build(&model.mesh, Params::PUBLISHED));
        Ok(())
    }),
    (TUNED_RAY_STRIPS, |model, _| {
        black_box(RayStrips::build(&model.mesh, Params::TUNED));
        Ok(())
    }),
    ("multi-BVH", |model, _| {
        black_box(MultiBvh::build(&model.mesh));
        Ok(())
    }),
    ("this program, strips and hierarchy", |model, _| {
        let mesh = raystrips_strips::Mesh {
            positions: model.mesh.positions.clone(),
            triangles: model.mesh.triangles.clone(),
            geometries: vec![0; model.mesh.triangles.len()],
        };
        black_box(raystrips_strips::build(&mesh, &ConvertParams::default().strips, &|_| {}));
        Ok(())
    }),
    ("this program, from file to file", |model, pack| {
        convert(
            std::slice::from_ref(&model.path),
            pack,
            &ConvertParams { proxies: None, ..ConvertParams::default() },
            &Unobserved,
        )?;
        Ok(())
    }),
];

/// Prints a row for each model and structure.
pub fn print(paths: &[String]) -> Result<()> {
    println!(
        "| model | triangles | structure | s, median | best | Mtri/s, median | of BVH |\n|---|---|---|---|---|---|---|"
    );
    let thread = rayon::ThreadPoolBuilder::new().num_threads(1).build().context("cannot start a thread")?;
    let folder = tempfile::tempdir()?;
    models::each(paths, |model| {
        let times = thread.install(|| time(model, &folder.path().join("built.rsp")))?;
        rows(model, &times);
        model.published().into_iter().for_each(published_rows);
        Ok(())
    })?;
    models::unmatched(paths).into_iter().for_each(published_rows);
    let about = format!(
        "Processor time of one thread, {ROUNDS} rounds in turn. All rows of a model but the last begin with the mesh \
         in memory, its triangles in the order of the pack."
    );
    models::print_notes(paths, &about);
    Ok(())
}

fn time(model: &Model, pack: &Path) -> Result<[Times; BUILDS.len()]> {
    let mut times = BUILDS.map(|_| Times::default());
    for _ in 0..ROUNDS {
        for ((_, build), times) in BUILDS.iter().zip(&mut times) {
            let begin = process_time();
            build(model, pack)?;
            times.push(process_time() - begin);
        }
    }
    Ok(times)
}

fn rows(model: &Model, times: &[Times]) {
    for ((name, _), time) in BUILDS.iter().zip(times) {
        println!(
            "| {} | {} | {name} | {:.3} | {:.3} | {:.2} | {:.2} |",
            model.name,
            model.triangles(),
            time.median(),
            time.best(),
            model.triangles() / time.median() / 1e6,
            time.ratio_to(&times[0]),
        );
    }
}

fn published_rows(model: &published::Model) {
    let [strips, bvh] = model.seconds;
    for (name, seconds) in [("BVH", bvh), ("Ray-Strips", strips)] {
        println!(
            "| paper: {} | {} | {name} | {seconds} | | {:.2} | {:.2} |",
            model.name,
            model.triangles,
            model.triangles / seconds / 1e6,
            seconds / bvh
        );
    }
}
