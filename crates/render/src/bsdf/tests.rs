//! Sampling, values and densities agree; no energy is made.

use super::*;
use crate::sampler::PathSampler;
use raystrips_geom::scene::{Anisotropy, Clearcoat, Iridescence, Material, Sheen};
use std::f32::consts::TAU;

fn surfaces() -> Vec<(&'static str, Material)> {
    let of = |material: Material| Material { base_color: [1.0; 3], ..material };
    vec![
        ("matte", of(Material::default())),
        ("plastic", of(Material { specular: 1.0, roughness: 0.5, ..Material::default() })),
        ("smooth plastic", of(Material { specular: 1.0, roughness: 0.0, ..Material::default() })),
        ("metal", of(Material { metallic: 1.0, roughness: 0.6, ..Material::default() })),
        ("rough metal", of(Material { metallic: 1.0, roughness: 1.0, ..Material::default() })),
        (
            "half a metal",
            of(Material { metallic: 0.5, specular: 1.0, roughness: 0.7, ..Material::default() }),
        ),
        ("glass", of(Material { specular: 1.0, transmission: 1.0, roughness: 0.0, ..Material::default() })),
        (
            "frosted glass",
            of(Material { specular: 1.0, transmission: 1.0, roughness: 0.5, ..Material::default() }),
        ),
        (
            "window",
            of(Material {
                specular: 1.0,
                transmission: 1.0,
                roughness: 0.0,
                thin: true,
                ..Material::default()
            }),
        ),
        (
            "milk glass",
            of(Material { specular: 1.0, transmission: 0.5, roughness: 0.3, ..Material::default() }),
        ),
    ]
}

/// White materials with layers.
fn layered() -> Vec<(&'static str, Material)> {
    let white = Material { base_color: [1.0; 3], roughness: 0.6, ..Material::default() };
    let plastic = Material { specular: 1.0, ..white.clone() };
    let metal = Material { metallic: 1.0, roughness: 0.4, ..white.clone() };
    let coated = |strength, roughness, base: &Material| Material {
        clearcoat: Clearcoat { strength, roughness, ..Clearcoat::default() },
        ..base.clone()
    };
    let woolly = |roughness, base: &Material| Material {
        sheen: Sheen { color: [0.9, 0.5, 0.2], roughness },
        ..base.clone()
    };
    let brushed = |strength, base: &Material| Material {
        anisotropy: Anisotropy { strength, rotation: 0.0 },
        ..base.clone()
    };
    let filmed = |ior, thickness, base: &Material| Material {
        iridescence: Iridescence { strength: 1.0, ior, thickness, ..Iridescence::default() },
        ..base.clone()
    };
    let glass = Material { transmission: 1.0, roughness: 0.0, ..plastic.clone() };
    vec![
        ("colored plastic", Material { specular_color: [4.0, 1.0, 0.0], ..plastic.clone() }),
        ("colored glass", Material { specular_color: [4.0, 1.0, 0.0], ..glass.clone() }),
        ("smooth coat", coated(1.0, 0.0, &white)),
        ("rough coat", coated(0.8, 0.5, &white)),
        ("coat on metal", coated(1.0, 0.2, &metal)),
        ("coat on glass", coated(1.0, 0.0, &glass)),
        ("velvet", woolly(0.3, &white)),
        ("felt", woolly(1.0, &plastic)),
        ("smooth fibers", woolly(0.05, &white)),
        ("coat on felt", coated(1.0, 0.3, &woolly(0.8, &plastic))),
        ("brushed metal", brushed(0.7, &metal)),
        ("strongly brushed metal", brushed(1.0, &Material { roughness: 0.25, ..metal.clone() })),
        ("brushed plastic", brushed(0.8, &plastic)),
        ("film on plastic", filmed(1.8, 350.0, &plastic)),
        ("film on metal", filmed(1.3, 400.0, &metal)),
        ("soap", filmed(1.33, 500.0, &Material { thin: true, ior: 1.0, ..glass })),
    ]
}

