//! Difficult cases for renderers: unusual sizes, positions, powers, and orders of edits.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod boxes;
mod closed;
#[path = "../common/mod.rs"]
mod common;
mod dark_sides;
mod determinism;
mod dispatches;
mod edits;
mod extremes;
mod film;
mod frame_costs;
mod geometry;
mod loop_limit;
mod measures;
mod mixing;
mod near_lights;
mod own_records;
mod pass_costs;
mod precompute_costs;
mod rays;
mod silhouettes;
mod single_edits;
mod tuning;
mod views;

use common::context;
use glam::Vec3;
use lightpaths::gpu::Buffer;
use lightpaths::renderer::{Layer, Renderer, Silent};
use lightpaths::scene::{LoadOptions, Quality, Scene, Triangle, shapes};

/// Settings that take a fraction of a second.
const SMALL: Quality = Quality {
    preset: "test",
    entry_points: 20_000,
    cache_points: 2_000,
    gather_rays: 64,
    cells: 16,
    ..Quality::DRAFT
};

/// Smaller settings, for checks that hold at any size: bits, exact ratios, black, finite.
const FEW: Quality = Quality { entry_points: 4_000, cache_points: 400, gather_rays: 32, ..SMALL };

const LAYERS: [Layer; 6] =
    [Layer::Beauty, Layer::Direct, Layer::Indirect, Layer::Albedo, Layer::Normal, Layer::Depth];

/// A renderer before its first frame.
fn prepare(mut scene: Scene, quality: Quality) -> Renderer {
    scene.quality = quality;
    Renderer::new(&context(), scene, &mut Silent).unwrap()
}

/// A renderer after its first frame; all of its buffers must hold finite numbers.
fn render(scene: Scene, quality: Quality) -> Renderer {
    let mut renderer = prepare(scene, quality);
    renderer.frame().unwrap();
    assert_finite(&renderer);
    renderer
}

/// The built-in Box with changes, by default 64×48 pixels.
fn the_box(set: &[String]) -> Scene {
    let mut changes = vec!["camera.size=[64,48]".to_owned()];
    changes.extend_from_slice(set);
    Scene::load("box", &LoadOptions { set: changes, ..LoadOptions::default() }).unwrap()
}

/// A closed room with a block in it, 64×48 pixels. Few records cover it, because it has
/// no curved surface.
fn room() -> Scene {
    let mut scene = shapes::closed_box(Vec3::new(1.0, 0.8, 1.2), 0.5);
    let block = shapes::closed_box(Vec3::new(0.3, 0.2, 0.3), 0.5).triangles.into_iter().map(|triangle| {
        // The fronts of the box are inside; those of a block are outside.
        let [a, b, c] = triangle.positions.map(|p| p + Vec3::new(-0.2, -0.25, -0.1));
        Triangle { positions: [a, c, b], normals: triangle.normals.map(|n| -n), ..triangle }
    });
    scene.triangles.extend(block);
    scene.cameras[0].size = [64, 48];
    scene
}

/// Asserts that no stage has NaN, infinity or negative energy. Only depth is infinite where a
/// camera ray leaves the scene.
#[track_caller]
fn assert_finite(renderer: &Renderer) {
    let stages = renderer.stages();
    let floats = |buffer: &Buffer| buffer.read::<f32>().unwrap();
    let path_flux: Vec<f32> = renderer.path_flux().unwrap().iter().flat_map(Vec3::to_array).collect();
    for (name, values) in [
        ("path flux", path_flux),
        ("cluster flux", floats(stages.cluster_flux)),
        ("cluster irradiance", floats(stages.cluster_irradiance)),
    ] {
        assert!(values.iter().all(|v| v.is_finite() && *v >= 0.0), "{name}");
    }
    assert!(floats(stages.records).iter().all(|v| v.is_finite()), "records");
    for layer in LAYERS {
        let pixels = renderer.layer(layer).unwrap();
        let is_sane = |v: &f32| match layer {
            Layer::Normal => v.is_finite(),
            Layer::Depth => *v >= 0.0,
            _ => v.is_finite() && *v >= 0.0,
        };
        assert!(pixels.as_flattened().iter().all(is_sane), "{layer:?}");
    }
}

/// Hit of each pixel's ray, from its depth. `None` if the ray left the scene.
fn positions(renderer: &Renderer) -> Vec<Option<Vec3>> {
    let camera = &renderer.scene().cameras[0];
    let [right, up, forward] = camera.frame();
    let [width, height] = camera.size.map(|pixels| pixels as f32);
    let tan = (0.5 * camera.fov_y_degrees).to_radians().tan();
    let depths = renderer.layer(Layer::Depth).unwrap();
    let position = |(index, depth): (u32, &[f32; 3])| {
        let x = (2.0 * ((index % camera.size[0]) as f32 + 0.5) / width - 1.0) * tan * width / height;
        let y = (1.0 - 2.0 * ((index / camera.size[0]) as f32 + 0.5) / height) * tan;
        depth[0].is_finite().then(|| camera.position + depth[0] * (forward + x * right + y * up))
    };
    (0..).zip(&depths).map(position).collect()
}

/// A count of the renderer's statistics.
fn count(renderer: &Renderer, name: &str) -> u64 {
    renderer.statistics().unwrap().counts[name]
}

/// Mean of the squared difference over the reference's square.
fn relative_mse(image: &[[f32; 3]], reference: &[[f32; 3]]) -> f64 {
    assert_eq!(image.len(), reference.len());
    let sum = |pixels: &mut dyn Iterator<Item = f64>| pixels.map(|v| v * v).sum::<f64>();
    let difference = image.as_flattened().iter().zip(reference.as_flattened());
    sum(&mut difference.map(|(a, b)| f64::from(*a) - f64::from(*b)))
        / sum(&mut reference.as_flattened().iter().map(|v| f64::from(*v)))
}
