//! Wavefront OBJ: positions and their colors, texture coordinates, normals, faces, lines of known width and material names; all
//! else is left aside.
//!
//! The file is read once, from start to end. Positions are kept until the end, since any face may name any of them.
//! A face that names a vertex further on is put aside and added at the end of the file, under the numbers it would
//! have had. Both go to a scratch file where they do not fit into memory. There is a geometry for each material that faces use.

mod forward;
mod lines;
mod maps;
mod mtl;
mod survey;
mod vertices;

pub(crate) use survey::survey;

use crate::emit::{Emitter, Vertices};
use crate::error::excerpt;
use crate::number::{is_space, parse_f64, parse_i64, words};
use crate::reference::resolve;
use crate::{ImportError, Place, Result};
use forward::{Face, ForwardFaces};
use lines::Lines;
use mtl::Library;
use raystrips_geom::scene::Material;
use std::collections::HashMap;
use std::path::Path;
use vertices::ObjVertices;

/// Reads the file at `path` and says in words what it holds.
pub(crate) fn read(path: &Path, out: &mut Emitter) -> Result<String> {
    let mut lines = Lines::open(path).map_err(|e| ImportError::io(path, e))?;
    refuse_other_encodings(path, lines.first_bytes())?;
    let mut obj = Obj::new(path, out);
    let mut bytes_read = 0;
    while let Some(line) = lines.next().map_err(|e| ImportError::io(path, e))? {
        let statement = Statement::of(line);
        match statement.keyword {
            b"v" => {
                let vertex = obj.vertex(statement.rest).map_err(|what| obj.syntax(lines.line(), what));
                let (position, color) = vertex?;
                obj.vertices.push(position, color)?;
            }
            b"vt" => obj.vertices.tex_coord(statement.rest)?,
            b"vn" => obj.vertices.normal(statement.rest)?,
            b"f" => {
                obj.face(statement.rest).map_err(|what| obj.syntax(lines.line(), what))?;
                obj.add_face(lines.line())?;
            }
            b"l" => {
                obj.face(statement.rest).map_err(|what| obj.syntax(lines.line(), what))?;
                obj.add_line()?;
            }
            _ => obj.other(&statement),
        }
        if lines.bytes_read() != bytes_read {
            bytes_read = lines.bytes_read();
            obj.out.advance(bytes_read);
        }
    }
    obj.finish()
}

fn refuse_other_encodings(path: &Path, start: &[u8]) -> Result<()> {
    let start = &start[..start.len().min(1024)];
    if start.starts_with(b"\xff\xfe") || start.starts_with(b"\xfe\xff") {
        return Err(ImportError::unsupported(path, Place::Whole, "is UTF-16 text; save it as UTF-8"));
    }
    if start.contains(&0) {
        return Err(ImportError::unsupported(
            path,
            Place::Whole,
            "is no OBJ text, it holds zero bytes; save it as UTF-8 OBJ or give it the ending of its format",
        ));
    }
    Ok(())
}

struct Statement<'a> {
    keyword: &'a [u8],
    rest: &'a [u8],
}

impl Statement<'_> {
    #[inline]
    fn of(line: &[u8]) -> Statement<'_> {
        let line = &line[line.iter().position(|&c| !is_space(c)).unwrap_or(line.len())..];
        let (keyword, rest) = line.split_at(line.iter().position(|&c| is_space(c)).unwrap_or(line.len()));
        Statement { keyword, rest }
    }
}

struct Obj<'a, 'b> {
    path: &'a Path,
    out: &'a mut Emitter<'b>,
    vertices: ObjVertices,
    /// Of vertices.
    wants_colors: bool,
    /// Vertices of the present face, counted from 0.
    corners: Vec<u32>,
    /// An index of the present face that no vertex can have, wherever it may come.
    impossible: Option<i64>,
    forward: ForwardFaces,
    library: Library,
    /// By name of the material; "" for faces without.
    geometries: HashMap<String, u32>,
    /// Materials to be looked up at the end, since libraries may be named after their use.
    materials: Vec<(u32, String)>,
    /// Of the present material, once a face has used it.
    geometry: Option<u32>,
    material: String,
    /// The present material has textures.
    is_textured: bool,
    small_faces: u64,
    /// Lines that are left out because nobody says how wide they are.
    thin_lines: u64,
    /// Lines that name vertices which are not there, or not yet.
    forward_lines: u64,
    points: u64,
    curves: u64,
}

impl<'a, 'b> Obj<'a, 'b> {
    fn new(path: &'a Path, out: &'a mut Emitter<'b>) -> Obj<'a, 'b> {
        let options = out.options;
        let for_faces = options.kept_bytes / 8;
        let wants_colors = out.wants_colors();
        Obj {
            path,
            out,
            wants_colors,
            vertices: ObjVertices::new(options, options.kept_bytes - for_faces),
            corners: Vec::new(),
            impossible: None,
            forward: ForwardFaces::new(options, for_faces),
            library: Library::new(),
            geometries: HashMap::new(),
            materials: Vec::new(),
            geometry: None,
            material: String::new(),
            is_textured: false,
            small_faces: 0,
            thin_lines: 0,
            forward_lines: 0,
            points: 0,
            curves: 0,
        }
    }

