//! Images on walls: all methods against a closed form, and light paths against the path tracer
//! where borders of an image must stay sharp.

use crate::common::{assert_silent, context};
use crate::path_tracer::trace;
use crate::{SMALL, assert_close, render};
use glam::{DVec3, Vec2, Vec3};
use lightpaths::cpu::textures::Textures;
use lightpaths::metrics;
use lightpaths::reference::{PhotonMapper, Progressive};
use lightpaths::renderer::{Layer, Renderer, Silent};
use lightpaths::scene::{Image, Quality, Scene, Texture, Triangle, shapes};
use lightpaths::types::Record;
use std::sync::Arc;

fn image(size: [u32; 2], codes: Vec<[u8; 3]>) -> Option<Texture> {
    Some(Texture { image: Arc::new(Image { size, codes }), is_clamped: false, is_atlas: false })
}

const TINT: Vec3 = Vec3::new(0.9, 0.8, 0.95);

/// A sphere lit from its centre. Its wall is a patchwork of eight colours.
fn patchwork() -> Scene {
    let mut scene = shapes::integrating_sphere(1.5, 3, 0.5, Vec3::ZERO, 10.0);
    let code =
        |texel: u32| [0, 1, 2].map(|channel| 60 + 65 * (texel >> channel & 1) as u8 + 20 * channel as u8);
    scene.materials[0].texture = image([8, 1], (0..8).map(code).collect());
    scene.materials[0].diffuse = TINT;
    let corners = |index: usize| {
        let first = Vec2::new(index as f32 * 0.618_034, 0.0);
        [first, first + Vec2::new(0.4, 0.0), first + Vec2::new(0.1, 1.0)]
    };
    scene.texture_coordinates = (0..scene.triangles.len()).map(corners).collect();
    scene
}

/// Mean albedo by area, which uniform light in a sphere depends on.
fn mean_albedo(scene: &Scene) -> DVec3 {
    const STEPS: usize = 16;
    let textures = Textures { materials: &scene.materials, coordinates: &scene.texture_coordinates };
    let of_triangle = |(index, triangle): (usize, &Triangle)| {
        // The centres of small triangles that point up, and of small triangles that point down.
        let mut sum = DVec3::ZERO;
        for i in 0..STEPS {
            for j in 0..STEPS - i {
                let corner = DVec3::new(i as f64, j as f64, (STEPS - 1 - i - j) as f64) + 1.0 / 3.0;
                sum += textures.colour(0, index as u32, corner / STEPS as f64);
                if i + j + 1 < STEPS {
                    let corner = DVec3::new(i as f64, j as f64, (STEPS - 2 - i - j) as f64) + 2.0 / 3.0;
                    sum += textures.colour(0, index as u32, corner / STEPS as f64);
                }
            }
        }
        triangle.area_m2() * sum / (STEPS * STEPS) as f64
    };
    let sum: DVec3 = scene.triangles.iter().enumerate().map(of_triangle).sum();
    scene.materials[0].diffuse.as_dvec3() * sum / scene.area_m2()
}

fn sum(layer: &[[f32; 3]]) -> DVec3 {
    layer.iter().map(|pixel| DVec3::from(pixel.map(f64::from))).sum()
}

/// Asserts that a layer has the reference's energy within 1 %, and a relMSE within a bound.
#[track_caller]
fn assert_layer(renderer: &Renderer, layer: Layer, expected: &[[f32; 3]], bound: f64) {
    let found = renderer.layer(layer).unwrap();
    let ratio = sum(&found) / sum(expected);
    let relmse = metrics::relmse(&found, expected);
    println!("{layer:?}: energy {ratio}, relMSE {relmse:.2e} of {bound:.2e}");
    for channel in 0..3 {
        assert_close(&format!("{layer:?}"), ratio[channel], 1.0, 0.01);
    }
    assert!(relmse <= bound, "{layer:?}: {relmse:.2e}");
}

