//! Brings every triangle and every window of a strand to the scratch file in which its piece is gathered.
//!
//! Within a piece these keep the order of the input, so that what is built of them depends on nothing else.

use crate::block::{self, Block, Contents, StoredWindow};
use crate::blocks::{Blocks, lost_triangles};
use crate::mesh::Welded;
use crate::partition::{Census, PIECE_TRIANGLES, Partition};
use crate::positions::ToPack;
use crate::strands::Selected;
use crate::{ConvertError, Observer, Stage};
use glam::Vec3;
use raystrips_extmem::{Extent, Spool};
use raystrips_geom::Aabb;
use raystrips_simplify::StoredQuadric;
use raystrips_strips::Bvh;
use serde::{Deserialize, Serialize};
use std::ops::Range;
use std::sync::Arc;

/// Bytes that wait to be written, over all pieces.
const BUFFER_BYTES: usize = 32 << 20;

/// Where a piece is gathered.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct PieceSource {
    /// Triangles, or windows of strands.
    pub triangles: u64,
    /// Triangles, or segments of strands.
    pub primitives: u64,
    /// Offset and bytes of its parts in the spool, in order.
    parts: Vec<(u64, u64)>,
}

impl PieceSource {
    pub fn parts(&self) -> impl Iterator<Item = Extent> {
        self.parts.iter().map(|&(offset, bytes)| Extent { offset, bytes })
    }
}

/// All pieces, with the hierarchy over them: leaf i is piece i.
pub(crate) struct Pieces {
    pub tree: Bvh,
    pub sources: Vec<PieceSource>,
    pub spool: Arc<Spool>,
    pub census: Census,
}

/// The same while the spool may still get more.
pub(crate) struct Distributed {
    tree: Bvh,
    sources: Vec<PieceSource>,
    census: Census,
}

impl Distributed {
    /// The pieces, which are in `spool`.
    pub fn in_spool(self, spool: Arc<Spool>) -> Pieces {
        let Distributed { tree, sources, census } = self;
        Pieces { tree, sources, spool, census }
    }
}

impl Pieces {
    /// Triangles of all pieces, or windows of strands.
    pub fn triangles(&self) -> u64 {
        self.sources.iter().map(|source| source.triangles).sum()
    }

    /// Triangles of all pieces, or segments of strands.
    pub fn primitives(&self) -> u64 {
        self.sources.iter().map(|source| source.primitives).sum()
    }

    /// Calls `take` with the bytes of each part of piece `number`.
    pub fn for_each_part(
        &self,
        number: usize,
        mut take: impl FnMut(&[u8]) -> std::io::Result<()>,
    ) -> Result<(), ConvertError> {
        let mut parts = self.sources[number].parts();
        let read = parts.try_for_each(|part| take(&self.spool.read(part)?));
        read.map_err(ConvertError::Scratch)
    }

    /// The mesh of piece `number`, which is of triangles.
    pub fn read(&self, number: usize) -> Result<Welded, ConvertError> {
        let source = &self.sources[number];
        let mut welded = Welded::with_capacity(source.triangles as usize);
        self.for_each_part(number, |bytes| welded.add(bytes))?;
        if welded.mesh.triangles.len() as u64 != source.triangles {
            return Err(ConvertError::Scratch(lost_triangles()));
        }
        Ok(welded.finish())
    }
}

/// Distributes `blocks` over the pieces of `partition`, into `spool`.
pub(crate) fn distribute(
    blocks: &Blocks,
    partition: &Partition,
    to_pack: &ToPack,
    keep_ids: bool,
    spool: &mut Spool,
    observer: &dyn Observer,
) -> Result<Distributed, ConvertError> {
    let leaves = partition.tree.leaves().len();
    let mut out =
        Gatherer { leaves: (0..leaves).map(|_| vec![Gathering::default()]).collect(), buffered: 0, spool };
    let keeps = Keeps { ids: keep_ids, flat: blocks.keeps_flat };
    let work = |block: Block| split(&block, partition, to_pack, keeps);
    blocks.for_each(Stage::Distribute, observer, work, |parts| {
        parts.into_iter().try_for_each(|part| out.add(part)).map_err(ConvertError::Scratch)
    })?;
    out.flush().map_err(ConvertError::Scratch)?;
    let counts: Vec<usize> = out.leaves.iter().map(Vec::len).collect();
    let mut counts = counts.into_iter();
    let mut row = |bounds, _| row_of_leaves(bounds, 0..counts.next().expect("a count for each leaf"));
    Ok(Distributed {
        tree: partition.tree.clone().graft(&mut row),
        sources: out.leaves.into_iter().flatten().map(|gathered| gathered.source).collect(),
        census: partition.census.clone(),
    })
}

/// A balanced tree whose leaves cannot be told apart by space.
fn row_of_leaves(bounds: Aabb, items: Range<usize>) -> Bvh {
    if items.len() <= 1 {
        return Bvh::Leaf { bounds, items };
    }
    let middle = items.start + items.len() / 2;
    let children = [row_of_leaves(bounds, items.start..middle), row_of_leaves(bounds, middle..items.end)];
    Bvh::Inner { bounds, children: Box::new(children) }
}

/// What of one block goes to one leaf.
struct Part {
    leaf: u32,
    triangles: u64,
    primitives: u64,
    bytes: Vec<u8>,
}

/// What goes on to the pieces.
#[derive(Clone, Copy)]
struct Keeps {
    ids: bool,
    /// Triangles without area.
    flat: bool,
}