    fn syntax(&self, line: u64, what: String) -> ImportError {
        ImportError::syntax(self.path, Place::Line(line), what)
    }

    /// `v x y z` or `v x y z red green blue`, the color if it is wanted; a weight does not matter.
    #[inline]
    fn vertex(&self, rest: &[u8]) -> std::result::Result<([f64; 3], Option<[f64; 3]>), String> {
        let mut position = [0.0; 3];
        let mut words = words(rest);
        for x in &mut position {
            let word = words.next().ok_or("a vertex needs three coordinates; add the missing ones")?;
            *x = parse_f64(word)
                .ok_or_else(|| format!("{} is not a number; correct the coordinate", excerpt(word)))?;
        }
        if self.vertices.positions.count() >= u64::from(u32::MAX) {
            return Err("more than 4294967295 vertices; split the file".into());
        }
        let mut color = || words.next().and_then(parse_f64).filter(|x| x.is_finite());
        let color = self.wants_colors.then(|| Some([color()?, color()?, color()?])).flatten();
        Ok((position, color))
    }

    /// `f 1 2 3`, `f 1/1 2/2 3/3`, `f 1//1 2//2 3//3`, `f -3 -2 -1`: puts the vertices into `corners`.
    #[inline]
    fn face(&mut self, rest: &[u8]) -> std::result::Result<(), String> {
        self.corners.clear();
        self.vertices.begin_face();
        self.impossible = None;
        for word in words(rest) {
            if word[0] == b'#' {
                break;
            }
            let mut parts = word.split(|&c| c == b'/');
            let index = parts.next().and_then(parse_i64);
            let index =
                index.ok_or_else(|| format!("{} is not a vertex index; correct the face", excerpt(word)))?;
            let from_zero =
                if index < 0 { self.vertices.positions.count() as i64 + index } else { index - 1 };
            self.corners.push(u32::try_from(from_zero).unwrap_or_else(|_| {
                self.impossible.get_or_insert(index);
                0
            }));
            self.vertices.corner(parts);
        }
        Ok(())
    }

    #[inline]
    fn add_face(&mut self, line: u64) -> Result<()> {
        if self.corners.len() < 3 {
            self.small_faces += 1;
            return Ok(());
        }
        let triangle_count = self.corners.len() as u64 - 2;
        let vertex_count = self.vertices.positions.count();
        if let Some(index) = self.impossible {
            return self.out.out_of_range(
                triangle_count,
                self.path,
                || Place::Line(line),
                index,
                vertex_count,
            );
        }
        let geometry = match self.geometry {
            Some(geometry) => geometry,
            None => self.begin_geometry(),
        };
        if self.corners.iter().all(|&corner| u64::from(corner) < vertex_count) {
            self.vertices.begin_polygon(&self.corners, self.is_textured);
            return self
                .out
                .polygon(geometry, &self.vertices, &self.corners, self.path, || Place::Line(line));
        }
        let first_triangle_id = self.out.next_triangle_id();
        self.forward.push(first_triangle_id, geometry, line, &self.corners)?;
        self.out.set_next_triangle_id(first_triangle_id + triangle_count)
    }

    /// Adds the line through `corners` as a strand, if its width is known.
    fn add_line(&mut self) -> Result<()> {
        let Some(width) = self.out.strand_width() else {
            self.thin_lines += 1;
            return Ok(());
        };
        let vertex_count = self.vertices.positions.count();
        if self.impossible.is_some() || self.corners.iter().any(|&corner| u64::from(corner) >= vertex_count) {
            self.forward_lines += 1;
            return Ok(());
        }
        let geometry = match self.geometry {
            Some(geometry) => geometry,
            None => self.begin_geometry(),
        };
        let points =
            self.corners.iter().map(|&corner| (self.vertices.positions.position(corner), width / 2.0));
        self.out.strand(geometry, points)
    }

    /// The geometry of the present material.
    fn begin_geometry(&mut self) -> u32 {
        let geometry = match self.geometries.get(&self.material) {
            Some(&geometry) => geometry,
            None => self.new_geometry(),
        };
        *self.geometry.insert(geometry)
    }

    fn new_geometry(&mut self) -> u32 {
        let name = self.material.clone();
        let material = if name.is_empty() {
            self.out.default_material(self.vertices.has_colors())
        } else {
            self.out.material(Material { name: name.clone(), ..Material::default() })
        };
        let geometry = self.out.geometry(&name, material);
        self.geometries.insert(name.clone(), geometry);
        if !name.is_empty() {
            self.materials.push((material, name));
        }
        geometry
    }

