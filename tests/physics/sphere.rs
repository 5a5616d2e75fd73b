//! The integrating sphere: indirect irradiance is Φ/A·ρ/(1−ρ) everywhere, wherever the light is.

use crate::common::{assert_silent, context};
use crate::render;
use glam::Vec3;
use lightpaths::gpu::Buffer;
use lightpaths::renderer::{Edit, Renderer};
use lightpaths::scene::{Quality, shapes};
use lightpaths::types::Record;

const FLUX_W: f32 = 10.0;
const RADIUS_M: f32 = 1.5;

/// The paper's entry points, gather rays and cells; 1 000 cache points are as good a sample of the wall as 40 000.
const PAPER: Quality = Quality { cache_points: 1_000, ..Quality::PAPER };

/// Mean error and RMS of the indirect irradiance in all records, relative to the closed form, all channels.
fn errors(renderer: &Renderer, records: &Buffer, albedo: f64) -> [f64; 2] {
    // Flux and albedo are the polyhedron's exactly; so must its area be.
    let expected = f64::from(FLUX_W) / renderer.scene().area_m2() * albedo / (1.0 - albedo);
    let records: Vec<Record> = records.read().unwrap();
    let errors: Vec<f64> = records
        .iter()
        .flat_map(|record| record.irradiance.to_array())
        .map(|irradiance| f64::from(irradiance) / expected - 1.0)
        .collect();
    let mean =
        |terms: &dyn Fn(f64) -> f64| errors.iter().map(|e| terms(*e)).sum::<f64>() / errors.len() as f64;
    [mean(&|e| e), mean(&|e| e * e).sqrt()]
}

/// One precomputation, the light at the centre and then half-way to the wall.
fn check(albedo: f32) {
    let scene = shapes::integrating_sphere(RADIUS_M, 4, albedo, Vec3::ZERO, FLUX_W);
    let mut renderer = render(scene, PAPER);
    let beside = 0.5 * RADIUS_M * Vec3::new(0.48, 0.6, 0.64);
    for light in [Vec3::ZERO, beside] {
        renderer.move_light(0, light).unwrap();
        renderer.frame(Edit::Light).unwrap();
        let stages = renderer.stages();
        for (what, records) in [("gathered", stages.gathered), ("blended", stages.records)] {
            let [mean, rms] = errors(&renderer, records, f64::from(albedo)).map(|error| 100.0 * error);
            let figures =
                format!("albedo {albedo}, light at {light}, {what}: mean {mean:+.3} %, RMS {rms:.3} %");
            println!("{figures}");
            assert!(mean.abs() <= 0.3 && rms <= 2.0, "{figures}");
        }
    }
    assert_silent(&context());
}

#[test]
fn indirect_irradiance_is_uniform_at_albedo_one_half() {
    check(0.5);
}

#[test]
fn indirect_irradiance_is_uniform_at_albedo_nine_tenths() {
    check(0.9);
}
