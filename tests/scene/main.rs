//! Scene loading: results, changes and repairs; `refused` has the errors.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::collections::HashSet;
use std::path::Path;

use glam::{DVec3, Vec3};
use lightpaths::Result;
use lightpaths::scene::material::MAX_ALBEDO;
use lightpaths::scene::{LightKind, LoadOptions, Quality, Scene, shapes};
use refused::message;

#[path = "../../examples/box_model.rs"]
#[allow(dead_code, reason = "the example's main")]
mod box_model;
mod confined;
mod cutouts;
mod emission;
mod film;
mod fit;
mod gltf;
mod gltf_documents;
mod images;
mod keys;
mod lenient;
mod libraries;
mod limits;
mod luminaires;
mod metallic;
mod model_keys;
mod panes;
mod photometry;
mod places;
mod recording;
mod refused;
mod save;
mod scans;
mod textures;
mod vertex_colours;

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 0 -1\nv 0 0 -1\nf 1 2 3 4\n";
const HEAD: &str = "[[model]]\nfile = \"m.obj\"\n";
const CAMERA: &str = "[camera]\nposition = [0, 1, 3]\ntarget = [0, 0, 0]\n";
const LIGHT: &str =
    "[[light]]\nname = \"lamp\"\nkind = \"point\"\nposition = [0, 1, 0]\nintensity = [1, 1, 1]\n";

/// Loads `s.toml` from a fresh folder that holds these files.
fn load_files(files: &[(&str, &[u8])], spec: &str, options: &LoadOptions) -> Result<Scene> {
    let folder = tempfile::tempdir().unwrap();
    for (name, bytes) in files {
        std::fs::write(folder.path().join(name), bytes).unwrap();
    }
    Scene::load(folder.path().join(spec).to_str().unwrap(), options)
}

fn load(toml: &str, obj: &str) -> Result<Scene> {
    load_files(&[("s.toml", toml.as_bytes()), ("m.obj", obj.as_bytes())], "s.toml", &LoadOptions::default())
}

fn good_toml() -> String {
    format!("{HEAD}{CAMERA}{LIGHT}")
}

fn set(changes: &[&str]) -> LoadOptions {
    LoadOptions { set: changes.iter().map(|&change| change.to_owned()).collect(), ..Default::default() }
}

fn close(a: Vec3, b: Vec3) -> bool {
    (a - b).length() < 1e-5
}

#[test]
fn box_is_the_generators_output() {
    let committed =
        std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/box.obj")).unwrap();
    assert!(committed == box_model::obj(), "run: cargo run --example box_model > assets/box.obj");
}

#[test]
fn box_loads_by_name() {
    let scene = Scene::load("box", &LoadOptions::default()).unwrap();
    assert_eq!(scene.triangles.len(), 2914);
    assert_eq!(scene.warnings, Vec::<String>::new());
    assert_eq!((scene.name.as_str(), scene.cameras[0].size, scene.lights.len()), ("box", [512, 512], 1));
    assert_eq!(scene.quality, Quality::PAPER);
    let (low, high) = scene.bounds();
    let origin = scene.origin.as_vec3();
    assert!(
        close(low + origin, Vec3::new(-1.0, -0.001, -1.0)) && close(high + origin, Vec3::new(1.0, 2.0, 1.0))
    );
    // Camera and light move with the geometry.
    assert!(close(scene.cameras[0].position + origin, Vec3::new(0.0, 1.0, 3.95)));
    let LightKind::Point { position, intensity } = scene.lights[0].kind else { panic!("{:?}", scene.lights) };
    assert!(close(position + origin, Vec3::new(0.0, 1.75, 0.2)) && intensity == Vec3::splat(1.5));
    let albedo = |name: &str| scene.materials.iter().find(|m| m.name == name).unwrap().diffuse;
    assert_eq!(albedo("red"), Vec3::new(0.63, 0.065, 0.05));
    assert_eq!(albedo("teapot"), Vec3::new(0.55, 0.55, 0.62));
}

