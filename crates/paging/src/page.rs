//! A page in memory.

use raystrips_extmem::Reservation;
use raystrips_pack::layout::PageHeader;
use raystrips_pack::{PageView, WideNode};

/// A page in memory that was checked.
pub(crate) struct Page {
    /// Whole cache lines, for the alignment.
    lines: Vec<WideNode>,
    len: usize,
    /// Its share of a budget.
    _memory: Option<Reservation>,
}

impl Page {
    /// A page of `bytes` that were checked.
    pub fn new(bytes: &[u8], memory: Reservation) -> Page {
        let line = |part: &[u8]| {
            let mut line = [0; size_of::<WideNode>()];
            line[..part.len()].copy_from_slice(part);
            bytemuck::cast(line)
        };
        let lines = bytes.chunks(size_of::<WideNode>()).map(line).collect();
        Page { lines, len: bytes.len(), _memory: Some(memory) }
    }

    /// A page without anything in it.
    pub fn blank() -> Page {
        let header_lines = size_of::<PageHeader>().div_ceil(size_of::<WideNode>());
        let mut lines: Vec<WideNode> = bytemuck::zeroed_vec(header_lines + 1);
        let header = PageHeader {
            nodes_offset: (header_lines * size_of::<WideNode>()) as u32,
            max_windows: 1,
            ..bytemuck::Zeroable::zeroed()
        };
        bytemuck::cast_slice_mut(&mut lines)[..size_of::<PageHeader>()]
            .copy_from_slice(bytemuck::bytes_of(&header));
        let len = lines.len() * size_of::<WideNode>();
        Page { lines, len, _memory: None }
    }

    #[inline]
    pub fn view(&self) -> PageView<'_> {
        PageView::new(&bytemuck::cast_slice(&self.lines)[..self.len])
            .expect("pages are checked when they come")
    }
}
