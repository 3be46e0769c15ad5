//! A small pack with something of everything: three pages, one of strips of one to five windows with splits, one of
//! single windows, one of strands; four clusters, turns, two geometries in one cluster, coordinates in fixed point and as floats,
//! emitters, ids, names, a light, a camera, a sky, attributes of one page and an image of two tiles. The second page is
//! shown by two instances.

use glam::{Vec2, Vec3, Vec4};
use raystrips_geom::scene::{
    AlphaMode, Camera, Geometry, Light, LightKind, Material, Projection, SceneDesc, Sky,
};
use raystrips_geom::strip::{PlaneSplit, WINDOW_TRIANGLES};
use raystrips_geom::texture::{Image, TILE_BYTES, Texture, Wrap, tile_count};
use raystrips_geom::{Aabb, Attributes, RadiusCode, Streams};
use raystrips_pack::layout::{ChildBoxes, TopNode, WIDTH};
use raystrips_pack::page::builder::{BuiltPage, Children, StripParts};
use raystrips_pack::{
    AttributeBuilder, BlockEntry, ByteCounts, Dropped, Emitter, GeometryBounds, Instance, Manifest,
    PackContents, PackWriter, PageBuilder, ProxyKind, StoredStrands, StrandParts, TopEntry, tile_code,
};
use std::io::Read;
use std::ops::Range;
use std::path::Path;

/// Writes the sample pack, with `alter` done to its manifest, to `path`. Gives its pages as they were built and
/// its manifest.
pub fn write_sample(path: &Path, alter: impl FnOnce(&mut Manifest)) -> (Vec<BuiltPage>, Manifest) {
    write_with(path, alter, &[], &[])
}

/// The same with boxes of geometries and packs of proxies.
#[allow(dead_code, reason = "not all tests need it")]
pub fn write_with(
    path: &Path,
    alter: impl FnOnce(&mut Manifest),
    geometry_bounds: &[GeometryBounds],
    proxies: &[(ProxyKind, &[u8])],
) -> (Vec<BuiltPage>, Manifest) {
    let mut writer = PackWriter::create(&path.with_extension("partial"), manifest()).unwrap();
    let first = first_page();
    writer.page(&first).unwrap();
    let second = second_page(writer.next_triangle());
    writer.page(&second).unwrap();
    let third = third_page(writer.next_triangle());
    writer.page(&third).unwrap();
    let ids: Vec<u8> =
        (0..writer.next_triangle() as u32).flat_map(|i| (i * 4 + i % 3).to_le_bytes()).collect();
    let (top_nodes, top_entries, instances) = top();
    alter(writer.manifest_mut());
    let emitter = Emitter { corners: [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.5]], geometry: 1 };
    let mut proxies = proxies.to_vec();
    let block = attributes(first.triangle_count);
    let entry = BlockEntry::of(&block);
    let entries = [entry, BlockEntry::default(), BlockEntry::default()];
    let tiles: Vec<u8> = (0..TILE_BYTES * tile_count(40, 3) as usize).map(|i| i as u8).collect();
    let codes: Vec<Vec<u8>> = tiles.chunks(TILE_BYTES).map(tile_code::encode).collect();
    let tile_entries: Vec<BlockEntry> = codes.iter().map(|code| BlockEntry::of(code)).collect();
    let codes = codes.concat();
    let contents = PackContents {
        top_nodes: &top_nodes,
        top_entries: &top_entries,
        instances: &instances,
        emitters: &mut bytemuck::bytes_of(&emitter),
        triangle_ids: &mut ids.as_slice(),
        geometry_bounds,
        attributes: Some([&mut bytemuck::cast_slice(&entries), &mut block.as_slice()]),
        tiles: Some((&tile_entries, &mut codes.as_slice())),
        proxies: proxies.iter_mut().map(|(kind, bytes)| (*kind, bytes as &mut dyn Read)).collect(),
    };
    let (manifest, _) = writer.finish(path, contents).unwrap();
    (vec![first, second, third], manifest)
}

/// Attributes of a page, of all kinds.
fn attributes(triangles: u32) -> Vec<u8> {
    let mut builder = AttributeBuilder::new(Streams::ALL);
    for i in 0..triangles {
        let corner = |k: u32| Attributes {
            normal: Vec3::new((i + k) as f32, 1.0, -2.0),
            tex_coords: [Vec2::new(i as f32, 0.5), Vec2::new(0.25, k as f32)],
            color: Vec4::new(0.0, 0.5, 1.0, 0.75),
            tangent: Vec3::new(1.0, k as f32, 0.0),
        };
        builder.triangle(&[corner(0), corner(1), corner(2)]);
    }
    builder.finish()
}

