//! Arches and what lies on them: walls with moldings around the openings, cornices, balustrades, vaults.
//!
//! Everything here is on the side of positive x and looks to the nave; the other side is the same, turned.

use super::patches::{Detail, Patches};
use super::plan::{ARCADE, ARCH, BAY, BAYS, HALF_LENGTH, STOREYS, Storey, THICKNESS, VAULT};
use glam::DVec3;
use std::f64::consts::PI;

/// Balusters of a bay.
pub const BALUSTERS: usize = 9;
/// Coarser surfaces have no dentils, and no balusters.
const MAX_DENTIL_EDGE: f64 = 0.4;
const MAX_BALUSTER_EDGE: f64 = 0.8;
/// Height of a balustrade with its rail.
pub const BALUSTRADE: f64 = 0.95;

/// An upright wall over an opening with a round arch.
pub struct ArchedWall {
    /// In the middle of the opening where the arch begins, and of the thickness of the wall.
    pub center: DVec3,
    /// Unit vector through the opening.
    pub through: DVec3,
    /// Radius of the arch.
    pub radius: f64,
    /// Half of the width of the wall.
    pub half_width: f64,
    /// From where the arch begins to the top.
    pub height: f64,
    /// Thickness.
    pub thickness: f64,
}

impl ArchedWall {
    fn point(&self, across: f64, up: f64, through: f64) -> DVec3 {
        self.center + DVec3::Y.cross(self.through) * across + DVec3::Y * up + self.through * through
    }

    /// On the arch, from one end of it to the other.
    fn arch(&self, along: f64, radius: f64, through: f64) -> DVec3 {
        let (sin, cos) = libm::sincos(PI * along);
        self.point(-radius * cos, radius * sin, through)
    }

    /// Around the wall from one end of the arch to the other: up, over, and down.
    fn border(&self, along: f64, through: f64) -> DVec3 {
        let [across, up] = match along {
            a if a < 0.25 => [-1.0, a * 4.0],
            a if a <= 0.75 => [(a - 0.5) * 4.0, 1.0],
            a => [1.0, (1.0 - a) * 4.0],
        };
        self.point(across * self.half_width, up * self.height, through)
    }

    /// Adds both faces, the inside of the arch, and what lies on the columns.
    pub fn build(&self, detail: Detail, patches: &mut Patches) {
        let around = detail.steps(PI * self.radius, [8, 64]).next_multiple_of(4);
        let out = detail.steps(self.half_width, [1, 24]);
        let half = self.thickness / 2.0;
        patches.grid([around, out], |a, s| self.arch(a, self.radius, half).lerp(self.border(a, half), s));
        patches.grid([around, out], |a, s| {
            self.arch(1.0 - a, self.radius, -half).lerp(self.border(1.0 - a, -half), s)
        });
        let deep = detail.steps(self.thickness, [1, 16]);
        patches.grid([around, deep], |a, s| self.arch(a, self.radius, (s * 2.0 - 1.0) * half));
        for [from, to] in [[-self.half_width, -self.radius], [self.radius, self.half_width]] {
            patches.grid([1, deep], |a, s| self.point(from + (to - from) * a, 0.0, (s * 2.0 - 1.0) * half));
        }
    }

    /// Adds a molding around the arch, on the face that is seen against `through` where `side` is -1.
    pub fn molding(&self, detail: Detail, side: f64, width: f64, patches: &mut Patches) {
        let outline = [
            [0.0, -0.4],
            [0.0, 0.2],
            [0.35, 0.2],
            [0.4, 0.3],
            [0.62, 0.3],
            [0.7, 0.42],
            [0.92, 0.42],
            [1.0, 0.3],
            [1.0, -0.4],
        ];
        let length = PI * self.radius;
        patches.drawn(detail, &outline, length, |[radial, out], along| {
            let along = if side < 0.0 { 1.0 - along } else { along };
            self.arch(along, self.radius + radial * width, side * (self.thickness / 2.0 + out * width))
        });
    }
}

/// The arched wall of a bay about z = 0.
pub fn bay(storey: Storey) -> ArchedWall {
    ArchedWall {
        center: DVec3::new(ARCADE, storey.springing, 0.0),
        through: DVec3::X,
        radius: ARCH,
        half_width: BAY / 2.0,
        height: storey.top - storey.springing,
        thickness: THICKNESS,
    }
}

