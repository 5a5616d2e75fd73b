//! Slots of edge pixels: the samples that share one, and the light that is summed in them.

use crate::antialias::{Frame, camera, is_apart, parts_of};
use crate::common::{assert_silent, context};
use crate::path_trace;
use crate::world::World;
use glam::{DVec2, Vec3};
use lightpaths::cpu;
use lightpaths::cpu::antialias::Needs;
use lightpaths::cpu::lights::PointSamples;
use lightpaths::cpu::sampling::sample_3d;
use lightpaths::passes::frame::antialias::{ALIKE, DENSITY, EdgeSample, MAX_SAMPLE_FACTOR, SPREAD};
use lightpaths::passes::{OneLight, light_sources};
use lightpaths::scene::shapes;
use lightpaths::types::{NO_SIDE, PixelSurface};

#[test]
fn slots_equal_the_reference() {
    let (room, boxes) = (World::textured_room(), World::room());
    for (world, size, most, slots_each) in
        [(&room, [31, 17], 16, 4), (&boxes, [31, 17], 64, 3), (&boxes, [13, 11], 128, 2)]
    {
        let camera = camera(size, 1.0);
        let edges = Frame::new(world, &[], &camera, most).edge_count();
        let frame = Frame::with_room(world, &[], &camera, most, [u32::MAX, slots_each * edges]);
        let (count, room) = (frame.samples_per_edge(edges) as usize, frame.slots_per_edge());
        assert_eq!((count, room), (most as usize, slots_each as usize));
        let (samples, slots) = (frame.samples(), frame.slots());
        let (mut used, mut points, mut inside, mut differ) = (0, 0, 0, 0);
        let edge_points: Vec<PixelSurface> = frame.antialias.edge_points.read().unwrap();
        let are_alike = |found: &PixelSurface, other: &PixelSurface| {
            cpu::antialias::dissimilarity(&world.surfaces, found, other) <= f64::from(ALIKE)
        };
        let chunks = samples.chunks_exact(count).zip(slots.chunks_exact(room));
        for (pixel, (samples, slots)) in frame.edge_pixels().into_iter().zip(chunks) {
            let image_point = |index: usize| index + parts_of(samples[index])[0] as usize * count;
            let shown = |index: usize| {
                let [_, _, place, _] = parts_of(samples[index]);
                let side = samples[index].side;
                let number = image_point(index) as u32;
                let surface =
                    || cpu::antialias::surface_on(world.geometry(), &frame.view, pixel, number, side);
                let material = || world.surfaces[side as usize / 2].material;
                (side != NO_SIDE)
                    .then(|| (material(), if is_apart(samples[index]) { Err(surface()) } else { Ok(place) }))
            };
            let all: Vec<_> = (0..count).map(shown).collect();
            let reference = cpu::antialias::slots(&all, slots_each, are_alike);
            let of_device =
                |index: usize| (samples[index].side != NO_SIDE).then(|| parts_of(samples[index])[3] as usize);
            let of_device: Vec<_> = (0..count).map(of_device).collect();
            // A sample may be just as dissimilar as is allowed.
            differ += usize::from(of_device != reference);
            for (number, slot) in slots.iter().enumerate() {
                let own: Vec<usize> = (0..count).filter(|&index| of_device[index] == Some(number)).collect();
                let first = own.first().map(|&index| samples[index]);
                let side = first.map_or(NO_SIDE, |sample| sample.side);
                let place = first.map_or(0, |sample| parts_of(sample)[2]);
                let eighths: u32 = own.iter().map(|&index| parts_of(samples[index])[1]).sum();
                let apart = first.is_some_and(is_apart);
                assert_eq!((slot.side, slot.what), (side, place | eighths << 4 | u32::from(apart) << 31));
                used += usize::from(side != NO_SIDE);
                if !apart {
                    assert_eq!(slot.point, u32::MAX);
                    continue;
                }
                assert_eq!(slot.point as usize, points);
                let offset =
                    |&index: &usize| sample_3d(image_point(index) as u32, pixel).truncate().as_dvec2();
                let middle = own.iter().map(offset).sum::<DVec2>() / own.len() as f64;
                let expected =
                    cpu::antialias::surface_through(world.geometry(), &frame.view, pixel, middle, side);
                let [a, b, c] = world.triangles[side as usize / 2].positions;
                let part = |b: Vec3, c: Vec3| (b - expected.position).cross(c - expected.position);
                let normal = (b - a).cross(c - a);
                let is_inside =
                    [part(b, c), part(c, a), part(a, b)].iter().all(|part| part.dot(normal) > 0.0);
                // A position beyond the triangle is moved into it.
                inside += usize::from(is_inside);
                let apart = expected.position.distance(edge_points[points].position);
                assert!(!is_inside || apart < 1e-3, "point {points} is {apart} m away");
                assert_eq!(edge_points[points].side, side);
                points += 1;
            }
        }
        assert!(differ * 50 <= edges as usize, "{differ} of {edges} pixels have other slots");
        assert!(used > edges as usize, "{used} slots of {edges} pixels");
        let groups: Vec<u32> = frame.antialias.point_groups.read().unwrap();
        assert!(groups[3] as usize == points && points > 0, "{points} edge points, {groups:?}");
        assert!(inside * 2 > points, "{inside} of {points} points are inside the first sample's triangle");
    }
    assert_silent(&context());
}

