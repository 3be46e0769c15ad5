//! Counts vertices that several pieces may have.
//!
//! Only those in the box of another piece can be in it too. They are put down as the pieces come and counted in the
//! end, so that the number of vertices of a pack is exact without anything that grows with the mesh.

use glam::Vec3;
use raystrips_extmem::ExternalSort;
use raystrips_geom::Aabb;
use std::io::{self, Read};
use std::path::Path;

/// A position, bit for bit.
pub(crate) type Position = [u32; 3];

/// The vertices of `positions` that lie in any of `others`, the parts of a piece's box that boxes of others overlap.
pub(crate) fn shared(positions: &[Vec3], others: &[Aabb]) -> Vec<Position> {
    let is_shared = |p: &&Vec3| others.iter().any(|b| p.cmpge(b.min).all() && p.cmple(b.max).all());
    positions.iter().filter(is_shared).map(|p| p.to_array().map(f32::to_bits)).collect()
}

/// For each of `boxes` its overlaps with the others.
pub(crate) fn overlaps(boxes: &[Aabb], of: usize) -> Vec<Aabb> {
    let overlap = |b: &Aabb| Aabb { min: b.min.max(boxes[of].min), max: b.max.min(boxes[of].max) };
    let others = boxes.iter().enumerate().filter(|(i, _)| *i != of);
    others.map(|(_, b)| overlap(b)).filter(|b| !b.is_empty()).collect()
}

/// How many different positions there are in `file`.
pub(crate) fn count_different(mut file: impl Read, folder: &Path, memory_bytes: usize) -> io::Result<u64> {
    let mut sort = ExternalSort::<Position>::new(folder, memory_bytes);
    let mut position: Position = [0; 3];
    while read_whole(&mut file, bytemuck::bytes_of_mut(&mut position))? {
        sort.push(position)?;
    }
    let (mut count, mut last) = (0, None);
    sort.finish(|position| {
        count += u64::from(last != Some(position));
        last = Some(position);
    })?;
    Ok(count)
}

/// Fills `bytes`; false at the end of the file.
fn read_whole(file: &mut impl Read, bytes: &mut [u8]) -> io::Result<bool> {
    match file.read_exact(bytes) {
        Ok(()) => Ok(true),
        Err(e) if e.kind() == io::ErrorKind::UnexpectedEof => Ok(false),
        Err(e) => Err(e),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vertices_of_two_pieces_count_once() {
        let square = |x: f32| Aabb { min: Vec3::new(x, 0.0, 0.0), max: Vec3::new(x + 1.0, 1.0, 0.0) };
        let boxes = [square(0.0), square(1.0), square(5.0)];
        let positions = [0.0f32, 0.5, 1.0].map(|x| Vec3::new(x, 0.5, 0.0));
        let of_first = shared(&positions, &overlaps(&boxes, 0));
        assert_eq!(of_first, [positions[2].to_array().map(f32::to_bits)]);
        assert!(shared(&positions, &overlaps(&boxes, 2)).is_empty());
        let twice = [of_first.clone(), of_first].concat();
        let bytes: &[u8] = bytemuck::cast_slice(&twice);
        assert_eq!(count_different(bytes, Path::new("."), 1000).unwrap(), 1);
    }
}
