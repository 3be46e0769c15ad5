//! Bytes are distrusted: whatever is in a file, it opens and can be walked, or there is a clean error.
#![allow(clippy::unwrap_used, reason = "a test")]

mod claims;
mod pages;
mod proxies;
mod reseal;
#[path = "../support/mod.rs"]
mod support;
mod walk;

use raystrips_pack::layout::FORMAT_VERSION;
use raystrips_pack::{Manifest, Pack, PackError};
use reseal::{parts, reseal};
use std::io::Cursor;
use walk::{open_all, walk};

fn sample() -> Vec<u8> {
    sample_with(|_| {})
}

fn sample_with(alter: impl FnOnce(&mut Manifest)) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("sample.rsp");
    support::write_sample(&path, alter);
    std::fs::read(path).unwrap()
}

fn error_of(file: &[u8]) -> PackError {
    open_all(file).map(|_| ()).expect_err("opens")
}

/// Numbers that look random and are always the same.
fn random(state: &mut u64) -> u8 {
    *state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*state >> 56) as u8
}

#[test]
fn the_sample_is_sound() {
    let file = sample();
    let opened = open_all(&file).unwrap();
    assert_eq!(walk(&opened), opened.pack.manifest.primitives);
    let most_windows: Vec<u8> = opened.pages().iter().map(|page| page.header().max_windows).collect();
    assert_eq!(most_windows, [5, 1, 0]);
    assert!([1, 2].iter().all(|&page| opened.pages()[page].cluster(0).vertex_code().is_float(2)));
    let before = file.clone();
    let mut resealed = file;
    reseal(&mut resealed);
    assert!(before == resealed, "checksums are where the tests think");
}

#[test]
fn every_prefix_is_refused() {
    let file = sample();
    for length in 1..file.len() {
        let error = Pack::open(&mut Cursor::new(&file[..length])).map(|_| ()).expect_err("opens");
        assert!(matches!(error, PackError::Corrupt(_)), "{length} bytes: {error}");
    }
}

#[test]
fn more_bytes_are_refused() {
    for extra in [0, b'\n', 0xFF] {
        let mut file = sample();
        file.push(extra);
        assert!(matches!(error_of(&file), PackError::Corrupt(_)));
    }
}

#[test]
fn other_files_have_their_own_errors() {
    assert!(matches!(error_of(b""), PackError::NotAPack));
    assert!(matches!(error_of(b"v 0 0 0"), PackError::NotAPack));
    assert!(matches!(error_of(&[7; 9000]), PackError::NotAPack));
    let mut newer = sample();
    newer[8] += 1;
    let PackError::Version { expected, got } = error_of(&newer) else { panic!("other error") };
    assert_eq!((expected, got), (FORMAT_VERSION, FORMAT_VERSION + 1));
    // What a transfer as text does to line ends.
    let text: Vec<u8> = sample().into_iter().filter(|&b| b != b'\r').collect();
    assert!(matches!(error_of(&text), PackError::NotAPack));
}

#[test]
fn a_flipped_bit_is_found_unless_it_is_padding() {
    let mut file = sample();
    let parts = parts(&file);
    let (mut state, mut found) = (1, 0);
    for i in 0..file.len() {
        let part = parts.iter().find(|(_, range)| range.contains(&i));
        let bit = 1 << (random(&mut state) % 8);
        file[i] ^= bit;
        match (part, open_all(&file)) {
            (None, opened) => assert!(opened.is_ok(), "padding at {i} is read"),
            (Some((name, _)), opened) => {
                assert!(opened.is_err(), "{name}: flip of {bit} at {i} is not found");
                found += 1;
            }
        }
        file[i] ^= bit;
    }
    assert_eq!(found, parts.iter().map(|(_, range)| range.len()).sum::<usize>());
}

/// Any byte at any place, with checksums that are right.
#[test]
fn hostile_bytes_do_no_harm() {
    let file = sample();
    let (mut state, mut opened, mut refused) = (2, 0, 0);
    for (name, range) in parts(&file) {
        for i in range {
            let others = [random(&mut state), random(&mut state), file[i] ^ 1, file[i] ^ 0x80, 0, 0xFF];
            for value in others {
                let mut file = file.clone();
                file[i] = value;
                reseal(&mut file);
                match open_all(&file) {
                    Ok(opened_pack) => {
                        walk(&opened_pack);
                        opened += 1;
                    }
                    Err(error) => {
                        let line = error.to_string();
                        assert!(!line.contains('\n') && line.len() < 300, "{name}, byte {i}: {line}");
                        refused += 1;
                    }
                }
            }
        }
    }
    // Positions, planes and names can be anything; structure cannot.
    assert!(opened > 1000 && refused > 1000, "{opened} opened, {refused} refused");
}

/// Several bytes at once, near each other, so that fields change together.
#[test]
fn hostile_records_do_no_harm() {
    let file = sample();
    let mut state = 3;
    for (_, range) in parts(&file) {
        for _ in 0..500 {
            let mut file = file.clone();
            let at = range.start + usize::from(random(&mut state)) * range.len() / 256;
            let length = 1 + usize::from(random(&mut state) % 16);
            file[at..range.end.min(at + length)].fill_with(|| [0, 1, 255, random(&mut state)][at % 4]);
            reseal(&mut file);
            if let Ok(opened) = open_all(&file) {
                walk(&opened);
            }
        }
    }
}