/// A tree over two clusters, the first with two strips.
fn first_page() -> BuiltPage {
    let rows = [row(0.0, 35), row(2.0, 12)];
    let strips = [
        vec![Strip::over(&rows[0], 0..30, 0), Strip::over(&rows[0], 30..33, 1)],
        vec![Strip::over(&rows[1], 0..12, 0)],
    ];
    let mut page = PageBuilder::default();
    let root = page.reserve_nodes(1);
    let first = page.reserve_nodes(2);
    page.set_node(root, vec![row_bounds(0.0), row_bounds(2.0)], Children::Nodes(first));
    for ((number, vertices), strips) in (first..).zip(&rows).zip(&strips) {
        add_cluster(&mut page, number, vertices, strips);
    }
    page.finish(0).unwrap()
}

/// One cluster with strips of one window, and a coordinate that needs a float.
fn second_page(first_triangle: u64) -> BuiltPage {
    let mut vertices = row(4.0, 20);
    vertices[0].z = 1e-20;
    let strips = [0..8, 6..14, 12..18].map(|refs| Strip::over(&vertices, refs, 1));
    let mut page = PageBuilder::default();
    let root = page.reserve_nodes(1);
    add_cluster(&mut page, root, &vertices, &strips);
    page.finish(first_triangle).unwrap()
}

/// One cluster with a pair of windows of strands and one that is no pair, and a coordinate that needs a float.
fn third_page(first_triangle: u64) -> BuiltPage {
    let mut vertices = row(6.0, 20);
    vertices[2].z = 1e-20;
    let windows: Vec<Vec<u8>> = [0..5, 10..14, 4..8].map(Iterator::collect).to_vec();
    let radii: Vec<Vec<u8>> =
        windows.iter().map(|refs| refs.iter().map(|vertex| 255 - 15 * vertex).collect()).collect();
    let parts: Vec<StrandParts> =
        windows.iter().zip(&radii).map(|(refs, radii)| StrandParts { refs, radii, geometry: 0 }).collect();
    let strands = StoredStrands::of(&vertices, &parts);
    let mut page = PageBuilder::new(RadiusCode::covering(0.25, 0.5), None);
    let root = page.reserve_nodes(1);
    let cluster = page.strands(&strands);
    let bounds = windows.iter().map(|refs| {
        let points = Aabb::of_points(refs.iter().map(|&r| vertices[usize::from(r)]));
        Aabb { min: points.min - 0.5, max: points.max + 0.5 }
    });
    page.set_node(root, bounds.collect(), Children::Strips { cluster, first: 0 });
    page.finish(first_triangle).unwrap()
}

/// A root over a node over the first page, over two instances of a tree over the second page, and over the third page.
fn top() -> (Vec<TopNode>, Vec<TopEntry>, Vec<Instance>) {
    let node = |bounds: &[Aabb], used: &[u32]| {
        let mut child = [TopNode::EMPTY; WIDTH];
        child[..used.len()].copy_from_slice(used);
        TopNode { boxes: ChildBoxes::around(bounds), child }
    };
    let first = row_bounds(0.0).union(row_bounds(2.0));
    let second = row_bounds(4.0);
    let mirrored = Aabb { min: -second.max, max: -second.min };
    let nodes = vec![
        node(
            &[first, second, mirrored, row_bounds(6.0)],
            &[TopNode::NODE | 1, TopNode::INSTANCE, TopNode::INSTANCE | 1, TopNode::ENTRY | 2],
        ),
        node(&[first], &[TopNode::ENTRY]),
        node(&[second], &[TopNode::ENTRY | 1]),
    ];
    let scaled = |s: f32| Instance {
        world_from_local: [[s, 0.0, 0.0, 0.0], [0.0, s, 0.0, 0.0], [0.0, 0.0, s, 0.0]],
        root: 2,
    };
    let entries =
        vec![TopEntry { page: 0, node: 0 }, TopEntry { page: 1, node: 0 }, TopEntry { page: 2, node: 0 }];
    (nodes, entries, vec![scaled(1.0), scaled(-1.0)])
}

/// `count` vertices in a zig-zag along x.
fn row(y: f32, count: usize) -> Vec<Vec3> {
    (0..count).map(|i| Vec3::new(i as f32 * 0.5, y + (i % 2) as f32, i as f32 * 0.125)).collect()
}

fn row_bounds(y: f32) -> Aabb {
    Aabb::of_points(row(y, 35))
}

#[derive(Clone)]
struct Strip {
    refs: Vec<u8>,
    turns: Vec<u8>,
    splits: Vec<PlaneSplit>,
    geometry: u32,
    bounds: Aabb,
}

