//! The path tracer's estimate of its own noise, and the accuracy of its sums.

use crate::common::{assert_silent, context};
use crate::path_tracer::trace;
use glam::Vec3;
use lightpaths::reference::{Picture, Progressive};
use lightpaths::scene::{LightKind, Scene, shapes};

/// A room with uneven light; `seed` selects the random sequence.
fn room(seed: u32) -> Scene {
    let mut scene = shapes::closed_box(Vec3::new(2.0, 1.0, 1.5), 0.6);
    scene.quality.seed = seed;
    scene.lights[0].kind = LightKind::Point { position: Vec3::new(0.3, 0.1, 0.2), intensity: Vec3::ONE };
    scene
}

#[test]
fn the_stated_variance_is_that_of_independent_pictures() {
    let pictures = [1, 2].map(|seed| {
        let tracer = trace(room(seed), [32, 32], 64);
        (tracer.picture().unwrap().beauty, tracer.variance().unwrap())
    });
    let [(a, variance_a), (b, variance_b)] = &pictures;
    let z2 = |i: usize| {
        let [a, b, va, vb] = [a, b, variance_a, variance_b].map(|of| f64::from(of[i][0]));
        (a - b).powi(2) / (va + vb)
    };
    let mean = (0..a.len()).map(z2).sum::<f64>() / a.len() as f64;
    println!("mean z² {mean:.3}");
    // 1024 pixels have 4.4 % of their own noise, and as much from the two scales.
    assert!((mean - 1.0).abs() < 0.2, "mean z² {mean}");
    assert_silent(&context());
}

#[test]
fn the_halves_are_independent() {
    // Uniform light: each difference from the mean is noise.
    let scene = shapes::integrating_sphere(1.0, 3, 0.5, Vec3::ZERO, 10.0);
    let tracer = trace(scene, [32, 32], 16);
    let apart = tracer.halves().unwrap().map(|half| {
        let values: Vec<f64> = half.iter().map(|pixel| f64::from(pixel[0])).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        values.into_iter().map(|value| value - mean).collect::<Vec<_>>()
    });
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let [a, b] = &apart;
    let correlation = product(a, b) / (product(a, a) * product(b, b)).sqrt();
    println!("correlation {correlation:.4}");
    assert!(correlation.abs() < 4.0 / 32.0, "{correlation}");
    let noise = tracer.noise().unwrap().unwrap();
    assert!(noise > 0.0 && noise < 1e-2, "{noise}");
    assert_silent(&context());
}

#[test]
fn the_same_samples_give_the_same_bytes_however_they_are_asked_for() {
    let pictures: Vec<Picture> = [&[40][..], &[1, 2, 30, 7], &[40]]
        .iter()
        .map(|rounds| {
            let mut tracer = trace(room(3), [17, 9], 0);
            rounds.iter().for_each(|&samples| tracer.add_samples(samples).unwrap());
            assert_eq!(tracer.samples(), 40);
            tracer.picture().unwrap()
        })
        .collect();
    assert!(pictures[0] == pictures[1] && pictures[0] == pictures[2]);
    assert!(pictures[0].beauty.iter().flatten().all(|value| *value > 0.0));
    assert_silent(&context());
}

/// The mean of equal samples equals one sample. A plain f32 sum of the samples of one half has an
/// error above `plain_error`.
fn check_many_samples(samples: u32, plain_error: f32) {
    // A plane under a directional light: all samples are the same.
    let mut scene = shapes::facing_squares(100.0, 0.0, 0.7);
    scene.triangles.truncate(2);
    scene.lights[0].kind =
        LightKind::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::new(1.0, 1e-6, 0.3) };
    let camera = &mut scene.cameras[0];
    (camera.position, camera.up) = (Vec3::Y, Vec3::NEG_Z);
    let once = trace(scene.clone(), [1, 1], 1).picture().unwrap().beauty[0];
    let tracer = trace(scene, [1, 1], samples);
    let mean = tracer.picture().unwrap().beauty[0];
    for (mean, once) in mean.into_iter().zip(once) {
        // Almost equal: interpolated normals have unit length within a few ulps.
        assert!((mean / once - 1.0).abs() < 1e-6, "the mean of equal samples: {mean}, {once}");
        let plain = (0..samples / 2).fold(0.0_f32, |sum, _| sum + once) / (samples / 2) as f32;
        assert!(
            (plain / once - 1.0).abs() > plain_error,
            "a plain sum shows the difference: {plain}, {once}"
        );
    }
    for (variance, once) in tracer.variance().unwrap()[0].into_iter().zip(once) {
        assert!(variance.sqrt() <= 1e-7 * once, "{variance}");
    }
    assert_silent(&context());
}

#[test]
fn many_samples_lose_nothing() {
    check_many_samples(24_000, 3e-6);
}

#[test]
#[ignore = "full size: make stress"]
fn a_hundred_thousand_samples_lose_nothing() {
    check_many_samples(120_000, 1e-5);
}

#[test]
fn without_lights_all_is_black_and_too_few_samples_state_no_variance() {
    let mut scene = room(1);
    scene.lights.clear();
    let tracer = trace(scene, [9, 7], 3);
    assert!(tracer.picture().unwrap().beauty.iter().all(|pixel| *pixel == [0.0; 3]));
    assert!(tracer.variance().unwrap_err().to_string().contains("four samples"));
    assert!(tracer.rays().unwrap().unwrap() > 3 * 9 * 7);
    assert_silent(&context());
}
