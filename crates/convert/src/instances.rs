//! Instances of parts: from the import to the pack.

use crate::gathered::Gathered;
use crate::import::Imported;
use crate::offset;
use crate::partition::Census;
use glam::{DVec3, Vec3};
use raystrips_geom::Aabb;
use raystrips_geom::affine::{norm, transformed_bounds, transformed_triangle};
use raystrips_pack::{Emitter, GeometryBounds, Instance};

/// The instances of the import between coordinates of the pack. Their `root` is the number of the part, from 0 on.
pub(crate) fn placed(imported: &Imported) -> Vec<Instance> {
    let scene = DVec3::from_array(offset::placement(&imported.bounds).offset);
    let placed = imported.instances.iter().map(|instance| {
        let part =
            DVec3::from_array(offset::placement(&imported.parts[instance.part as usize].bounds).offset);
        let world_from_local = instance.world_from_local;
        let translation = world_from_local.transform_point3(part) - scene;
        let [x, y, z] = world_from_local.matrix3.transpose().to_cols_array_2d().map(DVec3::from_array);
        let row = |axis: usize, row: DVec3| row.extend(translation[axis]).as_vec4().to_array();
        Instance { world_from_local: [row(0, x), row(1, y), row(2, z)], root: instance.part - 1 }
    });
    placed.collect()
}

/// Most by which a coordinate of what instances show is moved: as in the part, and by the rounding of the transformation.
pub(crate) fn position_error(imported: &Imported, placed: &[Instance], gathered: &Gathered) -> f64 {
    let of_instance = |(instance, placed): (&raystrips_meshio::Instance, &Instance)| {
        let Some(part) = &gathered.parts[placed.root as usize] else { return 0.0 };
        let exact = instance.world_from_local.matrix3;
        let rounded = placed.world_from_local();
        let moved = norm(exact - rounded.matrix3) * reach(&part.tree.bounds());
        let rounding = rounded.translation.abs().max_element() / f64::from(1u32 << 24);
        norm(rounded.matrix3) * part.census.position_error + moved + rounding
    };
    imported.instances.iter().zip(placed).map(of_instance).fold(0.0, f64::max)
}

/// The greatest coordinate.
fn reach(bounds: &Aabb) -> f64 {
    f64::from(bounds.min.abs().max(bounds.max.abs()).max_element())
}

/// Lets boxes of geometries, which are those of what stands in the scene, hold what instances show too.
pub(crate) fn grow_bounds(bounds: &mut [GeometryBounds], instances: &[Instance], gathered: &Gathered) {
    let in_parts: Vec<Vec<(usize, Aabb)>> = gathered
        .parts
        .iter()
        .map(|part| part.as_ref().map_or(Vec::new(), |part| boxes(&part.census, bounds.len())))
        .collect();
    for instance in instances {
        for (geometry, local) in &in_parts[instance.root as usize] {
            let grown = &mut bounds[*geometry];
            let shown = transformed_bounds(local, &instance.world_from_local());
            let before = Aabb { min: Vec3::from_array(grown.min), max: Vec3::from_array(grown.max) };
            let all = before.union(shown);
            *grown = GeometryBounds { min: all.min.to_array(), max: all.max.to_array() };
        }
    }
}

/// The geometries that there are, with their boxes.
fn boxes(census: &Census, geometries: usize) -> Vec<(usize, Aabb)> {
    let bounds = census.geometry_bounds(geometries).into_iter().enumerate();
    let boxes = bounds.map(|(geometry, GeometryBounds { min, max })| {
        (geometry, Aabb { min: Vec3::from_array(min), max: Vec3::from_array(max) })
    });
    boxes.filter(|(_, bounds)| bounds.min.cmple(bounds.max).all()).collect()
}

/// The lamps of a part as an instance shows them.
pub(crate) fn placed_emitters(instance: &Instance, emitters: &[Emitter]) -> Vec<Emitter> {
    let world_from_local = instance.world_from_local();
    let placed = |emitter: &Emitter| {
        let corners = transformed_triangle(emitter.corners.map(Vec3::from_array), &world_from_local);
        Emitter { corners: corners.map(|p| p.to_array()), ..*emitter }
    };
    emitters.iter().map(placed).collect()
}
