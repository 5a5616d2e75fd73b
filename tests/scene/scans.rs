//! PLY and STL files, as text and binary, and damaged ones.

use glam::{DVec3, Vec3};
use lightpaths::Result;
use lightpaths::cpu::textures::linear;
use lightpaths::scene::{LoadOptions, Scene};

use super::refused::message;
use super::vertex_colours::difference;
use super::{CAMERA, LIGHT, close, load_files};

const CORNERS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, -1.0], [0.0, 0.0, -1.0]];
const CODES: [[u8; 3]; 4] = [[90, 80, 70], [100, 80, 60], [99, 70, 66], [120, 80, 90]];

fn load(name: &str, bytes: &[u8]) -> Result<Scene> {
    let toml = format!("[[model]]\nfile = {name:?}\n{CAMERA}{LIGHT}");
    let mut scene =
        load_files(&[("s.toml", toml.as_bytes()), (name, bytes)], "s.toml", &LoadOptions::default())?;
    let is_folder = |word: &str| word.starts_with('/');
    let strip = |said: &String| {
        said.rsplit_once(name)
            .filter(|(folder, _)| is_folder(folder))
            .map(|(_, rest)| format!("{name}{rest}"))
    };
    scene.warnings.iter_mut().for_each(|said| *said = strip(said).unwrap_or_else(|| said.clone()));
    Ok(scene)
}

/// A square of one polygon: vertices with colours, and perhaps normals.
fn ply(format: &str, has_normals: bool) -> Vec<u8> {
    let normals = if has_normals { "property float nx\nproperty float ny\nproperty float nz\n" } else { "" };
    let mut bytes = format!(
        "ply\nformat {format} 1.0\ncomment made by hand\nelement vertex 4\nproperty float x\nproperty float y\n\
property double z\n{normals}property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 1\n\
property list uchar int vertex_indices\nelement edge 1\nproperty int vertex1\nend_header\n"
    )
    .into_bytes();
    let is_text = format == "ascii";
    let mut put = |text: String, mut binary: Vec<u8>| {
        if format == "binary_big_endian" {
            binary.reverse();
        }
        bytes.extend(if is_text { (text + " ").into_bytes() } else { binary });
    };
    for (corner, codes) in CORNERS.iter().zip(CODES) {
        put(corner[0].to_string(), corner[0].to_le_bytes().to_vec());
        put(corner[1].to_string(), corner[1].to_le_bytes().to_vec());
        put(corner[2].to_string(), f64::from(corner[2]).to_le_bytes().to_vec());
        for axis in [0.0_f32, 1.0, 0.5].into_iter().filter(|_| has_normals) {
            put(axis.to_string(), axis.to_le_bytes().to_vec());
        }
        codes.iter().for_each(|code| put(code.to_string(), vec![*code]));
    }
    put("4".to_owned(), vec![4]);
    (0..4).for_each(|index: i32| put(index.to_string(), index.to_le_bytes().to_vec()));
    put("3".to_owned(), 3_i32.to_le_bytes().to_vec());
    if is_text { bytes.trim_ascii_end().to_vec() } else { bytes }
}

fn is_the_square(scene: &Scene) {
    assert_eq!((scene.triangles.len(), scene.materials.len()), (2, 1));
    let corner = |index: usize| (scene.triangles[0].positions[index].as_dvec3() + scene.origin).as_vec3();
    assert!((0..3).all(|index| close(corner(index), Vec3::from(CORNERS[index]))));
    assert!(scene.triangles.iter().all(|triangle| close(triangle.geometric_normal(), Vec3::Y)));
}

#[test]
fn ply_files_are_read_in_every_format() {
    for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
        for has_normals in [false, true] {
            let scene = load("a.ply", &ply(format, has_normals)).unwrap();
            is_the_square(&scene);
            let normal = if has_normals { Vec3::new(0.0, 1.0, 0.5).normalize() } else { Vec3::Y };
            assert!(scene.triangles.iter().flat_map(|triangle| triangle.normals).all(|n| close(n, normal)));
            let corners = [0, 1, 2].map(|index: usize| DVec3::from(CODES[index].map(linear)));
            let error = difference(&scene, 0, corners);
            assert!(error < 2e-3, "{format}: {error}");
            let said = "a.ply: elements of PLY files are passed over: \"edge\"";
            assert!(scene.warnings.iter().any(|warning| warning == said), "{:?}", scene.warnings);
        }
    }
    // Without colours the model is grey, and colours of floats are 0 to 1.
    let head =
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
    let faces = "element face 1\nproperty list uchar uint vertex_index\nend_header\n";
    let plain = load("a.ply", format!("{head}{faces}0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n").as_bytes()).unwrap();
    assert!(plain.materials[0].texture.is_none() && close(plain.materials[0].diffuse, Vec3::splat(0.7)));
    let float = "property float red\nproperty float green\nproperty float blue\n";
    let text = format!("{head}{float}{faces}0 0 0 1 0 .5\n1 0 0 1 0 .5\n0 1 0 1 0 .5\n3 0 1 2\n");
    let float = load("a.ply", text.as_bytes()).unwrap();
    assert!(close(float.materials[0].diffuse, 0.99 * Vec3::new(1.0, 0.0, linear(128) as f32)));
}

