//! How a disk takes to reads in no order.

use raystrips_extmem::{BlockBuffer, BlockFile};
use raystrips_pack::PageEntry;
use std::io;
use std::time::Instant;

/// Pages read to find the time of a seek: more than a system lets through at once that limits reads a second.
const PAGES: usize = 24;
/// Longer reads, to find the rate.
const LONG_READS: u64 = 4;
/// Their bytes. More are not read at a time anyway.
const LONG_BYTES: u64 = 1 << 20;
/// A read that takes less before its first byte comes is no seek, and others go on meanwhile.
const SEEK_SECONDS: f64 = 0.002;

/// How much to read at a time from the file of a pack: as much as comes in the time of a seek, at most a mebibyte, and 0
/// where the disk does not seek, or nothing is left to be found out since the pack is small.
pub(crate) fn read_bytes(file: &BlockFile, directory: &[PageEntry]) -> io::Result<u64> {
    let (Some(first), Some(last)) = (directory.first(), directory.last()) else { return Ok(0) };
    let span = last.offset + u64::from(last.bytes) - first.offset;
    if directory.len() < PAGES || span < LONG_READS * LONG_BYTES {
        return Ok(0);
    }
    let mut buffer = BlockBuffer::default();
    let begin = Instant::now();
    let mut bytes = 0;
    for i in 0..PAGES {
        let page = &directory[i * directory.len() / PAGES];
        file.read(page.offset..page.offset + u64::from(page.bytes), &mut buffer)?;
        bytes += u64::from(page.bytes);
    }
    let seconds = begin.elapsed().as_secs_f64() / PAGES as f64;
    if seconds < SEEK_SECONDS {
        return Ok(0);
    }
    let begin = Instant::now();
    for i in 0..LONG_READS {
        let offset = first.offset + (span - LONG_BYTES) / LONG_READS * i;
        file.read(offset..offset + LONG_BYTES, &mut buffer)?;
    }
    let long_seconds = begin.elapsed().as_secs_f64() / LONG_READS as f64;
    Ok(in_a_seek((bytes / PAGES as u64, seconds), (LONG_BYTES, long_seconds)))
}

/// Bytes that come in the time of a seek, if so many take so many seconds.
fn in_a_seek(short: (u64, f64), long: (u64, f64)) -> u64 {
    let seconds_a_byte = ((long.1 - short.1) / (long.0 - short.0.min(long.0 - 1)) as f64).max(1e-12);
    let seek = short.1 - seconds_a_byte * short.0 as f64;
    if seek < SEEK_SECONDS { 0 } else { ((seek / seconds_a_byte) as u64).min(LONG_BYTES) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn disks_that_seek_are_told_from_slow_ones() {
        let time = |seek: f64, rate: f64, bytes: u64| (bytes, seek + bytes as f64 / rate);
        let found = |seek, rate| in_a_seek(time(seek, rate, 60_000), time(seek, rate, LONG_BYTES));
        let hard_disk = found(0.008, 100e6);
        assert!((790_000..810_000).contains(&hard_disk), "{hard_disk}");
        assert_eq!(found(0.02, 200e6), LONG_BYTES);
        assert_eq!(found(0.0001, 20e6), 0);
    }
}