impl Strip {
    /// A strip over some of `vertices`; every second window has a turn.
    fn over(vertices: &[Vec3], refs: Range<u8>, geometry: u32) -> Strip {
        let refs: Vec<u8> = refs.collect();
        let bounds_of = |refs: &[u8]| Aabb::of_points(refs.iter().map(|&r| vertices[usize::from(r)]));
        let starts = (0..refs.len() - 2).step_by(WINDOW_TRIANGLES);
        let windows: Vec<Aabb> =
            starts.map(|w| bounds_of(&refs[w..refs.len().min(w + WINDOW_TRIANGLES + 2)])).collect();
        let turns = (0..windows.len()).map(|w| [0b000100, 0][w % 2]).collect();
        let mut splits = Vec::new();
        split(&windows, &mut splits);
        let bounds = bounds_of(&refs);
        Strip { refs, turns, splits, geometry, bounds }
    }
}

/// Adds a cluster and makes node `number` that of its strips.
fn add_cluster<'a>(page: &mut PageBuilder<'a>, number: u16, vertices: &'a [Vec3], strips: &'a [Strip]) {
    let parts = strips.iter().map(|s| StripParts {
        refs: &s.refs,
        turns: &s.turns,
        splits: &s.splits,
        geometry: s.geometry,
    });
    let cluster = page.cluster(vertices, parts.collect());
    let bounds = strips.iter().map(|s| s.bounds).collect();
    page.set_node(number, bounds, Children::Strips { cluster, first: 0 });
}

/// The tree over `windows` in pre-order; all splits are along x, where the left half is the lower one.
fn split(windows: &[Aabb], splits: &mut Vec<PlaneSplit>) {
    if windows.len() > 1 {
        let (left, right) = windows.split_at(windows.len().div_ceil(2));
        let lower_max = left.iter().fold(f32::MIN, |x, w| x.max(w.max.x));
        let upper_min = right.iter().fold(f32::MAX, |x, w| x.min(w.min.x));
        splits.push(PlaneSplit { axis: 0, reversed: false, lower_max, upper_min });
        split(left, splits);
        split(right, splits);
    }
}

fn manifest() -> Manifest {
    let bounds = row_bounds(0.0).union(row_bounds(4.0));
    Manifest {
        generator: "sample".into(),
        primitives: 0,
        shown: 123,
        instances: 0,
        segments: 0,
        strips: 0,
        vertices: 20,
        clusters: 0,
        pages: 0,
        depth: 4,
        page_size: 65536,
        bounds_min: bounds.min.to_array(),
        bounds_max: bounds.max.to_array(),
        scene_offset: [1e6, 0.0, -0.5],
        position_error: 0.125,
        radius_error: 0.0625,
        id_bytes: 4,
        bytes: ByteCounts::default(),
        strand_bytes: ByteCounts::default(),
        dropped: Dropped { degenerate: 1, non_finite: 300, out_of_range: 70_000 },
        scene: scene(),
    }
}

fn scene() -> SceneDesc {
    let material = |name: &str, emission| Material { name: name.into(), emission, ..Material::default() };
    let light = |kind| Light { name: "sun".into(), intensity: [3.0, 2.0, 1.0], kind };
    let camera = |projection, aspect| Camera {
        name: "überblick".into(),
        position: [0.0, 1.0, 5e9],
        forward: [0.0, 0.0, -1.0],
        up: [0.0, 1.0, 0.0],
        projection,
        aspect,
    };
    let (position, direction) = ([1.0, 2.0, 3.0], [0.0, -1.0, 0.0]);
    let mut textured = material("gray", [0.0; 3]);
    textured.alpha_mode = AlphaMode::Mask(0.5);
    textured.textures.base_color = Some(0);
    SceneDesc {
        geometries: vec![
            Geometry { name: "floor".into(), material: 0, has_triangles: true },
            Geometry { name: String::new(), material: 1, has_triangles: true },
        ],
        materials: vec![textured, material("lamp", [1.0, 0.5, 0.25])],
        lights: vec![
            light(LightKind::Point { position }),
            light(LightKind::Spot { position, direction, inner_angle: 0.25, outer_angle: 0.5 }),
            light(LightKind::Directional { direction }),
        ],
        cameras: vec![
            camera(Projection::Perspective { vertical_fov: 0.75 }, Some(1.5)),
            camera(Projection::Orthographic { height: 2.0 }, None),
        ],
        sky: Some(Sky::Gradient { zenith: [0.0, 0.0, 1.0], horizon: [1.0; 3], ground: [0.25; 3] }),
        images: vec![Image { name: "wood".into(), width: 40, height: 3, is_srgb: true, first_tile: 0 }],
        textures: vec![Texture { wrap: [Wrap::Mirror, Wrap::Clamp], ..Texture::default() }],
    }
}
