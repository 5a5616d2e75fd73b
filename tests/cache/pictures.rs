//! A picture from stored light paths equals that of new ones to the bit, also after edits.

use crate::common::{assert_silent, context};
use crate::tables::Tables;
use glam::{Vec2, Vec3};
use lightpaths::cache_file::Folder;
use lightpaths::renderer::{Layer, Renderer, Silent, Store};
use lightpaths::scene::{Image, LoadOptions, OpacityMaps, Quality, Scene, Texture};
use std::fs;
use std::sync::Arc;

/// Settings that take a fraction of a second.
pub(crate) const TINY: Quality = Quality {
    preset: "test",
    entry_points: 6_000,
    cache_points: 800,
    gather_rays: 64,
    cells: 16,
    ..Quality::DRAFT
};

/// The Box without editable materials, 40×30 pixels.
pub(crate) fn diffuse() -> Scene {
    let set = vec!["camera.size=[40,30]".to_owned()];
    let mut scene = Scene::load("box", &LoadOptions { set, ..LoadOptions::default() }).unwrap();
    scene.materials.iter_mut().for_each(|material| {
        material.editable = false;
        material.specular = Vec3::ZERO;
    });
    scene.quality = TINY;
    scene
}

/// The Box with an editable glossy teapot.
pub(crate) fn glossy() -> Scene {
    let mut scene = diffuse();
    let teapot = scene.materials.iter_mut().find(|material| material.name == "teapot").unwrap();
    (teapot.editable, teapot.specular, teapot.exponent) = (true, Vec3::splat(0.3), 20.0);
    scene
}

/// A scene with a chequered image on every second material.
pub(crate) fn textured(mut scene: Scene) -> Scene {
    let codes =
        (0..16).map(|texel| if (texel + texel / 4) % 2 == 0 { [250, 40, 90] } else { [30, 200, 220] });
    let image = Arc::new(Image { size: [4, 4], codes: codes.collect() });
    for material in scene.materials.iter_mut().step_by(2) {
        material.texture = Some(Texture { image: image.clone(), is_clamped: false, is_atlas: false });
    }
    let corner = |p: Vec3| Vec2::new(p.x + 0.3 * p.y, p.z - 0.2 * p.y);
    scene.texture_coordinates = scene.triangles.iter().map(|t| t.positions.map(corner)).collect();
    scene
}

/// A scene with holes in every second triangle.
pub(crate) fn with_holes(mut scene: Scene) -> Scene {
    let levels: Vec<u32> = (0..scene.triangles.len() as u32).map(|index| 2 * (index % 2)).collect();
    scene.opacity = OpacityMaps::new(&levels, |_, centre| centre.x > centre.y);
    scene
}

/// A scene with near-field patches and narrow cavities.
pub(crate) fn with_gaps(mut scene: Scene) -> Scene {
    scene.quality = Quality { gap_rounds: 2, occlusion: true, cells: 32, ..scene.quality };
    scene
}

fn bits(renderer: &Renderer) -> Vec<u32> {
    let layers = [Layer::Beauty, Layer::Direct, Layer::Indirect, Layer::Albedo];
    let pixels = layers.into_iter().flat_map(|layer| renderer.layer(layer).unwrap());
    pixels.flat_map(|pixel| pixel.map(f32::to_bits)).collect()
}

/// A renderer from the store; loading must give no message.
fn loaded(scene: Scene, store: &Store) -> Renderer {
    let mut said = Vec::new();
    let mut say = |line: &str| said.push(line.to_owned());
    let renderer = Renderer::cached(&context(), scene, store, &mut Silent, &mut say).unwrap();
    assert_eq!(said, [""; 0]);
    assert_eq!(renderer.statistics().unwrap().precompute_stages[0].0, "stored light paths");
    renderer
}

/// Stores a scene's light paths, and compares every picture from them with one from new light
/// paths. Returns the statistics' counts.
fn compare(scene: &Scene) -> std::collections::BTreeMap<String, u64> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("scene.paths");
    let store = Store::File(file);
    // If there is no file yet, light paths are traced and stored.
    let mut fresh = Renderer::cached(&context(), scene.clone(), &store, &mut Silent, &mut |_| ()).unwrap();
    assert_ne!(fresh.statistics().unwrap().precompute_stages[0].0, "stored light paths");
    // A light that moved before loading makes no difference.
    let mut moved = scene.clone();
    moved.lights[0].kind = moved.lights[0].kind.moved_to(Vec3::new(0.2, 0.3, 0.4));
    let mut stored = loaded(moved, &store);
    stored.set_light(0, scene.lights[0].kind).unwrap();
    let same = |fresh: &mut Renderer, stored: &mut Renderer, what: &str| {
        fresh.frame().unwrap();
        stored.frame().unwrap();
        let expected = bits(fresh);
        assert!(expected.iter().any(|word| *word != 0));
        assert!(bits(stored) == expected, "{what}");
    };
    same(&mut fresh, &mut stored, "as it was");
    let camera = scene.cameras[0].clone();
    for renderer in [&mut fresh, &mut stored] {
        renderer.move_light(0, Vec3::new(-0.3, 0.2, 0.5)).unwrap();
    }
    same(&mut fresh, &mut stored, "a light moved");
    for renderer in [&mut fresh, &mut stored] {
        let material = scene.materials.iter().position(|material| material.editable).unwrap_or(0);
        let specular = scene.materials[material].specular;
        renderer.set_material(material, Vec3::new(0.2, 0.5, 0.1), specular, 7.0).unwrap();
    }
    same(&mut fresh, &mut stored, "a material edited");
    for renderer in [&mut fresh, &mut stored] {
        renderer.move_camera(camera.position + Vec3::new(0.2, 0.1, -0.1), camera.target);
    }
    same(&mut fresh, &mut stored, "the camera moved");
    for renderer in [&mut fresh, &mut stored] {
        renderer.set_skipping(false);
    }
    same(&mut fresh, &mut stored, "nothing left out");
    assert_silent(&context());
    stored.statistics().unwrap().counts
}

