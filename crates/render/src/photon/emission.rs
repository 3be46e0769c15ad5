//! Where photons begin: each light sends out as many as its share of the power.

use crate::{color::luminance, lights::AreaLights, sky::SkyLight};
use glam::{DVec3, Vec3};
use raystrips_geom::{
    Aabb, Ray,
    scene::{Light, LightKind, Sky},
};
use std::f32::consts::{PI, TAU};

/// All that shines.
pub(super) struct Emission<'a> {
    area_lights: AreaLights<'a>,
    lights: &'a [Light],
    sky: SkyLight<'a>,
    center: Vec3,
    radius: f32,
    /// Power up to and including each of: area lights together, the sky, each light without a surface.
    cumulative: Vec<f64>,
}

/// Random numbers of a photon.
pub(super) struct Numbers {
    /// Which light, and which side of it.
    pub choice: [f32; 2],
    pub place: [f32; 2],
    pub direction: [f32; 2],
}

impl<'a> Emission<'a> {
    pub fn new(
        area_lights: AreaLights<'a>,
        lights: &'a [Light],
        sky: SkyLight<'a>,
        bounds: &Aabb,
    ) -> Emission<'a> {
        let (center, radius) = match bounds.is_empty() {
            true => (Vec3::ZERO, 0.0),
            false => (bounds.center(), 0.5 * bounds.diagonal()),
        };
        let disc = PI * radius * radius;
        let finite = |power: f64| if power.is_finite() && power > 0.0 { power } else { 0.0 };
        let own = lights
            .iter()
            .map(|light| f64::from(luminance(Vec3::from(light.intensity)) * spread(light, disc)));
        let sky_power = match &sky {
            SkyLight::Smooth(sky) => f64::from(luminance(mean(sky)) * 4.0 * PI * disc),
            SkyLight::Environment(environment) => environment.total_luminance() * f64::from(disc),
        };
        let powers = [f64::from(PI) * area_lights.total_power(), sky_power].into_iter().chain(own);
        let cumulative = powers.scan(0.0, |sum, power| {
            *sum += finite(power);
            Some(*sum)
        });
        let cumulative = cumulative.collect();
        Emission { area_lights, lights, sky, center, radius, cumulative }
    }

    /// A photon's first ray and its power, if there were no others; `None` if nothing shines, or this one goes nowhere.
    pub fn photon(&self, numbers: &Numbers) -> Option<(Ray, Vec3)> {
        let total = self.cumulative.last().copied().unwrap_or(0.0);
        let target = f64::from(numbers.choice[0]) * total;
        let i = self.cumulative.partition_point(|&sum| sum <= target);
        let before = if i == 0 { 0.0 } else { self.cumulative[i - 1] };
        let probability = (self.cumulative.get(i)? - before) / total;
        let (ray, power) = match i {
            0 => self.area_lights.emit(numbers.place, numbers.choice[1], numbers.direction)?,
            1 => self.of_sky(numbers)?,
            _ => self.of_light(&self.lights[i - 2], numbers)?,
        };
        Some((ray, power / probability as f32))
    }

    fn of_sky(&self, numbers: &Numbers) -> Option<(Ray, Vec3)> {
        let (to_sky, power) = match self.sky {
            SkyLight::Smooth(_) => {
                let to_sky = on_sphere(numbers.direction, -1.0);
                (to_sky, self.sky.radiance(to_sky) * (4.0 * PI * self.disc()))
            }
            SkyLight::Environment(environment) => {
                let light = environment.sample(numbers.direction)?;
                (light.wi, environment.radiance(light.wi) * (self.disc() / light.pdf))
            }
        };
        Some((self.through_disc(-to_sky, numbers.place), power))
    }

    fn of_light(&self, light: &Light, numbers: &Numbers) -> Option<(Ray, Vec3)> {
        let power = Vec3::from(light.intensity).max(Vec3::ZERO) * spread(light, self.disc());
        let from = |position: [f64; 3], dir: Vec3| Ray::new(DVec3::from(position).as_vec3(), dir);
        match &light.kind {
            LightKind::Point { position } => {
                Some((from(*position, on_sphere(numbers.direction, -1.0)), power))
            }
            LightKind::Spot { position, direction, inner_angle, outer_angle } => {
                let axis = Vec3::from(*direction).try_normalize()?;
                let around = on_sphere(numbers.direction, libm::cosf(*outer_angle));
                let (s, t) = axis.any_orthonormal_pair();
                let falloff = crate::lights::spot_falloff(around.z, *inner_angle, *outer_angle);
                Some((from(*position, s * around.x + t * around.y + axis * around.z), power * falloff))
            }
            LightKind::Directional { direction } => {
                Some((self.through_disc(Vec3::from(*direction).try_normalize()?, numbers.place), power))
            }
        }
    }

    /// Area of a disc that no side of the scene is larger than.
    fn disc(&self) -> f32 {
        PI * self.radius * self.radius
    }

    /// A ray along `dir` that comes through an even point of that disc, before the scene.
    fn through_disc(&self, dir: Vec3, place: [f32; 2]) -> Ray {
        let (sin, cos) = libm::sincosf(TAU * place[0]);
        let r = self.radius * place[1].sqrt();
        let (s, t) = dir.any_orthonormal_pair();
        Ray::new(self.center - dir * self.radius + s * (r * cos) + t * (r * sin), dir)
    }
}

