//! Affine transformations between the coordinates of a part of a scene and those of the scene.

use crate::Aabb;
use glam::{DAffine3, DMat3, DVec3, Vec3};

/// How much more than errors of coordinates before the transformation those after it may matter, both against the size of
/// what is transformed: |M| |M⁻¹| with the greatest sum of absolute values of a row for |M|. 1 to 3 where `matrix` turns
/// and scales evenly, infinite where there is no way back.
pub fn condition(matrix: DMat3) -> f64 {
    if !matrix.is_finite() || matrix.determinant() == 0.0 {
        return f64::INFINITY;
    }
    let inverse = matrix.inverse();
    if inverse.is_finite() { norm(matrix) * norm(inverse) } else { f64::INFINITY }
}

/// How much longer the longest coordinate of a vector may become: the greatest sum of absolute values of a row.
pub fn norm(matrix: DMat3) -> f64 {
    let rows = matrix.transpose();
    [rows.x_axis, rows.y_axis, rows.z_axis].map(|row| row.abs().element_sum()).into_iter().fold(0.0, f64::max)
}

/// True if the front of what is transformed becomes its back, unless corners are taken the other way round.
pub fn is_mirrored(matrix: DMat3) -> bool {
    matrix.determinant() < 0.0
}

/// Corners of a triangle where the transformation brings them, wound so that its front stays its front: if it mirrors, the second
/// and the third change places.
pub fn transformed_triangle(corners: [Vec3; 3], transformation: &DAffine3) -> [Vec3; 3] {
    let [a, b, c] = corners.map(|p| transformation.transform_point3(p.as_dvec3()).as_vec3());
    if is_mirrored(transformation.matrix3) { [a, c, b] } else { [a, b, c] }
}

/// Turns normals as `matrix` turns surfaces, to the same side if it mirrors; their lengths are of no meaning afterwards.
pub fn normal_matrix(matrix: DMat3) -> DMat3 {
    let DMat3 { x_axis: x, y_axis: y, z_axis: z } = matrix;
    // The cofactors are the inverse transpose but for a factor, and exist for flat transformations too.
    let sign = if is_mirrored(matrix) { -1.0 } else { 1.0 };
    DMat3::from_cols(y.cross(z) * sign, z.cross(x) * sign, x.cross(y) * sign)
}

/// Least and greatest corner of a box around the box `min` to `max` where `transformation` brings it.
pub fn bounds_of([min, max]: [DVec3; 2], transformation: &DAffine3) -> [DVec3; 2] {
    let corner = |i: usize| {
        let pick = |axis: usize| if i >> axis & 1 == 0 { min[axis] } else { max[axis] };
        transformation.transform_point3(DVec3::new(pick(0), pick(1), pick(2)))
    };
    let corners = (0..8).map(corner);
    corners.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[min, max], p| [min.min(p), max.max(p)])
}

/// The same for a box in `f32`, rounded outward; of an empty one an empty one.
pub fn transformed_bounds(bounds: &Aabb, transformation: &DAffine3) -> Aabb {
    if bounds.min.cmpgt(bounds.max).any() {
        return Aabb::EMPTY;
    }
    let [min, max] = bounds_of([bounds.min.as_dvec3(), bounds.max.as_dvec3()], transformation);
    let around = Aabb { min: min.as_vec3(), max: max.as_vec3() };
    Aabb { min: around.min.map(|x| x.next_down()), max: around.max.map(|x| x.next_up()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DQuat;

    #[test]
    fn conditions_are_those_of_scales() {
        let turned = DMat3::from_quat(DQuat::from_euler(glam::EulerRot::XYZ, 1.0, 2.0, 3.0));
        assert!((1.0..=3.0).contains(&condition(turned * -5.0)));
        assert!((condition(DMat3::from_diagonal(DVec3::new(2.0, -1.0, 10.0))) - 10.0).abs() < 1e-12);
        assert_eq!(condition(DMat3::from_diagonal(DVec3::new(1.0, 0.0, 1.0))), f64::INFINITY);
        assert_eq!(condition(DMat3::NAN), f64::INFINITY);
    }

    #[test]
    fn normals_stay_on_their_side_and_upright() {
        let matrix = DMat3::from_cols_array(&[2.0, 0.5, 0.0, 0.0, -1.0, 0.3, 0.1, 0.0, 4.0]);
        let (a, b) = (DVec3::new(1.0, 0.2, 0.0), DVec3::new(0.0, 1.0, -0.5));
        let normal = normal_matrix(matrix) * a.cross(b);
        // Mirrored, so that corners run the other way round.
        let expected = (matrix * b).cross(matrix * a);
        assert!(normal.normalize().distance(expected.normalize()) < 1e-12);
    }

    #[test]
    fn boxes_hold_what_was_in_them() {
        let turn = DAffine3::from_rotation_translation(DQuat::from_rotation_z(0.7), DVec3::splat(0.1));
        let bounds = transformed_bounds(&Aabb { min: -Vec3::ONE, max: Vec3::ONE }, &turn);
        let corner = turn.transform_point3(DVec3::new(1.0, -1.0, 1.0));
        assert!(bounds.min.as_dvec3().cmple(corner).all() && bounds.max.as_dvec3().cmpge(corner).all());
        assert_eq!(transformed_bounds(&Aabb::EMPTY, &turn), Aabb::EMPTY);
    }
}