/// Compares the ratio of indirect to direct light with ρ/(1−ρ) for the mean albedo ρ,
/// in every pixel.
#[track_caller]
fn check_ratio(what: &str, layers: [&[[f32; 3]]; 2], albedo: DVec3, tolerance: f64) {
    let [direct, indirect] = layers.map(sum);
    let expected = albedo / (1.0 - albedo);
    println!("{what}: {} of {expected}, {}", indirect / direct, indirect / direct / expected - 1.0);
    for channel in 0..3 {
        assert_close(what, indirect[channel] / direct[channel], expected[channel], tolerance);
    }
}

#[test]
fn a_sphere_of_many_colours_reflects_by_their_mean() {
    let scene = patchwork();
    let albedo = mean_albedo(&scene);
    assert!(albedo.max_element() < 0.6 && albedo.max_element() > albedo.min_element() + 0.05, "{albedo}");
    let tracer = trace(scene.clone(), [32, 32], 128);
    let picture = tracer.picture().unwrap();
    check_ratio("path tracer", [&picture.direct, &picture.indirect], albedo, 0.01);

    let mut small = scene.clone();
    small.cameras[0].size = [32, 32];
    let mut mapper = PhotonMapper::new(&context(), small.clone(), &mut Silent).unwrap();
    mapper.add_samples(32).unwrap();
    let picture = mapper.picture().unwrap();
    check_ratio("photon mapper", [&picture.direct, &picture.indirect], albedo, 0.01);

    // A gather ray sees one texel. With this number of rays, their noise does not matter.
    let mut renderer = render(small, Quality { gather_rays: 256, ..SMALL });
    let layers =
        |renderer: &Renderer| [Layer::Direct, Layer::Indirect].map(|layer| renderer.layer(layer).unwrap());
    let [direct, indirect] = layers(&renderer);
    check_ratio("pixels", [&direct, &indirect], albedo, 0.01);
    let records: Vec<Record> = renderer.stages().records.read().unwrap();
    let sum: Vec3 = records.iter().map(|record| record.irradiance).sum();
    let mean = renderer.stages().emission_scale * sum / records.len() as f32;
    for channel in 0..3 {
        let expected = 10.0 / scene.area_m2() * albedo[channel] / (1.0 - albedo[channel]);
        assert_close("records", mean[channel].into(), expected, 0.005);
    }

    // The material's albedo is a separate factor: half of it is half the total albedo,
    // without new paths.
    renderer.set_diffuse(0, 0.5 * TINT).unwrap();
    renderer.frame().unwrap();
    let [darker, indirect] = layers(&renderer);
    check_ratio("half the tint", [&darker, &indirect], 0.5 * albedo, 0.01);
    assert!(direct.as_flattened().iter().zip(darker.as_flattened()).all(|(a, b)| 0.5 * a == *b));
    assert_silent(&context());
}

/// A room whose floor is a chequerboard and whose walls are striped.
fn room() -> Scene {
    let mut scene = shapes::closed_box(Vec3::new(2.0, 1.5, 1.6), 0.8);
    let (dark, light, red) = ([40, 50, 60], [230, 220, 200], [200, 40, 30]);
    let board = |i: u32| if (i % 32 / 8 + i / 256).is_multiple_of(2) { dark } else { light };
    let stripes = |i: u32| if i % 16 < 8 { red } else { light };
    let mut floor = scene.materials[0].clone();
    floor.texture = image([32, 32], (0..32 * 32).map(board).collect());
    let mut wall = scene.materials[0].clone();
    wall.texture = image([16, 1], (0..16).map(stripes).collect());
    scene.materials.extend([floor, wall]);
    let place = |triangle: &Triangle| {
        // Coordinates of the floor's own plane; on walls, the position along the wall.
        triangle.positions.map(|p| match triangle.geometric_normal() {
            normal if normal.y.abs() > 0.5 => Vec2::new(p.x, p.z) + 0.1,
            _ => Vec2::new(1.3 * (p.x + p.z), p.y),
        })
    };
    scene.texture_coordinates = scene.triangles.iter().map(place).collect();
    for triangle in &mut scene.triangles {
        let normal = triangle.geometric_normal();
        triangle.material = if normal.y > 0.5 { 1 } else { 2 * u32::from(normal.y.abs() < 0.5) };
    }
    scene.cameras[0].target = Vec3::new(-0.2, -0.4, -0.3);
    scene
}

