//! A queue of integers of any length: written once, then read once from the start. In memory as long as it fits, in a
//! scratch file beyond.

use crate::scratch::Scratch;
use crate::{ImportOptions, Result};
use std::io::{BufReader, Cursor, Read};

/// Less would make writing slow.
const MIN_MEMORY: u64 = 1 << 16;

/// The end where integers go in. Small ones take few bytes (LEB128).
pub(crate) struct Spool {
    /// What comes behind the contents of the scratch file.
    memory: Vec<u8>,
    max_memory: usize,
    scratch: Scratch,
}

/// The end where they come out.
pub(crate) struct SpoolReader {
    bytes: Box<dyn Read>,
}

impl Spool {
    /// A queue that keeps about `memory` bytes out of the scratch file.
    pub fn new(options: &ImportOptions, memory: u64) -> Spool {
        let max_memory = usize::try_from(memory.max(MIN_MEMORY)).unwrap_or(usize::MAX);
        Spool { memory: Vec::new(), max_memory, scratch: Scratch::new(options) }
    }

    pub fn push(&mut self, mut value: u64) -> Result<()> {
        while value >= 0x80 {
            self.memory.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.memory.push(value as u8);
        if self.memory.len() >= self.max_memory {
            self.scratch.append(&self.memory)?;
            self.memory.clear();
        }
        Ok(())
    }

    pub fn into_reader(self) -> Result<SpoolReader> {
        let rest = Cursor::new(self.memory);
        Ok(match self.scratch.into_file()? {
            Some(file) => SpoolReader { bytes: Box::new(BufReader::new(file).chain(rest)) },
            None => SpoolReader { bytes: Box::new(rest) },
        })
    }
}

impl SpoolReader {
    /// The next integer, or `None` behind the last.
    pub fn next(&mut self) -> std::io::Result<Option<u64>> {
        let (mut value, mut shift) = (0, 0);
        let mut byte = [0];
        while self.bytes.read(&mut byte)? == 1 {
            value |= u64::from(byte[0] & 0x7f).checked_shl(shift).unwrap_or(0);
            shift += 7;
            if byte[0] < 0x80 {
                return Ok(Some(value));
            }
        }
        Ok(None)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_come_back_in_order() {
        let value = |i: u64| i.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (i % 64);
        for (count, memory) in [(0, 0), (100, 0), (50_000, 0), (50_000, 1 << 17), (50_000, u64::MAX)] {
            let mut spool = Spool::new(&ImportOptions::default(), memory);
            (0..count).for_each(|i| spool.push(value(i)).unwrap());
            let mut reader = spool.into_reader().unwrap();
            (0..count).for_each(|i| assert_eq!(reader.next().unwrap(), Some(value(i))));
            assert_eq!(reader.next().unwrap(), None);
        }
    }
}
