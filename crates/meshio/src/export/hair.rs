//! The hair format of Cem Yuksel, which [`crate::hair`] reads: segments, points and thickness.

use super::ExportMesh;
use std::io::{self, Write};

const HEADER_BYTES: usize = 128;
/// Arrays of segments, points and thickness.
const ARRAYS: u32 = 1 | 2 | 4;

/// Strands of more segments than 16 bits can tell are cut, and more points than 32 bits can tell are an error.
pub(super) fn write(mesh: &ExportMesh, out: &mut dyn Write) -> io::Result<()> {
    let strands = || mesh.strands.iter().flat_map(|(_, points)| parts(points));
    let points: usize = strands().map(<[_]>::len).sum();
    let count =
        |n: usize| u32::try_from(n).map_err(|_| io::Error::other("more points than the format can tell"));
    let material = mesh.strands.first().map(|(geometry, _)| {
        &mesh.scene.materials[mesh.scene.geometries[*geometry as usize].material as usize]
    });
    let [red, green, blue] = material.map_or([1.0; 3], |material| material.base_color);
    let transparency = material.map_or(0.0, |material| 1.0 - material.alpha);
    let mut header = b"HAIR".to_vec();
    for number in [count(strands().count())?, count(points)?, ARRAYS, 0] {
        header.extend(number.to_le_bytes());
    }
    for number in [0.0, transparency, red, green, blue] {
        header.extend(number.to_le_bytes());
    }
    header.resize(HEADER_BYTES, 0);
    out.write_all(&header)?;
    for strand in strands() {
        out.write_all(&((strand.len() - 1) as u16).to_le_bytes())?;
    }
    let offset = glam::DVec3::from_array(mesh.offset);
    for (position, _) in strands().flatten() {
        let position = (position.as_dvec3() + offset).as_vec3();
        position.to_array().iter().try_for_each(|x| out.write_all(&x.to_le_bytes()))?;
    }
    strands().flatten().try_for_each(|(_, radius)| out.write_all(&(2.0 * radius).to_le_bytes()))
}

/// A strand cut into parts of at most as many segments as 16 bits can tell, each beginning where the one before ends.
fn parts<T>(points: &[T]) -> impl Iterator<Item = &[T]> {
    const MOST: usize = u16::MAX as usize;
    (0..points.len().saturating_sub(1))
        .step_by(MOST)
        .map(|first| &points[first..points.len().min(first + MOST + 1)])
}
