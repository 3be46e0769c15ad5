//! How a surface scatters light: the metallic-roughness model of glTF 2.0 (appendix B), with transmission.
//!
//! A surface is a mixture of three lobes: reflection at a boundary of microfacets, which is that of a dielectric or of a
//! metal; below a dielectric, diffuse reflection (Lambert), or transmission (Walter, Marschner, Li, Torrance 2007). What
//! facets of a metal reflect to each other is added. A [`Film`] may color the boundary, and layers may lie over it all:
//! [`Layered`]. Below [`Ggx::MIN_ALPHA`] microfacets are a smooth boundary,
//! whose directions no light can be sampled for.
//!
//! Radiance is not scaled by the square of the index of refraction: what a path loses when it enters a medium it gains when
//! it leaves. Lamps inside of glass are brighter by that.

mod energy;
mod film;
mod fresnel;
mod ggx;
mod layered;
mod sheen;
#[cfg(test)]
mod tests;

use crate::material::ShadingMaterial;
use crate::sampling::cosine_hemisphere;
use energy::Coat;
use film::Film;
use ggx::Ggx;
use glam::{Vec2, Vec3};
use layered::Layered;
use std::f32::consts::FRAC_1_PI;

/// What is rougher reflects as if diffusely.
const DIFFUSE_ALPHA: f32 = 0.25;

/// How light that leaves towards the viewer comes from elsewhere.
pub(crate) struct Bsdf<'a> {
    material: &'a ShadingMaterial,
    /// Normal on the side of the viewer.
    n: Vec3,
    /// All but plain diffuse reflection.
    lobes: Option<Lobes>,
}

/// A direction that light may come from.
pub(crate) struct Scattered {
    pub wi: Vec3,
    /// What of it leaves towards the viewer, over the density of the direction.
    pub weight: Vec3,
    /// Density over solid angle, if lights are sampled for this direction too.
    pub pdf: Option<f32>,
    /// It comes through the surface.
    pub is_transmitted: bool,
    /// Index of refraction where it comes from over that here.
    pub eta: f32,
}

/// Mixture of lobes as seen from one side.
struct Lobes {
    /// Unit vectors at right angles to the normal and each other.
    tangents: (Vec3, Vec3),
    /// To the viewer, in the frame of tangents and normal.
    wo: Vec3,
    /// Index of refraction behind the surface over that before it.
    eta: f32,
    /// Nothing: a smooth boundary.
    facets: Option<Ggx>,
    /// What reflection by a metal is multiplied by, for light that facets reflect to each other.
    compensation: Vec3,
    /// On the boundary.
    film: Option<Film>,
    /// Over the boundary. From inside it only takes away.
    layered: Option<Layered>,
    /// Reflectance straight back of a dielectric without film, and without color.
    normal: Vec3,
    plain_normal: f32,
    /// The boundary above what reflects diffusely; from inside there is none.
    coat: Option<Coat>,
    /// Probabilities with which the boundary and diffuse reflection below it are chosen.
    choice: [f32; 2],
}

