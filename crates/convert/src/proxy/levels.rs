//! Simplification of what does not fit in memory, level by level.
//!
//! On each level the mesh is divided into pieces. Each is simplified by itself; vertices that several have stay as they
//! are, so that pieces fit together. The next level divides what is left by other planes: what was a border is in the
//! middle of a piece then, and since vertices bring their quadrics along, it is simplified as if it had never been one.
//! Pieces depend on the mesh alone, so the result does not depend on memory or threads.

use super::allotment::{Allotment, Goal};
use super::locks::Locks;
use super::method::{Preparation, SimplifyMethod};
use super::piece::{Reading, Simplified};
use crate::block::Block;
use crate::blocks::{Blocks, lost_triangles};
use crate::distribute::{self, Pieces};
use crate::mesh::Welded;
use crate::partition::{self, Division, PIECE_TRIANGLES};
use crate::positions::ToPack;
use crate::queue::in_order;
use crate::strands::StrandThinning;
use crate::{ConvertError, Observer, Stage};
use raystrips_extmem::{Extent, MemoryBudget, Spool};
use raystrips_geom::{Aabb, RadiusCode};
use raystrips_simplify::StoredQuadric;
use raystrips_strips::Mesh;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Parts of the triangles on one side of the planes that divide space, by turns of the levels.
const PARTS: [f64; 3] = [0.4, 0.53, 0.62];
/// A level that leaves more than this part of what it began with was kept from its goal by locks.
const STUCK: f64 = 0.85;
/// The count may be missed by this part of it.
const TOLERANCE: f64 = 0.005;
/// Bytes of a triangle of a simplified mesh that take no more memory than a piece may: where triangles share few
/// vertices, pieces have fewer triangles.
const USUAL_BYTES: u64 = 75;
/// Levels after which the count is left as it is: more than 2^64 triangles need.
const MOST_LEVELS: usize = 40;

/// Simplifies level by level.
pub(crate) struct Levels<'a> {
    /// Folder for scratch files.
    pub folder: &'a Path,
    /// Memory for what is kept between the levels.
    pub budget: Option<&'a MemoryBudget>,
    /// Memory for sorting.
    pub sort_memory: u64,
    /// Pieces and batches that are worked on at a time.
    pub pieces_at_a_time: usize,
    pub batches_at_a_time: usize,
    /// Box of the mesh.
    pub bounds: Aabb,
    pub observer: &'a dyn Observer,
}

/// How the pieces of a level are simplified.
pub(crate) struct Level {
    locks: Locks,
    preparation: Preparation,
    allotment: Allotment,
}

impl Level {
    /// Simplifies piece `number`, with the quadrics of its vertices if it was simplified before.
    pub fn simplified(&self, mesh: Mesh, quadrics: Vec<StoredQuadric>, number: usize) -> Simplified {
        let target = self.allotment.target(number, mesh.triangles.len() as u64);
        let reading = Reading { locks: &self.locks, preparation: self.preparation };
        reading.simplified(mesh, quadrics, number, target)
    }
}

