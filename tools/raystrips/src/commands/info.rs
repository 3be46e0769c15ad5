//! `raystrips info`.

use super::print_json;
use crate::args::InfoArgs;
use crate::units::{bytes, grouped};
use anyhow::{Context, Result};
use raystrips_convert::ProxyReport;
use raystrips_pack::{ByteCounts, Manifest, Pack, ProxyKind};
use serde_json::{Value, json};
use std::fs::File;
use std::io::Write;
use std::path::Path;

/// Tells what is in a pack.
pub fn run(args: &InfoArgs) -> Result<()> {
    let (pack, proxies) = open(&args.pack).with_context(|| args.pack.display().to_string())?;
    if args.json {
        return print_json(&describe(&pack.manifest, pack.file_bytes, &proxies));
    }
    let mut out = std::io::stdout();
    for (name, value) in lines(&pack.manifest, pack.file_bytes, &proxies) {
        writeln!(out, "{name:>16}  {value}")?;
    }
    Ok(())
}

/// A pack with what proxies it has, the largest first.
fn open(path: &Path) -> Result<(Pack, Vec<ProxyReport>)> {
    let mut file = File::open(path)?;
    let pack = Pack::open(&mut file)?;
    let mut proxies = Vec::new();
    for kind in ProxyKind::ALL {
        if let Some(proxy) = pack.open_proxy(&mut file, kind)? {
            proxies.push(ProxyReport { triangles: proxy.manifest.primitives, bytes: proxy.file_bytes });
        }
    }
    Ok((pack, proxies))
}

/// The JSON that `info` and `convert` share.
pub fn describe(manifest: &Manifest, file_bytes: u64, proxies: &[ProxyReport]) -> Value {
    let (bytes, strand_bytes) = (&manifest.bytes, &manifest.strand_bytes);
    let proxy_bytes: u64 = proxies.iter().map(|proxy| proxy.bytes).sum();
    let shading = bytes.materials + bytes.attributes + bytes.textures;
    let named = bytes.tracing() - bytes.page_overhead + shading + proxy_bytes;
    let other = file_bytes.saturating_sub(named);
    let proxy_triangles = |i: usize| proxies.get(i).map_or(0, |proxy| proxy.triangles);
    json!({
        "triangles": manifest.triangles(),
        "segments": manifest.segments,
        "instances": manifest.instances,
        "shown": manifest.shown,
        "vertices": manifest.vertices,
        "strips": manifest.strips,
        "triangles_per_strip": manifest.primitives as f64 / manifest.strips.max(1) as f64,
        "clusters": manifest.clusters,
        "pages": manifest.pages,
        "bytes": {
            "file": file_bytes,
            "vertices": bytes.vertices,
            "indices": bytes.indices,
            "strip_trees": bytes.strip_trees,
            "nodes": bytes.nodes,
            "materials": bytes.materials,
            "attributes": bytes.attributes,
            "textures": bytes.textures,
            "other": other,
            "proxy": proxy_bytes,
        },
        "bytes_per_triangle": manifest.bytes_per_triangle(),
        "bytes_per_segment": manifest.bytes_per_segment(),
        "strand_bytes": {
            "vertices": strand_bytes.vertices,
            "indices": strand_bytes.indices,
            "nodes": strand_bytes.nodes,
        },
        "proxy": {"triangles": proxy_triangles(0), "coarse_triangles": proxy_triangles(1)},
        "bounds": {"min": manifest.bounds_min, "max": manifest.bounds_max},
        "scene_offset": manifest.scene_offset,
        "position_error": manifest.position_error,
        "radius_error": manifest.radius_error,
        "dropped": {
            "degenerate": manifest.dropped.degenerate,
            "non_finite": manifest.dropped.non_finite,
            "out_of_range": manifest.dropped.out_of_range,
        },
        "depth": manifest.depth,
        "id_bytes": manifest.id_bytes,
        "geometries": manifest.scene.geometries.len(),
        "materials": manifest.scene.materials.len(),
        "textures": manifest.scene.textures.len(),
        "images": manifest.scene.images.len(),
        "lights": manifest.scene.lights.len(),
        "cameras": manifest.scene.cameras.len(),
        "generator": manifest.generator,
    })
}

fn lines(manifest: &Manifest, file_bytes: u64, proxies: &[ProxyReport]) -> Vec<(&'static str, String)> {
    let scene = &manifest.scene;
    let dropped = &manifest.dropped;
    let per_strip = manifest.primitives as f64 / manifest.strips.max(1) as f64;
    let mut lines = vec![
        ("triangles", format!("{}, {} vertices", grouped(manifest.triangles()), grouped(manifest.vertices))),
        ("strips", format!("{}, {per_strip:.2} triangles or segments each", grouped(manifest.strips))),
        ("pages", format!("{}, {} clusters", grouped(manifest.pages), grouped(manifest.clusters))),
        ("file", bytes(file_bytes)),
    ];
    if manifest.instances > 0 {
        lines.insert(1, ("instances", shown(manifest)));
    }
    if manifest.segments > 0 {
        lines.insert(1, ("hair", format!("{} segments of strands", grouped(manifest.segments))));
    }
    if manifest.triangles() > 0 {
        let counts = manifest.bytes.without(&manifest.strand_bytes);
        lines.push(("bytes/triangle", shares(&counts, manifest.triangles())));
    }
    if manifest.segments > 0 {
        lines.push(("bytes/segment", shares(&manifest.strand_bytes, manifest.segments)));
    }
    if manifest.bytes.attributes > 0 {
        let each = manifest.bytes.attributes as f64 / manifest.triangles().max(1) as f64;
        let text = format!("normals, texture coordinates, colors: {each:.2} bytes/triangle beside these");
        lines.push(("attributes", text));
    }
    if !scene.images.is_empty() {
        let text = format!(
            "{} of {} images ({})",
            scene.textures.len(),
            scene.images.len(),
            bytes(manifest.bytes.textures)
        );
        lines.push(("textures", text));
    }
    lines.extend([
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
    ]);
    if !proxies.is_empty() {
        let text = |proxy: &ProxyReport| {
            format!("{} triangles and segments ({})", grouped(proxy.triangles), bytes(proxy.bytes))
        };
        lines.push(("proxies", proxies.iter().map(text).collect::<Vec<_>>().join(", ")));
    }
    if manifest.position_error > 0.0 {
        lines.push(("position error", format!("{:e} at most, on each axis", manifest.position_error)));
    }
    if manifest.radius_error > 0.0 {
        lines.push(("radius error", format!("{:.2} % at most", 100.0 * manifest.radius_error)));
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

/// What instances there are.
pub fn shown(manifest: &Manifest) -> String {
    let (count, shown) = (grouped(manifest.instances), grouped(manifest.shown));
    format!("{count} instances, which make it {shown} that are shown")
}

/// What each of `primitives` takes, and for what.
fn shares(counts: &ByteCounts, primitives: u64) -> String {
    let per_primitive = |n: u64| n as f64 / primitives as f64;
    format!(
        "{:.2}: vertices {:.2}, indices {:.2}, strip trees {:.2}, nodes {:.2}, headers and padding {:.2}",
        per_primitive(counts.tracing()),
        per_primitive(counts.vertices),
        per_primitive(counts.indices),
        per_primitive(counts.strip_trees),
        per_primitive(counts.nodes),
        per_primitive(counts.page_overhead),
    )
}
