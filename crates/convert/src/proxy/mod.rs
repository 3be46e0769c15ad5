//! A mesh of fewer triangles that looks like the model from afar, whatever the size of the model.

mod allotment;
mod distances;
mod levels;
mod locks;
mod method;
mod packed;
mod piece;

pub(crate) use levels::{Level, Levels};
pub use method::SimplifyMethod;
pub use packed::PackProxies;
pub(crate) use packed::{FirstLevel, PackedProxy, ProxyGoal};
pub(crate) use piece::Simplified;

use crate::block::Block;
use crate::distribute::Pieces;
use crate::import::Imported;
use crate::job::{Found, Job};
use crate::report::Clock;
use crate::strands::{SortedStrands, StrandThinning};
use crate::{Conversion, ConvertError, ConvertParams, ImportOptions, Observer, Plan, offset};
use glam::Vec3;
use raystrips_extmem::MemoryBudget;
use raystrips_geom::Aabb;
use raystrips_geom::scene::SceneDesc;
use raystrips_simplify::Distances;
use raystrips_strips::Mesh;
use std::path::{Path, PathBuf};

/// Memory that a triangle of a proxy takes while all of them are made one mesh.
const TRIANGLE_BYTES: u64 = 80;

/// How large a proxy is to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ProxySize {
    /// As a share of the triangles of the input.
    Ratio(f64),
    /// In triangles.
    Triangles(u64),
}

impl ProxySize {
    /// Triangles of the proxy of a model of so many: at least one.
    fn triangles(self, of: u64) -> u64 {
        let wanted = match self {
            ProxySize::Ratio(ratio) => (of as f64 * ratio).round() as u64,
            ProxySize::Triangles(triangles) => triangles,
        };
        wanted.clamp(1, of.max(1))
    }
}

/// Parameters of [`proxy`].
#[derive(Clone, Debug)]
pub struct ProxyParams {
    /// How large it is to be.
    pub size: ProxySize,
    /// How to simplify.
    pub method: SimplifyMethod,
    /// How the model is read and gathered: what to do where files leave a choice, memory, scratch files.
    pub convert: ConvertParams,
    /// Points on each surface at which the distance to the other is measured; 0 to measure nothing.
    pub measured_points: usize,
}

impl ProxyParams {
    /// Memory for the proxy of a model of so many triangles when all of it is there, and for what is measured then.
    fn bytes_at_the_end(&self, triangles: u64) -> u64 {
        let points = self.measured_points as u64;
        let measuring = if points > 0 { distances::TRIANGLE_BYTES } else { 0 };
        self.size.triangles(triangles) * (TRIANGLE_BYTES + measuring) + points * distances::POINT_BYTES
    }
}

/// Geometry of a strand, and its points with their radii.
pub type Strand = (u32, Vec<(Vec3, f32)>);

/// A simplified mesh.
#[derive(Clone, Debug)]
pub struct Proxy {
    /// Vertices, less the offset.
    pub positions: Vec<Vec3>,
    /// Corners as vertices.
    pub triangles: Vec<[u32; 3]>,
    /// Geometry of each triangle.
    pub geometries: Vec<u32>,
    /// Strands that were left, and made thicker.
    pub strands: Vec<Strand>,
    /// Geometries and materials.
    pub scene: SceneDesc,
    /// What to add to all positions.
    pub offset: [f64; 3],
    /// Triangles of the input that have an area.
    pub input_triangles: u64,
    /// Segments of strands of the input.
    pub input_segments: u64,
    /// Pieces that the input was divided into.
    pub pieces: usize,
    /// Diagonal of the input's box.
    pub diagonal: f64,
    /// Distances between the surfaces in scene units, if they were measured.
    pub distances: Option<Distances>,
    /// Things worth knowing about the input, a line each.
    pub warnings: Vec<String>,
}

/// Simplifies `inputs`, all placed into one scene. Scratch files are beside `output`, which is not written. The same
/// inputs and parameters give the same mesh, whatever the memory and the number of threads.
pub fn proxy(
    inputs: &[PathBuf],
    output: &Path,
    params: &ProxyParams,
    observer: &dyn Observer,
) -> Result<Proxy, ConvertError> {
    let import = ImportOptions { bare: true, instances: false, ..params.convert.import.clone() };
    let convert = ConvertParams { import, ..params.convert.clone() };
    let plan = Plan::new(inputs, output, &convert)?;
    plan.check_memory(params.bytes_at_the_end(plan.triangles))?;
    observer.planned(&plan);
    let (mut job, found) = Job::open(inputs, output, &convert)?;
    let conversion = Conversion { inputs, output, params: &convert, plan: &plan, observer };
    job.run(|job| conversion.simplify(job, found, params))
}

impl Conversion<'_> {
    /// Levels of simplification of a mesh in `bounds`.
    pub(crate) fn levels<'a>(
        &'a self,
        job: &'a Job,
        budget: Option<&'a MemoryBudget>,
        bounds: Aabb,
    ) -> Levels<'a> {
        Levels {
            folder: job.scratch_path(),
            budget,
            sort_memory: self.plan.sort_memory(),
            pieces_at_a_time: self.plan.pieces_at_a_time,
            batches_at_a_time: self.plan.batches_at_a_time(),
            bounds,
            observer: self.observer,
        }
    }

    fn simplify(&self, job: &mut Job, mut found: Found, params: &ProxyParams) -> Result<Proxy, ConvertError> {
        let budget = self.budget();
        let (imported, gathered) = self.gather(job, &mut found, budget.as_ref(), &mut Clock::new())?;
        let primitives = gathered.primitives();
        let kept = params.size.triangles(primitives) as f64 / primitives.max(1) as f64;
        let mut mesh = Mesh::default();
        let mut distances = None;
        if let Some(pieces) = &gathered.triangles {
            let wanted = ((pieces.triangles() as f64 * kept).round() as u64).max(1);
            let levels = self.levels(job, budget.as_ref(), pieces.tree.bounds());
            let first = levels.first(pieces, params.method, wanted)?;
            let blocks = levels.reduce(levels.simplify(pieces, &first)?, wanted)?;
            mesh = blocks.weld()?.mesh;
            if params.measured_points > 0 {
                distances = Some(distances::between(pieces, &mesh, params.measured_points, self.observer)?);
            }
        }
        let strands = match &gathered.strands {
            Some(pieces) => thinned_strands(pieces, StrandThinning::new(kept))?,
            None => Vec::new(),
        };
        let Imported { scene, warnings, bounds, .. } = imported;
        Ok(Proxy {
            positions: mesh.positions,
            triangles: mesh.triangles,
            geometries: mesh.geometries,
            strands,
            scene,
            offset: offset::placement(&bounds).offset,
            input_triangles: gathered.triangles.as_ref().map_or(0, Pieces::triangles),
            input_segments: gathered.strands.as_ref().map_or(0, Pieces::primitives),
            pieces: gathered.piece_count(),
            diagonal: f64::from(gathered.bounds().diagonal()),
            distances,
            warnings,
        })
    }
}

/// The strands of `pieces` that stay, in the order of the input.
fn thinned_strands(pieces: &Pieces, thinning: StrandThinning) -> Result<Vec<Strand>, ConvertError> {
    let mut sorted = SortedStrands::default();
    for number in 0..pieces.sources.len() {
        pieces.for_each_part(number, |bytes| {
            Block::all(bytes).try_for_each(|block| {
                let block = block?;
                let selected = thinning.apply(&block, StrandThinning::default());
                sorted.add(&selected.block(block.geometry(), block.first_id()))
            })
        })?;
    }
    Ok(sorted.finish())
}
