//! Ray files and hit files.

/// Eight numbers: origin, tnear, direction, tfar.
pub type Ray = [f32; 8];

/// The half line from `origin` along `direction`.
pub fn ray(origin: [f64; 3], direction: [f64; 3]) -> Ray {
    let ([x, y, z], [dx, dy, dz]) = (origin.map(|c| c as f32), direction.map(|c| c as f32));
    [x, y, z, 0.0, dx, dy, dz, f32::INFINITY]
}

/// A ray file.
pub fn encode(rays: &[Ray]) -> Vec<u8> {
    rays.iter().flatten().flat_map(|number| number.to_le_bytes()).collect()
}

/// A record of a hit file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    pub t: f32,
    pub u: f32,
    pub v: f32,
    pub geometry: u32,
    pub triangle: u64,
}

/// Reads a hit file.
pub fn decode(bytes: &[u8]) -> Vec<Hit> {
    assert_eq!(bytes.len() % 24, 0, "a hit has 24 bytes");
    let hit = |record: &[u8]| {
        let word = |i: usize| record[4 * i..4 * i + 4].try_into().unwrap();
        let float = |i| f32::from_le_bytes(word(i));
        Hit {
            t: float(0),
            u: float(1),
            v: float(2),
            geometry: u32::from_le_bytes(word(3)),
            triangle: u64::from_le_bytes(record[16..].try_into().unwrap()),
        }
    };
    bytes.chunks_exact(24).map(hit).collect()
}

/// Rays down onto the square from 0 to `side`, in directions that are all different.
pub fn onto(side: u32, count: usize) -> Vec<Ray> {
    // Multiples of irrational numbers, spread evenly and without a pattern that meets edges.
    let fraction = |i: usize, step: f64| (i as f64 * step).fract();
    let one = |i: usize| {
        let place = [0.7548776662, 0.5698402909].map(|step| fraction(i + 1, step) * f64::from(side));
        let lean = [0.8191725134, 0.6710436067].map(|step| fraction(i + 1, step) - 0.5);
        ray([place[0] - 8.0 * lean[0], place[1] - 8.0 * lean[1], 8.0], [lean[0], lean[1], -1.0])
    };
    (0..count).map(one).collect()
}
