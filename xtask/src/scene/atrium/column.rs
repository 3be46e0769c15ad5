//! What is turned: columns, balusters, pedestals.

use super::patches::{Detail, Patches, Section};
use super::plan::Storey;
use glam::DVec3;

/// Flutes of a column.
const FLUTES: u32 = 20;

/// A column of a storey: a square foot, a base with two rings, a fluted shaft, and a capital.
pub fn column(detail: Detail, storey: Storey) -> Patches {
    let mut column = Patches::default();
    let r = storey.column;
    let height = storey.springing - storey.floor;
    let foot = storey.floor * DVec3::Y;
    for [y, half, high] in [[0.0, r * 1.45, 0.14], [height - 0.16, r * 1.5, 0.16]] {
        let low = foot + DVec3::new(-half, y, -half);
        column.block(detail, low, DVec3::new(2.0 * half, high, 2.0 * half));
    }
    let rings =
        [[1.42, 0.0], [1.46, 0.05], [1.4, 0.12], [1.2, 0.15], [1.15, 0.2], [1.22, 0.24], [1.24, 0.29]];
    let base: Vec<[f64; 2]> = rings.iter().map(|[x, y]| [r * x, 0.14 + y * 0.8]).collect();
    column.turned(detail, &[&base[..], &[[r * 1.0, 0.41]]].concat(), Section::Round, foot);
    // Thinner toward the top, and bulging a little on the way there.
    let begin = 0.38;
    let end = height - 0.52;
    let shaft: Vec<[f64; 2]> = (0..=8)
        .map(|i| f64::from(i) / 8.0)
        .map(|t| [r * (1.0 - 0.16 * t * t), begin + (end - begin) * t])
        .collect();
    column.turned(detail, &shaft, Section::Fluted(FLUTES), foot);
    let bell = [
        [0.83, 0.0],
        [0.94, 0.02],
        [0.96, 0.06],
        [0.86, 0.09],
        [0.88, 0.16],
        [1.02, 0.25],
        [1.3, 0.33],
        [1.4, 0.37],
    ];
    let bell: Vec<[f64; 2]> = bell.iter().map(|[x, y]| [r * x, end - 0.01 + y]).collect();
    column.turned(detail, &bell, Section::Round, foot);
    column
}

/// A baluster of a height, its foot at height 0.
pub fn baluster(detail: Detail, height: f64) -> Patches {
    let mut baluster = Patches::default();
    let outline = [
        [0.09, 0.0],
        [0.09, 0.08],
        [0.055, 0.1],
        [0.06, 0.14],
        [0.095, 0.28],
        [0.085, 0.4],
        [0.045, 0.62],
        [0.045, 0.78],
        [0.07, 0.82],
        [0.07, 0.86],
        [0.085, 0.9],
        [0.085, 1.0],
    ];
    let outline = outline.map(|[radius, y]| [radius, y * height]);
    baluster.turned(Detail { edge: detail.edge * 0.7 }, &outline, Section::Round, DVec3::ZERO);
    baluster
}

/// A square pedestal for statues.
pub fn pedestal(detail: Detail, half: f64, height: f64) -> Patches {
    let mut pedestal = Patches::default();
    let outline = [
        [1.18, 0.0],
        [1.18, 0.1],
        [1.14, 0.13],
        [1.04, 0.17],
        [1.0, 0.22],
        [1.0, 0.8],
        [1.04, 0.84],
        [1.15, 0.88],
        [1.18, 0.93],
        [1.18, 1.0],
        [0.0, 1.0],
    ];
    let outline = outline.map(|[radius, y]| [radius * half, y * height]);
    pedestal.turned(detail, &outline, Section::Square, DVec3::ZERO);
    pedestal
}
