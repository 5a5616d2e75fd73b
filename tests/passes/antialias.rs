//! Antialiasing: the pixels that are sampled, and the surfaces that their samples see.

use crate::common::{assert_silent, context};
use crate::path_trace;
use crate::world::World;
use glam::{DVec2, Vec3};
use lightpaths::cpu;
use lightpaths::cpu::antialias::Thresholds;
use lightpaths::cpu::lights::PointSamples;
use lightpaths::cpu::primary::seen_through;
use lightpaths::gpu::Buffer;
use lightpaths::gpu::barrier::COMPUTE_TO_COMPUTE;
use lightpaths::passes::frame::antialias::{
    Antialias, COVERAGE, CREASE, EdgeCapacity, Fragment, MASKED, MAX_FRAGMENTS, NO_EDGE, SHADING, STEP,
};
use lightpaths::passes::frame::direct::Direct;
use lightpaths::passes::frame::pixel_colours::PixelColours;
use lightpaths::passes::frame::primary::Primary;
use lightpaths::passes::{OneLight, light_sources};
use lightpaths::scene::{Camera, OpacityMaps, shapes};
use lightpaths::types::{LIGHT_AREA, LightSource, MeshEdge, NO_SIDE, PixelSurface, SHAPE_TWO_SIDED, View};

/// The passes of a frame up to the per-light irradiance buffers.
pub(crate) struct Frame {
    pub(crate) view: View,
    pub(crate) pixels: Vec<PixelSurface>,
    /// For each light: its irradiance buffer before and after the averaging of shadow edges.
    pub(crate) irradiances: Vec<[Vec<f32>; 2]>,
    /// For each light: the number of pixels that were averaged anew, and the fragments that were.
    pub(crate) shadow_counts: Vec<u32>,
    pub(crate) mixed: Vec<Vec<u32>>,
    pub(crate) irradiance: Vec<Vec3>,
    pub(crate) antialias: Antialias,
    pub(crate) numbers: Vec<u32>,
    pub(crate) buffers: [Buffer; 2],
    pub(crate) colours: PixelColours,
}

/// See [`Antialias::smooth_m`].
pub(crate) const SMOOTH_M: f32 = 0.03;

impl Frame {
    pub(crate) fn new(world: &World, lights: &[LightSource], camera: &Camera, light_samples: u32) -> Self {
        Self::with_room(world, lights, camera, light_samples, [u32::MAX; 2])
    }

