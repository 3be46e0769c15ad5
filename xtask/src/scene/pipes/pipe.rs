//! Pipes: straight pieces along the coordinate axes, elbows between them, fittings on them.

use super::bay::{Bay, LEVEL, SIZE};
use super::fittings::{blind_flange, flanges, hanger, sides_of, valve};
use super::materials::{Kind, any_of};
use super::shapes::{Bend, Frame, bend, tube};
use glam::DVec3;
use std::f64::consts::FRAC_PI_2;

/// Radius of the center line of an elbow, in radii of the pipe.
const ELBOW: f64 = 3.0;
/// Segments along an elbow.
const ELBOW_SEGMENTS: u32 = 7;
/// Radii of pipes, in meters.
const RADII: [f64; 8] = [0.017, 0.024, 0.03, 0.044, 0.057, 0.084, 0.11, 0.16];
/// Most legs of a pipe.
const MAX_LEGS: usize = 8;

const DIRECTIONS: [DVec3; 6] = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];

/// A pipe that goes its ways in the box from `min`.
pub fn wander(bay: &mut Bay, min: DVec3, size: DVec3) {
    let radius = bay.random.of(&RADII);
    let bend_radius = radius * ELBOW;
    let any_place = |bay: &mut Bay| min + size * DVec3::from_array([0; 3].map(|_| bay.random.unit()));
    let mut at = any_place(bay);
    let mut toward = bay.random.of(&DIRECTIONS);
    let material = any_of(Kind::Pipe, &mut bay.random);
    for _ in 0..1 + bay.random.below(MAX_LEGS) {
        let room = room(at, toward, min, size);
        if room < bend_radius * 4.0 {
            break;
        }
        let length = bay.random.between(bend_radius * 3.0, room.min(bend_radius * 3.0 + 6.0));
        let frame = Frame::new(at, toward);
        leg(bay, frame, radius, length - bend_radius, material);
        let corner = at + toward * length;
        let turn = turn(bay, corner, toward, min, size);
        elbow(bay, corner, [toward, turn], radius, material);
        at = corner + turn * bend_radius;
        toward = turn;
    }
    blind_flange(bay, Frame::new(at, toward), radius);
}

/// How far it is to the end of the box.
fn room(at: DVec3, toward: DVec3, min: DVec3, size: DVec3) -> f64 {
    let end = if toward.min_element() < 0.0 { min } else { min + size };
    (end - at).dot(toward)
}

/// A direction at right angles that leads away from the nearer wall more often than not.
fn turn(bay: &mut Bay, at: DVec3, toward: DVec3, min: DVec3, size: DVec3) -> DVec3 {
    let first = bay.random.below(DIRECTIONS.len());
    let around = (0..DIRECTIONS.len()).map(|i| DIRECTIONS[(first + i) % DIRECTIONS.len()]);
    let across = around.filter(|d| d.dot(toward) == 0.0);
    across
        .take(2)
        .max_by(|a, b| room(at, *a, min, size).total_cmp(&room(at, *b, min, size)))
        .unwrap_or(DVec3::Y)
}

/// A straight piece with what sits on it.
fn leg(bay: &mut Bay, frame: Frame, radius: f64, length: f64, material: usize) {
    bay.put(material, tube(frame, radius, length, sides_of(radius)));
    if length > 12.0 * radius && bay.random.chance(0.5) {
        flanges(bay, frame.moved(length * 0.25), radius);
    }
    if length > 14.0 * radius && bay.random.chance(0.22) {
        valve(bay, frame.moved(length * 0.62), radius);
    }
    if frame.axis.y == 0.0 && length > 1.0 {
        hanger(bay, frame.moved(length * 0.45), radius, 0.5);
    }
    if length > 8.0 * radius && bay.random.chance(0.12) {
        let insulation = any_of(Kind::Insulation, &mut bay.random);
        bay.put(insulation, tube(frame.moved(length * 0.1), radius * 1.45, length * 0.3, sides_of(radius)));
    }
}

/// The bend at a corner where the pipe turns from one direction to another.
fn elbow(bay: &mut Bay, corner: DVec3, [from, to]: [DVec3; 2], radius: f64, material: usize) {
    let bend_radius = radius * ELBOW;
    let elbow = Bend {
        center: corner + (to - from) * bend_radius,
        begin: -to,
        toward: from,
        radii: [bend_radius, radius],
        angle: FRAC_PI_2,
    };
    bay.put(material, bend(&elbow, ELBOW_SEGMENTS, sides_of(radius)));
}

/// Pipes side by side through all of a level, under its ceiling.
pub fn rack(bay: &mut Bay, corner: DVec3) {
    let along_x = bay.random.chance(0.5);
    let [along, across] = if along_x { [DVec3::X, DVec3::Z] } else { [DVec3::Z, DVec3::X] };
    let height = LEVEL - bay.random.between(0.6, 1.0);
    let mut place = bay.random.between(0.8, SIZE - 4.0);
    for _ in 0..5 + bay.random.below(8) {
        let radius = bay.random.of(&RADII[1..6]);
        place += radius * 1.8;
        let material = any_of(Kind::Pipe, &mut bay.random);
        let origin = corner + across * place + DVec3::Y * (height + radius) - along * 0.4;
        leg(bay, Frame::new(origin, along), radius, SIZE + 0.8, material);
        place += radius * 1.8;
    }
}
