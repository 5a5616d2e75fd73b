//! Colours of vertices: of OBJ files here, of glTF files in `gltf`, of PLY files in `scans`.

use glam::{DVec3, Vec3};
use image::{ImageFormat, Rgb, RgbImage};
use lightpaths::cpu::textures::{Textures, linear};
use lightpaths::scene::{LoadOptions, Scene};
use std::fmt::Write as _;

use super::textures::{encoded, load_with};
use super::{close, good_toml};

pub(super) fn textures(scene: &Scene) -> Textures<'_> {
    Textures { materials: &scene.materials, coordinates: &scene.texture_coordinates }
}

/// Largest difference between the colours of a triangle and linear interpolation.
pub(super) fn difference(scene: &Scene, triangle: usize, corners: [DVec3; 3]) -> f64 {
    let steps = 12;
    let weights = (0..=steps).flat_map(|i| (0..=steps - i).map(move |j| [i, j, steps - i - j]));
    let error = weights.map(|weights| {
        let weights = DVec3::from(weights.map(f64::from)) / f64::from(steps);
        let material = scene.triangles[triangle].material;
        let found = textures(scene).colour(material, triangle as u32, weights);
        let expected = weights.x * corners[0] + weights.y * corners[1] + weights.z * corners[2];
        (found - expected).abs().max_element()
    });
    error.fold(0.0, f64::max)
}

fn load(obj: &str, mtl: &str) -> Scene {
    let png = encoded(RgbImage::from_pixel(2, 2, Rgb([188; 3])), ImageFormat::Png);
    load_with(&good_toml(), obj, mtl, &[("a.png", &png)], &LoadOptions::default()).unwrap()
}

/// A strip of triangles, each of whose vertices has sRGB codes.
fn strip(codes: &[[u8; 3]], head: &str) -> String {
    let mut obj = head.to_owned();
    for (index, [r, g, b]) in codes.iter().enumerate() {
        let [r, g, b] = [r, g, b].map(|&code| f32::from(code) / 255.0);
        let _ = writeln!(obj, "v {} {} 0 {r} {g} {b}", index, index % 2);
    }
    for index in 1..codes.len() - 1 {
        let _ = writeln!(obj, "f {} {} {}", index, index + 1, index + 2);
    }
    obj
}

fn decoded(codes: [u8; 3]) -> DVec3 {
    DVec3::from(codes.map(linear))
}

#[test]
fn colours_are_linear_between_vertices() {
    // A scan has similar colours beside each other; the last triangles are the worst case.
    let similar = [[90, 80, 70], [95, 84, 60], [99, 70, 66], [120, 80, 90], [110, 111, 112]];
    let opposite = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255], [0, 0, 0]];
    for (codes, most) in [(similar, 2e-3), (opposite, 0.04)] {
        let scene = load(&strip(&codes, ""), "");
        assert_eq!(scene.warnings.len(), 1, "{:?}", scene.warnings);
        assert!(scene.materials[0].diffuse.min_element() >= 0.989, "no grey under the colours");
        for triangle in 0..3 {
            let corners = [0, 1, 2].map(|corner| decoded(codes[triangle + corner]));
            let error = difference(&scene, triangle, corners);
            assert!(error < most, "triangle {triangle}: {error}");
        }
    }
}

/// Many triangles have smaller blocks, and equal ones share theirs.
#[test]
fn an_atlas_grows_with_distinct_triangles() {
    let colour = |index: u32| [index as u8, (index >> 8) as u8, 77 + (index >> 16) as u8];
    for (count, most) in [(400_u32, 400 * 64 + 2000), (70_000, 70_000 * 16 + 9000)] {
        let codes: Vec<_> = (0..count + 2).map(colour).collect();
        let scene = load(&strip(&codes, ""), "");
        let texels = scene.materials[0].texture.as_ref().unwrap().image.codes.len();
        assert!(texels < most, "{texels} for {count}");
        for triangle in (0..count as usize).step_by(997) {
            let corners = [0, 1, 2].map(|corner| decoded(codes[triangle + corner]));
            assert!(difference(&scene, triangle, corners) < 0.26);
        }
    }
    let stripes: Vec<_> = (0..5002).map(|index| [50 * (index % 2) as u8, 60, 70]).collect();
    let scene = load(&strip(&stripes, ""), "");
    assert!(scene.materials[0].texture.as_ref().unwrap().image.codes.len() <= 4 * 64);
}

