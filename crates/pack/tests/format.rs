//! Holds the code against the tables of FORMAT.md, so that neither drifts from the other.
#![allow(clippy::unwrap_used, reason = "a test")]

mod tables;

use glam::Vec3;
use raystrips_geom::strand::WINDOW_SEGMENTS;
use raystrips_geom::strip::{WINDOW_TRIANGLES, strip_is_reversed, strip_triangle};
use raystrips_geom::{Aabb, RadiusCode};
use raystrips_pack::layout::*;
use raystrips_pack::manifest::MAX_MANIFEST_BYTES;
use raystrips_pack::page::builder::Children;
use raystrips_pack::strand_code::PAIR_SLACK;
use raystrips_pack::strip_record::*;
use raystrips_pack::vertices::{VERTEX_REACH, VertexCode};
use raystrips_pack::{PageBuilder, STRAND_RECORD_BYTES, StoredStrands, StrandCode, StrandParts};
use std::mem::offset_of;
use tables::{document, plain, rows};

/// Name, offset and size of a field.
type Field = (&'static str, usize, usize);

fn field_size<T, F>(_: fn(&T) -> &F) -> usize {
    size_of::<F>()
}

/// Name, size and fields of a record of the code.
macro_rules! record {
    ($type:ident { $($field:ident),* }) => {
        (stringify!($type), size_of::<$type>(), vec![
            $((stringify!($field), offset_of!($type, $field), field_size(|r: &$type| &r.$field))),*
        ])
    };
}

fn code_records() -> Vec<(&'static str, usize, Vec<Field>)> {
    vec![
        record!(FileHeader { magic, version, reserved }),
        record!(Footer { sections_offset, section_count, sections_checksum, file_bytes, magic }),
        record!(SectionEntry { kind, checksum, offset, bytes }),
        record!(GeometryBounds { min, max }),
        record!(PageEntry { offset, first_triangle, bytes, checksum, triangle_count, node_count }),
        record!(ChildBoxes { origin, exponent, reserved, lo, hi }),
        record!(TopNode { boxes, child }),
        record!(TopEntry { page, node }),
        record!(Instance { world_from_local, root }),
        record!(WideNode { origin, reserved, exponent, reserved_too, first, cluster, count, lo, hi }),
        record!(PageHeader {
            last_node,
            cluster_count,
            triangle_count,
            first_triangle,
            grid_origin,
            grid_exponent,
            max_windows,
            strip_count,
            nodes_offset,
            radius_base,
            radius_shift,
            turn
        }),
        record!(ClusterHeader {
            offset,
            first_triangle,
            triangle_count,
            first_strip,
            strip_count,
            run_count,
            code
        }),
        record!(VertexCode { anchor, bits, stride, exponent, last }),
        record!(GeometryRun { geometry, end }),
        record!(StrandCode { step, bend, rest, radius_anchor, radius_bits, order, reach }),
        record!(Emitter { corners, geometry }),
        record!(BlockEntry { bytes, checksum }),
        record!(AttributeHeader { record_count, triangle_count, streams }),
    ]
}

/// Name and size of all records, from headings like `### Footer (32 bytes)`.
fn records(doc: &str) -> Vec<(String, usize)> {
    let record = |line: &str| {
        let (name, size) = line.strip_prefix("### ")?.strip_suffix(" bytes)")?.split_once(" (")?;
        Some((name.to_string(), size.parse().ok()?))
    };
    doc.lines().filter_map(record).collect()
}

/// Bytes of a type as FORMAT.md writes it: `u16 x 8`.
fn type_size(name: &str) -> usize {
    let mut words = name.split(" x ");
    let one = match words.next().unwrap() {
        "u8" | "i8" => 1,
        "u16" => 2,
        "u32" | "i32" | "f32" => 4,
        "u64" => 8,
        "ChildBoxes" => size_of::<ChildBoxes>(),
        "VertexCode" => size_of::<VertexCode>(),
        other => panic!("type {other}"),
    };
    one * words.map(|n| n.parse::<usize>().unwrap()).product::<usize>()
}

#[test]
fn records_are_as_described() {
    let doc = document();
    let code = code_records();
    let names: Vec<_> = code.iter().map(|(name, size, _)| (name.to_string(), *size)).collect();
    assert_eq!(records(&doc), names, "records and their sizes");
    for (name, size, fields) in code {
        let described = rows(&doc, &format!("### {name} "), 0);
        assert_eq!(described.len(), fields.len(), "fields of {name}");
        for (row, (field, offset, bytes)) in described.iter().zip(&fields) {
            assert_eq!(row[0], offset.to_string(), "offset of {name}.{field}");
            assert_eq!(row[1], bytes.to_string(), "bytes of {name}.{field}");
            assert_eq!(type_size(&row[2]), *bytes, "type of {name}.{field}");
            assert_eq!(plain(&row[3]), *field, "name of {name}.{field}");
        }
        assert_eq!(fields.iter().map(|f| f.2).sum::<usize>(), size, "{name} has no gaps");
    }
}

#[test]
fn constants_are_as_described() {
    let code: [(&str, i64); 30] = [
        ("FORMAT_VERSION", FORMAT_VERSION.into()),
        ("ALIGNMENT", ALIGNMENT as i64),
        ("MAX_PAGES", MAX_PAGES as i64),
        ("MAX_INSTANCES", MAX_INSTANCES as i64),
        ("WIDTH", WIDTH as i64),
        ("MAX_DEPTH", MAX_DEPTH as i64),
        ("MAX_PAGE_NODES", MAX_PAGE_NODES as i64),
        ("MAX_PAGE_CLUSTERS", MAX_PAGE_CLUSTERS as i64),
        ("MAX_PAGE_STRIPS", MAX_PAGE_STRIPS as i64),
        ("MAX_CLUSTER_VERTICES", MAX_CLUSTER_VERTICES as i64),
        ("MAX_STRIP_TRIANGLES", MAX_STRIP_TRIANGLES as i64),
        ("MAX_STRIP_WINDOWS", MAX_STRIP_WINDOWS as i64),
        ("WINDOW_TRIANGLES", WINDOW_TRIANGLES as i64),
        ("WINDOW_RECORD_BYTES", WINDOW_RECORD_BYTES as i64),
        ("WINDOW_SEGMENTS", WINDOW_SEGMENTS as i64),
        ("STRAND_RECORD_BYTES", STRAND_RECORD_BYTES as i64),
        ("PAIR_SLACK", PAIR_SLACK as i64),
        ("PLACE_BYTES", PLACE_BYTES as i64),
        ("SPLIT_BYTES", SPLIT_BYTES as i64),
        ("SPLIT_PLANE_STEP", SPLIT_PLANE_STEP.into()),
        ("VERTEX_REACH", VERTEX_REACH as i64),
        ("MAX_MANIFEST_BYTES", MAX_MANIFEST_BYTES as i64),
        ("WideNode::STRIPS", WideNode::STRIPS.into()),
        ("VertexCode::FLOAT_EXPONENT", VertexCode::FLOAT_EXPONENT.into()),
        ("TopNode::KIND", TopNode::KIND.into()),
        ("TopNode::EMPTY", TopNode::EMPTY.into()),
        ("TopNode::NODE", TopNode::NODE.into()),
        ("TopNode::ENTRY", TopNode::ENTRY.into()),
        ("TopNode::INSTANCE", TopNode::INSTANCE.into()),
        ("Instance::MAX_CONDITION", Instance::MAX_CONDITION as i64),
    ];
    let number = |s: &str| match s.strip_prefix("0x") {
        Some(hex) => i64::from_str_radix(hex, 16).unwrap(),
        None => s.parse().unwrap(),
    };
    let described = rows(&document(), "## Constants", 0);
    let described: Vec<_> = described.iter().map(|row| (plain(&row[0]), number(&row[1]))).collect();
    assert_eq!(described, code.map(|(name, value)| (name.to_string(), value)));
}

#[test]
fn magic_and_version_are_as_described() {
    let doc = document();
    let hex: Vec<String> = MAGIC.iter().map(|b| format!("{b:02X}")).collect();
    assert!(doc.contains(&format!("`{}`", hex.join(" "))));
    assert!(doc.contains(&format!("`{}`", MAGIC.escape_ascii())));
    assert!(doc.starts_with(&format!("# The pack: format version {FORMAT_VERSION}\n")));
    assert!(doc.contains(&format!("This is version {FORMAT_VERSION}.")));
}

#[test]
fn section_kinds_are_as_described() {
    use Section::*;
    let code = [
        Directory,
        TopNodes,
        TopEntries,
        Emitters,
        TriangleIds,
        Manifest,
        GeometryBounds,
        FineProxy,
        CoarseProxy,
        AttributeDirectory,
        Attributes,
        TileDirectory,
        Tiles,
        Instances,
    ];
    let described = rows(&document(), "### SectionEntry", 1);
    let described: Vec<_> = described.iter().map(|row| (row[0].clone(), plain(&row[1]))).collect();
    assert_eq!(described, code.map(|kind| ((kind as u32).to_string(), format!("{kind:?}"))));
}

#[test]
fn strips_are_as_described() {
    let doc = document();
    let turns = [0b0100];
    for row in rows(&doc, "### Turns", 0) {
        let i = row[0].parse().unwrap();
        let corners = strip_triangle(&turns, i);
        assert_eq!(row[1], if turns[0] >> i & 1 == 1 { "yes" } else { "no" });
        assert_eq!(row[2], corners[0].to_string());
        assert_eq!(row[3].parse::<u32>().unwrap() % 2 == 1, strip_is_reversed(&turns, i));
        assert_eq!(row[4], corners.map(|c| c.to_string()).join(" "));
    }
    let mut record = Vec::new();
    push_window(&mut record, turns[0], &[0, 1, 2, 3, 4, 5]);
    let hex: Vec<String> = record.iter().map(|b| format!("{b:02X}")).collect();
    assert!(doc.contains(&format!("`{}`", hex.join(" "))), "{hex:?}");
    for n in 1..=MAX_STRIP_TRIANGLES {
        let w = n.div_ceil(6);
        let bytes = if w == 1 { 9 } else { 4 + 4 * (w - 1) + w + n + 3 };
        assert_eq!(strips_bytes([n].into_iter()), bytes);
    }
}

#[test]
fn splits_are_as_described() {
    let split = SplitNode { axis: 2, reversed: true, lower_max: 7, upper_min: 9 };
    assert_eq!(split.to_bits(), 2 | 1 << 2 | 7 << 3 | 9 << 17);
    let bits: Vec<_> =
        rows(&document(), "### Splits", 0).into_iter().map(|row| [0, 1].map(|i| plain(&row[i]))).collect();
    let expected =
        [["0-1", "axis"], ["2", "reversed"], ["3-16", "lower_max"], ["17-30", "upper_min"], ["31", ""]];
    assert_eq!(bits, expected.map(|row| row.map(str::to_string)));
}

#[test]
fn vertices_are_as_described() {
    fn numbers(cell: &str) -> Vec3 {
        let numbers: Vec<f32> = cell.split(' ').map(|x| x.parse().unwrap()).collect();
        Vec3::from_slice(&numbers)
    }
    let table = rows(&document(), "### VertexCode", 1);
    let vertices: Vec<Vec3> = table.iter().map(|row| numbers(&row[0])).collect();
    let code = VertexCode::of(&vertices);
    let expected =
        VertexCode { anchor: [6, 1, 3], bits: [3, 0, 3], stride: 1, exponent: [-2, 1, 0], last: 2 };
    assert_eq!(code, expected);
    let mut bytes = Vec::new();
    code.encode(&vertices, &mut bytes);
    for (row, (byte, vertex)) in table.iter().zip(bytes.iter().zip(&vertices)) {
        let q = numbers(&row[1]);
        assert_eq!(*vertex, Vec3::from_array([0, 1, 2].map(|axis| code.value(axis, q[axis] as u32))));
        assert_eq!(row[2], format!("{byte:#04x}"));
    }
    assert_eq!((bytes.len(), code.byte_count()), (3, 4));
}

#[test]
fn strands_are_as_described() {
    let vertices = [1.0, 2.0, 4.0, 7.0, 11.0].map(|x| Vec3::new(x, 0.0, 0.0));
    let part = |refs| StrandParts { refs, radii: &[9; 3], geometry: 0 };
    let strands = StoredStrands::of(&vertices, &[part(&[0, 1, 2]), part(&[2, 3, 4])]);
    let mut page = PageBuilder::new(RadiusCode::default(), None);
    let root = page.reserve_nodes(1);
    let cluster = page.strands(&strands);
    page.set_node(root, vec![Aabb::of_points(vertices); 2], Children::Strips { cluster, first: 0 });
    let bytes = page.finish(0).unwrap().bytes;
    let header_at = size_of::<PageHeader>();
    let header: ClusterHeader =
        bytemuck::pod_read_unaligned(&bytes[header_at..][..size_of::<ClusterHeader>()]);
    let expected = VertexCode { anchor: [4, 0, 0], bits: [0; 3], stride: 1, exponent: [0; 3], last: 0 };
    assert_eq!(header.code, expected);
    let doc = document();
    let hex = |bytes: &[u8]| bytes.iter().map(|b| format!("{b:02X}")).collect::<Vec<_>>().join(" ");
    let table = &bytes[header_at + size_of::<ClusterHeader>()..][..4];
    assert!(doc.contains(&format!("Their table is `{}`", hex(table))), "{}", hex(table));
    let (code, pairs) = bytes[header.offset as usize..].split_at(size_of::<StrandCode>());
    let expected = StrandCode {
        step: [3, 0, 0, 0],
        bend: [2, 0, 0, 0],
        rest: [0; 4],
        radius_anchor: 9,
        radius_bits: 0,
        order: 3,
        reach: [2, 2],
    };
    assert_eq!(bytemuck::pod_read_unaligned::<StrandCode>(code), expected);
    assert!(doc.contains(&format!("The pair is the byte `{}`", hex(&pairs[..1]))), "{}", hex(&pairs[..1]));
}

#[test]
fn checksum_is_as_described() {
    let value = crc32c::crc32c(b"123456789");
    assert!(document().contains(&format!("`123456789` is `{value:#010X}`").replace("0X", "0x")));
}
