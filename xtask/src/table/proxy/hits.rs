//! How far the hit points of rays on a simplified mesh are from those on the model.

use crate::rays::ray_sets_of;
use anyhow::Result;
use raystrips_convert::{ConvertParams, Unobserved, convert};
use raystrips_geom::{Aabb, Hit, Ray};
use raystrips_tracer::{Scene, Tracer};
use std::path::Path;

/// Pixels along a side of the picture that the rays come from.
const PICTURE: usize = 512;

/// The rays of a path tracer in a model, and where they hit it.
pub struct ExactHits {
    rays: Vec<(Ray, f32)>,
    bounds: Aabb,
}

/// What rays do in a simplified mesh.
pub struct Approximation {
    /// Median distance between exact and approximate hit points in percent of the diagonal. Rays that only miss the
    /// simplified mesh count with the place where they come into the box of the model, by which they would be ordered.
    pub median_percent: f64,
    /// Share of the rays that hit the model but not the simplified mesh.
    pub missed: f64,
}

impl ExactHits {
    /// Camera rays and rays of the second bounce that hit the model.
    pub fn of(model: &Path, folder: &Path) -> Result<ExactHits> {
        let scene = pack(model, folder)?;
        let mut tracer = Tracer::new(&scene);
        let [primary, _, second, _] = ray_sets_of(&scene, PICTURE);
        let rays = primary.into_iter().chain(second);
        let hits = rays.map(|ray| (ray, tracer.intersect(&ray))).filter(|(_, hit)| hit.is_hit());
        Ok(ExactHits { rays: hits.map(|(ray, hit)| (ray, hit.t)).collect(), bounds: scene.bounds() })
    }

    /// Compares with the hits on the mesh in a file.
    pub fn compare(&self, mesh: &Path, folder: &Path) -> Result<Approximation> {
        let scene = pack(mesh, folder)?;
        let mut tracer = Tracer::new(&scene);
        let mut missed = 0;
        let mut distance = |(ray, exact): &(Ray, f32)| {
            let hit: Hit = tracer.intersect(ray);
            missed += usize::from(!hit.is_hit());
            let t = if hit.is_hit() { hit.t } else { entry(ray, &self.bounds) };
            f64::from((t - exact).abs())
        };
        let mut distances: Vec<f64> = self.rays.iter().map(&mut distance).collect();
        distances.sort_unstable_by(f64::total_cmp);
        let median = distances.get(distances.len() / 2).copied().unwrap_or(f64::NAN);
        Ok(Approximation {
            median_percent: 100.0 * median / f64::from(self.bounds.diagonal()),
            missed: missed as f64 / self.rays.len().max(1) as f64,
        })
    }
}

/// Where a ray with a direction of length one comes into a box that it meets.
fn entry(ray: &Ray, bounds: &Aabb) -> f32 {
    let inverse = ray.dir.recip();
    let (a, b) = ((bounds.min - ray.org) * inverse, (bounds.max - ray.org) * inverse);
    a.min(b).max_element().max(ray.tnear)
}

fn pack(model: &Path, folder: &Path) -> Result<Scene> {
    let path = folder.join("hits.rsp");
    let params = ConvertParams { proxies: None, ..ConvertParams::default() };
    convert(&[model.to_owned()], &path, &params, &Unobserved)?;
    Ok(Scene::open(&path)?)
}