    /// With capacity for at most `samples` samples and `fragments` fragments.
    pub(crate) fn with_room(
        world: &World,
        lights: &[LightSource],
        camera: &Camera,
        light_samples: u32,
        [samples, fragments]: [u32; 2],
    ) -> Self {
        let (view, size, context) = (View::from(camera), camera.size, &world.context);
        let primary = Primary::new(context, size[0] * size[1]).unwrap();
        let mut antialias = Antialias::new(context, size, light_samples).unwrap();
        let capacity = antialias.capacity;
        // Some pixels are wider than this, and some narrower.
        antialias.smooth_m = SMOOTH_M;
        antialias.capacity = EdgeCapacity {
            samples: capacity.samples.min(samples),
            fragments: capacity.fragments.min(fragments),
            ..capacity
        };
        let direct = Direct::new(context, size, capacity.fragments).unwrap();
        let colours =
            PixelColours::new(context, &world.buffers, size[0] * size[1], capacity.fragments).unwrap();
        let table = Buffer::from_slice(context, "lights", lights).unwrap();
        let irradiance =
            || Buffer::storage(context, "irradiance", 4 * u64::from(direct.point_count())).unwrap();
        let buffers: Vec<Buffer> = lights.iter().map(|_| irradiance()).collect();
        context
            .run(|rec| {
                primary.record(rec, &world.buffers, &view);
                rec.barrier(COMPUTE_TO_COMPUTE);
                direct.record_batches(rec, &world.buffers, &primary.pixels);
                antialias.record(rec, &world.buffers, &view, &primary.pixels);
                rec.barrier(COMPUTE_TO_COMPUTE);
                colours.record(rec, &world.buffers, &view, &primary.pixels, Some(&antialias));
            })
            .unwrap();
        let (mut irradiances, mut shadow_counts, mut mixed) = (Vec::new(), Vec::new(), Vec::new());
        let primary_count = (size[0] * size[1]) as usize;
        for ((index, light), irradiance) in (0..).zip(lights).zip(&buffers) {
            let marks_penumbra = antialias.is_on();
            let light = OneLight { marks_penumbra, ..OneLight::new(&table, index, light) };
            context
                .run(|rec| {
                    let mut pass = rec.pass("direct");
                    direct.record(&mut pass, &world.buffers, light, &primary.pixels, irradiance);
                })
                .unwrap();
            let before: Vec<f32> = irradiance.read().unwrap();
            // Rays that cannot bring light change neither the light nor the marks.
            let untiring = OneLight { traces_all: true, ..light };
            context
                .run(|rec| {
                    let mut pass = rec.pass("direct");
                    direct.record(&mut pass, &world.buffers, untiring, &primary.pixels, irradiance);
                })
                .unwrap();
            let bits = |values: &[f32]| {
                values[..primary_count].iter().map(|value| value.to_bits()).collect::<Vec<_>>()
            };
            assert_eq!(bits(&irradiance.read().unwrap()), bits(&before), "light {index}");
            let groups = Antialias::groups(context).unwrap();
            // No pass writes them if antialiasing is off.
            context.run(|rec| rec.fill_zero(&groups)).unwrap();
            context
                .run(|rec| {
                    let mut pass = rec.pass("shadow_edges");
                    let (pixels, irradiance) = (&primary.pixels, (irradiance, &groups));
                    antialias.record_light(&mut pass, &world.buffers, &view, light, pixels, irradiance);
                })
                .unwrap();
            irradiances.push([before, irradiance.read().unwrap()]);
            let count = Antialias::counted(&groups).unwrap();
            let words: Vec<u32> = groups.read().unwrap();
            for (first, count, of_group) in [(0, count, 4), (8, words[11], 8)] {
                let swizzled =
                    if count == 0 { [0; 3] } else { context.tuning().swizzled(count.div_ceil(of_group)) };
                assert_eq!(words[first..first + 3], swizzled, "{count} items, {of_group} a workgroup");
            }
            shadow_counts.push(count);
            let mut listed: Vec<u32> = antialias.fragments.mixed.read_range(0, words[11] as usize).unwrap();
            listed.sort_unstable();
            let fragments: Vec<Fragment> = antialias.fragments.list.read().unwrap();
            let samples =
                listed.iter().map(|&index| (fragments[index as usize].what >> 14).min(light_samples));
            assert_eq!(samples.sum::<u32>(), words[12], "samples of mixed fragments");
            mixed.push(listed);
        }
        let rows: Vec<_> = lights.iter().map(|light| light.emission).zip(&buffers).collect();
        context.run(|rec| direct.record_sum(rec, &antialias, &rows)).unwrap();
        Self {
            view,
            pixels: primary.pixels.read().unwrap(),
            irradiances,
            shadow_counts,
            mixed,
            irradiance: direct.irradiance.read().unwrap(),
            numbers: antialias.numbers.read().unwrap(),
            antialias,
            buffers: [primary.pixels, direct.irradiance],
            colours,
        }
    }

    pub(crate) fn edge_count(&self) -> u32 {
        *self.numbers.last().unwrap()
    }

    pub(crate) fn edge_pixels(&self) -> Vec<u32> {
        self.antialias.edge_pixels.read_range(0, self.edge_count() as usize).unwrap()
    }

    /// Number of samples of an edge pixel if there are `edge_count`.
    pub(crate) fn samples_per_edge(&self, edge_count: u32) -> u32 {
        let EdgeCapacity { light_samples, samples, fragments, .. } = self.antialias.capacity;
        cpu::antialias::samples_per_edge(edge_count, light_samples, [samples, fragments])
    }

    /// Samples of the edges of geometry: the side and the fragment of each.
    pub(crate) fn samples(&self) -> Vec<(u32, usize)> {
        let (edges, count) = (self.edge_count() as usize, self.samples_per_edge(self.edge_count()) as usize);
        let words = count.div_ceil(MASKED as usize);
        let sides: Vec<u32> = self.antialias.edge_samples.read_range(0, edges * count).unwrap();
        let masks: Vec<[u32; 4]> = self.antialias.fragments.of_samples.read_range(0, edges * words).unwrap();
        let own = |index: usize| {
            let (edge, number) = (index / count, index % count);
            let masks = masks[edge * words + number / MASKED as usize];
            let bits = masks.map(|mask| mask >> (number % MASKED as usize) & 1);
            assert!(bits.iter().sum::<u32>() <= 1, "sample {number} of edge {edge} is of several fragments");
            bits.iter().position(|&bit| bit != 0).unwrap_or(MAX_FRAGMENTS as usize)
        };
        sides.into_iter().enumerate().map(|(index, side)| (side, own(index))).collect()
    }

