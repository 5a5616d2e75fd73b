//! Direct light at measuring points against its reference.

use crate::common::assert_silent;
use crate::lights::{GRAZING, lights, one, overhead};
use crate::path_trace;
use crate::world::{FLOAT, Random};
use bytemuck::Zeroable;
use lightpaths::cpu;
use lightpaths::gpu::Buffer;
use lightpaths::passes::meters::Meters;
use lightpaths::types::{CachePoint, PixelSurface};

#[test]
fn measured_lights_equal_the_reference() {
    let world = path_trace::world();
    let lights = lights();
    let table = Buffer::from_slice(&world.context, "lights", &lights).unwrap();
    for count in [1, 63, 900] {
        let pixels = world.pixels(&mut Random::new(72), count);
        let point = |(number, pixel): (usize, &PixelSurface)| CachePoint {
            position: pixel.position,
            normal: pixel.normal,
            facet: world.geometry().normal(pixel.side),
            radius: if number % 9 == 8 { 0.0 } else { 0.1 },
            ..CachePoint::zeroed()
        };
        let points: Vec<CachePoint> = pixels.iter().enumerate().map(point).collect();
        let pass = Meters::new(&world.context, &points).unwrap();
        for (index, light) in lights.iter().enumerate() {
            let light_at = one(&table, &lights, index);
            world.context.run(|rec| pass.record(rec, &world.buffers, light_at)).unwrap();
            let found: Vec<f32> = pass.irradiance.read().unwrap();
            assert_eq!(found.len(), count);
            let mut disagree = 0;
            for (point, &found) in points.iter().zip(&found) {
                let (geometry, CachePoint { position, normal, facet, .. }) = (world.geometry(), *point);
                let lit = cpu::direct::light_factor(geometry, light, position, facet, normal, 0.0);
                let expected = if point.radius == 0.0 { 0.0 } else { lit };
                disagree += usize::from(
                    (f64::from(found) - expected).abs() > FLOAT * overhead(light, point.position),
                );
            }
            let allowed = count * (light.samples as usize).min(5);
            assert!(disagree * GRAZING <= allowed, "light {index}: {disagree} of {count} points differ");
            assert!(count < 900 || found.iter().filter(|value| **value > 0.0).count() > 50);
        }
    }
    assert_silent(&world.context);
}
