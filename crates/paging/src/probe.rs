//! How a disk takes to reads in no order.

use raystrips_extmem::{BlockBuffer, BlockFile};
use raystrips_pack::PageEntry;
use std::io;
use std::ops::Range;
use std::time::Instant;

/// Pages read to find the time of a seek: several times what a system lets through at once that limits reads a second.
const PAGES: usize = 48;
/// Longer reads, to find the rate.
const LONG_READS: u32 = 8;
/// Their bytes. More are not read at a time anyway.
const LONG_BYTES: u64 = 1 << 20;
/// A read takes as long as so many seeks: some of the pages in it are there already.
const SEEKS: f64 = 2.0;
/// A read that takes less before its first byte comes is no seek, and others go on meanwhile.
const SEEK_SECONDS: f64 = 0.002;

/// How much to read at a time from the file of a pack: as much as comes in the time of two seeks, at most a mebibyte, and 0
/// where the disk does not seek, or nothing is left to be found out since the pack is small.
pub(crate) fn read_bytes(file: &BlockFile, directory: &[PageEntry]) -> io::Result<u64> {
    let begin = directory.iter().map(|page| page.offset).min().unwrap_or(0);
    let end = directory.iter().map(|page| page.offset + u64::from(page.bytes)).max().unwrap_or(0);
    let span = end - begin;
    if directory.len() < PAGES || span < u64::from(LONG_READS) * LONG_BYTES {
        return Ok(0);
    }
    let mut buffer = BlockBuffer::default();
    let mut time = |place: Range<u64>| -> io::Result<f64> {
        let begin = Instant::now();
        file.read(place, &mut buffer)?;
        Ok(begin.elapsed().as_secs_f64())
    };
    let pages = (0..PAGES).map(|i| &directory[i * directory.len() / PAGES]);
    let seconds = mean(pages.clone().map(|p| time(p.offset..p.offset + u64::from(p.bytes))))?;
    if seconds < SEEK_SECONDS {
        return Ok(0);
    }
    let offsets = (0..LONG_READS).map(|i| begin + (span - LONG_BYTES) / u64::from(LONG_READS) * u64::from(i));
    let long_seconds = mean(offsets.map(|offset| time(offset..offset + LONG_BYTES)))?;
    let bytes = pages.map(|page| u64::from(page.bytes)).sum::<u64>() / PAGES as u64;
    Ok(in_a_seek((bytes, seconds), (LONG_BYTES, long_seconds)))
}

/// The mean of times: where reads a second are limited, some are let through at once and the next has to wait.
fn mean(times: impl ExactSizeIterator<Item = io::Result<f64>>) -> io::Result<f64> {
    let count = times.len() as f64;
    Ok(times.sum::<io::Result<f64>>()? / count)
}

/// Bytes that come in the time of [`SEEKS`], if so many take so many seconds.
fn in_a_seek(short: (u64, f64), long: (u64, f64)) -> u64 {
    let seconds_a_byte = ((long.1 - short.1) / (long.0 - short.0.min(long.0 - 1)) as f64).max(1e-12);
    let seek = short.1 - seconds_a_byte * short.0 as f64;
    if seek < SEEK_SECONDS { 0 } else { ((SEEKS * seek / seconds_a_byte) as u64).min(LONG_BYTES) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn disks_that_seek_are_told_from_slow_ones() {
        let time = |seek: f64, rate: f64, bytes: u64| (bytes, seek + bytes as f64 / rate);
        let found = |seek, rate| in_a_seek(time(seek, rate, 60_000), time(seek, rate, LONG_BYTES));
        let hard_disk = found(0.004, 100e6);
        assert!((790_000..810_000).contains(&hard_disk), "{hard_disk}");
        assert_eq!(found(0.02, 200e6), LONG_BYTES);
        assert_eq!(found(0.0001, 20e6), 0);
    }
}
