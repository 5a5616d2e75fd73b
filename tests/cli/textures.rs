//! Materials with images, and with lobes.

use super::{CUBE, CUBE_SCENE, SMALL, folder_with, lightpaths, render_cube, stderr, stdout};
use crate::common::channels;
use image::{Rgb, RgbImage};
use std::fs;
use tempfile::TempDir;

/// A closed room. Its far wall shows an image of four texels; the other walls are grey.
const ROOM: &str = "mtllib room.mtl\nv -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv -1 2 -1\nv 1 2 -1\nv 1 2 1\nv -1 2 1\n\
vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl grey\nf 4 3 2 1\nf 5 6 7 8\nf 3 4 8 7\nf 4 1 5 8\nf 2 3 7 6\n\
usemtl image\nf 1/1 2/2 6/3 5/4\n";
const MTL: &str =
    "newmtl grey\nKd 0.5 0.5 0.5\nnewmtl image\nKd 0.5 1 1\nmap_Kd -clamp on pictures/four.png\n";
/// Texels, row by row from the top.
const CODES: [[u8; 3]; 4] = [[252, 0, 0], [0, 252, 0], [0, 0, 252], [128, 64, 252]];

fn room() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("room.obj"), ROOM).unwrap();
    fs::write(path("room.mtl"), MTL).unwrap();
    fs::write(path("room.toml"), CUBE_SCENE.replace("cube.obj", "room.obj")).unwrap();
    fs::create_dir(path("pictures")).unwrap();
    let image = RgbImage::from_fn(2, 2, |x, y| Rgb(CODES[(2 * y + x) as usize]));
    image.save(path("pictures/four.png")).unwrap();
    folder
}

#[test]
fn every_method_shows_the_image_where_it_lies() {
    let folder = room();
    let names = ["lightpaths", "path", "photon", "direct"];
    let mut energies = Vec::new();
    for method in names {
        let arguments = ["render", "room.toml", "--method", method, "-o", "a.exr", "--aov", "albedo", "-q"];
        let mut arguments = [&arguments[..], &SMALL, &["--set", "quality.entry_points=100000"]].concat();
        if ["path", "photon"].contains(&method) {
            arguments.extend(["--spp", "64"]);
        }
        let output = lightpaths(&folder, &arguments).output().unwrap();
        assert!(output.status.success(), "{method}: {}", stderr(&output));
        let channels = channels(&folder.path().join("a.exr"));
        let albedo =
            |x: usize, y: usize| ["R", "G", "B"].map(|c| channels[&format!("albedo.{c}")][32 * y + x]);
        // A pixel of the far wall spans 1/11 of the image. Each corner of the image has one
        // colour, times Kd.
        let (half, full) = (0.215_86, 0.973_45);
        for (x, y, expected) in [
            (3, 3, [0.5 * full, 0.0, 0.0]),
            (28, 3, [0.0, full, 0.0]),
            (3, 28, [0.0, 0.0, full]),
            (28, 28, [0.5 * half, 0.051_27, full]),
        ] {
            let found = albedo(x, y);
            let apart = found.iter().zip(expected).map(|(a, b): (&f32, f32)| (a - b).abs());
            assert!(apart.fold(0.0, f32::max) < 2e-3, "{method}: {found:?} at {x}, {y}");
        }
        let sum: f64 = ["R", "G", "B"].iter().flat_map(|c| &channels[*c]).map(|&v| f64::from(v)).sum();
        energies.push(sum);
    }
    let ratios: Vec<f64> = energies.iter().map(|energy| energy / energies[1]).collect();
    println!("{names:?}: {ratios:?}");
    assert!((ratios[0] - 1.0).abs() < 0.02 && (ratios[2] - 1.0).abs() < 0.02, "{ratios:?}");
    assert!(ratios[3] < 0.9, "direct light alone");
}

/// The picture is rendered without the image. Both `render` and `info` name it.
#[test]
fn a_missing_image_is_left_out_and_named() {
    let folder = room();
    fs::remove_file(folder.path().join("pictures/four.png")).unwrap();
    let render = ["render", "room.toml", "--method", "path", "--spp", "1", "--size", "16x16", "-o", "a.png"];
    let output = lightpaths(&folder, &render).output().unwrap();
    assert!(output.status.success() && folder.path().join("a.png").exists(), "{}", stderr(&output));
    let output_of_info = lightpaths(&folder, &["info", "room.toml"]).output().unwrap();
    for text in [stderr(&output), stdout(&output_of_info)] {
        let warnings: Vec<&str> = text.lines().filter(|line| line.contains("room.mtl:5: ")).collect();
        let [warning] = warnings[..] else { panic!("{text}") };
        assert!(warning.contains("\"pictures/four.png\" does not exist"), "{warning}");
    }
    // `info` lists images.
    let folder = room();
    let output = lightpaths(&folder, &["info", "room.toml"]).output().unwrap();
    assert!(stdout(&output).contains("image (2×2)"), "{}", stdout(&output));
}

#[test]
fn lobes_too_sharp_for_the_directions_are_named() {
    // The number of direction bins follows the exponent of materials that are not editable,
    // up to 4096.
    for (exponent, is_too_sharp) in [(500, false), (5000, true)] {
        let material = format!(
            "[[material]]\nname = \"default\"\ndiffuse = [0.2, 0.2, 0.2]\nspecular = [0.5, 0.5, 0.5]\nexponent = {exponent}.0\n"
        );
        let scene = format!("{CUBE_SCENE}{material}");
        let cube = folder_with(&[("cube.obj", CUBE), ("cube.toml", &scene)]);
        let folder = TempDir::new().unwrap();
        let output = render_cube(&folder, &cube, &["-o", "a.png"]).output().unwrap();
        assert!(output.status.success(), "{}", stderr(&output));
        let warning = "resolve exponents up to 1420, and it has 5000; raise quality.directions to 14641";
        assert_eq!(stderr(&output).contains(warning), is_too_sharp, "{}", stderr(&output));
    }
}
