//! Lights on walls, in corners and inside solids: finite, and what is far from them takes no notice.

use crate::common::{assert_silent, context};
use crate::{SMALL, assert_finite, positions, prepare, relative_mse};
use glam::Vec3;
use lightpaths::renderer::{Layer, Renderer};
use lightpaths::scene::{Quality, Scene, shapes};
use lightpaths::types::Deposit;

/// A closed room of 1×0.8×1.2 m seen from a corner under its ceiling.
fn hall(albedo: f32, size: [u32; 2]) -> Scene {
    let mut scene = shapes::closed_box(Vec3::new(1.0, 0.8, 1.2), albedo);
    let camera = &mut scene.cameras[0];
    (camera.position, camera.target) = (Vec3::new(0.4, 0.35, 0.55), Vec3::new(-0.2, -0.2, -0.3));
    camera.size = size;
    scene
}

fn far(renderer: &Renderer, layer: Layer, is_far: &[bool]) -> Vec<[f32; 3]> {
    let pixels = renderer.layer(layer).unwrap();
    pixels.into_iter().zip(is_far).filter(|(_, is_far)| **is_far).map(|(pixel, _)| pixel).collect()
}

/// Flux that all path vertices deposit, W.
fn deposited(renderer: &Renderer) -> f64 {
    let entering = renderer.path_flux().unwrap();
    let deposits: Vec<Deposit> = renderer.stages().deposits.read().unwrap();
    deposits.iter().map(|d| f64::from(d.throughput.x) * f64::from(entering[d.path() as usize].x)).sum()
}

fn check(quality: Quality, size: [u32; 2]) {
    let mut renderer = prepare(hall(0.5, size), quality);
    renderer.frame().unwrap();
    let positions = positions(&renderer);
    for (name, on, inwards) in [
        ("on a wall", Vec3::new(-0.5, 0.1, -0.05), Vec3::X),
        ("on an edge", Vec3::new(-0.5, -0.4, 0.1), Vec3::new(1.0, 1.0, 0.0)),
        ("in a corner", Vec3::new(-0.5, -0.4, -0.6), Vec3::ONE),
    ] {
        let is_far: Vec<bool> = positions.iter().map(|p| p.is_some_and(|p| p.distance(on) > 0.3)).collect();
        let mut picture = |distance: f32| {
            renderer.move_light(0, on + distance * inwards).unwrap();
            renderer.frame().unwrap();
            assert_finite(&renderer);
            let entering = deposited(&renderer);
            println!("{:?}", renderer.statistics().unwrap().removed);
            let layers = [Layer::Direct, Layer::Indirect].map(|layer| far(&renderer, layer, &is_far));
            let sums = layers.clone().map(|layer| layer.iter().map(|p| f64::from(p[0])).sum::<f64>());
            println!(
                "{name}, {distance:e}: flux {:.5} of what the lamp sends, sums {sums:.4?}",
                entering / 8.0 / std::f64::consts::PI
            );
            layers
        };
        let reference = picture(1e-3);
        for distance in [0.1, 1e-2, 1e-4, 1e-6, 1e-7, 0.0] {
            let found = picture(distance);
            let errors = [0, 1].map(|layer: usize| relative_mse(&found[layer], &reference[layer]));
            println!(
                "{name}, {distance:e} m off: relMSE of what is far: direct {:.1e}, indirect {:.1e}",
                errors[0], errors[1]
            );
        }
    }
    assert_silent(&context());
}

#[test]
fn lights_on_walls() {
    check(SMALL, [64, 48]);
}

#[test]
#[ignore = "full size: make stress"]
fn lights_on_walls_at_the_papers_settings() {
    check(Quality::PAPER, [256, 192]);
}
