//! Models and scenes to packs, within a declared budget of memory, whatever the size of the input.
//!
//! The stages: [`import`] models to blocks of triangles and strands in a scratch file; [`partition`] space so that each
//! piece fits; [`distribute`] what there is to its pieces; build each [`piece`] and append its pages to the [`output`];
//! join the hierarchies of the pieces at the [`top`]. What is shown many times is a part with pieces of its own, of which
//! there are [`instances`]. Pieces depend on the input alone, so the pack has the same bytes
//! for any number of threads and any budget. What is whole is noted by the [`job`], from which a killed conversion
//! goes on.

mod assemble;
mod attributes;
mod block;
mod blocks;
mod borders;
mod cells;
mod distribute;
mod emitters;
mod flat_tree;
mod forest;
mod gathered;
mod hash;
mod import;
mod instances;
mod job;
mod layout;
mod mesh;
mod offset;
mod output;
mod partition;
mod piece;
mod plan;
mod positions;
mod proxy;
mod queue;
mod report;
mod sidecar;
mod strands;
mod textures;
mod top;

pub use layout::Layout;
pub use plan::Plan;
pub use positions::Positions;
pub use proxy::{PackProxies, Proxy, ProxyParams, ProxySize, SimplifyMethod, Strand, proxy};
pub use raystrips_meshio::{FileStamp, ImportOptions};
pub use raystrips_strips::StripParams;
pub use report::{ConvertError, ConvertReport, Observer, ProxyReport, Stage, Unobserved};

use blocks::Blocks;
use distribute::{Distributed, Pieces};
use forest::Forest;
use gathered::Gathered;
use glam::Vec3;
use import::{Imported, ImportedBlocks};
use job::{Found, Job};
use offset::WorldBounds;
use output::{Output, PieceRecord};
use partition::{Census, Division};
use piece::Kind;
use positions::ToPack;
use proxy::{FirstLevel, ProxyGoal};
use queue::in_order;
use raystrips_extmem::{MemoryBudget, Spool};
use raystrips_geom::{Aabb, RadiusCode};
use raystrips_pack::Manifest;
use report::Clock;
use std::ops::Range;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use textures::Tiles;

/// Most scratch bytes a triangle of an import whose triangles share their vertices with neighbors in the file.
const COHERENT_BYTES: u64 = 30;

/// Parameters of [`convert`].
#[derive(Clone, Debug)]
pub struct ConvertParams {
    /// Bytes of a page to aim at.
    pub page_size: u32,
    /// Order of what is in the pack.
    pub layout: Layout,
    /// Strips.
    pub strips: StripParams,
    /// How positions are kept.
    pub positions: Positions,
    /// Keep the number that each triangle has in the input: 4 or 8 bytes a triangle.
    pub keep_ids: bool,
    /// Proxies to put into the pack.
    pub proxies: Option<PackProxies>,
    /// What to do where files leave a choice. What it says of memory and scratch files is overridden by the below.
    pub import: ImportOptions,
    /// Bytes of memory that the whole process keeps to; by default half of what is free.
    pub memory: Option<u64>,
    /// Folder for scratch files; by default one beside the output.
    pub scratch: Option<PathBuf>,
    /// Begin anew even where an interrupted run of the same conversion could go on.
    pub restart: bool,
}

impl Default for ConvertParams {
    fn default() -> ConvertParams {
        ConvertParams {
            page_size: 64 << 10,
            layout: Layout::default(),
            strips: StripParams::default(),
            positions: Positions::default(),
            keep_ids: false,
            proxies: Some(PackProxies::default()),
            import: ImportOptions { instances: true, ..ImportOptions::default() },
            memory: None,
            scratch: None,
            restart: false,
        }
    }
}

/// Converts `inputs`, all placed into one scene, to the pack `output`. The same inputs and parameters give the same
/// bytes, whatever the memory and the number of threads (that of the current rayon pool).
///
/// Killed, the same call goes on from what was whole. After an error that may pass (an interrupt, a full disk) files
/// for that are kept; after others nothing is left behind.
pub fn convert(
    inputs: &[PathBuf],
    output: &Path,
    params: &ConvertParams,
    observer: &dyn Observer,
) -> Result<ConvertReport, ConvertError> {
    let plan = Plan::new(inputs, output, params)?;
    observer.planned(&plan);
    let (mut job, found) = Job::open(inputs, output, params)?;
    let conversion = Conversion { inputs, output, params, plan: &plan, observer };
    job.run(|job| conversion.run(job, found))
}

