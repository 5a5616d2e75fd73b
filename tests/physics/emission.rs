//! Surfaces that emit and the sky: against closed forms, against area lights and against path and
//! photon tracing.

use crate::common::{assert_silent, context};
use crate::{SMALL, assert_close, render};
use glam::{Vec2, Vec3};
use lightpaths::reference::{PathTracer, PhotonMapper, Picture, Progressive};
use lightpaths::renderer::{Layer, Renderer, Silent};
use lightpaths::scene::emission::Sky;
use lightpaths::scene::environment::Environment;
use lightpaths::scene::material::Sides;
use lightpaths::scene::{Emission, Light, LightKind, Material, Quality, Scene, Triangle, shapes};
use std::f64::consts::PI;
use std::sync::Arc;

/// Directional lights of a sky.
const SKY_SAMPLES: u32 = 64;

/// The scene with this surface as an emitter.
fn with_emitter(mut scene: Scene, surface: &[[Vec3; 3]], radiance: Vec3, sides: Sides) -> Scene {
    let material = scene.materials.len() as u32;
    scene.materials.push(Material {
        name: "emitter".to_owned(),
        diffuse: Vec3::splat(0.3),
        emission: radiance,
        emitting_sides: Some(sides),
        ..scene.materials[0].clone()
    });
    scene.triangles.extend(surface.iter().map(|&positions| {
        let [p0, p1, p2] = positions;
        Triangle { positions, normals: [(p1 - p0).cross(p2 - p0).normalize(); 3], material, object: 0 }
    }));
    with_lights(scene, None)
}

/// The scene with its emitters and a sky as its only lights.
fn with_lights(mut scene: Scene, sky: Option<(Arc<Environment>, Vec3, f32)>) -> Scene {
    let placing = sky.as_ref().map(|&(_, radiance, turn)| (radiance, turn));
    let sky = sky.map(|(environment, ..)| Sky::new(environment, SKY_SAMPLES));
    let emission = Emission::new(&scene.triangles, &scene.materials, sky);
    scene.lights = emission.lights(&scene.materials, placing, &[]);
    scene.emission = Arc::new(emission);
    scene
}

/// A quad as two triangles whose front faces `u × v`.
fn quad(corner: Vec3, u: Vec3, v: Vec3) -> [[Vec3; 3]; 2] {
    let [p0, p1, p2, p3] = [corner, corner + u, corner + u + v, corner + v];
    [[p0, p1, p2], [p0, p2, p3]]
}

/// A ball of 320 triangles.
fn ball(centre: Vec3, radius: f32) -> Vec<[Vec3; 3]> {
    let sphere = shapes::integrating_sphere(radius, 2, 0.5, Vec3::ZERO, 1.0);
    // That one is seen from inside.
    sphere.triangles.iter().map(|t| t.positions.map(|p| centre + p)).map(|[a, b, c]| [a, c, b]).collect()
}

fn room(albedo: f32) -> Scene {
    let mut scene = shapes::hidden_light(0.01, 0.9, albedo);
    // Without the screen: the last two triangles.
    scene.triangles.truncate(12);
    scene.cameras[0].size = [48, 48];
    scene
}

fn trace(scene: Scene, samples: u32) -> Picture {
    let mut tracer = PathTracer::new(&context(), scene, &mut Silent).unwrap();
    tracer.add_samples(samples).unwrap();
    tracer.picture().unwrap()
}

fn photons(scene: Scene, samples: u32) -> Picture {
    let mut mapper = PhotonMapper::new(&context(), scene, &mut Silent).unwrap();
    mapper.add_samples(samples).unwrap();
    mapper.picture().unwrap()
}

/// Mean of a layer, first channel.
fn mean(pixels: &[[f32; 3]]) -> f64 {
    pixels.iter().map(|pixel| f64::from(pixel[0])).sum::<f64>() / pixels.len() as f64
}

#[test]
fn a_quad_emits_as_an_area_light_does_and_is_seen() {
    let (corner, u, v) = (Vec3::new(-0.9, -0.2, -0.3), Vec3::Y * 0.4, Vec3::Z * 0.6);
    let radiance = Vec3::new(8.0, 4.0, 2.0);
    let mut area = room(0.5);
    let kind = LightKind::Area { corner, edge_u: u, edge_v: v, radiance, samples: 32 };
    area.lights = vec![Light::new("area", kind)];
    let quad = with_emitter(room(0.5), &quad(corner, u, v), radiance, Sides::Front);
    assert_eq!(quad.lights.len(), 1);
    let exact = trace(quad.clone(), 256);
    let [area, quad] = [area, quad].map(|scene| render(scene, SMALL));
    let direct = [&area, &quad].map(|renderer| renderer.layer(Layer::Direct).unwrap());
    assert_close("indirect light", mean(&quad.layer(Layer::Indirect).unwrap()), mean(&exact.indirect), 0.015);
    let is_seen = |pixel: &[f32; 3]| pixel[0] >= radiance.x;
    let (seen, lit): (Vec<_>, Vec<_>) =
        direct[0].iter().zip(&direct[1]).partition(|(_, pixel)| is_seen(pixel));
    let sum =
        |of: fn(&(&[f32; 3], &[f32; 3])) -> f32| lit.iter().map(|pair| f64::from(of(pair))).sum::<f64>();
    // The quad hides a little of the wall behind it.
    assert_close("direct light", sum(|pair| pair.1[0]), sum(|pair| pair.0[0]), 2e-3);
    assert!(seen.len() > 10, "{} pixels show the emitter", seen.len());
    assert_silent(&context());
}

