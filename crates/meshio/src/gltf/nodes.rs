//! The tree of nodes: where meshes, cameras and lights stand.

use super::document::{Document, Node, entry};
use super::syntax;
use crate::Result;
use crate::emit::Emitter;
use glam::{DAffine3, DMat4, DQuat, DVec3};
use gltf::json::camera::Type as CameraType;
use gltf::json::extensions::scene::khr_lights_punctual::Type as LightType;
use gltf::json::validation::Checked;
use raystrips_geom::scene::{Camera, Light, LightKind, Projection};
use std::f32::consts::{FRAC_PI_2, PI};
use std::path::Path;

/// What a walk finds that holds triangles.
pub(super) struct Found {
    pub meshes: Vec<MeshNode>,
    /// Where each node stands, if the document has skins; nodes that are below themselves stand nowhere.
    pub file_from_node: Vec<Option<DAffine3>>,
}

/// A mesh, which exists, and where it stands.
pub(super) struct MeshNode {
    pub mesh: usize,
    pub node: Option<usize>,
    pub file_from_local: DAffine3,
}

/// Walks through the default scene, or the first, or all nodes if there is none; without nodes, over all meshes.
/// Adds cameras and lights to `out`.
pub(super) fn walk(path: &Path, document: &Document, out: &mut Emitter) -> Result<Found> {
    let mut found = Found { meshes: Vec::new(), file_from_node: Vec::new() };
    if document.nodes.is_empty() {
        // A library of meshes that nothing shows: the least surprise is to show them.
        let file_from_local = DAffine3::IDENTITY;
        let all = (0..document.meshes.len()).map(|mesh| MeshNode { mesh, node: None, file_from_local });
        found.meshes.extend(all);
    }
    let mut seen = vec![false; document.nodes.len()];
    if !document.skins.is_empty() {
        found.file_from_node.resize(document.nodes.len(), None);
    }
    let (at, roots) = roots(path, document)?;
    let mut open: Vec<(u32, DAffine3)> = Vec::new();
    push(path, &mut open, &at, &roots, DAffine3::IDENTITY, document, &mut seen)?;
    while let Some((index, file_from_parent)) = open.pop() {
        let at = format!("nodes[{index}]");
        let node = &document.nodes[index as usize];
        let file_from_local = file_from_parent * parent_from_local(path, &at, node)?;
        push(
            path,
            &mut open,
            &format!("{at}.children"),
            &node.children,
            file_from_local,
            document,
            &mut seen,
        )?;
        if let Some(mesh) = node.mesh {
            entry(&document.meshes, mesh as usize, path, format_args!("{at}.mesh"))?;
            found.meshes.push(MeshNode { mesh: mesh as usize, node: Some(index as usize), file_from_local });
        }
        if let Some(stands) = found.file_from_node.get_mut(index as usize) {
            *stands = Some(file_from_local);
        }
        add_camera(path, document, &at, node, file_from_local, out)?;
        add_light(path, document, &at, node, file_from_local, out)?;
    }
    if !document.skins.is_empty() {
        place_the_rest(path, document, &mut seen, &mut found.file_from_node)?;
    }
    Ok(found)
}

/// Says where nodes stand that no scene shows: they may be joints all the same.
fn place_the_rest(
    path: &Path,
    document: &Document,
    seen: &mut [bool],
    file_from_node: &mut [Option<DAffine3>],
) -> Result<()> {
    let mut open: Vec<(u32, DAffine3)> = Vec::new();
    let roots = parentless(document).filter(|&node| !seen[node as usize]).collect::<Vec<_>>();
    push(path, &mut open, "nodes", &roots, DAffine3::IDENTITY, document, seen)?;
    while let Some((index, file_from_parent)) = open.pop() {
        let (at, node) = (format!("nodes[{index}]"), &document.nodes[index as usize]);
        let file_from_local = file_from_parent * parent_from_local(path, &at, node)?;
        file_from_node[index as usize] = Some(file_from_local);
        push(path, &mut open, &format!("{at}.children"), &node.children, file_from_local, document, seen)?;
    }
    Ok(())
}

/// The nodes to begin with and what names them.
fn roots(path: &Path, document: &Document) -> Result<(String, Vec<u32>)> {
    if let Some(scene) = document.scene {
        let nodes = &entry(&document.scenes, scene as usize, path, "scene")?.nodes;
        return Ok((format!("scenes[{scene}].nodes"), nodes.clone()));
    }
    if let Some(scene) = document.scenes.first() {
        return Ok(("scenes[0].nodes".into(), scene.nodes.clone()));
    }
    Ok(("nodes".into(), parentless(document).collect()))
}

/// Nodes that are no children.
fn parentless(document: &Document) -> impl Iterator<Item = u32> {
    let mut is_child = vec![false; document.nodes.len()];
    for &child in document.nodes.iter().flat_map(|node| &node.children) {
        if let Some(is_child) = is_child.get_mut(child as usize) {
            *is_child = true;
        }
    }
    (0..document.nodes.len() as u32).filter(move |&i| !is_child[i as usize])
}

/// Puts nodes on the stack so that the first comes off first. A node that comes twice would make the walk endless.
fn push(
    path: &Path,
    open: &mut Vec<(u32, DAffine3)>,
    at: &str,
    nodes: &[u32],
    file_from_parent: DAffine3,
    document: &Document,
    seen: &mut [bool],
) -> Result<()> {
    for (i, &node) in nodes.iter().enumerate().rev() {
        entry(&document.nodes, node as usize, path, format_args!("{at}[{i}]"))?;
        if std::mem::replace(&mut seen[node as usize], true) {
            let what =
                format!("node {node} is reached twice, but nodes must form trees; export the file again");
            return Err(syntax(path, format_args!("{at}[{i}]"), what));
        }
        open.push((node, file_from_parent));
    }
    Ok(())
}

