//! Materials of Wavefront MTL libraries.
//!
//! Read here and not by a library because the usual one panics on `Kd 0.5`, which the format allows, and gives up a
//! whole file for one odd line; here an odd line costs that line.
//!
//! MTL describes Phong surfaces. `Kd` becomes the base color (`Ks` where a material is a mirror: black `Kd`, `illum`
//! 3 or 5), `Ns` the roughness of a microfacet lobe of the same width, `d` and `Tr` the opacity, `Ke` the emission.
//! `illum` 4, 6, 7, 9 with an index of refraction other than 1 is glass, of the color of `Tf`. `Pr` and `Pm` of the PBR
//! extension, where given, win; `Pc` and `Pcr` are a clear coat, `Ps` is sheen, `aniso` and `anisor` (in turns) are anisotropy.
//! Textures are in [`maps`](super::maps).

use super::maps::{Slot, TextureMap};
use crate::Result;
use crate::emit::Emitter;
use crate::map::Map;
use crate::number::{is_space, parse_f64, words};
use raystrips_geom::scene::{AlphaMode, Anisotropy, Clearcoat, Material, Sheen};
use std::collections::HashMap;
use std::f32::consts::TAU;
use std::path::Path;

/// The extension has no number for it; that of the program whose numbers it is for.
const SHEEN_ROUGHNESS: f32 = 0.5;

/// Materials by name, each with its textures; the first of a name counts.
pub(super) type Library = HashMap<String, (Material, Vec<TextureMap>)>;

/// Adds the materials of the file at `path`.
pub(super) fn read(path: &Path, library: &mut Library, out: &mut Emitter) -> Result<()> {
    let bytes = Map::open(path)?;
    let (mut present, mut odd_line, mut not_read) = (None::<Phong>, None, false);
    for (number, line) in (1..).zip(bytes.split(|&c| c == b'\n' || c == b'\r')) {
        let line = line.strip_prefix(b"\xef\xbb\xbf").unwrap_or(line).trim_ascii();
        let (keyword, rest) = line.split_at(line.iter().position(|&c| is_space(c)).unwrap_or(line.len()));
        let slot = Slot::of(keyword);
        not_read |=
            slot.is_none() && (keyword.starts_with(b"map_") || keyword == b"refl" || keyword == b"disp");
        if keyword == b"newmtl" {
            finish(present.replace(Phong::new(rest)), library);
        } else if let Some(phong) = &mut present
            && match slot {
                Some(slot) => TextureMap::parse(slot, path, rest).map(|map| phong.maps.push(map)),
                None => phong.set(keyword, rest),
            }
            .is_none()
        {
            odd_line.get_or_insert(number);
        }
    }
    finish(present, library);
    if let Some(number) = odd_line {
        let what = format!("line {number} has no number, or no file, where one is needed and is left out");
        out.warn(path, what);
    }
    if not_read {
        out.warn(
            path,
            "textures other than map_Kd, map_Ks, map_d, map_Ke, map_Pr, map_Pm, map_Bump and norm are not read",
        );
    }
    Ok(())
}

fn finish(phong: Option<Phong>, library: &mut Library) {
    if let Some(phong) = phong {
        library.entry(phong.name.clone()).or_insert_with(|| {
            let maps = phong.maps.clone();
            (phong.into_material(), maps)
        });
    }
}

/// A material as written.
#[derive(Default)]
struct Phong {
    name: String,
    diffuse: Option<[f32; 3]>,
    specular: Option<[f32; 3]>,
    emission: [f32; 3],
    exponent: Option<f32>,
    opacity: Option<f32>,
    filter: Option<[f32; 3]>,
    ior: Option<f32>,
    illumination: i32,
    roughness: Option<f32>,
    metallic: Option<f32>,
    clearcoat: Clearcoat,
    sheen: [f32; 3],
    anisotropy: f32,
    /// Of the direction in which facets are rougher, in turns.
    turn: f32,
    maps: Vec<TextureMap>,
}

impl Phong {
    fn new(name: &[u8]) -> Phong {
        Phong { name: material_name(name), ..Phong::default() }
    }