#[test]
fn teapot_is_welded_and_smooth() {
    let scene = Scene::load("box", &LoadOptions::default()).unwrap();
    let teapot: Vec<_> =
        scene.triangles.iter().filter(|t| scene.materials[t.material as usize].name == "teapot").collect();
    assert_eq!(teapot.len(), 2904);
    let bits = |p: Vec3| p.to_array().map(f32::to_bits);
    let mut edges = HashSet::new();
    for t in &teapot {
        assert!(
            t.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-5 && n.dot(t.geometric_normal()) > 0.2)
        );
        for (a, b) in [(0, 1), (1, 2), (2, 0)] {
            let edge = (bits(t.positions[a]), bits(t.positions[b]));
            assert!(edges.insert(edge), "two faces run along one edge in one direction");
        }
    }
    // Open edges: rim, lid and base with 48 each, the spout's mouth and foot with 18, the handle's
    // ends with 16.
    let open = edges.iter().filter(|(a, b)| !edges.contains(&(*b, *a))).count();
    assert_eq!(open, 3 * 48 + 2 * 18 + 2 * 16);
}

#[test]
fn all_keys_are_read() {
    let toml = r#"
[[model]]
file = "m.obj"
translate = [10, 0, 0]
rotate = [0, 90, 0]
scale = 2
[[camera]]
name = "a"
position = [10, 1, 3]
target = [10, 0, 0]
[[camera]]
name = "b"
position = [10, 3, 0]
target = [10, 0, 0]
up = [0, 0, -2]
fov_y = 60
size = [32, 16]
[[light]]
kind = "spot"
name = "s"
position = [10, 1, 0]
direction = [0, -3, 0]
angle = 30
penumbra = 0.5
intensity = [1, 2, 3]
[[light]]
kind = "area"
name = "a"
corner = [10, 1, 0]
edge_u = [1, 0, 0]
edge_v = [0, 0, 1]
radiance = [4, 5, 6]
[[light]]
kind = "directional"
name = "d"
direction = [0, -2, 0]
irradiance = [7, 8, 9]
[[material]]
name = "default"
diffuse = [0.5, 0.4, 0.3]
specular = [0.3, 0.2, 0.1]
exponent = 40
editable = true
[quality]
preset = "draft"
entry_points = 1000
gather_rays = 64
cells = 16
cache_points = 500
directions = 64
occlusion = false
seed = 7
"#;
    let scene = load(toml, SQUARE).unwrap();
    let (low, high) = scene.bounds();
    // After a turn by 90° about y, x becomes -z and -z becomes -x.
    let [low, high] = [low, high].map(|corner| corner + scene.origin.as_vec3());
    assert!(close(low, Vec3::new(8.0, 0.0, -2.0)) && close(high, Vec3::new(10.0, 0.0, 0.0)), "{low} {high}");
    assert!(scene.triangles.iter().all(|t| close(t.geometric_normal(), Vec3::Y)));
    let b = &scene.cameras[1];
    assert_eq!((b.name.as_str(), b.up, b.fov_y_degrees, b.size), ("b", Vec3::NEG_Z, 60.0, [32, 16]));
    let LightKind::Spot { direction, angle, penumbra, intensity, .. } = scene.lights[0].kind else {
        panic!()
    };
    assert_eq!((direction, penumbra, intensity), (Vec3::NEG_Y, 0.5, Vec3::new(1.0, 2.0, 3.0)));
    assert!((angle - 30.0_f32.to_radians()).abs() < 1e-6);
    let LightKind::Area { samples, edge_u, radiance, .. } = scene.lights[1].kind else { panic!() };
    assert_eq!((samples, edge_u, radiance), (10, Vec3::X, Vec3::new(4.0, 5.0, 6.0)));
    let LightKind::Directional { direction, irradiance } = scene.lights[2].kind else { panic!() };
    assert_eq!((direction, irradiance), (Vec3::NEG_Y, Vec3::new(7.0, 8.0, 9.0)));
    let material = &scene.materials[0];
    assert_eq!((material.exponent, material.editable), (40.0, true));
    assert_eq!((material.diffuse, material.specular), (Vec3::new(0.5, 0.4, 0.3), Vec3::new(0.3, 0.2, 0.1)));
    let q = &scene.quality;
    assert_eq!(
        [q.entry_points, q.cache_points, q.gather_rays, q.directions, q.cells, q.seed],
        [1000, 500, 64, 64, 16, 7]
    );
    assert!(!q.occlusion && Quality::DRAFT.occlusion);
    assert_eq!(scene.warnings, Vec::<String>::new());
    assert!(scene.summary().contains(&("light".into(), "s (spot)".into())));
}

