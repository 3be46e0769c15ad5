//! Geographic coordinates keep their detail.

use crate::models::Mesh;
use crate::rays::{self, ray};
use crate::support::Folder;

/// Easting and northing. An f32 has steps of half a unit here.
const EAST: f64 = 5_000_000.0;
const NORTH: f64 = 5_400_000.0;

const SIDE: u32 = 40;

/// Heights that differ by centimeters between neighbors.
fn height(i: u32, j: u32) -> f64 {
    f64::from((3 * i + 7 * j) % 10) * 0.01
}

#[test]
fn centimeters_survive_at_five_million() {
    let folder = Folder::new();
    // Vertices lie between the steps of f32, the middles of squares on them.
    let place = |i, j| [EAST + 0.25 + 0.5 * f64::from(i), NORTH + 0.25 + 0.5 * f64::from(j), height(i, j)];
    folder.write("utm.ply", Mesh::height_field(SIDE, place).ply_f64());
    let told = folder.run("convert utm.ply -o utm.rsp --json").done().json();
    assert_eq!(told["triangles"], 2 * SIDE * SIDE);

    let numbers = |value: &serde_json::Value| [0, 1, 2].map(|axis| value[axis].as_f64().unwrap());
    let offset = numbers(&told["scene_offset"]);
    assert!((offset[0] - EAST).abs() < 100.0 && (offset[1] - NORTH).abs() < 100.0 && offset[2] == 0.0);
    let min = numbers(&told["bounds"]["min"]);
    assert_eq!([0, 1].map(|k| min[k] + offset[k]), [EAST + 0.25, NORTH + 0.25]);

    let squares: Vec<(u32, u32)> = (0..SIDE * SIDE).map(|k| (k % SIDE, k / SIDE)).collect();
    let onto_middle = |&(i, j): &(u32, u32)| {
        ray([EAST + 0.5 + 0.5 * f64::from(i), NORTH + 0.5 + 0.5 * f64::from(j), 4.0], [0.0, 0.0, -1.0])
    };
    let rays: Vec<_> = squares.iter().map(onto_middle).collect();
    folder.write("rays", rays::encode(&rays));
    folder.run("trace utm.rsp --rays rays -o hits").done();
    let hits = rays::decode(&folder.read("hits"));
    for ((i, j), hit) in squares.into_iter().zip(hits) {
        // The middle of a square is the middle of its cut.
        let expected = 4.0 - 0.5 * (height(i + 1, j) + height(i, j + 1));
        assert!((f64::from(hit.t) - expected).abs() < 1e-5, "{i} {j}: {} instead of {expected}", hit.t);
    }
}
