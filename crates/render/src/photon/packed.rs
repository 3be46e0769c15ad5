//! Photons in few bytes.

use glam::{Vec2, Vec3};
use raystrips_geom::chance;

/// A photon where it landed: 28 bytes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Photon {
    pub p: Vec3,
    power: SharedExponent,
    /// Where it came from.
    from: Octahedral,
    /// Normal on that side.
    n: Octahedral,
    /// The axis along which a map is divided here.
    pub axis: u32,
}

impl Photon {
    /// One that came from the direction `from` to a surface with the normal `n` on that side.
    pub fn new(p: Vec3, n: Vec3, from: Vec3, power: Vec3) -> Photon {
        // Photons of a lamp have the same power, so what is always rounded the same way adds up: chance does it.
        let threshold = chance([[p.x, p.y], [p.z, 0.0]]);
        let power = SharedExponent::new(power, threshold);
        let (from, n) = (Octahedral::new(from), Octahedral::new(n));
        Photon { p, power, from, n, axis: 0 }
    }

    pub fn power(&self) -> Vec3 {
        self.power.get()
    }

    pub fn from(&self) -> Vec3 {
        self.from.get()
    }

    pub fn n(&self) -> Vec3 {
        self.n.get()
    }
}

/// Three numbers, at least 0, of eight bits with one exponent (Ward 1991).
#[derive(Clone, Copy, Debug)]
pub(super) struct SharedExponent([u8; 4]);

impl SharedExponent {
    const BIAS: i32 = 128;

    /// `threshold`, 0 to 1: what lies between two steps by more than one less it is the greater one.
    pub fn new(v: Vec3, threshold: f32) -> SharedExponent {
        let most = v.max_element();
        if !(most > 0.0 && most.is_finite()) {
            return SharedExponent([0; 4]);
        }
        // The greatest is 128 to 255 steps.
        let mut exponent = (libm::ilogbf(most) - 7).clamp(-Self::BIAS, 127);
        let rounded = |exponent: i32| (v * libm::ldexpf(1.0, -exponent) + threshold).floor();
        if rounded(exponent).max_element() > 255.0 {
            exponent = (exponent + 1).min(127);
        }
        let [r, g, b] = rounded(exponent).to_array().map(|x| x.clamp(0.0, 255.0) as u8);
        SharedExponent([r, g, b, (exponent + Self::BIAS) as u8])
    }

    pub fn get(self) -> Vec3 {
        let [r, g, b, exponent] = self.0;
        Vec3::new(r.into(), g.into(), b.into()) * libm::ldexpf(1.0, i32::from(exponent) - Self::BIAS)
    }
}

/// A direction as a point of the unfolded octahedron.
#[derive(Clone, Copy, Debug)]
struct Octahedral([u16; 2]);

impl Octahedral {
    fn new(dir: Vec3) -> Octahedral {
        let on_faces = dir / dir.abs().element_sum();
        let flat = match on_faces.z >= 0.0 {
            true => on_faces.truncate(),
            false => fold(on_faces.truncate()),
        };
        Octahedral((flat * 0.5 + 0.5).to_array().map(|x| (x * 65535.0).round() as u16))
    }

    fn get(self) -> Vec3 {
        let flat = Vec2::from(self.0.map(f32::from)) / 65535.0 * 2.0 - 1.0;
        let z = 1.0 - flat.x.abs() - flat.y.abs();
        let flat = if z >= 0.0 { flat } else { fold(flat) };
        flat.extend(z).normalize()
    }
}

/// The lower half of the octahedron lies outside of the upper one.
fn fold(v: Vec2) -> Vec2 {
    let sign = Vec2::select(v.cmpge(Vec2::ZERO), Vec2::ONE, Vec2::NEG_ONE);
    (1.0 - Vec2::new(v.y, v.x).abs()) * sign
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn photons_are_small() {
        assert_eq!(size_of::<Photon>(), 28);
        assert_eq!(SharedExponent::new(Vec3::ZERO, 0.5).get(), Vec3::ZERO);
    }

    #[test]
    fn power_is_right_in_the_mean() {
        let power = Vec3::new(2.99, 0.3, 0.017);
        let count = 1 << 14;
        let packed = |i| Photon::new(Vec3::new(i as f32, 0.5, 2.0), Vec3::Y, Vec3::Y, power).power();
        let mean = (0..count).map(packed).sum::<Vec3>() / count as f32;
        assert!((mean / power - 1.0).abs().max_element() < 0.01, "{mean}");
    }

    proptest! {
        #[test]
        fn what_is_packed_comes_back(
            dir in prop::array::uniform3(-1.0f32..1.0),
            power in prop::array::uniform3(0.0f32..1.0),
            log_scale in -20i32..20,
            threshold in 0.0f32..1.0,
        ) {
            let dir = Vec3::from(dir);
            prop_assume!(dir.length() > 1e-3);
            let dir = dir.normalize();
            prop_assert!((Octahedral::new(dir).get() - dir).length() < 1e-4);
            let power = Vec3::from(power) * libm::ldexpf(1.0, log_scale);
            let error = (SharedExponent::new(power, threshold).get() - power).abs().max_element();
            prop_assert!(error <= power.max_element() / 127.0);
        }
    }
}
