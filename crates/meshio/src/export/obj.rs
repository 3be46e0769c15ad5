//! OBJ text.

use super::ExportMesh;
use glam::DVec3;
use std::io::{self, Write};

pub(super) fn write(mesh: &ExportMesh, out: &mut dyn Write) -> io::Result<()> {
    for p in mesh.world_positions() {
        writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
    }
    for (geometry, triangles) in mesh.by_geometry() {
        let material = mesh.material_name(geometry).replace(['\n', '\r'], " ");
        if !material.is_empty() {
            writeln!(out, "usemtl {material}")?;
        }
        for [a, b, c] in triangles.iter().map(|triangle| triangle.map(|v| u64::from(v) + 1)) {
            writeln!(out, "f {a} {b} {c}")?;
        }
    }
    let offset = DVec3::from_array(mesh.offset);
    for (geometry, points) in mesh.strands {
        for (p, _) in points {
            let p = p.as_dvec3() + offset;
            writeln!(out, "v {} {} {}", p.x, p.y, p.z)?;
        }
        let material = mesh.material_name(*geometry as usize).replace(['\n', '\r'], " ");
        if !material.is_empty() {
            writeln!(out, "usemtl {material}")?;
        }
        write!(out, "l")?;
        (1..=points.len()).rev().try_for_each(|back| write!(out, " -{back}"))?;
        writeln!(out)?;
    }
    Ok(())
}
