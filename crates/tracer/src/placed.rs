//! Instances: rays into the coordinates of a part of the scene, and what they hit back from there.

use crate::prepared::PreparedRay;
use crate::scene::ResolvedHit;
use glam::{DMat3, Vec3};
use raystrips_geom::affine::{is_mirrored, normal_matrix, transformed_triangle};
use raystrips_geom::{Attributes, Ray, Shape};
use raystrips_pack::Instance;

/// Bound of what the rounding of a ray in a part moves its origin by, relative to the coordinates there: half an ulp for the
/// ray that found a place, as much for the one that leaves it, and the same again for what tests of the next one round.
const ROUNDING: f64 = 4.0 / (1u32 << 24) as f64;

/// The ray as seen from the part that the instance shows. `None` if it is none there, as of numbers beyond all bounds.
///
/// Distances along it are the same in both. Origin and direction are rounded to `f32`, so that in the part rays are traced as
/// everywhere else, and meet closed meshes.
#[inline(always)]
pub(crate) fn local_ray(instance: &Instance, ray: &PreparedRay) -> Option<Ray> {
    let local_from_world = instance.world_from_local().inverse();
    let [x, y, z, _] = ray.org;
    let org = local_from_world.transform_point3(Vec3::new(x, y, z).as_dvec3()).as_vec3();
    let dir = local_from_world.transform_vector3(ray.direction()).as_vec3();
    let local = Ray { org, tnear: ray.tnear, dir, tfar: ray.tfar };
    local.is_valid().then_some(local)
}

/// Where the instance shows what was hit in its part.
pub fn placed(instance: &Instance, found: &ResolvedHit) -> ResolvedHit {
    let Shape::Triangle(corners) = found.shape else { return *found };
    let world_from_local = instance.world_from_local();
    let reach = corners.iter().fold(Vec3::ZERO, |reach, corner| reach.max(corner.abs())).as_dvec3();
    let rounding = absolute(world_from_local.matrix3) * reach * ROUNDING;
    let (u, v) = if is_mirrored(world_from_local.matrix3) { (found.v, found.u) } else { (found.u, found.v) };
    let shape = Shape::Triangle(transformed_triangle(corners, &world_from_local));
    ResolvedHit { shape, u, v, error: rounding.max_element() as f32, ..*found }
}

/// The attributes of the corners of what [`placed`] gives.
pub fn placed_attributes(instance: &Instance, corners: [Attributes; 3]) -> [Attributes; 3] {
    let matrix = instance.world_from_local().matrix3;
    let normals = normal_matrix(matrix);
    let [a, b, c] = corners.map(|corner| {
        let turned = |matrix: DMat3, v: Vec3| (matrix * v.as_dvec3()).normalize_or_zero().as_vec3();
        let (normal, tangent) = (turned(normals, corner.normal), turned(matrix, corner.tangent));
        Attributes { normal, tangent, ..corner }
    });
    if is_mirrored(matrix) { [a, c, b] } else { [a, b, c] }
}

fn absolute(matrix: DMat3) -> DMat3 {
    DMat3::from_cols(matrix.x_axis.abs(), matrix.y_axis.abs(), matrix.z_axis.abs())
}
