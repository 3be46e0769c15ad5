//! Parts of a large file, read in no order.

use crate::disk::advise_random;
use bytemuck::{Pod, Zeroable};
use std::fs::File;
use std::io;
use std::ops::Range;
use std::path::Path;

/// What reads past the system's cache are made of.
const BLOCK_BYTES: u64 = 4096;

#[repr(C, align(4096))]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Block([u8; BLOCK_BYTES as usize]);

/// Where parts of a file are read to. Grows to the largest part.
#[derive(Default)]
pub struct BlockBuffer(Vec<Block>);

/// A file of which parts are read in no order, by several threads.
#[derive(Debug)]
pub struct BlockFile {
    file: File,
}

impl BlockFile {
    /// Opens the file at `path`. With `past_cache`, what is read is not kept by the system, where it can do that: for a
    /// file that has no room in the memory that is left, keeping is nothing but work.
    pub fn open(path: &Path, past_cache: bool) -> io::Result<BlockFile> {
        let direct = if past_cache { open_direct(path) } else { None };
        let file = match direct {
            Some(file) => file,
            None => File::open(path)?,
        };
        advise_random(&file);
        Ok(BlockFile { file })
    }

    /// The bytes at `place`. If it begins at a multiple of 4096, they do so in memory.
    ///
    /// # Errors
    /// If the file is shorter, or cannot be read.
    pub fn read<'b>(&self, place: Range<u64>, buffer: &'b mut BlockBuffer) -> io::Result<&'b [u8]> {
        let begin = place.start / BLOCK_BYTES * BLOCK_BYTES;
        let blocks = (place.end - begin).div_ceil(BLOCK_BYTES) as usize;
        if buffer.0.len() < blocks {
            buffer.0.resize(blocks, Block::zeroed());
        }
        let bytes: &mut [u8] = bytemuck::cast_slice_mut(&mut buffer.0[..blocks]);
        let wanted = (place.start - begin) as usize..(place.end - begin) as usize;
        self.fill(bytes, begin, wanted.end)?;
        Ok(&bytes[wanted])
    }

    /// Reads the first `wanted` bytes from `offset` on, and maybe more, into memory of whole blocks that begins at one, as
    /// `offset` must.
    ///
    /// # Errors
    /// If the file is shorter, or cannot be read.
    pub fn fill(&self, blocks: &mut [u8], offset: u64, wanted: usize) -> io::Result<()> {
        let mut filled = 0;
        while filled < wanted {
            match read_at(&self.file, &mut blocks[filled..], offset + filled as u64) {
                Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                Ok(read) => filled += read,
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
        Ok(())
    }
}

/// Opens a file to be read past the system's cache; `None` where the file system has no such thing.
fn open_direct(path: &Path) -> Option<File> {
    #[cfg(target_os = "linux")]
    {
        use rustix::fs::{Mode, OFlags, open};
        let flags = OFlags::RDONLY | OFlags::DIRECT | OFlags::CLOEXEC;
        let file = File::from(open(path, flags, Mode::empty()).ok()?);
        // Some open such files and then refuse to read.
        let mut block = [Block::zeroed()];
        read_at(&file, bytemuck::cast_slice_mut(&mut block), 0).ok()?;
        Some(file)
    }
    #[cfg(not(target_os = "linux"))]
    {
        _ = path;
        None
    }
}

fn read_at(file: &File, bytes: &mut [u8], offset: u64) -> io::Result<usize> {
    #[cfg(unix)]
    return std::os::unix::fs::FileExt::read_at(file, bytes, offset);
    #[cfg(windows)]
    return std::os::windows::fs::FileExt::seek_read(file, bytes, offset);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_read_whole_or_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("file");
        let bytes: Vec<u8> = (0..10_000u32).map(|i| (i * 7 % 251) as u8).collect();
        std::fs::write(&path, &bytes).unwrap();
        for past_cache in [false, true] {
            let file = BlockFile::open(&path, past_cache).unwrap();
            let mut buffer = BlockBuffer::default();
            for place in [0..1, 4095..4097, 8192..10_000, 0..10_000, 5..5] {
                let expected = &bytes[place.start as usize..place.end as usize];
                assert_eq!(file.read(place, &mut buffer).unwrap(), expected);
            }
            let error = file.read(9999..10_001, &mut buffer).unwrap_err();
            assert_eq!(error.kind(), io::ErrorKind::UnexpectedEof);
        }
    }
}