/// The parts of a block, in the order of their leaves.
fn split(block: &Block, partition: &Partition, to_pack: &ToPack, keeps: Keeps) -> Vec<Part> {
    let positions: Vec<Vec3> = block.positions().map(|p| to_pack.place(p)).collect();
    let mut places: Vec<(u32, u32)> = Vec::with_capacity(block.item_count());
    block.for_each_box(&positions, to_pack, keeps.flat, |place, bounds| {
        places.extend(bounds.map(|bounds| (partition.leaf(&bounds), place)));
    });
    places.sort_unstable();
    if block.is_of_strands() {
        return split_strands(block, &positions, &places);
    }
    let triangles: Vec<[u32; 3]> = block.triangles().collect();
    let mut renumbered = Renumbered::new(&positions, block);
    let parts = places.chunk_by(|a, b| a.0 == b.0).map(|group| {
        renumbered.clear();
        let corners: Vec<[u32; 3]> =
            group.iter().map(|&(_, place)| triangles[place as usize].map(|v| renumbered.number(v))).collect();
        // A batch has at most 2^16 triangles.
        let kept: Vec<u16> = group.iter().filter(|_| keeps.ids).map(|&(_, place)| place as u16).collect();
        let bytes = block::of_triangles(&Contents {
            geometry: block.geometry(),
            first_id: block.first_id(),
            positions: &renumbered.used,
            streams: block.streams(),
            attributes: &renumbered.used_attributes,
            triangles: &corners,
            places: &kept,
            quadrics: &renumbered.used_quadrics,
        });
        let count = group.len() as u64;
        Part { leaf: group[0].0, triangles: count, primitives: count, bytes }
    });
    parts.collect()
}

/// The parts of a block of strands; `places` are the leaf and the place of each window.
fn split_strands(block: &Block, positions: &[Vec3], places: &[(u32, u32)]) -> Vec<Part> {
    let windows: Vec<StoredWindow> = block.windows().collect();
    let radii: Vec<f32> = block.radii().collect();
    let parts = places.chunk_by(|a, b| a.0 == b.0).map(|group| {
        let members = group.iter().map(|&(_, place)| windows[place as usize]);
        let selected = Selected::new(members, positions, &radii);
        Part {
            leaf: group[0].0,
            triangles: group.len() as u64,
            primitives: selected.segments(),
            bytes: selected.block(block.geometry(), block.first_id()),
        }
    });
    parts.collect()
}

/// Numbers the vertices that a part uses, from 0 on.
struct Renumbered<'a> {
    positions: &'a [Vec3],
    /// Those that no part has used yet. The first one to use a vertex gets all of its quadric, since quadrics of a vertex
    /// are going to be added up.
    quadrics: Vec<StoredQuadric>,
    attributes: &'a [u8],
    record_bytes: usize,
    /// For each vertex of the block the part that used it last, and its number there.
    numbers: Vec<(u32, u32)>,
    part: u32,
    used: Vec<Vec3>,
    used_quadrics: Vec<StoredQuadric>,
    used_attributes: Vec<u8>,
}

impl<'a> Renumbered<'a> {
    fn new(positions: &'a [Vec3], block: &Block<'a>) -> Renumbered<'a> {
        Renumbered {
            positions,
            quadrics: block.quadrics().collect(),
            attributes: block.attributes(),
            record_bytes: block.streams().record_bytes(),
            numbers: vec![(0, 0); positions.len()],
            part: 0,
            used: Vec::new(),
            used_quadrics: Vec::new(),
            used_attributes: Vec::new(),
        }
    }

    fn clear(&mut self) {
        self.part += 1;
        self.used.clear();
        self.used_quadrics.clear();
        self.used_attributes.clear();
    }

    fn number(&mut self, vertex: u32) -> u32 {
        let entry = &mut self.numbers[vertex as usize];
        if entry.0 != self.part {
            *entry = (self.part, self.used.len() as u32);
            self.used.push(self.positions[vertex as usize]);
            self.used_quadrics.extend(self.quadrics.get_mut(vertex as usize).map(StoredQuadric::take));
            let record = vertex as usize * self.record_bytes;
            self.used_attributes.extend_from_slice(&self.attributes[record..record + self.record_bytes]);
        }
        entry.1
    }
}

/// A piece on its way to the spool.
#[derive(Default)]
struct Gathering {
    source: PieceSource,
    buffer: Vec<u8>,
}

struct Gatherer<'a> {
    /// For each leaf its pieces: more than one only where space cannot tell triangles apart.
    leaves: Vec<Vec<Gathering>>,
    buffered: usize,
    spool: &'a mut Spool,
}

impl Gatherer<'_> {
    fn add(&mut self, part: Part) -> std::io::Result<()> {
        let pieces = &mut self.leaves[part.leaf as usize];
        if pieces.last().is_some_and(|last| last.source.triangles + part.triangles > PIECE_TRIANGLES) {
            pieces.push(Gathering::default());
        }
        let piece = pieces.last_mut().expect("a leaf has a piece");
        piece.source.triangles += part.triangles;
        piece.source.primitives += part.primitives;
        self.buffered += part.bytes.len();
        piece.buffer.extend(part.bytes);
        if self.buffered > BUFFER_BYTES { self.flush() } else { Ok(()) }
    }

    fn flush(&mut self) -> std::io::Result<()> {
        for piece in self.leaves.iter_mut().flatten().filter(|piece| !piece.buffer.is_empty()) {
            let extent = self.spool.append(std::mem::take(&mut piece.buffer))?;
            piece.source.parts.push((extent.offset, extent.bytes));
        }
        self.buffered = 0;
        Ok(())
    }
}