#[test]
fn rotation_is_about_x_then_y_then_z() {
    // (0, 0, -1) → about x by 90°: (0, 1, 0) → about y: unchanged → about z by 90°: (-1, 0, 0).
    let toml = format!("{HEAD}rotate = [90, 45, 90]\n{CAMERA}{LIGHT}");
    let scene = load(&toml, "v 0 0 0\nv 0 0 -1\nv 0 0 -2\nv 0.1 0 -1\nf 1 3 4\nf 1 4 2\n").unwrap();
    let (low, _) = scene.bounds();
    assert!(((low + scene.origin.as_vec3()).x + 2.0).abs() < 1e-5);
}

#[test]
fn mirrored_models_keep_their_front() {
    let obj = format!("{}vn 0 3 1\nf 1//1 2//1 3//1 4//1\n", SQUARE.rsplit_once("f ").unwrap().0);
    let toml = format!("{HEAD}scale = [-1, 2, 1]\n{CAMERA}{LIGHT}");
    let scene = load(&toml, &obj).unwrap();
    assert_eq!(scene.warnings, Vec::<String>::new());
    for t in &scene.triangles {
        assert!(close(t.geometric_normal(), Vec3::Y));
        // Inverse transpose: y shrinks as the surface stretches.
        assert!(close(t.normals[0], Vec3::new(0.0, 1.5, 1.0).normalize()), "{}", t.normals[0]);
    }
}

#[test]
fn far_away_models_keep_their_shape() {
    let obj = "v 1000000.125 5 0\nv 1000001.125 5 0\nv 1000000.125 5 -1\nf 1 2 3\n";
    let scene = load(&good_toml(), obj).unwrap();
    assert!((scene.area_m2() - 0.5).abs() < 1e-6);
    let corner = scene.triangles[0].positions[0].as_dvec3() + scene.origin;
    assert!((corner - DVec3::new(1_000_000.125, 5.0, 0.0)).length() < 1e-6);
    let camera = scene.cameras[0].position.as_dvec3() + scene.origin;
    assert!((camera - DVec3::new(0.0, 1.0, 3.0)).length() < 0.1);
}

#[test]
fn models_are_repaired_and_say_so() {
    // A sliver, a repeated index, a repeated face (turned, then reversed); normals:
    // reversed, zero, NaN.
    let obj = format!(
        "{SQUARE}v 0.5 1e-12 0\nvn 0 -1 0\nvn 0 0 0\nvn nan 0 0\nvn 0 1 1\nv 5 0 0\nv 6 0 0\nv 6 0 -1\nv 5 0 -1\n\
         f 1 2 5\nf 1 1 2\nf 2 3 1\nf 3 2 1\nf 6//1 7//1 8//1\nf 6//2 8//3 9//4\n"
    );
    let scene = load(&good_toml(), &obj).unwrap();
    assert_eq!(scene.triangles.len(), 4);
    assert_eq!(
        scene.warnings,
        [
            "triangles repaired: 2 without area dropped, 2 that repeat another dropped, 1 with zero or non-finite \
          normals given their face's normal, 1 with normals against their front side turned"
        ]
    );
    assert!(scene.triangles.iter().all(|t| close(t.normals[0], Vec3::Y) && close(t.normals[1], Vec3::Y)));
    let tilted = Vec3::new(0.0, 1.0, 1.0).normalize();
    assert_eq!(scene.triangles.iter().filter(|t| close(t.normals[2], tilted)).count(), 1);
}

#[test]
fn materials_come_from_mtl_with_repairs() {
    let obj = format!("mtllib m.mtl\nusemtl mirror\n{SQUARE}v 2 2 2\nusemtl  lost one\nf 1 2 5\n");
    let mtl = "newmtl mirror\n\tKd 0.5 0.8 0.1\n  Ks 0.5 0.25 0.5\nNs 96\nmap_Ks a.png\nd 1 # junk\n";
    let toml = good_toml();
    let files: [(&str, &[u8]); 3] =
        [("s.toml", toml.as_bytes()), ("m.obj", obj.as_bytes()), ("m.mtl", mtl.as_bytes())];
    let scene = load_files(&files, "s.toml", &LoadOptions::default()).unwrap();
    let [mirror, lost] = &scene.materials[..] else { panic!("{:?}", scene.materials) };
    assert_eq!((mirror.exponent, lost.diffuse, lost.name.as_str()), (96.0, Vec3::splat(0.7), "lost one"));
    // The specular albedo is lowered, all channels alike.
    assert_eq!(mirror.diffuse, Vec3::new(0.5, 0.8, 0.1));
    let left = (MAX_ALBEDO - 0.8) / 0.25 * Vec3::new(0.5, 0.25, 0.5);
    assert!(close(mirror.specular, left), "{}", mirror.specular);
    assert_eq!(scene.triangles.iter().map(|t| t.material).collect::<Vec<_>>(), [0, 0, 1]);
    let [textures, missing, scaled] = &scene.warnings[..] else { panic!("{:?}", scene.warnings) };
    assert!(
        textures
            .contains("m.mtl:5: material \"mirror\": images of highlights that cannot be used are left out"),
        "{textures}"
    );
    assert!(missing.contains("m.obj:9: material \"lost one\" is defined nowhere"), "{missing}");
    assert!(
        scaled.contains("material \"mirror\" reflected more than it receives: its highlights are dimmed"),
        "{scaled}"
    );
    // An override defines a material that the model does not define.
    let scene = load_files(&files, "s.toml", &set(&["material.'lost one'.diffuse=[0.1,0.2,0.3]"])).unwrap();
    assert_eq!((scene.materials[1].diffuse, scene.warnings.len()), (Vec3::new(0.1, 0.2, 0.3), 2));
}