impl<'a> Bsdf<'a> {
    /// Of a surface seen along `dir`, with `n` on the side of the viewer; `is_outside`: the viewer is before its front.
    pub fn new(material: &'a ShadingMaterial, n: Vec3, is_outside: bool, dir: Vec3) -> Bsdf<'a> {
        let lobes = (!material.is_matte).then(|| Lobes::new(material, n, is_outside, dir));
        Bsdf { material, n, lobes }
    }

    /// True where nothing is scattered.
    pub fn is_black(&self) -> bool {
        match &self.lobes {
            None => self.material.albedo == Vec3::ZERO,
            Some(lobes) => {
                lobes.choice == [0.0; 2] && !lobes.layered.is_some_and(|layered| layered.is_wide(0.0))
            }
        }
    }

    /// True where light is spread so widely that it can be told from the photons of a place.
    pub fn is_diffuse(&self) -> bool {
        let Some(lobes) = &self.lobes else { return self.material.albedo != Vec3::ZERO };
        let is_rough = self.material.alpha_ggx >= DIFFUSE_ALPHA && self.material.transmitted() == Vec3::ZERO;
        lobes.choice[1] > 0.0
            || (is_rough && lobes.choice[0] > 0.0)
            || lobes.layered.is_some_and(|layered| layered.is_wide(DIFFUSE_ALPHA))
    }

    /// How much wider what is seen by way of the surface is far away: roughly, of the lobe that spreads most.
    pub fn spread(&self) -> f32 {
        /// Of diffuse reflection.
        const DIFFUSE: f32 = 0.5;
        let Some(lobes) = &self.lobes else { return DIFFUSE };
        let is_wide = lobes.layered.is_some_and(|layered| layered.is_wide(DIFFUSE_ALPHA));
        if lobes.choice[1] > 0.0 || is_wide { DIFFUSE } else { DIFFUSE * self.material.alpha_ggx }
    }

    /// What of light from `wi`, a unit vector on the viewer's side, is reflected to the viewer (without the cosine), and the
    /// density with which [`Bsdf::sample`] finds this direction.
    pub fn evaluate(&self, wi: Vec3) -> (Vec3, f32) {
        match &self.lobes {
            None => (self.material.albedo * FRAC_1_PI, self.n.dot(wi) * FRAC_1_PI),
            Some(lobes) => lobes.evaluate(self.material, lobes.local(self.n, wi)),
        }
    }

    /// Chooses a direction; `None` where the choice fell on one from which nothing comes.
    pub fn sample(&self, u: [f32; 2], choice: f32) -> Option<Scattered> {
        let Some(lobes) = &self.lobes else {
            let (wi, cosine) = cosine_hemisphere(self.n, u);
            let pdf = Some(cosine * FRAC_1_PI);
            return (cosine > 0.0).then_some(Scattered {
                wi,
                weight: self.material.albedo,
                pdf,
                is_transmitted: false,
                eta: 1.0,
            });
        };
        let scattered = lobes.sample(self.material, u, choice)?;
        let (s, t) = lobes.tangents;
        let Vec3 { x, y, z } = scattered.wi;
        Some(Scattered { wi: (s * x + t * y + self.n * z).normalize(), ..scattered })
    }
}

impl Lobes {
    fn new(material: &ShadingMaterial, n: Vec3, is_outside: bool, dir: Vec3) -> Lobes {
        let tangents = tangents(material, n);
        let to_viewer = -dir.normalize();
        let wo = Vec3::new(tangents.0.dot(to_viewer), tangents.1.dot(to_viewer), n.dot(to_viewer).max(1e-4));
        // Of what nothing is seen through only the outside is there.
        let eta = if is_outside || !material.is_solid() { material.ior } else { 1.0 / material.ior };
        let root = (eta - 1.0) / (eta + 1.0);
        let mut lobes = Lobes {
            tangents,
            wo,
            eta,
            facets: facets(material),
            compensation: Vec3::ONE,
            film: None,
            layered: None,
            normal: (root * root * material.specular_color).min(Vec3::ONE),
            plain_normal: root * root,
            coat: None,
            choice: [0.0; 2],
        };
        if let Some(layers) = &material.layers {
            let film = Film::new(layers.iridescence, layers.film_ior, layers.film_thickness[1]);
            lobes.film = (layers.iridescence > 0.0).then_some(film);
            let coat_normal = layers.clearcoat_normal.try_normalize().unwrap_or(n);
            lobes.layered = Layered::new(layers, lobes.local(n, coat_normal));
        }
        lobes.compensation = match lobes.facets {
            Some(ggx) if ggx.is_stretched() => {
                energy::stretched_compensation(wo.z, ggx.alpha.to_array(), material.albedo)
            }
            Some(_) => energy::compensation(wo.z, material.alpha_ggx, material.albedo),
            None => Vec3::ONE,
        };
        if eta >= 1.0 {
            let normal = lobes.film.map_or(lobes.normal, |film| film.bound(lobes.normal));
            lobes.coat = Some(Coat { alpha: material.alpha_ggx, normal, strength: material.specular });
        }
        lobes.choose(material);
        lobes
    }

    fn local(&self, n: Vec3, w: Vec3) -> Vec3 {
        Vec3::new(self.tangents.0.dot(w), self.tangents.1.dot(w), n.dot(w))
    }

    /// Lobes are chosen by about what they reflect of light from everywhere.
    fn choose(&mut self, material: &ShadingMaterial) {
        let [reflected, transmitted] = self.boundary(material, self.wo.z);
        let passed = self.coat.map_or(1.0, |coat| coat.passed(self.wo.z));
        let mut parts = [reflected + transmitted, material.diffuse().max_element() * passed, 0.0, 0.0];
        if self.film.is_some() {
            // It may be dark at this angle and bright at those of facets.
            parts[0] = parts[0].max(0.05);
        }
        if let Some(layered) = self.layered {
            let below = layered.passed([self.wo; 2]);
            let [coat, sheen] = if self.eta >= 1.0 { layered.reflected(self.wo) } else { [0.0; 2] };
            parts = [parts[0] * below, parts[1] * below, coat, sheen];
        }
        let sum: f32 = parts.iter().sum();
        if sum > 0.0 {
            let [boundary, diffuse, coat, sheen] = parts.map(|part| part / sum);
            self.choice = [boundary, diffuse];
            self.layered.iter_mut().for_each(|layered| layered.choose([coat, sheen]));
        }
    }

