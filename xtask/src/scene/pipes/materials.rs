//! What parts are made of: several dozen materials, as a plant has them.

use crate::scene::random::Random;

/// What a part is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Ground,
    Slab,
    Pipe,
    Insulation,
    Flange,
    Bolt,
    Valve,
    Wheel,
    Beam,
    Grating,
    Railing,
    Vessel,
    Tube,
    Machine,
    Tray,
    Cabinet,
}

/// A name and a color (linear RGB) for a kind of part.
pub struct PlantMaterial {
    pub kind: Kind,
    pub name: &'static str,
    pub color: [f32; 3],
}

const fn material(kind: Kind, name: &'static str, color: [f32; 3]) -> PlantMaterial {
    PlantMaterial { kind, name, color }
}

/// All of them.
pub const MATERIALS: &[PlantMaterial] = &[
    material(Kind::Ground, "ground", [0.36, 0.34, 0.31]),
    material(Kind::Slab, "concrete", [0.52, 0.50, 0.47]),
    material(Kind::Slab, "concrete_sealed", [0.42, 0.44, 0.43]),
    material(Kind::Pipe, "pipe_water", [0.10, 0.42, 0.17]),
    material(Kind::Pipe, "pipe_cooling", [0.09, 0.26, 0.52]),
    material(Kind::Pipe, "pipe_steam", [0.60, 0.61, 0.63]),
    material(Kind::Pipe, "pipe_gas", [0.75, 0.55, 0.06]),
    material(Kind::Pipe, "pipe_air", [0.22, 0.50, 0.66]),
    material(Kind::Pipe, "pipe_fire", [0.58, 0.06, 0.05]),
    material(Kind::Pipe, "pipe_acid", [0.66, 0.27, 0.05]),
    material(Kind::Pipe, "pipe_oil", [0.30, 0.17, 0.08]),
    material(Kind::Pipe, "pipe_drain", [0.12, 0.12, 0.13]),
    material(Kind::Pipe, "pipe_stainless", [0.70, 0.69, 0.66]),
    material(Kind::Pipe, "pipe_copper", [0.68, 0.34, 0.20]),
    material(Kind::Insulation, "insulation_foil", [0.76, 0.77, 0.78]),
    material(Kind::Insulation, "insulation_white", [0.78, 0.76, 0.70]),
    material(Kind::Flange, "flange_steel", [0.45, 0.45, 0.46]),
    material(Kind::Flange, "flange_dark", [0.25, 0.25, 0.27]),
    material(Kind::Bolt, "bolt_zinc", [0.62, 0.60, 0.54]),
    material(Kind::Bolt, "bolt_black", [0.09, 0.09, 0.10]),
    material(Kind::Valve, "valve_red", [0.62, 0.10, 0.07]),
    material(Kind::Valve, "valve_blue", [0.11, 0.22, 0.55]),
    material(Kind::Valve, "valve_bronze", [0.50, 0.32, 0.13]),
    material(Kind::Wheel, "wheel_red", [0.66, 0.05, 0.04]),
    material(Kind::Wheel, "wheel_black", [0.07, 0.07, 0.08]),
    material(Kind::Beam, "beam_gray", [0.40, 0.43, 0.46]),
    material(Kind::Beam, "beam_green", [0.22, 0.38, 0.33]),
    material(Kind::Beam, "beam_primer", [0.42, 0.17, 0.11]),
    material(Kind::Grating, "grating", [0.47, 0.48, 0.48]),
    material(Kind::Grating, "checker_plate", [0.36, 0.37, 0.39]),
    material(Kind::Railing, "railing", [0.78, 0.60, 0.05]),
    material(Kind::Vessel, "vessel_white", [0.77, 0.77, 0.74]),
    material(Kind::Vessel, "vessel_gray", [0.50, 0.53, 0.55]),
    material(Kind::Vessel, "vessel_blue", [0.27, 0.40, 0.52]),
    material(Kind::Vessel, "vessel_rust", [0.46, 0.24, 0.14]),
    material(Kind::Tube, "tube_copper", [0.70, 0.40, 0.26]),
    material(Kind::Tube, "tube_steel", [0.58, 0.59, 0.60]),
    material(Kind::Machine, "machine_green", [0.15, 0.36, 0.25]),
    material(Kind::Machine, "machine_blue", [0.13, 0.29, 0.50]),
    material(Kind::Machine, "machine_orange", [0.70, 0.32, 0.07]),
    material(Kind::Tray, "tray", [0.66, 0.66, 0.64]),
    material(Kind::Tray, "tray_lid", [0.55, 0.56, 0.58]),
    material(Kind::Cabinet, "cabinet", [0.68, 0.68, 0.62]),
    material(Kind::Cabinet, "cabinet_blue", [0.24, 0.34, 0.46]),
];

/// The number of one of the materials of a kind.
pub fn any_of(kind: Kind, random: &mut Random) -> usize {
    let of_kind = || MATERIALS.iter().enumerate().filter(|(_, m)| m.kind == kind);
    let choice = random.below(of_kind().count());
    of_kind().nth(choice).map_or(0, |(number, _)| number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_differ() {
        let mut names: Vec<&str> = MATERIALS.iter().map(|m| m.name).collect();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), MATERIALS.len());
        assert!(names.len() >= 36);
    }

    #[test]
    fn kinds_are_kept() {
        let mut random = Random::new(&[1]);
        assert!((0..50).all(|_| MATERIALS[any_of(Kind::Bolt, &mut random)].kind == Kind::Bolt));
    }
}
