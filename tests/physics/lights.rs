//! Every kind of light: direct light against closed forms and the path tracer, form factors by the
//! power that enters a closed sphere, and all light of a room against the path tracer.

use crate::common::{assert_silent, context};
use crate::path_tracer::{square, trace};
use crate::{SMALL, assert_close, render};
use glam::{DVec3, Vec3};
use lightpaths::reference::Progressive;
use lightpaths::renderer::{Layer, Renderer};
use lightpaths::scene::{Light, LightKind, Quality, Scene, shapes};
use std::f64::consts::PI;

const AREA: LightKind = LightKind::Area {
    corner: Vec3::new(-0.25, 0.7, -0.15),
    edge_u: Vec3::new(0.5, 0.0, 0.0),
    edge_v: Vec3::new(0.0, 0.0, 0.3),
    radiance: Vec3::new(4.0, 2.0, 1.0),
    samples: 10,
};

/// Direct irradiance of each pixel of the square of albedo 1/2, first channel, W/m², and
/// the pixel's position.
fn direct(kind: LightKind) -> Vec<(DVec3, f64)> {
    let mut scene = square(kind);
    scene.cameras[0].size = [48, 32];
    let renderer = render(scene, SMALL);
    let positions = crate::direct::positions(&renderer);
    let radiance = renderer.layer(Layer::Direct).unwrap();
    let pixels = positions.into_iter().zip(radiance);
    pixels.filter_map(|(position, pixel)| Some((position?, f64::from(pixel[0]) * PI / 0.5))).collect()
}

#[test]
fn spots_and_parallel_light_follow_closed_forms() {
    let (position, direction) = (Vec3::new(0.1, 0.8, 0.05), Vec3::new(0.0, -1.0, 0.0));
    let [angle, penumbra] = [0.5_f32, 0.6];
    let spot = LightKind::Spot { position, direction, intensity: Vec3::splat(2.0), angle, penumbra };
    let found = direct(spot);
    assert!(found.len() > 1000);
    for (x, value) in found {
        let to_light = position.as_dvec3() - x;
        let off_axis = (to_light.y / to_light.length()).acos();
        let [inner, outer] = [f64::from(angle * (1.0 - penumbra)), f64::from(angle)];
        let falloff = ((outer - off_axis) / (outer - inner)).clamp(0.0, 1.0);
        let expected = 2.0 * falloff * to_light.y / to_light.length().powi(3);
        assert!((value - expected).abs() < 3e-3, "{value} instead of {expected} at {x}");
    }
    let direction = Vec3::new(0.6, -0.64, 0.48);
    for (x, value) in direct(LightKind::Directional { direction, irradiance: Vec3::splat(3.0) }) {
        assert_close(&format!("parallel light at {x}"), value, 3.0 * 0.64, 1e-5);
    }
    let up = LightKind::Directional { direction: -direction, irradiance: Vec3::ONE };
    assert!(direct(up).iter().all(|(_, value)| *value == 0.0), "from below");
    assert_silent(&context());
}

/// The error falls with the number of samples.
#[test]
fn area_lights_converge_to_the_integral() {
    let LightKind::Area { corner, edge_u, edge_v, radiance, .. } = AREA else { unreachable!() };
    let integral = |x: DVec3| {
        let mut sum = 0.0;
        for (i, j) in (0..64 * 64).map(|index| (index % 64, index / 64)) {
            let [u, v] = [i, j].map(|place| (f64::from(place) + 0.5) / 64.0);
            let to_light = corner.as_dvec3() + u * edge_u.as_dvec3() + v * edge_v.as_dvec3() - x;
            sum += to_light.y.powi(2) / to_light.length_squared().powi(2);
        }
        4.0 * sum * 0.15 / f64::from(64 * 64)
    };
    let errors = [1, 10, 40, 100].map(|samples| {
        let found = direct(LightKind::Area { corner, edge_u, edge_v, radiance, samples });
        let errors = found.iter().map(|(x, value)| (value / integral(*x) - 1.0).abs());
        errors.fold(0.0, f64::max)
    });
    println!("largest errors of 1, 10, 40 and 100 samples: {errors:.5?}");
    // Midpoint rules: four times the points give at most a quarter of the error.
    assert!(errors[0] < 0.2 && errors[1] < 0.02 && errors[2] < 0.005 && errors[3] < 0.002, "{errors:?}");
    let turned = LightKind::Area { corner, edge_u: edge_v, edge_v: edge_u, radiance, samples: 10 };
    assert!(direct(turned).iter().all(|(_, value)| *value == 0.0), "one side only");
    assert_silent(&context());
}

