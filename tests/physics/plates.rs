//! Light bouncing between two plates, against radiosity on a fine mesh in f64.

use crate::common::{assert_silent, context};
use crate::{direct::positions, render};
use glam::{DVec3, Vec3};
use lightpaths::renderer::Layer;
use lightpaths::scene::{LightKind, Quality, Scene, shapes};
use lightpaths::types::Record;
use std::f64::consts::PI;

const ALBEDO: f64 = 0.6;
const LIGHT: DVec3 = DVec3::new(0.15, 0.1, -0.2);
/// Patches along the edge of a plate.
const PATCHES: usize = 40;

const QUALITY: Quality = Quality {
    preset: "test",
    entry_points: 200_000,
    cache_points: 1_000,
    gather_rays: 1024,
    edge_samples: 0,
    ..Quality::DRAFT
};

/// Unit squares half a metre above and below the origin. The camera sees the lower
/// one between them.
pub(crate) fn scene() -> Scene {
    let mut scene = shapes::facing_squares(1.0, 1.0, ALBEDO as f32);
    scene.lights[0].kind = LightKind::Point { position: LIGHT.as_vec3(), intensity: Vec3::ONE };
    let camera = &mut scene.cameras[0];
    (camera.position, camera.target) = (Vec3::new(0.0, 0.4, 0.9), Vec3::new(0.0, -0.5, 0.0));
    scene
}

/// Ratio of a picture's indirect light on the lower plate to the expected one, and the
/// number of pixels.
pub(crate) fn ratio(positions: &[Option<DVec3>], indirect: &[[f32; 3]]) -> (f64, u32) {
    let plates = [-0.5, 0.5].map(middles);
    let [_, upper] = radiosities(&plates);
    let (mut value, mut expected, mut pixels) = (0.0, 0.0, 0);
    for (position, indirect) in positions.iter().zip(indirect) {
        // Well inside, so that the whole pixel shows the plate.
        let Some(position) = position.filter(|p| p.y < 0.0 && p.x.abs().max(p.z.abs()) < 0.45) else {
            continue;
        };
        value += f64::from(indirect[0]);
        expected += ALBEDO / PI * gathered(position, &plates[1], &upper);
        pixels += 1;
    }
    println!("{pixels} pixels: {:+.3} %", 100.0 * (value / expected - 1.0));
    (value / expected, pixels)
}

/// Centres of a plate's patches.
fn middles(height: f64) -> Vec<DVec3> {
    let along = |i: usize| (i as f64 + 0.5) / PATCHES as f64 - 0.5;
    (0..PATCHES * PATCHES).map(|i| DVec3::new(along(i % PATCHES), height, along(i / PATCHES))).collect()
}

/// Irradiance at a point by a plate of given radiosities (W/m²) that is parallel to
/// the point's surface.
fn gathered(point: DVec3, plate: &[DVec3], radiosity: &[f64]) -> f64 {
    let area = 1.0 / (PATCHES * PATCHES) as f64;
    let kernel = |patch: &DVec3| {
        let d = *patch - point;
        d.y * d.y / (d.length_squared() * d.length_squared()) / PI * area
    };
    plate.iter().zip(radiosity).map(|(patch, radiosity)| kernel(patch) * radiosity).sum()
}

/// Radiosity of the lower and the upper plate, with all bounces.
fn radiosities(plates: &[Vec<DVec3>; 2]) -> [Vec<f64>; 2] {
    let direct = |patch: &DVec3| {
        let d = LIGHT - *patch;
        d.y.abs() / d.length().powi(3)
    };
    let emitted =
        [0, 1].map(|plate: usize| plates[plate].iter().map(|p| ALBEDO * direct(p)).collect::<Vec<_>>());
    let mut radiosities = emitted.clone();
    // A bounce keeps at most 12 %: after eight, a ten-millionth is left.
    for _ in 0..8 {
        radiosities = [0, 1].map(|plate: usize| {
            let (other, from) = (&plates[1 - plate], &radiosities[1 - plate]);
            let reflected = plates[plate].iter().map(|p| ALBEDO * gathered(*p, other, from));
            reflected.zip(&emitted[plate]).map(|(r, e)| r + e).collect()
        });
    }
    radiosities
}

/// Mean and RMS of a list of relative errors.
fn statistics(errors: &[f64]) -> [f64; 2] {
    let count = errors.len() as f64;
    [errors.iter().sum::<f64>() / count, (errors.iter().map(|e| e * e).sum::<f64>() / count).sqrt()]
}

#[test]
fn bounces_between_plates_equal_their_integral() {
    let mut scene = scene();
    (scene.cameras[0].position, scene.cameras[0].target) = (Vec3::new(0.0, 0.3, 1.5), Vec3::ZERO);
    let renderer = render(scene, QUALITY);

    let plates = [middles(-0.5), middles(0.5)];
    let radiosities = radiosities(&plates);
    let expected = |point: DVec3| {
        let other = usize::from(point.y < 0.0);
        gathered(point, &plates[other], &radiosities[other])
    };
    let records: Vec<Record> = renderer.stages().records.read().unwrap();
    let emission_scale = renderer.stages().emission_scale.y;
    let at_records: Vec<f64> = records
        .iter()
        .map(|record| {
            f64::from(emission_scale * record.irradiance.y) / expected(record.position.as_dvec3()) - 1.0
        })
        .collect();
    let indirect = renderer.layer(Layer::Indirect).unwrap();
    // The outer sides of the plates get no light and are not in view.
    let at_pixels: Vec<f64> = positions(&renderer)
        .into_iter()
        .zip(&indirect)
        .filter_map(|(position, pixel)| Some((position?, pixel)))
        .map(|(position, pixel)| f64::from(pixel[1]) * PI / ALBEDO / expected(position) - 1.0)
        .collect();
    assert!(records.len() > 500 && at_pixels.len() > 500);
    for (what, errors) in [("records", at_records), ("pixels", at_pixels)] {
        let [mean, rms] = statistics(&errors);
        let figures = format!("{what}: mean {:+.3} %, RMS {:.3} %", 100.0 * mean, 100.0 * rms);
        println!("{figures}");
        assert!(mean.abs() <= 0.005 && rms <= 0.03, "{figures}");
    }
    assert_silent(&context());
}
