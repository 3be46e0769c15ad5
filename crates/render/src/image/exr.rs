//! OpenEXR: linear f32 values, with the layers albedo, normal and depth.

use super::{ImageOptions, SOFTWARE};
use crate::film::Film;
use exr::prelude::{
    AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer, LayerAttributes, Text, WritableImage,
};
use std::{
    fs::File,
    io::{self, BufWriter},
};

/// Channels of three values a pixel, and where the film has them.
type Triple = (&'static str, fn(&Film, usize) -> Option<[f32; 3]>);

/// Colors, and the layers that need a film with AOVs.
const RGB: Triple = ("RGB", |film, pixel| Some(film.rgb(pixel)));
const ALBEDO: Triple = ("albedo.RGB", Film::albedo);
const NORMAL: Triple = ("normal.XYZ", Film::normal);

pub(super) fn write(file: &mut File, film: &Film, options: &ImageOptions) -> io::Result<()> {
    let size = (film.width() as usize, film.height() as usize);
    // The metadata is one standard attribute: the library writes attributes of other names in random order,
    // and the same picture should be the same file.
    let attributes = LayerAttributes {
        software_name: Some(Text::from(SOFTWARE)),
        comments: Text::new_or_none(options.metadata_line()),
        ..LayerAttributes::default()
    };
    let channels = AnyChannels::sort(channels(film, options.aovs).into_iter().collect());
    let layer = Layer::new(size, attributes, Encoding::SMALL_LOSSLESS, channels);
    Image::from_layer(layer).write().to_buffered(BufWriter::new(file)).map_err(|error| match error {
        exr::error::Error::Io(error) => error,
        error => io::Error::other(error),
    })
}

fn channels(film: &Film, aovs: bool) -> Vec<AnyChannel<FlatSamples>> {
    let mut channels = triple(film, RGB);
    if aovs {
        channels.push(channel("depth.Z", film, |pixel| film.depth(pixel)));
    }
    if aovs && film.has_aovs() {
        channels.extend([ALBEDO, NORMAL].into_iter().flat_map(|layer| triple(film, layer)));
    }
    channels
}

/// Three channels; `names` is the layer's prefix and a letter for each.
fn triple(film: &Film, (names, value): Triple) -> Vec<AnyChannel<FlatSamples>> {
    let (prefix, letters) = names.split_at(names.len() - 3);
    let component = |(i, letter)| {
        channel(&format!("{prefix}{letter}"), film, move |pixel| value(film, pixel).map_or(0.0, |v| v[i]))
    };
    letters.chars().enumerate().map(component).collect()
}

fn channel(name: &str, film: &Film, value: impl Fn(usize) -> f32) -> AnyChannel<FlatSamples> {
    let count = film.width() as usize * film.height() as usize;
    AnyChannel::new(name, FlatSamples::F32((0..count).map(value).collect()))
}
