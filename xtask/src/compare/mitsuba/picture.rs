//! Pictures as numbers: how alike two of them are, and how they are shown beside each other.

use anyhow::Result;
use std::array::from_fn;

/// Weights of red, green and blue in luminance (Rec. 709).
const LUMINANCE: [f64; 3] = [0.2126, 0.7152, 0.0722];
/// Half of the width of the windows of [`ssim`], and the standard deviation of their weights, as published.
const RADIUS: usize = 5;
const DEVIATION: f64 = 1.5;
/// What differences are multiplied by to be seen.
const GAIN: f64 = 4.0;

/// Linear RGB, row by row from the top.
pub struct Picture {
    pub size: [u32; 2],
    pub pixels: Vec<[f32; 3]>,
}

impl Picture {
    /// The mean of each channel.
    pub fn mean(&self) -> [f64; 3] {
        let sum = |channel: usize| self.pixels.iter().map(|pixel| f64::from(pixel[channel])).sum::<f64>();
        from_fn(|channel| sum(channel) / self.pixels.len() as f64)
    }

    /// Luminance as a screen codes it, 0 to 1; what is brighter is cut.
    fn coded_luminance(&self) -> Vec<f64> {
        let luminance = |pixel: &[f32; 3]| (0..3).map(|i| LUMINANCE[i] * f64::from(pixel[i])).sum::<f64>();
        self.pixels.iter().map(|pixel| coded(luminance(pixel))).collect()
    }

    /// Means of blocks of so many pixels along each side.
    fn shrunk(&self, factor: u32) -> Picture {
        let size = self.size.map(|extent| extent / factor);
        let block = |x: u32, y: u32| {
            let mut sum = [0.0f32; 3];
            for (dy, dx) in (0..factor).flat_map(|dy| (0..factor).map(move |dx| (dy, dx))) {
                let pixel = self.pixels[((y * factor + dy) * self.size[0] + x * factor + dx) as usize];
                (0..3).for_each(|i| sum[i] += pixel[i] / (factor * factor) as f32);
            }
            sum
        };
        let places = (0..size[1]).flat_map(|y| (0..size[0]).map(move |x| (x, y)));
        Picture { size, pixels: places.map(|(x, y)| block(x, y)).collect() }
    }
}

/// The transfer function of sRGB (IEC 61966-2-1), cut at 1.
fn coded(linear: f64) -> f64 {
    let linear = linear.clamp(0.0, 1.0);
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055 }
}

/// The largest difference of the means of a channel, as a share of that of `reference`.
pub fn apart(picture: &Picture, reference: &Picture) -> f64 {
    let means = picture.mean().into_iter().zip(reference.mean());
    means.map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f64::max)
}

/// Mean structural similarity of coded luminance (Wang, Bovik, Sheikh, Simoncelli 2004): 1 of the same pictures.
pub fn ssim(a: &Picture, b: &Picture) -> f64 {
    /// (0.01 L)² and (0.03 L)², where values are up to L = 1.
    const C: [f64; 2] = [1e-4, 9e-4];
    let [a, b] =
        [a, b].map(|picture| Plane { width: picture.size[0] as usize, values: picture.coded_luminance() });
    let blurred = |f: &dyn Fn(f64, f64) -> f64| {
        let values = a.values.iter().zip(&b.values).map(|(&a, &b)| f(a, b)).collect();
        Plane { width: a.width, values }.blurred().transposed().blurred().values
    };
    let [mean_a, mean_b] = [blurred(&|a, _| a), blurred(&|_, b| b)];
    let [aa, bb, ab] = [blurred(&|a, _| a * a), blurred(&|_, b| b * b), blurred(&|a, b| a * b)];
    let of = |i: usize| {
        let (p, q) = (mean_a[i], mean_b[i]);
        let [var_a, var_b, covariance] = [aa[i] - p * p, bb[i] - q * q, ab[i] - p * q];
        (2.0 * p * q + C[0]) * (2.0 * covariance + C[1]) / ((p * p + q * q + C[0]) * (var_a + var_b + C[1]))
    };
    (0..mean_a.len()).map(of).sum::<f64>() / mean_a.len() as f64
}

/// A number for each pixel.
struct Plane {
    width: usize,
    values: Vec<f64>,
}

impl Plane {
    /// Weighted means along rows, of whole windows alone.
    fn blurred(&self) -> Plane {
        let weight = |i: usize| libm::exp(-0.5 * ((i as f64 - RADIUS as f64) / DEVIATION).powi(2));
        let weights: [f64; 2 * RADIUS + 1] = from_fn(weight);
        let sum: f64 = weights.iter().sum();
        let mean = |window: &[f64]| {
            window.iter().zip(&weights).map(|(value, weight)| value * weight).sum::<f64>() / sum
        };
        let rows = self.values.chunks_exact(self.width);
        Plane {
            width: self.width - 2 * RADIUS,
            values: rows.flat_map(|row| row.windows(weights.len()).map(mean)).collect(),
        }
    }

