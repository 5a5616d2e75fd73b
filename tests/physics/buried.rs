//! Parts that reach into each other: what is buried in a solid is no surface.

use crate::common::{assert_silent, context};
use crate::{SMALL, render};
use glam::Vec3;
use lightpaths::renderer::{Exact, Stage};
use lightpaths::scene::{Quality, Scene, Triangle, shapes};
use lightpaths::types::Record;

/// A cube of 2 m from inside, on whose floor a slab of 2 cm lies, sunk to half its height: nearly all of the floor is buried, in the
/// same cells as the slab's top.
fn tiled_room() -> Scene {
    let mut scene = shapes::closed_box(Vec3::splat(2.0), 0.5);
    let slab = shapes::closed_box(Vec3::new(1.9, 0.02, 1.9), 0.5).triangles;
    scene.triangles.extend(slab.into_iter().map(|Triangle { positions: [a, b, c], normals, material }| {
        let positions = [a, c, b].map(|corner| corner - Vec3::Y);
        Triangle { positions, normals: normals.map(|normal| -normal), material }
    }));
    scene
}

#[test]
fn what_is_buried_in_a_solid_takes_no_light_away() {
    let quality = Quality { entry_points: 100_000, ..SMALL };
    let renderer = render(tiled_room(), quality);
    let exact = Exact { stage: Stage::Clusters, samples: 16, sequence: 0 };
    let expected: f32 = renderer.exact_irradiance(exact).unwrap().iter().map(|exact| exact.x).sum();
    let records: Vec<Record> = renderer.stages().gathered.read().unwrap();
    let found: f32 = records.iter().map(|record| record.irradiance.x).sum();
    println!("irradiance of all records: {:+.2} %", 100.0 * (found / expected - 1.0));
    assert!((found / expected - 1.0).abs() < 0.02, "{found} instead of {expected}");
    assert_silent(&context());
}
