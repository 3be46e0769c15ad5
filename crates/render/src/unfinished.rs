//! A picture on the way: what is done of it is exact, so that what is left can be done by another process, and the picture
//! is the same to the last bit.

use crate::{
    film::Film,
    params::RenderParams,
    render::{RenderOutput, RenderStats},
};
use std::io::{self, Read, Write};

/// A picture of which some of the work is done. Each way to render numbers its work in its own way.
#[derive(Clone, Debug)]
pub struct Unfinished {
    pub(crate) output: RenderOutput,
    /// Work before this number is done, and none after it is begun.
    pub(crate) next: u64,
    pub(crate) is_finished: bool,
}

/// Begins a file.
const MAGIC: [u8; 8] = *b"RSTRIPS\x01";

impl Unfinished {
    /// A picture of which nothing is done.
    pub fn new(params: &RenderParams) -> Unfinished {
        // A size that is refused later gets no film.
        let (width, height) = if params.validate().is_ok() { (params.width, params.height) } else { (0, 0) };
        let film = Film::new(width, height, params.aovs);
        let output = RenderOutput { film, stats: RenderStats::default() };
        Unfinished { output, next: 0, is_finished: false }
    }

    /// True if nothing is left to be done.
    pub fn is_finished(&self) -> bool {
        self.is_finished
    }

    /// The picture as it is.
    pub fn into_output(self) -> RenderOutput {
        self.output
    }

    /// Writes it so that [`Unfinished::read`] gives it back. `key` says of what it is a picture.
    ///
    /// # Errors
    /// Those of `file`.
    pub fn write(&self, key: u64, file: &mut impl Write) -> io::Result<()> {
        let mut file = Summed { file, sum: Fnv::default() };
        file.write_all(&MAGIC)?;
        let RenderStats { primary, shadow, secondary, seconds } = self.output.stats;
        for number in [key, self.next, primary, shadow, secondary, seconds.total.to_bits()] {
            file.write_all(&number.to_le_bytes())?;
        }
        self.output.film.write_sums(&mut file)?;
        let sum = file.sum.0;
        file.file.write_all(&sum.to_le_bytes())
    }

    /// Reads a picture with these parameters; `None` if it is one of something else, or not whole.
    ///
    /// # Errors
    /// Those of `file`.
    pub fn read(params: &RenderParams, key: u64, file: &mut impl Read) -> io::Result<Option<Unfinished>> {
        let mut file = Summed { file, sum: Fnv::default() };
        let mut unfinished = Unfinished::new(params);
        let whole = || -> io::Result<bool> {
            let mut magic = [0; MAGIC.len()];
            file.read_exact(&mut magic)?;
            let mut numbers = [0; 6];
            for number in &mut numbers {
                *number = read_u64(&mut file)?;
            }
            let stats = &mut unfinished.output.stats;
            let (found_key, seconds);
            [found_key, unfinished.next, stats.primary, stats.shadow, stats.secondary, seconds] = numbers;
            stats.seconds.total = f64::from_bits(seconds);
            if magic != MAGIC || found_key != key {
                return Ok(false);
            }
            unfinished.output.film.read_sums(&mut file)?;
            let sum = file.sum.0;
            Ok(read_u64(&mut file)? == sum)
        };
        match { whole }() {
            Ok(true) => Ok(Some(unfinished)),
            Ok(false) => Ok(None),
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => Ok(None),
            Err(error) => Err(error),
        }
    }
}

fn read_u64(file: &mut impl Read) -> io::Result<u64> {
    let mut bytes = [0; 8];
    file.read_exact(&mut bytes)?;
    Ok(u64::from_le_bytes(bytes))
}

/// A checksum (Fowler, Noll, Vo), eight bytes at a time.
struct Fnv(u64);

impl Default for Fnv {
    fn default() -> Fnv {
        Fnv(0xcbf2_9ce4_8422_2325)
    }
}

impl Fnv {
    fn add(&mut self, bytes: &[u8]) {
        for part in bytes.chunks(8) {
            let mut word = [0; 8];
            word[..part.len()].copy_from_slice(part);
            self.0 = (self.0 ^ u64::from_le_bytes(word)).wrapping_mul(0x100_0000_01b3).rotate_left(29);
        }
    }
}

/// Sums what is written or read.
struct Summed<'a, F> {
    file: &'a mut F,
    sum: Fnv,
}

impl<F: Write> Write for Summed<'_, F> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.file.write_all(bytes)?;
        self.sum.add(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

impl<F: Read> Read for Summed<'_, F> {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        self.file.read_exact(bytes)?;
        self.sum.add(bytes);
        Ok(bytes.len())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn what_is_written_comes_back_or_is_refused() {
        let params = RenderParams { width: 3, height: 2, ..RenderParams::default() };
        let mut unfinished = Unfinished::new(&params);
        unfinished.next = 7;
        unfinished.output.stats.shadow = 5;
        unfinished.output.film.begin_sample(4);
        unfinished.output.film.add(4, Vec3::ONE);
        let mut bytes = Vec::new();
        unfinished.write(11, &mut bytes).unwrap();
        let read = |bytes: &[u8], key| Unfinished::read(&params, key, &mut &*bytes).unwrap();
        let back = read(&bytes, 11).unwrap();
        assert!(back.output.film == unfinished.output.film && back.output.stats == unfinished.output.stats);
        assert_eq!(back.next, 7);
        assert!(read(&bytes, 12).is_none());
        for i in 0..bytes.len() {
            let mut damaged = bytes.clone();
            damaged[i] ^= 1;
            assert!(read(&damaged, 11).is_none() && read(&bytes[..i], 11).is_none(), "{i}");
        }
    }
}