    /// How much a facet reflects and lets through at an angle of this cosine.
    fn boundary(&self, material: &ShadingMaterial, cosine: f32) -> [f32; 2] {
        [self.reflectance(material, cosine), self.transmitted(material, cosine)].map(Vec3::max_element)
    }

    /// Probability that reflection is chosen at a facet, and not transmission: by what that facet does, since it may reflect
    /// all where the surface as a whole hardly reflects.
    fn reflects(&self, material: &ShadingMaterial, cosine: f32) -> f32 {
        let [reflected, transmitted] = self.boundary(material, cosine);
        if transmitted > 0.0 { reflected / (reflected + transmitted) } else { 1.0 }
    }

    /// Reflectance of facets at an angle of this cosine: of glass, of what is opaque below its boundary, and of metal.
    fn reflectance(&self, material: &ShadingMaterial, cosine: f32) -> Vec3 {
        let glass = material.transmission * self.glass(material, cosine);
        let opaque =
            (1.0 - material.transmission) * self.coat.map_or(Vec3::ZERO, |coat| self.opaque(coat, cosine));
        let metal = self.filmed(fresnel::schlick(cosine, material.albedo), cosine, material.albedo);
        let metal = self.compensation * metal;
        (1.0 - material.metallic) * (glass + opaque) + metal * material.metallic
    }

    /// Reflectance, at an angle of this cosine, of a boundary above what reflects diffusely.
    fn opaque(&self, coat: Coat, cosine: f32) -> Vec3 {
        coat.strength * self.filmed(fresnel::schlick(cosine, self.normal), cosine, self.normal)
    }

    /// A reflectance with the film, if there is one.
    fn filmed(&self, reflectance: Vec3, cosine: f32, normal: Vec3) -> Vec3 {
        self.film.map_or(reflectance, |film| film.over(reflectance, cosine, normal))
    }

    /// Reflectance at an angle of this cosine of a boundary through which light goes.
    fn glass(&self, material: &ShadingMaterial, cosine: f32) -> Vec3 {
        let reflectance = fresnel::dielectric(cosine, self.eta);
        if reflectance >= 1.0 {
            return Vec3::ONE;
        }
        let colored = fresnel::colored(reflectance, self.plain_normal, self.normal);
        // The film is outside.
        let outside = if self.eta < 1.0 { fresnel::transmitted_cosine(cosine, self.eta) } else { None };
        let colored = self.filmed(colored, outside.unwrap_or(cosine), self.normal);
        let reflectance = material.specular * colored;
        if material.is_sheet() { fresnel::sheet(reflectance) } else { reflectance }
    }

    /// What of light at an angle of this cosine goes through the boundary and the material: of the color that most is reflected
    /// of, as of what is diffused.
    fn transmitted(&self, material: &ShadingMaterial, cosine: f32) -> Vec3 {
        material.transmitted() * (1.0 - self.glass(material, cosine).max_element())
    }

    /// What of light that is reflected to `wi` without the layers is left below them.
    fn below_layers(&self, wi: Vec3) -> f32 {
        let outside = match (wi.z > 0.0, self.eta >= 1.0) {
            (true, true) => [self.wo, wi],
            (true, false) => return 1.0,
            // Light goes through them once, outside.
            (false, true) => [self.wo; 2],
            (false, false) => [-wi; 2],
        };
        self.layered.map_or(1.0, |layered| layered.passed(outside))
    }

    fn evaluate(&self, material: &ShadingMaterial, wi: Vec3) -> (Vec3, f32) {
        if wi.z <= 0.0 {
            return (Vec3::ZERO, 0.0);
        }
        let (value, pdf) = self.evaluate_base(material, wi);
        match self.layered.filter(|_| self.eta >= 1.0) {
            Some(layered) => {
                let (above, above_pdf) = layered.evaluate(self.wo, wi);
                (above + value, above_pdf + pdf)
            }
            None => (value, pdf),
        }
    }

    /// Share of what is diffused that gets to where it is and back out to the viewer.
    fn diffused(&self, wi: Vec3) -> f32 {
        match (self.coat, &self.layered) {
            (Some(coat), Some(layered)) => layered.diffuse(coat, [self.wo, wi]),
            (Some(coat), None) => coat.diffuse([self.wo.z, wi.z]),
            (None, _) => 1.0,
        }
    }