    /// Index of the first fragment of each edge pixel; then the number of fragments.
    pub(crate) fn firsts(&self) -> Vec<usize> {
        let count = if self.antialias.is_on() { self.edge_count() as usize + 1 } else { 0 };
        let firsts: Vec<u32> = self.antialias.fragments.firsts.read_range(0, count).unwrap();
        firsts.into_iter().map(|first| first as usize).collect()
    }

    /// All fragments, edge pixel by edge pixel.
    pub(crate) fn fragments(&self) -> Vec<Fragment> {
        let count = self.firsts().last().copied().unwrap_or(0);
        self.antialias.fragments.list.read_range(0, count).unwrap()
    }

    /// Their points.
    pub(crate) fn fragment_surfaces(&self) -> Vec<PixelSurface> {
        self.antialias.fragments.surfaces.read_range(0, self.fragments().len()).unwrap()
    }

    /// The pixel at one of the nine places around another.
    pub(crate) fn pixel_at(&self, pixel: u32, place: u32) -> u32 {
        let [width, height] = [self.view.width, self.view.height];
        let x = (pixel % width + place % 3).saturating_sub(1).min(width - 1);
        let y = (pixel / width + place / 3).saturating_sub(1).min(height - 1);
        y * width + x
    }
}

pub(crate) fn camera(size: [u32; 2], distance: f32) -> Camera {
    let position = Vec3::new(0.1, 0.05, 0.48) * distance;
    let target = Vec3::new(-0.1, -0.2, 0.0);
    Camera { name: "camera".to_owned(), position, target, up: Vec3::Y, fov_y_degrees: 95.0, size }
}

pub(crate) fn lights() -> Vec<LightSource> {
    vec![
        LightSource::point(Vec3::new(0.1, 0.7, -0.2), Vec3::new(1.0, 2.0, 3.0)),
        LightSource::point(Vec3::new(-0.9, -0.7, 0.45), Vec3::new(1.0, 0.0, 1e-4)),
    ]
}