#[test]
fn damaged_ply_files_are_refused_in_one_line() {
    let good = String::from_utf8(ply("ascii", false)).unwrap();
    for (text, expected) in [
        (good.replace("ply\n", "plo\n"), "is no readable PLY: File must start with 'ply'"),
        (good.replace("4 0 1 2 3", "4 0 1 2 4"), "is damaged: a face names vertex 4, there are 4"),
        (good.replace("4 0 1 2 3", "4 0 1 2 -1"), "is no readable PLY: "),
        (good.replace("4 0 1 2 3 3", "4 0 1"), "is no readable PLY: "),
        (good.replace("4 0 1 2 3", "2 0 1"), "holds no face: clouds of points have no surface"),
        (good.replace("vertex 4", "vertex 4000000000"), "cannot hold 4000000000 elements \"vertex\""),
        (good.replace("property int vertex1\n", ""), "cannot hold 1 elements \"edge\""),
        (good.replace("end_header\n0 ", "end_header\nnan "), "has a vertex that is not finite: number 0"),
        (good.replace("property float x\n", "property float w\n"), "missing field `x`"),
    ] {
        let found = message(load("a.ply", text.as_bytes()));
        assert!(found.contains("a.ply: ") && found.contains(expected), "expected {expected}, found {found}");
    }
    let binary = ply("binary_little_endian", true);
    for cut in 1..binary.len() {
        assert!(load("a.ply", &binary[..binary.len() - cut]).is_err(), "{cut} bytes less");
    }
}

const STL: &str = "solid\n facet normal 0 1 0\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   VERTEX 1e0 0 -1\n  endloop\n\
 endfacet\nendsolid\nsolid two words\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 -1\nvertex 0 0 -1\nendloop\n\
endfacet\nendsolid two words\n";

fn binary_stl() -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes[..5].copy_from_slice(b"solid");
    bytes.extend(2_u32.to_le_bytes());
    for corners in [[0, 1, 2], [0, 2, 3]] {
        let numbers = [[0.0; 3]].into_iter().chain(corners.map(|corner: usize| CORNERS[corner]));
        bytes.extend(numbers.flatten().flat_map(f32::to_le_bytes));
        bytes.extend([0, 0]);
    }
    bytes
}

#[test]
fn stl_files_are_read_as_text_and_binary() {
    for bytes in [STL.as_bytes(), &STL.replace('\n', "\r\n").into_bytes(), &binary_stl()] {
        let scene = load("a.stl", bytes).unwrap();
        is_the_square(&scene);
        assert_eq!(scene.warnings, [""; 0]);
        assert!(close(scene.materials[0].diffuse, Vec3::splat(0.7)));
    }
    let mut coloured = binary_stl();
    *coloured.last_mut().unwrap() = 0x80;
    assert_eq!(load("a.stl", &coloured).unwrap().warnings, ["a.stl: colours of facets are passed over"]);
    coloured[0] = b'x';
    is_the_square(&load("a.stl", &[&coloured[..], b"more"].concat()).unwrap());
}

#[test]
fn damaged_stl_files_are_refused_in_one_line() {
    let binary = binary_stl();
    let mut infinite = binary.clone();
    infinite[96..100].copy_from_slice(&f32::INFINITY.to_le_bytes());
    for (bytes, expected) in [
        (
            STL.replace("1e0 0 -1", "1e0 0").into_bytes(),
            "a.stl:6: vertex: three finite numbers were expected",
        ),
        (STL.replace("1e0 0 -1", "1e0 0 inf").into_bytes(), "a.stl:6: vertex: three finite numbers"),
        (STL.replace("   VERTEX 1e0 0 -1\n", "").into_bytes(), "a.stl:6: endloop: a facet has three lines"),
        (b"solid\nendsolid\n".to_vec(), "a.stl: holds no facet"),
        (binary[..100].to_vec(), "a.stl: holds no facet"),
        (infinite, "a.stl: facet 0 has a corner that is not finite"),
    ] {
        let found = message(load("a.stl", &bytes));
        assert!(found.contains(expected), "expected {expected}, found {found}");
    }
}

/// A model alone gets a camera and lights.
#[test]
fn scans_are_scenes_alone() {
    for (name, bytes) in [("a.ply", ply("ascii", false)), ("A.STL", binary_stl())] {
        let scene = load_files(&[(name, &bytes)], name, &LoadOptions::default()).unwrap();
        assert!(scene.cameras.len() == 1 && !scene.lights.is_empty(), "{name}");
    }
}

/// Strips end with -1, and a repeated corner turns one.
#[test]
fn strips_of_ply_files_are_triangles() {
    let vertices = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n\
element tristrips 1\nproperty list int int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n0 2 0\n";
    for (strips, triangles) in [("9 0 1 2 3 -1 2 3 4 -1", 3), ("4 0 1 2 -1", 1), ("5 0 1 2 2 4", 1)] {
        let scene = load("m.ply", format!("{vertices}{strips}\n").as_bytes()).unwrap();
        assert_eq!(scene.triangles.len(), triangles, "{strips}");
        assert!(scene.triangles.iter().all(|t| close(t.geometric_normal(), Vec3::Z)), "{strips}");
        assert_eq!(scene.warnings, [""; 0]);
    }
    for strips in ["4 0 1 7 -1", "4 0 1 -2 -1"] {
        let found = message(load("m.ply", format!("{vertices}{strips}\n").as_bytes()));
        assert!(found.contains("is damaged: a face names vertex"), "{found}");
    }
}