    /// What the surface below the layers reflects to the viewer through them.
    fn evaluate_base(&self, material: &ShadingMaterial, wi: Vec3) -> (Vec3, f32) {
        let wo = self.wo;
        let h = (wo + wi).normalize();
        let cosine = wo.dot(h);
        let diffuse = material.diffuse() * (self.diffused(wi) * FRAC_1_PI);
        let diffuse_pdf = self.choice[1] * wi.z * FRAC_1_PI;
        let Some(ggx) = self.facets else { return (diffuse, diffuse_pdf) };
        let facets = ggx.facets(h) / (4.0 * wo.z);
        let visible = ggx.visible_from_both(wo, wi) * self.below_layers(wi);
        let reflected = self.reflectance(material, cosine) * (facets * visible / wi.z);
        let chosen = self.choice[0] * self.reflects(material, cosine);
        (diffuse + reflected, diffuse_pdf + chosen * facets * ggx.visible(wo))
    }

    fn sample(&self, material: &ShadingMaterial, u: [f32; 2], choice: f32) -> Option<Scattered> {
        let [boundary, diffuse] = self.choice;
        if let Some(layered) = self.layered.filter(|_| choice >= boundary + diffuse) {
            return match layered.sample(self.wo, u, choice - (boundary + diffuse)) {
                (_, Some(scattered)) => Some(scattered),
                (wi, None) => self.combined(material, wi),
            };
        }
        if choice >= boundary {
            return self.combined(material, cosine_hemisphere(Vec3::Z, u).0);
        }
        let h = self.facets.map_or(Vec3::Z, |ggx| ggx.sample(self.wo, u));
        let cosine = self.wo.dot(h);
        let reflected = boundary * self.reflects(material, cosine);
        if choice >= reflected {
            return self.transmit(material, h, boundary - reflected);
        }
        match self.facets {
            Some(_) => self.combined(material, mirrored(self.wo, h)),
            None => {
                let wi = mirrored(self.wo, h);
                let weight = self.reflectance(material, cosine) * (self.below_layers(wi) / reflected);
                Some(Scattered { wi, weight, pdf: None, is_transmitted: false, eta: 1.0 })
            }
        }
    }

    /// A direction of reflection that either lobe may have chosen.
    fn combined(&self, material: &ShadingMaterial, wi: Vec3) -> Option<Scattered> {
        let (value, pdf) = self.evaluate(material, wi);
        let weight = value * (wi.z / pdf);
        (wi.z > 0.0 && pdf > 0.0 && weight.is_finite()).then_some(Scattered {
            wi,
            weight,
            pdf: Some(pdf),
            is_transmitted: false,
            eta: 1.0,
        })
    }

    /// A direction behind a facet with normal `h`, at which transmission was chosen with this probability.
    fn transmit(&self, material: &ShadingMaterial, h: Vec3, probability: f32) -> Option<Scattered> {
        let cosine = self.wo.dot(h);
        let (wi, eta) = if material.is_sheet() {
            // What a rough sheet lets through is spread as what it reflects is.
            (mirrored(self.wo, h) * Vec3::new(1.0, 1.0, -1.0), 1.0)
        } else {
            let behind = fresnel::transmitted_cosine(cosine, self.eta)?;
            (h * (cosine / self.eta - behind) - self.wo / self.eta, self.eta)
        };
        let visible = self.facets.map_or(1.0, |ggx| ggx.visible(wi));
        let weight = self.transmitted(material, cosine) * (visible * self.below_layers(wi) / probability);
        (wi.z < 0.0 && weight.is_finite()).then_some(Scattered {
            wi,
            weight,
            pdf: None,
            is_transmitted: true,
            eta,
        })
    }
}

/// Unit vectors at right angles to `n` and each other: the first along the grain, if there is one.
fn tangents(material: &ShadingMaterial, n: Vec3) -> (Vec3, Vec3) {
    let grain = material.layers.map_or(Vec3::ZERO, |layers| layers.grain);
    match grain.reject_from_normalized(n).try_normalize() {
        Some(along) => (along, n.cross(along)),
        None => n.any_orthonormal_pair(),
    }
}

/// The facets of the boundary; `None` if it is smooth.
fn facets(material: &ShadingMaterial) -> Option<Ggx> {
    let alpha = material.alpha_ggx;
    let anisotropy = material.layers.map_or(0.0, |layers| layers.anisotropy);
    let along = alpha + (1.0 - alpha) * (anisotropy * anisotropy);
    (along >= Ggx::MIN_ALPHA).then(|| Ggx::stretched(Vec2::new(along, alpha.max(Ggx::MIN_ALPHA))))
}

/// The direction that `w` is reflected to by a mirror with normal `h`.
fn mirrored(w: Vec3, h: Vec3) -> Vec3 {
    h * (2.0 * w.dot(h)) - w
}
