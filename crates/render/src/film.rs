//! The film: exact sums of what arrived, so that the picture does not depend on the order of arrival.
//!
//! Floating-point sums depend on their order; integer sums do not. So every contribution, the light that one
//! path brings to a pixel from one light source, becomes fixed point first: a multiple of 2^-24 up to
//! [`MAX_CONTRIBUTION`]. An i64 holds 2^23 of that size.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use std::io::{self, Read, Write};

/// Largest value of a channel of a contribution, in units of radiance; larger ones are cut and counted.
pub const MAX_CONTRIBUTION: f32 = 65536.0;

/// Memory of a pixel of the picture that is written, beside that of the film.
pub const WRITTEN_PIXEL_BYTES: u64 = 64;

/// Units of the fixed point numbers in 1.
const SCALE: f64 = (1u32 << 24) as f64;

/// A picture while it is made: sums over the samples of each pixel, rows from top to bottom.
#[derive(Clone, Debug, PartialEq)]
pub struct Film {
    width: u32,
    height: u32,
    pixels: Vec<Pixel>,
    aovs: Option<Vec<AovPixel>>,
    clamped: u64,
    dropped: u64,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
struct Pixel {
    rgb: [i64; 3],
    samples: u32,
    depth: f32,
}

#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Pod, Zeroable)]
struct AovPixel {
    albedo: [i64; 3],
    normal: [i64; 3],
}

impl Film {
    /// A black film, with room for albedo and normal where `aovs`: 32 bytes a pixel, and 48 more for those.
    pub fn new(width: u32, height: u32, aovs: bool) -> Film {
        let count = width as usize * height as usize;
        let empty = Pixel { rgb: [0; 3], samples: 0, depth: f32::INFINITY };
        Film {
            width,
            height,
            pixels: vec![empty; count],
            aovs: aovs.then(|| vec![AovPixel::default(); count]),
            clamped: 0,
            dropped: 0,
        }
    }

    /// Bytes of a pixel of a film with albedo and normal or without.
    pub const fn pixel_bytes(aovs: bool) -> u64 {
        (size_of::<Pixel>() + if aovs { size_of::<AovPixel>() } else { 0 }) as u64
    }

    /// Pixels in a row.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// True where the film holds albedo and normal.
    pub fn has_aovs(&self) -> bool {
        self.aovs.is_some()
    }

    /// Contributions with a channel cut to [`MAX_CONTRIBUTION`].
    pub fn clamped(&self) -> u64 {
        self.clamped
    }

    /// Contributions left out because a channel was not a number.
    pub fn dropped(&self) -> u64 {
        self.dropped
    }

    /// Mean of a pixel, linear RGB. Pixels are numbered by rows from the top left.
    pub fn rgb(&self, pixel: usize) -> [f32; 3] {
        mean(&self.pixels[pixel].rgb, self.pixels[pixel].samples)
    }

    /// Distance along the ray of the nearest surface that a sample of the pixel met first, in scene units;
    /// infinity where all missed. (A mean would invent depths between a thing and what is behind it.)
    pub fn depth(&self, pixel: usize) -> f32 {
        self.pixels[pixel].depth
    }

    /// Mean share of light that the surfaces met first reflect, black where nothing is; `None` without AOVs.
    pub fn albedo(&self, pixel: usize) -> Option<[f32; 3]> {
        self.aovs.as_ref().map(|aovs| mean(&aovs[pixel].albedo, self.pixels[pixel].samples))
    }

    /// Mean normal of the surfaces met first, on the side of the viewer, zero where nothing is; `None` without
    /// AOVs.
    pub fn normal(&self, pixel: usize) -> Option<[f32; 3]> {
        self.aovs.as_ref().map(|aovs| mean(&aovs[pixel].normal, self.pixels[pixel].samples))
    }

    /// Writes all sums.
    pub(crate) fn write_sums(&self, file: &mut impl Write) -> io::Result<()> {
        file.write_all(bytemuck::cast_slice(&[self.clamped, self.dropped]))?;
        file.write_all(bytemuck::cast_slice(&self.pixels))?;
        self.aovs.iter().try_for_each(|aovs| file.write_all(bytemuck::cast_slice(aovs)))
    }

    /// Takes the sums of a film of the same kind.
    pub(crate) fn read_sums(&mut self, file: &mut impl Read) -> io::Result<()> {
        let mut counts = [0u64; 2];
        file.read_exact(bytemuck::cast_slice_mut(&mut counts))?;
        [self.clamped, self.dropped] = counts;
        file.read_exact(bytemuck::cast_slice_mut(&mut self.pixels))?;
        self.aovs.iter_mut().try_for_each(|aovs| file.read_exact(bytemuck::cast_slice_mut(aovs)))
    }

    /// Counts one more sample of a pixel, whatever it will bring.
    pub(crate) fn begin_sample(&mut self, pixel: usize) {
        self.pixels[pixel].samples += 1;
    }

