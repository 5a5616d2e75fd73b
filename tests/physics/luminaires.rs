//! Luminaires with measured intensities: against closed forms and between the methods.

use super::photons::differences;
use crate::common::{assert_silent, context};
use crate::{SMALL, assert_close, render};
use glam::Vec3;
use lightpaths::renderer::{Layer, Measured, Renderer};
use lightpaths::scene::luminaire::{Luminaire, Profile};
use lightpaths::scene::meter::{Meter, MeterShape};
use lightpaths::scene::photometry::lux;
use lightpaths::scene::{Light, Quality, Scene, shapes};
use std::f64::consts::PI;
use std::sync::Arc;

/// Intensity, cd, at a vertical and a horizontal angle, radians: wide along C0, narrow along C90,
/// and brighter towards C0 than towards C180.
fn intensity(axial: f64, around: f64) -> f64 {
    let (x, y) = (axial.sin() * around.cos(), axial.sin() * around.sin());
    800.0 * axial.cos().max(0.0) * (1.0 + 0.5 * x) * (1.0 - 0.7 * y * y)
}

/// That luminaire, each five degrees.
fn luminaire() -> Luminaire {
    let angles = |to: u32, step: usize| (0..=to).step_by(step).map(f64::from).collect::<Vec<_>>();
    let (vertical, horizontal) = (angles(90, 5), angles(360, 5));
    let words = |numbers: &[f64]| numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    let planes = horizontal.iter().map(|around| {
        let of = |axial: &f64| intensity(axial.to_radians(), around.to_radians());
        words(&vertical.iter().map(of).collect::<Vec<_>>())
    });
    let planes = planes.collect::<Vec<_>>().join("\n");
    let counts = format!("{} {}", vertical.len(), horizontal.len());
    let text = format!(
        "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 {counts} 1 2 0 0 0\n1 1 10\n{}\n{}\n{planes}\n",
        words(&vertical),
        words(&horizontal)
    );
    let profile = Arc::new(Profile::from_ies(text.as_bytes()).unwrap());
    Luminaire { profile, file: "lamp.ies".into(), turn: 0.0 }
}

/// ∫ intensity dω, by the midpoint rule, which converges faster than the file's own grid.
fn flux() -> f64 {
    let count = 400;
    let (step, turn) = (0.5 * PI / f64::from(count), 2.0 * PI / f64::from(count));
    let sum: f64 = (0..count * count)
        .map(|cell| {
            let axial = (f64::from(cell / count) + 0.5) * step;
            intensity(axial, (f64::from(cell % count) + 0.5) * turn) * axial.sin()
        })
        .sum();
    sum * step * turn
}

fn turned(mut light: Light, axis: Vec3, turn: f32) -> Light {
    let lightpaths::scene::LightKind::Spot { direction, .. } = &mut light.kind else { unreachable!() };
    *direction = axis;
    light.luminaire.as_mut().unwrap().turn = turn;
    light
}

/// The lumens of the file are those of its integral.
#[test]
fn a_file_has_the_lumens_of_its_integral() {
    let light = Light::measured("lamp", luminaire(), Vec3::ZERO);
    let (found, _) = light.power().unwrap();
    assert!((found / flux() - 1.0).abs() < 0.005, "{found} instead of {}", flux());
}

/// Illuminance is cd·cosθ/d², for a light that looks down and for one that looks aside, turned.
#[test]
fn meters_read_the_candela_of_the_file() {
    let place = Vec3::new(0.1, 0.6, -0.1);
    // Directions of the axis and of the planes C0 and C90.
    let aside = Vec3::new(0.6, -0.8, 0.0);
    let c0 = Vec3::new(0.8, 0.6, 0.0);
    for (axis, turn, c0, c90) in [
        (-Vec3::Y, 0.0, Vec3::X, -Vec3::Z),
        (-Vec3::Y, 0.5 * std::f32::consts::PI, -Vec3::Z, -Vec3::X),
        (aside, 0.0, c0, -Vec3::Z),
        (aside, -0.5 * std::f32::consts::PI, Vec3::Z, c0),
    ] {
        let mut scene = shapes::hidden_light(0.01, 0.9, 0.0);
        scene.triangles.truncate(12);
        scene.lights = vec![turned(Light::measured("lamp", luminaire(), place), axis, turn)];
        // Nodes of the file: there the interpolation is exact.
        let angles =
            [(0.0_f32, 0.0_f32), (20.0, 0.0), (45.0, 0.0), (45.0, 180.0), (45.0, 90.0), (30.0, 230.0)];
        let direction = |(axial, around): (f32, f32)| {
            let (sin, cos) = axial.to_radians().sin_cos();
            cos * axis + sin * (around.to_radians().cos() * c0 + around.to_radians().sin() * c90)
        };
        let meter = |angles| MeterShape::Point {
            position: place + 0.3 * direction(angles),
            normal: -direction(angles),
        };
        scene.meters = angles.map(|angles| Meter { name: "m".to_owned(), shape: meter(angles) }).to_vec();
        let found = render(scene, SMALL).measured().unwrap();
        for ((axial, around), point) in angles.iter().zip(found) {
            let expected = intensity(f64::from(*axial).to_radians(), f64::from(*around).to_radians()) / 0.09;
            assert_close(&format!("{axis}, {turn}: {axial}°, {around}°"), lux(point.direct), expected, 2e-4);
        }
    }
    assert_silent(&context());
}

