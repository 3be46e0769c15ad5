//! Simplification in memory and in one piece, each in a process of its own so that its memory is known.

use super::mesh_file::Mesh;
use crate::clock::thread_time;
use anyhow::{Context, Result, bail};
use glam::Vec3;
use meshopt::{SimplifyOptions, VertexDataAdapter};
use raystrips_extmem::peak_process_memory;
use raystrips_geom::Aabb;
use raystrips_simplify::{Piece, Target, simplify};
use serde_json::json;
use std::path::Path;
use std::process::ExitCode;

/// Simplifies a mesh to so many triangles.
type Kernel = fn(Mesh, usize) -> Mesh;

/// All there are, by the names of `cargo xtask simplify`.
const KERNELS: [(&str, Kernel); 4] = [
    ("ours", ours),
    ("meshopt", meshopt_simplify),
    ("meshopt-update", meshopt_update),
    ("meshopt-sloppy", meshopt_sloppy),
];

/// `cargo xtask simplify KERNEL IN OUT.ply TRIANGLES`: prints a JSON object about it.
pub fn task(_root: &Path, arguments: &[String]) -> Result<ExitCode> {
    let [name, input, output, triangles] = arguments else {
        bail!("usage: cargo xtask simplify {} IN OUT.ply TRIANGLES", KERNELS.map(|k| k.0).join("|"));
    };
    let Some((_, kernel)) = KERNELS.iter().find(|(known, _)| known == name) else {
        bail!("there is no kernel '{name}'");
    };
    let triangles = triangles.parse().context("TRIANGLES is no number")?;
    let mesh = Mesh::read(Path::new(input))?;
    let begin = thread_time();
    let simplified = kernel(mesh, triangles);
    let seconds = (thread_time() - begin).as_secs_f64();
    simplified.write(Path::new(output))?;
    println!("{}", json!({"seconds_cpu": seconds, "peak_rss_bytes": peak_process_memory()}));
    Ok(ExitCode::SUCCESS)
}

fn ours(mesh: Mesh, asked: usize) -> Mesh {
    let bounds = Aabb::of_points(mesh.positions.iter().copied());
    let piece = Piece {
        positions: mesh.positions,
        triangles: mesh.triangles,
        geometries: mesh.geometries,
        origin: bounds.center().as_dvec3(),
        ..Piece::default()
    };
    let Piece { positions, triangles, geometries, .. } = simplify(piece, Target::triangles(asked)).piece;
    Mesh { positions, triangles, geometries }
}

/// A weld leaves no seams, and small parts may go.
const OPTIONS: SimplifyOptions = SimplifyOptions::Prune;

fn meshopt_simplify(mesh: Mesh, asked: usize) -> Mesh {
    let indices = {
        let bytes = bytes_of(&mesh.positions);
        let vertices = adapter(&bytes);
        meshopt::simplify(mesh.triangles.as_flattened(), &vertices, asked * 3, f32::MAX, OPTIONS, None)
    };
    with_indices(mesh.positions, &indices)
}

fn meshopt_update(mesh: Mesh, asked: usize) -> Mesh {
    let mut indices = mesh.triangles.as_flattened().to_vec();
    let mut positions: Vec<[f32; 3]> = mesh.positions.iter().map(Vec3::to_array).collect();
    let left = meshopt::simplify_with_update(
        &mut indices,
        &mut positions,
        &mut [],
        &[],
        0,
        None,
        asked * 3,
        f32::MAX,
        OPTIONS,
        None,
    );
    with_indices(positions.into_iter().map(Vec3::from_array).collect(), &indices[..left])
}

fn meshopt_sloppy(mesh: Mesh, asked: usize) -> Mesh {
    let indices = {
        let bytes = bytes_of(&mesh.positions);
        meshopt::simplify_sloppy(mesh.triangles.as_flattened(), &adapter(&bytes), asked * 3, f32::MAX, None)
    };
    with_indices(mesh.positions, &indices)
}

fn with_indices(positions: Vec<Vec3>, indices: &[u32]) -> Mesh {
    let triangles = indices.as_chunks::<3>().0.to_vec();
    Mesh { positions, geometries: vec![0; triangles.len()], triangles }
}

fn bytes_of(positions: &[Vec3]) -> Vec<u8> {
    positions.iter().flat_map(|p| p.to_array()).flat_map(f32::to_ne_bytes).collect()
}

fn adapter(bytes: &[u8]) -> VertexDataAdapter<'_> {
    VertexDataAdapter::new(bytes, size_of::<[f32; 3]>(), 0).expect("whole positions")
}
