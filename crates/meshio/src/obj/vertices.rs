//! Vertices of OBJ files: corners of faces name positions, texture coordinates and normals on their own. Colors, which scanners
//! write behind positions, go with these.

use crate::emit::Vertices;
use crate::kept::Kept;
use crate::number::{parse_f64, parse_i64, words};
use crate::{ImportOptions, Result};
use glam::{Vec2, Vec3};
use raystrips_geom::texture::light_of_srgb;
use raystrips_geom::{Attributes, Streams};

/// No texture coordinate, or no normal.
const NONE: u32 = u32::MAX;

/// All vertices of a file so far, and what the corners of the present face name.
pub(super) struct ObjVertices {
    pub positions: Kept,
    tex_coords: Kept,
    /// Lines of texture coordinates, those that are not kept too.
    tex_coord_count: u64,
    /// Those before the first that is kept.
    tex_coords_before: u64,
    /// Texture coordinates are wanted.
    pub keeps_tex_coords: bool,
    normals: Kept,
    /// Of the positions from the first that has one.
    colors: Kept,
    colors_before: u64,
    is_bare: bool,
    /// Texture coordinate and normal of each corner.
    corners: Vec<[u32; 2]>,
    streams: Streams,
    /// Corners that name what is not there.
    pub broken: u64,
}

impl ObjVertices {
    /// A store that takes about `memory` bytes.
    pub fn new(options: &ImportOptions, memory: u64) -> ObjVertices {
        let part = if options.bare { 0 } else { memory / 8 };
        ObjVertices {
            positions: Kept::new(options, memory - 3 * part),
            tex_coords: Kept::beside(options, part),
            tex_coord_count: 0,
            tex_coords_before: 0,
            keeps_tex_coords: false,
            normals: Kept::beside(options, part + part / 2),
            colors: Kept::beside(options, part / 2),
            colors_before: 0,
            is_bare: options.bare,
            corners: Vec::new(),
            streams: Streams::NONE,
            broken: 0,
        }
    }

    /// A position, and its color if it has one.
    #[inline]
    pub fn push(&mut self, position: [f64; 3], color: Option<[f64; 3]>) -> Result<()> {
        if let Some(color) = color.or_else(|| self.has_colors().then_some([1.0; 3])) {
            if !self.has_colors() {
                self.colors_before = self.positions.count();
            }
            self.colors.push(color)?;
        }
        self.positions.push(position)
    }

    pub fn has_colors(&self) -> bool {
        self.colors.count() > 0
    }

    /// `vt u v`; what is odd becomes 0.
    pub fn tex_coord(&mut self, rest: &[u8]) -> Result<()> {
        if !self.keeps_tex_coords {
            self.tex_coords_before += 1;
        } else if self.tex_coords.count() < u64::from(NONE) {
            self.tex_coords.push(numbers(rest))?;
        }
        self.tex_coord_count += 1;
        Ok(())
    }

    /// `vn x y z`; what is odd becomes 0, which means no normal where all are.
    pub fn normal(&mut self, rest: &[u8]) -> Result<()> {
        if self.is_bare || self.normals.count() >= u64::from(NONE) {
            return Ok(());
        }
        self.normals.push(numbers(rest))
    }

    /// Begins a face.
    pub fn begin_face(&mut self) {
        self.corners.clear();
    }

    /// The parts of a corner `v/vt/vn` behind the first.
    #[inline]
    pub fn corner<'a>(&mut self, mut parts: impl Iterator<Item = &'a [u8]>) {
        if self.is_bare {
            return;
        }
        let mut index = |count: u64, before: u64| {
            let Some(index) = parts.next().and_then(parse_i64).filter(|&index| index != 0) else {
                return NONE;
            };
            let from_zero = if index < 0 { count as i64 + index } else { index - 1 };
            let kept = from_zero.checked_sub(before as i64).filter(|&i| from_zero < count as i64 && i >= 0);
            if kept.is_none() && from_zero >= before as i64 {
                self.broken += 1;
            }
            kept.and_then(|i| u32::try_from(i).ok()).unwrap_or(NONE)
        };
        let tex_coord = index(self.tex_coord_count, self.tex_coords_before);
        let normal = index(self.normals.count(), 0);
        self.corners.push([tex_coord, normal]);
    }

    /// Says of which attributes the present face, which has these vertices, is made: those that are wanted.
    pub fn begin_polygon(&mut self, vertices: &[u32], has_texture: bool) {
        let all = |part: usize| !self.corners.is_empty() && self.corners.iter().all(|c| c[part] != NONE);
        self.streams = Streams::NONE;
        if has_texture && all(0) {
            self.streams = self.streams.union(Streams::TEX_COORDS_0);
        }
        if all(1) {
            self.streams = self.streams.union(Streams::NORMALS);
        }
        if self.has_colors() && vertices.iter().all(|&v| u64::from(v) >= self.colors_before) {
            self.streams = self.streams.union(Streams::COLORS);
        }
    }
}

impl Vertices for ObjVertices {
    fn count(&self) -> u64 {
        self.positions.count()
    }

    #[inline]
    fn position(&self, index: u32) -> [f64; 3] {
        self.positions.position(index)
    }

    fn release(&self) {
        self.positions.release();
        self.colors.release();
    }

    fn streams(&self) -> Streams {
        self.streams
    }

    fn attributes(&self, place: usize, index: u32) -> Attributes {
        let [tex_coord, normal] = self.corners.get(place).copied().unwrap_or([NONE; 2]);
        let mut attributes = Attributes::default();
        if self.streams.has(Streams::COLORS) {
            let color = self.colors.position(index - self.colors_before as u32);
            let light = color.map(|code| light_of_srgb(code.clamp(0.0, 1.0)) as f32);
            attributes.color = Vec3::from_array(light).extend(1.0);
        }
        if self.streams.has(Streams::TEX_COORDS_0) {
            let [u, v, _] = self.tex_coords.position(tex_coord).map(|x| x as f32);
            attributes.tex_coords[0] = Vec2::new(u, v);
        }
        if self.streams.has(Streams::NORMALS) {
            attributes.normal = Vec3::from_array(self.normals.position(normal).map(|x| x as f32));
        }
        attributes
    }

    fn has_seams(&self) -> bool {
        true
    }
}

fn numbers(rest: &[u8]) -> [f64; 3] {
    let mut values = [0.0; 3];
    let found = words(rest).map_while(parse_f64);
    values.iter_mut().zip(found).for_each(|(value, x)| *value = if x.is_finite() { x } else { 0.0 });
    values
}
