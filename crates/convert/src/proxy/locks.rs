//! Which vertices of a piece must stay as they are because other pieces have them too.
//!
//! A vertex that two pieces share lies in the boxes of both, and, since some of its triangles are elsewhere, on an edge
//! of its piece that has only one triangle. That is enough as long as boxes overlap little. Where they do not, as in soups
//! of long triangles, such vertices are compared between all pieces.

use crate::ConvertError;
use crate::borders::{self, Position};
use crate::distribute::Pieces;
use crate::queue::in_order;
use crate::{Observer, hash::FastMap};
use glam::Vec3;
use raystrips_extmem::ExternalSort;
use raystrips_geom::Aabb;
use std::path::Path;

/// What keeps vertices from being moved.
pub(crate) struct Locks {
    boxes: Vec<Aabb>,
    /// Positions that several pieces have; none if that is not known.
    shared: Option<FastMap<Position, ()>>,
}

impl Locks {
    /// Locks by the boxes of pieces.
    pub fn by_boxes(pieces: &Pieces) -> Locks {
        Locks { boxes: pieces.tree.leaf_bounds(), shared: None }
    }

    /// The same with boxes that are larger on all sides, for vertices that move by as much before they are looked at.
    pub fn by_larger_boxes(pieces: &Pieces, by: f64) -> Locks {
        let mut locks = Locks::by_boxes(pieces);
        for bounds in &mut locks.boxes {
            let by = Vec3::splat(by as f32);
            *bounds = Aabb { min: bounds.min - by, max: bounds.max + by };
        }
        locks
    }

    /// Locks only what several pieces have indeed. Reads all of them; sorts in `memory_bytes`, or in `folder`.
    pub fn by_vertices(
        pieces: &Pieces,
        folder: &Path,
        memory_bytes: usize,
        at_a_time: usize,
        observer: &dyn Observer,
    ) -> Result<Locks, ConvertError> {
        let boxes = Locks::by_boxes(pieces);
        let mut sort = ExternalSort::<Position>::new(folder, memory_bytes);
        let work = |number: usize| {
            let mesh = pieces.read(number)?.mesh;
            let locked = boxes.locked(&mesh.positions, &mesh.triangles, number).into_iter();
            let positions = mesh.positions.iter().zip(locked).filter(|(_, locked)| *locked);
            Ok(positions.map(|(p, _)| p.to_array().map(f32::to_bits)).collect::<Vec<_>>())
        };
        in_order(0..pieces.sources.len(), at_a_time, observer, &work, &mut |_, positions| {
            positions.into_iter().try_for_each(|p| sort.push(p)).map_err(ConvertError::Scratch)
        })?;
        let (mut last, mut shared) = (None, FastMap::default());
        let compare = |position: Position| {
            if last == Some(position) {
                shared.insert(position, ());
            }
            last = Some(position);
        };
        sort.finish(compare).map_err(ConvertError::Scratch)?;
        Ok(Locks { shared: Some(shared), ..boxes })
    }

    /// For each vertex of piece `number` whether it is locked; empty if none is.
    pub fn locked(&self, positions: &[Vec3], triangles: &[[u32; 3]], number: usize) -> Vec<bool> {
        let others = borders::overlaps(&self.boxes, number);
        let is_near = |p: Vec3| others.iter().any(|b| p.cmpge(b.min).all() && p.cmple(b.max).all());
        if others.is_empty() {
            return Vec::new();
        }
        let near: Vec<bool> = positions.iter().map(|&p| is_near(p)).collect();
        let sides = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
        let mut edges: Vec<[u32; 2]> = triangles
            .iter()
            .flat_map(sides)
            .filter(|edge| edge.iter().all(|&v| near[v as usize]))
            .map(|[a, b]| [a.min(b), a.max(b)])
            .collect();
        edges.sort_unstable();
        let is_shared = |v: u32| {
            let bits = positions[v as usize].to_array().map(f32::to_bits);
            self.shared.as_ref().is_none_or(|shared| shared.contains_key(&bits))
        };
        let mut locked = vec![false; positions.len()];
        for edge in edges.chunk_by(|a, b| a == b).filter(|edges| edges.len() % 2 == 1) {
            edge[0].iter().for_each(|&v| locked[v as usize] = is_shared(v));
        }
        locked
    }
}
