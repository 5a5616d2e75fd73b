//! Lights on walls, in corners and inside solids: results are finite, and distant surface
//! does not change.

use crate::common::{assert_silent, context};
use crate::{SMALL, assert_finite, positions, prepare, relative_mse, render, room};
use glam::Vec3;
use lightpaths::renderer::{Layer, Renderer};
use lightpaths::scene::{LightKind, Quality, Scene, shapes};
use lightpaths::types::Contribution;
use std::f64::consts::PI;

const ALBEDO: f64 = 0.5;
/// Area of the hall's surface.
const AREA_M2: f64 = 5.92;

/// A closed room of 1×0.8×1.2 m seen from a corner under its ceiling.
fn hall(size: [u32; 2], albedo: f64) -> Scene {
    let mut scene = shapes::closed_box(Vec3::new(1.0, 0.8, 1.2), albedo as f32);
    let camera = &mut scene.cameras[0];
    (camera.position, camera.target) = (Vec3::new(0.4, 0.35, 0.55), Vec3::new(-0.2, -0.2, -0.3));
    camera.size = size;
    scene
}

/// A black hall. The tests read only its light paths, so it has few cache points.
fn prepare_black(quality: &Quality) -> Renderer {
    prepare(hall([8, 8], 0.0), Quality { cache_points: 100, gather_rays: 16, ..quality.clone() })
}

fn far(renderer: &Renderer, layer: Layer, is_far: &[bool]) -> Vec<[f32; 3]> {
    let pixels = renderer.layer(layer).unwrap();
    pixels.into_iter().zip(is_far).filter(|(_, is_far)| **is_far).map(|(pixel, _)| pixel).collect()
}

/// Flux of the contributions of all path vertices, W.
fn contributed(renderer: &Renderer) -> f64 {
    let entering = renderer.path_flux().unwrap();
    let contributions: Vec<Contribution> = renderer.stages().contributions.read().unwrap();
    contributions.iter().map(|d| f64::from(d.throughput.x) * f64::from(entering[d.path() as usize].x)).sum()
}

/// Pictures of point lights nearer and nearer to a position, without surface within 0.3 m of it.
/// They must equal that of a light at a millimetre, with all of its energy. A light on the wall
/// itself is on neither side, and only its direct light on other walls is tested.
fn check(quality: Quality, size: [u32; 2]) {
    let mut black = prepare_black(&quality);
    let mut renderer = prepare(hall(size, ALBEDO), quality);
    renderer.frame().unwrap();
    let positions = positions(&renderer);
    for (name, on, inwards) in [
        ("wall", Vec3::new(-0.5, 0.1, -0.05), Vec3::X),
        ("edge", Vec3::new(-0.5, -0.4, 0.1), Vec3::new(1.0, 1.0, 0.0)),
        ("corner", Vec3::new(-0.5, -0.4, -0.6), Vec3::ONE),
    ] {
        let is_far: Vec<bool> = positions.iter().map(|p| p.is_some_and(|p| p.distance(on) > 0.3)).collect();
        let mut picture = |distance: f32| {
            renderer.move_light(0, on + distance * inwards).unwrap();
            renderer.frame().unwrap();
            assert_finite(&renderer);
            // In a black room, the flux that enters the paths equals the sum of all contributions.
            black.move_light(0, on + distance * inwards).unwrap();
            black.frame().unwrap();
            let entered = contributed(&black) / (4.0 * PI);
            // In a closed room, all light is reflected until it is absorbed.
            let kept = contributed(&renderer) * (1.0 - ALBEDO) / (4.0 * PI);
            let removed = renderer.statistics().unwrap().removed;
            println!(
                "{distance:e} m off the {name}: {entered:.4} of its light found, {kept:.4} kept, removed by bounds: {removed:?}"
            );
            assert!(removed.len() == 2 && removed.values().all(|fraction| (0.0..1.0).contains(fraction)));
            assert!(
                distance == 0.0 || (entered - 1.0).abs() < 0.02,
                "{distance:e} m off the {name}: {entered} of its light"
            );
            assert!(
                distance < 0.1 || (kept - 1.0).abs() < 0.03,
                "{distance:e} m off the {name}: {kept} kept"
            );
            let is_counted = removed.values().all(|fraction| *fraction > 0.0);
            assert!(distance < 0.1 || is_counted, "{removed:?}");
            [Layer::Direct, Layer::Indirect].map(|layer| far(&renderer, layer, &is_far))
        };
        picture(0.1);
        picture(1e-2);
        let reference = picture(1e-3);
        for distance in [1e-4, 1e-6, 0.0] {
            let found = picture(distance);
            let errors = [0, 1].map(|layer: usize| relative_mse(&found[layer], &reference[layer]));
            println!("{distance:e} m off the {name}: relMSE of what is far, direct and indirect: {errors:?}");
            assert!(errors[0] <= 1e-3, "{distance:e} m off the {name}: {errors:?}");
            assert!(distance == 0.0 || errors[1] <= 1e-3, "{distance:e} m off the {name}: {errors:?}");
        }
    }
    assert_silent(&context());
}

