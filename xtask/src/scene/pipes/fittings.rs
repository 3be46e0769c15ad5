//! What sits on pipes: flanges with their bolts, valves, hangers.

use super::bay::Bay;
use super::materials::{Kind, any_of};
use super::shapes::{Bend, Frame, bend, collar, disc, lathe, tube};
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// How much wider than its pipe a flange is.
const FLANGE: f64 = 1.65;

/// Sides of a round part, as CAD programs choose them: by the error of the chord.
pub fn sides_of(radius: f64) -> u32 {
    ((radius / 0.0015).sqrt() * 1.6).clamp(8.0, 40.0) as u32 & !1
}

/// Two flanges against each other, with bolts, about the origin of the frame.
pub fn flanges(bay: &mut Bay, frame: Frame, radius: f64) {
    let material = any_of(Kind::Flange, &mut bay.random);
    let thickness = thickness(radius);
    let sides = sides_of(radius * FLANGE);
    for begin in [-thickness * 1.1, thickness * 0.1] {
        bay.put(material, collar(frame.moved(begin), [radius, radius * FLANGE], thickness, sides));
    }
    bolts(bay, frame.moved(-thickness * 1.1), radius, thickness * 2.2);
}

/// A flange with a lid at the end of a pipe.
pub fn blind_flange(bay: &mut Bay, frame: Frame, radius: f64) {
    let material = any_of(Kind::Flange, &mut bay.random);
    let thickness = thickness(radius);
    let sides = sides_of(radius * FLANGE);
    bay.put(material, disc(frame, radius * FLANGE, thickness, sides));
    bay.put(material, disc(frame.moved(thickness * 1.05), radius * FLANGE, thickness, sides));
    bolts(bay, frame, radius, thickness * 2.05);
}

fn thickness(radius: f64) -> f64 {
    0.012 + radius * 0.2
}

/// Bolts around a pair of flanges that is `length` thick.
fn bolts(bay: &mut Bay, frame: Frame, radius: f64, length: f64) {
    let material = any_of(Kind::Bolt, &mut bay.random);
    let count = 4 * (1 + (radius / 0.07) as u32).min(3);
    let circle = radius * (1.0 + FLANGE) / 2.0;
    let size = (PI * circle / f64::from(count)).min(radius * (FLANGE - 1.0)) * 0.42;
    for i in 0..count {
        let place = frame.around(circle, TAU * f64::from(i) / f64::from(count), 0.0);
        bolt(bay, Frame::new(place, frame.axis), material, size, length);
    }
}

/// Head and nut beyond both ends of `length`; what is between them is not seen.
pub fn bolt(bay: &mut Bay, frame: Frame, material: usize, size: f64, length: f64) {
    for begin in [-size * 0.8, length] {
        bay.put(material, disc(frame.moved(begin), size, size * 0.8, 6));
    }
}

/// A valve with a hand wheel, about the origin of the frame.
pub fn valve(bay: &mut Bay, frame: Frame, radius: f64) {
    let material = any_of(Kind::Valve, &mut bay.random);
    let reach = radius * 2.4;
    let body: Vec<[f64; 2]> = (0..=10)
        .map(|i| PI * f64::from(i) / 10.0)
        .map(|a| [radius * (1.02 + 0.75 * libm::sin(a)), -reach * 0.8 * libm::cos(a)])
        .collect();
    bay.put(material, lathe(frame, &body, sides_of(radius * 1.7)));
    flanges(bay, frame.moved(-reach), radius);
    flanges(bay, frame.moved(reach), radius);
    let up = if frame.axis.y.abs() > 0.5 { DVec3::X } else { DVec3::Y };
    let stem = Frame::new(frame.origin + up * radius, up);
    let bonnet = [
        [radius, 0.0],
        [radius * 0.95, radius],
        [radius * 0.35, radius * 1.4],
        [radius * 0.35, radius * 2.2],
    ];
    bay.put(material, lathe(stem, &bonnet, 16));
    hand_wheel(bay, stem.moved(radius * 2.2), radius * 1.5);
}

fn hand_wheel(bay: &mut Bay, frame: Frame, radius: f64) {
    let material = any_of(Kind::Wheel, &mut bay.random);
    let rim = radius * 0.09;
    bay.put(material, disc(frame, rim * 1.6, radius * 0.9, 8));
    let hub = frame.moved(radius * 0.7);
    let begin = (hub.around(1.0, 0.0, 0.0) - hub.origin).normalize();
    let toward = frame.axis.cross(begin);
    let ring = Bend { center: hub.origin, begin, toward, radii: [radius, rim], angle: TAU };
    bay.put(material, bend(&ring, 20, 8));
    for i in 0..4 {
        let spoke = (hub.around(1.0, TAU * f64::from(i) / 4.0, 0.0) - hub.origin).normalize();
        bay.put(material, tube(Frame::new(hub.origin, spoke), rim * 0.7, radius, 6));
    }
}

/// A clamp about the pipe and a rod that holds it from above.
pub fn hanger(bay: &mut Bay, frame: Frame, radius: f64, height: f64) {
    let material = any_of(Kind::Beam, &mut bay.random);
    bay.put(material, collar(frame.moved(-0.02), [radius, radius + 0.012], 0.04, sides_of(radius)));
    let top = frame.origin + DVec3::Y * (radius + 0.01);
    bay.put(material, disc(Frame::new(top, DVec3::Y), 0.008, height, 6));
}
