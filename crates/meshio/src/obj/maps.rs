//! Textures of MTL libraries: `map_Kd -s 2 2 2 wall.png` and the like.

use crate::ImageSource;
use crate::emit::Emitter;
use crate::number::{is_space, parse_f64};
use crate::reference::resolve_in;
use raystrips_geom::scene::{AlphaMode, Material, MaterialTextures};
use raystrips_geom::texture::{Texture, Wrap};
use std::path::{Path, PathBuf};

/// What a texture is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Slot {
    BaseColor,
    Opacity,
    Emission,
    /// Color of reflection.
    Specular,
    Roughness,
    Metallic,
    /// Heights; many files name slopes the same.
    Heights,
    Slopes,
}

impl Slot {
    /// What the keyword is for; `None` if it is no texture that is read.
    pub fn of(keyword: &[u8]) -> Option<Slot> {
        Some(match keyword.to_ascii_lowercase().as_slice() {
            b"map_kd" => Slot::BaseColor,
            b"map_d" => Slot::Opacity,
            b"map_ke" => Slot::Emission,
            b"map_ks" => Slot::Specular,
            b"map_pr" => Slot::Roughness,
            b"map_pm" => Slot::Metallic,
            b"map_bump" | b"bump" => Slot::Heights,
            b"norm" | b"map_kn" => Slot::Slopes,
            _ => return None,
        })
    }
}

/// A texture as written.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TextureMap {
    pub slot: Slot,
    /// The library that names it.
    library: PathBuf,
    file: String,
    scale: [f32; 2],
    offset: [f32; 2],
    is_clamped: bool,
    bump: f32,
}

impl TextureMap {
    /// Of what follows the keyword; `None` if no file is named.
    pub fn parse(slot: Slot, library: &Path, mut rest: &[u8]) -> Option<TextureMap> {
        let mut map = TextureMap {
            slot,
            library: library.to_owned(),
            file: String::new(),
            scale: [1.0; 2],
            offset: [0.0; 2],
            is_clamped: false,
            bump: 1.0,
        };
        loop {
            rest = rest.trim_ascii_start();
            if !rest.starts_with(b"-") {
                break;
            }
            let option = word(&mut rest);
            match option {
                b"-s" => map.scale = numbers(&mut rest, map.scale),
                b"-o" => map.offset = numbers(&mut rest, map.offset),
                b"-bm" => [map.bump, _] = numbers(&mut rest, [1.0; 2]),
                b"-clamp" => map.is_clamped = word(&mut rest) == b"on",
                b"-mm" | b"-t" => _ = numbers(&mut rest, [0.0; 2]),
                _ => _ = word(&mut rest),
            }
        }
        map.file = String::from_utf8_lossy(rest.trim_ascii()).into_owned();
        (!map.file.is_empty()).then_some(map)
    }

    /// The file of the texture in a model, or why it cannot be had.
    fn find(&self, model: &Path, out: &mut Emitter) -> Result<PathBuf, String> {
        let path = resolve_in(model, &self.library, &self.file)
            .map_err(|reason| format!("texture '{}' is not read: {reason}", self.file))?;
        out.note_file(&path);
        match path.is_file() {
            true => Ok(path),
            false => Err(format!("there is no texture '{}'; put it next to this file", self.file)),
        }
    }

    /// Number of the texture with the image at `path`.
    fn texture(&self, path: PathBuf, out: &mut Emitter) -> u32 {
        let wrap = if self.is_clamped { Wrap::Clamp } else { Wrap::Repeat };
        let ([su, sv], [ou, ov]) = (self.scale, self.offset);
        // The first row of an image is the upper one, where v is 1.
        let transform = [[su, 0.0, ou], [0.0, -sv, 1.0 - ov]];
        let texture = Texture { transform, wrap: [wrap; 2], ..Texture::default() };
        let source = match self.slot {
            Slot::Heights => ImageSource::Heights { path, scale: self.bump.to_bits() },
            _ => ImageSource::File(path),
        };
        let is_srgb = matches!(self.slot, Slot::BaseColor | Slot::Emission | Slot::Specular);
        out.texture(source, is_srgb, texture)
    }

    /// Gives the material of a model the texture. What cannot be had is told.
    fn apply(
        &self,
        model: &Path,
        material: &mut Material,
        base_color: Option<&TextureMap>,
        out: &mut Emitter,
    ) {
        let textures = &mut material.textures;
        let slot = match self.slot {
            Slot::BaseColor => &mut textures.base_color,
            Slot::Opacity => &mut textures.opacity,
            Slot::Emission => &mut textures.emission,
            Slot::Specular => &mut textures.specular_color,
            Slot::Roughness => &mut textures.roughness,
            Slot::Metallic => &mut textures.metallic,
            Slot::Heights | Slot::Slopes => &mut textures.normal,
        };
        if out.options.bare {
            *slot = Some(MaterialTextures::LOST);
            return;
        }
        let path = match self.find(model, out) {
            Ok(path) => path,
            Err(what) => {
                *slot = Some(MaterialTextures::LOST);
                return out.warn(&self.library, what);
            }
        };
        if self.slot == Slot::Opacity {
            material.alpha_mode = AlphaMode::Blend;
            // The opacity that comes with the colors.
            if base_color.is_some_and(|map| map.file == self.file) {
                return;
            }
        }
        *slot = Some(self.texture(path, out));
    }
}

/// Gives a material of a model its textures. Numbers that only say that there is a texture become 1, and go with it.
pub(super) fn apply(maps: &[TextureMap], model: &Path, material: &mut Material, out: &mut Emitter) {
    let base_color = maps.iter().find(|map| map.slot == Slot::BaseColor);
    maps.iter().for_each(|map| map.apply(model, material, base_color, out));
    material.drop_textures(|texture| texture == MaterialTextures::LOST);
}

fn word<'a>(rest: &mut &'a [u8]) -> &'a [u8] {
    let text = rest.trim_ascii_start();
    let (word, after) = text.split_at(text.iter().position(|&c| is_space(c)).unwrap_or(text.len()));
    *rest = after;
    word
}

/// Up to three numbers, of which two matter, in place of the `plain` ones.
fn numbers(rest: &mut &[u8], plain: [f32; 2]) -> [f32; 2] {
    let mut values = [plain[0], plain[1], 0.0];
    for value in &mut values {
        let mut after = *rest;
        let Some(found) = parse_f64(word(&mut after)).map(|x| x as f32).filter(|x| x.is_finite()) else {
            break;
        };
        *value = found;
        *rest = after;
    }
    [values[0], values[1]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn options_stand_before_names_with_blanks() {
        let map = |text: &str| TextureMap::parse(Slot::BaseColor, Path::new("a.mtl"), text.as_bytes());
        let found = map(" -s 2 3 1 -clamp on -bm 0.5 -blendu off -o .5 old wall.png ").unwrap();
        assert_eq!(
            (found.file.as_str(), found.scale, found.offset),
            ("old wall.png", [2.0, 3.0], [0.5, 0.0])
        );
        assert_eq!((found.is_clamped, found.bump), (true, 0.5));
        assert_eq!(map("-s 2"), None);
        assert_eq!(map("  "), None);
        assert_eq!((Slot::of(b"map_Bump"), Slot::of(b"map_Ns")), (Some(Slot::Heights), None));
    }
}