#[test]
fn edge_pixels_equal_the_reference() {
    let room = World::room();
    let squares = World::new(&shapes::facing_squares(1.0, 1.0, 0.5), 8);
    let thresholds = Thresholds { crease: f64::from(CREASE), step: f64::from(STEP) };
    let (mut shadows, mut between, mut through_holes) = (0, 0, 0);
    let mut cut = shapes::facing_squares(1.0, 1.0, 0.5);
    let levels = vec![7; cut.triangles.len()];
    cut.opacity = OpacityMaps::new(&levels, |_, centre| (23.0 * centre.y).fract() < 0.15);
    let holes = World::new(&cut, 8);
    for (world, distance) in [(&room, 1.0), (&squares, 4.0), (&holes, 2.0)] {
        for size in [[1, 1], [7, 9], [8, 8], [9, 7], [31, 17], [64, 3], [97, 53]] {
            let frame = Frame::new(world, &lights(), &camera(size, distance), 64);
            let pixels = &frame.pixels;
            let beside = cpu::antialias::edges(thresholds, &world.surfaces, size, pixels);
            let list: Vec<MeshEdge> = world.buffers.mesh_edges.read().unwrap();
            let crossed = cpu::antialias::crossed(world.geometry(), &frame.view, &list, pixels);
            let holed = cpu::antialias::show_holes(world.geometry(), &frame.view, pixels);
            let reference: Vec<bool> =
                (0..pixels.len()).map(|i| beside[i] || crossed[i] || holed[i]).collect();
            between += (0..pixels.len()).filter(|&pixel| crossed[pixel] && !beside[pixel]).count();
            through_holes += (0..pixels.len()).filter(|&i| holed[i] && !beside[i] && !crossed[i]).count();
            let marked = frame.edge_pixels();
            let is_marked = |index: usize| frame.numbers[index] != NO_EDGE;
            // In the order of tiles; each pixel stores its index in it.
            let expected = cpu::antialias::tile_order(size).filter(|&pixel| is_marked(pixel as usize));
            assert_eq!(marked, expected.collect::<Vec<_>>(), "{size:?}");
            assert!((0..).zip(&marked).all(|(number, &pixel)| frame.numbers[pixel as usize] == number));
            let differ = (0..reference.len()).filter(|&index| reference[index] != is_marked(index)).count();
            // Differences very close to a threshold.
            assert!(differ * 500 <= pixels.len(), "{differ} of {} pixels differ", pixels.len());
            let fraction = marked.len() as f64 / pixels.len() as f64;
            assert!(pixels.len() < 500 || (0.01..0.95).contains(&fraction), "{fraction} of {size:?}");

            let edges: Vec<bool> = (0..pixels.len()).map(is_marked).collect();
            for (irradiances, &count) in frame.irradiances.iter().zip(&frame.shadow_counts) {
                let irradiance = &irradiances[0][..pixels.len()];
                let reference = cpu::antialias::shadow_edges(f64::from(SHADING), size, &edges, irradiance);
                let expected = reference.iter().filter(|marked| **marked).count();
                assert!(
                    expected.abs_diff(count as usize) * 500 <= pixels.len(),
                    "{count}, {expected} by the reference"
                );
                shadows += expected;
                // Only these pixels change.
                let changed =
                    (0..reference.len()).filter(|&pixel| irradiances[1][pixel] != irradiance[pixel]);
                let unmarked = changed.filter(|&pixel| !reference[pixel]).count();
                assert!(unmarked * 500 <= pixels.len(), "{unmarked} unmarked pixels changed");
            }
        }
    }
    assert!(shadows > 500 && between > 50 && through_holes > 50, "{shadows}, {between}, {through_holes}");
    assert_silent(&context());
}

#[test]
fn edge_samples_equal_the_reference() {
    let room = World::room();
    let squares = World::new(&shapes::facing_squares(1.0, 1.0, 0.5), 8);
    for (world, distance, size, most, capacity) in [
        (&room, 1.0, [13, 11], 32, u32::MAX),
        (&room, 1.0, [31, 17], 16, u32::MAX),
        // The last pixels have no roots.
        (&room, 1.0, [31, 17], 16, 4_000),
        (&squares, 4.0, [33, 29], 8, u32::MAX),
    ] {
        let room = [capacity, u32::MAX];
        let frame = Frame::with_room(world, &[], &camera(size, distance), most, room);
        let count = frame.samples_per_edge(frame.edge_count());
        assert_eq!(count < COVERAGE * most, capacity < u32::MAX);
        let samples = frame.samples();
        assert!(count >= 4 && !samples.is_empty(), "{count} samples of {} pixels", frame.edge_count());
        let (mut other_sides, mut outside) = (0, 0);
        for (pixel, own) in frame.edge_pixels().into_iter().zip(samples.chunks_exact(count as usize)) {
            for (index, &(side, _)) in (0..).zip(own) {
                let seen = cpu::antialias::edge_sample(world.geometry(), &frame.view, pixel, index);
                // A ray may pass an edge on the other side.
                other_sides += usize::from(seen.map_or(NO_SIDE, |seen| seen.side) != side);
                outside += usize::from(side == NO_SIDE);
            }
        }
        let total = samples.len();
        println!("of {total} samples: {other_sides} other sides, {outside} see nothing");
        // Only the squares have an outline: the room is closed.
        let has_outline = frame.pixels.iter().any(|pixel| pixel.side == NO_SIDE);
        assert_eq!(has_outline, outside > total / 20, "{outside} of {total} samples see nothing");
        assert!(other_sides * 250 <= total, "{other_sides} of {total} samples see another side");
    }
    assert_silent(&context());
}

