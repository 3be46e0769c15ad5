//! Files by place, and how much room there is.

use std::fs::{File, Metadata};
use std::io;
use std::path::Path;

/// Bytes that a file in `folder` may still take; `None` where the system does not tell.
pub fn free_bytes(folder: &Path) -> Option<u64> {
    #[cfg(unix)]
    return rustix::fs::statvfs(folder).ok().map(|fs| fs.f_bavail.saturating_mul(fs.f_frsize));
    #[cfg(not(unix))]
    return None;
}

/// Bytes that the files in `folder` take on their disk; 0 if there is no such folder.
pub fn used_bytes(folder: &Path) -> u64 {
    let files = std::fs::read_dir(folder).into_iter().flatten().flatten();
    files.filter_map(|file| file.metadata().ok()).map(|metadata| bytes_on_disk(&metadata)).sum()
}

/// Bytes that a file takes: fewer than its length if it has holes.
pub fn bytes_on_disk(metadata: &Metadata) -> u64 {
    #[cfg(unix)]
    return std::os::unix::fs::MetadataExt::blocks(metadata) * 512;
    #[cfg(not(unix))]
    return metadata.len();
}

/// Gives the blocks of a part of a file back to the disk; what is read there then is zero. Where that cannot be done
/// nothing is.
pub fn discard(file: &File, offset: u64, bytes: u64) {
    #[cfg(target_os = "linux")]
    {
        use rustix::fs::{FallocateFlags, fallocate};
        // A file system that cannot keeps the blocks.
        _ = fallocate(file, FallocateFlags::PUNCH_HOLE | FallocateFlags::KEEP_SIZE, offset, bytes);
    }
    #[cfg(not(target_os = "linux"))]
    let _ = (file, offset, bytes);
}

/// Tells the system that parts of a file are read in no order, so that it does not read more than is asked for.
pub fn advise_random(file: &File) {
    #[cfg(target_os = "linux")]
    {
        // It is advice: where it is not taken, reads take longer.
        _ = rustix::fs::fadvise(file, 0, None, rustix::fs::Advice::Random);
    }
    #[cfg(not(target_os = "linux"))]
    let _ = file;
}

/// Fills `bytes` from `offset` on, whatever else reads the file.
pub fn read_exact_at(file: &File, bytes: &mut [u8], offset: u64) -> io::Result<()> {
    #[cfg(unix)]
    return std::os::unix::fs::FileExt::read_exact_at(file, bytes, offset);
    #[cfg(windows)]
    {
        let (mut bytes, mut offset) = (bytes, offset);
        while !bytes.is_empty() {
            let read = std::os::windows::fs::FileExt::seek_read(file, bytes, offset)?;
            if read == 0 {
                return Err(io::ErrorKind::UnexpectedEof.into());
            }
            bytes = &mut bytes[read..];
            offset += read as u64;
        }
        Ok(())
    }
}
