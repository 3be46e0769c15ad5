//! Looking up textures: of the level whose texels are as large as the place that is looked at, bilinear within levels and
//! linear between two.

use crate::world::{Tile, World};
use glam::{Vec2, Vec4};
use raystrips_geom::scene::SceneDesc;
use raystrips_geom::texture::{Level, TEXEL_BYTES, Texture, Wrap, levels};
use raystrips_tracer::OpenError;

/// The textures of a scene, made ready.
pub(crate) struct Textures {
    textures: Vec<ReadyTexture>,
    /// Light of each code of sRGB.
    linear: Vec<f32>,
}

struct ReadyTexture {
    texture: Texture,
    is_srgb: bool,
    first_tile: u64,
    /// None where the image could not be read.
    levels: Vec<Level>,
}

/// Where a texture is looked up.
pub(crate) struct Lookup {
    /// Place in the image, from (0, 0) to (1, 1).
    pub place: Vec2,
    /// Texels of the finest level across what is looked at.
    pub width: f32,
}

impl Textures {
    pub fn new(description: &SceneDesc) -> Textures {
        let ready = |texture: &Texture| {
            let image = description.images.get(texture.image as usize);
            let (width, height) = image.map_or((0, 0), |image| (image.width, image.height));
            ReadyTexture {
                texture: texture.clone(),
                is_srgb: image.is_some_and(|image| image.is_srgb),
                first_tile: image.map_or(0, |image| image.first_tile),
                levels: levels(width, height).collect(),
            }
        };
        let decode = |code: u16| {
            let x = f32::from(code) / 255.0;
            if x <= 0.04045 { x / 12.92 } else { libm::powf((x + 0.055) / 1.055, 2.4) }
        };
        Textures {
            textures: description.textures.iter().map(ready).collect(),
            linear: (0..256).map(decode).collect(),
        }
    }

    /// Which texture coordinates the texture is looked up with.
    pub fn tex_coord(&self, texture: u32) -> usize {
        usize::from(self.textures[texture as usize].texture.tex_coord)
    }

    /// From texture coordinates to the image.
    pub fn place(&self, texture: u32, uv: Vec2) -> Vec2 {
        let [x, y] = self.textures[texture as usize].texture.transform;
        let along = |[a, b, c]: [f32; 3]| a * uv.x + b * uv.y + c;
        Vec2::new(along(x), along(y))
    }

    /// Texels along the sides of the finest level; zero where the image could not be read.
    pub fn extent(&self, texture: u32) -> Vec2 {
        let finest = self.textures[texture as usize].levels.first();
        finest.map_or(Vec2::ZERO, |level| Vec2::new(level.width as f32, level.height as f32))
    }

    /// Red, green, blue (linear) and opacity; white where the image could not be read.
    ///
    /// # Errors
    /// If a tile cannot be read.
    pub fn sample(&self, world: &dyn World, texture: u32, at: &Lookup) -> Result<Vec4, OpenError> {
        let ready = &self.textures[texture as usize];
        let Some(coarsest) = ready.levels.len().checked_sub(1) else { return Ok(Vec4::ONE) };
        if !at.place.is_finite() {
            return Ok(Vec4::ONE);
        }
        if ready.texture.is_nearest {
            return self.nearest(world, ready, at.place);
        }
        let level = libm::log2f(at.width.max(1.0)).min(coarsest as f32);
        let (fine, share) = (level as usize, level.fract());
        let value = self.bilinear(world, ready, fine, at.place)?;
        match share > 0.0 {
            true => Ok(value.lerp(self.bilinear(world, ready, fine + 1, at.place)?, share)),
            false => Ok(value),
        }
    }

    fn nearest(&self, world: &dyn World, ready: &ReadyTexture, place: Vec2) -> Result<Vec4, OpenError> {
        let level = &ready.levels[0];
        let along = |x: f32, extent: u32, wrap| wrapped(texel_number(x * extent as f32), extent, wrap);
        let [u, v] = ready.texture.wrap;
        let [x, y] = [along(place.x, level.width, u), along(place.y, level.height, v)];
        self.texel(world, ready, level, [x, y], &mut None)
    }

    fn bilinear(
        &self,
        world: &dyn World,
        ready: &ReadyTexture,
        level: usize,
        place: Vec2,
    ) -> Result<Vec4, OpenError> {
        let level = &ready.levels[level];
        let [wrap_x, wrap_y] = ready.texture.wrap;
        let pair = |x: f32, extent: u32, wrap| {
            let x = x * extent as f32 - 0.5;
            let first = texel_number(x);
            (wrapped(first, extent, wrap), wrapped(first + 1, extent, wrap), x - x.floor())
        };
        let (x0, x1, across) = pair(place.x, level.width, wrap_x);
        let (y0, y1, down) = pair(place.y, level.height, wrap_y);
        let mut tile = None;
        let mut texel = |x, y| self.texel(world, ready, level, [x, y], &mut tile);
        let upper = texel(x0, y0)?.lerp(texel(x1, y0)?, across);
        let lower = texel(x0, y1)?.lerp(texel(x1, y1)?, across);
        Ok(upper.lerp(lower, down))
    }

    /// A texel; `last` is the tile that was looked at before, which is mostly the same one.
    fn texel<'w>(
        &self,
        world: &'w dyn World,
        ready: &ReadyTexture,
        level: &Level,
        [x, y]: [u32; 2],
        last: &mut Option<(u64, Tile<'w>)>,
    ) -> Result<Vec4, OpenError> {
        let (number, texel) = level.place(x, y);
        let tile = match last {
            Some((known, tile)) if *known == number => &*tile,
            _ => &last.insert((number, world.tile(ready.first_tile + number)?)).1,
        };
        let [red, green, blue, opacity] = [0, 1, 2, 3].map(|channel| tile[texel * TEXEL_BYTES + channel]);
        let share = |code: u8| f32::from(code) / 255.0;
        let color = |code: u8| if ready.is_srgb { self.linear[usize::from(code)] } else { share(code) };
        Ok(Vec4::new(color(red), color(green), color(blue), share(opacity)))
    }
}

/// The texel in which a place lies, counted from the image's first.
fn texel_number(x: f32) -> i64 {
    x.floor() as i64
}

/// The texel of the image that stands for one that may be beyond its borders.
fn wrapped(texel: i64, extent: u32, wrap: Wrap) -> u32 {
    let extent = i64::from(extent);
    let inside = match wrap {
        Wrap::Repeat => texel.rem_euclid(extent),
        Wrap::Mirror => {
            let place = texel.rem_euclid(2 * extent);
            place.min(2 * extent - 1 - place)
        }
        Wrap::Clamp => texel.clamp(0, extent - 1),
    };
    inside as u32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn images_go_on_beyond_their_borders() {
        let all = |wrap| [-5, -1, 0, 3, 4, 9].map(|texel| wrapped(texel, 4, wrap));
        assert_eq!(all(Wrap::Repeat), [3, 3, 0, 3, 0, 1]);
        assert_eq!(all(Wrap::Mirror), [3, 0, 0, 3, 3, 1]);
        assert_eq!(all(Wrap::Clamp), [0, 0, 0, 3, 3, 3]);
    }
}
