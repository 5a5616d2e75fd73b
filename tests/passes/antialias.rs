//! Antialiasing: which pixels are sampled, what their samples see, and what becomes of them.

use crate::common::{assert_silent, context};
use crate::world::{FLOAT, Random, SUM, World, assert_near, room, textured};
use glam::{DVec3, Vec3};
use lightpaths::cpu;
use lightpaths::cpu::antialias::Thresholds;
use lightpaths::cpu::pixel_colours::colour_through;
use lightpaths::cpu::sampling::sample_3d;
use lightpaths::cpu::textures::unpack_colour;
use lightpaths::gpu::Buffer;
use lightpaths::gpu::barrier::COMPUTE_TO_COMPUTE;
use lightpaths::passes::frame::antialias::{Antialias, CONTRAST, CREASE, EdgeSample, STEP};
use lightpaths::passes::frame::compose::{Compose, Irradiances};
use lightpaths::passes::frame::direct::Direct;
use lightpaths::passes::frame::pixel_colours::{POINTS, PixelColours};
use lightpaths::passes::frame::primary::Primary;
use lightpaths::scene::{Camera, shapes};
use lightpaths::types::{LightSource, NO_SIDE, PixelSurface, View};

/// A frame's part up to the edge samples.
struct Frame {
    view: View,
    pixels: Vec<PixelSurface>,
    direct: Vec<Vec3>,
    antialias: Antialias,
    offsets: Vec<u32>,
    buffers: [Buffer; 2],
    colours: PixelColours,
}

impl Frame {
    fn new(world: &World, lights: &[LightSource], camera: &Camera, most_samples: u32) -> Self {
        Self::with_room(world, lights, camera, most_samples, u32::MAX)
    }

    /// With room for so many samples at most.
    fn with_room(
        world: &World,
        lights: &[LightSource],
        camera: &Camera,
        most_samples: u32,
        room: u32,
    ) -> Self {
        let view = View::from(camera);
        let size = camera.size;
        let primary = Primary::new(&world.context, size[0] * size[1]).unwrap();
        let direct = Direct::new(&world.context, size[0] * size[1]).unwrap();
        let mut antialias = Antialias::new(&world.context, size, most_samples).unwrap();
        antialias.capacity = antialias.capacity.min(room);
        let pixel_count = size[0] * size[1];
        let colours =
            PixelColours::new(&world.context, &world.buffers, pixel_count, antialias.capacity).unwrap();
        let table = Buffer::from_slice(&world.context, "lights", lights).unwrap();
        let count = lights.len() as u32;
        world
            .context
            .run(|rec| {
                primary.record(rec, &world.buffers, &view);
                rec.barrier(COMPUTE_TO_COMPUTE);
                direct.record(rec, &world.buffers, &table, count, &primary.pixels, size);
                rec.barrier(COMPUTE_TO_COMPUTE);
                let (pixels, irradiance) = (&primary.pixels, &direct.irradiance);
                antialias.record(rec, &world.buffers, &view, &table, count, pixels, irradiance);
                rec.barrier(COMPUTE_TO_COMPUTE);
                colours.record(rec, &world.buffers, &view, pixels);
                colours.record_edges(rec, &world.buffers, &view, &antialias);
            })
            .unwrap();
        Self {
            view,
            pixels: primary.pixels.read().unwrap(),
            direct: direct.irradiance.read().unwrap(),
            offsets: antialias.offsets.read().unwrap(),
            antialias,
            buffers: [primary.pixels, direct.irradiance],
            colours,
        }
    }

    fn edge_count(&self) -> u32 {
        *self.offsets.last().unwrap()
    }

    fn edge_pixels(&self) -> Vec<u32> {
        (0..self.pixels.len()).filter(|&i| self.offsets[i + 1] > self.offsets[i]).map(|i| i as u32).collect()
    }

    fn samples_per_edge(&self) -> u32 {
        cpu::antialias::samples_per_edge(
            self.edge_count(),
            self.antialias.most_samples,
            self.antialias.capacity,
        )
    }