fn all() -> impl Iterator<Item = (&'static str, ShadingMaterial)> {
    let all = surfaces().into_iter().chain(layered());
    all.map(|(name, material)| (name, ShadingMaterial::new(&material))).chain(leaning_coats())
}

/// Coats whose normal is not that of the surface.
fn leaning_coats() -> impl Iterator<Item = (&'static str, ShadingMaterial)> {
    let plastic = Material { base_color: [1.0; 3], specular: 1.0, roughness: 0.6, ..Material::default() };
    [("leaning smooth coat", 0.0), ("leaning rough coat", 0.4)].into_iter().map(move |(name, roughness)| {
        let clearcoat = Clearcoat { strength: 1.0, roughness, ..Clearcoat::default() };
        let mut material = ShadingMaterial::new(&Material { clearcoat, ..plastic.clone() });
        material.layers.iter_mut().for_each(|layers| layers.clearcoat_normal = Vec3::new(0.28, 0.0, 0.96));
        (name, material)
    })
}

/// Viewers at some angles, before and behind the surface.
fn views() -> impl Iterator<Item = (Vec3, bool)> {
    [0.0f32, 0.5, 1.0, 1.4].into_iter().flat_map(|angle| {
        let dir = -Vec3::new(0.8 * angle.sin(), 0.6 * angle.sin(), angle.cos());
        [(dir, true), (dir, false)]
    })
}

fn numbers(i: u32) -> ([f32; 2], f32) {
    let sampler = PathSampler::new([3, 5], i, 0);
    (sampler.get_2d(1), sampler.get_2d(2)[1])
}

const SAMPLES: u32 = 1 << 14;

/// Mean weight of what is sampled: the share of light from everywhere that reaches the viewer.
fn albedo(bsdf: &Bsdf, of: impl Fn(&Scattered) -> bool) -> Vec3 {
    let scattered = (0..SAMPLES).filter_map(|i| {
        let (u, choice) = numbers(i);
        bsdf.sample(u, choice)
    });
    scattered.filter(of).map(|s| s.weight).sum::<Vec3>() / SAMPLES as f32
}

#[test]
fn no_surface_makes_light() {
    for (name, material) in all() {
        for (dir, is_outside) in views() {
            let all = albedo(&Bsdf::new(&material, Vec3::Z, is_outside, dir), |_| true);
            assert!(all.max_element() < 1.005, "{name} along {dir}: {all}");
            // Rough boundaries lose what facets send to each other, but for reflection.
            let least = match name {
                "frosted glass" | "milk glass" => 0.75,
                // What layers reflect of light at other angles is taken from facets below, too, and rough metals below
                // them, or of two widths, lose some of what facets send to each other.
                "coat on metal" | "felt" | "velvet" | "smooth fibers" | "coat on felt" => 0.8,
                "brushed metal" => 0.75,
                "strongly brushed metal" => 0.6,
                // From inside the coat takes its part and does not send it back.
                "film on plastic" | "coat on glass" | "brushed plastic" => 0.9,
                // Some of what leaning coats reflect goes below the surface.
                "leaning smooth coat" | "leaning rough coat" => 0.85,
                "film on metal" => 0.95,
                _ => 0.98,
            };
            assert!(all.max_element() > least, "{name} along {dir}: {all}");
        }
    }
}

