//! Packs in packs.

use super::reseal::parts;
use super::walk::{open_all, walk};
use super::{sample, sample_with, support};
use raystrips_pack::{GeometryBounds, Pack, PackError, ProxyKind};
use std::io::Cursor;

const BOXES: [GeometryBounds; 2] = [
    GeometryBounds { min: [0.0; 3], max: [1.0; 3] },
    GeometryBounds { min: [f32::INFINITY; 3], max: [f32::NEG_INFINITY; 3] },
];

fn with(bounds: &[GeometryBounds], proxies: &[(ProxyKind, &[u8])]) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sample.rsp");
    support::write_with(&path, |_| {}, bounds, proxies);
    std::fs::read(path).unwrap()
}

fn open(file: &[u8], kind: ProxyKind) -> Result<Option<Pack>, PackError> {
    let mut file = Cursor::new(file);
    Pack::open(&mut file)?.open_proxy(&mut file, kind)
}

#[test]
fn a_proxy_is_the_pack_that_was_put_in() {
    let fine = sample();
    let coarse = sample_with(|manifest| manifest.generator = "coarse".into());
    let file = with(&BOXES, &[(ProxyKind::Fine, &fine), (ProxyKind::Coarse, &coarse)]);
    let pack = open_all(&file).unwrap().pack;
    assert_eq!(pack.geometry_bounds, BOXES);
    for (kind, bytes) in [(ProxyKind::Fine, &fine), (ProxyKind::Coarse, &coarse)] {
        let (offset, length) = pack.proxy(kind).unwrap();
        let inside = &file[offset as usize..(offset + length) as usize];
        assert!(inside == bytes.as_slice(), "{kind:?}");
        assert_eq!(open(&file, kind).unwrap().unwrap().manifest, open_all(bytes).unwrap().pack.manifest);
        assert!(walk(&open_all(inside).unwrap()) > 0);
    }
    let without = with(&[], &[(ProxyKind::Coarse, &coarse)]);
    assert!(open(&without, ProxyKind::Fine).unwrap().is_none());
    assert!(open(&without, ProxyKind::Coarse).unwrap().is_some());
}

#[test]
fn what_is_wrong_in_a_proxy_is_told_when_it_is_opened() {
    #[track_caller]
    fn refused(proxy: &[u8], why: &str) {
        let file = with(&[], &[(ProxyKind::Fine, proxy)]);
        assert!(open_all(&file).is_ok(), "the pack around it is good");
        let error = open(&file, ProxyKind::Fine).map(|_| ()).expect_err("opens").to_string();
        assert!(error.contains("Fine proxy") && error.contains(why), "{error}");
    }
    refused(&sample()[..5000], "cut off");
    refused(b"v 0 0 0", "not a raystrips pack");
    refused(&with(&[], &[(ProxyKind::Coarse, &sample())]), "has proxies of its own");
    let other = sample_with(|manifest| {
        let geometry = manifest.scene.geometries[0].clone();
        manifest.scene.geometries.push(geometry);
    });
    refused(&other, "other geometries");
}

#[test]
fn boxes_are_checked() {
    let bad = GeometryBounds { min: [f32::NAN; 3], max: [1.0; 3] };
    for boxes in [vec![BOXES[0]], vec![BOXES[0], bad]] {
        let error = open_all(&with(&boxes, &[])).map(|_| ()).expect_err("opens").to_string();
        assert!(error.contains("boxes of geometries"), "{error}");
    }
}

#[test]
fn a_flipped_bit_of_a_proxy_is_found() {
    let fine = sample();
    let mut file = with(&[], &[(ProxyKind::Fine, &fine)]);
    let (offset, length) = open_all(&file).unwrap().pack.proxy(ProxyKind::Fine).unwrap();
    let place = offset as usize..(offset + length) as usize;
    for (name, range) in parts(&fine) {
        for i in range.step_by(7) {
            file[place.start + i] ^= 4;
            let opened = open(&file, ProxyKind::Fine);
            assert!(opened.is_err() || open_all(&file[place.clone()]).is_err(), "{name} at {i}");
            file[place.start + i] ^= 4;
        }
    }
}
