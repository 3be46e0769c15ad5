//! Attributes of the corners of a piece's triangles, on their way from blocks of the import to those of pages.

use crate::block::Block;
use raystrips_geom::{Attributes, Streams};
use raystrips_pack::page::builder::BuiltPage;
use raystrips_pack::{AttributeBuilder, BlockEntry};
use raystrips_strips::StripTree;

/// The attributes of triangles in a row.
///
/// Memory: the records as they were imported, and 13 bytes a triangle.
#[derive(Default)]
pub(crate) struct CornerAttributes {
    records: Vec<u8>,
    triangles: Vec<Corners>,
    streams: Vec<u8>,
}

/// Where the records of a triangle's corners begin.
type Corners = [u32; 3];

impl CornerAttributes {
    /// Adds those of a block, whose triangles follow `before` others.
    pub fn add(&mut self, block: &Block, before: usize) {
        let streams = block.streams();
        if streams.is_empty() {
            return;
        }
        // Triangles of blocks without attributes.
        self.triangles.resize(before, [0; 3]);
        self.streams.resize(before, Streams::NONE.bits());
        let first = self.records.len() as u32;
        let record_bytes = streams.record_bytes() as u32;
        self.records.extend_from_slice(block.attributes());
        self.triangles.extend(block.triangles().map(|corners| corners.map(|v| first + v * record_bytes)));
        self.streams.resize(self.triangles.len(), streams.bits());
    }

    fn streams(&self, triangle: usize) -> Streams {
        self.streams.get(triangle).and_then(|&bits| Streams::from_bits(bits)).unwrap_or_default()
    }

    fn corners(&self, triangle: usize) -> [Attributes; 3] {
        let streams = self.streams(triangle);
        if streams.is_empty() {
            return [Attributes::default(); 3];
        }
        self.triangles[triangle].map(|begin| {
            Attributes::decode(&self.records[begin as usize..][..streams.record_bytes()], streams)
        })
    }

    /// The blocks of the pages of a piece one after the other, and their directory; neither if there are no attributes.
    pub fn of_pages(&self, built: &StripTree, pages: &[BuiltPage]) -> (Vec<BlockEntry>, Vec<u8>) {
        if self.triangles.is_empty() {
            return (vec![BlockEntry::default(); pages.len()], Vec::new());
        }
        let (mut entries, mut bytes) = (Vec::with_capacity(pages.len()), Vec::new());
        let mut sources = built.clusters.iter().flat_map(|c| &c.strips).flat_map(|s| &s.sources);
        for page in pages {
            let sources: Vec<_> = sources.by_ref().take(page.triangle_count as usize).collect();
            let streams = sources.iter().map(|source| self.streams(source.triangle as usize));
            let streams = streams.fold(Streams::NONE, Streams::union);
            if streams.is_empty() {
                entries.push(BlockEntry::default());
                continue;
            }
            let mut builder = AttributeBuilder::new(streams);
            for source in sources {
                let corners = self.corners(source.triangle as usize);
                let first = usize::from(source.first_corner);
                builder.triangle(&[0, 1, 2].map(|k| corners[(first + k) % 3]));
            }
            let block = builder.finish();
            entries.push(BlockEntry::of(&block));
            bytes.extend(block);
        }
        (entries, bytes)
    }
}
