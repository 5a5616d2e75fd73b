//! Light transport against closed forms and against numerical integration.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

mod antialias;
mod bright;
#[path = "../common/mod.rs"]
mod common;
mod corner;
mod cutouts;
mod direct;
mod door;
mod emission;
mod energy;
mod facets;
mod few_paths;
mod form_factors;
mod gloss;
mod hidden_light;
mod interior;
mod lights;
mod luminaires;
mod meters;
mod moved_models;
mod panes;
mod path_noise;
mod path_tracer;
mod penumbra;
mod photons;
mod plates;
mod rounded;
mod scale;
mod sphere;
mod stages;
mod textures;
mod thin_faces;

use common::context;
use lightpaths::renderer::{Renderer, Silent};
use lightpaths::scene::{Quality, Scene};

/// Settings for closed scenes of few triangles.
const SMALL: Quality = Quality {
    preset: "test",
    entry_points: 50_000,
    cache_points: 400,
    gather_rays: 64,
    cells: 16,
    // Closed forms are evaluated at the centres of pixels.
    edge_samples: 0,
    ..Quality::DRAFT
};

/// A renderer after its first frame. It skips no work, so that all buffers between the
/// stages are complete.
fn render(mut scene: Scene, quality: Quality) -> Renderer {
    scene.quality = quality;
    let mut renderer = Renderer::new(&context(), scene, &mut Silent).unwrap();
    renderer.set_skipping(false);
    renderer.frame().unwrap();
    renderer
}

/// Asserts that a number is within a relative tolerance of the expected one.
#[track_caller]
fn assert_close(what: &str, value: f64, expected: f64, tolerance: f64) {
    let error = value / expected - 1.0;
    assert!(error.abs() <= tolerance, "{what}: {value} instead of {expected}, {:+.4} %", 100.0 * error);
}