/// A luminaire in an integrating sphere: what the sphere adds at its wall is the flux, wherever the
/// light goes first.
#[test]
fn a_sphere_integrates_a_luminaire() {
    let mut scene = shapes::integrating_sphere(1.5, 4, 0.5, Vec3::ZERO, 1.0);
    scene.lights =
        vec![turned(Light::measured("lamp", luminaire(), Vec3::ZERO), Vec3::new(0.48, 0.6, -0.64), 0.7)];
    let expected = scene.lights[0].power().unwrap().0 / scene.area_m2();
    let places = [Vec3::X, Vec3::NEG_Y, Vec3::new(0.48, 0.6, -0.64), Vec3::new(0.0, 0.8, 0.6)];
    let shape = |place: Vec3| MeterShape::Point { position: 1.49 * place, normal: -place };
    scene.meters = places.map(|place| Meter { name: "m".to_owned(), shape: shape(place) }).to_vec();
    let renderer = render(scene, Quality { cache_points: 400, ..Quality::PAPER });
    for (place, point) in places.iter().zip(renderer.measured().unwrap()) {
        assert_close(&format!("{place}"), lux(point.indirect), expected, 0.02);
    }
    assert_silent(&context());
}

fn room() -> Scene {
    let mut scene = shapes::hidden_light(0.7, 0.9, 0.5);
    let light = Light::measured("lamp", luminaire(), Vec3::new(0.2, 0.7, 0.1));
    scene.lights = vec![turned(light, Vec3::new(-0.36, -0.8, 0.48), 1.0)];
    scene
}

/// The light-path method, path tracing and photon mapping read the same intensities.
#[test]
fn methods_agree() {
    let [direct, indirect] = differences(room(), 48, [96, 32]);
    assert!(direct.abs() < 0.01 && indirect.abs() < 0.02, "direct {direct}, indirect {indirect}");
    let mut scene = room();
    let (corner, edge_u, edge_v) = (Vec3::new(-0.8, -0.9, 0.8), 1.6 * Vec3::X, -1.6 * Vec3::Z);
    let shape = MeterShape::Plane { corner, edge_u, edge_v, grid: [4, 4] };
    scene.meters = vec![Meter { name: "floor".to_owned(), shape }];
    let renderer = render(scene, Quality { entry_points: 100_000, cache_points: 400, ..Quality::PAPER });
    let (found, exact) = (renderer.measured().unwrap(), renderer.measured_by_paths(1 << 14).unwrap());
    let mean = |points: &[Measured]| points.iter().map(|point| lux(point.indirect)).sum::<f64>();
    assert_close("indirect light", mean(&found), mean(&exact), 0.01);
    assert_silent(&context());
}

/// Turning, moving and replacing a luminaire gives the picture of a cold start.
#[test]
fn edits_equal_a_cold_start() {
    let quality = Quality { entry_points: 20_000, cache_points: 200, ..Quality::PAPER };
    let mut renderer = render(room(), quality.clone());
    let mut after = room();
    after.lights[0] = turned(after.lights[0].clone(), Vec3::new(0.6, -0.8, 0.0), -2.0);
    after.lights[0].kind = after.lights[0].kind.moved_to(Vec3::new(-0.3, 0.5, 0.2));
    renderer.set_light(0, after.lights[0].kind).unwrap();
    renderer.set_luminaire(0, after.lights[0].luminaire.clone()).unwrap();
    renderer.frame().unwrap();
    let bits = |renderer: &Renderer| {
        let pixels = renderer.layer(Layer::Beauty).unwrap();
        pixels.iter().flatten().map(|value| value.to_bits()).collect::<Vec<_>>()
    };
    let edited = bits(&renderer);
    let cold = render(after, quality.clone());
    assert!(edited == bits(&cold));
    // Without the file's intensities the spot is even.
    renderer.set_luminaire(0, None).unwrap();
    renderer.frame().unwrap();
    assert!(edited != bits(&renderer));
    assert_silent(&context());
}