/// At an outline, a pixel shows only the fraction that its samples cover.
#[test]
fn an_outline_covers_its_share_of_each_pixel() {
    let world = World::new(&shapes::facing_squares(1.0, 1.0, 0.5), 8);
    let (most, size, grid) = (16, [33, 29], 48);
    let frame = Frame::new(&world, &[], &camera(size, 4.0), most);
    let (geometry, samples) = (world.geometry(), frame.samples());
    let count = (COVERAGE * most) as usize;
    let (mut squares, mut fewer, mut pixels) = (0.0, 0.0, 0);
    for (pixel, own) in frame.edge_pixels().into_iter().zip(samples.chunks_exact(count)) {
        let corner = DVec2::new(f64::from(pixel % size[0]), f64::from(pixel / size[0]));
        let meets = |i: i32| {
            let within = (DVec2::new(f64::from(i % grid), f64::from(i / grid)) + 0.5) / f64::from(grid);
            seen_through(geometry, &frame.view, corner + within).is_some()
        };
        let covered = (0..grid * grid).filter(|&i| meets(i)).count() as f64 / f64::from(grid * grid);
        let fraction = |samples: &[(u32, usize)]| {
            samples.iter().filter(|sample| sample.0 != NO_SIDE).count() as f64 / samples.len() as f64
        };
        squares += (fraction(own) - covered).powi(2);
        fewer += (fraction(&own[..most as usize]) - covered).powi(2);
        pixels += 1;
    }
    let [rms, fewer] = [squares, fewer].map(|sum: f64| (sum / f64::from(pixels)).sqrt());
    println!("RMS {rms:.4} of {pixels} pixels, {fewer:.4} by a quarter of the samples");
    // 64 stratified samples of an edge: about 64^(-3/4) / 3.
    assert!(pixels > 40 && rms < 0.5 * fewer && rms < 0.02, "RMS {rms}, {fewer} by a quarter of the samples");
    assert_silent(&context());
}

/// Shadow edges on flat walls and on triangles with smooth normals: the mean of the light over
/// the pixel's samples.
#[test]
fn shadow_edges_equal_the_reference() {
    let room = path_trace::world();
    // Irradiance changes fast near a light, with or without a shadow. Only that of lights of which
    // points may see a part is then averaged.
    let near = LightSource {
        kind: LIGHT_AREA,
        axis: Vec3::Z,
        edge_u: 0.02 * Vec3::X,
        edge_v: 0.02 * Vec3::Y,
        area: 4e-4,
        samples: 8,
        stride: 5,
        modulus: 8,
        shape: SHAPE_TWO_SIDED,
        ..LightSource::point(Vec3::new(0.6, 0.3, -0.35), Vec3::ONE)
    };
    let sphere = World::new(&shapes::integrating_sphere(0.8, 2, 0.5, Vec3::ZERO, 1.0), 8);
    let mut lights = light_sources(&path_trace::lights());
    // This light takes several dispatches.
    (lights[2].samples, lights[2].stride, lights[2].modulus) = (40, 25, 41);
    let (mut flat, mut curved) = (0, 0);
    let near = [near];
    for (world, lights, size, most) in [
        (&room, &*lights, [23, 19], 16),
        (&room, &lights, [31, 17], 20),
        (&sphere, &near, [31, 17], 16),
        (&sphere, &near, [13, 11], 5),
    ] {
        let frame = Frame::new(world, lights, &camera(size, 1.0), most);
        for (light, [before, after]) in lights.iter().zip(&frame.irradiances) {
            let (mut changed, mut differ) = (0, 0);
            let one = OneLight::new(&frame.buffers[0], 0, light);
            for (pixel, centre) in (0_u32..).zip(&frame.pixels) {
                let index = pixel as usize;
                // The sign marks a penumbra.
                if before[index].abs() == after[index] {
                    continue;
                }
                changed += 1;
                let sample = |number| {
                    let found =
                        cpu::antialias::shadow_sample(world.geometry(), &frame.view, pixel, centre, number);
                    let samples = PointSamples::of_image_point(one.point_samples(), number, one.point_step());
                    let lit = |found| cpu::direct::irradiance_by(world.geometry(), light, &samples, &found);
                    found.map_or(0.0, lit)
                };
                let reference = (0..most).map(sample).sum::<f64>() / f64::from(most);
                differ +=
                    usize::from((f64::from(after[index]) - reference).abs() > 1e-3 * (reference + 1e-2));
                let leans = centre.normal.dot(world.geometry().normal(centre.side)) < 0.999;
                *if leans { &mut curved } else { &mut flat } += 1;
            }
            // A pixel has many shadow rays, and one of them may pass an edge on the other side.
            assert!(differ * 20 <= changed + 20, "{differ} of {changed} pixels of {size:?} differ");
        }
    }
    println!("{flat} flat, {curved} curved");
    assert!(flat > 100 && curved > 20, "{flat} flat, {curved} curved");
    assert_silent(&context());
}

