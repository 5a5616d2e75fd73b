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
    ALIKE, Antialias, CONTRAST, CREASE, EdgeCapacity, EdgeSample, EdgeSlot, NO_EDGE, OUTLINE_POINTS, STEP,
};
use lightpaths::passes::frame::direct::Direct;
use lightpaths::passes::frame::pixel_colours::PixelColours;
use lightpaths::passes::frame::primary::Primary;
use lightpaths::passes::{OneLight, light_sources};
use lightpaths::scene::{Camera, shapes};
use lightpaths::types::{LightSource, NO_SIDE, PixelSurface, View};

/// The passes of a frame up to the per-light irradiance buffers.
pub(crate) struct Frame {
    pub(crate) view: View,
    pub(crate) pixels: Vec<PixelSurface>,
    /// For each light: its irradiance buffer before and after the averaging of shadow edges.
    pub(crate) irradiances: Vec<[Vec<f32>; 2]>,
    /// For each light: the number of pixels that were averaged anew, and the samples that its
    /// edge pixels need.
    pub(crate) shadow_counts: Vec<u32>,
    pub(crate) needs: Vec<Vec<u32>>,
    pub(crate) irradiance: Vec<Vec3>,
    pub(crate) antialias: Antialias,
    pub(crate) numbers: Vec<u32>,
    pub(crate) buffers: [Buffer; 2],
    pub(crate) colours: PixelColours,
}

/// See [`Antialias::smooth_m`].
const SMOOTH_M: f32 = 0.03;

impl Frame {
    pub(crate) fn new(world: &World, lights: &[LightSource], camera: &Camera, max_samples: u32) -> Self {
        Self::with_room(world, lights, camera, max_samples, [u32::MAX; 2])
    }

    /// With capacity for at most `samples` samples and `slots` slots.
    pub(crate) fn with_room(
        world: &World,
        lights: &[LightSource],
        camera: &Camera,
        max_samples: u32,
        [samples, slots]: [u32; 2],
    ) -> Self {
        let (view, size, context) = (View::from(camera), camera.size, &world.context);
        let primary = Primary::new(context, size[0] * size[1]).unwrap();
        let mut antialias = Antialias::new(context, size, max_samples).unwrap();
        let capacity = antialias.capacity;
        // Some pixels are wider than this, and some narrower.
        antialias.smooth_m = SMOOTH_M;
        antialias.capacity = EdgeCapacity {
            samples: capacity.samples.min(samples),
            slots: capacity.slots.min(slots),
            ..capacity
        };
        let direct = Direct::new(context, size, capacity.slots).unwrap();
        let colours = PixelColours::new(context, &world.buffers, size[0] * size[1], capacity.slots).unwrap();
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
        let (mut irradiances, mut shadow_counts, mut needs) = (Vec::new(), Vec::new(), Vec::new());
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
            for (first, pixels) in [(0, 4), (8, 64)] {
                let swizzled =
                    if count == 0 { [0; 3] } else { context.tuning().swizzled(count.div_ceil(pixels)) };
                assert_eq!(words[first..first + 3], swizzled, "{count} pixels, {pixels} a workgroup");
            }
            shadow_counts.push(count);
            let edge_count = antialias.edge_count().unwrap();
            needs.push(antialias.edge_needs.read_range(0, edge_count as usize).unwrap());
        }
        let rows: Vec<_> = lights.iter().map(|light| light.emission).zip(&buffers).collect();
        context.run(|rec| direct.record_sum(rec, &antialias, &rows)).unwrap();
        Self {
            view,
            pixels: primary.pixels.read().unwrap(),
            irradiances,
            shadow_counts,
            needs,
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
        let EdgeCapacity { max_samples, samples, slots, .. } = self.antialias.capacity;
        cpu::antialias::samples_per_edge(edge_count, max_samples, [samples, slots])
    }

    /// Samples of the edges of geometry.
    pub(crate) fn samples(&self) -> Vec<EdgeSample> {
        let count = (self.edge_count() * self.samples_per_edge(self.edge_count())) as usize;
        self.antialias.edge_samples.read_range(0, count).unwrap()
    }

    /// Slots of an edge pixel.
    pub(crate) fn slots_per_edge(&self) -> usize {
        cpu::antialias::slots_per_edge(self.edge_count(), self.antialias.capacity.slots) as usize
    }

    /// All slots, edge pixel by edge pixel.
    pub(crate) fn slots(&self) -> Vec<EdgeSlot> {
        self.antialias.edge_slots.read_range(0, self.edge_count() as usize * self.slots_per_edge()).unwrap()
    }

