//! What stands on the floors: vessels, tanks, bundles of tubes, pumps, cabinets.

use super::bay::Bay;
use super::materials::{Kind, any_of};
use super::shapes::{Bend, Frame, bend, block, collar, disc, lathe, tube};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Sides of a vessel.
const VESSEL_SIDES: u32 = 40;
/// Rings of each end of a vessel.
const HEAD_RINGS: u32 = 6;

/// The outline of a closed vessel from 0 to `length` with ends that are half ellipsoids.
fn vessel_profile(radius: f64, length: f64) -> Vec<[f64; 2]> {
    let depth = radius * 0.5;
    let head = |i: u32| libm::sincos(FRAC_PI_2 * f64::from(i) / f64::from(HEAD_RINGS));
    let lower = (0..=HEAD_RINGS).map(head).map(|(sin, cos)| [radius * sin, depth * (1.0 - cos)]);
    let upper =
        (1..HEAD_RINGS).rev().map(head).map(|(sin, cos)| [radius * sin, length - depth * (1.0 - cos)]);
    let upper = std::iter::once([radius, length - depth]).chain(upper);
    lower.chain(upper).chain([[0.0, length]]).collect()
}

/// An upright vessel on legs.
pub fn vessel(bay: &mut Bay, place: DVec3) {
    let [radius, height] = [bay.random.between(0.5, 1.3), bay.random.between(2.2, 3.1)];
    let material = any_of(Kind::Vessel, &mut bay.random);
    let foot = Frame::new(place + DVec3::Y * 0.5, DVec3::Y);
    bay.put(material, lathe(foot, &vessel_profile(radius, height), VESSEL_SIDES));
    for i in 0..4 {
        let leg = foot.around(radius * 0.85, TAU * (f64::from(i) + 0.5) / 4.0, -0.5);
        bay.put(material, block(leg - DVec3::new(0.06, 0.0, 0.06), DVec3::new(0.12, 1.2, 0.12)));
    }
    bay.nozzle(foot.moved(height - 0.03), radius * 0.2, 0.15);
    for _ in 0..2 + bay.random.below(4) {
        let along = bay.random.between(0.35, 0.65) * height;
        let angle = bay.random.between(0.0, TAU);
        let radial = (foot.around(1.0, angle, 0.0) - foot.origin).normalize();
        let mouth = Frame::new(foot.around(radius * 0.98, angle, along), radial);
        let size = bay.random.between(0.04, 0.15);
        bay.nozzle(mouth, size, 0.2);
    }
}

/// A lying tank on two saddles.
pub fn tank(bay: &mut Bay, place: DVec3) {
    let [radius, length] = [bay.random.between(0.4, 0.9), bay.random.between(3.0, 4.6)];
    let material = any_of(Kind::Vessel, &mut bay.random);
    let along = bay.random.of(&[DVec3::X, DVec3::Z]);
    let middle = place + DVec3::Y * (radius + 0.4);
    let frame = Frame::new(middle - along * (length / 2.0), along);
    bay.put(material, lathe(frame, &vessel_profile(radius, length), VESSEL_SIDES));
    let saddle =
        along * 0.2 + (DVec3::X + DVec3::Z - along) * (radius * 1.5) + DVec3::Y * (0.4 + radius * 0.35);
    for side in [0.22, 0.78] {
        let at = frame.origin + along * (length * side) - DVec3::Y * (radius + 0.4);
        bay.put(material, block(at - DVec3::new(saddle.x, 0.0, saddle.z) / 2.0, saddle));
        let bands = any_of(Kind::Flange, &mut bay.random);
        let band = frame.moved(length * side - 0.04);
        bay.put(bands, collar(band, [radius, radius + 0.015], 0.08, VESSEL_SIDES));
    }
    for side in [0.3, 0.5, 0.7] {
        let top = Frame::new(frame.origin + along * (length * side) + DVec3::Y * (radius * 0.98), DVec3::Y);
        let size = bay.random.between(0.05, 0.14);
        bay.nozzle(top, size, 0.2);
    }
}

