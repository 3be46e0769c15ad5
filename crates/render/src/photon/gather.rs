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
    /// Rays sent out from each surface seen.
    rays: u32,
    direct: DirectLight<'a>,
    /// Some lamps have a texture, and so send out no photons.
    has_textured_lamps: bool,
    max_bounces: u32,
}

/// What a path is out for, which its density tells. Glossy surfaces count as mirrors.
#[derive(Clone, Copy, PartialEq)]
enum Errand {
    /// It shows what the camera sees, by mirrors and through glass too.
    Show,
    /// The same, as one of several branches: it has no more.
    ShowAsBranch,
    /// It left a diffuse surface to gather light there.
    Gather,
    /// The same, when it has met mirrors or glass.
    GatherByMirrors,
    /// Photons told of all other light.
    FindTexturedLamps,
}

impl Errand {
    const AS_BRANCH: f32 = -1.0;
    const BY_MIRRORS: f32 = 0.0;
    const TEXTURED_LAMPS: f32 = f32::INFINITY;

    fn of(path: &Path) -> Errand {
        match path.scatter_pdf {
            None => Errand::Show,
            Some(Errand::AS_BRANCH) => Errand::ShowAsBranch,
            Some(Errand::BY_MIRRORS) => Errand::GatherByMirrors,
            Some(Errand::TEXTURED_LAMPS) => Errand::FindTexturedLamps,
            Some(_) => Errand::Gather,
        }
    }

    /// The density of a path that leaves a surface for the errand.
    fn density(self, pdf: Option<f32>) -> Option<f32> {
        match self {
            Errand::Show => None,
            Errand::ShowAsBranch => Some(Errand::AS_BRANCH),
            Errand::Gather => pdf.map(|pdf| pdf.clamp(f32::MIN_POSITIVE, f32::MAX)),
            Errand::GatherByMirrors => Some(Errand::BY_MIRRORS),
            Errand::FindTexturedLamps => Some(Errand::TEXTURED_LAMPS),
        }
    }

    fn shows(self) -> bool {
        matches!(self, Errand::Show | Errand::ShowAsBranch)
    }
}

/// The same for the paths of a camera.
pub(super) struct CameraGather<'a> {
    gather: Gather<'a>,
    camera: CameraPaths,
}

impl<'a> Gather<'a> {
    pub fn new(
        maps: PhotonMaps,
        (nearest, most_radius): (u32, f32),
        rays: u32,
        direct: DirectLight<'a>,
        has_textured_lamps: bool,
        max_bounces: u32,
    ) -> Gather<'a> {
        Gather { maps, nearest, most_radius, rays, direct, has_textured_lamps, max_bounces }
    }

    /// Bytes of memory of its photons.
    pub fn bytes(&self) -> u64 {
        self.maps.global.bytes() + self.maps.caustic.bytes()
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
        let errand = Errand::of(path);
        let is_seen = errand.shows();
        if is_seen && path.bounces == 0 {
            out.add_first_hit(path, hit);
        }
        // Lamps with a texture send out no photons.
        if is_seen || !hit.material.is_lamp {
            out.add(path, path.throughput * hit.material.emitted(hit.front));
        }
        if path.bounces >= self.max_bounces || bsdf.is_black() {
            return None;
        }
        if bsdf.is_diffuse() && errand != Errand::FindTexturedLamps {
            out.add(path, path.throughput * self.photon_light(hit, &bsdf, is_seen));
        }
        if bsdf.is_diffuse() && is_seen {
            self.direct.add_lamps(path, hit, &bsdf, out);
            self.direct.add_sky(path, hit, &bsdf, out);
        }
        if errand == Errand::Show && bsdf.is_diffuse() && self.rays > 1 {
            self.branch(path, hit, &bsdf, out);
            return None;
        }
        self.scatter(path, hit, &bsdf)
    }

    /// Divides a path.
    fn branch(&self, path: &Path, hit: &SurfaceInteraction, bsdf: &Bsdf, out: &mut ShadeOutput) {
        for number in 0..self.rays {
            let mut branch = Path {
                sampler: path.sampler.branch(number, self.rays),
                throughput: path.throughput / self.rays as f32,
                scatter_pdf: Errand::ShowAsBranch.density(None),
                ..*path
            };
            if let Some(ray) = self.scatter(&mut branch, hit, bsdf) {
                out.branch(ray, &branch);
            }
        }
    }

    /// The ray with which a path goes on, unless photons told of all that it would find.
    fn scatter(&self, path: &mut Path, hit: &SurfaceInteraction, bsdf: &Bsdf) -> Option<Ray> {
        let scattered = bsdf.sample(Pair::Direction.of(path), Pair::PunctualLight.of(path)[1])?;
        if !hit.leaves(scattered.wi, scattered.is_transmitted) {
            return None;
        }
        let errand = self.next_errand(Errand::of(path), bsdf.is_diffuse() && scattered.pdf.is_some())?;
        path.throughput *= scattered.weight / (scattered.eta * scattered.eta);
        path.segment += 1;
        path.bounces += 1;
        path.straight = 0.0;
        path.spread = path.spread.max(bsdf.spread());
        path.scatter_pdf = errand.density(scattered.pdf);
        Some(hit.spawn(scattered.wi, scattered.is_transmitted))
    }

    /// What a path is out for after a surface that scattered it diffusely or as a mirror does.
    fn next_errand(&self, errand: Errand, is_diffuse: bool) -> Option<Errand> {
        match errand {
            Errand::Show | Errand::ShowAsBranch if is_diffuse => Some(Errand::Gather),
            Errand::Show | Errand::ShowAsBranch | Errand::FindTexturedLamps => Some(errand),
            Errand::Gather | Errand::GatherByMirrors if is_diffuse => {
                self.has_textured_lamps.then_some(Errand::FindTexturedLamps)
            }
            Errand::Gather | Errand::GatherByMirrors => Some(Errand::GatherByMirrors),
        }
    }
}

impl Shader for CameraGather<'_> {
    fn begin(&self, at: [u32; 2], sample_index: u32, pixel: u32) -> (Ray, Path) {
        self.camera.begin(at, sample_index, pixel)
    }

    fn looks_around(&self) -> bool {
        true
    }

    fn most_branches(&self) -> usize {
        self.gather.rays as usize
    }

    fn shade(
        &self,
        path: &mut Path,
        ray: &Ray,
        hit: Option<&SurfaceInteraction>,
        out: &mut ShadeOutput,
    ) -> Option<Ray> {
        let Some(hit) = hit else {
            // Other light of the sky is that of photons.
            let density = match Errand::of(path) {
                Errand::Gather => path.scatter_pdf,
                errand if errand.shows() => None,
                _ => return None,
            };
            out.add(path, path.throughput * self.gather.direct.sky_found(ray.dir, density));
            return None;
        };
        path.throughput *= hit.transmittance();
        if Pair::Survival.of(path)[0] < hit.alpha {
            return self.gather.gather(path, ray, hit, out);
        }
        path.segment += 1;
        path.straight += hit.distance;
        path.passed += 1;
        (path.passed <= MAX_PASSED).then(|| hit.spawn(ray.dir, true))
    }
}
