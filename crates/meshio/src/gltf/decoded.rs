//! What the compressed parts of a document hold: in memory as long as it fits, in a scratch file beyond. Each part is
//! decoded once, so that a mesh may be shown, and its values be read, in any order.

use crate::map::Map;
use crate::scratch::Scratch;
use crate::{ImportOptions, Result};
use std::cell::{Cell, RefCell, RefMut};
use std::ops::Deref;

/// Where decoded bytes go.
pub(super) struct Store {
    memory_left: Cell<u64>,
    scratch: RefCell<Scratch>,
}

/// Bytes that have been decoded.
pub(super) enum Decoded {
    Memory(Vec<u8>),
    File(Map),
}

/// Takes decoded bytes as they come. There is one at a time, so that what it writes to the scratch file is in one piece.
pub(super) struct Writer<'a> {
    store: &'a Store,
    scratch: RefMut<'a, Scratch>,
    memory: Vec<u8>,
    /// Start and length of what is in the scratch file.
    written: Option<(u64, usize)>,
}

impl Store {
    /// A store that takes so many bytes of memory.
    pub fn new(options: &ImportOptions, memory: u64) -> Store {
        Store { memory_left: Cell::new(memory), scratch: RefCell::new(Scratch::new(options)) }
    }

    pub fn writer(&self) -> Writer<'_> {
        Writer { store: self, scratch: self.scratch.borrow_mut(), memory: Vec::new(), written: None }
    }
}

impl Writer<'_> {
    pub fn write(&mut self, bytes: &[u8]) -> Result<()> {
        if self.written.is_none() {
            if (self.memory.len() + bytes.len()) as u64 <= self.store.memory_left.get() {
                self.memory.extend_from_slice(bytes);
                return Ok(());
            }
            if !self.memory.is_empty() {
                let memory = std::mem::take(&mut self.memory);
                self.written = Some((self.scratch.append(&memory)?, memory.len()));
            }
        }
        if !bytes.is_empty() {
            let start = self.scratch.append(bytes)?;
            let (start, length) = self.written.unwrap_or((start, 0));
            self.written = Some((start, length + bytes.len()));
        }
        Ok(())
    }

    pub fn finish(mut self) -> Result<Decoded> {
        match self.written {
            Some((start, length)) => Ok(Decoded::File(self.scratch.map(start, length)?)),
            None => {
                self.memory.shrink_to_fit();
                let left = &self.store.memory_left;
                left.set(left.get().saturating_sub(self.memory.len() as u64));
                Ok(Decoded::Memory(self.memory))
            }
        }
    }
}

impl Decoded {
    /// Lets mapped pages leave memory.
    pub fn release(&self) {
        if let Decoded::File(map) = self {
            map.release();
        }
    }
}

impl Deref for Decoded {
    type Target = [u8];

    fn deref(&self) -> &[u8] {
        match self {
            Decoded::Memory(bytes) => bytes,
            Decoded::File(map) => map,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_come_back_whatever_the_memory() {
        for (memory, in_memory) in [(0, 0), (4, 1), (9, 2), (12, 3), (u64::MAX, 3)] {
            let store = Store::new(&ImportOptions::default(), memory);
            let all = [&b"abc"[..], b"de", b"", b"fghijkl"].map(|part| {
                let mut writer = store.writer();
                part.chunks(2).for_each(|bytes| writer.write(bytes).unwrap());
                (part, writer.finish().unwrap())
            });
            for (part, decoded) in &all {
                decoded.release();
                assert_eq!(&decoded[..], *part);
            }
            let kept = |(_, decoded): &&(_, Decoded)| matches!(decoded, Decoded::Memory(m) if !m.is_empty());
            assert_eq!(all.iter().filter(kept).count(), in_memory, "{memory}");
        }
    }
}