/// Thin tubes side by side that turn back at their ends, as in a heat exchanger whose shell is off.
pub fn tube_bundle(bay: &mut Bay, place: DVec3) {
    const RADIUS: f64 = 0.02;
    let material = any_of(Kind::Tube, &mut bay.random);
    let [along, across] = bay.random.of(&[[DVec3::X, DVec3::Z], [DVec3::Z, DVec3::X]]);
    let length = bay.random.between(3.0, 4.5);
    let [columns, rows] = [4 + bay.random.below(6), 2 + bay.random.below(3)];
    for i in 0..columns * rows {
        let offset = across * (((i % columns) as f64 - columns as f64 / 2.0) * 0.075);
        let turn = 0.08 + 0.1 * (i / columns) as f64;
        let middle = place + offset + DVec3::Y * 1.1 - along * (length / 2.0);
        for side in [-turn, turn] {
            bay.put(material, tube(Frame::new(middle + DVec3::Y * side, along), RADIUS, length, 10));
        }
        let back = Bend {
            center: middle + along * length,
            begin: DVec3::Y,
            toward: along,
            radii: [turn, RADIUS],
            angle: PI,
        };
        bay.put(material, bend(&back, 10, 10));
    }
    let sheet = any_of(Kind::Flange, &mut bay.random);
    let size = along * 0.05 + across * (0.075 * columns as f64 + 0.2) + DVec3::Y * 1.7;
    for end in [-0.5, 0.0, 0.45] {
        let at = place + along * (length * end) + DVec3::Y * 0.02;
        bay.put(sheet, block(at - (size - DVec3::Y * size.y) / 2.0, size));
    }
}

/// A row of pumps with their motors.
pub fn pumps(bay: &mut Bay, place: DVec3) {
    let material = any_of(Kind::Machine, &mut bay.random);
    let radius = bay.random.between(0.16, 0.3);
    for i in 0..2 + bay.random.below(2) {
        let foot = place + DVec3::new(-1.2, 0.0, (i as f64 - 1.0) * radius * 5.0);
        pump(bay, foot, radius, material);
    }
}

fn pump(bay: &mut Bay, foot: DVec3, radius: f64, material: usize) {
    let concrete = any_of(Kind::Slab, &mut bay.random);
    let size = DVec3::new(radius * 8.0, 0.25, radius * 3.2);
    bay.put(concrete, block(foot - DVec3::Z * (size.z / 2.0), size));
    let shaft = Frame::new(foot + DVec3::new(radius, 0.3 + radius, 0.0), DVec3::X);
    bay.put(material, disc(shaft, radius * 1.05, radius * 1.2, 32));
    let steel = any_of(Kind::Flange, &mut bay.random);
    bay.put(steel, disc(shaft.moved(radius * 1.2), radius * 0.2, radius * 1.4, 12));
    bay.put(material, lathe(shaft.moved(radius * 2.6), &finned_profile(radius, radius * 3.6), 24));
    bay.nozzle(shaft.moved(-radius * 0.3), radius * 0.35, radius * 0.3);
    bay.nozzle(Frame::new(shaft.origin + DVec3::new(radius * 0.6, radius, 0.0), DVec3::Y), radius * 0.3, 0.2);
}

/// The outline of a motor with fins around it.
fn finned_profile(radius: f64, length: f64) -> Vec<[f64; 2]> {
    const FINS: u32 = 9;
    let mut profile = vec![[0.0, 0.0], [radius * 0.8, 0.0]];
    for i in 0..FINS {
        let at = |part: f64| length * (f64::from(i) + part) / f64::from(FINS);
        profile.extend([
            [radius * 0.8, at(0.3)],
            [radius, at(0.3)],
            [radius, at(0.6)],
            [radius * 0.8, at(0.6)],
        ]);
    }
    profile.extend([[radius * 0.8, length], [0.0, length]]);
    profile
}

/// A row of switch cabinets with doors and handles.
pub fn cabinets(bay: &mut Bay, place: DVec3) {
    let material = any_of(Kind::Cabinet, &mut bay.random);
    let steel = any_of(Kind::Flange, &mut bay.random);
    for i in 0..3 + bay.random.below(3) {
        let corner = place + DVec3::new(f64::from(i as u32) * 0.82 - 1.6, 0.02, -0.3);
        bay.put(material, block(corner, DVec3::new(0.8, 2.1, 0.6)));
        bay.put(material, block(corner + DVec3::new(0.03, 0.05, 0.6), DVec3::new(0.74, 2.0, 0.02)));
        bay.put(steel, disc(Frame::new(corner + DVec3::new(0.68, 1.0, 0.65), DVec3::Y), 0.012, 0.18, 8));
    }
}
