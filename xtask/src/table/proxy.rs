//! Simplification to 2 %: triangles left, distances both ways, and processor time, beside meshoptimizer.

use crate::clock::thread_time;
use anyhow::{Context, Result};
use glam::Vec3;
use meshopt::{SimplifyOptions, VertexDataAdapter};
use raystrips_geom::Aabb;
use raystrips_meshio::{ImportOptions, TriangleBatch, TriangleSink, import};
use raystrips_simplify::{Piece, Target, measure, simplify, weld};
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Part of the triangles to keep.
const KEPT: f64 = 0.02;
/// Points on each surface whose distance is measured.
const POINTS: usize = 1_000_000;

/// What simplifies a mesh.
type Simplify = fn(Mesh, usize) -> Mesh;

/// All that is compared, in the order of rows.
const CONTESTANTS: [(&str, Simplify); 4] = [
    ("this program", ours),
    ("meshoptimizer, simplify", meshopt_simplify),
    ("meshoptimizer, simplify with update", meshopt_update),
    ("meshoptimizer, sloppy", meshopt_sloppy),
];

/// Triangles that share vertices.
#[derive(Clone, Default)]
struct Mesh {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    geometries: Vec<u32>,
}

/// Prints a row for each model and contestant.
pub fn print(paths: &[String]) -> Result<()> {
    println!(
        "| model | triangles | by | left | of asked | mean % | RMS % | max % | of simplify: mean | max | s | Mtri/s |\n\
         |---|---|---|---|---|---|---|---|---|---|---|---|"
    );
    for path in paths {
        rows(Path::new(path))?;
    }
    println!(
        "\nTo {} %; distances both ways in percent of the diagonal, {POINTS} points on each surface; processor time of \
         one thread.",
        KEPT * 100.0
    );
    Ok(())
}

fn rows(path: &Path) -> Result<()> {
    let mesh = read(path).with_context(|| format!("cannot read {}", path.display()))?;
    let asked = (mesh.triangles.len() as f64 * KEPT) as usize;
    let diagonal = f64::from(Aabb::of_points(mesh.positions.iter().copied()).diagonal());
    let results = CONTESTANTS.map(|(_, simplify)| timed(&mesh, asked, simplify));
    let measured = results.each_ref().map(|(simplified, _)| {
        let [a, b] = [&mesh, simplified].map(|mesh| (mesh.positions.as_slice(), mesh.triangles.as_slice()));
        if b.1.is_empty() { Default::default() } else { measure(a, b, POINTS) }
    });
    let reference = measured[1];
    for (((name, _), (simplified, time)), distances) in CONTESTANTS.iter().zip(&results).zip(&measured) {
        let percent = |distance: f64| distance / diagonal * 100.0;
        let left = simplified.triangles.len();
        println!(
            "| {} | {} | {name} | {left} | {:.3} | {:.4} | {:.4} | {:.3} | {:.2} | {:.2} | {:.3} | {:.2} |",
            path.file_stem().unwrap_or_default().display(),
            mesh.triangles.len(),
            left as f64 / asked as f64,
            percent(distances.mean),
            percent(distances.rms),
            percent(distances.max),
            distances.mean / reference.mean,
            distances.max / reference.max,
            time.as_secs_f64(),
            mesh.triangles.len() as f64 / time.as_secs_f64() / 1e6,
        );
    }
    Ok(())
}

fn timed(mesh: &Mesh, asked: usize, simplify: Simplify) -> (Mesh, Duration) {
    let mesh = mesh.clone();
    let begin = thread_time();
    let simplified = simplify(mesh, asked);
    (simplified, thread_time() - begin)
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

/// Reads a model and makes positions that are equal one vertex.
fn read(path: &Path) -> Result<Mesh> {
    let mut read = Read::default();
    import(&[PathBuf::from(path)], &ImportOptions::default(), &mut read)?;
    let Piece { positions, triangles, geometries, .. } = weld(&read.0);
    Ok(Mesh { positions, triangles, geometries })
}

/// Takes in the batches of a model.
#[derive(Default)]
struct Read(Piece);

impl TriangleSink for Read {
    fn batch(&mut self, batch: TriangleBatch) -> io::Result<()> {
        let first = self.0.positions.len() as u32;
        self.0.positions.extend(batch.positions.iter().map(|p| glam::DVec3::from_array(*p).as_vec3()));
        self.0.geometries.extend(batch.triangles.iter().map(|_| batch.geometry));
        self.0.triangles.extend(batch.triangles.iter().map(|t| t.map(|v| first + v)));
        Ok(())
    }
}
