//! The path tracer against closed forms: one bounce, all bounces, and every kind of light.

use crate::common::{assert_silent, context};
use crate::{assert_close, plates};
use glam::{DVec2, DVec3, Vec3};
use lightpaths::cpu::brdf::brdf;
use lightpaths::reference::{PathTracer, Picture, Progressive, TracedScene};
use lightpaths::renderer::Silent;
use lightpaths::scene::{LightKind, Material, Scene, Triangle, shapes};
use lightpaths::types::Reflectance;
use std::f64::consts::PI;
use std::time::{Duration, Instant};

pub(crate) fn trace(mut scene: Scene, size: [u32; 2], samples: u32) -> PathTracer {
    scene.cameras[0].size = size;
    let mut tracer = PathTracer::new(&context(), scene, &mut Silent).unwrap();
    tracer.add_samples(samples).unwrap();
    tracer
}

/// Hit of each pixel's central ray, from its depth. `None` if the ray left the scene.
pub(crate) fn positions(scene: &TracedScene) -> Vec<Option<DVec3>> {
    let view = &scene.view;
    let [right, up, forward] = [view.right, view.up, view.forward].map(Vec3::as_dvec3);
    let [width, height] = scene.size().map(f64::from);
    let depths = scene.first_hits().unwrap().depth;
    let position = |(index, depth): (u32, &[f32; 3])| {
        let x = 2.0 * (f64::from(index % view.width) + 0.5) / width - 1.0;
        let y = 2.0 * (f64::from(index / view.width) + 0.5) / height - 1.0;
        let depth = f64::from(depth[0]);
        depth.is_finite().then(|| view.position.as_dvec3() + depth * (forward + x * right - y * up))
    };
    (0..).zip(&depths).map(position).collect()
}

/// A unit square of albedo 1/2 that fills the image, seen from above under one light.
pub(crate) fn square(kind: LightKind) -> Scene {
    let mut scene = shapes::facing_squares(1.0, 0.0, 0.5);
    scene.triangles.truncate(2);
    let camera = &mut scene.cameras[0];
    (camera.position, camera.up, camera.fov_y_degrees) = (Vec3::Y, Vec3::NEG_Z, 50.0);
    scene.lights[0].kind = kind;
    scene
}

/// Compares the direct light of all pixels of [`square`] with an irradiance. `tolerance` is
/// relative to the largest value.
fn check_direct(kind: LightKind, samples: u32, tolerance: f64, irradiance: impl Fn(DVec3) -> f64) {
    let tracer = trace(square(kind), [32, 32], samples);
    compare_direct(kind, &tracer.picture().unwrap(), tracer.traced_scene(), tolerance, irradiance);
}

/// The same for a picture of 32×32 pixels of any method.
pub(crate) fn compare_direct(
    kind: LightKind,
    picture: &Picture,
    scene: &TracedScene,
    tolerance: f64,
    irradiance: impl Fn(DVec3) -> f64,
) {
    let positions = positions(scene);
    // The mean over the pixel: image x runs along x, image y along z, and the plane is
    // a metre away.
    let pixel = 2.0 * 25.0_f64.to_radians().tan() / 32.0;
    let inside = |i: u32| pixel * (f64::from(i) - 3.5) / 8.0;
    let mean = |at: DVec3| {
        let points = (0..64).map(|i| at + DVec3::new(inside(i % 8), 0.0, inside(i / 8)));
        points.map(&irradiance).sum::<f64>() / 64.0
    };
    let expected: Vec<f64> = positions.iter().map(|position| mean(position.unwrap())).collect();
    let largest = expected.iter().copied().fold(0.0, f64::max);
    for (index, expected) in expected.iter().enumerate() {
        let value = f64::from(picture.direct[index][0]) * PI / 0.5;
        let error = (value - expected).abs();
        assert!(
            error <= tolerance * largest,
            "{kind:?}: {value} instead of {expected} W/m² at {:?}",
            positions[index]
        );
    }
    assert!(picture.indirect.iter().all(|pixel| *pixel == [0.0; 3]), "a plane does not light itself");
    assert_silent(&context());
}

#[test]
fn point_light_follows_inverse_square_and_cosine() {
    for position in [[0.0, 1.0, 0.0], [0.3, 0.6, -0.1], [-3.0, 1.0, 4.0]] {
        let position = Vec3::from(position);
        check_direct(LightKind::Point { position, intensity: Vec3::ONE }, 16, 2e-3, |x| {
            let to_light = position.as_dvec3() - x;
            to_light.y / to_light.length().powi(3)
        });
    }
    let position = Vec3::NEG_Y;
    check_direct(LightKind::Point { position, intensity: Vec3::ONE }, 4, 0.0, |_| 0.0);
}

