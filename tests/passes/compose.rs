//! Composition of pixels and their samples: the colours of images there, and the picture.

use crate::antialias::{Frame, camera, lights};
use crate::common::{assert_silent, context};
use crate::world::{FLOAT, Random, SUM, World, assert_near, textured};
use glam::{DVec2, DVec3, Vec3};
use lightpaths::cpu;
use lightpaths::cpu::pixel_colours::colour_through;
use lightpaths::cpu::textures::unpack_colour;
use lightpaths::gpu::Buffer;
use lightpaths::passes::frame::antialias::NO_EDGE;
use lightpaths::passes::frame::compose::{Compose, Irradiances};
use lightpaths::passes::frame::gloss_pixels::PixelGloss;
use lightpaths::passes::frame::pixel_colours::POINTS;
use lightpaths::scene::shapes;
use lightpaths::types::{NO_SIDE, PixelSurface, View};

#[test]
fn colours_of_pixels_and_samples_equal_the_reference() {
    let room = World::textured_room();
    // With an outline.
    let squares = World::new(&textured(shapes::facing_squares(1.0, 1.0, 0.5)), 8);
    for (world, distance, size, most) in [
        (&room, 1.0, [1, 1], 16),
        (&room, 1.0, [31, 17], 16),
        (&room, 1.0, [31, 17], 0),
        (&squares, 4.0, [31, 17], 16),
    ] {
        let frame = Frame::new(world, &lights(), &camera(size, distance), most);
        let (geometry, view) = (world.geometry(), &frame.view);
        let count = frame.samples_per_edge(frame.edge_count());
        let (samples, firsts) = (frame.samples(), frame.firsts());
        let of_pixel = |(index, pixel): (u32, &PixelSurface)| {
            cpu::pixel_colours::pixel_colour(geometry, view, index, pixel.side, POINTS)
        };
        let of_sample = |pixel: u32, index: u32, side: u32| {
            let corner = DVec2::new(f64::from(pixel % size[0]), f64::from(pixel / size[0]));
            let point = corner + cpu::antialias::place_in_pixel(index, pixel);
            colour_through(geometry, view, point, side).unwrap_or_default()
        };
        let of_fragment = |number: usize, edge: usize| {
            let own = number - firsts[edge];
            let first = edge * count as usize;
            let members =
                (0..).zip(&samples[first..first + count as usize]).filter(|(_, sample)| sample.1 == own);
            let colours =
                members.map(|(index, &(side, _))| of_sample(frame.edge_pixels()[edge], index, side));
            let colours: Vec<DVec3> = colours.collect();
            colours.iter().sum::<DVec3>() / colours.len() as f64
        };
        let pixels: Vec<DVec3> = (0..).zip(&frame.pixels).map(of_pixel).collect();
        let fragments = frame.fragments();
        let fragments = fragments.iter().enumerate();
        let fragments: Vec<DVec3> =
            fragments.map(|(number, fragment)| of_fragment(number, fragment.edge as usize)).collect();
        for (what, buffer, reference) in
            [("pixels", &frame.colours.of_pixels, pixels), ("fragments", &frame.colours.of_edges, fragments)]
        {
            let found: Vec<u32> = buffer.read_range(0, reference.len()).unwrap();
            // Half of the last bit of a packed root, and the error of f32 texture coordinates at
            // a grazing angle.
            let apart = |(found, reference): &(&u32, &DVec3)| {
                (unpack_colour(**found) - *reference).abs().max_element() > 2e-3
            };
            let others = found.iter().zip(&reference).filter(apart).count();
            let tinted = reference.iter().filter(|colour| colour.min_element() < 0.9).count();
            println!("{size:?}, {most}: {others} of {} {what} differ, {tinted} are dark", reference.len());
            assert!(others * 500 <= reference.len(), "{others} of {} {what}", reference.len());
            assert!(tinted * 4 >= reference.len());
        }
    }
    assert_silent(&context());
}

#[test]
fn pictures_equal_the_reference() {
    for world in [World::room(), World::textured_room(), World::glossy_room()] {
        pictures_equal_the_reference_in(&world);
    }
}