    fn samples(&self) -> Vec<EdgeSample> {
        let count = self.edge_count() * self.samples_per_edge();
        self.antialias.edge_samples.read_range(0, count as usize).unwrap()
    }
}

fn camera(size: [u32; 2], distance: f32) -> Camera {
    let position = Vec3::new(0.1, 0.05, 0.48) * distance;
    let target = Vec3::new(-0.1, -0.2, 0.0);
    Camera { name: "camera".to_owned(), position, target, up: Vec3::Y, fov_y_degrees: 95.0, size }
}

fn lights() -> Vec<LightSource> {
    vec![
        LightSource::point(Vec3::new(0.1, 0.7, -0.2), Vec3::new(1.0, 2.0, 3.0)),
        LightSource::point(Vec3::new(-0.9, -0.7, 0.45), Vec3::new(1.0, 0.0, 1e-4)),
    ]
}

#[test]
fn edge_pixels_equal_the_twin() {
    let room = World::room();
    let squares = World::new(&shapes::facing_squares(1.0, 1.0, 0.5), 8);
    let [crease, step, contrast] = [CREASE, STEP, CONTRAST].map(f64::from);
    let thresholds = Thresholds { crease, step, contrast };
    for (world, distance) in [(&room, 1.0), (&squares, 4.0)] {
        for size in [[1, 1], [7, 9], [8, 8], [9, 7], [31, 17], [64, 3], [97, 53]] {
            let frame = Frame::new(world, &lights(), &camera(size, distance), 64);
            let Frame { pixels, direct, .. } = &frame;
            let twin = cpu::antialias::edges(thresholds, &world.surfaces, size, pixels, direct);
            let marked = frame.edge_pixels();
            let is_marked = |index: usize| marked.binary_search(&(index as u32)).is_ok();
            let differ = (0..twin.len()).filter(|&index| twin[index] != is_marked(index)).count();
            // Differences that reach a threshold by a hair.
            assert!(differ * 500 <= pixels.len(), "{differ} of {} pixels differ", pixels.len());
            let share = marked.len() as f64 / pixels.len() as f64;
            assert!(pixels.len() < 500 || (0.01..0.95).contains(&share), "{share} of {size:?}");
        }
    }
    assert_silent(&context());
}

#[test]
fn edge_samples_equal_the_twin() {
    let room = World::room();
    let squares = World::new(&shapes::facing_squares(1.0, 1.0, 0.5), 8);
    let lights = lights();
    for (world, distance, size, most) in
        [(&room, 1.0, [13, 11], 128), (&room, 1.0, [31, 17], 64), (&squares, 4.0, [33, 29], 32)]
    {
        let frame = Frame::new(world, &lights, &camera(size, distance), most);
        let count = frame.samples_per_edge();
        let samples = frame.samples();
        assert!(count >= 4 && !samples.is_empty(), "{count} samples of {} pixels", frame.edge_count());
        let (mut other_sides, mut other_sources, mut other_light, mut borrowed) = (0, 0, 0, 0);
        for (pixel, own) in frame.edge_pixels().into_iter().zip(samples.chunks_exact(count as usize)) {
            for (number, sample) in (0..).zip(own) {
                let seen = cpu::antialias::sample(world.geometry(), &frame.view, pixel, number);
                let Some(seen) = seen.filter(|seen| seen.side == sample.side) else {
                    other_sides += usize::from(seen.is_some() || sample.side != NO_SIDE);
                    continue;
                };
                let (least, source) = cpu::antialias::source(&frame.view, &frame.pixels, pixel, &seen);
                if source != sample.source {
                    // As good, but for an error of f32.
                    let cost = cpu::antialias::dissimilarity(&seen, &frame.pixels[sample.source as usize]);
                    other_sources += usize::from(cost > least + 1e-3 * (1.0 + least));
                }
                borrowed += usize::from(sample.source != pixel);
                let surface = PixelSurface {
                    position: seen.hit.position.as_vec3(),
                    side: seen.side,
                    normal: seen.normal.as_vec3(),
                    footprint: seen.footprint as f32,
                };
                let twin = cpu::direct::direct(world.geometry(), &lights, &surface);
                let overhead = |light: &LightSource| {
                    f64::from(
                        light.emission.max_element() / (light.position - surface.position).length_squared(),
                    )
                };
                // A hit at a slant of 1 in 100 moves a hundred times as far as the ray's error.
                let bound = 1e-3 * lights.iter().map(overhead).sum::<f64>();
                other_light += usize::from((sample.direct.as_dvec3() - twin).abs().max_element() > bound);
            }
        }
        let what = format!(
            "of {} samples: {other_sides} sides, {other_sources} sources, {other_light} lit",
            samples.len()
        );
        println!("{what}, {borrowed} borrow");
        assert!(other_sides * 250 <= samples.len(), "{what}");
        assert!(other_sources * 250 <= samples.len(), "{what}");
        assert!(other_light * 100 <= samples.len(), "{what}");
        assert!(borrowed * 20 > samples.len(), "{what}, {borrowed} borrow");
    }
    assert_silent(&context());
}