#[test]
fn spot_light_falls_linearly_in_the_angle() {
    let (position, direction) = (Vec3::new(0.1, 0.8, 0.05), Vec3::new(0.0, -1.0, 0.0));
    let [angle, penumbra] = [0.5, 0.6];
    let kind = LightKind::Spot { position, direction, intensity: Vec3::splat(2.0), angle, penumbra };
    check_direct(kind, 64, 4e-3, |x| {
        let to_light = position.as_dvec3() - x;
        let off_axis = (to_light.y / to_light.length()).acos();
        let [inner, outer] = [f64::from(angle * (1.0 - penumbra)), f64::from(angle)];
        2.0 * ((outer - off_axis) / (outer - inner)).clamp(0.0, 1.0) * to_light.y / to_light.length().powi(3)
    });
}

#[test]
fn directional_light_follows_the_cosine() {
    let direction = Vec3::new(0.6, -0.64, 0.48);
    check_direct(LightKind::Directional { direction, irradiance: Vec3::splat(3.0) }, 4, 1e-6, |_| 3.0 * 0.64);
    let direction = -direction;
    check_direct(LightKind::Directional { direction, irradiance: Vec3::splat(3.0) }, 4, 0.0, |_| 0.0);
}

/// Irradiance of an upward surface from a polygon of unit radiance above it: Lambert's sum
/// over its edges.
fn polygon_irradiance(at: DVec3, corners: &[DVec3]) -> f64 {
    let term = |i: usize| {
        let [a, b] = [i, (i + 1) % corners.len()].map(|i| (corners[i] - at).normalize());
        a.angle_between(b) * a.cross(b).normalize().y
    };
    0.5 * (0..corners.len()).map(term).sum::<f64>().abs()
}

#[test]
fn area_light_follows_the_polygon_formula_and_emits_on_one_side() {
    let (corner, edge_u, edge_v) =
        (Vec3::new(-0.3, 0.5, -0.2), Vec3::new(0.5, 0.1, 0.0), Vec3::new(0.1, 0.0, 0.4));
    let [c, u, v] = [corner, edge_u, edge_v].map(Vec3::as_dvec3);
    let corners = [c, c + u, c + u + v, c + v];
    let light =
        |edge_u, edge_v| LightKind::Area { corner, edge_u, edge_v, radiance: Vec3::splat(2.0), samples: 1 };
    check_direct(light(edge_u, edge_v), 256, 4e-3, |x| 2.0 * polygon_irradiance(x, &corners));
    // The back of the light is dark, and the camera looks through it.
    check_direct(light(edge_v, edge_u), 4, 0.0, |_| 0.0);
}

/// Mean of a channel over pixels, and its standard deviation from the variances of the pixels.
fn mean_and_noise(values: &[[f32; 3]], variance: &[[f32; 3]]) -> [f64; 2] {
    let count = values.len() as f64;
    let sum = |of: &[[f32; 3]]| of.iter().map(|pixel| f64::from(pixel[0])).sum::<f64>();
    [sum(values) / count, sum(variance).sqrt() / count]
}

/// Cases are albedo, pixels along an edge, samples of a pixel, and the tolerance of the mean.
fn check_sphere(cases: &[(f32, u32, u32, f64)]) {
    let (radius, flux) = (1.5, 10.0);
    for &(albedo, size, samples, tolerance) in cases {
        let light = Vec3::new(0.1, 0.05, -0.1);
        let scene = shapes::integrating_sphere(radius, 4, albedo, light, flux);
        let area = scene.area_m2();
        let tracer = trace(scene, [size; 2], samples);
        let picture = tracer.picture().unwrap();
        let [mean, noise] = mean_and_noise(&picture.indirect, &tracer.variance().unwrap());
        let albedo = f64::from(albedo);
        if albedo == 0.0 {
            assert_eq!(mean, 0.0);
            continue;
        }
        let expected = f64::from(flux) / area * albedo / (1.0 - albedo) * albedo / PI;
        println!(
            "albedo {albedo}: {mean:.5} of {expected:.5}, {:+.3} %, noise {:.3} %",
            100.0 * (mean / expected - 1.0),
            100.0 * noise / expected
        );
        assert!((mean - expected).abs() <= 4.0 * noise, "albedo {albedo}: {mean} ± {noise}, {expected}");
        assert_close(&format!("albedo {albedo}"), mean, expected, tolerance);
    }
    assert_silent(&context());
}

