//! Alpha, depth beside the scene, and mattes of objects and materials.

use super::{folder_with, run};
use crate::common::channels;
use exr::meta::attribute::AttributeValue;
use std::collections::BTreeMap;
use tempfile::TempDir;

const SIZE: usize = 48;

/// A triangle before a square, both turned against the pixels, and a plate beside them.
const SCENE: &str = r#"
[[model]]
file = "signs.obj"
[[model]]
file = "plate.obj"
translate = [0.9, -0.4, 0.0]
[[model]]
file = "plate.obj"
translate = [0.9, 0.3, 0.0]
[camera]
position = [0.0, 0.0, 3.0]
target = [0.0, 0.0, 0.0]
fov_y = 50.0
size = [48, 48]
[[light]]
kind = "point"
position = [0.0, 1.0, 3.0]
intensity = [5.0, 5.0, 5.0]
[[light]]
kind = "area"
name = "panel"
corner = [-1.2, 0.9, 0.0]
edge_u = [0.4, 0.0, 0.0]
edge_v = [0.0, 0.2, 0.0]
radiance = [0.5, 0.5, 0.5]
visible = true
[quality]
entry_points = 500
cache_points = 200
gather_rays = 64
cells = 8
"#;

const SIGNS: &str = "mtllib signs.mtl\no near\nusemtl red\nv -0.7 -0.5 0.2\nv 0.1 -0.6 0.2\nv -0.2 0.5 0.2\nf 1 2 3\n\
    o far side\nusemtl blue\nv -0.9 -0.1 0\nv 0.2 -0.4 0\nv 0.5 0.4 0\nv -0.6 0.7 0\nf 4 5 6 7\n";
const MATERIALS: &str =
    "newmtl red\nKd 0.8 0.1 0.1\nnewmtl blue\nKd 0.1 0.1 0.8\nnewmtl été\nKd 0.5 0.5 0.5\n";
const PLATE: &str =
    "mtllib signs.mtl\nusemtl été\nv 0 0 0\nv 0.3 0.02 0\nv 0.25 0.4 0\nv 0.01 0.35 0\nf 1 2 3 4\n";

fn folder() -> TempDir {
    folder_with(&[("s.toml", SCENE), ("signs.obj", SIGNS), ("signs.mtl", MATERIALS), ("plate.obj", PLATE)])
}

fn render(folder: &TempDir, name: &str, arguments: &[&str]) -> BTreeMap<String, Vec<f32>> {
    let output = run(folder, &[&["render", "s.toml", "-o", name], arguments].concat());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    channels(&folder.path().join(name)).into_iter().collect()
}

/// MurmurHash3 of 32 bits with seed 0, from its published description.
fn murmur(text: &str) -> u32 {
    let scrambled = |word: u32| word.wrapping_mul(0xcc9e_2d51).rotate_left(15).wrapping_mul(0x1b87_3593);
    let word = |bytes: &[u8]| bytes.iter().rev().fold(0, |word, byte| word << 8 | u32::from(*byte));
    let (words, tail) = text.as_bytes().as_chunks::<4>();
    let step = |hash: u32, bytes: &[u8; 4]| {
        (hash ^ scrambled(word(bytes))).rotate_left(13).wrapping_mul(5).wrapping_add(0xe654_6b64)
    };
    let mut hash = words.iter().fold(0, step) ^ scrambled(word(tail)) ^ text.len() as u32;
    for (shift, factor) in [(16, 0x85eb_ca6b), (13, 0xc2b2_ae35)] {
        hash = (hash ^ hash >> shift).wrapping_mul(factor);
    }
    hash ^ hash >> 16
}

fn id(name: &str) -> u32 {
    let hash = murmur(name);
    if matches!(hash >> 23 & 255, 0 | 255) { hash ^ 1 << 23 } else { hash }
}

/// Names and ids of a set, by the header of a file.
fn manifest(folder: &TempDir, name: &str, set: &str) -> BTreeMap<String, u32> {
    let header = exr::meta::MetaData::read_from_file(folder.path().join(name), false).unwrap();
    let texts = &header.headers[0].own_attributes.other;
    let text = |what: &str| {
        let key = format!("cryptomatte/{}/{what}", &format!("{:08x}", murmur(set))[..7]);
        let Some(AttributeValue::Text(text)) = texts.get(key.as_bytes()) else { panic!("no {key}") };
        String::from_utf8(text.as_slice().to_vec()).unwrap()
    };
    assert_eq!([text("name"), text("hash")], [set, "MurmurHash3_32"]);
    assert_eq!(text("conversion"), "uint32_to_float32");
    let names: BTreeMap<String, String> = serde_json::from_str(&text("manifest")).unwrap();
    names.into_iter().map(|(name, id)| (name, u32::from_str_radix(&id, 16).unwrap())).collect()
}