#[test]
fn a_fan_of_many_corners_loads() {
    const CORNERS: usize = 300_000;
    let mut obj = String::new();
    let mut face = String::from("f");
    for i in 0..CORNERS {
        let (sin, cos) = (i as f64 / CORNERS as f64 * std::f64::consts::TAU).sin_cos();
        obj += &format!("v {cos} 0 {sin}\n");
        face += &format!(" {}", i + 1);
    }
    let scene = load_files(&[("m.obj", (obj + &face).as_bytes())], "m.obj", &LoadOptions::default()).unwrap();
    // Slivers next to the fan's first corner have no area in f32; the disc hardly shrinks.
    assert!(scene.triangles.len() > CORNERS / 2 && scene.triangles.len() <= CORNERS - 2);
    assert!((scene.area_m2() - std::f64::consts::PI).abs() < 1e-3, "{}", scene.area_m2());
    // A tree over the slivers would take minutes; the camera is chosen by their bounds.
    assert!(scene.cameras[0].position.y > 0.5, "{}", scene.cameras[0].position);
}

#[test]
fn settings_change_the_scene() {
    let options = LoadOptions {
        set: [
            "quality.entry_points=1000",
            "camera.fov_y = 50",
            "light.lamp.intensity=[1,2,3]",
            "light.0.position=[0,1,0]",
            "material.teapot.diffuse=[0.1,0.2,0.3]",
            "material.teapot.editable=true",
            "model.0.translate=[5,0,0]",
        ]
        .map(str::to_owned)
        .to_vec(),
        preset: Some("draft".to_owned()),
        size: Some([64, 32]),
        camera: Some("camera".to_owned()),
        ..LoadOptions::default()
    };
    let scene = Scene::load("box", &options).unwrap();
    assert_eq!(scene.quality, Quality { entry_points: 1000, ..Quality::DRAFT });
    assert_eq!((scene.cameras[0].fov_y_degrees, scene.cameras[0].size), (50.0, [64, 32]));
    let LightKind::Point { position, intensity } = scene.lights[0].kind else { panic!() };
    assert_eq!(intensity, Vec3::new(1.0, 2.0, 3.0));
    assert!(close(position + scene.origin.as_vec3(), Vec3::Y) && (scene.origin.x - 5.0).abs() < 1e-6);
    let teapot = scene.materials.iter().find(|m| m.name == "teapot").unwrap();
    assert!(teapot.editable && teapot.diffuse == Vec3::new(0.1, 0.2, 0.3));
    let word = Scene::load("box", &set(&["quality.preset=high"])).unwrap();
    assert_eq!(word.quality, Quality::HIGH);
}