/// Estimated noise: 0.4 % at an albedo of one half, 0.8 % at 0.99. The bounds are 3 and
/// 2.5 times that.
#[test]
fn indirect_light_of_the_integrating_sphere() {
    check_sphere(&[(0.0, 8, 4, 0.0), (0.5, 32, 16, 0.012), (0.99, 16, 16, 0.02)]);
}

#[test]
#[ignore = "full size: make stress"]
fn indirect_light_of_the_integrating_sphere_by_more_samples() {
    check_sphere(&[(0.5, 32, 32, 5e-3), (0.9, 32, 32, 5e-3), (0.99, 16, 64, 5e-3)]);
}

#[test]
fn light_bounces_between_two_plates() {
    let tracer = trace(plates::scene(), [32, 32], 128);
    let picture = tracer.picture().unwrap();
    let (ratio, pixels) = plates::ratio(&positions(tracer.traced_scene()), &picture.indirect);
    assert!(pixels > 300, "{pixels}");
    assert_close("mean indirect light", ratio, 1.0, 5e-3);
    assert_silent(&context());
}

/// Form factor from a surface element to a rectangle perpendicular to its plane, at distance `a`,
/// of height `height`, from the foot of the perpendicular to `b` aside.
fn upright(a: f64, b: f64, height: f64) -> f64 {
    let slant = a.hypot(height);
    ((b / a).atan() - a / slant * (b / slant).atan()) / (2.0 * PI)
}

#[test]
fn a_wall_lights_the_floor_beside_it() {
    // The floor is in view; the sunlight runs along the floor, perpendicular to the wall at
    // z = -1/2.
    let irradiance = Vec3::ONE;
    let mut scene = square(LightKind::Directional { direction: Vec3::NEG_Z, irradiance });
    scene.materials.push(Material { diffuse: Vec3::splat(0.8), ..scene.materials[0].clone() });
    // In red, the floor is so dark that its light on the wall does not count: 0.01·0.8·0.2. The
    // green channel keeps the paths alive.
    scene.materials[0].diffuse = Vec3::new(0.01, 0.9, 0.0);
    let corners = [(-0.5, 0.0), (0.5, 0.0), (0.5, 1.0), (-0.5, 1.0)].map(|(x, y)| Vec3::new(x, y, -0.5));
    for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
        let positions = [corners[a], corners[b], corners[c]];
        scene.triangles.push(Triangle { positions, normals: [Vec3::Z; 3], material: 1, object: 0 });
    }
    scene.cameras[0].fov_y_degrees = 30.0;
    let tracer = trace(scene, [32, 32], 256);
    let picture = tracer.picture().unwrap();
    let (mut value, mut expected) = (0.0, 0.0);
    for (position, indirect) in positions(tracer.traced_scene()).iter().zip(&picture.indirect) {
        let position = position.unwrap();
        value += f64::from(indirect[0]);
        let [a, x] = [position.z + 0.5, position.x];
        expected += 0.01 / PI * 0.8 * (upright(a, 0.5 - x, 1.0) + upright(a, 0.5 + x, 1.0));
    }
    println!("{:+.3} %", 100.0 * (value / expected - 1.0));
    assert_close("mean indirect light", value, expected, 5e-3);
    assert_silent(&context());
}

