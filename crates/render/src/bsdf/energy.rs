//! Where light goes that a single reflection at microfacets does not send back: on from facet to facet, or below the
//! boundary.

use super::fresnel::schlick;
use super::ggx::Ggx;
use glam::Vec3;
use std::array::from_fn;
use std::sync::OnceLock;

/// Steps of alpha and of the square root of the cosine: at grazing angles most changes.
pub(super) const STEPS: usize = 32;
/// Samples along each axis for one entry.
const SAMPLES: u32 = 32;

/// Light from everywhere that facets send to a viewer after one reflection, by the Fresnel reflection of Schlick: it is
/// `mirror - glancing` times the reflectance straight back, and `glancing`.
#[derive(Clone, Copy, Debug, Default)]
struct Reflected {
    /// Of perfect mirrors.
    mirror: f32,
    /// Of facets that reflect nothing straight back.
    glancing: f32,
}

impl Reflected {
    fn mix(self, other: Reflected, part: f32) -> Reflected {
        Reflected {
            mirror: self.mirror + (other.mirror - self.mirror) * part,
            glancing: self.glancing + (other.glancing - self.glancing) * part,
        }
    }

    fn of(self, normal: f32) -> f32 {
        normal * (self.mirror - self.glancing) + self.glancing
    }
}

/// By alpha: for each cosine of the direction to the viewer, and the mean over all of these.
struct Tables {
    by_cosine: [[Reflected; STEPS]; STEPS],
    mean: [Reflected; STEPS],
}

impl Tables {
    fn get() -> &'static Tables {
        static TABLES: OnceLock<Tables> = OnceLock::new();
        TABLES.get_or_init(|| {
            let by_cosine =
                from_fn(|alpha| from_fn(|cosine| reflected(step(cosine) * step(cosine), step(alpha))));
            Tables { by_cosine, mean: from_fn(|alpha| mean(&by_cosine[alpha])) }
        })
    }

    fn at(&self, cosine: f32, alpha: f32) -> Reflected {
        let (row, between) = place(alpha);
        let (column, part) = place(cosine.max(0.0).sqrt());
        let of = |row: usize| self.by_cosine[row][column].mix(self.by_cosine[row][column + 1], part);
        of(row).mix(of(row + 1), between)
    }

    fn mean_at(&self, alpha: f32) -> Reflected {
        let (row, between) = place(alpha);
        self.mean[row].mix(self.mean[row + 1], between)
    }
}

pub(super) fn step(i: usize) -> f32 {
    i as f32 / (STEPS - 1) as f32
}

/// The step below a number from 0 to 1, and how far it is on the way to the next.
pub(super) fn place(x: f32) -> (usize, f32) {
    let scaled = x.clamp(0.0, 1.0) * (STEPS - 1) as f32;
    let step = (scaled as usize).min(STEPS - 2);
    (step, scaled - step as f32)
}

fn reflected(cosine: f32, alpha: f32) -> Reflected {
    let cosine = cosine.max(1e-3);
    let ggx = Ggx::new(alpha.max(Ggx::MIN_ALPHA));
    let wo = Vec3::new((1.0 - cosine * cosine).sqrt(), 0.0, cosine);
    let mid = |i: u32| (i as f32 + 0.5) / SAMPLES as f32;
    let mut sum = Reflected::default();
    for i in 0..SAMPLES * SAMPLES {
        let h = ggx.sample(wo, [mid(i % SAMPLES), mid(i / SAMPLES)]);
        let wi = h * (2.0 * wo.dot(h)) - wo;
        if wi.z > 0.0 {
            let part = ggx.visible_from_both(wo, wi) / ggx.visible(wo) / (SAMPLES * SAMPLES) as f32;
            let x = 1.0 - wo.dot(h).min(1.0);
            sum.mirror += part;
            sum.glancing += part * (x * x) * (x * x) * x;
        }
    }
    sum
}

/// The mean over the hemisphere, weighted by the cosine: trapezoids.
fn mean(by_cosine: &[Reflected; STEPS]) -> Reflected {
    let mut sum = Reflected::default();
    for i in 0..STEPS - 1 {
        let middle = by_cosine[i].mix(by_cosine[i + 1], 0.5);
        let [begin, end] = [i, i + 1].map(|i| (step(i) * step(i)) * (step(i) * step(i)));
        let weight = end - begin;
        sum.mirror += middle.mirror * weight;
        sum.glancing += middle.glancing * weight;
    }
    sum
}

/// What reflection by a metal is multiplied by so that a perfect one loses nothing (Turquin 2019, "Practical multiple
/// scattering compensation for microfacet models").
pub(super) fn compensation(cosine: f32, alpha: f32, normal: Vec3) -> Vec3 {
    let single = Tables::get().at(cosine, alpha).mirror;
    1.0 + normal * ((1.0 - single) / single)
}

/// The same where facets are wider along one direction: by the mean of both widths straight on, and not at all at grazing angles,
/// where it depends on the side from which they are seen. No light is made, but some is lost.
pub(super) fn stretched_compensation(cosine: f32, alphas: [f32; 2], normal: Vec3) -> Vec3 {
    let [along, across] = alphas.map(|alpha| Tables::get().at(cosine, alpha).mirror);
    let straight = 0.5 * (along + across);
    let single = 1.0 + (straight - 1.0) * (cosine * cosine);
    1.0 + normal * ((1.0 - single) / single)
}

/// A boundary of facets above what reflects diffusely.
#[derive(Clone, Copy, Debug)]
pub(super) struct Coat {
    pub alpha: f32,
    /// Reflectance straight back.
    pub normal: Vec3,
    /// What all reflection is multiplied by.
    pub strength: f32,
}

impl Coat {
    /// Share of light from everywhere that gets below the boundary, or from there to a viewer: of the color that most is
    /// reflected of, so that what is below keeps its hue.
    pub fn passed(&self, cosine: f32) -> f32 {
        1.0 - self.strength * Tables::get().at(cosine, self.alpha).of(self.normal.max_element())
    }

    /// Reflectance of a facet at an angle of this cosine.
    pub fn reflectance(&self, cosine: f32) -> Vec3 {
        self.strength * schlick(cosine, self.normal)
    }

    /// What diffuse reflection below is multiplied by, so that it and reflection at the boundary are all of the light where
    /// nothing is absorbed (Kelemen and Szirmay-Kalos 2001). By what a facet lets through, as the specification of glTF has
    /// it, a white surface would reflect more than comes.
    pub fn diffuse(&self, cosines: [f32; 2]) -> f32 {
        let mean = 1.0 - self.strength * Tables::get().mean_at(self.alpha).of(self.normal.max_element());
        let [a, b] = cosines.map(|cosine| self.passed(cosine));
        if mean > 0.0 { a * b / mean } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn smooth_mirrors_lose_nothing_and_rough_ones_much() {
        let tables = Tables::get();
        assert!((tables.at(0.9, 0.0).mirror - 1.0).abs() < 1e-3);
        // Seen straight on, of half-spherical microfacets: the integral of c / (1 + c).
        let rough = tables.at(1.0, 1.0).mirror;
        assert!((rough - (1.0 - std::f32::consts::LN_2)).abs() < 0.01, "{rough}");
        // The mean of (1 - cosine)^5, weighted by the cosine, is 1 / 21.
        assert!((tables.mean_at(0.0).glancing - 1.0 / 21.0).abs() < 2e-3);
    }
}
