//! The format of files: the reader detects all damage.

use super::tables::bless;
use lightpaths::cache_file::{CacheMiss, File, Key, VERSION, Writer, hash};
use std::fs;

const NUMBERS: [u32; 5] = [3, 1, 4, 1, 5];
const WORDS: [f64; 700] = [0.1; 700];

fn key() -> Key {
    Key::default().with("geometry", hash(b"a cube")).with("settings", hash(b"draft"))
}

fn writer() -> Writer<'static> {
    let mut writer = Writer::default();
    writer.add("numbers", &NUMBERS[..]);
    writer.add("nothing", Vec::<u16>::new());
    writer.add("words", &WORDS[..]);
    writer
}

fn file() -> Vec<u8> {
    writer().to_bytes(&key())
}

fn miss(bytes: &[u8]) -> Option<CacheMiss> {
    File::parse(bytes, &key()).err()
}

/// Bytes before the sections.
const HEAD: usize = 48 + 2 * 40 + 3 * 56;

#[test]
fn what_is_written_is_read() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.paths");
    writer().write(&path, &key()).unwrap();
    let bytes = File::bytes(&path).unwrap();
    assert_eq!(bytes, file());
    assert_eq!(bytes.len() as u64, writer().file_bytes(&key()));
    assert_eq!(bytes.len(), HEAD + 20 + 5600);
    let read = File::parse(&bytes, &key()).unwrap();
    assert_eq!(read.list::<u32>("numbers").unwrap(), NUMBERS);
    assert!(read.list::<u16>("nothing").unwrap().is_empty());
    assert_eq!(read.list::<f64>("words").unwrap(), WORDS);
    for refused in [
        read.list::<u64>("numbers").err(),
        read.list::<u16>("numbers").err(),
        read.list::<u32>("number").err(),
        read.one::<u32>("numbers").err(),
    ] {
        assert!(matches!(refused, Some(CacheMiss::Damaged(_))), "{refused:?}");
    }
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left behind");
    assert_eq!(File::bytes(&folder.path().join("b.paths")), Err(CacheMiss::Missing));
    assert!(matches!(File::bytes(folder.path()), Err(CacheMiss::Unreadable(_))));
}

#[test]
fn a_file_that_ends_early_or_late_is_refused() {
    let whole = file();
    // Every byte of the head and of the first sections, then every seventh.
    for end in (0..HEAD + 40).chain((HEAD + 40..whole.len()).step_by(7)).chain([whole.len() - 1]) {
        assert!(miss(&whole[..end]).is_some(), "cut at {end}");
        // The same with an adjusted length.
        if end >= HEAD {
            let mut cut = whole[..end].to_vec();
            cut[24..32].copy_from_slice(&(end as u64).to_le_bytes());
            bless(&mut cut);
            assert!(miss(&cut).is_some(), "cut at {end}, and said so");
        }
    }
    let mut longer = [&whole[..], b"x"].concat();
    assert!(miss(&longer).is_some());
    let length = longer.len() as u64;
    longer[24..32].copy_from_slice(&length.to_le_bytes());
    bless(&mut longer);
    assert!(miss(&longer).is_some());
}

#[test]
fn every_flipped_bit_is_noticed() {
    let whole = file();
    let mut state = 1_u64;
    let mut random = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    let head = (0..HEAD).flat_map(|place| (0..8).map(move |bit| (place, bit)));
    let mut flips: Vec<(usize, usize)> = head.collect();
    flips.extend((0..1000).map(|_| (random(whole.len()), random(8))));
    for (place, bit) in flips {
        let mut bytes = whole.clone();
        bytes[place] ^= 1 << bit;
        assert!(miss(&bytes).is_some(), "bit {bit} of byte {place}");
    }
    // A thousand random bytes.
    for _ in 0..1000 {
        let (place, value) = (random(whole.len()), random(256) as u8);
        let mut bytes = whole.clone();
        bytes[place] = value;
        assert_eq!(miss(&bytes).is_some(), value != whole[place], "{value} at byte {place}");
    }
}

#[test]
fn other_versions_and_byte_orders_are_told() {
    let with = |at: usize, bytes: [u8; 4]| {
        let mut file = file();
        file[at..at + 4].copy_from_slice(&bytes);
        bless(&mut file);
        miss(&file).unwrap().to_string()
    };
    assert!(with(0, *b"lppt").contains("does not hold light paths"));
    assert!(with(8, 0x0102_0304_u32.to_be_bytes()).contains("byte order"));
    for version in [0, VERSION + 1, u32::MAX] {
        let line = with(12, version.to_le_bytes());
        assert!(line.contains(&format!("form {version}")), "{line}");
    }
}

#[test]
fn sizes_that_lie_are_refused() {
    // Element bytes and count of each section; counts of tables.
    for section in 0..3 {
        let at = 48 + 2 * 40 + section * 56 + 24;
        let told = |at: usize, file: &[u8]| u64::from_le_bytes(file[at..at + 8].try_into().unwrap());
        for field in [at, at + 8] {
            let value = told(field, &file());
            for lie in [0, 1, value + 1, value.wrapping_sub(1), 2 * value, 1 << 32, 1 << 63, u64::MAX] {
                let mut bytes = file();
                bytes[field..field + 8].copy_from_slice(&lie.to_le_bytes());
                bless(&mut bytes);
                let product = |file: &[u8]| u128::from(told(at, file)) * u128::from(told(at + 8, file));
                if product(&bytes) != product(&file()) {
                    assert!(miss(&bytes).is_some(), "section {section}: {lie} instead of {value}");
                }
            }
        }
    }
    for at in [16, 20] {
        for lie in [0, 1, 4, 255, 256, 257, u32::MAX] {
            let mut bytes = file();
            bytes[at..at + 4].copy_from_slice(&lie.to_le_bytes());
            let told = miss(&bytes);
            assert!(told.is_some(), "{lie} entries");
        }
    }
    // Two sections with one name, and invalid names.
    for name in [*b"numbers\0", *b"numb\xffrs\0", *b"\0umbers\0", *b"num\0ers\0"] {
        let mut bytes = file();
        let at = 48 + 2 * 40 + 2 * 56;
        bytes[at..at + 8].copy_from_slice(&name);
        bless(&mut bytes);
        assert!(matches!(miss(&bytes), Some(CacheMiss::Damaged(_))), "{name:?}");
    }
}

#[test]
fn what_has_changed_is_told() {
    let bytes = file();
    let told = |key: Key| File::parse(&bytes, &key).unwrap_err().to_string();
    let one = Key::default().with("geometry", hash(b"a cube")).with("settings", hash(b"paper"));
    assert_eq!(told(one), "is out of date: settings has changed");
    let two = Key::default().with("geometry", hash(b"a ball")).with("settings", hash(b"paper"));
    assert_eq!(told(two), "is out of date: geometry, settings have changed");
    let more = key().with("lights", hash(b"on"));
    assert_eq!(told(more), "is out of date: what light paths depend on has changed");
}
