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

/// What a path is out for. Glossy surfaces count as mirrors.
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
    /// It left a strand, of whose light no photons tell.
    Trace,
    /// The same, when it has met mirrors or glass.
    TraceByMirrors,
    /// Photons told of all other light.
    FindTexturedLamps,
}

impl Errand {
    const ALL: [Errand; 7] = [
        Errand::Show,
        Errand::ShowAsBranch,
        Errand::Gather,
        Errand::GatherByMirrors,
        Errand::Trace,
        Errand::TraceByMirrors,
        Errand::FindTexturedLamps,
    ];

    /// Paths know it by its number.
    const ARE_IN_ORDER: () = {
        let mut number = 0;
        while number < Errand::ALL.len() {
            assert!(Errand::ALL[number] as usize == number);
            number += 1;
        }
    };

    fn of(path: &Path) -> Errand {
        const { Errand::ARE_IN_ORDER }
        Errand::ALL[usize::from(path.errand)]
    }

    fn shows(self) -> bool {
        matches!(self, Errand::Show | Errand::ShowAsBranch)
    }

    /// True where a lamp that the path meets is found in no other way.
    fn finds_lamps(self) -> bool {
        self.shows() || self == Errand::TraceByMirrors
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
        if errand.finds_lamps() || !hit.material.is_lamp {
            out.add(path, path.throughput * hit.material.emitted(hit.front));
        }
        if path.bounces >= self.max_bounces || bsdf.is_black() {
            return None;
        }
        if bsdf.is_diffuse() && errand != Errand::FindTexturedLamps {
            self.add_light(path, hit, &bsdf, is_seen, out);
        }
        if errand == Errand::Show && bsdf.is_diffuse() && self.rays > 1 {
            self.branch(path, hit, &bsdf, out);
            return None;
        }
        self.scatter(path, hit, &bsdf)
    }

    /// Adds light of a diffuse surface, but for what the ray finds with which the path goes on.
    fn add_light(
        &self,
        path: &Path,
        hit: &SurfaceInteraction,
        bsdf: &Bsdf,
        is_seen: bool,
        out: &mut ShadeOutput,
    ) {
        if !hit.is_strand {
            out.add(path, path.throughput * self.photon_light(hit, bsdf, is_seen));
        }
        if is_seen || hit.is_strand {
            self.direct.add_lamps(path, hit, bsdf, out);
            self.direct.add_sky(path, hit, bsdf, out);
        }
    }

    /// Divides a path.
    fn branch(&self, path: &Path, hit: &SurfaceInteraction, bsdf: &Bsdf, out: &mut ShadeOutput) {
        for number in 0..self.rays {
            let mut branch = Path {
                sampler: path.sampler.branch(number, self.rays),
                throughput: path.throughput / self.rays as f32,
                errand: Errand::ShowAsBranch as u8,
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
        let is_diffuse = bsdf.is_diffuse() && scattered.pdf.is_some();
        let errand = self.next_errand(Errand::of(path), is_diffuse, hit.is_strand)?;
        path.throughput *= scattered.weight / (scattered.eta * scattered.eta);
        path.segment += 1;
        path.bounces += 1;
        path.straight = 0.0;
        path.spread = path.spread.max(bsdf.spread());
        path.scatter_pdf = scattered.pdf;
        path.medium = hit.medium_after(path.medium, scattered.is_transmitted);
        path.errand = errand as u8;
        Some(hit.spawn(scattered.wi, scattered.is_transmitted))
    }

    /// What a path is out for after a surface or a strand that scattered it diffusely or as a mirror does.
    fn next_errand(&self, errand: Errand, is_diffuse: bool, is_strand: bool) -> Option<Errand> {
        match errand {
            Errand::FindTexturedLamps => Some(errand),
            _ if is_diffuse && is_strand => Some(Errand::Trace),
            Errand::Show | Errand::ShowAsBranch => Some(if is_diffuse { Errand::Gather } else { errand }),
            _ if is_diffuse => self.has_textured_lamps.then_some(Errand::FindTexturedLamps),
            Errand::Gather | Errand::GatherByMirrors => Some(Errand::GatherByMirrors),
            Errand::Trace | Errand::TraceByMirrors => Some(Errand::TraceByMirrors),
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
                Errand::Gather | Errand::Trace => path.scatter_pdf,
                errand if errand.finds_lamps() => None,
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
