//! Panes: what they let pass, in frames and by path and photon tracing.

use crate::common::{assert_silent, context};
use crate::{SMALL, assert_close, render};
use glam::Vec3;
use lightpaths::reference::{PathTracer, PhotonMapper, Picture, Progressive};
use lightpaths::renderer::{Layer, Renderer, Silent};
use lightpaths::scene::emission::Sky;
use lightpaths::scene::environment::Environment;
use lightpaths::scene::{Emission, Light, LightKind, Pane, Quality, Scene, shapes};
use std::sync::Arc;

fn quad(corner: Vec3, u: Vec3, v: Vec3, colour: Vec3) -> [Pane; 2] {
    let [p0, p1, p2, p3] = [corner, corner + u, corner + u + v, corner + v];
    [[p0, p1, p2], [p0, p2, p3]].map(|positions| Pane { positions, colour })
}

fn room() -> Scene {
    let mut scene = shapes::closed_box(Vec3::splat(2.0), 0.5);
    scene.cameras[0].size = [48, 48];
    scene
}

fn references(scene: &Scene, samples: u32) -> [(&'static str, Picture); 2] {
    let context = context();
    let mut tracer = PathTracer::new(&context, scene.clone(), &mut Silent).unwrap();
    tracer.add_samples(samples).unwrap();
    let mut mapper = PhotonMapper::new(&context, scene.clone(), &mut Silent).unwrap();
    mapper.add_samples(samples / 4).unwrap();
    [("paths", tracer.picture().unwrap()), ("photons", mapper.picture().unwrap())]
}

fn mean(pixels: &[[f32; 3]], channel: usize) -> f64 {
    pixels.iter().map(|pixel| f64::from(pixel[channel])).sum::<f64>() / pixels.len() as f64
}

/// Two panes right before the camera dim the whole picture by both of their colours.
#[test]
fn panes_before_the_camera_multiply() {
    let quality = Quality { entry_points: 0, cache_points: 0, ..SMALL };
    let plain = render(room(), quality.clone()).layer(Layer::Direct).unwrap();
    let mut scene = room();
    let eye = scene.cameras[0].position;
    let colours = [Vec3::new(0.8, 0.5, 0.25), Vec3::splat(0.6)];
    for (colour, distance) in colours.into_iter().zip([1e-3, 2e-3]) {
        let corner = eye + Vec3::new(-4e-3, -4e-3, -distance);
        scene.panes.extend(quad(corner, Vec3::X * 8e-3, Vec3::Y * 8e-3, colour));
    }
    let colour = colours[0] * colours[1];
    let dimmed = render(scene, quality).layer(Layer::Direct).unwrap();
    // Few points are in the shadow of panes that small.
    let differs = |(plain, dimmed): (&[f32; 3], &[f32; 3])| {
        (0..3).any(|channel| {
            (dimmed[channel] / plain[channel].max(1e-9) - colour[channel]).abs() > 2e-3 * colour[channel]
        })
    };
    let differing = plain.iter().zip(&dimmed).filter(|&pair| differs(pair)).count();
    assert!(differing * 50 <= plain.len(), "{differing} of {}", plain.len());
    assert_silent(&context());
}

/// A level pane between the light and the floor: shadows let a third of the light pass.
#[test]
fn a_pane_in_a_room_is_as_the_path_tracer_says() {
    let mut scene = room();
    let LightKind::Point { position, .. } = &mut scene.lights[0].kind else { panic!("a point light") };
    *position = Vec3::new(0.1, 0.6, 0.0);
    scene.panes.extend(quad(
        Vec3::new(-0.99, -0.2, -0.99),
        Vec3::X * 1.4,
        Vec3::Z * 1.98,
        Vec3::splat(1.0 / 3.0),
    ));
    let found = render(scene.clone(), Quality { cache_points: 2000, ..SMALL });
    for (what, picture) in references(&scene, 256) {
        for (layer, exact) in [(Layer::Direct, &picture.direct), (Layer::Indirect, &picture.indirect)] {
            let found = mean(&found.layer(layer).unwrap(), 0);
            println!("{what}, {layer:?}: {found:.5} {:.5}", mean(exact, 0));
            assert_close(&format!("{what}, {layer:?}"), found, mean(exact, 0), 0.01);
        }
    }
    assert_silent(&context());
}

/// A stained window before a lamp and the sky: every colour passes by its own fraction.
#[test]
fn a_stained_window_colours_lamp_and_sky() {
    let mut scene = room();
    scene.triangles.retain(|triangle| !triangle.positions.iter().all(|point| point.x > 0.99));
    let colour = Vec3::new(0.9, 0.5, 0.2);
    scene.panes.extend(quad(Vec3::new(1.0, -1.0, -1.0), Vec3::Y * 2.0, Vec3::Z * 2.0, colour));
    let sky = Some(Sky::new(Environment::constant(), 64));
    let emission = Emission::new(&scene.triangles, &scene.materials, sky);
    let kind = LightKind::Sky { radiance: Vec3::splat(0.3), turn: 0.0, channel: None };
    scene.lights[0].kind = LightKind::Point { position: Vec3::new(1.5, 0.3, 0.2), intensity: Vec3::ONE };
    scene.lights.push(Light::new("sky", kind));
    scene.emission = Arc::new(emission);
    let quality = Quality { cache_points: 2000, gather_rays: 256, ..SMALL };
    let renderer = render(scene.clone(), quality);
    let found = renderer.layer(Layer::Beauty).unwrap();
    for (what, picture) in references(&scene, 512) {
        for channel in 0..3 {
            let [found, exact] = [&found, &picture.beauty].map(|pixels| mean(pixels, channel));
            println!("{what}, channel {channel}: {found:.5} {exact:.5}");
            assert_close(&format!("{what}, channel {channel}"), found, exact, 0.015);
        }
    }
    assert_silent(&context());
}

/// An edit through coloured panes has the bits of a cold start.
#[test]
fn lights_behind_coloured_panes_are_edited_live() {
    let scene = |position: Vec3, intensity: Vec3| {
        let mut scene = room();
        scene.lights[0].kind = LightKind::Point { position, intensity };
        let corner = Vec3::new(-0.99, 0.1, -0.99);
        scene.panes.extend(quad(corner, Vec3::X * 1.4, Vec3::Z * 1.98, Vec3::new(0.2, 0.5, 0.9)));
        scene
    };
    let (start, end) = (Vec3::new(0.3, 0.7, 0.0), Vec3::new(-0.2, 0.6, 0.4));
    let mut edited = render(scene(start, Vec3::ONE), SMALL);
    let colour = Vec3::new(1.0, 0.5, 0.25);
    edited.set_light(0, LightKind::Point { position: end, intensity: colour }).unwrap();
    let lamp = edited.scene().lights[0].clone();
    edited.frame().unwrap();
    edited.add_light(lamp.clone()).unwrap();
    edited.frame().unwrap();
    edited.remove_light(1).unwrap();
    edited.frame().unwrap();
    let cold = render(scene(end, colour), SMALL);
    let bits = |renderer: &Renderer| {
        let pixels = renderer.layer(Layer::Beauty).unwrap();
        pixels.iter().flatten().map(|value| value.to_bits()).collect::<Vec<_>>()
    };
    assert_eq!(bits(&edited), bits(&cold));
    assert_silent(&context());
}
