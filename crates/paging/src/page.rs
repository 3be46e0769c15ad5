//! A page in memory.

use crate::frames::Frame;
use raystrips_pack::layout::PageHeader;
use raystrips_pack::{PageView, WideNode};

/// A page in memory that was checked.
pub(crate) struct Page {
    frame: Frame,
    len: usize,
}

impl Page {
    /// The page of `len` bytes that is in `frame` and was checked.
    pub fn new(frame: Frame, len: usize) -> Page {
        Page { frame, len }
    }

    /// Its frame, for another page.
    pub fn into_frame(self) -> Frame {
        self.frame
    }

    #[inline]
    pub fn view(&self) -> PageView<'_> {
        PageView::new(&self.frame.bytes()[..self.len]).expect("pages are checked when they come")
    }
}

/// The bytes of a page without anything in it.
pub(crate) fn blank() -> Vec<WideNode> {
    let header_lines = size_of::<PageHeader>().div_ceil(size_of::<WideNode>());
    let mut lines: Vec<WideNode> = bytemuck::zeroed_vec(header_lines + 1);
    let header = PageHeader {
        nodes_offset: (header_lines * size_of::<WideNode>()) as u32,
        max_windows: 1,
        ..bytemuck::Zeroable::zeroed()
    };
    bytemuck::cast_slice_mut(&mut lines)[..size_of::<PageHeader>()]
        .copy_from_slice(bytemuck::bytes_of(&header));
    lines
}