fn pictures_equal_the_reference_in(world: &World) {
    let has_images = !world.coordinates.is_empty();
    let mut random = Random::new(73);
    for (size, most, fraction) in [
        ([13, 11], 32, [1.0, 1.0]),
        ([31, 17], 64, [0.0, 1.0]),
        ([31, 17], 64, [1.0, 0.0]),
        ([31, 17], 0, [1.0; 2]),
    ] {
        let frame = Frame::new(world, &lights(), &camera(size, 1.0), most);
        let indirect: Vec<Vec3> = frame.pixels.iter().map(|_| 1.0 + random.cube()).collect();
        let buffer = Buffer::from_slice(&world.context, "indirect", &indirect).unwrap();
        let points = frame.antialias.capacity.points.max(1);
        let at_edges: Vec<Vec3> = (0..points).map(|_| 1.0 + random.cube()).collect();
        let edge_buffer = Buffer::from_slice(&world.context, "edge irradiance", &at_edges).unwrap();
        let pass = Compose::new(&world.context, &world.buffers, size, true).unwrap();
        let random_gloss =
            |random: &mut Random| PixelGloss { direct: 1.0 + random.cube(), indirect: 1.0 + random.cube() };
        let radiances: Vec<PixelGloss> = frame.pixels.iter().map(|_| random_gloss(&mut random)).collect();
        let gloss = Buffer::from_slice(&world.context, "gloss radiance", &radiances).unwrap();
        let irradiances = Irradiances {
            pixels: &frame.buffers[0],
            direct: &frame.buffers[1],
            indirect: &buffer,
            at_edges: &edge_buffer,
            gloss: Some(&gloss),
            antialias: &frame.antialias,
            colours: &frame.colours,
            emission_scale: Vec3::new(0.5, 2.0, 3.0),
        };
        let colours = |buffer: &Buffer| -> Vec<DVec3> {
            let packed = if has_images { buffer.read().unwrap() } else { Vec::new() };
            packed.into_iter().map(unpack_colour).collect()
        };
        let of_pixels = colours(&frame.colours.of_pixels);
        let of_edges = colours(&frame.colours.of_edges);
        let tint = |colours: &[DVec3], index: usize| if has_images { colours[index] } else { DVec3::ONE };
        let view = View::from(&camera(size, 1.0));
        world.context.run(|rec| pass.record(rec, &world.buffers, &view, irradiances, fraction)).unwrap();
        let radiance: Vec<Vec3> = pass.radiance.read().unwrap();
        let material_of = |side: u32| world.surfaces[side as usize / 2].material;
        let reflected = |pixel: usize, side: u32, colour: DVec3, direct: Vec3, light_of: Vec3| {
            if side == NO_SIDE {
                return DVec3::ZERO;
            }
            let albedo = world.materials[material_of(side) as usize].diffuse * colour.as_vec3();
            let light = irradiances.emission_scale;
            // A pixel's gloss is a mean over its glossy surface; other surface has none.
            let is_glossy = world.materials[material_of(side) as usize].specular != Vec3::ZERO;
            let gloss = if is_glossy {
                radiances[pixel]
            } else {
                PixelGloss { direct: Vec3::ZERO, indirect: Vec3::ZERO }
            };
            cpu::compose::compose(
                albedo,
                fraction[0] * light * direct,
                fraction[1] * light * light_of,
                light * (fraction[0] * gloss.direct + fraction[1] * gloss.indirect),
            )
        };
        let count = frame.samples_per_edge(frame.edge_count());
        let (fragments, firsts) = (frame.fragments(), frame.firsts());
        let surfaces = frame.fragment_surfaces();
        assert_eq!(fragments.is_empty(), most == 0);
        for (index, device) in radiance.iter().enumerate() {
            let number = frame.numbers[index];
            let is_sampled = count > 0 && number != NO_EDGE;
            if !is_sampled {
                let pixel = &frame.pixels[index];
                let tint = tint(&of_pixels, index);
                let reference = reflected(index, pixel.side, tint, frame.irradiance[index], indirect[index]);
                assert_near(*device, reference, FLOAT, 0.0, "centre");
                continue;
            }
            let own = firsts[number as usize]..firsts[number as usize + 1];
            let part = |number: usize| {
                let (fragment, side) = (&fragments[number], surfaces[number].side);
                let direct = frame.irradiance[frame.pixels.len() + number];
                let weight = f64::from(fragment.what >> 14) / f64::from(count);
                let source = frame.pixel_at(index as u32, fragment.what & 15) as usize;
                let point = fragment.point;
                let light_of = if point == u32::MAX { indirect[source] } else { at_edges[point as usize] };
                weight * reflected(index, side, tint(&of_edges, number), direct, light_of)
            };
            assert_near(*device, own.map(part).sum(), SUM, 0.0, "edge");
        }
    }
    assert_silent(&context());
}