#[test]
fn settings_find_the_camera_they_mean() {
    let toml = format!(
        "{HEAD}{LIGHT}[[camera]]\nname = \"a\"\nposition = [0, 1, 3]\ntarget = [0, 0, 0]\n\
                        [[camera]]\nname = \"b\"\nposition = [0, 2, 3]\ntarget = [0, 0, 0]\n"
    );
    let files: [(&str, &[u8]); 2] = [("s.toml", toml.as_bytes()), ("m.obj", SQUARE.as_bytes())];
    let options =
        LoadOptions { camera: Some("b".to_owned()), ..set(&["camera.fov_y=50", "camera.a.fov_y=70"]) };
    let scene = load_files(&files, "s.toml", &options).unwrap();
    let cameras: Vec<_> = scene.cameras.iter().map(|c| (c.name.as_str(), c.fov_y_degrees)).collect();
    assert_eq!(cameras, [("b", 50.0), ("a", 70.0)]);
    for (options, expected) in [
        (LoadOptions { camera: Some("c".to_owned()), ..Default::default() }, "--camera: unknown camera `c`"),
        (
            set(&["camera.c.fov_y=1"]),
            "--set camera.c.fov_y=1: unknown camera `c`: did you mean `a`? possible: a, b",
        ),
    ] {
        let found = message(load_files(&files, "s.toml", &options));
        assert!(found.contains(expected), "expected {expected:?}, found {found:?}");
    }
}

#[test]
fn a_model_alone_gets_camera_and_light() {
    let box_obj = box_model::obj();
    let mtl = include_bytes!("../../assets/box.mtl");
    let files: [(&str, &[u8]); 2] = [("box.obj", box_obj.as_bytes()), ("box.mtl", mtl)];
    let scene = load_files(&files, "box.obj", &set(&["camera.size=[8,8]"])).unwrap();
    let [camera, light] = &scene.warnings[..] else { panic!("{:?}", scene.warnings) };
    assert!(camera.contains("has no camera") && light.contains("has no light"));
    // A room without a wall at +z: the camera looks in from there, the light is inside.
    let origin = scene.origin.as_vec3();
    let position = scene.cameras[0].position + origin;
    assert!(position.z > 2.0 && position.x.abs() < 0.1, "{position}");
    assert_eq!(scene.cameras[0].size, [8, 8]);
    let LightKind::Point { position, .. } = scene.lights[0].kind else { panic!() };
    assert!((1.5..1.99).contains(&(position + origin).y));
    // An object is seen from outside, in the light of a sun.
    let scene = load_files(&[("m.obj", SQUARE.as_bytes())], "m.obj", &LoadOptions::default()).unwrap();
    let LightKind::Directional { direction, .. } = scene.lights[0].kind else { panic!() };
    assert!(scene.cameras[0].position.length() > 1.0 && direction.y < 0.0);
    // A scene file may lack a camera.
    let scene = load(&format!("{HEAD}{LIGHT}"), SQUARE).unwrap();
    assert!(scene.warnings.len() == 1 && scene.warnings[0].contains("has no camera"));
}

#[test]
fn shapes_have_their_closed_forms() {
    for subdivisions in 0..6 {
        let sphere = shapes::integrating_sphere(2.0, subdivisions, 0.5, Vec3::X, 10.0);
        assert_eq!(sphere.triangles.len(), 20 << (2 * subdivisions));
        for t in &sphere.triangles {
            let inward = -(t.positions[0] + t.positions[1] + t.positions[2]).normalize();
            assert!(t.geometric_normal().dot(inward) > 0.999);
            assert!(t.positions.iter().zip(t.normals).all(|(p, n)| close(n, -0.5 * *p)));
        }
        // Inscribed: the area is too small by a fraction of the squared edge length.
        let fraction = sphere.area_m2() / (16.0 * std::f64::consts::PI);
        let deficit = 0.31 / f64::from(1 << (2 * subdivisions));
        assert!(fraction < 1.0 && fraction > 1.0 - deficit, "{subdivisions}: {fraction}");
        let LightKind::Point { intensity, .. } = sphere.lights[0].kind else { panic!() };
        assert!((intensity.x * 4.0 * std::f32::consts::PI - 10.0).abs() < 1e-5);
    }
    let room = shapes::closed_box(Vec3::new(1.0, 2.0, 3.0), 0.5);
    assert!((room.area_m2() - 22.0).abs() < 1e-5);
    assert!(room.triangles.iter().all(|t| t.geometric_normal().dot(t.positions[0]) < 0.0));
    let squares = shapes::facing_squares(2.0, 1.0, 0.5);
    assert_eq!(squares.triangles.len(), 4);
    assert!(
        squares.triangles.iter().all(|t| close(t.geometric_normal() * t.positions[0].y, Vec3::NEG_Y * 0.5))
    );
    let wall = shapes::thin_wall();
    assert!((wall.area_m2() - (10.0 + 2.0 * 1.02 * 1.02)).abs() < 1e-4);
    assert!(wall.triangles[12..].iter().all(|t| t.geometric_normal().x * t.positions[0].x > 0.0));
}