#[test]
fn emitting_meshes_light_a_room_as_the_path_tracer_says() {
    let triangle = vec![[Vec3::new(-0.4, 0.8, -0.3), Vec3::new(0.5, 0.8, -0.3), Vec3::new(0.0, 0.7, 0.4)]];
    let ball = ball(Vec3::new(-0.3, 0.2, 0.1), 0.15);
    for (what, surface) in [("two-sided triangle", triangle), ("ball of 320 triangles", ball)] {
        let scene = with_emitter(room(0.5), &surface, Vec3::splat(6.0), Sides::Both);
        let quality = Quality { edge_samples: 16, ..Quality { cache_points: 2000, ..SMALL } };
        let exact = trace(scene.clone(), 256);
        let renderer = render(scene.clone(), quality);
        let photons = photons(scene, 32);
        let found = [Layer::Direct, Layer::Indirect].map(|layer| mean(&renderer.layer(layer).unwrap()));
        for (layer, found, exact, photons) in [
            ("direct", found[0], mean(&exact.direct), mean(&photons.direct)),
            ("indirect", found[1], mean(&exact.indirect), mean(&photons.indirect)),
        ] {
            println!("{what}, {layer}: {found:.5}, path tracing {exact:.5}, photons {photons:.5}");
            assert_close(&format!("{what}, {layer}, photons"), photons, exact, 0.02);
            assert_close(&format!("{what}, {layer}"), found, exact, 0.015);
        }
    }
    assert_silent(&context());
}

/// A convex body in a sky of radiance 1 reflects its albedo, and its surroundings are the sky.
#[test]
fn a_ball_in_a_constant_sky_shows_its_albedo() {
    for albedo in [0.0, 0.5, 0.99] {
        let mut scene = shapes::hidden_light(0.01, 0.9, albedo);
        scene.triangles = ball(Vec3::ZERO, 0.8)
            .into_iter()
            .map(|positions| {
                // The outer one of the two orders of corners.
                let [p0, p1, p2] = positions;
                Triangle {
                    positions,
                    normals: [(p1 - p0).cross(p2 - p0).normalize(); 3],
                    material: 0,
                    object: 0,
                }
            })
            .collect();
        scene.cameras[0].position = Vec3::new(0.3, 0.4, 3.0);
        scene.cameras[0].size = [48, 48];
        let scene = with_lights(scene, Some((Environment::constant(), Vec3::splat(2.0), 0.3)));
        let renderer = render(scene.clone(), SMALL);
        let found = renderer.layer(Layer::Beauty).unwrap();
        let exact = trace(scene.clone(), 512).beauty;
        let photons = photons(scene, 64).beauty;
        let expected = |value: f32| if value > 1.999 { 2.0 } else { 2.0 * f64::from(albedo) };
        for pixel in &found {
            let expected = expected(pixel[0]);
            let error = (f64::from(pixel[0]) - expected).abs();
            assert!(error <= 1e-3 * expected + 1e-6, "{pixel:?} at albedo {albedo}");
        }
        let covered = found.iter().filter(|pixel| pixel[0] < 1.999).count();
        assert!((200..2000).contains(&covered), "{covered} pixels of the ball");
        for (what, image) in [("path tracing", exact), ("photons", photons)] {
            assert_close(&format!("{what} at albedo {albedo}"), mean(&image), mean(&found), 0.02);
        }
    }
    assert_silent(&context());
}