fn parent_from_local(path: &Path, at: &str, node: &Node) -> Result<DAffine3> {
    if let Some(columns) = node.matrix {
        if [columns[3], columns[7], columns[11], columns[15]] != [0.0, 0.0, 0.0, 1.0] {
            let what = "its last row must be 0, 0, 0, 1; export the file again";
            return Err(syntax(path, format_args!("{at}.matrix"), what));
        }
        return Ok(DAffine3::from_mat4(DMat4::from_cols_array(&columns)));
    }
    // Rotations are unit quaternions up to the digits in the file; one without length is none.
    let rotation = DQuat::from_array(node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]));
    let rotation = if rotation.length_squared() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY };
    Ok(DAffine3::from_scale_rotation_translation(
        DVec3::from(node.scale.unwrap_or([1.0; 3])),
        rotation,
        DVec3::from(node.translation.unwrap_or_default()),
    ))
}

fn add_camera(
    path: &Path,
    document: &Document,
    at: &str,
    node: &Node,
    file_from_local: DAffine3,
    out: &mut Emitter,
) -> Result<()> {
    let Some(index) = node.camera else { return Ok(()) };
    let camera = entry(&document.cameras, index as usize, path, format_args!("{at}.camera"))?;
    let (projection, aspect) = match (&camera.type_, &camera.perspective, &camera.orthographic) {
        (Checked::Valid(CameraType::Perspective), Some(lens), _) => {
            (Projection::Perspective { vertical_fov: lens.yfov }, lens.aspect_ratio)
        }
        (Checked::Valid(CameraType::Orthographic), _, Some(lens)) => {
            (Projection::Orthographic { height: 2.0 * lens.ymag.abs() }, Some((lens.xmag / lens.ymag).abs()))
        }
        _ => {
            out.warn(path, format_args!("cameras[{index}] has no projection and is left out"));
            return Ok(());
        }
    };
    let usable = match projection {
        Projection::Perspective { vertical_fov } => vertical_fov > 0.0 && vertical_fov < PI,
        Projection::Orthographic { height } => height > 0.0 && height.is_finite(),
    };
    let world_from_local = out.placement() * file_from_local;
    let frame = camera_frame(world_from_local).filter(|_| usable);
    let Some((forward, up)) = frame else {
        out.warn(path, format_args!("cameras[{index}] cannot see anything and is left out"));
        return Ok(());
    };
    out.scene.cameras.push(Camera {
        name: name(&node.name, &camera.name),
        position: world_from_local.translation.to_array(),
        forward,
        up,
        projection,
        aspect: aspect.filter(|aspect| *aspect > 0.0 && aspect.is_finite()),
    });
    Ok(())
}

/// Cameras look along -z, with +y up. Scaling and shearing must not bend that.
fn camera_frame(world_from_local: DAffine3) -> Option<([f32; 3], [f32; 3])> {
    let forward = (-world_from_local.matrix3.z_axis).try_normalize()?;
    let up = world_from_local.matrix3.y_axis.reject_from_normalized(forward).try_normalize()?;
    world_from_local.is_finite().then(|| (forward.as_vec3().to_array(), up.as_vec3().to_array()))
}

fn add_light(
    path: &Path,
    document: &Document,
    at: &str,
    node: &Node,
    file_from_local: DAffine3,
    out: &mut Emitter,
) -> Result<()> {
    let Some(index) = node.extensions.light.as_ref().map(|light| light.light) else { return Ok(()) };
    let at = format!("{at}.extensions.KHR_lights_punctual.light");
    let light = entry(document.lights(), index as usize, path, at)?;
    let world_from_local = out.placement() * file_from_local;
    let direction = (-world_from_local.matrix3.z_axis).try_normalize().filter(|d| d.is_finite());
    let intensity = light.color.map(|c| c * light.intensity);
    let usable = world_from_local.is_finite() && intensity.iter().all(|c| c.is_finite() && *c >= 0.0);
    let position = world_from_local.translation.to_array();
    let kind = match (&light.type_, direction.map(|d| d.as_vec3().to_array())) {
        (Checked::Valid(LightType::Point), _) => Some(LightKind::Point { position }),
        (Checked::Valid(LightType::Directional), Some(direction)) => {
            Some(LightKind::Directional { direction })
        }
        (Checked::Valid(LightType::Spot), Some(direction)) => {
            let spot = light.spot.clone().unwrap_or_default();
            // Without a cone in the file, the specification's default.
            let outer = if light.spot.is_some() { spot.outer_cone_angle } else { PI / 4.0 };
            let outer_angle = outer.clamp(0.0, FRAC_PI_2);
            let inner_angle = spot.inner_cone_angle.clamp(0.0, outer_angle);
            Some(LightKind::Spot { position, direction, inner_angle, outer_angle })
        }
        _ => None,
    };
    match kind.filter(|_| usable) {
        Some(kind) => out.scene.lights.push(Light { name: name(&node.name, &light.name), intensity, kind }),
        None => out
            .warn(path, format_args!("light {index} has no usable type, direction or color and is left out")),
    }
    Ok(())
}

fn name(node: &Option<String>, own: &Option<String>) -> String {
    own.as_ref().or(node.as_ref()).cloned().unwrap_or_default()
}