    fn transposed(&self) -> Plane {
        let height = self.values.len() / self.width;
        let places = (0..self.width).flat_map(|x| (0..height).map(move |y| y * self.width + x));
        Plane { width: height, values: places.map(|place| self.values[place]).collect() }
    }
}

/// A picture for eyes: rows of bytes.
pub struct Panel {
    size: [u32; 2],
    rgb: Vec<[u8; 3]>,
}

impl Panel {
    fn new(size: [u32; 2], color: impl Fn(usize) -> [f64; 3]) -> Panel {
        let byte = |x: f64| (x.clamp(0.0, 1.0) * 255.0).round() as u8;
        Panel { size, rgb: (0..(size[0] * size[1]) as usize).map(|pixel| color(pixel).map(byte)).collect() }
    }

    /// Ours, theirs, and how much codes differ, four times as bright: in a row, or one below the other.
    pub fn comparison(ours: &Picture, theirs: &Picture, shrink: u32, in_a_row: bool) -> Panel {
        let [ours, theirs] = [ours, theirs].map(|picture| picture.shrunk(shrink));
        let color = |picture: &Picture, pixel: usize| picture.pixels[pixel].map(|x| coded(f64::from(x)));
        let difference = |pixel: usize| {
            let [a, b] = [color(&ours, pixel), color(&theirs, pixel)];
            from_fn(|i| GAIN * (a[i] - b[i]).abs())
        };
        let panels = [
            Panel::new(ours.size, |pixel| color(&ours, pixel)),
            Panel::new(ours.size, |pixel| color(&theirs, pixel)),
            Panel::new(ours.size, difference),
        ];
        if in_a_row { Panel::beside(&panels) } else { Panel::below(&panels) }
    }

    /// Panels of the same height from left to right.
    pub fn beside(panels: &[Panel]) -> Panel {
        let height = panels.first().map_or(0, |panel| panel.size[1]);
        let row = |panel: &Panel, y: u32| {
            let width = panel.size[0] as usize;
            let begin = y as usize * width;
            panel.rgb[begin..begin + width].to_vec()
        };
        let rgb = (0..height).flat_map(|y| panels.iter().flat_map(move |panel| row(panel, y))).collect();
        Panel { size: [panels.iter().map(|panel| panel.size[0]).sum(), height], rgb }
    }

    /// Panels of the same width from top to bottom.
    fn below(panels: &[Panel]) -> Panel {
        let width = panels.first().map_or(0, |panel| panel.size[0]);
        let rgb = panels.iter().flat_map(|panel| &panel.rgb).copied().collect();
        Panel { size: [width, panels.iter().map(|panel| panel.size[1]).sum()], rgb }
    }

    /// As a PNG.
    pub fn png(&self) -> Result<Vec<u8>> {
        png_bytes(self.size, self.rgb.as_flattened())
    }
}

/// A PNG of 8-bit RGB.
pub fn png_bytes([width, height]: [u32; 2], rgb: &[u8]) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(rgb)?;
    writer.finish()?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(value: impl Fn(u32, u32) -> f32) -> Picture {
        let places = (0..32).flat_map(|y| (0..32).map(move |x| (x, y)));
        Picture { size: [32, 32], pixels: places.map(|(x, y)| [value(x, y); 3]).collect() }
    }

    #[test]
    fn same_pictures_are_alike_and_others_are_not() {
        let stripes = picture(|x, _| (x % 4) as f32 / 4.0);
        assert!((ssim(&stripes, &stripes) - 1.0).abs() < 1e-9);
        let brighter = picture(|x, _| (x % 4) as f32 / 4.0 * 1.02);
        assert!(ssim(&stripes, &brighter) > 0.99);
        assert!(ssim(&stripes, &picture(|_, y| (y % 4) as f32 / 4.0)) < 0.1);
        assert!((apart(&brighter, &stripes) - 0.02).abs() < 1e-4);
    }

    #[test]
    fn flat_pictures_differ_by_their_means_alone() {
        let [a, b] = [0.25, 0.5].map(|value| picture(|_, _| value));
        let [p, q] = [0.25, 0.5].map(coded);
        let expected = (2.0 * p * q + 1e-4) / (p * p + q * q + 1e-4);
        assert!((ssim(&a, &b) - expected).abs() < 1e-6);
    }

    #[test]
    fn panels_are_put_together() {
        let [a, b] = [0.0, 1.0].map(|value| picture(|_, _| value));
        let row = Panel::comparison(&a, &b, 2, true);
        assert_eq!((row.size, row.rgb[0], row.rgb[16], row.rgb[32]), ([48, 16], [0; 3], [255; 3], [255; 3]));
        assert_eq!(Panel::comparison(&a, &b, 1, false).size, [32, 96]);
    }
}