    /// Adds light to a pixel.
    pub(crate) fn add(&mut self, pixel: usize, rgb: Vec3) {
        if rgb.is_nan() {
            self.dropped += 1;
            return;
        }
        if rgb.max_element() > MAX_CONTRIBUTION {
            self.clamped += 1;
        }
        add_fixed(&mut self.pixels[pixel].rgb, rgb.clamp(Vec3::ZERO, Vec3::splat(MAX_CONTRIBUTION)));
    }

    /// Records the first surface of a sample.
    pub(crate) fn add_first_hit(&mut self, pixel: usize, depth: f32, albedo: Vec3, normal: Vec3) {
        self.pixels[pixel].depth = self.pixels[pixel].depth.min(depth);
        if let Some(aovs) = &mut self.aovs {
            add_fixed(&mut aovs[pixel].albedo, albedo);
            add_fixed(&mut aovs[pixel].normal, normal);
        }
    }

    /// Adds the samples of `tile`, whose upper left pixel is (x, y).
    pub(crate) fn add_tile(&mut self, x: u32, y: u32, tile: &Film) {
        let row_width = tile.width as usize;
        for row in 0..tile.height as usize {
            let start = (y as usize + row) * self.width as usize + x as usize;
            let (to, from) = (start..start + row_width, row * row_width..(row + 1) * row_width);
            for (pixel, more) in self.pixels[to.clone()].iter_mut().zip(&tile.pixels[from.clone()]) {
                add_sums(&mut pixel.rgb, &more.rgb);
                pixel.samples += more.samples;
                pixel.depth = pixel.depth.min(more.depth);
            }
            if let (Some(aovs), Some(more)) = (&mut self.aovs, &tile.aovs) {
                for (pixel, more) in aovs[to].iter_mut().zip(&more[from]) {
                    add_sums(&mut pixel.albedo, &more.albedo);
                    add_sums(&mut pixel.normal, &more.normal);
                }
            }
        }
        self.clamped += tile.clamped;
        self.dropped += tile.dropped;
    }
}

fn add_sums(sums: &mut [i64; 3], more: &[i64; 3]) {
    sums.iter_mut().zip(more).for_each(|(sum, more)| *sum = sum.saturating_add(*more));
}

fn add_fixed(sum: &mut [i64; 3], value: Vec3) {
    for (sum, x) in sum.iter_mut().zip(value.to_array()) {
        *sum = sum.saturating_add(fixed(x));
    }
}

/// The nearest fixed point number. In the sum with 1.5 * 2^28 the last bit of the mantissa is worth 2^-24, so
/// that the mantissa counts them: faster than rounding, which is a function call where the CPU is not known.
fn fixed(x: f32) -> i64 {
    const ALIGN: f64 = 1.5 * (1u32 << 28) as f64;
    (f64::from(x) + ALIGN).to_bits() as i64 - ALIGN.to_bits() as i64
}

fn mean(sum: &[i64; 3], samples: u32) -> [f32; 3] {
    let divisor = SCALE * f64::from(samples.max(1));
    sum.map(|sum| (sum as f64 / divisor) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_do_not_depend_on_order() {
        let values: Vec<Vec3> = (1..1000).map(|i| Vec3::splat(1e4 / (i * i) as f32)).collect();
        let film_of = |values: &mut dyn Iterator<Item = &Vec3>| {
            let mut film = Film::new(1, 1, true);
            values.for_each(|v| {
                film.begin_sample(0);
                film.add(0, *v);
                film.add_first_hit(0, v.x, *v * 1e-4, -*v * 1e-4);
            });
            film
        };
        let film = film_of(&mut values.iter());
        assert_eq!(film, film_of(&mut values.iter().rev()));
        let expected: f64 = values.iter().map(|v| f64::from(v.x)).sum::<f64>() / 999.0;
        assert!((f64::from(film.rgb(0)[0]) - expected).abs() < 1e-5);
        assert_eq!(film.depth(0), 1e4 / (999 * 999) as f32);
    }

    #[test]
    fn wild_contributions_are_cut_dropped_and_counted() {
        let mut film = Film::new(1, 1, false);
        for rgb in [Vec3::splat(1e9), Vec3::new(0.0, f32::NAN, 0.0), Vec3::INFINITY, Vec3::NEG_ONE] {
            film.begin_sample(0);
            film.add(0, rgb);
        }
        assert_eq!((film.clamped(), film.dropped()), (2, 1));
        assert_eq!(film.rgb(0), [MAX_CONTRIBUTION / 2.0; 3]);
    }

    #[test]
    fn fixed_point_is_the_nearest() {
        for x in [0.0, 1.0, -1.0, 0.1, -0.7, 1e-9, 3e-8, MAX_CONTRIBUTION, 12345.678, f32::MIN_POSITIVE] {
            assert_eq!(fixed(x), (f64::from(x) * SCALE).round_ties_even() as i64);
        }
    }

    #[test]
    fn tiles_land_in_their_place() {
        let mut film = Film::new(3, 2, true);
        let mut tile = Film::new(2, 1, true);
        tile.begin_sample(1);
        tile.add(1, Vec3::ONE);
        film.add_tile(1, 1, &tile);
        let lit: Vec<usize> = (0..6).filter(|&i| film.rgb(i) != [0.0; 3]).collect();
        assert_eq!(lit, [5]);
    }
}