/// Pixels that see a part of an area light are averaged, and no mark remains.
#[test]
fn penumbrae_equal_the_reference() {
    let room = path_trace::world();
    let mut lights = vec![light_sources(&path_trace::lights())[2]; 3];
    // One dispatch; several; too few samples for marks.
    (lights[1].samples, lights[1].stride, lights[1].modulus) = (17, 11, 18);
    (lights[2].samples, lights[2].stride, lights[2].modulus) = (3, 2, 3);
    let mut seen = 0;
    for size in [[23, 19], [64, 3], [97, 53]] {
        let frame = Frame::new(&room, &lights, &camera(size, 1.0), 16);
        for (light, [before, after]) in lights.iter().zip(&frame.irradiances) {
            let is_marked = |pixel: usize| before[pixel].is_sign_negative();
            let is_edge = |pixel: usize| frame.numbers[pixel] != NO_EDGE;
            let pixels = 0..frame.pixels.len();
            if light.samples < 4 {
                assert_eq!(pixels.filter(|&pixel| is_marked(pixel)).count(), 0);
                continue;
            }
            let reference =
                |pixel: &usize| cpu::direct::is_in_penumbra(room.geometry(), light, &frame.pixels[*pixel]);
            let differ = pixels.clone().filter(|pixel| reference(pixel) != is_marked(*pixel)).count();
            // A ray may pass an edge on the other side.
            assert!(differ * 100 <= pixels.len(), "{differ} of {} pixels differ", pixels.len());
            let marked = pixels.filter(|&pixel| is_marked(pixel) && !is_edge(pixel));
            seen += marked.count();
            let mut after = after[..frame.pixels.len() + frame.fragments().len()].iter();
            assert!(after.all(|value| value.is_sign_positive()), "no mark remains");
        }
    }
    assert!(seen > 200, "{seen} pixels in penumbrae");
    // Without samples at edges there are no marks.
    let frame = Frame::new(&room, &lights, &camera([23, 19], 1.0), 0);
    let mut pixels = frame.irradiances.iter().flat_map(|[before, _]| &before[..frame.pixels.len()]);
    assert!(pixels.all(|value| value.is_sign_positive()));
    assert_silent(&context());
}

#[test]
fn many_edges_share_the_room_that_there_is() {
    for (edges, most, capacity, expected) in [
        (0, 4, 100, 16),
        (1, 4, 100, 16),
        (6, 4, 100, 16),
        (7, 4, 100, 8),
        (12, 4, 100, 8),
        (13, 4, 100, 0),
        (1, 3, 100, 16),
        (1, 256, 1000, 256),
        (5, 0, 100, 0),
        (5, 4, 0, 0),
    ] {
        assert_eq!(cpu::antialias::samples_per_edge(edges, most, [capacity, u32::MAX]), expected);
    }
    for (edges, fragments, expected) in [(0, 9, 4), (2, 9, 4), (3, 9, 3), (4, 9, 2), (5, 9, 1), (10, 9, 0)] {
        assert_eq!(cpu::antialias::fragments_per_edge(edges, fragments), expected);
        let samples = cpu::antialias::samples_per_edge(edges, 4, [u32::MAX, fragments]);
        assert_eq!(samples, if expected < 2 { 0 } else { 16 });
    }
    let world = World::room();
    let camera = camera([31, 17], 1.0);
    let edges = Frame::new(&world, &lights(), &camera, 0).edge_count();
    assert_eq!(edges, 0, "nothing is marked where antialiasing is off");
    let edges = Frame::new(&world, &lights(), &camera, 4).edge_count();
    assert!(edges > 30);
    for (room, expected) in
        [(u32::MAX, 16), (16 * edges, 16), (16 * edges - 1, 8), (8 * edges, 8), (8 * edges - 1, 0)]
    {
        let room = [room, u32::MAX];
        let frame = Frame::with_room(&world, &lights(), &camera, 4, room);
        assert_eq!(frame.samples_per_edge(edges), expected);
        assert_eq!(frame.samples().len() as u32, expected * edges);
        assert_eq!(frame.fragments().is_empty(), expected == 0);
    }
    assert_silent(&context());
}