#[test]
fn a_room_with_images_equals_the_path_tracer() {
    let mut scene = room();
    let size = [64, 48];
    let tracer = trace(scene.clone(), size, 256);
    let expected = tracer.picture().unwrap();
    let noise = tracer.noise().unwrap().unwrap();
    scene.cameras[0].size = size;
    let quality = Quality { preset: "test", entry_points: 200_000, cache_points: 2_000, ..Quality::DRAFT };
    let mut renderer = render(scene, quality);
    // A misplaced border of an image is a whole pixel between dark and light.
    for (layer, expected, bound) in [
        (Layer::Beauty, &expected.beauty, noise + 1e-3),
        (Layer::Direct, &expected.direct, 5e-4),
        (Layer::Indirect, &expected.indirect, noise + 2.5e-3),
    ] {
        assert_layer(&renderer, layer, expected, bound);
    }
    // Colours depend on the camera, and the samples of edge pixels on the light. After a change and
    // its reverse, the picture is the same.
    let first = renderer.layer(Layer::Beauty).unwrap();
    let view = renderer.scene().cameras[0].clone();
    renderer.move_camera(Vec3::new(0.3, 0.2, 0.4), Vec3::ZERO);
    renderer.frame().unwrap();
    assert!(renderer.layer(Layer::Beauty).unwrap() != first);
    renderer.move_camera(view.position, view.target);
    renderer.frame().unwrap();
    assert!(renderer.layer(Layer::Beauty).unwrap() == first, "the camera");
    for light in [Vec3::new(0.3, 0.4, -0.2), Vec3::ZERO] {
        renderer.move_light(0, light).unwrap();
        renderer.frame().unwrap();
        assert_eq!(renderer.layer(Layer::Beauty).unwrap() == first, light == Vec3::ZERO, "{light}");
    }
    // Both methods average the image over the pixel.
    let [ours, theirs] =
        [renderer.layer(Layer::Albedo).unwrap(), tracer.traced_scene().first_hits().unwrap().albedo];
    assert!(ours == theirs);
    let greens: Vec<f32> = ours.iter().map(|pixel| pixel[1]).collect();
    let (low, high) = greens.iter().fold((1.0_f32, 0.0_f32), |(low, high), &g| (low.min(g), high.max(g)));
    assert!(low < 0.05 && high > 0.55, "{low} {high}");
    assert_silent(&context());
}

/// Images multiply diffuse reflection, and do not affect lobes: all light paths of a glossy room.
#[test]
fn a_glossy_room_with_images_equals_the_path_tracer() {
    let mut scene = room();
    for (material, exponent) in scene.materials.iter_mut().zip([5.0, 60.0, 12.0]) {
        material.diffuse *= 0.7;
        (material.specular, material.exponent) = (Vec3::new(0.3, 0.25, 0.2), exponent);
    }
    // Paths of editable materials are sampled differently.
    scene.materials[2].editable = true;
    let size = [48, 36];
    let tracer = trace(scene.clone(), size, 256);
    let expected = tracer.picture().unwrap();
    let noise = tracer.noise().unwrap().unwrap();
    scene.cameras[0].size = size;
    let quality = Quality { preset: "test", entry_points: 100_000, cache_points: 2_000, ..Quality::DRAFT };
    let renderer = render(scene, quality);
    for (layer, expected, bound) in [
        (Layer::Beauty, &expected.beauty, noise + 2.5e-3),
        (Layer::Direct, &expected.direct, 5e-4),
        (Layer::Indirect, &expected.indirect, noise + 5e-3),
    ] {
        assert_layer(&renderer, layer, expected, bound);
    }
    assert_silent(&context());
}
