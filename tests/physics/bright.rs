//! A lamp beside a surface: the spot that it lights sends out half of the indirect light, and few
//! gather rays meet it.

use crate::common::{assert_silent, context};
use crate::path_tracer::trace;
use glam::Vec3;
use lightpaths::reference::Progressive;
use lightpaths::renderer::{Layer, Renderer, Silent};
use lightpaths::scene::{LightKind, Material, Measure, Measures, Quality, Scene, shapes};

/// A room of 2×1.6×2 m with a lamp 8 cm below its ceiling.
fn room(seed: u32, left_out: Measures) -> Scene {
    let mut scene = shapes::closed_box(Vec3::new(2.0, 1.6, 2.0), 0.6);
    let position = Vec3::new(0.1, 0.72, 0.05);
    scene.lights[0].kind = LightKind::Point { position, intensity: Vec3::ONE };
    scene.quality = Quality { seed, left_out, ..Quality::DRAFT };
    scene
}

/// Indirect light of a seed, of all channels alike.
fn picture(seed: u32, left_out: Measures) -> Vec<f64> {
    let mut scene = room(seed, left_out);
    scene.cameras[0].size = [48, 48];
    let mut renderer = Renderer::new(&context(), scene, &mut Silent).unwrap();
    renderer.frame().unwrap();
    renderer.layer(Layer::Indirect).unwrap().iter().map(|pixel| f64::from(pixel[0])).collect()
}

/// Mean of the squared relative difference of two pictures, over two.
fn noise(a: &[f64], b: &[f64]) -> f64 {
    let mean = a.iter().chain(b).sum::<f64>() / (2 * a.len()) as f64;
    a.iter().zip(b).map(|(a, b)| ((a - b) / mean).powi(2)).sum::<f64>() / (2 * a.len()) as f64
}

#[test]
fn a_lamp_beside_a_surface_makes_no_blotches() {
    let [without, with] = [Measures::only(Measure::BrightClusters), Measures::NONE]
        .map(|left_out| [1, 2, 3].map(|seed| picture(seed, left_out)));
    let of = |pictures: &[Vec<f64>; 3]| {
        let [a, b, c] = pictures;
        (noise(a, b) + noise(b, c) + noise(c, a)) / 3.0
    };
    let energy = |pictures: &[Vec<f64>; 3]| pictures.iter().flatten().sum::<f64>() / 3.0;
    let tracer = trace(room(0, Measures::NONE), [48, 48], 512);
    let reference: f64 = tracer.picture().unwrap().indirect.iter().map(|pixel| f64::from(pixel[0])).sum();
    println!(
        "noise {:.2e} without, {:.2e} with; energy {:.4} and {:.4}",
        of(&without),
        of(&with),
        energy(&without) / reference,
        energy(&with) / reference
    );
    assert!(of(&with) * 3.0 < of(&without), "the noise is {:.2e}, not {:.2e}", of(&with), of(&without));
    assert!((energy(&with) / reference - 1.0).abs() < 0.01);
    assert_silent(&context());
}

/// A lamp comes to surfaces, another moves, a material changes, the lamp leaves: each picture is
/// that of a cold start.
#[test]
fn edits_beside_a_surface_equal_cold_starts() {
    let mut scene = room(1, Measures::NONE);
    scene.cameras[0].size = [32, 32];
    let lamp = |position| LightKind::Point { position, intensity: Vec3::new(1.0, 0.8, 0.6) };
    let mut other = scene.lights[0].clone();
    other.kind = lamp(Vec3::new(0.4, -0.2, -0.3));
    scene.lights.push(other);
    scene.lights[0].kind = lamp(Vec3::ZERO);
    scene.materials[0].editable = true;
    let mut renderer = Renderer::new(&context(), scene.clone(), &mut Silent).unwrap();
    renderer.frame().unwrap();
    for (step, position) in
        [[0.1, 0.72, 0.05], [0.0, 0.7, 0.3], [-0.93, 0.0, 0.2], [0.0; 3]].into_iter().enumerate()
    {
        scene.lights[0].kind = lamp(Vec3::from(position));
        renderer.set_light(0, scene.lights[0].kind).unwrap();
        if step == 1 {
            scene.lights[1].kind = lamp(Vec3::new(0.4, 0.5, -0.3));
            renderer.set_light(1, scene.lights[1].kind).unwrap();
        }
        if step == 2 {
            scene.materials[0].diffuse = Vec3::new(0.3, 0.5, 0.7);
            let Material { diffuse, specular, exponent, .. } = scene.materials[0];
            renderer.set_material(0, diffuse, specular, exponent).unwrap();
        }
        renderer.frame().unwrap();
        let mut cold = Renderer::new(&context(), scene.clone(), &mut Silent).unwrap();
        cold.frame().unwrap();
        let [edited, expected] = [&renderer, &cold].map(|of| of.layer(Layer::Indirect).unwrap());
        assert!(edited == expected, "step {step}");
    }
    assert_silent(&context());
}
