//! Image sizes and places of the camera.

use crate::common::{assert_silent, context};
use crate::{SMALL, assert_finite, count, render, the_box};
use glam::Vec3;
use lightpaths::renderer::{Edit, Layer, Renderer};
use lightpaths::scene::shapes;

/// Pixels that see something.
fn seen(renderer: &Renderer) -> usize {
    renderer.layer(Layer::Depth).unwrap().iter().filter(|depth| depth[0].is_finite()).count()
}

#[track_caller]
fn assert_no_hole(renderer: &Renderer) {
    assert_eq!(count(renderer, "pixels without a record"), 0);
    let (relaxed, pixels) = (count(renderer, "pixels served by a relaxed record"), count(renderer, "pixels"));
    assert!(
        relaxed as f64 <= (1e-3 * pixels as f64).max(2.0),
        "{relaxed} of {pixels} pixels are served by a relaxed record"
    );
}

#[test]
fn odd_image_sizes() {
    for size in [[1, 1], [17, 1], [1, 33], [513, 3], [16, 16], [65, 63]] {
        let renderer = render(the_box(&[format!("camera.size={size:?}")]), SMALL);
        assert_eq!(renderer.size(), size);
        assert_eq!(renderer.layer(Layer::Beauty).unwrap().len(), (size[0] * size[1]) as usize);
        assert_no_hole(&renderer);
        assert!(renderer.layer(Layer::Beauty).unwrap().iter().any(|pixel| pixel[1] > 0.0), "{size:?}");
    }
    assert_silent(&context());
}

#[test]
fn cameras_near_and_far() {
    let mut renderer = render(the_box(&[]), SMALL);
    let fallback = |renderer: &Renderer| count(renderer, "splat tile pairs");
    let usual = fallback(&renderer);
    // Far: all records in one tile. Then so near that each record covers all tiles. Then inside the wall and the teapot.
    for (position, target) in [
        (Vec3::new(0.0, 0.0, 120.0), Vec3::ZERO),
        (Vec3::new(0.0, 0.0, -0.99), Vec3::new(0.0, 0.0, -1.0)),
        (Vec3::new(0.0, -0.999, 0.0), Vec3::new(0.3, -1.0, 0.1)),
        (Vec3::new(0.0, -0.7, 0.0), Vec3::ZERO),
        (Vec3::new(1.0, 0.0, 0.0), Vec3::ZERO),
    ] {
        renderer.move_camera(position, target);
        renderer.frame(Edit::View).unwrap();
        assert_finite(&renderer);
        assert_eq!(count(&renderer, "pixels without a record"), 0, "camera at {position}");
        assert!(seen(&renderer) > 0, "camera at {position}");
    }
    assert!(usual > 0);
    assert_silent(&context());
}

#[test]
fn lists_grow_with_the_view() {
    let mut renderer = render(shapes::closed_box(Vec3::ONE, 0.5), SMALL);
    let usual = count(&renderer, "splat weights");
    for distance in [0.3, 0.05, 0.01, 1e-3] {
        renderer.move_camera(Vec3::new(0.01, 0.02, distance - 0.5), Vec3::new(0.01, 0.02, -0.5));
        renderer.frame(Edit::View).unwrap();
        assert_finite(&renderer);
        assert_no_hole(&renderer);
    }
    assert!(usual > 0);
    assert_silent(&context());
}

#[test]
fn a_view_of_nothing_is_black() {
    let mut renderer = render(the_box(&[]), SMALL);
    for (position, target) in [(Vec3::splat(50.0), Vec3::splat(100.0)), (Vec3::ZERO, Vec3::Z)] {
        renderer.move_camera(position, target);
        renderer.frame(Edit::View).unwrap();
        assert_finite(&renderer);
    }
    renderer.move_camera(Vec3::splat(50.0), Vec3::splat(100.0));
    renderer.frame(Edit::View).unwrap();
    assert_eq!(seen(&renderer), 0);
    assert!(renderer.layer(Layer::Beauty).unwrap().iter().all(|pixel| *pixel == [0.0; 3]));
    assert_eq!(count(&renderer, "splat weights"), 0);
    assert_silent(&context());
}