#[test]
fn many_edges_share_the_room_that_there_is() {
    for (edges, most, capacity, expected) in [
        (0, 16, 100, 16),
        (1, 16, 100, 16),
        (6, 16, 100, 16),
        (7, 16, 100, 14),
        (25, 16, 100, 4),
        (26, 16, 100, 0),
        (5, 0, 100, 0),
        (5, 3, 100, 0),
        (5, 16, 0, 0),
    ] {
        assert_eq!(cpu::antialias::samples_per_edge(edges, most, capacity), expected);
    }
    let world = World::room();
    let camera = camera([31, 17], 1.0);
    let edges = Frame::new(&world, &lights(), &camera, 0).edge_count();
    assert_eq!(edges, 0, "nothing is marked where antialiasing is off");
    let edges = Frame::new(&world, &lights(), &camera, 16).edge_count();
    assert!(edges > 30);
    for (room, expected) in
        [(u32::MAX, 16), (16 * edges, 16), (16 * edges - 1, 15), (4 * edges, 4), (4 * edges - 1, 0)]
    {
        let frame = Frame::with_room(&world, &lights(), &camera, 16, room);
        assert_eq!(frame.samples_per_edge(), expected);
        assert_eq!(frame.samples().len() as u32, expected * edges);
    }
    assert_silent(&context());
}

#[test]
fn colours_of_pixels_and_samples_equal_the_twin() {
    let world = World::new(&textured(room()), 16);
    for (size, most) in [([1, 1], 16), ([31, 17], 256), ([31, 17], 0)] {
        let frame = Frame::new(&world, &lights(), &camera(size, 1.0), most);
        let (geometry, view) = (world.geometry(), &frame.view);
        let count = frame.samples_per_edge();
        let samples = frame.samples();
        let of_pixel = |(index, pixel): (u32, &PixelSurface)| {
            cpu::pixel_colours::pixel_colour(geometry, view, index, pixel.side, POINTS)
        };
        let of_sample = |(index, sample): (u32, &EdgeSample)| {
            let pixel = frame.edge_pixels()[(index / count) as usize];
            let corner = DVec3::new(f64::from(pixel % size[0]), f64::from(pixel / size[0]), 0.0);
            let point = corner + sample_3d(index % count, pixel).as_dvec3();
            let seen = Some(sample.side).filter(|&side| side != NO_SIDE);
            seen.and_then(|side| colour_through(geometry, view, point.truncate(), side)).unwrap_or_default()
        };
        let pixels: Vec<DVec3> = (0..).zip(&frame.pixels).map(of_pixel).collect();
        let samples: Vec<DVec3> = (0..).zip(&samples).map(of_sample).collect();
        for (what, buffer, twin) in
            [("pixels", &frame.colours.of_pixels, pixels), ("samples", &frame.colours.of_edges, samples)]
        {
            let found: Vec<u32> = buffer.read_range(0, twin.len()).unwrap();
            // Half of the last bit of a packed root, and the error of f32 texture coordinates at a slant.
            let apart =
                |(found, twin): &(&u32, &DVec3)| (unpack_colour(**found) - *twin).abs().max_element() > 2e-3;
            let others = found.iter().zip(&twin).filter(apart).count();
            let tinted = twin.iter().filter(|colour| colour.min_element() < 0.9).count();
            println!("{size:?}, {most}: {others} of {} {what} differ, {tinted} are dark", twin.len());
            assert!(others * 500 <= twin.len(), "{others} of {} {what}", twin.len());
            assert!(tinted * 4 >= twin.len());
        }
    }
    assert_silent(&context());
}