/// What all stages know.
struct Conversion<'a> {
    inputs: &'a [PathBuf],
    output: &'a Path,
    params: &'a ConvertParams,
    plan: &'a Plan,
    observer: &'a dyn Observer,
}

impl Conversion<'_> {
    fn run(&self, job: &mut Job, mut found: Found) -> Result<ConvertReport, ConvertError> {
        let mut clock = Clock::new();
        let budget = self.budget();
        let (imported, gathered) = self.gather(job, &mut found, budget.as_ref(), &mut clock)?;
        let instances = instances::placed(&imported);
        let error = instances::position_error(&imported, &instances, &gathered);
        let mut output = Output::open(
            self.output,
            job.files(""),
            self.manifest(&imported, &gathered.census(), error),
            found.pieces,
        )?;
        let goal = ProxyGoal::of(self.params.proxies.as_ref(), &gathered);
        self.build_scene(&imported, &gathered, goal, &mut output, job)?;
        let mut geometry_bounds = gathered.geometry_bounds(imported.scene.geometries.len());
        instances::grow_bounds(&mut geometry_bounds, &instances, &gathered);
        let (bounds, scene_pieces) = (gathered.bounds(), gathered.scene_piece_count());
        let forest = Forest::of(&gathered, instances);
        let triangle_pieces = gathered.triangles.as_ref().map_or(0, |pieces| pieces.sources.len());
        drop(gathered);
        clock.record(Stage::Build);
        let mut proxies = Vec::new();
        if let Some(goal) = goal {
            let levels = self.levels(job, budget.as_ref(), bounds);
            let simplified = |range: Range<usize>| {
                let is_empty = range.is_empty();
                (!is_empty).then(|| output.simplified(range, levels.batches_at_a_time)).transpose()
            };
            let first = FirstLevel {
                triangles: simplified(0..triangle_pieces)?,
                strands: simplified(triangle_pieces..scene_pieces)?,
            };
            proxies = self.pack_proxies(first, goal, &imported, &levels, job)?;
            clock.record(Stage::Simplify);
        }
        let sort_memory = self.plan.sort_memory();
        let Imported { mut warnings, files, images, .. } = imported;
        let tiles = match images.is_empty() {
            true => None,
            false => {
                let (file, scene) = output.images()?;
                Some(Tiles::make(&images, scene, file, sort_memory, &mut warnings)?)
            }
        };
        let (manifest, file_bytes) = output.finish(forest, sort_memory, &geometry_bounds, &proxies, tiles)?;
        clock.record(Stage::Finish);
        let proxies =
            proxies.iter().map(|p| ProxyReport { triangles: p.triangles, bytes: p.bytes }).collect();
        Ok(ConvertReport { manifest, file_bytes, proxies, seconds: clock.seconds, warnings, files })
    }

    /// Memory for what is kept between the stages, if that is not to go to the disk.
    fn budget(&self) -> Option<MemoryBudget> {
        self.plan.is_in_memory().then(|| MemoryBudget::new(self.plan.spool_memory))
    }

    /// Imports the inputs and gathers the triangles of each piece, as far as that was not done before.
    fn gather(
        &self,
        job: &mut Job,
        found: &mut Found,
        budget: Option<&MemoryBudget>,
        clock: &mut Clock,
    ) -> Result<(Imported, Gathered), ConvertError> {
        let imported = found.imported.take();
        let gathered = job.gathered(found);
        let (mut imported, gathered) = match (imported, gathered) {
            (Some(imported), Some(gathered)) => (imported, gathered),
            (imported, _) => {
                let (imported, mut blocks) = self.import(imported, job, budget)?;
                clock.record(Stage::Import);
                if imported.files != found.files {
                    found.pieces.clear();
                }
                // Incoherent input, of which every triangle brings its own vertices, would take as much again: rather
                // import again after a kill than fill the disk.
                let is_consumed = imported.spool_bytes() > COHERENT_BYTES * imported.triangles.max(1);
                blocks.parts.iter_mut().for_each(|part| part.is_consumed = is_consumed);
                if is_consumed && imported.triangles > 0 {
                    job.note_import_gone()?;
                }
                let gathered = self.pieces(&imported, &blocks, job, budget, clock)?;
                drop(blocks);
                job.note_gathered(&gathered, &imported)?;
                (imported, gathered)
            }
        };
        job.remove_import()?;
        imported.dropped.degenerate = gathered.degenerate();
        Ok((imported, gathered))
    }

    /// The import: the earlier one if its triangles are still there.
    fn import(
        &self,
        earlier: Option<Imported>,
        job: &mut Job,
        budget: Option<&MemoryBudget>,
    ) -> Result<(Imported, ImportedBlocks), ConvertError> {
        let at_a_time = self.plan.batches_at_a_time();
        if let Some(imported) = earlier
            && let Some(spool) = job.imported(&imported)
        {
            let blocks = imported.blocks(spool, at_a_time);
            return Ok((imported, blocks));
        }
        let options = ImportOptions {
            scratch: Some(job.scratch_path().to_owned()),
            kept_bytes: self.plan.kept_bytes,
            ..self.params.import.clone()
        };
        let (imported, spool) =
            import::import(self.inputs, &options, job.import_spool(budget), self.observer)?;
        job.note_import(&imported, &spool)?;
        let blocks = imported.blocks(spool, at_a_time);
        Ok((imported, blocks))
    }

    /// Gathers what is in each piece.
    fn pieces(
        &self,
        imported: &Imported,
        blocks: &ImportedBlocks,
        job: &Job,
        budget: Option<&MemoryBudget>,
        clock: &mut Clock,
    ) -> Result<Gathered, ConvertError> {
        let radii = imported.radii.code();
        let mut gather = |blocks: &[Blocks], bounds: &[WorldBounds], mut spool: Spool| {
            let gathered = blocks
                .iter()
                .zip(bounds)
                .map(|(blocks, bounds)| self.distribute(blocks, bounds, radii, &mut spool, clock));
            let gathered = gathered.collect::<Result<Vec<Option<Distributed>>, ConvertError>>()?;
            let spool = Arc::new(spool);
            let pieces = |part: Option<Distributed>| part.map(|part| part.in_spool(spool.clone()));
            Ok::<Vec<Option<Pieces>>, ConvertError>(gathered.into_iter().map(pieces).collect())
        };
        let (scene, parts) = blocks.parts.split_at(1);
        let all = [imported.bounds];
        let triangles = gather(scene, &all, job.triangle_spool(budget))?.pop().flatten();
        let strands = std::slice::from_ref(&blocks.strands);
        let strands = gather(strands, &all, job.strand_spool(budget))?.pop().flatten();
        let bounds: Vec<WorldBounds> = imported.parts[1..].iter().map(|part| part.bounds).collect();
        let parts = gather(parts, &bounds, job.part_spool(budget))?;
        Gathered::new(triangles, strands, parts).ok_or_else(|| ConvertError::NoArea {
            path: self.inputs.first().cloned().unwrap_or_default(),
            triangles: imported.triangles,
        })
    }

    /// Distributes what is in a space with these bounds over its pieces; nothing if there is nothing.
    fn distribute(
        &self,
        blocks: &Blocks,
        bounds: &WorldBounds,
        radii: RadiusCode,
        spool: &mut Spool,
        clock: &mut Clock,
    ) -> Result<Option<Distributed>, ConvertError> {
        if blocks.triangles == 0 {
            return Ok(None);
        }
        let to_pack = ToPack::new(&offset::placement(bounds), self.params.positions, radii);
        let [min, max] = bounds.corners().map(|corner| to_pack.place(corner));
        let division = Division::SurfaceArea;
        let partition = partition::partition(blocks, Aabb { min, max }, &to_pack, division, self.observer)?;
        clock.record(Stage::Partition);
        let Some(partition) = partition else { return Ok(None) };
        let keep_ids = self.params.keep_ids;
        let distributed =
            distribute::distribute(blocks, &partition, &to_pack, keep_ids, spool, self.observer)?;
        clock.record(Stage::Distribute);
        Ok(Some(distributed))
    }

    /// Builds all pieces of the scene that are not in the pack yet, and simplifies them on the way to proxies.
    fn build_scene(
        &self,
        imported: &Imported,
        gathered: &Gathered,
        goal: Option<ProxyGoal>,
        output: &mut Output,
        job: &mut Job,
    ) -> Result<(), ConvertError> {
        let goal = goal.filter(|_| output.piece_count() < gathered.piece_count());
        let levels = self.levels(job, None, gathered.bounds());
        let first_level = match (goal, &gathered.triangles) {
            (Some(goal), Some(pieces)) => Some(levels.first(pieces, SimplifyMethod::Auto, goal.triangles)?),
            _ => None,
        };
        let shines = emitters::shining(&imported.scene);
        let triangles = Kind::Triangles { shines: &shines, first_level: first_level.as_ref() };
        let strands =
            Kind::Strands { radii: imported.radii.code(), thinning: goal.map(|goal| goal.thinning()) };
        let id_bytes = if self.params.keep_ids { imported.id_bytes } else { 0 };
        let in_parts = Kind::Triangles { shines: &shines, first_level: None };
        let contexts = self.contexts(gathered, [triangles, strands, in_parts], id_bytes);
        self.build(gathered, output, &contexts, self.observer, &mut |piece| job.note_piece(piece))
    }

    /// What pieces are built with, those of triangles, of strands and of each part, as far as there are any.
    fn contexts<'a>(
        &'a self,
        gathered: &'a Gathered,
        [triangles, strands, in_parts]: [Kind<'a>; 3],
        id_bytes: u8,
    ) -> Vec<piece::Context<'a>> {
        let parts = gathered.parts.iter().map(|part| (part, in_parts));
        let kinds = [(&gathered.triangles, triangles), (&gathered.strands, strands)].into_iter().chain(parts);
        let context = |(pieces, kind): (&'a Option<Pieces>, Kind<'a>)| {
            pieces.as_ref().map(|pieces| piece::Context {
                params: self.params,
                output: self.output,
                boxes: pieces.tree.leaf_bounds(),
                pieces,
                id_bytes,
                kind,
            })
        };
        kinds.filter_map(context).collect()
    }

    /// Builds all of `gathered` that is not in `output` yet; `contexts` are those of its pieces. `note` gets a
    /// record of each piece.
    fn build(
        &self,
        gathered: &Gathered,
        output: &mut Output,
        contexts: &[piece::Context],
        observer: &dyn Observer,
        note: &mut (dyn FnMut(PieceRecord) -> Result<(), ConvertError> + Send),
    ) -> Result<(), ConvertError> {
        let first_primitives = gathered.first_primitives();
        let begin = output.piece_count();
        let total = gathered.primitives();
        let done = AtomicU64::new(first_primitives.get(begin).copied().unwrap_or(total));
        let finished = |primitives: usize| {
            let before = done.fetch_add(primitives as u64, Ordering::Relaxed);
            observer.progress(Stage::Build, before + primitives as u64, total);
        };
        let begin_of_next = |end: &mut usize, context: &piece::Context| {
            let begin = *end;
            *end += context.pieces.sources.len();
            Some(begin)
        };
        let begins: Vec<usize> = contexts.iter().scan(0, begin_of_next).collect();
        let work = |number: usize| {
            let context = begins.partition_point(|&begin| begin <= number) - 1;
            let place = number - begins[context];
            piece::build(&contexts[context], place, first_primitives[number], &finished)
        };
        in_order(
            begin..first_primitives.len(),
            self.plan.pieces_at_a_time,
            observer,
            &work,
            &mut |_, piece| note(output.add(piece)?),
        )
    }

    /// The manifest as far as it is known before the pages. What instances show is off by `error_of_instances` at most.
    fn manifest(&self, imported: &Imported, census: &Census, error_of_instances: f64) -> Manifest {
        let placement = offset::placement(&imported.bounds);
        let mut scene = imported.scene.clone();
        scene.translate(placement.offset.map(|x| -x));
        Manifest {
            generator: concat!("raystrips ", env!("CARGO_PKG_VERSION")).into(),
            primitives: 0,
            shown: 0,
            instances: 0,
            segments: 0,
            vertices: imported.strand_points,
            strips: 0,
            clusters: 0,
            pages: 0,
            depth: 0,
            page_size: self.params.page_size,
            bounds_min: Vec3::ZERO.to_array(),
            bounds_max: Vec3::ZERO.to_array(),
            scene_offset: placement.offset,
            position_error: census.position_error.max(error_of_instances),
            radius_error: if imported.strand_points > 0 { imported.radii.code().error() } else { 0.0 },
            id_bytes: if self.params.keep_ids { imported.id_bytes } else { 0 },
            bytes: Default::default(),
            strand_bytes: Default::default(),
            dropped: imported.dropped,
            scene,
        }
    }
}
