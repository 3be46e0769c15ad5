//! Binary PLY.

use super::ExportMesh;
use std::io::{self, Write};

pub(super) fn write(mesh: &ExportMesh, out: &mut dyn Write) -> io::Result<()> {
    let is_wide = mesh.offset != [0.0; 3];
    let number = if is_wide { "double" } else { "float" };
    writeln!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}", mesh.positions.len())?;
    ["x", "y", "z"].iter().try_for_each(|axis| writeln!(out, "property {number} {axis}"))?;
    writeln!(
        out,
        "element face {}\nproperty list uchar uint vertex_indices\nend_header",
        mesh.triangles.len()
    )?;
    for position in mesh.world_positions() {
        for coordinate in position.to_array() {
            if is_wide {
                out.write_all(&coordinate.to_le_bytes())?;
            } else {
                out.write_all(&(coordinate as f32).to_le_bytes())?;
            }
        }
    }
    for triangle in mesh.triangles {
        out.write_all(&[3])?;
        triangle.iter().try_for_each(|v| out.write_all(&v.to_le_bytes()))?;
    }
    Ok(())
}
