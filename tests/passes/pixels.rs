//! Primary visibility, composition and tone map.

use crate::common::assert_silent;
use crate::world::{FLOAT, Random, World, assert_near};
use glam::Vec3;
use lightpaths::cpu;
use lightpaths::gpu::Buffer;
use lightpaths::passes::frame::{
    antialias::Antialias,
    compose::{Compose, Irradiances},
    pixel_colours::PixelColours,
    primary::Primary,
    tonemap::Tonemap,
};
use lightpaths::scene::{Camera, DisplayTransform, ToneCurve, WhiteBalance, shapes};
use lightpaths::types::{NO_SIDE, PixelSurface, View};

/// Sizes around a workgroup of 8×8 pixels.
const SIZES: [[u32; 2]; 6] = [[1, 1], [7, 9], [8, 8], [9, 7], [31, 17], [64, 3]];

fn camera(size: [u32; 2], distance: f32) -> Camera {
    let name = "camera".to_owned();
    let position = Vec3::new(0.1, 0.05, 0.48) * distance;
    Camera { name, position, target: Vec3::new(-0.1, -0.2, 0.0), up: Vec3::Y, fov_y_degrees: 95.0, size }
}

#[test]
fn pixels_equal_the_reference() {
    let room = World::room();
    // Squares without a room, so that some rays miss.
    let squares = World::new(&shapes::facing_squares(1.0, 1.0, 0.5), 8);
    for (world, distance) in [(&room, 1.0), (&squares, 4.0)] {
        for size in SIZES {
            let view = View::from(&camera(size, distance));
            let pass = Primary::new(&world.context, size[0] * size[1]).unwrap();
            world.context.run(|rec| pass.record(rec, &world.buffers, &view)).unwrap();
            let pixels: Vec<PixelSurface> = pass.pixels.read().unwrap();
            let mut other_sides = 0;
            for (index, pixel) in (0..).zip(&pixels) {
                let seen = cpu::primary::primary(world.geometry(), &view, index % size[0], index / size[0]);
                let Some(seen) = seen.filter(|seen| seen.side == pixel.side) else {
                    other_sides += u32::from(pixel.side != NO_SIDE || seen.is_some());
                    continue;
                };
                // At a slope of 1 in 100, the hit moves a hundred times as far as the ray's error.
                assert_near(pixel.position, seen.hit.position, 1e-4, 1.0, "position");
                assert_near(pixel.normal, seen.normal, 1e-4, 1.0, "normal");
                let footprint = f64::from(pixel.footprint);
                assert!(
                    (footprint / seen.footprint - 1.0).abs() < 1e-3,
                    "{footprint} m², {} by the reference",
                    seen.footprint
                );
            }
            assert!(other_sides * 500 <= size[0] * size[1], "{other_sides} pixels see something else");
        }
    }
    assert_silent(&room.context);
}

#[test]
fn radiance_equals_the_reference() {
    let world = World::room();
    let mut random = Random::new(72);
    for count in [0, 1, 63, 64, 65, 997] {
        let mut pixels = world.pixels(&mut random, count);
        for pixel in pixels.iter_mut().step_by(5).skip(1) {
            pixel.side = NO_SIDE;
        }
        let irradiances = [(); 2].map(|()| (0..count).map(|_| 1.0 + random.cube()).collect::<Vec<Vec3>>());
        let upload = |name: &str, values: &[Vec3]| Buffer::from_slice(&world.context, name, values).unwrap();
        let [direct, indirect] = [upload("direct", &irradiances[0]), upload("indirect", &irradiances[1])];
        let surfaces = Buffer::from_slice(&world.context, "pixels", &pixels).unwrap();
        let pass = Compose::new(&world.context, &world.buffers, [count as u32, 1], false).unwrap();
        let antialias = Antialias::new(&world.context, [count as u32, 1], 0).unwrap();
        let colours = PixelColours::new(&world.context, &world.buffers, count as u32, 0).unwrap();
        let irradiances_of = Irradiances {
            pixels: &surfaces,
            direct: &direct,
            indirect: &indirect,
            at_edges: &indirect,
            gloss: None,
            antialias: &antialias,
            colours: &colours,
            emission_scale: Vec3::ONE,
        };
        let view = View { width: count as u32, height: 1, ..bytemuck::Zeroable::zeroed() };
        world.context.run(|rec| pass.record(rec, &world.buffers, &view, irradiances_of, [1.0, 1.0])).unwrap();
        let radiance: Vec<Vec3> = pass.radiance.read().unwrap();
        for (index, (device, pixel)) in radiance.iter().zip(&pixels).enumerate() {
            if pixel.side == NO_SIDE {
                assert_eq!(*device, Vec3::ZERO);
                continue;
            }
            let material = world.surfaces[pixel.side as usize / 2].material;
            let albedo = world.materials[material as usize].diffuse;
            let reference =
                cpu::compose::compose(albedo, irradiances[0][index], irradiances[1][index], Vec3::ZERO);
            assert_near(*device, reference, FLOAT, 0.0, "radiance");
        }
    }
    assert_silent(&world.context);
}

#[test]
fn display_codes_equal_the_reference() {
    let context = crate::common::context();
    // The curve's toe, its shoulder, over- and underflow, and NaN; and a fine sweep.
    let mut values = vec![0.0, 0.003_130_8, 0.18, 0.8, 0.801, 1.0, 8.0, 1e30, -1.0, f32::NAN, f32::INFINITY];
    values.extend((0..4000).map(|i| i as f32 * 5e-4));
    values.resize(values.len().next_multiple_of(3), 0.5);
    // Colours over 24 stops.
    values.extend((0..1200).flat_map(|i| {
        let value = (i as f32 / 50.0 - 16.0).exp2();
        [[1.0, 0.3, 0.05], [0.02, 1.0, 0.4], [0.2, 0.0, 1.0]][i % 3].map(|part| part * value)
    }));
    let pixels = values.as_chunks::<3>().0;
    let radiance = Buffer::from_slice(&context, "radiance", &values).unwrap();
    let pass = Tonemap::new(&context, pixels.len() as u32).unwrap();
    for tone in ToneCurve::ALL {
        for (exposure_stops, kelvin, tint) in
            [(0.0, 6504.0, 0.0), (-2.5, 6504.0, 0.0), (1.0, 2700.0, 0.0), (0.0, 9000.0, 12.0)]
        {
            let display =
                DisplayTransform { exposure_stops, tone, white_balance: WhiteBalance { kelvin, tint } };
            context.run(|rec| pass.record(rec, &radiance, &display)).unwrap();
            let codes: Vec<[u8; 4]> = pass.display.read().unwrap();
            let mut different = 0;
            for (index, (codes, pixel)) in codes.iter().zip(pixels).enumerate() {
                let reference = cpu::tonemap::dithered(index as u32, &display.constants(), *pixel);
                // The device's pow is accurate to a few ulps: the threshold of a code may move.
                let is_near =
                    codes.iter().zip(reference).all(|(code, reference)| code.abs_diff(reference) <= 1);
                assert!(
                    is_near && codes[3] == 255,
                    "{pixel:?} by {display:?}: {codes:?}, {reference:?} by the reference"
                );
                different += usize::from(*codes != reference);
            }
            // Different noise would change a third of the codes.
            assert!(different <= codes.len() / 100, "{different} of {} by {display:?}", codes.len());
        }
    }
    assert_silent(&context);
}