/// A floor and a wall under a sky with a bright side.
#[test]
fn a_sky_of_several_colours_lights_as_the_path_tracer_says() {
    let size = [64, 32];
    let texels = (0..64 * 32).map(|index| {
        let place = Vec2::new((index % 64) as f32 / 64.0, (index / 64) as f32 / 32.0);
        let bright = (-40.0 * place.distance_squared(Vec2::new(0.7, 0.3))).exp();
        Vec3::new(0.2 + 6.0 * bright, 0.3 + 4.0 * bright, 0.6 + bright)
    });
    let sky = Arc::new(Environment { size, texels: texels.collect() });
    let mut scene = room(0.5);
    // Its floor and the wall at -x.
    let is_all =
        |triangle: &Triangle, low: fn(Vec3) -> f32| triangle.positions.iter().all(|point| low(*point) < -0.9);
    scene.triangles.retain(|triangle| is_all(triangle, |point| point.y) || is_all(triangle, |point| point.x));
    assert_eq!(scene.triangles.len(), 4);
    let scene = with_lights(scene, Some((sky, Vec3::ONE, 0.8)));
    assert_eq!(scene.lights.len(), 3, "one for each channel");
    let exact = trace(scene.clone(), 256);
    let quality = Quality { edge_samples: 16, ..Quality { cache_points: 2000, ..SMALL } };
    let renderer = render(scene, quality);
    for (layer, exact) in [(Layer::Direct, &exact.direct), (Layer::Indirect, &exact.indirect)] {
        let found = renderer.layer(layer).unwrap();
        println!("{layer:?}: {:.5} {:.5}", mean(&found), mean(exact));
        assert_close(&format!("{layer:?}"), mean(&found), mean(exact), 0.005);
        let blue = |pixels: &[[f32; 3]]| pixels.iter().map(|pixel| f64::from(pixel[2])).sum::<f64>();
        assert_close(&format!("{layer:?}, blue"), blue(&found), blue(exact), 0.02);
    }
    assert_silent(&context());
}

/// Edits have the bits of a cold start; a new colour traces nothing.
#[test]
fn emission_is_edited_live() {
    let surface = quad(Vec3::new(-0.9, -0.2, -0.3), Vec3::Y * 0.4, Vec3::Z * 0.6);
    let mut open = room(0.5);
    // Without the ceiling.
    open.triangles.retain(|triangle| triangle.positions.iter().any(|point| point.y < 0.9));
    let scene = |radiance: Vec3, turn: f32| {
        let mut scene = with_emitter(open.clone(), &surface, Vec3::ONE, Sides::Both);
        scene = with_lights(scene, Some((Environment::constant(), 0.1 * radiance, turn)));
        scene.lights[0].kind = scene.lights[0].kind.with_emission(radiance);
        scene
    };
    let colour = Vec3::new(5.0, 3.0, 1.0);
    let start = Scene { quality: SMALL, ..scene(Vec3::ONE, 0.0) };
    let mut edited = Renderer::new(&context(), start, &mut Silent).unwrap();
    edited.frame().unwrap();
    edited.set_light(0, edited.scene().lights[0].kind.with_emission(colour)).unwrap();
    let report = edited.frame().unwrap();
    assert!(report.passes.iter().all(|pass| pass.name != "direct"), "a colour traces nothing");
    let shown = edited.layer(Layer::Beauty).unwrap().iter().map(|pixel| pixel[0]).fold(0.0, f32::max);
    assert!(shown > 0.9 * colour.x, "the emitter shows its new colour: {shown}");
    let LightKind::Sky { channel, .. } = edited.scene().lights[1].kind else { panic!("the sky is a light") };
    edited.set_light(1, LightKind::Sky { radiance: 0.1 * colour, turn: 0.5, channel }).unwrap();
    edited.frame().unwrap();
    let cold = render(scene(colour, 0.5), SMALL);
    let bits = |renderer: &Renderer| {
        let pixels = renderer.layer(Layer::Beauty).unwrap();
        pixels.iter().flatten().map(|value| value.to_bits()).collect::<Vec<_>>()
    };
    assert_eq!(bits(&edited), bits(&cold));
    // A colour of the sky alone, and a switch.
    let sky = edited.scene().lights[1].kind;
    for (factor, is_on) in [(0.0, false), (2.0, true), (1.0, true)] {
        edited.set_light(1, sky.with_emission(factor * sky.emission())).unwrap();
        edited.switch_light(1, is_on).unwrap();
        let report = edited.frame().unwrap();
        assert!(report.passes.iter().all(|pass| pass.name != "form_factors"), "a colour traces nothing");
        let mut scene = scene(colour, 0.5);
        scene.lights[1].kind = edited.scene().lights[1].kind;
        scene.lights[1].is_on = is_on;
        assert!(bits(&edited) == bits(&render(scene, SMALL)), "{factor} {is_on}");
    }
    // Switched off, the emitter is black.
    let brightest = |renderer: &Renderer| {
        renderer.layer(Layer::Beauty).unwrap().iter().flatten().copied().fold(0.0, f32::max)
    };
    let before = brightest(&edited);
    edited.switch_light(0, false).unwrap();
    edited.switch_light(1, false).unwrap();
    edited.frame().unwrap();
    assert!(f64::from(brightest(&edited)) < 0.1 * f64::from(before) * PI, "{before}");
    assert_silent(&context());
}