#[test]
fn densities_are_those_of_the_samples() {
    const BINS: usize = 8;
    let bin = |w: Vec3| {
        let turn = libm::atan2f(w.y, w.x) / TAU + 0.5;
        let place = |x: f32| ((x * BINS as f32) as usize).min(BINS - 1);
        place(w.z) * BINS + place(turn)
    };
    for (name, material) in all() {
        for (dir, is_outside) in views() {
            let bsdf = Bsdf::new(&material, Vec3::Z, is_outside, dir);
            let (mut sampled, mut expected) = ([0.0; BINS * BINS], [0.0; BINS * BINS]);
            for i in 0..SAMPLES {
                let (u, choice) = numbers(i);
                if let Some(Scattered { wi, pdf: Some(pdf), .. }) = bsdf.sample(u, choice) {
                    sampled[bin(wi)] += 1.0 / SAMPLES as f32;
                    assert!((bsdf.evaluate(wi).1 / pdf - 1.0).abs() < 1e-2, "{name}");
                }
            }
            let fine = 1 << 17;
            for i in 0..fine {
                let [u, z] = PathSampler::new([0, 0], i, 0).get_2d(0);
                let (sin, cos) = libm::sincosf(TAU * (u - 0.5));
                let r = (1.0 - z * z).sqrt();
                let w = Vec3::new(r * cos, r * sin, z);
                expected[bin(w)] += bsdf.evaluate(w).1 * TAU / fine as f32;
            }
            for (sampled, expected) in sampled.iter().zip(expected) {
                // Chance, and the rest for the finite sums.
                let chance = 4.0 * (expected / SAMPLES as f32).sqrt();
                assert!(
                    (sampled - expected).abs() < chance + 0.003,
                    "{name} along {dir}: {sampled} {expected}"
                );
            }
        }
    }
}

#[test]
fn samples_and_values_give_the_same_reflection() {
    for (name, material) in all() {
        for (dir, is_outside) in views() {
            let bsdf = Bsdf::new(&material, Vec3::Z, is_outside, dir);
            let by_samples = albedo(&bsdf, |s| s.pdf.is_some());
            let count = 1 << 16;
            let value = |i| {
                let [u, z] = PathSampler::new([0, 0], i, 0).get_2d(0);
                let (sin, cos) = libm::sincosf(TAU * u);
                let r = (1.0 - z * z).sqrt();
                bsdf.evaluate(Vec3::new(r * cos, r * sin, z)).0 * (z * TAU)
            };
            let by_values = (0..count).map(value).sum::<Vec3>() / count as f32;
            let difference = (by_samples - by_values).abs().max_element();
            assert!(difference < 0.02, "{name} along {dir}: {by_samples} {by_values}");
        }
    }
}

#[test]
fn no_sample_of_glass_counts_more_than_the_surface_lets_through() {
    // Near the critical angle some facets reflect all and others next to nothing: each must be chosen by what it does.
    let glass = surfaces().into_iter().filter(|(name, _)| matches!(*name, "glass" | "frosted glass"));
    for (name, material) in glass {
        let material = ShadingMaterial::new(&material);
        for angle in (0..15).map(|i| i as f32 * 0.1) {
            let dir = -Vec3::new(angle.sin(), 0.0, angle.cos());
            for is_outside in [true, false] {
                let bsdf = Bsdf::new(&material, Vec3::Z, is_outside, dir);
                let scattered =
                    (0..SAMPLES >> 2).map(numbers).filter_map(|(u, choice)| bsdf.sample(u, choice));
                let most = scattered.map(|s| s.weight.max_element()).fold(0.0, f32::max);
                assert!(most < 1.001, "{name} at {angle}: {most}");
            }
        }
    }
}

#[test]
fn light_is_refracted_by_snells_law() {
    let glass =
        Material { specular: 1.0, transmission: 1.0, roughness: 0.0, ior: 1.5, ..Material::default() };
    let material = ShadingMaterial::new(&glass);
    let dir = Vec3::new(0.6, 0.0, -0.8);
    let transmitted =
        |is_outside: bool| Bsdf::new(&material, Vec3::Z, is_outside, dir).sample([0.5; 2], 0.999);
    let into = transmitted(true).filter(|s| s.is_transmitted).unwrap();
    assert!((into.wi.x - 0.4).abs() < 1e-5 && into.wi.z < 0.0, "{}", into.wi);
    let out = transmitted(false).filter(|s| s.is_transmitted).unwrap();
    assert!((out.wi.x - 0.9).abs() < 1e-5 && out.wi.z < 0.0, "{}", out.wi);
}