/// The cornice over a storey, along all of the hall.
pub fn cornice(detail: Detail, storey: Storey) -> Patches {
    let mut cornice = Patches::default();
    let outline = [
        [0.0, 0.0],
        [0.05, 0.0],
        [0.05, 0.06],
        [0.1, 0.08],
        [0.12, 0.14],
        [0.2, 0.16],
        [0.3, 0.2],
        [0.34, 0.26],
        [0.34, 0.32],
        [0.38, 0.36],
        [0.38, 0.4],
        [-0.36, 0.4],
    ];
    let face = ARCADE - THICKNESS / 2.0;
    cornice.drawn(detail, &outline, 2.0 * HALF_LENGTH, |[out, up], along| {
        DVec3::new(face - out, storey.top + up, HALF_LENGTH * (2.0 * along - 1.0))
    });
    cornice
}

/// Dentils under a cornice, for a bay about z = 0; none if they would be smaller than triangles.
pub fn dentils(detail: Detail, storey: Storey) -> Patches {
    const COUNT: u32 = 14;
    let mut dentils = Patches::default();
    let coarse = Detail { edge: detail.edge.max(0.05) };
    let count = if detail.edge > MAX_DENTIL_EDGE { 0 } else { COUNT };
    for i in 0..count {
        let z = BAY * ((f64::from(i) + 0.25) / f64::from(COUNT) - 0.5);
        let corner = DVec3::new(ARCADE - THICKNESS / 2.0 - 0.19, storey.top + 0.045, z);
        dentils.block(coarse, corner, DVec3::new(0.2, 0.11, BAY / f64::from(COUNT) * 0.5));
    }
    dentils
}

/// The rail and the foot of a balustrade along all of the hall.
pub fn rails(detail: Detail) -> Patches {
    let mut rails = Patches::default();
    let floor = STOREYS[1].floor;
    for [y, high, half] in [[floor, 0.08, 0.14], [floor + BALUSTRADE - 0.1, 0.1, 0.13]] {
        let low = DVec3::new(ARCADE - half, y, -HALF_LENGTH);
        rails.block(detail, low, DVec3::new(2.0 * half, high, 2.0 * HALF_LENGTH));
    }
    rails
}

/// Places of the balusters along z; none if they would be smaller than triangles.
pub fn baluster_places(detail: Detail) -> impl Iterator<Item = f64> {
    let count = if detail.edge > MAX_BALUSTER_EDGE { 0 } else { BALUSTERS };
    let place = |i: usize| (i as f64 + 0.5) / BALUSTERS as f64;
    (0..BAYS).flat_map(move |bay| {
        (0..count).map(move |i| (bay as f64 + 0.07 + 0.86 * place(i)) * BAY - HALF_LENGTH)
    })
}

/// The vault over an aisle, and the walls beneath it that stand on the arches.
pub fn vault(detail: Detail, storey: Storey) -> Patches {
    let mut vault = Patches::default();
    let [around, along] = [PI * VAULT, 2.0 * HALF_LENGTH].map(|length| detail.steps(length, [8, 128]));
    let center = ARCADE + THICKNESS / 2.0 + VAULT;
    vault.grid([around, along], |a, z| {
        let (sin, cos) = libm::sincos(PI * a);
        DVec3::new(
            center - VAULT * cos,
            storey.top - 0.1 - VAULT + VAULT * sin,
            HALF_LENGTH * (2.0 * z - 1.0),
        )
    });
    vault
}

/// A rib under a vault, across the aisle at z = 0.
pub fn rib(detail: Detail, storey: Storey) -> Patches {
    let mut rib = Patches::default();
    let outline = [[0.02, -0.25], [-0.14, -0.25], [-0.18, -0.15], [-0.18, 0.15], [-0.14, 0.25], [0.02, 0.25]];
    let center = ARCADE + THICKNESS / 2.0 + VAULT;
    rib.drawn(detail, &outline, PI * VAULT, |[radial, z], along| {
        let (sin, cos) = libm::sincos(PI * along);
        let radius = VAULT + radial;
        DVec3::new(center - radius * cos, storey.top - 0.1 - VAULT + radius * sin, z)
    });
    rib
}
