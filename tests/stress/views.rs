//! Image sizes and positions of the camera.

use crate::common::{assert_silent, context};
use crate::{SMALL, assert_finite, count, render, room, the_box};
use glam::Vec3;
use lightpaths::renderer::{Layer, Renderer};
use lightpaths::scene::Quality;
use lightpaths::types::CachePoint;

/// Number of pixels with a hit.
fn seen(renderer: &Renderer) -> usize {
    renderer.layer(Layer::Depth).unwrap().iter().filter(|depth| depth[0].is_finite()).count()
}

#[track_caller]
fn assert_no_hole(renderer: &Renderer) {
    let uncovered = count(renderer, "pixels without a covering record");
    let points = count(renderer, "pixels") + count(renderer, "edge points");
    assert_eq!(count(renderer, "pixels that take the nearest record"), 0);
    // One of few points may lie in a corner, where it takes records of relaxed validity.
    assert!(1000 * uncovered <= points.max(2000), "{uncovered} of {points} points have no covering record");
}

#[test]
fn odd_image_sizes() {
    let mut scene = room();
    scene.cameras[0].size = [1, 1];
    let mut renderer = render(scene, SMALL);
    // `passes::resize` compares resized pictures with those of a cold start.
    for size in [[1, 1], [17, 1], [1, 33], [513, 3], [16, 16], [65, 63]] {
        renderer.resize(size).unwrap();
        renderer.frame().unwrap();
        assert_finite(&renderer);
        assert_eq!(renderer.size(), size);
        assert_eq!(renderer.layer(Layer::Beauty).unwrap().len(), (size[0] * size[1]) as usize);
        assert_no_hole(&renderer);
        assert!(renderer.layer(Layer::Beauty).unwrap().iter().any(|pixel| pixel[1] > 0.0), "{size:?}");
    }
    assert_silent(&context());
}

/// The cache point on a wall that is covered by most others, and the wall's normal.
fn crowded(renderer: &Renderer) -> (Vec3, Vec3) {
    let points: Vec<CachePoint> = renderer.stages().cache_points.read().unwrap();
    let covering = |point: &&CachePoint| {
        let covers = |other: &&CachePoint| {
            other.normal == point.normal && other.position.distance(point.position) < other.radius
        };
        points.iter().filter(covers).count()
    };
    let walls = points.iter().filter(|point| point.normal.y.abs() < 0.5);
    let most = walls.max_by_key(covering).unwrap();
    (most.position, most.normal)
}

#[test]
fn cameras_near_far_and_inside_things() {
    let mut renderer = render(room(), SMALL);
    let usual = count(&renderer, "splat weights");
    let (crowded, normal) = crowded(&renderer);
    for (position, target, grows) in [
        // All records in one tile.
        (Vec3::new(0.1, 0.1, 12.0), Vec3::ZERO, false),
        // Each record over all tiles.
        (crowded + 1e-3 * normal, crowded, true),
        (Vec3::new(0.3, -0.39, 0.2), Vec3::new(0.4, -0.4, 0.1), true),
        // On the wall, in the wall's plane, inside the block.
        (Vec3::new(0.5, 0.0, 0.0), Vec3::ZERO, false),
        (Vec3::new(0.5, 0.0, 0.6), Vec3::new(0.5, 0.0, 0.0), false),
        (Vec3::new(-0.2, -0.25, -0.1), Vec3::ZERO, false),
    ] {
        renderer.move_camera(position, target);
        renderer.frame().unwrap();
        assert_finite(&renderer);
        assert!(seen(&renderer) > 0, "camera at {position}");
        if grows {
            assert_no_hole(&renderer);
            let weights = count(&renderer, "splat weights");
            assert!(weights > usual, "camera at {position}: {weights} weights, usually {usual}");
        }
    }
    assert_silent(&context());
}

#[test]
fn a_view_of_nothing_is_black() {
    let mut renderer = render(room(), SMALL);
    for (position, target) in [(Vec3::splat(50.0), Vec3::splat(100.0)), (Vec3::ZERO, Vec3::Z)] {
        renderer.move_camera(position, target);
        renderer.frame().unwrap();
        assert_finite(&renderer);
    }
    renderer.move_camera(Vec3::splat(50.0), Vec3::splat(100.0));
    renderer.frame().unwrap();
    assert_eq!(seen(&renderer), 0);
    assert!(renderer.layer(Layer::Beauty).unwrap().iter().all(|pixel| *pixel == [0.0; 3]));
    assert_eq!(count(&renderer, "splat weights"), 0);
    assert_silent(&context());
}

/// With few records, gradients extrapolate too far: below zero, or beyond the limit of uncovered
/// pixels. These cases are counted.
#[test]
fn extrapolations_that_are_limited_are_counted() {
    let limited = |cache_points: u32| {
        let renderer = render(the_box(&[]), Quality { cache_points, ..SMALL });
        let names = [
            "extrapolations of records that were limited",
            "pixels clamped at zero",
            "records clamped at zero",
        ];
        let found = names.map(|name| count(&renderer, name));
        println!("{cache_points} records: {found:?} of {} weights", count(&renderer, "splat weights"));
        found
    };
    let [few, many] = [100, 2_000].map(limited);
    assert!(few[0] > many[0], "{few:?}, {many:?}");
    assert_silent(&context());
}
