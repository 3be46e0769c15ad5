//! The steel frame of a level, its floor, railings and cable trays.

use super::bay::{Bay, LEVEL, SIZE};
use super::fittings::bolt;
use super::materials::{Kind, any_of};
use super::shapes::{Frame, Profile, block, disc, extrude};
use glam::DVec3;

/// Beams across a floor, and plates between them.
const FLOOR_PARTS: usize = 4;

/// Columns, beams and the floor on top of them.
pub fn frame(bay: &mut Bay, corner: DVec3, material: usize) {
    let column = Profile::i_beam(0.3, 0.3, 0.018);
    let beam = Profile::i_beam(0.36, 0.17, 0.014);
    for [x, z] in [[0.0, 0.0], [SIZE, 0.0], [0.0, SIZE], [SIZE, SIZE]] {
        let foot = corner + DVec3::new(x, 0.0, z);
        base_plate(bay, foot, material);
        bay.put(material, extrude(Frame::new(foot, DVec3::Y), &column, LEVEL - 0.02));
    }
    let top = corner + DVec3::Y * (LEVEL - 0.2);
    for (along, across) in [(DVec3::X, DVec3::Z), (DVec3::Z, DVec3::X)] {
        for side in [0.0, SIZE] {
            let origin = top + across * side + along * 0.16;
            bay.put(material, extrude(Frame::new(origin, along), &beam, SIZE - 0.32));
        }
    }
    let joist = Profile::i_beam(0.2, 0.1, 0.01);
    for i in 1..FLOOR_PARTS {
        let origin = top + DVec3::new(SIZE * i as f64 / FLOOR_PARTS as f64, 0.0, 0.1);
        bay.put(material, extrude(Frame::new(origin, DVec3::Z), &joist, SIZE - 0.2));
    }
    floor(bay, corner + DVec3::Y * (LEVEL - 0.02));
}

fn base_plate(bay: &mut Bay, foot: DVec3, material: usize) {
    bay.put(material, block(foot - DVec3::new(0.22, 0.0, 0.22), DVec3::new(0.44, 0.02, 0.44)));
    let bolts = any_of(Kind::Bolt, &mut bay.random);
    for [x, z] in [[-0.18, -0.18], [0.18, -0.18], [-0.18, 0.18], [0.18, 0.18]] {
        bolt(bay, Frame::new(foot + DVec3::new(x, 0.0, z), DVec3::Y), bolts, 0.018, 0.02);
    }
}

/// Plates, of which some are missing so that there is light below.
fn floor(bay: &mut Bay, corner: DVec3) {
    let material = any_of(Kind::Grating, &mut bay.random);
    let width = SIZE / FLOOR_PARTS as f64;
    for i in 0..FLOOR_PARTS * FLOOR_PARTS {
        let at = DVec3::new((i % FLOOR_PARTS) as f64, 0.0, (i / FLOOR_PARTS) as f64) * width;
        if bay.random.chance(0.55) {
            bay.put(material, block(corner + at, DVec3::new(width - 0.01, 0.02, width - 0.01)));
        }
    }
}

/// Posts and rails around the top of a bay.
pub fn railing(bay: &mut Bay, corner: DVec3) {
    let material = any_of(Kind::Railing, &mut bay.random);
    let sides = [
        (DVec3::ZERO, DVec3::X),
        (DVec3::ZERO, DVec3::Z),
        (DVec3::X * SIZE, DVec3::Z),
        (DVec3::Z * SIZE, DVec3::X),
    ];
    for (begin, along) in sides {
        for i in 0..8 {
            let post = corner + begin + along * (SIZE * f64::from(i) / 8.0);
            bay.put(material, disc(Frame::new(post, DVec3::Y), 0.022, 1.1, 8));
        }
        for height in [0.55, 1.1] {
            let rail = Frame::new(corner + begin + DVec3::Y * height, along);
            bay.put(material, disc(rail, 0.02, SIZE, 8));
        }
        let kick = Frame::new(corner + begin + DVec3::Y * 0.07, along);
        bay.put(material, extrude(kick, &Profile::rectangle(0.1, 0.005), SIZE));
    }
}

/// Cable trays under the ceiling, with cables.
pub fn trays(bay: &mut Bay, corner: DVec3) {
    let channel = Profile::channel(0.08, 0.4, 0.003);
    for _ in 0..bay.random.below(3) {
        let material = any_of(Kind::Tray, &mut bay.random);
        let [along, across] = bay.random.of(&[[DVec3::X, DVec3::Z], [DVec3::Z, DVec3::X]]);
        let height = LEVEL - bay.random.between(1.1, 1.6);
        let origin = corner + across * bay.random.between(0.6, SIZE - 0.6) + DVec3::Y * height;
        bay.put(material, extrude(Frame::new(origin, along), &channel, SIZE));
        for _ in 0..4 + bay.random.below(8) {
            let cable = any_of(Kind::Pipe, &mut bay.random);
            let place = across * bay.random.between(-0.17, 0.17) + DVec3::Y * 0.02;
            bay.put(cable, disc(Frame::new(origin + place, along), 0.012, SIZE, 8));
        }
    }
}
