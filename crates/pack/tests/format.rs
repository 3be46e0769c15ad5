//! Holds the code against the tables of FORMAT.md, so that neither drifts from the other.
#![allow(clippy::unwrap_used, reason = "a test")]

mod tables;

use raystrips_geom::strip::{WINDOW_TRIANGLES, strip_is_reversed, strip_triangle};
use raystrips_pack::layout::*;
use raystrips_pack::manifest::MAX_MANIFEST_BYTES;
use raystrips_pack::strip_record::{SPLIT_BYTES, SplitNode, record_bytes};
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
        record!(PageEntry { offset, first_triangle, bytes, checksum, triangle_count, node_count }),
        record!(ChildBoxes { origin, exponent, cluster, lo, hi }),
        record!(WideNode { boxes, child }),
        record!(TopNode { boxes, child }),
        record!(TopEntry { page, node }),
        record!(PageHeader { node_count, cluster_count, triangle_count, first_triangle }),
        record!(ClusterHeader {
            offset,
            first_triangle,
            triangle_count,
            strip_bytes,
            last_vertex,
            last_run,
            reserved
        }),
        record!(GeometryRun { geometry, end }),
        record!(Emitter { corners, geometry }),
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
        "u32" | "f32" => 4,
        "u64" => 8,
        "ChildBoxes" => size_of::<ChildBoxes>(),
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
    let code: [(&str, u64); 17] = [
        ("FORMAT_VERSION", FORMAT_VERSION.into()),
        ("ALIGNMENT", ALIGNMENT),
        ("MAX_PAGES", MAX_PAGES),
        ("WIDTH", WIDTH as u64),
        ("MAX_DEPTH", MAX_DEPTH as u64),
        ("MAX_PAGE_NODES", MAX_PAGE_NODES as u64),
        ("MAX_PAGE_CLUSTERS", MAX_PAGE_CLUSTERS as u64),
        ("MAX_CLUSTER_VERTICES", MAX_CLUSTER_VERTICES as u64),
        ("MAX_STRIP_BYTES", MAX_STRIP_BYTES as u64),
        ("MAX_STRIP_TRIANGLES", MAX_STRIP_TRIANGLES as u64),
        ("WINDOW_TRIANGLES", WINDOW_TRIANGLES as u64),
        ("SPLIT_BYTES", SPLIT_BYTES as u64),
        ("MAX_MANIFEST_BYTES", MAX_MANIFEST_BYTES as u64),
        ("WideNode::EMPTY", WideNode::EMPTY.into()),
        ("WideNode::LEAF", WideNode::LEAF.into()),
        ("TopNode::EMPTY", TopNode::EMPTY.into()),
        ("TopNode::ENTRY", TopNode::ENTRY.into()),
    ];
    let number = |s: &str| match s.strip_prefix("0x") {
        Some(hex) => u64::from_str_radix(hex, 16).unwrap(),
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
    let code = [Directory, TopNodes, TopEntries, Emitters, TriangleIds, Manifest];
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
    for n in 1..=MAX_STRIP_TRIANGLES {
        let w = n.div_ceil(6);
        assert_eq!(record_bytes(n), 3 * (w - 1) + w + n + 3);
    }
    let split = SplitNode { axis: 2, reversed: true, lower_max: 7, upper_min: 9 };
    assert_eq!(split.to_bytes(), [0b110, 7, 9]);
    let bits: Vec<_> =
        rows(&doc, "### Splits", 0).into_iter().map(|row| [0, 1, 2].map(|i| plain(&row[i]))).collect();
    let expected = [
        ["0", "0-1", "axis"],
        ["0", "2", "reversed"],
        ["0", "3-7", ""],
        ["1", "0-7", "lower_max"],
        ["2", "0-7", "upper_min"],
    ];
    assert_eq!(bits, expected.map(|row| row.map(str::to_string)));
}

#[test]
fn checksum_is_as_described() {
    let value = crc32c::crc32c(b"123456789");
    assert!(document().contains(&format!("`123456789` is `{value:#010X}`").replace("0X", "0x")));
}
