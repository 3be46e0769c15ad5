//! The emissive triangles of a scene, which renderers sample as lights.

use raystrips_geom::scene::SceneDesc;
use raystrips_pack::Emitter;
use raystrips_strips::Mesh;

/// For each geometry whether it is a lamp.
pub(crate) fn shining(scene: &SceneDesc) -> Vec<bool> {
    scene.geometries.iter().map(|g| scene.materials[g.material as usize].is_lamp()).collect()
}

/// Every triangle of a geometry that shines; those not in `shines` do not.
pub(crate) fn emitters(shines: &[bool], mesh: &Mesh) -> Vec<Emitter> {
    let emissive =
        (0..mesh.triangles.len()).filter(|&i| shines.get(mesh.geometries[i] as usize) == Some(&true));
    let emitter =
        |i| Emitter { corners: mesh.corners(i).map(|p| p.to_array()), geometry: mesh.geometries[i] };
    emissive.map(emitter).collect()
}