    fn other(&mut self, statement: &Statement) {
        match statement.keyword {
            b"usemtl" => {
                self.material = mtl::material_name(statement.rest);
                self.is_textured = self.library.get(&self.material).is_some_and(|(_, maps)| !maps.is_empty());
                self.geometry = None;
            }
            b"mtllib" => self.libraries(&String::from_utf8_lossy(statement.rest.trim_ascii())),
            b"p" => self.points += 1,
            b"curv" | b"curv2" | b"surf" => self.curves += 1,
            _ => {}
        }
    }

    /// `mtllib` names one file or several; blanks may be part of a name, with or without a backslash before them.
    fn libraries(&mut self, names: &str) {
        let names = names.replace("\\ ", " ");
        let mut start = 0;
        let ends = names.match_indices(char::is_whitespace).map(|(at, _)| at).chain([names.len()]);
        for end in ends {
            let name = names[start..end].trim();
            let is_last = end == names.len();
            if !name.is_empty()
                && (is_last || name.to_ascii_lowercase().ends_with(".mtl") || self.is_file(name))
            {
                self.library(name);
                start = end;
            }
        }
    }

    fn is_file(&self, name: &str) -> bool {
        resolve(self.path, name).is_ok_and(|path| path.is_file())
    }

    fn library(&mut self, name: &str) {
        match resolve(self.path, name) {
            Ok(path) => {
                self.out.note_file(&path);
                if let Err(error) = mtl::read(&path, &mut self.library, self.out) {
                    self.out.warn(self.path, format_args!("no materials: {error}"));
                }
                let materials = self.library.values();
                let mut needs = materials.map(|(m, maps)| !maps.is_empty() || m.anisotropy.strength > 0.0);
                self.vertices.keeps_tex_coords = needs.any(|needs| needs) && !self.out.options.bare;
            }
            Err(reason) => self.out.warn(self.path, format_args!("mtllib '{name}' is not read: {reason}")),
        }
    }

    /// Adds what had to wait for the end of the file, and says what the file holds.
    fn finish(mut self) -> Result<String> {
        let faces = std::mem::replace(&mut self.forward, ForwardFaces::new(self.out.options, 0));
        self.add_forward_faces(faces)?;
        self.fill_in_materials();
        self.warn_of_what_is_left_out();
        Ok(format!(
            "it has {} vertices, {} lines and points, {} faces with less than three corners",
            self.vertices.positions.count(),
            self.thin_lines + self.forward_lines + self.points,
            self.small_faces
        ))
    }

    /// They have no more than positions and their colors.
    fn add_forward_faces(&mut self, faces: ForwardFaces) -> Result<()> {
        self.vertices.begin_face();
        let end = self.out.next_triangle_id();
        let vertex_count = self.vertices.positions.count();
        let mut faces = faces.into_reader()?;
        while let Some(Face { first_triangle_id, geometry, line, corners }) = faces.next(self.path)? {
            self.out.set_next_triangle_id(*first_triangle_id)?;
            match corners.iter().find(|&&corner| u64::from(corner) >= vertex_count) {
                Some(&bad) => {
                    let (count, index) = (corners.len() as u64 - 2, i64::from(bad) + 1);
                    self.out.out_of_range(count, self.path, || Place::Line(*line), index, vertex_count)?;
                }
                None => {
                    let place = || Place::Line(*line);
                    self.vertices.begin_polygon(corners, false);
                    self.out.polygon(*geometry, &self.vertices, corners, self.path, place)?;
                }
            }
        }
        self.out.set_next_triangle_id(end)
    }

    fn fill_in_materials(&mut self) {
        let mut missing = Vec::new();
        for (material, name) in std::mem::take(&mut self.materials) {
            match self.library.get(&name) {
                Some((read, maps)) => {
                    let mut read = read.clone();
                    maps::apply(maps, self.path, &mut read, self.out);
                    self.out.scene.materials[material as usize] = read;
                }
                None => missing.push(name),
            }
        }
        if let Some(first) = missing.first() {
            let count = missing.len();
            self.out.warn(
                self.path,
                format_args!("{count} materials are not found and light gray, first '{first}'"),
            );
        }
    }

    fn warn_of_what_is_left_out(&mut self) {
        for (count, what) in [
            (self.small_faces, "faces with less than three corners are left out"),
            (self.thin_lines, "lines are left out; --strand-width makes strands of them"),
            (self.forward_lines, "lines name vertices that are not before them and are left out"),
            (
                self.vertices.broken,
                "corners name texture coordinates or normals that are not there and have none",
            ),
            (self.points, "points are left out"),
            (self.curves, "free-form curves and surfaces are left out"),
        ] {
            if count > 0 {
                self.out.warn(self.path, format_args!("{count} {what}"));
            }
        }
    }
}

#[cfg(test)]
mod tests;
