//! MTL files that an OBJ file names otherwise, and what they state of highlights and emission.

use glam::Vec3;
use image::{ImageFormat, Rgb, RgbImage};
use lightpaths::scene::{LoadOptions, Scene};

use super::{SQUARE, close, load_files};

fn load(files: &[(&str, &str)]) -> Scene {
    let files: Vec<(&str, &[u8])> = files.iter().map(|(name, text)| (*name, text.as_bytes())).collect();
    let mut scene = load_files(&files, "m.obj", &LoadOptions::default()).unwrap();
    scene.warnings.retain(|warning| !warning.contains(" has no "));
    scene
}

#[test]
fn libraries_are_found_by_escaped_and_former_names() {
    let mtl = "newmtl a\nKd 0.1 0.2 0.3\n";
    for (line, file, is_noted) in [
        ("a\\ b.mtl", "a b.mtl", false),
        ("former.mtl", "m.mtl", true),
        ("former name.mtl", "m.mtl", true),
        ("former.mtl", "other.mtl", true),
    ] {
        let scene = load(&[("m.obj", &format!("mtllib {line}\nusemtl a\n{SQUARE}")), (file, mtl)]);
        let is_found = scene.materials[0].diffuse == Vec3::new(0.1, 0.2, 0.3);
        assert_eq!(is_found, file != "other.mtl", "{line}: {:?}", scene.warnings);
        let noted =
            if is_found { "files are found under another name" } else { "libraries that cannot be used" };
        let is_said = scene.warnings.iter().any(|warning| warning.contains(noted));
        assert_eq!(is_said, is_noted, "{line}: {:?}", scene.warnings);
    }
}

#[test]
fn images_of_highlights_count_by_their_mean() {
    let mut png = std::io::Cursor::new(Vec::new());
    let stripes = RgbImage::from_fn(2, 2, |x, _| Rgb([255 * x as u8, 255, 0]));
    stripes.write_to(&mut png, ImageFormat::Png).unwrap();
    let (obj, mtl) =
        (format!("mtllib m.mtl\nusemtl a\n{SQUARE}"), "newmtl a\nKd 0.1\nKs 0.4\nmap_Ks -bm 1 a.png\n");
    let files: [(&str, &[u8]); 3] =
        [("m.obj", obj.as_bytes()), ("m.mtl", mtl.as_bytes()), ("a.png", png.get_ref())];
    let scene = load_files(&files, "m.obj", &LoadOptions::default()).unwrap();
    assert!(close(scene.materials[0].specular, Vec3::new(0.2, 0.4, 0.0)), "{:?}", scene.materials);
    assert!(
        scene.warnings[0].ends_with("images of highlights count by their mean colour"),
        "{:?}",
        scene.warnings
    );
}

/// A material that no face has does not emit, so lights are chosen.
#[test]
fn unused_materials_that_emit_leave_the_lights_to_choose() {
    let mtl = "newmtl a\nKd 0.5\nnewmtl b\nKe 1 1 1\n";
    for (used, lights) in [("a", ["sun", "sky"].as_slice()), ("b", &["b"])] {
        let scene = load(&[("m.obj", &format!("mtllib m.mtl\nusemtl {used}\n{SQUARE}")), ("m.mtl", mtl)]);
        let names: Vec<&str> = scene.lights.iter().map(|light| light.name.as_str()).collect();
        assert_eq!((names, scene.warnings.len()), (lights.to_vec(), 0), "{:?}", scene.warnings);
    }
}
