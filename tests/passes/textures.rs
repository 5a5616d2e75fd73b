//! Image lookup on the device, with values that are known without a reference.

use crate::common::{assert_silent, context};
use crate::world::World;
use glam::{DVec2, DVec3, Vec2, Vec3};
use lightpaths::cpu::textures::{linear, sample, unpack_colour};
use lightpaths::gpu::Buffer;
use lightpaths::passes::TextureBuffers;
use lightpaths::passes::frame::pixel_colours::{PixelColours, PixelColoursPush};
use lightpaths::scene::{Camera, Image, Material, Scene, Texture, shapes};
use lightpaths::types::{NO_SIDE, PixelSurface, View};
use std::sync::Arc;

const SIDE: u32 = 4;

/// A different code for each texel.
fn code(x: u32, y: u32) -> [u8; 3] {
    [60 * x as u8, 255 - 70 * y as u8, 16 * (x + 4 * y) as u8]
}

fn image(size: [u32; 2]) -> Arc<Image> {
    let codes = (0..size[0] * size[1]).map(|index| code(index % size[0], index / size[0])).collect();
    Arc::new(Image { size, codes })
}

/// A square with an image. The camera sees its corners in the corners of the picture.
fn square(shift: Vec2, is_clamped: bool) -> Scene {
    let mut scene = shapes::facing_squares(1.0, 0.0, 0.5);
    scene.triangles.truncate(2);
    scene.materials[0].texture = Some(Texture { image: image([SIDE; 2]), is_clamped, is_atlas: false });
    let place = |p: Vec3| Vec2::new(0.5 + p.x, 0.5 - p.z) + shift;
    scene.texture_coordinates = scene.triangles.iter().map(|t| t.positions.map(place)).collect();
    scene
}

/// Colours in a picture of the image's size, one point for each pixel.
fn colours(scene: &Scene) -> Vec<DVec3> {
    let world = World::new(scene, 4);
    let view = View::from(&Camera {
        name: "above".to_owned(),
        position: Vec3::Y,
        target: Vec3::ZERO,
        up: Vec3::NEG_Z,
        fov_y_degrees: 2.0 * 0.5_f32.atan().to_degrees(),
        size: [SIDE; 2],
    });
    // One of the two triangles serves all pixels: both have the same plane. The last
    // pixel sees nothing.
    let mut pixels =
        vec![PixelSurface { position: Vec3::ZERO, side: 0, normal: Vec3::Y, footprint: 0.0 }; 16];
    pixels[15].side = NO_SIDE;
    let pixels = Buffer::from_slice(&world.context, "pixels", &pixels).unwrap();
    let packed = Buffer::from_slice(&world.context, "colours", &[7_u32; 17]).unwrap();
    let buffers = &world.buffers;
    world.dispatch(
        PixelColours::STEM,
        &[("POINTS", 1), buffers.textures.constant()],
        |_| SIDE * SIDE,
        &PixelColoursPush { view },
        &buffers.textures.after([
            ("Triangles", &buffers.triangles),
            ("Surfaces", &buffers.surfaces),
            ("Pixels", &pixels),
            ("PixelColours", &packed),
        ]),
    );
    let packed: Vec<u32> = packed.read().unwrap();
    assert_eq!(packed[16], 7, "nothing is written behind the last pixel");
    assert_silent(&world.context);
    packed[..16].iter().copied().map(unpack_colour).collect()
}