/// The light of an edge pixel: its sum over slots is the mean over samples. If it varies much, more
/// samples are used.
#[test]
fn light_at_edges_equals_the_reference() {
    let room = path_trace::world();
    let squares = World::new(&shapes::facing_squares(1.0, 1.0, 0.5), 8);
    let mut lights = light_sources(&path_trace::lights());
    // This light takes several dispatches.
    (lights[2].samples, lights[2].stride, lights[2].modulus) = (17, 11, 18);
    let needs = Needs { spread: f64::from(SPREAD), density: f64::from(DENSITY), most: MAX_SAMPLE_FACTOR };
    let (mut needy, mut plain, mut other_needs) = (0, 0, 0);
    for (world, size, most, distance) in
        [(&room, [23, 19], 16, 1.0), (&room, [7, 1], 20, 1.0), (&squares, [33, 29], 16, 4.0)]
    {
        let frame = Frame::new(world, &lights, &camera(size, distance), most);
        let (geometry, slots) = (world.geometry(), frame.slots_per_edge());
        let count = frame.samples_per_edge(frame.edge_count());
        assert_eq!(count, most);
        let samples = frame.samples();
        for ((light, [_, irradiance]), device_needs) in
            lights.iter().zip(&frame.irradiances).zip(&frame.needs)
        {
            let irradiance = &irradiance[frame.pixels.len()..];
            let one = OneLight::new(&frame.buffers[0], 0, light);
            let (mut differ, mut edges) = (0, 0);
            let edge = frame.edge_pixels().into_iter().zip(samples.chunks_exact(count as usize));
            for (((pixel, own), irradiance), &device_need) in
                edge.zip(irradiance.chunks_exact(slots)).zip(device_needs)
            {
                let lit = |number, set| {
                    let seen = cpu::antialias::sample(geometry, &frame.view, pixel, number);
                    seen.map_or(0.0, |seen| {
                        let surface = cpu::antialias::surface_of(&seen);
                        let samples =
                            PointSamples::of_image_point(one.point_samples(), set, one.point_step());
                        cpu::direct::irradiance_by(geometry, light, &samples, &surface)
                    })
                };
                let light_of = |(index, &sample): (u32, &EdgeSample)| {
                    let [point, eighths, _, _] = parts_of(sample);
                    if eighths == 0 {
                        0.0
                    } else {
                        f64::from(eighths) / 8.0 * lit(index + point * count, index)
                    }
                };
                let values: Vec<f64> = (0..).zip(own).map(light_of).collect();
                let is_covered = own.iter().all(|&sample| parts_of(sample)[1] == 8);
                let need = if is_covered { cpu::antialias::need(needs, &values) } else { 0 };
                other_needs += usize::from(need != device_need);
                edges += 1;
                let room = |slot: usize| samples_in(own, slot) > 0;
                let sum: f64 =
                    (0..slots).filter(|&slot| room(slot)).map(|slot| f64::from(irradiance[slot])).sum();
                if device_need > 0 {
                    let more: f64 = (count..device_need).map(|number| lit(number, number)).sum();
                    let reference = (values.iter().sum::<f64>() + more) / f64::from(device_need);
                    differ += usize::from((sum - reference).abs() > 0.05 * (reference + 1e-2));
                    needy += 1;
                    continue;
                }
                for slot in (0..slots).filter(|&slot| room(slot)) {
                    let own =
                        own.iter().zip(&values).filter(|(sample, _)| parts_of(**sample)[3] as usize == slot);
                    let reference = own.map(|(_, value)| value).sum::<f64>() / f64::from(count);
                    differ += usize::from(
                        (f64::from(irradiance[slot]) - reference).abs() > 1e-3 * (reference + 1e-2),
                    );
                }
                plain += 1;
            }
            // A pixel has many shadow rays, and one of them may pass an edge on the other side.
            assert!(differ * 20 <= edges + 20, "{differ} of {edges} pixels of {size:?} differ");
        }
    }
    println!("{needy} needy, {plain} plain, {other_needs} other needs");
    assert!(needy > 10 && plain > 500, "{needy} needy, {plain} plain");
    assert!(other_needs * 20 <= needy + plain, "{other_needs} other needs of {}", needy + plain);
    assert_silent(&context());
}

/// Samples of a pixel that see something and belong to a slot.
fn samples_in(samples: &[EdgeSample], slot: usize) -> usize {
    let is_own = |sample: &&EdgeSample| sample.side != NO_SIDE && parts_of(**sample)[3] as usize == slot;
    samples.iter().filter(is_own).count()
}