    /// Sets what `keyword` names; `None` if `rest` does not fit it.
    fn set(&mut self, keyword: &[u8], rest: &[u8]) -> Option<()> {
        match keyword {
            b"Kd" => self.diffuse = Some(color(rest)?),
            b"Ks" => self.specular = Some(color(rest)?),
            b"Tf" => self.filter = Some(color(rest)?),
            b"Ke" => self.emission = color(rest)?,
            b"Ns" => self.exponent = Some(number(rest)?),
            b"Ni" => self.ior = Some(number(rest)?),
            b"d" => self.opacity = Some(number(rest.trim_ascii().strip_prefix(b"-halo").unwrap_or(rest))?),
            b"Tr" => self.opacity = self.opacity.or(Some(1.0 - number(rest)?)),
            b"illum" => self.illumination = number(rest)? as i32,
            b"Pr" => self.roughness = Some(number(rest)?),
            b"Pm" => self.metallic = Some(number(rest)?),
            b"Pc" => self.clearcoat.strength = number(rest)?.clamp(0.0, 1.0),
            b"Pcr" => self.clearcoat.roughness = number(rest)?.clamp(0.0, 1.0),
            b"Ps" => self.sheen = color(rest)?.map(|c| c.clamp(0.0, 1.0)),
            b"aniso" => self.anisotropy = number(rest)?.clamp(0.0, 1.0),
            b"anisor" => self.turn = number(rest)?,
            _ => {}
        }
        Some(())
    }

    /// It reflects as more than a matte surface does.
    fn is_shiny(&self) -> bool {
        let is_textured = self.maps.iter().any(|map| map.slot == Slot::Specular);
        let reflects = self.specular.map_or(is_textured, |c| c.iter().any(|&x| x > 0.0));
        reflects && self.illumination != 1
    }

    fn into_material(self) -> Material {
        let plain = Material::default();
        let black = |c: [f32; 3]| c.iter().all(|&x| x <= 0.0);
        let mirror = matches!(self.illumination, 3 | 5)
            && self.specular.is_some_and(|c| !black(c))
            && self.diffuse.is_none_or(black);
        let glass =
            matches!(self.illumination, 4 | 6 | 7 | 9) && self.ior.is_some_and(|ior| ior > 0.0 && ior != 1.0);
        let shiny = self.is_shiny();
        // A Phong lobe of exponent n is as wide as a Beckmann lobe of alpha^2 = 2 / (n + 2); alpha is roughness^2.
        let lobe = self.exponent.filter(|_| shiny || glass).map(|n| (2.0 / (n.max(0.0) + 2.0)).sqrt().sqrt());
        let smooth = if mirror || glass { Some(0.0) } else { None };
        let has = |slot| self.maps.iter().any(|map| map.slot == slot);
        // Black with a texture means the color of the texture; to most programs, any color does.
        let of_texture = has(Slot::BaseColor).then_some([1.0; 3]);
        let diffuse = of_texture.or(self.diffuse);
        let base_color = if mirror { self.specular } else { diffuse }.unwrap_or(plain.base_color);
        let base_color = match self.filter.filter(|_| glass) {
            Some(filter) => filter,
            None if glass && black(base_color) => [1.0; 3],
            None => base_color,
        };
        let alpha = if glass { 1.0 } else { self.opacity.unwrap_or(1.0).clamp(0.0, 1.0) };
        Material {
            base_color: base_color.map(|c| c.clamp(0.0, 1.0)),
            alpha_mode: if alpha < 1.0 { AlphaMode::Blend } else { AlphaMode::Uniform },
            alpha,
            emission: if has(Slot::Emission) && black(self.emission) {
                [1.0; 3]
            } else {
                self.emission.map(|c| c.max(0.0))
            },
            metallic: self
                .metallic
                .unwrap_or(if mirror || has(Slot::Metallic) { 1.0 } else { 0.0 })
                .clamp(0.0, 1.0),
            roughness: self.roughness.or(smooth).or(lobe).unwrap_or(plain.roughness).clamp(0.0, 1.0),
            transmission: if glass { 1.0 } else { 0.0 },
            ior: self.ior.filter(|&ior| ior >= 1.0).unwrap_or(plain.ior),
            specular: if shiny || glass || self.roughness.is_some() { 1.0 } else { 0.0 },
            clearcoat: self.clearcoat,
            sheen: Sheen { color: self.sheen, roughness: SHEEN_ROUGHNESS },
            anisotropy: Anisotropy { strength: self.anisotropy, rotation: self.turn.fract() * TAU },
            name: self.name,
            ..plain
        }
    }
}

/// A material's name as written: all of the line, blanks inside included.
pub(super) fn material_name(rest: &[u8]) -> String {
    String::from_utf8_lossy(rest.trim_ascii()).into_owned()
}

fn number(rest: &[u8]) -> Option<f32> {
    words(rest).next().and_then(parse_f64).map(|x| x as f32).filter(|x| x.is_finite())
}