/// Area lights that face a wall, nearer and nearer to it: their point samples make no spots, and
/// distant surface does not change.
fn check_panels(quality: Quality, size: [u32; 2]) {
    let entry_points = f64::from(quality.entry_points);
    let mut black = prepare_black(&quality);
    let mut renderer = prepare(hall(size, ALBEDO), quality);
    renderer.frame().unwrap();
    let on = Vec3::new(-0.5, 0.1, -0.05);
    let is_far: Vec<bool> =
        positions(&renderer).iter().map(|p| p.is_some_and(|p| p.distance(on) > 0.4)).collect();
    let side = 0.3;
    let power = PI * f64::from(side * side);
    // Some entry points around the rim of the lit area are in it by chance: one standard deviation,
    // relative to the light.
    let noise = (f64::from(side) * (entry_points / AREA_M2).sqrt()).powf(-1.5);
    let mut picture = |distance: f32| {
        let corner = on + Vec3::new(distance, -0.5 * side, -0.5 * side);
        let kind = LightKind::Area {
            corner,
            edge_u: side * Vec3::Z,
            edge_v: side * Vec3::Y,
            radiance: Vec3::ONE,
            samples: 16,
        };
        for renderer in [&mut renderer, &mut black] {
            renderer.set_light(0, kind).unwrap();
            let passes = renderer.frame().unwrap().passes;
            assert!(passes.iter().all(|pass| pass.ms > 0.0), "{passes:?}");
            assert_finite(renderer);
        }
        let entered = contributed(&black) / power;
        let kept = contributed(&renderer) * (1.0 - ALBEDO) / power;
        let removed = renderer.statistics().unwrap().removed;
        println!(
            "{distance:e} m: {entered:.4} of its light found, {kept:.4} kept, removed by bounds: {removed:?}"
        );
        assert!((entered - 1.0).abs() < 3.0 * noise, "{distance:e} m off the wall: {entered} of its light");
        assert!((kept - 1.0).abs() < 3.0 * noise + 0.01, "{distance:e} m off the wall: {kept} kept");
        far(&renderer, Layer::Indirect, &is_far)
    };
    picture(0.1);
    picture(1e-2);
    let reference = picture(1e-3);
    for distance in [1e-4, 1e-6] {
        let error = relative_mse(&picture(distance), &reference);
        println!("{distance:e} m: relMSE of what is far, indirect: {error:e}");
        assert!(error <= 1e-3, "{distance:e} m off the wall: {error:e}");
    }
    assert_silent(&context());
}

#[test]
fn panels_on_walls_leave_the_far_field_alone() {
    check_panels(SMALL, [64, 48]);
}

/// Each further sample of a pixel at a shadow edge sums all samples of the light.
#[test]
#[ignore = "full size: make stress"]
fn a_panel_of_as_many_samples_as_there_may_be_is_a_picture() {
    let mut scene = room();
    scene.cameras[0].size = [12, 9];
    let kind = |samples| LightKind::Area {
        corner: Vec3::new(-0.5 + 1e-2, -0.1, -0.2),
        edge_u: 0.3 * Vec3::Z,
        edge_v: 0.3 * Vec3::Y,
        radiance: Vec3::ONE,
        samples,
    };
    let quality = Quality { entry_points: 500, cache_points: 100, edge_samples: 16, ..SMALL };
    let pictures = [64, 4096].map(|samples| {
        scene.lights[0].kind = kind(samples);
        let renderer = render(scene.clone(), quality.clone());
        renderer.layer(Layer::Beauty).unwrap()
    });
    let error = relative_mse(&pictures[0], &pictures[1]);
    println!("64 and 4096 samples: relMSE {error:e}");
    assert!(error < 1e-2, "{error:e}");
    assert_silent(&context());
}

/// Entry points are 3.8 mm apart.
#[test]
#[ignore = "full size: make stress"]
fn panels_on_walls_at_the_papers_settings() {
    check_panels(Quality::PAPER, [256, 192]);
}

#[test]
fn lamps_on_walls_leave_the_far_field_alone() {
    check(SMALL, [64, 48]);
}

/// Entry points are 3.8 mm apart.
#[test]
#[ignore = "full size: make stress"]
fn lamps_on_walls_at_the_papers_settings() {
    check(Quality::PAPER, [256, 192]);
}