impl Levels<'_> {
    /// The first level: `pieces` as they were gathered, on the way to `wanted` triangles.
    pub fn first(&self, pieces: &Pieces, method: SimplifyMethod, wanted: u64) -> Result<Level, ConvertError> {
        let goal = Goal::of(pieces.triangles(), pieces.sources.len(), true, wanted);
        let kept = wanted as f64 / pieces.triangles().max(1) as f64;
        let preparation = Preparation::new(pieces, &goal.looks(pieces.sources.len()), method, kept)?;
        let locks = match preparation {
            Preparation { cell: Some(cell), .. } => Locks::by_larger_boxes(pieces, cell),
            // Parts that are locked somewhere are not left out.
            Preparation { thinning: Some(_), .. } => self.exact_locks(pieces)?,
            _ => Locks::by_boxes(pieces),
        };
        self.level(pieces, locks, preparation, goal, wanted)
    }

    /// Simplifies `blocks` of a simplified mesh on to `wanted` triangles.
    pub fn reduce(&self, mut blocks: Blocks, wanted: u64) -> Result<Blocks, ConvertError> {
        let enough = (wanted as f64 * (1.0 + TOLERANCE)) as u64;
        let mut is_stuck = false;
        for number in 1..=MOST_LEVELS {
            if blocks.triangles <= enough {
                break;
            }
            let pieces = self.regroup(&blocks, PARTS[number % PARTS.len()])?;
            let locks = if is_stuck { self.exact_locks(&pieces)? } else { Locks::by_boxes(&pieces) };
            let goal = Goal::of(pieces.triangles(), pieces.sources.len(), false, wanted);
            let level = self.level(&pieces, locks, Preparation::default(), goal, wanted)?;
            let before = blocks.triangles;
            blocks = self.simplify(&pieces, &level)?;
            is_stuck = !goal.is_last && blocks.triangles as f64 > STUCK * before as f64;
        }
        Ok(blocks)
    }

    fn level(
        &self,
        pieces: &Pieces,
        locks: Locks,
        preparation: Preparation,
        goal: Goal,
        wanted: u64,
    ) -> Result<Level, ConvertError> {
        let reading = Reading { locks: &locks, preparation };
        let at_a_time = self.pieces_at_a_time;
        let allotment = Allotment::new(pieces, &reading, goal, wanted, at_a_time, self.observer)?;
        Ok(Level { locks, preparation, allotment })
    }

    /// Divides what `blocks` hold into pieces by planes that have this part of the triangles on one side.
    fn regroup(&self, blocks: &Blocks, part: f64) -> Result<Pieces, ConvertError> {
        let to_pack = ToPack::identity(RadiusCode::default());
        let quiet = self.quiet();
        let bytes = blocks.spool.length() / blocks.triangles.max(1);
        let most = (PIECE_TRIANGLES * USUAL_BYTES / bytes.max(1)).min(PIECE_TRIANGLES);
        let division = Division::Quantiles { part, most };
        let partition = partition::partition(blocks, self.bounds, &to_pack, division, &quiet)?;
        let partition = partition.ok_or_else(|| ConvertError::Scratch(lost_triangles()))?;
        let mut spool = Spool::unnamed(self.folder, self.budget);
        let distributed = distribute::distribute(blocks, &partition, &to_pack, false, &mut spool, &quiet)?;
        Ok(distributed.in_spool(Arc::new(spool)))
    }

    /// The observer for what is not worth a bar of its own.
    pub fn quiet(&self) -> Quiet<'_> {
        Quiet(self.observer)
    }

    fn exact_locks(&self, pieces: &Pieces) -> Result<Locks, ConvertError> {
        let memory = self.sort_memory as usize;
        Locks::by_vertices(pieces, self.folder, memory, self.pieces_at_a_time, self.observer)
    }

    /// Simplifies all of `pieces`.
    pub fn simplify(&self, pieces: &Pieces, level: &Level) -> Result<Blocks, ConvertError> {
        let mut blocks = self.no_blocks();
        let (done, total) = (AtomicU64::new(0), pieces.triangles());
        let work = |number: usize| {
            let triangles = pieces.sources[number].triangles;
            let Welded { mesh, quadrics, .. } = pieces.read(number)?;
            let simplified = level.simplified(mesh, quadrics, number);
            let before = done.fetch_add(triangles, Ordering::Relaxed);
            self.observer.progress(Stage::Simplify, before + triangles, total);
            Ok(simplified)
        };
        let count = pieces.sources.len();
        in_order(0..count, self.pieces_at_a_time, self.observer, &work, &mut |_, simplified| {
            blocks.add(simplified)
        })?;
        Ok(blocks.finish())
    }

    /// Thins the strands of `blocks`, which were thinned by `before`.
    pub fn thin_strands(
        &self,
        blocks: &Blocks,
        thinning: StrandThinning,
        before: StrandThinning,
    ) -> Result<Blocks, ConvertError> {
        let mut thinned = self.no_blocks();
        let work = |block: Block| {
            let mut simplified = Simplified::default();
            simplified.add_strands(&block, thinning, before);
            simplified
        };
        blocks.for_each(Stage::Simplify, &self.quiet(), work, |simplified| thinned.add(simplified))?;
        Ok(thinned.finish())
    }

    fn no_blocks(&self) -> NewBlocks {
        NewBlocks {
            spool: Spool::unnamed(self.folder, self.budget),
            chunks: Vec::new(),
            triangles: 0,
            at_a_time: self.batches_at_a_time,
        }
    }
}

/// Blocks on their way to a spool.
struct NewBlocks {
    spool: Spool,
    chunks: Vec<Extent>,
    triangles: u64,
    at_a_time: usize,
}

impl NewBlocks {
    fn add(&mut self, Simplified { bytes, triangles }: Simplified) -> Result<(), ConvertError> {
        if triangles > 0 {
            self.chunks.push(self.spool.append(bytes).map_err(ConvertError::Scratch)?);
            self.triangles += triangles;
        }
        Ok(())
    }

    fn finish(self) -> Blocks {
        Blocks {
            spool: self.spool.into(),
            chunks: self.chunks,
            triangles: self.triangles,
            at_a_time: self.at_a_time,
            is_consumed: false,
            keeps_flat: true,
        }
    }
}

/// Passes on nothing but whether to stop.
pub(crate) struct Quiet<'a>(&'a dyn Observer);

impl Observer for Quiet<'_> {
    fn is_cancelled(&self) -> bool {
        self.0.is_cancelled()
    }
}
