//! The keys `matrix`, `material` and `movable` of a model.

use glam::{DMat4, DQuat, DVec3, EulerRot, Vec3};
use lightpaths::scene::save::{Edited, SceneText};
use lightpaths::scene::{LoadOptions, Naming, Scene};

use super::refused::message;
use super::{CAMERA, HEAD, LIGHT, SQUARE, close, load};

fn with_keys(keys: &str) -> lightpaths::Result<Scene> {
    load(&format!("{HEAD}{keys}\n{CAMERA}{LIGHT}"), &format!("usemtl wall\n{SQUARE}"))
}

/// The key for a matrix, row by row.
fn key(matrix: DMat4) -> String {
    let rows = matrix.transpose().to_cols_array_2d();
    format!("matrix = {rows:?}")
}

#[test]
fn a_matrix_is_the_transform_of_the_three_keys() {
    let (translate, rotate, scale) =
        (DVec3::new(1.0, -2.0, 3.0), [30.0, -50.0, 70.0], DVec3::new(2.0, -0.5, 1.5));
    let keys = format!(
        "translate = {:?}\nrotate = {rotate:?}\nscale = {:?}",
        translate.to_array(),
        scale.to_array()
    );
    let [x, y, z] = rotate.map(f64::to_radians);
    let rotation = DQuat::from_euler(EulerRot::ZYX, z, y, x);
    let matrix = DMat4::from_scale_rotation_translation(scale, rotation, translate);
    let (stated, by_matrix) = (with_keys(&keys).unwrap(), with_keys(&key(matrix)).unwrap());
    assert!((stated.origin - by_matrix.origin).length() < 1e-6);
    for (a, b) in stated.triangles.iter().zip(&by_matrix.triangles) {
        assert!((0..3).all(|i| close(a.positions[i], b.positions[i]) && close(a.normals[i], b.normals[i])));
    }
}

/// One model that can move is enough to name random decisions by place.
#[test]
fn decisions_are_named_by_place_where_a_model_is_movable() {
    for (keys, naming) in
        [("", Naming::Number), ("movable = false", Naming::Number), ("movable = true", Naming::Place)]
    {
        assert_eq!(with_keys(keys).unwrap().naming(), naming, "{keys}");
    }
}

/// The front of a mirrored square is the mirror image of its front.
#[test]
fn a_mirror_keeps_the_front() {
    for mirror in [DVec3::new(-1.0, 1.0, 1.0), DVec3::new(1.0, -1.0, 1.0), DVec3::new(2.0, 3.0, -1.0)] {
        let scene = with_keys(&key(DMat4::from_scale(mirror))).unwrap();
        let front = Vec3::Y * mirror.y.signum() as f32;
        assert!(scene.triangles.iter().all(|triangle| close(triangle.geometric_normal(), front)), "{mirror}");
    }
}

#[test]
fn matrices_that_are_no_transforms_are_refused() {
    let identity = "[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0]";
    for (keys, expected) in [
        (format!("matrix = [{identity}, [0, 0, 1, 1]]"), "its last row must be 0, 0, 0, 1"),
        (format!("matrix = [{identity}]"), "a list of four rows of four numbers was expected"),
        (format!("matrix = [{identity}, [0, 0, 0]]"), "a list of four rows of four numbers was expected"),
        (format!("matrix = [{identity}, [0, 0, 0, inf]]"), "inf is not a finite number"),
        (key(DMat4::from_scale(DVec3::new(1.0, 1e-10, 1.0))), "must scale by 1e-9 to 1e9"),
        (
            "matrix = [[1, 2, 3, 0], [2, 4, 6, 0], [0.1, 0.7, 1, 0], [0, 0, 0, 1]]".to_owned(),
            "must scale by 1e-9",
        ),
        (format!("matrix = [{identity}, [0, 0, 0, 1]]\nscale = 2"), "replaces `scale`: state one of them"),
    ] {
        let found = message(with_keys(&keys));
        assert!(found.contains("s.toml:3: model.0.matrix: ") && found.contains(expected), "{found}");
    }
}

#[test]
fn a_material_may_take_all_faces() {
    let obj = format!("usemtl wall\n{SQUARE}usemtl other\nv 0 1 0 1 0 0\nf 1 2 5\n");
    let with = |keys: &str, more: &str| load(&format!("{HEAD}{keys}\n{CAMERA}{LIGHT}{more}"), &obj).unwrap();
    let gold = "[[material]]\nname = \"gold\"\ndiffuse = [0.3, 0.2, 0.1]\n";
    let scene = with("material = \"gold\"", gold);
    assert_eq!((scene.materials.len(), scene.triangles.len()), (1, 3));
    assert!(scene.triangles.iter().all(|triangle| triangle.material == 0));
    assert_eq!(scene.materials[0].diffuse, Vec3::new(0.3, 0.2, 0.1));
    assert_eq!(scene.warnings, [""; 0]);
    let scene = with("material = \"other\"", "");
    assert_eq!((scene.materials.len(), &*scene.materials[0].name), (1, "other"));
    assert!(scene.materials[0].texture.is_none(), "no colours of other materials");
    let scene = with("material = \"nowhere\"", "");
    assert!(
        scene.warnings[0]
            .ends_with("s.toml:3: model.0.material: \"nowhere\" is defined nowhere: taken as grey"),
        "{:?}",
        scene.warnings
    );
}

#[test]
fn saving_keeps_both_keys() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let keys = "matrix = [[1, 0, 0, 2], # across\n  [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]]\nmaterial = \"wall\"\n";
    let toml = format!("{HEAD}{keys}{CAMERA}{LIGHT}");
    std::fs::write(path("s.toml"), &toml).unwrap();
    std::fs::write(path("m.obj"), SQUARE).unwrap();
    let spec = path("s.toml").to_str().unwrap().to_owned();
    let options = LoadOptions::default();
    let mut scene = Scene::load(&spec, &options).unwrap();
    let text = SceneText::new(&spec, &options, &scene).unwrap();
    scene.materials[0].diffuse = Vec3::splat(0.25);
    let saved = text.with_edits(&Edited::from_scene(&scene), &path("s.toml")).unwrap();
    assert!(saved.contains(keys), "{saved}");
    std::fs::write(path("s.toml"), saved).unwrap();
    let again = Scene::load(&spec, &options).unwrap();
    assert_eq!((again.triangles, again.materials), (scene.triangles, scene.materials));
}
