//! Pictures, read by libraries of others.

use exr::prelude::{FlatImage, ReadChannels, ReadLayers, read};
use std::collections::BTreeMap;
use std::path::Path;

/// Channels of an EXR by name, each with one value a pixel, row by row from the top.
pub struct Exr {
    pub width: usize,
    pub height: usize,
    pub channels: BTreeMap<String, Vec<f32>>,
}

impl Exr {
    pub fn read(path: &Path) -> Exr {
        let reader =
            read().no_deep_data().largest_resolution_level().all_channels().all_layers().all_attributes();
        let image: FlatImage = reader.from_file(path).unwrap();
        let layer = &image.layer_data[0];
        let channels = layer.channel_data.list.iter();
        Exr {
            width: layer.size.x(),
            height: layer.size.y(),
            channels: channels
                .map(|channel| (channel.name.to_string(), channel.sample_data.values_as_f32().collect()))
                .collect(),
        }
    }

    /// Linear RGB of a pixel; column from the left, row from the top.
    pub fn rgb(&self, column: usize, row: usize) -> [f64; 3] {
        ["R", "G", "B"].map(|name| f64::from(self.channels[name][row * self.width + column]))
    }
}

/// Width, height and RGB bytes of a PNG.
pub fn read_png(path: &Path) -> (u32, u32, Vec<u8>) {
    let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
    let mut reader = png::Decoder::new(file).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut bytes).unwrap();
    assert_eq!((frame.color_type, frame.bit_depth), (png::ColorType::Rgb, png::BitDepth::Eight));
    (frame.width, frame.height, bytes)
}
