//! Sampling, values and densities agree; no energy is made.

use super::*;
use crate::sampler::PathSampler;
use raystrips_geom::scene::Material;
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

/// Viewers at some angles, before and behind the surface.
fn views() -> impl Iterator<Item = (Vec3, bool)> {
    [0.0f32, 0.5, 1.0, 1.4].into_iter().flat_map(|angle| {
        let dir = -Vec3::new(angle.sin(), 0.0, angle.cos());
        [(dir, true), (dir, false)]
    })
}

fn numbers(i: u32) -> ([f32; 2], f32) {
    let sampler = PathSampler::new([3, 5], i, 0);
    (sampler.get_2d(1), sampler.get_2d(2)[1])
}

const SAMPLES: u32 = 1 << 14;

/// Mean weight of what is sampled: the share of light from everywhere that reaches the viewer.
fn albedo(bsdf: &Bsdf, of: impl Fn(&Scattered) -> bool) -> f32 {
    let scattered = (0..SAMPLES).filter_map(|i| {
        let (u, choice) = numbers(i);
        bsdf.sample(u, choice)
    });
    scattered.filter(of).map(|s| s.weight.x).sum::<f32>() / SAMPLES as f32
}

#[test]
fn no_surface_makes_light() {
    for (name, material) in surfaces() {
        let material = ShadingMaterial::new(&material);
        for (dir, is_outside) in views() {
            let all = albedo(&Bsdf::new(&material, Vec3::Z, is_outside, dir), |_| true);
            assert!(all < 1.005, "{name} along {dir}: {all}");
            // Rough boundaries lose what facets send to each other, but for reflection.
            let least = match name {
                "frosted glass" | "milk glass" => 0.75,
                _ => 0.98,
            };
            assert!(all > least, "{name} along {dir}: {all}");
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
    for (name, material) in surfaces() {
        let material = ShadingMaterial::new(&material);
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
            let fine = 1 << 18;
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
    for (name, material) in surfaces() {
        let material = ShadingMaterial::new(&material);
        for (dir, is_outside) in views() {
            let bsdf = Bsdf::new(&material, Vec3::Z, is_outside, dir);
            let by_samples = albedo(&bsdf, |s| s.pdf.is_some());
            let count = 1 << 17;
            let value = |i| {
                let [u, z] = PathSampler::new([0, 0], i, 0).get_2d(0);
                let (sin, cos) = libm::sincosf(TAU * u);
                let r = (1.0 - z * z).sqrt();
                bsdf.evaluate(Vec3::new(r * cos, r * sin, z)).0.x * z * TAU
            };
            let by_values = (0..count).map(value).sum::<f32>() / count as f32;
            assert!((by_samples - by_values).abs() < 0.02, "{name} along {dir}: {by_samples} {by_values}");
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