/// In a sphere whose wall emits evenly, a small glossy mirror shows the wall's radiance
/// times its albedo.
#[test]
fn a_glossy_surface_in_even_light_shows_its_albedo() {
    let (radius, flux, wall) = (1.5, 10.0, 0.8);
    for (diffuse, specular, exponent, tilt) in
        [(0.0, 0.9, 40.0, 0.0), (0.3, 0.6, 5.0, 0.0), (0.0, 1.0, 10.0, 1.0_f64)]
    {
        let mut scene = shapes::integrating_sphere(radius, 4, wall, Vec3::ZERO, flux);
        let area = scene.area_m2();
        let [diffuse, specular] = [diffuse, specular].map(Vec3::splat);
        scene.materials.push(Material { diffuse, specular, exponent, ..scene.materials[0].clone() });
        let middle = Vec3::new(0.0, -0.6, 0.0);
        let corner = |x: f32, z: f32| middle + 0.01 * Vec3::new(x, 0.0, z);
        for positions in [
            [corner(-1.0, 1.0), corner(1.0, 1.0), corner(1.0, -1.0)],
            [corner(-1.0, 1.0), corner(1.0, -1.0), corner(-1.0, -1.0)],
        ] {
            scene.triangles.push(Triangle { positions, normals: [Vec3::Y; 3], material: 1, object: 0 });
        }
        let (sin, cos) = tilt.sin_cos();
        let outgoing = DVec3::new(sin, cos, 0.0);
        let camera = &mut scene.cameras[0];
        (camera.position, camera.target, camera.up) = (middle + 0.2 * outgoing.as_vec3(), middle, Vec3::Z);
        camera.fov_y_degrees = 1.5;
        let tracer = trace(scene, [16, 16], 256);
        let picture = tracer.picture().unwrap();
        let [mean, _] = mean_and_noise(&picture.indirect, &picture.indirect);
        let wall = f64::from(wall);
        let radiance = f64::from(flux) / area / (1.0 - wall) * wall / PI;
        let material = Reflectance { diffuse, exponent, specular, flags: 0 };
        let albedo = albedo(&material, outgoing);
        println!("tilt {tilt}, exponent {exponent}: {:.4} of albedo {albedo:.4}", mean / radiance);
        assert!(albedo <= 1.0 + 1e-3);
        if tilt == 0.0 {
            assert_close("albedo at normal incidence", albedo, f64::from(diffuse.x + specular.x), 1e-3);
        }
        assert_close("radiance", mean / radiance, albedo, 7e-3);
    }
    assert_silent(&context());
}

/// ∫ brdf·cosθ dω by the midpoint rule.
fn albedo(material: &Reflectance, outgoing: DVec3) -> f64 {
    let steps = 400;
    let mut sum = 0.0;
    for i in 0..steps {
        let height = (f64::from(i) + 0.5) / f64::from(steps);
        for j in 0..steps {
            let azimuth = 2.0 * PI * (f64::from(j) + 0.5) / f64::from(steps);
            let across = DVec2::from_angle(azimuth) * (1.0 - height * height).sqrt();
            sum += height * brdf(material, DVec3::Y, outgoing, DVec3::new(across.x, height, across.y)).x;
        }
    }
    2.0 * PI * sum / f64::from(steps * steps)
}

/// Between walls that absorb nothing, only the deadline ends paths. Every pixel has a
/// sample by then.
#[test]
fn a_deadline_ends_paths_that_never_end() {
    for albedo in [1.0, 0.5] {
        let mut scene = shapes::closed_box(Vec3::ONE, albedo);
        scene.cameras[0].size = [24, 17];
        let mut tracer = PathTracer::new(&context(), scene, &mut Silent).unwrap();
        tracer.set_deadline(Some(Instant::now()));
        tracer.add_samples(1 << 20).unwrap();
        assert_eq!(tracer.samples(), 1);
        let picture = tracer.picture().unwrap();
        let is_lit = |pixel: &[f32; 3]| pixel.iter().all(|value| value.is_finite() && *value > 0.0);
        assert!(picture.beauty.iter().all(is_lit), "{:?}", picture.beauty);
        assert_eq!(tracer.noise().unwrap(), None);
        // The deadline stays in the past.
        tracer.add_samples(1).unwrap();
        assert_eq!(tracer.picture().unwrap(), picture);
    }
    assert_silent(&context());
}

/// A deadline between samples leaves pixels with different numbers of samples; each pixel is right
/// in the mean.
#[test]
fn a_deadline_between_samples_keeps_the_mean() {
    let mut scene = shapes::closed_box(Vec3::ONE, 0.5);
    scene.cameras[0].size = [16, 16];
    let mean = |tracer: &PathTracer| {
        let picture = tracer.picture().unwrap();
        picture.beauty.iter().map(|pixel| f64::from(pixel[0])).sum::<f64>() / picture.beauty.len() as f64
    };
    let expected = mean(&trace(scene.clone(), [16, 16], 64));
    let mut tracer = PathTracer::new(&context(), scene, &mut Silent).unwrap();
    tracer.add_samples(32).unwrap();
    let before = tracer.samples();
    tracer.set_deadline(Some(Instant::now() + Duration::from_millis(50)));
    tracer.add_samples(1 << 20).unwrap();
    assert!(tracer.samples() >= before && tracer.samples() < 1 << 20);
    let found = mean(&tracer);
    assert!((found / expected - 1.0).abs() < 0.03, "{found} instead of {expected}");
    assert_silent(&context());
}
