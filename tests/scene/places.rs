//! The atrium and the room: closed solids of the size of the paper's scenes, at any resolution.

use std::collections::{HashMap, HashSet};

use glam::Vec3;
use lightpaths::scene::{LoadOptions, Scene, Triangle};

use crate::set;

/// Names, the paper's numbers of triangles [Yue, table 1], and lights.
const PLACES: [(&str, usize, usize); 2] = [("atrium", 76_154, 1), ("room", 141_287, 2)];

fn load(name: &str, triangles: Option<u32>) -> Scene {
    let setting = triangles.map(|count| format!("model.0.triangles={count}"));
    Scene::load(name, &set(&setting.iter().map(String::as_str).collect::<Vec<_>>())).unwrap()
}

/// Position of a corner, bit for bit.
fn bits(p: Vec3) -> [u32; 3] {
    // Adding zero makes -0 equal to 0.
    (p + 0.0).to_array().map(f32::to_bits)
}

/// Every edge must occur equally often in both directions: then the surface has no border.
fn open_edges(triangles: &[Triangle]) -> usize {
    let mut passed: HashMap<[[u32; 3]; 2], i32> = HashMap::new();
    for triangle in triangles {
        let corners = triangle.positions.map(bits);
        for edge in 0..3 {
            let (from, to) = (corners[edge], corners[(edge + 1) % 3]);
            *passed.entry([from.min(to), from.max(to)]).or_default() += if from < to { 1 } else { -1 };
        }
    }
    passed.values().filter(|&&balance| balance != 0).count()
}

/// Invariants for every number of triangles.
fn assert_sound(scene: &Scene) {
    // The loader would warn of triangles without area, repeated ones, and normals
    // against their front.
    assert_eq!(scene.warnings, Vec::<String>::new(), "{}", scene.name);
    assert_eq!(open_edges(&scene.triangles), 0, "{}: open edges", scene.name);
    for triangle in &scene.triangles {
        assert!(triangle.positions.iter().all(|p| p.is_finite()));
        let front = triangle.geometric_normal();
        assert!(triangle.normals.iter().all(|n| n.is_normalized() && n.dot(front) > 0.0), "{triangle:?}");
    }
}

#[test]
fn places_have_the_papers_size_and_are_closed() {
    for (name, count, lights) in PLACES {
        let scene = load(name, None);
        let off = scene.triangles.len() as f64 / count as f64 - 1.0;
        assert!(off.abs() < 0.02, "{name}: {} triangles", scene.triangles.len());
        assert_sound(&scene);
        assert_eq!((scene.name.as_str(), scene.lights.len()), (name, lights));
        assert!(scene.cameras.iter().all(|camera| camera.size == [640, 480]));
        let (low, high) = scene.bounds();
        let inside = |p: Vec3| p.cmpgt(low).all() && p.cmplt(high).all();
        assert!(scene.lights.iter().all(|light| light.kind.position().is_some_and(inside)));
        assert!(scene.cameras.iter().all(|camera| inside(camera.position)));
    }
}

#[test]
fn every_material_is_used_and_absorbs() {
    for (name, ..) in PLACES {
        let scene = load(name, None);
        let used: HashSet<u32> = scene.triangles.iter().map(|triangle| triangle.material).collect();
        assert_eq!(used.len(), scene.materials.len(), "{name}");
        let albedos: HashSet<_> = scene.materials.iter().map(|material| bits(material.diffuse)).collect();
        assert_eq!(albedos.len(), scene.materials.len(), "{name}: each has a colour of its own");
        let range = |material: &lightpaths::scene::Material| {
            material.diffuse.min_element() > 0.0 && material.diffuse.max_element() < 0.85
        };
        assert!(scene.materials.iter().all(range), "{name}");
    }
}

#[test]
fn as_many_triangles_come_as_are_asked_for() {
    for (name, ..) in PLACES {
        let mut last = 0;
        for (wanted, fraction) in [(10_000, 0.02), (30_000, 0.1), (100_000, 0.1)] {
            let scene = load(name, Some(wanted));
            let count = scene.triangles.len();
            let off = count as f64 / f64::from(wanted) - 1.0;
            assert!(off.abs() < fraction && count > last, "{name}: {count} instead of {wanted}");
            assert_sound(&scene);
            last = count;
        }
    }
}

/// Run by `make stress`: takes memory and, unless optimised, minutes.
#[test]
#[ignore = "10 million triangles"]
fn places_of_one_and_ten_million_triangles_are_closed() {
    for (name, ..) in PLACES {
        for wanted in [1_000_000, 10_000_000] {
            let scene = load(name, Some(wanted));
            let off = scene.triangles.len() as f64 / f64::from(wanted) - 1.0;
            assert!(off.abs() < 0.05, "{name}: {} instead of {wanted}", scene.triangles.len());
            assert_sound(&scene);
        }
    }
}

#[test]
fn places_are_the_same_each_time() {
    for (name, ..) in PLACES {
        let [a, b] = [0; 2].map(|_| load(name, Some(20_000)));
        assert!(a.triangles == b.triangles, "{name}");
    }
}

#[test]
fn built_in_models_take_transforms_and_bad_keys_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("s.toml");
    let load = |model: &str| {
        let rest = format!("{}{}", crate::CAMERA, crate::LIGHT);
        std::fs::write(&file, format!("[[model]]\n{model}\n{rest}")).unwrap();
        Scene::load(file.to_str().unwrap(), &LoadOptions::default())
    };
    let size = |scene: &Scene| scene.bounds().1 - scene.bounds().0;
    let [small, large] = ["", "scale = 2.0"]
        .map(|more| load(&format!("built_in = \"atrium\"\ntriangles = 20000\n{more}")).unwrap());
    assert!((size(&large) - 2.0 * size(&small)).abs().max_element() < 1e-4);
    for (model, words) in [
        ("built_in = \"sponza\"", "unknown built-in model `sponza`: possible: box, atrium, room"),
        ("built_in = \"atrium\"\nfile = \"m.obj\"", "either a file or a built-in name"),
        ("built_in = \"atrium\"\ntriangles = 5", "5 is out of range: 10000 to 20000000"),
        ("file = \"m.obj\"\ntriangles = 20000", "only the built-in models atrium and room"),
    ] {
        let message = load(model).unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
    }
}