    /// The pixel at one of the nine places around another.
    pub(crate) fn pixel_at(&self, pixel: u32, place: u32) -> u32 {
        let [width, height] = [self.view.width, self.view.height];
        let x = (pixel % width + place % 3).saturating_sub(1).min(width - 1);
        let y = (pixel / width + place / 3).saturating_sub(1).min(height - 1);
        y * width + x
    }
}

/// Fields of a sample: the point that it shows, eighths that met a surface, position of
/// its source, slot.
pub(crate) fn parts_of(sample: EdgeSample) -> [u32; 4] {
    let what = sample.what;
    [what & 7, what >> 3 & 15, what >> 7 & 15, what >> 11 & 3]
}

/// Whether no pixel around serves a sample.
pub(crate) fn is_apart(sample: EdgeSample) -> bool {
    sample.what >> 13 & 1 != 0
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
    let mut shadows = 0;
    for (world, distance) in [(&room, 1.0), (&squares, 4.0)] {
        for size in [[1, 1], [7, 9], [8, 8], [9, 7], [31, 17], [64, 3], [97, 53]] {
            let frame = Frame::new(world, &lights(), &camera(size, distance), 64);
            let pixels = &frame.pixels;
            let reference = cpu::antialias::edges(thresholds, &world.surfaces, size, pixels);
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
            for ((irradiances, &count), needs) in
                frame.irradiances.iter().zip(&frame.shadow_counts).zip(&frame.needs)
            {
                let irradiance = &irradiances[0][..pixels.len()];
                let reference = cpu::antialias::shadow_edges(f64::from(CONTRAST), size, &edges, irradiance);
                let needy = needs.iter().filter(|need| **need > 0).count();
                let expected = reference.iter().filter(|marked| **marked).count() + needy;
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
    assert!(shadows > 500, "{shadows}");
    assert_silent(&context());
}

#[test]
fn edge_samples_equal_the_reference() {
    let room = World::room();
    let squares = World::new(&shapes::facing_squares(1.0, 1.0, 0.5), 8);
    let mut both = [0; 2];
    for (world, distance, size, most) in
        [(&room, 1.0, [13, 11], 128), (&room, 1.0, [31, 17], 64), (&squares, 4.0, [33, 29], 32)]
    {
        let frame = Frame::new(world, &[], &camera(size, distance), most);
        let count = frame.samples_per_edge(frame.edge_count());
        let samples = frame.samples();
        assert!(count >= 4 && !samples.is_empty(), "{count} samples of {} pixels", frame.edge_count());
        let (mut other_sides, mut other_sources, mut borrowed) = (0, 0, 0);
        let (mut other_weights, mut shared) = (0, 0);
        let mut apart = [0; 2];
        for (pixel, own) in frame.edge_pixels().into_iter().zip(samples.chunks_exact(count as usize)) {
            for (index, &sample) in (0..).zip(own) {
                let [point, eighths, place, _] = parts_of(sample);
                let (number, source) = (index + point * count, frame.pixel_at(pixel, place));
                let reference = cpu::antialias::edge_sample(
                    world.geometry(),
                    &frame.view,
                    &frame.pixels,
                    pixel,
                    [index, count, OUTLINE_POINTS],
                );
                // A ray may pass an edge on the other side.
                other_weights += usize::from((reference.fraction - f64::from(eighths) / 8.0).abs() > 1e-6);
                shared += usize::from(eighths > 0 && eighths < 8);
                let seen = reference.seen.filter(|_| reference.number == number);
                let Some(seen) = seen.filter(|seen| seen.side == sample.side) else {
                    other_sides += usize::from(reference.fraction > 0.0 || sample.side != NO_SIDE);
                    continue;
                };
                let seen = cpu::antialias::surface_of(&seen);
                let (least, reference) =
                    cpu::antialias::source(&world.surfaces, &frame.view, &frame.pixels, pixel, &seen);
                let is_coarse = source != pixel && seen.footprint > SMOOTH_M * SMOOTH_M;
                let is_sure = (least - f64::from(ALIKE)).abs() > 1e-3
                    && (seen.footprint / (SMOOTH_M * SMOOTH_M) - 1.0).abs() > 1e-3;
                let expected = least > f64::from(ALIKE) || is_coarse;
                assert!(!is_sure || is_apart(sample) == expected, "{least}, {is_coarse}");
                apart[usize::from(expected)] += 1;
                if reference != source {
                    // As good, within an error of f32.
                    let pixel = &frame.pixels[source as usize];
                    let cost = cpu::antialias::dissimilarity(&world.surfaces, &seen, pixel);
                    other_sources += usize::from(cost > least + 1e-3 * (1.0 + least));
                }
                borrowed += usize::from(source != pixel);
            }
        }
        let total = samples.len();
        let what = format!("of {total} samples: {other_sides} sides, {other_sources} sources");
        println!("{what}, {borrowed} borrow");
        // Only the squares have an outline: the room is closed.
        let has_outline = frame.pixels.iter().any(|pixel| pixel.side == NO_SIDE);
        assert_eq!(has_outline, shared > total / 20, "{shared} of {total} samples count for a part");
        assert!(other_weights * 100 <= total, "{other_weights} shares, {what}");
        assert!(other_sides * 250 <= total, "{what}");
        assert!(other_sources * 250 <= total, "{what}");
        assert!(borrowed * 20 > total, "{what}, {borrowed} borrow");
        both = [0, 1].map(|i| both[i] + apart[i]);
    }
    assert!(both[0] > 100 && both[1] > 100, "{both:?} samples are served, and are not");
    assert_silent(&context());
}

/// At an outline, a sample shows only the covered fraction of the pixel: sixteen points resolve it
/// to 1/16 at best.
#[test]
fn an_outline_covers_its_share_of_each_pixel() {
    let world = World::new(&shapes::facing_squares(1.0, 1.0, 0.5), 8);
    let (most, size, grid) = (16, [33, 29], 48);
    let frame = Frame::new(&world, &[], &camera(size, 4.0), most);
    let (geometry, samples) = (world.geometry(), frame.samples());
    let (mut squares, mut plain, mut pixels) = (0.0, 0.0, 0);
    for (pixel, own) in frame.edge_pixels().into_iter().zip(samples.chunks_exact(most as usize)) {
        let corner = DVec2::new(f64::from(pixel % size[0]), f64::from(pixel / size[0]));
        let meets = |i: i32| {
            let within = (DVec2::new(f64::from(i % grid), f64::from(i / grid)) + 0.5) / f64::from(grid);
            seen_through(geometry, &frame.view, corner + within).is_some()
        };
        let covered = (0..grid * grid).filter(|&i| meets(i)).count() as f64 / f64::from(grid * grid);
        let sum: f64 = own.iter().map(|&sample| f64::from(parts_of(sample)[1]) / 8.0).sum();
        let first = |index| cpu::antialias::sample(geometry, &frame.view, pixel, index).is_some();
        let fraction = (0..most).filter(|&index| first(index)).count() as f64 / f64::from(most);
        squares += (sum / f64::from(most) - covered).powi(2);
        plain += (fraction - covered).powi(2);
        pixels += 1;
    }
    let [rms, plain] = [squares, plain].map(|sum: f64| (sum / f64::from(pixels)).sqrt());
    println!("RMS {rms:.4} of {pixels} pixels, {plain:.4} by one point a sample");
    assert!(pixels > 40 && rms < 0.25 * plain, "RMS {rms}, {plain} by one point a sample");
    assert_silent(&context());
}

/// Shadow edges on flat walls and on triangles with smooth normals: the mean of the light over
/// the pixel's samples.
#[test]
fn shadow_edges_equal_the_reference() {
    let room = path_trace::world();
    // Irradiance changes fast near a light, with or without a shadow.
    let near = LightSource::point(Vec3::new(0.6, 0.3, -0.35), Vec3::ONE);
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
        for ((light, [before, after]), &edge_count) in
            lights.iter().zip(&frame.irradiances).zip(&frame.shadow_counts)
        {
            let count = frame.samples_per_edge(edge_count);
            assert_eq!(count, most);
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
                let reference = (0..count).map(sample).sum::<f64>() / f64::from(count);
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
            let mut after = after[..frame.pixels.len()].iter();
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
        assert_eq!(cpu::antialias::samples_per_edge(edges, most, [capacity, u32::MAX]), expected);
    }
    for (edges, slots, expected) in [(0, 9, 4), (2, 9, 4), (3, 9, 3), (4, 9, 2), (5, 9, 1), (10, 9, 0)] {
        assert_eq!(cpu::antialias::slots_per_edge(edges, slots), expected);
        let samples = cpu::antialias::samples_per_edge(edges, 16, [u32::MAX, slots]);
        assert_eq!(samples, if expected < 2 { 0 } else { 16 });
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
        let room = [room, u32::MAX];
        let frame = Frame::with_room(&world, &lights(), &camera, 16, room);
        assert_eq!(frame.samples_per_edge(edges), expected);
        assert_eq!(frame.samples().len() as u32, expected * edges);
    }
    assert_silent(&context());
}
