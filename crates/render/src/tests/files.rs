//! Picture files are read back.

use crate::{
    Film, ImageError, ImageOptions, ToneCurve,
    params::{Integrator, RenderParams},
    testing::{cornell_box, render_quietly},
    write_image,
};
use exr::prelude::read_all_flat_layers_from_file;
use glam::Vec3;
use std::fs::{self, File};

fn picture() -> (Film, ImageOptions) {
    let params = RenderParams { width: 37, height: 21, spp: 2, seed: 7, ..RenderParams::default() };
    (render_quietly(&cornell_box(), &params).film, ImageOptions::for_render(&params))
}

#[test]
fn exr_holds_every_value_and_its_origin() {
    let (film, options) = picture();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.EXR");
    write_image(&path, &film, &options).unwrap();
    let image = read_all_flat_layers_from_file(&path).unwrap();
    let layer = &image.layer_data[0];
    assert_eq!((layer.size.0, layer.size.1), (37, 21));
    assert_eq!(
        layer.attributes.comments.as_ref().unwrap().to_string(),
        "integrator=path spp=2 seed=7 ordering=none"
    );
    assert!(layer.attributes.software_name.as_ref().unwrap().to_string().starts_with("raystrips "));

    let channels = &layer.channel_data.list;
    let names: Vec<String> = channels.iter().map(|channel| channel.name.to_string()).collect();
    let expected = ["B", "G", "R", "albedo.B", "albedo.G", "albedo.R", "depth.Z"];
    assert_eq!(names, [&expected[..], &["normal.X", "normal.Y", "normal.Z"]].concat());
    for pixel in 0..37 * 21 {
        let value = |c: usize| channels[c].sample_data.value_by_flat_index(pixel).to_f32();
        assert_eq!([value(2), value(1), value(0)], film.rgb(pixel));
        assert_eq!([value(5), value(4), value(3)], film.albedo(pixel).unwrap());
        assert_eq!(value(6), film.depth(pixel));
        assert_eq!([value(7), value(8), value(9)], film.normal(pixel).unwrap());
    }
}

#[test]
fn same_picture_is_the_same_file() {
    let (film, options) = picture();
    let folder = tempfile::tempdir().unwrap();
    for extension in ["exr", "png"] {
        let [a, b] = ["a", "b"].map(|name| {
            let path = folder.path().join(name).with_extension(extension);
            write_image(&path, &film, &options).unwrap();
            fs::read(path).unwrap()
        });
        assert_eq!(a, b);
    }
}

#[test]
fn png_is_srgb_of_the_exposed_film() {
    let mut film = Film::new(3, 1, false);
    for (pixel, rgb) in [Vec3::ZERO, Vec3::new(0.5, 0.25, 0.02), Vec3::splat(9.0)].into_iter().enumerate() {
        film.begin_sample(pixel);
        film.add(pixel, rgb);
    }
    let options = ImageOptions {
        exposure: 0.5,
        tone_curve: ToneCurve::Neutral,
        ..ImageOptions::for_render(&RenderParams::default())
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.png");
    write_image(&path, &film, &options).unwrap();
    let decoder = png::Decoder::new(std::io::BufReader::new(File::open(&path).unwrap()));
    let mut reader = decoder.read_info().unwrap();
    let mut bytes = [0; 9];
    let info = reader.next_frame(&mut bytes).unwrap();
    assert_eq!((info.width, info.height), (3, 1));
    // 0.25, 0.125, 0.01 encoded, and 4.5 compressed to 0.9898 first.
    assert_eq!(bytes, [0, 0, 0, 137, 99, 25, 254, 254, 254]);
}

#[test]
fn failures_name_the_file_and_leave_nothing() {
    let (film, options) = picture();
    let folder = tempfile::tempdir().unwrap();
    let error = write_image(&folder.path().join("picture.jpg"), &film, &options).unwrap_err();
    assert!(error.to_string().ends_with("picture.jpg: a picture's name must end in .exr or .png"));
    let blocked = folder.path().join("folder.png");
    fs::create_dir(&blocked).unwrap();
    let error = write_image(&blocked, &film, &options).unwrap_err();
    assert!(matches!(error, ImageError::Write { .. }) && error.to_string().contains("folder.png"));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
}

#[test]
fn data_has_no_tone_curve() {
    let params = RenderParams { integrator: Integrator::Normal, ..RenderParams::default() };
    assert_eq!(ImageOptions::for_render(&params).tone_curve, ToneCurve::Clip);
}

#[test]
fn light_gets_a_tone_curve_and_data_none() {
    let curve = |integrator| {
        ImageOptions::for_render(&RenderParams { integrator, ..RenderParams::default() }).tone_curve
    };
    for integrator in [Integrator::Path, Integrator::Photon] {
        assert_eq!(curve(integrator), ToneCurve::Neutral);
    }
    for integrator in [Integrator::Ao, Integrator::Normal] {
        assert_eq!(curve(integrator), ToneCurve::Clip);
    }
}
