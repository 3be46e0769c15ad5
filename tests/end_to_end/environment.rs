//! `render --env`: light from a picture of all directions.

use crate::pictures::read_png;
use crate::support::{Folder, Outcome, repository_file};

/// A white picture, but what is on the left is not red.
fn hdr(width: usize, height: usize) -> Vec<u8> {
    let mut file = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes();
    for _ in 0..height {
        file.extend([2, 2, (width >> 8) as u8, width as u8]);
        // One is 128 times 2 to the power of (129 - 136).
        for [left, right] in [[0, 128], [128, 128], [128, 128], [129, 129]] {
            for (mut rest, value) in [(width / 2, left), (width - width / 2, right)] {
                while rest > 0 {
                    let run = rest.min(127);
                    file.extend([128 + run as u8, value]);
                    rest -= run;
                }
            }
        }
    }
    file
}

fn render(folder: &Folder, options: &str) -> Outcome {
    let scene = repository_file("scenes/cornell/scene.toml");
    let mut all = vec!["render", scene.to_str().unwrap()];
    all.extend("-o a.png --size 24x16 --spp 4 --cache cache".split(' '));
    all.extend(options.split_whitespace());
    folder.run_args(&all)
}

#[test]
fn pictures_have_the_light_that_was_asked_for_in_any_order() {
    let folder = Folder::new();
    folder.write("sky.hdr", hdr(64, 32));
    let picture = |options: &str| {
        render(&folder, options).done();
        read_png(&folder.path("a.png")).2
    };
    let one = picture("--env sky.hdr --camera 0,1,90000,0,1,99999");
    // Seen backwards, the right border is on the left and the left one on the right.
    let pixel = |x: usize| &one[3 * (24 * 8 + x)..][..3];
    let [left, right] = [pixel(2), pixel(21)];
    assert!(left[0] == left[1] && right[0] < 64 && right[1] == left[1], "{left:?} {right:?}");
    let inside = picture("--env sky.hdr");
    for order in ["none", "queues", "chunks", "origin-dir", "hph"] {
        assert!(picture(&format!("--env sky.hdr --reorder {order} --threads 2")) == inside, "{order}");
    }
    let others = [
        "",
        "--env sky.hdr --env-rotation -90",
        "--env sky.hdr --env-strength 0.3",
        "--env sky.hdr --tone agx",
    ];
    let mut seen = vec![inside];
    for options in others {
        let other = picture(options);
        assert!(!seen.contains(&other), "{options}");
        seen.push(other);
    }
}

#[test]
fn what_cannot_be_light_is_said_in_one_line() {
    let folder = Folder::new();
    folder.write("cut.hdr", &hdr(64, 32)[..500]);
    folder.write("text.exr", "no picture");
    folder.write("sky.png", "no picture");
    render(&folder, "--env cut.hdr").failed(&["cut.hdr: "]);
    render(&folder, "--env text.exr").failed(&["text.exr: "]);
    render(&folder, "--env none.hdr").failed(&["none.hdr: "]);
    render(&folder, "--env sky.png").failed(&["sky.png: an environment's name must end in .hdr or .exr"]);
    assert!(!folder.path("a.png").exists());
}

#[test]
fn memory_of_an_environment_counts() {
    let folder = Folder::new();
    folder.write("large.hdr", hdr(4096, 2048));
    // Conversion takes more.
    render(&folder, "").done();
    render(&folder, "--memory 60M").done();
    // 96 MiB of pixels.
    render(&folder, "--memory 60M --env large.hdr").failed(&["too little for this picture; use --memory"]);
    render(&folder, "--memory 170M --env large.hdr").done();
}
