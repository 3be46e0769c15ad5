//! The shine of fibers that stand up from a surface (Estevez and Kulla 2017, "Production friendly microfacet sheen BRDF"), as
//! KHR_materials_sheen has it.

use super::energy::{STEPS, place, step};
use glam::Vec3;
use std::array::from_fn;
use std::f32::consts::TAU;
use std::sync::OnceLock;

/// Samples along each axis for one entry of the table.
const SAMPLES: usize = 48;

/// Sheen above what else reflects.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sheen {
    color: Vec3,
    alpha: f32,
}

impl Sheen {
    /// Smoother fibers shine in a seam that is too narrow to be found.
    const MIN_ALPHA: f32 = 0.01;
    /// Density of the directions of [`Sheen::sample`].
    pub const PDF: f32 = 1.0 / TAU;

    pub fn new(color: Vec3, roughness: f32) -> Sheen {
        Sheen { color, alpha: (roughness * roughness).max(Self::MIN_ALPHA) }
    }

    /// What of light from `wi` leaves along `wo`. The model reflects more than comes at grazing angles where fibers are smooth:
    /// there it is divided by that.
    pub fn value(&self, wo: Vec3, wi: Vec3) -> Vec3 {
        let [most_o, most_i] = [wo.z, wi.z].map(|cosine| albedo_at(cosine, self.alpha));
        self.color * (value(self.alpha, wo, wi) / most_o.max(most_i).max(1.0))
    }

    /// Share of light from everywhere that is reflected to a viewer, of the color that most is reflected of.
    pub fn albedo(&self, cosine: f32) -> f32 {
        self.color.max_element() * albedo_at(cosine, self.alpha).min(1.0)
    }

    /// An even direction of the hemisphere: where sheen is seen from, it is nearly all at the horizon.
    pub fn sample([u, v]: [f32; 2]) -> Vec3 {
        let (sin, cos) = libm::sincosf(TAU * u);
        let r = (1.0 - v * v).max(0.0).sqrt();
        Vec3::new(r * cos, r * sin, v)
    }
}

/// Distribution over four times the cosines, with shadowing.
fn value(alpha: f32, wo: Vec3, wi: Vec3) -> f32 {
    let h = (wo + wi).normalize();
    let sine = (h.x * h.x + h.y * h.y).min(1.0).sqrt();
    let fibers = (2.0 + 1.0 / alpha) * libm::powf(sine, 1.0 / alpha) / TAU;
    let hidden = hidden(alpha, wo.z) + hidden(alpha, wi.z);
    fibers / ((1.0 + hidden) * 4.0 * wo.z * wi.z)
}

/// Area of hidden fibers over that of visible ones: the fit of the paper, equation 3 and table 1.
fn hidden(alpha: f32, cosine: f32) -> f32 {
    const SMOOTH: [f32; 5] = [25.3245, 3.32435, 0.16801, -1.27393, -4.85967];
    const ROUGH: [f32; 5] = [21.5473, 3.82987, 0.19823, -1.97760, -4.32054];
    let part = (1.0 - alpha) * (1.0 - alpha);
    let [a, b, c, d, e]: [f32; 5] = from_fn(|i| ROUGH[i] + (SMOOTH[i] - ROUGH[i]) * part);
    let fit = |x: f32| a / (1.0 + b * libm::powf(x, c)) + d * x + e;
    let x = cosine.clamp(0.0, 1.0);
    libm::expf(if x < 0.5 { fit(x) } else { 2.0 * fit(0.5) - fit(1.0 - x) })
}

/// Light from everywhere that white sheen reflects: from a table by alpha and cosine.
fn albedo_at(cosine: f32, alpha: f32) -> f32 {
    static TABLE: OnceLock<[[f32; STEPS]; STEPS]> = OnceLock::new();
    let table = TABLE.get_or_init(|| {
        from_fn(|alpha| {
            from_fn(|cosine| albedo(step(alpha).max(Sheen::MIN_ALPHA), step(cosine) * step(cosine)))
        })
    });
    let (row, between) = place(alpha);
    let (column, part) = place(cosine.max(0.0).sqrt());
    let of = |row: usize| table[row][column] + (table[row][column + 1] - table[row][column]) * part;
    of(row) + (of(row + 1) - of(row)) * between
}

fn albedo(alpha: f32, cosine: f32) -> f32 {
    let cosine = cosine.max(1e-3);
    let wo = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
    let mid = |i: usize| (i as f32 + 0.5) / SAMPLES as f32;
    let mut sum = 0.0;
    for i in 0..SAMPLES * SAMPLES {
        // More samples near the horizon; one half of all azimuths is as the other.
        let (u, azimuth) = (mid(i % SAMPLES), 0.5 * mid(i / SAMPLES));
        let wi = Sheen::sample([azimuth, u * u]);
        sum += value(alpha, wo, wi) * wi.z * (2.0 * u);
    }
    sum * TAU / (SAMPLES * SAMPLES) as f32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rough_fibers_shine_by_a_part_and_most_at_grazing_angles() {
        // As integrated by other means.
        for (alpha, cosine, expected) in [(1.0, 1.0, 0.164), (1.0, 0.1, 0.721), (0.25, 0.4, 0.247)] {
            let found = albedo_at(cosine, alpha);
            assert!((found - expected).abs() < 0.01, "{alpha} {cosine}: {found}");
        }
        let sheen = Sheen::new(Vec3::ONE, 0.0);
        assert!((0..100).all(|i| sheen.albedo(i as f32 / 100.0) <= 1.0));
    }

    #[test]
    fn both_ways_are_the_same() {
        let [a, b] = [[0.3, 0.02], [0.8, 0.9]].map(Sheen::sample);
        let sheen = Sheen::new(Vec3::new(1.0, 0.5, 0.2), 0.15);
        assert!((sheen.value(a, b) - sheen.value(b, a)).abs().max_element() < 1e-6);
    }
}
