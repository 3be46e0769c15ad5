//! The curved surface over a triangle or an edge.

use glam::DVec3;

/// A vertex of the base, or a point between some.
#[derive(Clone, Copy, Debug, Default)]
pub struct Corner {
    pub position: DVec3,
    pub normal: DVec3,
}

/// The point between `corners` by their weights. The flat point is projected to the tangent planes of the corners;
/// `roundness` of the way to the mean of these is gone (Boubekeur, Alexa 2008).
pub fn surface(corners: &[(Corner, f64)], roundness: f64) -> Corner {
    let flat: DVec3 = corners.iter().map(|(corner, weight)| corner.position * *weight).sum();
    let normal: DVec3 = corners.iter().map(|(corner, weight)| corner.normal * *weight).sum();
    let to_planes = corners
        .iter()
        .map(|(corner, weight)| corner.normal * ((corner.position - flat).dot(corner.normal) * weight));
    let bulge: DVec3 = to_planes.sum();
    let normal = normal.try_normalize().unwrap_or(corners[0].0.normal);
    Corner { position: flat + bulge * roundness, normal }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sphere_becomes_rounder() {
        let corners = [DVec3::X, DVec3::Y].map(|p| (Corner { position: p, normal: p }, 0.5));
        let radius = |roundness| surface(&corners, roundness).position.length();
        assert!(radius(0.0) < 0.71 && radius(0.75) > 0.9 && radius(0.75) < 1.0);
    }
}