/// What the intensity of a light is multiplied by for its power, or for a spot the power it would have without its falloff.
fn spread(light: &Light, disc: f32) -> f32 {
    match &light.kind {
        LightKind::Point { .. } => 4.0 * PI,
        LightKind::Spot { outer_angle, .. } => TAU * (1.0 - libm::cosf(*outer_angle)),
        LightKind::Directional { .. } => disc,
    }
}

/// Even directions whose z is at least `least_z`.
fn on_sphere([u, v]: [f32; 2], least_z: f32) -> Vec3 {
    let z = 1.0 - v * (1.0 - least_z);
    let r = (1.0 - z * z).max(0.0).sqrt();
    let (sin, cos) = libm::sincosf(TAU * u);
    Vec3::new(r * cos, r * sin, z)
}

fn mean(sky: &Sky) -> Vec3 {
    match *sky {
        Sky::Constant(radiance) => radiance.into(),
        Sky::Gradient { zenith, horizon, ground } => {
            // Linear in the height of directions, which is spread evenly.
            0.5 * Vec3::from(horizon) + 0.25 * (Vec3::from(zenith) + Vec3::from(ground))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        environment::Environment,
        material::Materials,
        sampler::PathSampler,
        testing::{BruteWorld, lamp, quad},
        world::World,
    };

    fn mean_power(emission: &Emission) -> Vec3 {
        let count = 1 << 12;
        let photon = |i| {
            let sampler = PathSampler::new([0, 0], i, 0);
            let [choice, place, direction] = [0, 1, 2].map(|pair| sampler.get_2d(pair));
            emission.photon(&Numbers { choice, place, direction }).map_or(Vec3::ZERO, |(_, power)| power)
        };
        (0..count).map(photon).sum::<Vec3>() / count as f32
    }

    #[test]
    fn all_photons_have_the_power_of_all_lights() {
        let mut world = BruteWorld::default();
        world.add(&quad(Vec3::ZERO, Vec3::Z * 2.0, Vec3::X), lamp([1.0, 2.0, 3.0]));
        let materials = Materials::new(&world.description);
        let kind = LightKind::Point { position: [0.0; 3] };
        let point = [Light { name: String::new(), intensity: [5.0, 1.0, 0.0], kind }];
        let of = |lights, sky| {
            let area = AreaLights::new(world.emitters(), &materials);
            mean_power(&Emission::new(area, lights, sky, &world.bounds()))
        };
        let constant = |radiance: f32| SkyLight::Smooth(Sky::Constant([radiance; 3]));
        let dark = constant(0.0);
        let area = Vec3::new(1.0, 2.0, 3.0) * (2.0 * PI);
        assert!((of(&[], dark) - area).abs().max_element() < 0.01);
        let both = area + Vec3::new(5.0, 1.0, 0.0) * (4.0 * PI);
        assert!(((of(&point, dark) - both) / both.max(Vec3::ONE)).abs().max_element() < 0.02);
        // A radius of half the root of five.
        let even = Environment::new(3, 2, vec![[1.0; 3]; 6]);
        for sky in [constant(1.0), SkyLight::Environment(&even)] {
            let sky = of(&[], sky) - area;
            assert!((sky / (4.0 * PI * PI * 1.25) - 1.0).abs().max_element() < 0.02, "{sky}");
        }
    }
}