#[test]
fn a_matt_scene() {
    compare(&small_diffuse());
}

#[test]
fn a_scene_with_editable_gloss() {
    let counts = compare(&glossy());
    assert!(counts["outgoing directions of clusters"] > 0);
}

#[test]
fn a_textured_scene() {
    compare(&textured(small_diffuse()));
}

#[test]
fn a_scene_with_holes() {
    compare(&with_holes(small_diffuse()));
}

/// Models that can move have a tree of their own: the order of triangles depends on which they are.
#[test]
fn a_scene_with_a_movable_model() {
    let scene = |model_is_movable: [bool; 2]| {
        let mut scene = small_diffuse();
        let teapot = scene.objects.len() as u32 - 1;
        scene.model_objects = vec![0..teapot, teapot..teapot + 1];
        scene.model_is_movable = model_is_movable.to_vec();
        scene
    };
    compare(&scene([false, true]));
    let folder = tempfile::tempdir().unwrap();
    let store = Store::Folder(Folder { path: folder.path().to_owned(), limit_bytes: u64::MAX });
    for model_is_movable in [[false, true], [true, false], [true, true], [false, false]] {
        let scene = scene(model_is_movable);
        let traced = Renderer::cached(&context(), scene, &store, &mut Silent, &mut |_| ()).unwrap();
        let first = &traced.statistics().unwrap().precompute_stages[0].0;
        assert_ne!(first, "stored light paths", "{model_is_movable:?}");
    }
}

/// Fewer light paths, for tests that do not depend on their number.
fn small_diffuse() -> Scene {
    let mut scene = diffuse();
    scene.quality = Quality { entry_points: 2_000, cache_points: 200, ..TINY };
    scene
}

#[test]
fn a_scene_with_near_field_patches_and_narrow_cavities() {
    let counts = compare(&with_gaps(diffuse()));
    assert!(counts["near-field patches"] > 0, "{counts:?}");
}

#[test]
fn warnings_are_those_of_fresh_light_paths() {
    let mut scene = small_diffuse();
    scene.quality.cache_points = 20;
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("scene.paths");
    let store = Store::File(file);
    let fresh = Renderer::cached(&context(), scene.clone(), &store, &mut Silent, &mut |_| ()).unwrap();
    let stored = loaded(scene, &store);
    assert!(!fresh.scene().warnings.is_empty());
    assert_eq!(stored.scene().warnings, fresh.scene().warnings);
}

#[test]
fn each_dependency_is_told_and_a_damaged_file_is_replaced() {
    let scene = small_diffuse();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("scene.paths");
    let store = Store::File(file.clone());
    Renderer::store(&context(), scene.clone(), &file, &mut Silent).unwrap();
    let miss = |change: &dyn Fn(&mut Scene)| {
        let mut scene = scene.clone();
        change(&mut scene);
        store.miss(&context(), &scene).unwrap().map(|miss| miss.to_string())
    };
    assert_eq!(miss(&|_| ()), None);
    assert_eq!(miss(&|scene| scene.cameras[0].size = [20, 20]), None);
    assert_eq!(miss(&|scene| scene.lights.clear()), None);
    let stale = |what: &str| Some(format!("is out of date: {what} has changed"));
    assert_eq!(miss(&|scene| scene.triangles[7].positions[1].y += 1e-6), stale("geometry"));
    assert_eq!(miss(&|scene| scene.materials[0].diffuse.x *= 0.999), stale("materials"));
    assert_eq!(miss(&|scene| scene.cameras[0].position.x += 0.1), stale("viewpoints"));
    assert_eq!(miss(&|scene| scene.quality.seed += 1), stale("settings"));

    // Another program's file: the first dependency is the program's hash.
    let mut tables = Tables::from_bytes(&fs::read(&file).unwrap());
    tables.dependencies[24] ^= 1;
    fs::write(&file, tables.file()).unwrap();
    assert_eq!(miss(&|_| ()), stale("program"));

    let whole = fs::read(&file).unwrap();
    fs::write(&file, &whole[..whole.len() / 2]).unwrap();
    let mut said = Vec::new();
    let mut say = |line: &str| said.push(line.to_owned());
    Renderer::cached(&context(), scene.clone(), &store, &mut Silent, &mut say).unwrap();
    assert_eq!(said.len(), 1, "{said:?}");
    assert!(said[0].contains("is damaged") && said[0].ends_with("traced anew"), "{said:?}");
    assert_eq!(miss(&|_| ()), None, "it was replaced");
}