/// Flux that enters the paths of a closed sphere: the whole power of the light.
#[test]
fn form_factors_take_in_the_power_of_each_kind() {
    let (position, direction) = (Vec3::new(0.1, -0.2, 0.2), Vec3::new(0.48, 0.6, 0.64));
    let spot =
        |penumbra| LightKind::Spot { position, direction, intensity: Vec3::splat(2.0), angle: 0.8, penumbra };
    // ∫ sin θ dθ over the cone; with a penumbra of 1, with the falloff 1 - θ/0.8.
    let cone = 2.0 * PI * (1.0 - 0.8_f64.cos());
    let soft = 2.0 * PI * (1.0 - 0.8_f64.sin() / 0.8);
    let area = LightKind::Area {
        corner: Vec3::new(-0.2, 0.1, -0.2),
        edge_u: Vec3::new(0.3, 0.1, 0.0),
        edge_v: Vec3::new(0.0, 0.1, 0.4),
        radiance: Vec3::splat(5.0),
        samples: 10,
    };
    let extent = f64::from(Vec3::new(0.3, 0.1, 0.0).cross(Vec3::new(0.0, 0.1, 0.4)).length());
    for (kind, power) in [(spot(0.0), 2.0 * cone), (spot(1.0), 2.0 * soft), (area, 5.0 * PI * extent)] {
        let mut scene = shapes::integrating_sphere(0.8, 3, 0.5, Vec3::ZERO, 1.0);
        scene.lights[0].kind = kind;
        // Records do not affect the result.
        let renderer = render(scene, Quality { cache_points: 50, gather_rays: 16, ..SMALL });
        let stages = renderer.stages();
        let flux = renderer.path_flux().unwrap();
        let entering: f64 = flux.iter().map(|flux| f64::from(flux.x * stages.emission_scale.x)).sum();
        assert_close(&format!("flux of the light {}", kind.word()), entering, power, 4e-3);
    }
    assert_silent(&context());
}

/// A room of 1.2×1×1.4 m with a block in it; without a ceiling if the light is directional.
pub(crate) fn room(kind: LightKind) -> Scene {
    let mut scene = shapes::closed_box(Vec3::new(1.2, 1.0, 1.4), 0.6);
    if matches!(kind, LightKind::Directional { .. }) {
        scene.triangles.retain(|triangle| triangle.positions.iter().any(|p| p.y < 0.4));
    }
    let block =
        shapes::closed_box(Vec3::new(0.35, 0.3, 0.3), 0.6).triangles.into_iter().map(|mut triangle| {
            // The fronts of the box are inside; those of a block are outside.
            let [a, b, c] = triangle.positions.map(|p| p + Vec3::new(-0.2, -0.35, -0.2));
            (triangle.positions, triangle.normals) = ([a, c, b], triangle.normals.map(|n| -n));
            triangle
        });
    scene.triangles.extend(block);
    scene.cameras[0].size = [40, 30];
    scene.lights = vec![Light::new("lamp", kind)];
    scene
}

fn mean(pixels: &[[f32; 3]]) -> f64 {
    pixels.iter().flatten().map(|value| f64::from(*value)).sum::<f64>() / (3 * pixels.len()) as f64
}

#[test]
fn rooms_hold_the_light_that_the_path_tracer_finds() {
    let quality = Quality { edge_samples: 16, cache_points: 2_000, gather_rays: 144, ..SMALL };
    let (position, direction) = (Vec3::new(0.2, 0.3, 0.1), Vec3::new(-0.6, -0.8, 0.0));
    let corner = Vec3::new(0.0, 0.45, -0.2);
    let (edge_u, edge_v) = (Vec3::new(0.4, 0.0, 0.0), Vec3::new(0.0, 0.0, 0.3));
    for kind in [
        LightKind::Point { position, intensity: Vec3::ONE },
        LightKind::Spot { position, direction, intensity: Vec3::splat(4.0), angle: 0.8, penumbra: 0.3 },
        LightKind::Area { corner, edge_u, edge_v, radiance: Vec3::splat(9.0), samples: 10 },
        LightKind::Directional { direction, irradiance: Vec3::splat(2.0) },
    ] {
        let renderer: Renderer = render(room(kind), quality.clone());
        let tracer = trace(room(kind), [40, 30], 64);
        let picture = tracer.picture().unwrap();
        let direct = mean(&renderer.layer(Layer::Direct).unwrap()) / mean(&picture.direct);
        let indirect = mean(&renderer.layer(Layer::Indirect).unwrap()) / mean(&picture.indirect);
        println!("{}: {direct:.4} of the direct, {indirect:.4} of the indirect light", kind.word());
        assert!((direct - 1.0).abs() < 0.01, "{}: {direct} of the direct light", kind.word());
        assert!((indirect - 1.0).abs() < 0.015, "{}: {indirect} of the indirect light", kind.word());
    }
    assert_silent(&context());
}