/// `r`, or `r g b`, or `xyz x y z`, taken as if it were RGB. Spectra are not read.
fn color(rest: &[u8]) -> Option<[f32; 3]> {
    let mut values = words(rest).skip_while(|word| *word == b"xyz").map(number);
    let red = values.next()??;
    match values.next() {
        None => Some([red; 3]),
        Some(green) => Some([red, green?, values.next()??]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Collect, write_file};

    fn library(text: &str) -> (Library, Vec<String>) {
        let (dir, path) = write_file("a.mtl", text.as_bytes());
        let (options, mut sink) = Default::default();
        let mut out = Emitter::new(&options, &mut sink as &mut Collect, 0);
        let mut library = Library::new();
        read(&path, &mut library, &mut out).unwrap();
        drop(dir);
        (library, out.finish().unwrap().report.warnings)
    }

    #[test]
    fn phong_becomes_metallic_roughness() {
        let (library, warnings) = library(
            "\u{feff}# c\r\nnewmtl  red wall \r\nKd 1 0 0\r\nd 0.5\r\n\tnewmtl glass\nKd 0 0 0\nNi 1.5\nillum 7\n\
             newmtl mirror\nKd 0 0 0\nKs .9\nillum 3\nnewmtl lamp\nKe 4 4 4\nKd 0.5\nnewmtl lamp\nKd 0 0 0\n\
             newmtl bottle\nKd .8 .8 .8\nTf 0 1 0\nNi 1.5\nillum 6",
        );
        assert!(warnings.is_empty(), "{warnings:?}");
        assert_eq!((library["red wall"].0.base_color, library["red wall"].0.alpha), ([1.0, 0.0, 0.0], 0.5));
        assert_eq!((library["glass"].0.transmission, library["glass"].0.ior), (1.0, 1.5));
        assert_eq!((library["bottle"].0.base_color, library["bottle"].0.specular), ([0.0, 1.0, 0.0], 1.0));
        assert_eq!(library["red wall"].0.specular, 0.0);
        assert_eq!((library["mirror"].0.metallic, library["mirror"].0.roughness), (1.0, 0.0));
        assert_eq!((library["lamp"].0.emission, library["lamp"].0.base_color), ([4.0; 3], [0.5; 3]));
    }

    #[test]
    fn what_has_a_texture_has_its_color() {
        let (library, warnings) =
            library("newmtl a\nKd 0 0 0\nmap_Kd a.png\nnewmtl b\nmap_Ke b.png\nKd 1 0 0\nmap_Ns c.png");
        assert_eq!((library["a"].0.base_color, library["a"].1[0].slot), ([1.0; 3], Slot::BaseColor));
        assert_eq!((library["b"].0.base_color, library["b"].0.emission), ([1.0, 0.0, 0.0], [1.0; 3]));
        assert_eq!(warnings.len(), 1, "{warnings:?}");
    }

    #[test]
    fn layers_of_the_pbr_extension() {
        let (library, warnings) = library(
            "newmtl car\nPc 0.5\nPcr 3\nPs 0.25\nnewmtl pan\nPm 1\nPr 0.5\naniso 0.75\nanisor 1.25\nnewmtl silk\n\
             Ps 1 .5 .25\nPc x\nnewmtl tile\nmap_Ks a.png\nnewmtl wood\nKs 0 0 0\nmap_Ks a.png",
        );
        let car = &library["car"].0;
        assert_eq!(car.clearcoat, Clearcoat { strength: 0.5, roughness: 1.0, normal_scale: 1.0 });
        assert_eq!((car.sheen.color, library["silk"].0.sheen.color), ([0.25; 3], [1.0, 0.5, 0.25]));
        assert_eq!(library["pan"].0.anisotropy, Anisotropy { strength: 0.75, rotation: 0.25 * TAU });
        assert_eq!((library["tile"].0.specular, library["wood"].0.specular), (1.0, 0.0));
        assert!(warnings.len() == 1 && warnings[0].contains("line 12"), "{warnings:?}");
    }

    #[test]
    fn odd_lines_cost_only_themselves() {
        let (library, warnings) = library("Kd 1 1 1\nnewmtl a\nKd x\nmap_Kd\nNs\nKs 1 0\nKd 0.1 0.2 0.3");
        assert_eq!(library["a"].0.base_color, [0.1, 0.2, 0.3]);
        assert_eq!(warnings.len(), 1);
        assert!(warnings[0].contains("line 3"), "{warnings:?}");
    }
}
