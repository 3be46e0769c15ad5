//! Reads a manifest by FORMAT.md alone: an interpreter of its tables must find in the bytes what the code put
//! there, field by field and to the last byte.
#![allow(clippy::unwrap_used, reason = "a test")]

mod support;
mod tables;

use raystrips_geom::scene::Sky;
use raystrips_pack::Manifest;
use raystrips_pack::layout::{FOOTER_BYTES, Section, SectionEntry};
use tables::{document, plain, rows};

struct Reader<'a> {
    doc: &'a str,
    bytes: &'a [u8],
}

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> [u8; N] {
        let (taken, rest) = self.bytes.split_first_chunk().expect("bytes are left");
        self.bytes = rest;
        *taken
    }

    fn varint(&mut self) -> u64 {
        match self.take::<1>()[0] {
            251 => u16::from_le_bytes(self.take()).into(),
            252 => u32::from_le_bytes(self.take()).into(),
            253 => u64::from_le_bytes(self.take()),
            small => small.into(),
        }
    }

    /// A value of the type that is written `name`, in the words of `Debug`.
    fn value(&mut self, name: &str) -> String {
        match name {
            "u8" => self.take::<1>()[0].to_string(),
            "bool" => ["false", "true"][usize::from(self.take::<1>()[0])].into(),
            "f32" => format!("{:?}", f32::from_le_bytes(self.take())),
            "f64" => format!("{:?}", f64::from_le_bytes(self.take())),
            "u32" | "u64" => self.varint().to_string(),
            "string" => {
                let length = self.varint() as usize;
                let (text, rest) = self.bytes.split_at(length);
                self.bytes = rest;
                format!("{:?}", str::from_utf8(text).unwrap())
            }
            _ => self.composed(name),
        }
    }

    fn composed(&mut self, name: &str) -> String {
        if let Some((one, count)) = name.rsplit_once(" x ") {
            return self.array(one, count.parse().unwrap());
        }
        if let Some(one) = name.strip_prefix("list of ") {
            let count = self.varint();
            return self.array(one, count);
        }
        if let Some(one) = name.strip_prefix("option of ") {
            return match self.take() {
                [0] => "None".into(),
                [1] => format!("Some({})", self.value(one)),
                [other] => panic!("option {other}"),
            };
        }
        let table = rows(self.doc, &format!("#### {name}"), 0);
        if plain(&table[0][0]) == "0" {
            let chosen = &table[self.varint() as usize];
            return self.record(&plain(&chosen[1]), &variant_fields(&chosen[2]));
        }
        let fields: Vec<_> = table.iter().map(|row| (plain(&row[0]), row[1].clone())).collect();
        self.record(name, &fields)
    }

    fn array(&mut self, one: &str, count: u64) -> String {
        let values: Vec<String> = (0..count).map(|_| self.value(one)).collect();
        format!("[{}]", values.join(", "))
    }

    fn record(&mut self, name: &str, fields: &[(String, String)]) -> String {
        if let [(unnamed, of)] = fields
            && unnamed.is_empty()
        {
            return format!("{name}({})", self.value(of));
        }
        if fields.is_empty() {
            return name.into();
        }
        let fields: Vec<String> =
            fields.iter().map(|(name, of)| format!("{name}: {}", self.value(of))).collect();
        format!("{name} {{ {} }}", fields.join(", "))
    }
}

/// Name and type of each field of a variant; the name is empty where it has none.
fn variant_fields(cell: &str) -> Vec<(String, String)> {
    let field =
        |f: &str| f.split_once(": ").map_or((String::new(), f.into()), |(n, of)| (plain(n), of.into()));
    cell.split(", ").filter(|cell| !cell.is_empty()).map(field).collect()
}

/// The manifest of the sample pack, altered, and its bytes in the file.
fn sample(alter: impl FnOnce(&mut Manifest)) -> (Manifest, Vec<u8>) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sample.rsp");
    let (_, manifest) = support::write_sample(&path, alter);
    let file = std::fs::read(path).unwrap();
    let mut entries = file[..file.len() - FOOTER_BYTES].rchunks(size_of::<SectionEntry>());
    let entries = entries.by_ref().map(bytemuck::pod_read_unaligned::<SectionEntry>);
    let entry = entries.take(8).find(|entry| entry.kind == Section::Manifest as u32).unwrap();
    (manifest, file[entry.offset as usize..][..entry.bytes as usize].to_vec())
}

#[track_caller]
fn check(alter: impl FnOnce(&mut Manifest)) {
    let (manifest, bytes) = sample(alter);
    let doc = document();
    let mut reader = Reader { doc: &doc, bytes: &bytes };
    assert_eq!(reader.value("Manifest"), format!("{manifest:?}"));
    assert!(reader.bytes.is_empty(), "bytes left over");
}

#[test]
fn manifest_is_as_described() {
    check(|_| {});
}

#[test]
fn other_choices_are_as_described() {
    check(|manifest| {
        manifest.scene.sky = Some(Sky::Constant([0.5, 1.0, 1.5]));
        manifest.dropped.degenerate = u64::MAX;
        manifest.scene.materials[0].double_sided = true;
    });
    check(|manifest| manifest.scene.sky = None);
}