/// Pixels beside a triangle of an atlas show its nearest colour: other texels belong to others.
#[test]
fn an_atlas_ends_at_its_triangle() {
    let mut scene = square(Vec2::ZERO, true);
    scene.triangles.truncate(1);
    scene.texture_coordinates.truncate(1);
    let atlas = Texture { is_atlas: true, ..scene.materials[0].texture.clone().unwrap() };
    scene.materials[0].texture = Some(atlas.clone());
    let [a, b, c] = scene.triangles[0].positions.map(Vec3::as_dvec3);
    let places = scene.texture_coordinates[0].map(Vec2::as_dvec2);
    let found = colours(&scene);
    let mut beyond = 0;
    for (index, colour) in (0..15).zip(found) {
        let at = (DVec2::new(f64::from(index % SIDE), f64::from(index / SIDE)) + 0.5) / f64::from(SIDE) - 0.5;
        let at = DVec3::new(at.x, a.y, at.y);
        let normal = (b - a).cross(c - a);
        let weight = |p: DVec3, q: DVec3| (p - at).cross(q - at).dot(normal) / normal.length_squared();
        let weights = [weight(b, c), weight(c, a), weight(a, b)];
        beyond += usize::from(weights.iter().any(|weight| *weight < -0.01));
        let inside = weights.map(|weight| weight.max(0.0));
        let sum: f64 = inside.iter().sum();
        let place = inside.iter().zip(places).map(|(weight, place)| *weight / sum * place).sum::<DVec2>();
        let expected = sample(&atlas, place);
        let error = (colour - expected).abs().max_element();
        assert!(error < 1.1e-3, "pixel {index}: {colour}, {expected} expected");
    }
    assert!(beyond >= 5, "{beyond} pixels are beyond the triangle");
}

#[test]
fn texels_show_in_their_middles_and_halfway_between() {
    let texel = |x: u32, y: u32| DVec3::from(code(x, y).map(linear));
    // Shifts by whole and half texels, beyond the image on both sides.
    for (shift, is_clamped) in
        [(0, false), (0, true), (1, false), (1, true), (-3, false), (-3, true), (29, false)]
    {
        let found = colours(&square(Vec2::new(shift as f32 / 8.0, 0.0), is_clamped));
        for (index, colour) in (0..).zip(&found[..15]) {
            let (x, y) = (index % SIDE, index / SIDE);
            let at = |x: i32| match is_clamped {
                true => texel(x.clamp(0, 3) as u32, y),
                false => texel(x.rem_euclid(4) as u32, y),
            };
            let halves = 2 * x as i32 + shift;
            let expected = 0.5 * (at(halves.div_euclid(2)) + at(halves.div_euclid(2) + halves.rem_euclid(2)));
            let error = (*colour - expected).abs().max_element();
            assert!(error < 1.1e-3, "{shift} {is_clamped} ({x}, {y}): {colour}, {expected} expected");
        }
        assert_eq!(found[15], DVec3::ZERO);
    }
}

#[test]
fn each_image_is_stored_once_and_none_beyond_the_binding() {
    let context = context();
    let material = |image: &Arc<Image>| {
        let texture = Some(Texture { image: image.clone(), is_clamped: false, is_atlas: false });
        Material { texture, ..shapes::closed_box(Vec3::ONE, 0.5).materials[0].clone() }
    };
    let (small, other) = (image([4, 3]), image([4, 3]));
    let bytes = |materials: &[Material], coordinates: &[[Vec2; 3]]| {
        let textures = TextureBuffers::new(&context, coordinates, materials, false)?;
        Ok::<u64, lightpaths::Error>(textures.after([]).iter().map(|(_, buffer)| buffer.bytes()).sum())
    };
    let coordinates = [[Vec2::ZERO; 3]];
    let [once, shared, twice] = [&[&small][..], &[&small, &small], &[&small, &other]].map(|images| {
        bytes(&images.iter().map(|image| material(image)).collect::<Vec<_>>(), &coordinates).unwrap()
    });
    assert_eq!([once, shared, twice], [24 + 16 + 1024 + 48, 24 + 32 + 1024 + 48, 24 + 32 + 1024 + 96]);
    assert!(bytes(&[material(&small)], &[]).unwrap() < 64, "nothing without coordinates");

    let rows = context.limits().storage_range_bytes / (4 * 8192);
    let large = Arc::new(Image { size: [8192, rows as u32], codes: vec![[0; 3]; 8192 * rows as usize] });
    let message = bytes(&[material(&large)], &coordinates).unwrap_err().to_string();
    assert!(message.contains("the device can bind") && message.contains("scale them"), "{message}");
}
