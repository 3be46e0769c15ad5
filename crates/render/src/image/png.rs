//! PNG: 8 bit sRGB through a tone curve.

use super::{ImageOptions, SOFTWARE, tone::srgb_byte};
use crate::film::Film;
use glam::Vec3;
use png::{BitDepth, ColorType, Encoder, EncodingError, SrgbRenderingIntent};
use std::{
    fs::File,
    io::{self, BufWriter},
};

pub(super) fn write(file: &mut File, film: &Film, options: &ImageOptions) -> io::Result<()> {
    encode(file, film, options).map_err(|error| match error {
        EncodingError::IoError(error) => error,
        error => io::Error::other(error),
    })
}

fn encode(file: &mut File, film: &Film, options: &ImageOptions) -> Result<(), EncodingError> {
    let mut encoder = Encoder::new(BufWriter::new(file), film.width(), film.height());
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_source_srgb(SrgbRenderingIntent::RelativeColorimetric);
    encoder.add_text_chunk("Software".into(), SOFTWARE.into())?;
    encoder.add_itxt_chunk("Comment".into(), options.metadata_line())?;
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&pixels(film, options))?;
    writer.finish()
}

fn pixels(film: &Film, options: &ImageOptions) -> Vec<u8> {
    let count = film.width() as usize * film.height() as usize;
    let rgb = |pixel| options.tone_curve.apply(Vec3::from(film.rgb(pixel)) * options.exposure);
    (0..count).flat_map(|pixel| rgb(pixel).to_array().map(srgb_byte)).collect()
}
