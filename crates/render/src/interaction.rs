//! What a ray found: a point on a surface as seen from where the ray came.

use crate::{
    material::{Materials, Place, ShadingMaterial, Slopes},
    offset::SurfacePoint,
    wave::Path,
    world::{Surface, World},
};
use glam::{Vec2, Vec3};
use raystrips_geom::{Attributes, Hit, Ray, Shape};
use raystrips_tracer::OpenError;

/// A hit made ready for shading.
pub(crate) struct SurfaceInteraction {
    pub point: SurfacePoint,
    /// The geometric normal on the side of the viewer.
    pub n: Vec3,
    /// The normal that the surface is shaded with, which those of the corners and of a texture may turn; on the side of the
    /// viewer, too.
    pub shading_n: Vec3,
    /// The front was hit, from which the corners run counter-clockwise.
    pub front: bool,
    /// Distance from the ray's origin in scene units.
    pub distance: f32,
    pub material: ShadingMaterial,
    pub is_strand: bool,
    /// What the path came through absorbs, for each unit of length at the beginning, if it is not this solid.
    pub around: Vec3,
    /// How much of the path ends here. Strands that let a ray pass were not hit by it.
    pub alpha: f32,
}

/// A ray of a path, and what is needed to see what it hits.
pub(crate) struct Seen<'a> {
    pub world: &'a dyn World,
    pub materials: &'a Materials,
    pub ray: &'a Ray,
    pub path: &'a Path,
}

impl Seen<'_> {
    /// `None` where nothing was hit, or a triangle without area.
    ///
    /// # Errors
    /// If a texture cannot be read.
    pub fn surface(&self, hit: &Hit, surface: &Surface) -> Result<Option<SurfaceInteraction>, OpenError> {
        let Some(point) = self.point(hit, surface) else { return Ok(None) };
        let front = point.ng.dot(self.ray.dir) < 0.0;
        let n = if front { point.ng } else { -point.ng };
        let distance = hit.t * self.ray.dir.length();
        let mut interaction = SurfaceInteraction {
            point,
            n,
            shading_n: n,
            front,
            distance,
            material: *self.materials.of(surface.geometry),
            is_strand: matches!(surface.shape, Shape::Segment(_)),
            around: self.materials.absorption(self.path.medium),
            alpha: 1.0,
        };
        // Strands are not sampled.
        interaction.material.is_lamp &= !interaction.is_strand;
        let (Some(corners), Shape::Triangle(positions)) = (&surface.corners, &surface.shape) else {
            if !interaction.is_strand {
                interaction.alpha = self.materials.alpha_of(surface.geometry);
            }
            return Ok(Some(interaction));
        };
        let place = Place {
            world: self.world,
            attributes: interpolated(corners, surface.u, surface.v),
            tex_coords: corners.map(|corner| corner.tex_coords),
            edges: [positions[1] - positions[0], positions[2] - positions[0]],
            width: self.path.width_at(distance),
        };
        let found = self.materials.at(surface.geometry, &place)?;
        (interaction.material, interaction.alpha) = (found.material, found.alpha);
        // Corners may be wound against their normals: the viewer's side is that of the geometric one.
        let facing = |normal: Vec3| if normal.dot(n) < 0.0 { -normal } else { normal };
        let smooth = place.attributes.normal.try_normalize().map_or(n, facing);
        let to_viewer = -self.ray.dir.normalize();
        let turned = |slopes: Option<Slopes>| {
            seen_from(slopes.map_or(smooth, |slopes| slopes.turned(smooth)), to_viewer)
        };
        interaction.shading_n = turned(found.slopes);
        if let Some(layers) = &mut interaction.material.layers {
            layers.clearcoat_normal = turned(found.coat_slopes);
        }
        Ok(Some(interaction))
    }

    fn point(&self, hit: &Hit, surface: &Surface) -> Option<SurfacePoint> {
        if !hit.is_hit() {
            return None;
        }
        let point = match &surface.shape {
            Shape::Triangle(corners) => SurfacePoint::on_triangle(corners, surface.u, surface.v),
            Shape::Segment(segment) => SurfacePoint::on_segment(segment, surface.u, self.ray, hit.t),
        }?;
        Some(SurfacePoint { error: point.error + surface.error, ..point })
    }
}

/// Attributes between corners.
fn interpolated([a, b, c]: &[Attributes; 3], u: f32, v: f32) -> Attributes {
    let w = 1.0 - u - v;
    let tex_coord = |i: usize| -> Vec2 { a.tex_coords[i] * w + b.tex_coords[i] * u + c.tex_coords[i] * v };
    Attributes {
        normal: a.normal * w + b.normal * u + c.normal * v,
        tex_coords: [tex_coord(0), tex_coord(1)],
        color: a.color * w + b.color * u + c.color * v,
        tangent: a.tangent * w + b.tangent * u + c.tangent * v,
    }
}

/// The normal, turned so far towards a viewer whom it shows its back that it does not.
fn seen_from(normal: Vec3, to_viewer: Vec3) -> Vec3 {
    /// Cosine of the steepest view of a surface.
    const LEAST_COSINE: f32 = 1e-3;
    let cosine = normal.dot(to_viewer);
    if cosine >= LEAST_COSINE {
        return normal;
    }
    (normal + to_viewer * (LEAST_COSINE - cosine)).normalize()
}

impl SurfaceInteraction {
    /// The half line along `dir` from here, on this side or behind the surface.
    pub fn spawn(&self, dir: Vec3, is_behind: bool) -> Ray {
        self.point.spawn(if is_behind { -self.n } else { self.n }, dir)
    }

    /// True if `dir` leaves to the side that it is meant to: the shading normal may say otherwise than the surface.
    pub fn leaves(&self, dir: Vec3, is_behind: bool) -> bool {
        (self.n.dot(dir) < 0.0) == is_behind
    }

    /// What is left of light after its way here: a solid that it came through absorbs some (Beer and Lambert).
    pub fn transmittance(&self) -> Vec3 {
        let is_end_of_solid = !self.front && self.material.is_solid();
        let absorption = if is_end_of_solid { self.material.absorption } else { self.around };
        match absorption == Vec3::ZERO {
            true => Vec3::ONE,
            false => (absorption * -self.distance).to_array().map(libm::expf).into(),
        }
    }

    /// What a path is in, by number, that was in `before` and is scattered here.
    pub fn medium_after(&self, before: u8, is_transmitted: bool) -> u8 {
        match is_transmitted && self.material.is_solid() {
            true if self.front => self.material.medium,
            true => 0,
            false => before,
        }
    }
}