#[test]
fn brushed_metal_makes_no_light_from_any_side() {
    for (strength, roughness) in [(0.3, 0.1), (0.7, 0.4), (1.0, 0.25), (1.0, 0.6), (0.5, 0.8)] {
        let metal = Material { base_color: [1.0; 3], metallic: 1.0, roughness, ..Material::default() };
        let metal = Material { anisotropy: Anisotropy { strength, rotation: 0.0 }, ..metal };
        let material = ShadingMaterial::new(&metal);
        let angles = |i| [0.0f32, 0.4, 0.8, 1.1, 1.3, 1.5].map(|angle| (i as f32 * 0.5, angle));
        for (azimuth, angle) in (0..4).flat_map(angles) {
            let (sin, cos) = libm::sincosf(azimuth);
            let dir = -Vec3::new(angle.sin() * cos, angle.sin() * sin, angle.cos());
            let all = albedo(&Bsdf::new(&material, Vec3::Z, true, dir), |_| true).x;
            assert!((0.5..1.005).contains(&all), "{strength} {roughness} along {dir}: {all}");
        }
    }
}

#[test]
fn both_ways_reflect_the_same() {
    let [a, b] = [Vec3::new(0.48, 0.36, 0.8), Vec3::new(-0.6, 0.64, 0.48)];
    // What facets of metals send to each other is by the direction to the viewer alone, and by a normal that is not that of
    // the surface directions have other cosines.
    let leans =
        |material: &ShadingMaterial| material.layers.is_some_and(|l| l.clearcoat_normal != Vec3::ZERO);
    for (name, material) in all().filter(|(_, material)| material.metallic == 0.0 && !leans(material)) {
        let value = |wo: Vec3, wi: Vec3| Bsdf::new(&material, Vec3::Z, true, -wo).evaluate(wi).0;
        let (there, back) = (value(a, b), value(b, a));
        assert!((there - back).abs().max_element() < 1e-5, "{name}: {there} {back}");
    }
}

#[test]
fn numbers_that_make_no_sense_give_no_such_light() {
    let hostile = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -1.0, 1e30, 0.0];
    for x in hostile {
        let material = Material {
            roughness: x,
            metallic: 0.5,
            specular: x,
            specular_color: [x, 1.0, x],
            ior: x,
            transmission: 0.3,
            clearcoat: Clearcoat { strength: 1.0, roughness: x, ..Clearcoat::default() },
            sheen: Sheen { color: [x, x, 1.0], roughness: x },
            anisotropy: Anisotropy { strength: 0.5, rotation: x },
            iridescence: Iridescence { strength: 1.0, ior: x, least_thickness: x, thickness: x },
            ..Material::default()
        };
        let mut material = ShadingMaterial::new(&material);
        material.layers.as_mut().unwrap().set_grain(Vec2::X, [Vec3::splat(x), Vec3::Z]);
        for (dir, is_outside) in views() {
            let bsdf = Bsdf::new(&material, Vec3::Z, is_outside, dir);
            let all = albedo(&bsdf, |_| true);
            assert!(all.cmpge(Vec3::ZERO).all() && all.max_element() < 1.1, "{x} along {dir}: {all}");
        }
    }
}

#[test]
fn a_smooth_coat_is_a_mirror_at_right_angles_to_its_own_normal() {
    let (_, material) = leaning_coats().next().unwrap();
    let wo = Vec3::new(0.0, 0.6, 0.8);
    let bsdf = Bsdf::new(&material, Vec3::Z, true, -wo);
    let scattered = (0..SAMPLES).filter_map(|i| bsdf.sample(numbers(i).0, numbers(i).1));
    let mut mirrored = scattered.filter(|scattered| scattered.pdf.is_none()).peekable();
    assert!(mirrored.peek().is_some());
    let halfway = Vec3::new(0.28, 0.0, 0.96);
    assert!(mirrored.all(|scattered| ((wo + scattered.wi).normalize() - halfway).length() < 1e-4));
}
