//! `raystrips info`.

use super::print_json;
use crate::args::InfoArgs;
use crate::units::{bytes, grouped};
use anyhow::{Context, Result};
use raystrips_pack::{Manifest, Pack};
use serde_json::{Value, json};
use std::fs::File;
use std::io::Write;

/// Tells what is in a pack.
pub fn run(args: &InfoArgs) -> Result<()> {
    let open = || -> Result<Pack> { Ok(Pack::open(&mut File::open(&args.pack)?)?) };
    let pack = open().with_context(|| args.pack.display().to_string())?;
    if args.json {
        return print_json(&describe(&pack.manifest, pack.file_bytes));
    }
    let mut out = std::io::stdout();
    for (name, value) in lines(&pack.manifest, pack.file_bytes) {
        writeln!(out, "{name:>16}  {value}")?;
    }
    Ok(())
}

/// The JSON that `info` and `convert` share.
pub fn describe(manifest: &Manifest, file_bytes: u64) -> Value {
    let bytes = &manifest.bytes;
    let other = file_bytes.saturating_sub(bytes.tracing() - bytes.page_overhead + bytes.materials);
    json!({
        "triangles": manifest.triangles,
        "vertices": manifest.vertices,
        "strips": manifest.strips,
        "triangles_per_strip": manifest.triangles as f64 / manifest.strips.max(1) as f64,
        "clusters": manifest.clusters,
        "pages": manifest.pages,
        "bytes": {
            "file": file_bytes,
            "vertices": bytes.vertices,
            "indices": bytes.indices,
            "strip_trees": bytes.strip_trees,
            "nodes": bytes.nodes,
            "materials": bytes.materials,
            "other": other,
            "proxy": 0,
        },
        "bytes_per_triangle": manifest.bytes_per_triangle(),
        "proxy": {"triangles": 0},
        "bounds": {"min": manifest.bounds_min, "max": manifest.bounds_max},
        "scene_offset": manifest.scene_offset,
        "position_error": manifest.position_error,
        "dropped": {
            "degenerate": manifest.dropped.degenerate,
            "non_finite": manifest.dropped.non_finite,
            "out_of_range": manifest.dropped.out_of_range,
        },
        "depth": manifest.depth,
        "id_bytes": manifest.id_bytes,
        "geometries": manifest.scene.geometries.len(),
        "materials": manifest.scene.materials.len(),
        "lights": manifest.scene.lights.len(),
        "cameras": manifest.scene.cameras.len(),
        "generator": manifest.generator,
    })
}

fn lines(manifest: &Manifest, file_bytes: u64) -> Vec<(&'static str, String)> {
    let per_triangle = |n: u64| format!("{:.2}", n as f64 / manifest.triangles.max(1) as f64);
    let counts = &manifest.bytes;
    let scene = &manifest.scene;
    let dropped = &manifest.dropped;
    let mut lines = vec![
        ("triangles", format!("{}, {} vertices", grouped(manifest.triangles), grouped(manifest.vertices))),
        (
            "strips",
            format!(
                "{}, {:.2} triangles each",
                grouped(manifest.strips),
                manifest.triangles as f64 / manifest.strips.max(1) as f64
            ),
        ),
        ("pages", format!("{}, {} clusters", grouped(manifest.pages), grouped(manifest.clusters))),
        ("file", bytes(file_bytes)),
        (
            "bytes/triangle",
            format!(
                "{:.2}: vertices {}, indices {}, strip trees {}, nodes {}, headers and padding {}",
                manifest.bytes_per_triangle(),
                per_triangle(counts.vertices),
                per_triangle(counts.indices),
                per_triangle(counts.strip_trees),
                per_triangle(counts.nodes),
                per_triangle(counts.page_overhead),
            ),
        ),
        ("bounds", format!("{:?} to {:?}", manifest.bounds_min, manifest.bounds_max)),
        (
            "scene",
            format!(
                "{} geometries, {} materials, {} lights, {} cameras",
                scene.geometries.len(),
                scene.materials.len(),
                scene.lights.len(),
                scene.cameras.len()
            ),
        ),
        ("original ids", if manifest.id_bytes > 0 { "kept" } else { "not kept" }.into()),
        ("written by", manifest.generator.clone()),
    ];
    if manifest.position_error > 0.0 {
        lines.push(("position error", format!("{:e} at most, on each axis", manifest.position_error)));
    }
    if manifest.scene_offset != [0.0; 3] {
        lines.push(("scene offset", format!("{:?}", manifest.scene_offset)));
    }
    if *dropped != Default::default() {
        let text = format!(
            "{} without area, {} not finite, {} out of range",
            grouped(dropped.degenerate),
            grouped(dropped.non_finite),
            grouped(dropped.out_of_range)
        );
        lines.push(("dropped", text));
    }
    lines
}