#[test]
fn pictures_equal_the_twin() {
    for world in [World::room(), World::new(&textured(room()), 16)] {
        pictures_equal_the_twin_in(&world);
    }
}

fn pictures_equal_the_twin_in(world: &World) {
    let has_images = !world.coordinates.is_empty();
    let mut random = Random::new(73);
    for (size, most, share) in [
        ([13, 11], 128, [1.0, 1.0]),
        ([31, 17], 256, [0.0, 1.0]),
        ([31, 17], 256, [1.0, 0.0]),
        ([31, 17], 0, [1.0; 2]),
    ] {
        let frame = Frame::new(world, &lights(), &camera(size, 1.0), most);
        let indirect: Vec<Vec3> = frame.pixels.iter().map(|_| 1.0 + random.cube()).collect();
        let buffer = Buffer::from_slice(&world.context, "indirect", &indirect).unwrap();
        let pass = Compose::new(&world.context, &world.buffers, frame.pixels.len() as u32).unwrap();
        let irradiances = Irradiances {
            pixels: &frame.buffers[0],
            direct: &frame.buffers[1],
            indirect: &buffer,
            antialias: &frame.antialias,
            colours: &frame.colours,
        };
        let colours = |buffer: &Buffer| -> Vec<DVec3> {
            let packed = if has_images { buffer.read().unwrap() } else { Vec::new() };
            packed.into_iter().map(unpack_colour).collect()
        };
        let of_pixels = colours(&frame.colours.of_pixels);
        let of_edges = colours(&frame.colours.of_edges);
        let tint = |colours: &[DVec3], index: usize| if has_images { colours[index] } else { DVec3::ONE };
        world.context.run(|rec| pass.record(rec, &world.buffers, irradiances, share)).unwrap();
        let radiance: Vec<Vec3> = pass.radiance.read().unwrap();
        let reflected = |side: u32, direct: Vec3, source: usize| {
            if side == NO_SIDE {
                return DVec3::ZERO;
            }
            let material = world.surfaces[side as usize / 2].material;
            let albedo = world.materials[material as usize].diffuse;
            cpu::compose::compose(albedo, share[0] * direct, share[1] * indirect[source])
        };
        let count = frame.samples_per_edge() as usize;
        let samples = frame.samples();
        assert_eq!(samples.is_empty(), most == 0);
        for (index, device) in radiance.iter().enumerate() {
            let first = frame.offsets[index] as usize;
            let is_sampled = count > 0 && frame.offsets[index + 1] as usize > first;
            if !is_sampled {
                let pixel = &frame.pixels[index];
                let twin = reflected(pixel.side, frame.direct[index], index) * tint(&of_pixels, index);
                assert_near(*device, twin, FLOAT, 0.0, "centre");
                continue;
            }
            let own = &samples[first * count..(first + 1) * count];
            let own = own.iter().zip(first * count..);
            let reflected = |(sample, index): (&EdgeSample, usize)| {
                reflected(sample.side, sample.direct, sample.source as usize) * tint(&of_edges, index)
            };
            let sum: DVec3 = own.map(reflected).sum();
            assert_near(*device, sum / count as f64, SUM, 0.0, "edge");
        }
    }
    assert_silent(&context());
}