/// Ids of a pixel with their fractions, rank by rank.
fn ranks(channels: &BTreeMap<String, Vec<f32>>, set: &str, pixel: usize) -> Vec<(u32, f32)> {
    let value = |layer: usize, channel: &str| channels[&format!("{set}{layer:02}.{channel}")][pixel];
    let layers = (0..3).flat_map(|layer| [["R", "G"], ["B", "A"]].map(|pair| (layer, pair)));
    layers.map(|(layer, [id, part])| (value(layer, id).to_bits(), value(layer, part))).collect()
}

#[test]
fn mattes_add_up_to_alpha_and_name_what_is_seen() {
    let folder = folder();
    let seen = render(&folder, "a.exr", &["--aov", "all"]);
    for (name, values) in &seen {
        assert!(values.iter().all(|value| value.is_finite()), "{name}");
    }
    let (alpha, depth) = (&seen["A"], &seen["depth.Z"]);
    let mut counts = [0; 3];
    for pixel in 0..SIZE * SIZE {
        counts[[alpha[pixel] == 0.0, (0.01..0.99).contains(&alpha[pixel]), alpha[pixel] == 1.0]
            .iter()
            .position(|is_so| *is_so)
            .unwrap()] += 1;
        for set in ["CryptoObject", "CryptoMaterial"] {
            let ranks = ranks(&seen, set, pixel);
            let sum: f32 = ranks.iter().map(|(_, fraction)| fraction).sum();
            assert!((sum - alpha[pixel]).abs() < 1e-3, "{set}, pixel {pixel}: {sum}, {}", alpha[pixel]);
            assert!(ranks.windows(2).all(|pair| pair[0].1 >= pair[1].1), "{ranks:?}");
        }
        if alpha[pixel] == 0.0 {
            assert_eq!((seen["R"][pixel], depth[pixel]), (0.0, 1e10));
        } else if alpha[pixel] == 1.0 {
            assert!((2.0..4.0).contains(&depth[pixel]), "{}", depth[pixel]);
        }
    }
    assert!(counts.iter().all(|&count| count > 50), "outside, edges, inside: {counts:?}");

    for (set, names) in [
        ("CryptoObject", &["far side", "near", "panel", "plate", "plate 2"][..]),
        ("CryptoMaterial", &["blue", "panel", "red", "été"]),
    ] {
        let manifest = manifest(&folder, "a.exr", set);
        assert_eq!(manifest.keys().map(String::as_str).collect::<Vec<_>>(), names);
        for (name, found) in manifest {
            assert_eq!(found, id(&name), "{name}");
        }
    }
    assert_eq!((murmur("hello"), murmur("")), (0x248b_fa47, 0), "published vectors");
}

/// The matte of an object is the mask that its colour gives, away from edges.
#[test]
fn a_matte_is_the_mask_of_its_object() {
    let folder = folder();
    let seen = render(&folder, "a.exr", &["--aov", "albedo,cryptomatte"]);
    let other = render(&folder, "b.exr", &["--method", "path", "--spp", "4", "--aov", "alpha,cryptomatte"]);
    let is_red = |x: usize, y: usize| seen["albedo.R"][y * SIZE + x] > 0.7;
    let matte = |channels: &BTreeMap<String, Vec<f32>>, x: usize, y: usize| -> f32 {
        let ranks = ranks(channels, "CryptoObject", y * SIZE + x);
        ranks.iter().filter(|(found, _)| *found == id("near")).map(|(_, fraction)| fraction).sum()
    };
    let (mut inside, mut outside) = (0, 0);
    for (x, y) in (1..SIZE - 1).flat_map(|x| (1..SIZE - 1).map(move |y| (x, y))) {
        let around = (0..9).filter(|place| is_red(x + place % 3 - 1, y + place / 3 - 1)).count();
        let found = [matte(&seen, x, y), matte(&other, x, y)];
        match around {
            9 => assert_eq!(found, [1.0; 2], "({x}, {y})"),
            0 => assert_eq!(found, [0.0; 2], "({x}, {y})"),
            _ => assert!((found[0] - found[1]).abs() < 0.1, "({x}, {y}): {found:?}"),
        }
        inside += usize::from(around == 9);
        outside += usize::from(around == 0);
    }
    assert!(inside > 50 && outside > 500, "{inside}, {outside}");
    assert!(other["A"].iter().any(|alpha| (0.2..0.8).contains(alpha)));
}
