//! `--camera`: one of the file's by name or number, or numbers of its own.

use anyhow::{Context, Result, bail};
use glam::DVec3;
use raystrips_geom::scene::{Camera, Projection};
use raystrips_pack::Manifest;

/// Vertical field of view where none is given.
const DEFAULT_FOV_DEGREES: f64 = 40.0;

/// The camera that `text` means, in the space of the pack.
pub fn parse(text: &str, manifest: &Manifest) -> Result<Camera> {
    let cameras = &manifest.scene.cameras;
    if let Some(camera) = cameras.iter().find(|c| c.name == text) {
        return Ok(camera.clone());
    }
    if let Ok(number) = text.parse::<usize>() {
        return cameras.get(number).cloned().with_context(|| {
            format!("--camera {number}: the scene has {} cameras, numbered from 0", cameras.len())
        });
    }
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|n| n.trim().parse::<f64>()).collect();
    match numbers.as_deref() {
        Ok([px, py, pz, tx, ty, tz, rest @ ..]) if rest.len() <= 1 => {
            let fov = rest.first().copied().unwrap_or(DEFAULT_FOV_DEGREES);
            let offset = DVec3::from_array(manifest.scene_offset);
            look_at(DVec3::new(*px, *py, *pz) - offset, DVec3::new(*tx, *ty, *tz) - offset, fov)
        }
        _ => {
            let names: Vec<&str> =
                cameras.iter().map(|c| c.name.as_str()).filter(|n| !n.is_empty()).collect();
            bail!(
                "--camera {text}: not a camera of the scene ({}), and not 6 or 7 numbers \"px,py,pz,tx,ty,tz[,fov]\"",
                if names.is_empty() { "it has none with a name".into() } else { names.join(", ") }
            )
        }
    }
}

fn look_at(position: DVec3, target: DVec3, fov_degrees: f64) -> Result<Camera> {
    let forward =
        (target - position).try_normalize().context("--camera: position and target are the same")?;
    // Straight up or down any direction is as good as another.
    let up = if forward.x.hypot(forward.z) < 1e-6 { DVec3::NEG_Z } else { DVec3::Y };
    let up = forward.cross(up).cross(forward).normalize();
    Ok(Camera {
        name: String::new(),
        position: position.to_array(),
        forward: forward.as_vec3().to_array(),
        up: up.as_vec3().to_array(),
        projection: Projection::Perspective { vertical_fov: fov_degrees.to_radians() as f32 },
        aspect: None,
    })
}