/// One colour of a material needs no image.
#[test]
fn constant_colours_multiply_the_material() {
    let half = [188; 3];
    let mtl = "newmtl wall\nKd 0.5 0.4 0.3\n";
    let head = "mtllib m.mtl\nusemtl wall\n";
    let scene = load(&strip(&[half; 4], head), mtl);
    assert!(scene.materials[0].texture.is_none() && scene.texture_coordinates.is_empty());
    let expected = Vec3::new(0.5, 0.4, 0.3) * linear(188) as f32;
    assert!(close(scene.materials[0].diffuse, expected), "{:?}", scene.materials[0]);
    // White is no colour: the scene is the one without.
    let white = load(&strip(&[[255; 3]; 4], ""), "");
    let plain = load(&strip(&[[255; 3]; 4], "").replace(" 1 1 1\n", "\n"), "");
    assert_eq!((white.materials, white.triangles), (plain.materials, plain.triangles));
}

#[test]
fn colours_beside_an_image_count_by_their_mean() {
    let mtl = "newmtl wall\nmap_Kd a.png\n";
    let obj = strip(&[[0; 3], [255; 3], [255; 3]], "mtllib m.mtl\nusemtl wall\n");
    let scene = load(&obj, mtl);
    assert_eq!(scene.materials[0].texture.as_ref().unwrap().image.size, [2, 2]);
    assert!(close(scene.materials[0].diffuse, Vec3::splat(2.0 / 3.0)), "{:?}", scene.materials[0]);
    assert!(
        scene.warnings.iter().any(|said| said.starts_with("material \"wall\" has vertex colours beside")),
        "{:?}",
        scene.warnings
    );
}

/// Codes up to 255, colours of some vertices, and the comments of ZBrush.
#[test]
fn other_ways_to_write_colours_are_read() {
    let expected = [[255, 0, 0], [0, 128, 0], [0, 0, 64]].map(decoded);
    let codes = "v 0 0 0 255 0 0\nv 1 0 0 0 128 0 # note\nv 0 1 0 0 0 64 1\nf 1 2 3\n";
    let hidden = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n#MRGB ffff0000ff008000\n#MRGB ff000040\n";
    for obj in [codes, hidden] {
        let scene = load(obj, "");
        assert!(difference(&scene, 0, expected) < 0.03, "{obj}");
    }
    let some = "v 0 0 0 0 0 1\nv 1 0 0 nan 0 0\nv 0 1 0 0.5\nf 1 2 3\n";
    let scene = load(some, "");
    assert!(difference(&scene, 0, [DVec3::Z, DVec3::ONE, DVec3::ONE]) < 0.03);
    assert!(scene.warnings[0].contains("m.obj:2: colours of vertices that are no numbers"));
}

/// A diffuse albedo of the scene file replaces the colours, a tint multiplies them.
#[test]
fn the_scene_file_overrides_colours() {
    let obj = strip(&[[10, 90, 200], [200, 80, 30], [70, 70, 70]], "usemtl wall\n");
    let with = |change: &str| {
        let toml = format!("{}[[material]]\nname = \"wall\"\n{change}\n", good_toml());
        load_with(&toml, &obj, "", &[], &LoadOptions::default()).unwrap().materials.remove(0)
    };
    let plain = with("diffuse = [0.1, 0.2, 0.3]");
    assert!(plain.texture.is_none() && close(plain.diffuse, Vec3::new(0.1, 0.2, 0.3)));
    let tinted = with("tint = [0.1, 0.2, 0.3]");
    assert!(tinted.texture.is_some() && close(tinted.diffuse, Vec3::new(0.1, 0.2, 0.3)));
}
