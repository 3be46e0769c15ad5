//! A mesh of fewer triangles that looks like the model from afar. It is simplified in one piece in memory; models
//! that do not fit the budget are refused.

use crate::block::{self, Block};
use crate::mesh::{Welded, has_area};
use crate::offset::{self, Placement};
use crate::positions::{Positions, ToPack};
use crate::{ConvertError, Observer, Stage, import};
use glam::{DVec3, Vec3};
use raystrips_extmem::{MemoryBudget, Spool, spare_memory};
use raystrips_geom::Aabb;
use raystrips_geom::scene::SceneDesc;
use raystrips_meshio::{ImportOptions, survey};
use raystrips_simplify::{Distances, Piece, Target, measure, simplify};
use raystrips_strips::Mesh;
use std::path::{Path, PathBuf};

/// Memory at the most, a triangle of the input: measured.
const TRIANGLE_BYTES: u64 = 280;
/// The program and its buffers.
const BASE_BYTES: u64 = 64 << 20;

/// How large a proxy is to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ProxySize {
    /// As a share of the triangles of the input.
    Ratio(f64),
    /// In triangles.
    Triangles(u64),
}

/// Parameters of [`proxy`].
#[derive(Clone, Debug)]
pub struct ProxyParams {
    /// How large it is to be.
    pub size: ProxySize,
    /// What to do where files leave a choice.
    pub import: ImportOptions,
    /// Bytes of memory that the whole process keeps to; by default half of what is free.
    pub memory: Option<u64>,
    /// Points on each surface at which the distance to the other is measured; 0 to measure nothing.
    pub measured_points: usize,
}

/// A simplified mesh.
#[derive(Clone, Debug)]
pub struct Proxy {
    /// Vertices, less the offset.
    pub positions: Vec<Vec3>,
    /// Corners as vertices.
    pub triangles: Vec<[u32; 3]>,
    /// Geometry of each triangle.
    pub geometries: Vec<u32>,
    /// Geometries and materials.
    pub scene: SceneDesc,
    /// What to add to all positions.
    pub offset: [f64; 3],
    /// Triangles of the input that have an area.
    pub input_triangles: u64,
    /// Diagonal of the input's box.
    pub diagonal: f64,
    /// Distances between the surfaces in scene units, if they were measured.
    pub distances: Option<Distances>,
    /// Things worth knowing about the input, a line each.
    pub warnings: Vec<String>,
}

/// Simplifies `inputs`, all placed into one scene.
pub fn proxy(
    inputs: &[PathBuf],
    params: &ProxyParams,
    observer: &dyn Observer,
) -> Result<Proxy, ConvertError> {
    let given = params.memory.or_else(spare_memory).unwrap_or(u64::MAX);
    let least = BASE_BYTES + survey(inputs)?.triangles * TRIANGLE_BYTES;
    if given < least {
        return Err(ConvertError::TooLittleMemory { given, least });
    }
    // It never gets to the disk.
    let spool = Spool::new(Path::new(""), Some(&MemoryBudget::new(u64::MAX)));
    let (imported, spool) = import::import(inputs, &params.import, spool, observer)?;
    let placement = offset::placement(&imported.bounds);
    let blocks = imported.blocks(spool, 2 * rayon::current_num_threads());
    let to_pack = ToPack::new(&placement, Positions::Exact);
    let mut welded = Welded::with_capacity(imported.triangles as usize);
    blocks.for_each(
        Stage::Partition,
        observer,
        |block| in_place(&block, &to_pack),
        |bytes| welded.add(&bytes).map_err(ConvertError::Scratch),
    )?;
    drop(blocks);
    let mesh = welded.finish().mesh;
    if mesh.triangles.is_empty() {
        let path = inputs.first().cloned().unwrap_or_default();
        return Err(ConvertError::NoArea { path, triangles: imported.triangles });
    }
    let mut proxy = simplified(mesh, &placement, params);
    proxy.scene = imported.scene;
    proxy.warnings = imported.warnings;
    Ok(proxy)
}

/// The triangles of a block that have an area, where they are in the pack.
fn in_place(block: &Block, to_pack: &ToPack) -> Vec<u8> {
    let positions: Vec<Vec3> = block.positions().map(|p| to_pack.place(p)).collect();
    let triangles: Vec<[u32; 3]> =
        block.triangles().filter(|t| has_area(t.map(|v| positions[v as usize]))).collect();
    block::of_triangles(block.geometry(), block.first_id(), &positions, &triangles, &[])
}

fn simplified(mesh: Mesh, placement: &Placement, params: &ProxyParams) -> Proxy {
    let input_triangles = mesh.triangles.len() as u64;
    let wanted = match params.size {
        ProxySize::Ratio(ratio) => (input_triangles as f64 * ratio).round() as u64,
        ProxySize::Triangles(triangles) => triangles,
    };
    let bounds = Aabb::of_points(mesh.positions.iter().copied());
    let original = (params.measured_points > 0).then(|| (mesh.positions.clone(), mesh.triangles.clone()));
    let piece = Piece {
        origin: DVec3::from(bounds.center()),
        positions: mesh.positions,
        triangles: mesh.triangles,
        geometries: mesh.geometries,
        ..Piece::default()
    };
    let piece = simplify(piece, Target::triangles(wanted.clamp(1, input_triangles) as usize)).piece;
    let distances = original.map(|(positions, triangles)| {
        measure((&positions, &triangles), (&piece.positions, &piece.triangles), params.measured_points)
    });
    Proxy {
        positions: piece.positions,
        triangles: piece.triangles,
        geometries: piece.geometries,
        scene: SceneDesc::default(),
        offset: placement.offset,
        input_triangles,
        diagonal: f64::from(bounds.diagonal()),
        distances,
        warnings: Vec::new(),
    }
}
