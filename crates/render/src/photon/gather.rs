//! Paths from the camera, which end at photons.

use super::map::Query;
use super::tracer::PhotonMaps;
use crate::{
    bsdf::Bsdf,
    camera::CameraPaths,
    integrator::{DirectLight, MAX_PASSED, Pair, Shader},
    interaction::SurfaceInteraction,
    wave::{Path, ShadeOutput},
};
use glam::Vec3;
use raystrips_geom::Ray;

/// What photons are gathered from.
pub(super) struct Gather<'a> {
    maps: PhotonMaps,
    nearest: u32,
    most_radius: f32,
    direct: DirectLight<'a>,
    max_bounces: u32,
}

/// The same for the paths of a camera. A path is in one of three states, which its density tells: without one it comes from
/// the camera by mirrors and through glass alone; with one greater than 0 it left a surface to gather light there; with 0 it
/// has met mirrors or glass on that way.
pub(super) struct CameraGather<'a> {
    gather: Gather<'a>,
    camera: CameraPaths,
}

impl<'a> Gather<'a> {
    pub fn new(
        maps: PhotonMaps,
        (nearest, most_radius): (u32, f32),
        direct: DirectLight<'a>,
        max_bounces: u32,
    ) -> Gather<'a> {
        Gather { maps, nearest, most_radius, direct, max_bounces }
    }

    pub fn with_camera(self, camera: CameraPaths) -> CameraGather<'a> {
        CameraGather { gather: self, camera }
    }

    fn query(&self, hit: &SurfaceInteraction) -> Query {
        Query { p: hit.point.p, n: hit.n, nearest: self.nearest, most_radius: self.most_radius }
    }

    /// Light that leaves towards a viewer of the photons here: of caustics alone where lamps and other surfaces are looked for
    /// by rays.
    fn photon_light(&self, hit: &SurfaceInteraction, bsdf: &Bsdf, is_seen: bool) -> Vec3 {
        let query = self.query(hit);
        if !is_seen && hit.material.is_matte {
            return bsdf.evaluate(hit.shading_n).0 * self.maps.global.irradiance(&query);
        }
        let reflected = |from: Vec3| if hit.n.dot(from) > 0.0 { bsdf.evaluate(from).0 } else { Vec3::ZERO };
        let map = if is_seen { &self.maps.caustic } else { &self.maps.global };
        map.estimate(&query, reflected)
    }

    /// Light of a surface: what is found here, and the ray that finds the rest.
    fn gather(
        &self,
        path: &mut Path,
        ray: &Ray,
        hit: &SurfaceInteraction,
        out: &mut ShadeOutput,
    ) -> Option<Ray> {
        let bsdf = Bsdf::new(&hit.material, hit.shading_n, hit.front, ray.dir);
        let is_seen = path.scatter_pdf.is_none();
        if is_seen && path.bounces == 0 {
            out.add_first_hit(path, hit);
        }
        // Lamps with a texture send out no photons, but are found by rays that gather.
        if is_seen || !hit.material.is_lamp {
            out.add(path, path.throughput * hit.material.emitted(hit.front));
        }
        if bsdf.is_diffuse() {
            out.add(path, path.throughput * self.photon_light(hit, &bsdf, is_seen));
            if is_seen {
                self.direct.add_lamps(path, hit, &bsdf, out);
            }
        }
        if path.bounces >= self.max_bounces || bsdf.is_black() {
            return None;
        }
        if is_seen && bsdf.is_diffuse() {
            self.direct.add_sky(path, hit, &bsdf, out);
        }
        let scattered = bsdf.sample(Pair::Direction.of(path), Pair::PunctualLight.of(path)[1])?;
        if !hit.leaves(scattered.wi, scattered.is_transmitted) {
            return None;
        }
        // What photons tell of is not looked for once more.
        if !is_seen && bsdf.is_diffuse() && scattered.pdf.is_some() {
            return None;
        }
        path.throughput *= scattered.weight / (scattered.eta * scattered.eta);
        path.bounces += 1;
        path.straight = 0.0;
        path.spread = path.spread.max(bsdf.spread());
        path.scatter_pdf = match (path.scatter_pdf, scattered.pdf) {
            (None, Some(pdf)) if bsdf.is_diffuse() => Some(pdf.max(f32::MIN_POSITIVE)),
            (None, _) => None,
            (Some(_), _) => Some(0.0),
        };
        Some(hit.spawn(scattered.wi, scattered.is_transmitted))
    }
}

impl Shader for CameraGather<'_> {
    fn begin(&self, at: [u32; 2], sample_index: u32, pixel: u32) -> (Ray, Path) {
        self.camera.begin(at, sample_index, pixel)
    }

    fn looks_around(&self) -> bool {
        true
    }

    fn shade(
        &self,
        path: &mut Path,
        ray: &Ray,
        hit: Option<&SurfaceInteraction>,
        out: &mut ShadeOutput,
    ) -> Option<Ray> {
        let Some(hit) = hit else {
            // Light of the sky by mirrors or through glass is that of caustic photons.
            if path.scatter_pdf != Some(0.0) {
                out.add(path, path.throughput * self.gather.direct.sky_found(ray.dir, path.scatter_pdf));
            }
            return None;
        };
        path.throughput *= hit.transmittance();
        let next = if Pair::Survival.of(path)[0] >= hit.alpha {
            path.straight += hit.distance;
            path.passed += 1;
            (path.passed <= MAX_PASSED).then(|| hit.spawn(ray.dir, true))
        } else {
            self.gather.gather(path, ray, hit, out)
        };
        path.segment += 1;
        next
    }
}
