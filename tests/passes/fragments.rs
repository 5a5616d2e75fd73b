//! Fragments of edge pixels: the samples that see one surface, their point, and their light.

use crate::antialias::{Frame, SMOOTH_M, camera};
use crate::common::{assert_silent, context};
use crate::path_trace;
use crate::world::World;
use glam::{DVec2, Vec3};
use lightpaths::cpu;
use lightpaths::cpu::lights::PointSamples;
use lightpaths::passes::frame::antialias::{ALIKE, CONTRAST, COVERAGE, Fragment, NO_EDGE, SHADING, SPREAD};
use lightpaths::passes::{OneLight, light_sources};
use lightpaths::scene::shapes;
use lightpaths::types::{LIGHT_AREA, NO_SIDE, PixelSurface};

/// Parts of `Fragment::what`: place, whether the fragment is apart, alike pixels, samples.
fn parts_of(fragment: &Fragment) -> (u32, bool, u32, u32) {
    let what = fragment.what;
    (what & 15, what >> 4 & 1 != 0, what >> 5 & 0x1ff, what >> 14)
}

/// Whether f32 may decide differently from f64.
fn is_close(cost: f64) -> bool {
    (cost - f64::from(ALIKE)).abs() < 1e-3 * (1.0 + cost)
}

#[test]
fn fragments_equal_the_reference() {
    let (room, boxes) = (World::textured_room(), World::room());
    let squares = World::new(&shapes::facing_squares(1.0, 1.0, 0.5), 8);
    let mut decided = [0; 2];
    for (world, distance, size, most, fragments_each) in [
        (&room, 1.0, [31, 17], 4, 4),
        (&boxes, 1.0, [31, 17], 16, 3),
        (&boxes, 1.0, [13, 11], 32, 2),
        (&squares, 4.0, [33, 29], 8, 4),
    ] {
        let camera = camera(size, distance);
        let edges = Frame::new(world, &[], &camera, most).edge_count();
        let frame = Frame::with_room(world, &[], &camera, most, [u32::MAX, fragments_each * edges]);
        let count = frame.samples_per_edge(edges) as usize;
        assert_eq!(count as u32, COVERAGE * most);
        let (samples, firsts) = (frame.samples(), frame.firsts());
        let (fragments, points) = (frame.fragments(), frame.fragment_surfaces());
        let (surfaces, geometry) = (&world.surfaces, world.geometry());
        let (mut differ, mut apart_count, mut other_sources) = (0, 0, 0);
        let edge_points: Vec<PixelSurface> = frame.antialias.fragments.edge_points.read().unwrap();
        let edge_pixels = frame.edge_pixels();
        for (edge, (&pixel, own)) in edge_pixels.iter().zip(samples.chunks_exact(count)).enumerate() {
            let shown = |(number, &(side, _)): (u32, &(u32, usize))| {
                (side != NO_SIDE)
                    .then(|| cpu::antialias::surface_on(geometry, &frame.view, pixel, number, side))
            };
            let all: Vec<_> = (0..).zip(own).map(shown).collect();
            let (reference, _) = cpu::antialias::fragments(surfaces, &all, fragments_each, f64::from(ALIKE));
            let device: Vec<_> = own.iter().map(|&(side, own)| (side != NO_SIDE).then_some(own)).collect();
            // A sample may be just as dissimilar as is allowed.
            differ += usize::from(device != reference);
            let used = firsts[edge + 1] - firsts[edge];
            assert_eq!(used, device.iter().flatten().max().map_or(0, |last| last + 1));

            for number in 0..used {
                let index = firsts[edge] + number;
                let (fragment, point) = (&fragments[index], &points[index]);
                let members: Vec<usize> = (0..count).filter(|&i| device[i] == Some(number)).collect();
                let (place, is_apart, alike, samples) = parts_of(fragment);
                assert_eq!((fragment.edge as usize, samples as usize), (edge, members.len()));
                let offset = |&i: &usize| cpu::antialias::place_in_pixel(i as u32, pixel);
                let middle = members.iter().map(offset).sum::<DVec2>() / members.len() as f64;
                let apart = |i: &usize| (offset(i) - middle).length_squared();
                let least = members.iter().map(apart).fold(f64::INFINITY, f64::min);
                // Two samples may be as near as each other.
                let nearest = members.iter().filter(|i| apart(i) < least + 1e-6 && own[**i].0 == point.side);
                let is_there = |&&i: &&usize| {
                    let expected =
                        cpu::antialias::surface_on(geometry, &frame.view, pixel, i as u32, point.side);
                    let [a, b, c] = world.triangles[point.side as usize / 2].positions;
                    let part = |b: Vec3, c: Vec3| (b - expected.position).cross(c - expected.position);
                    let normal = (b - a).cross(c - a);
                    // A position at an edge of the triangle is moved into it.
                    let is_inside =
                        [part(b, c), part(c, a), part(a, b)].iter().all(|part| part.dot(normal) > 0.0);
                    !is_inside || expected.position.distance(point.position) < 1e-3
                };
                assert!(nearest.clone().any(|i| is_there(&i)), "point {index} is at no sample");

                // Pixels around of the same surface, and the one that indirect light is taken of.
                let cost = |place: u32| {
                    let other = &frame.pixels[frame.pixel_at(pixel, place) as usize];
                    cpu::antialias::dissimilarity(surfaces, point, other)
                };
                for place in (0..9).filter(|&place| !is_close(cost(place))) {
                    assert_eq!(alike >> place & 1 != 0, cost(place) <= f64::from(ALIKE));
                }
                let (least, source) =
                    cpu::antialias::source(surfaces, &frame.view, &frame.pixels, pixel, point);
                let taken = cost(place);
                if frame.pixel_at(pixel, place) != source {
                    other_sources += usize::from(taken > least + 1e-3 * (1.0 + least));
                }
                let is_coarse = place != 4 && point.footprint > SMOOTH_M * SMOOTH_M;
                let is_sure =
                    !is_close(taken) && (point.footprint / (SMOOTH_M * SMOOTH_M) - 1.0).abs() > 1e-3;
                let expected = taken > f64::from(ALIKE) || is_coarse;
                assert!(!is_sure || is_apart == expected, "{taken}, {is_coarse}");
                decided[usize::from(is_apart)] += 1;
                if is_apart {
                    assert_eq!(fragment.point as usize, apart_count);
                    let own = &edge_points[apart_count];
                    assert_eq!((own.position, own.side), (point.position, point.side));
                    assert!((own.normal - point.normal.normalize()).length() < 1e-6);
                    apart_count += 1;
                } else {
                    assert_eq!(fragment.point, u32::MAX);
                }

                // Fragments around of the same surface.
                for (n, place) in [0, 1, 2, 3, 5, 6, 7, 8].into_iter().enumerate() {
                    let other = frame.numbers[frame.pixel_at(pixel, place) as usize];
                    let links = fragment.neighbours >> (4 * n) & 15;
                    if other == NO_EDGE || other as usize == edge {
                        assert_eq!(links, 0);
                        continue;
                    }
                    let [first, end] = [firsts[other as usize], firsts[other as usize + 1]];
                    assert_eq!(links >> (end - first), 0);
                    for (k, shown) in points[first..end].iter().enumerate() {
                        let cost = cpu::antialias::dissimilarity(surfaces, point, shown);
                        let is_linked = links >> k & 1 != 0;
                        assert!(is_close(cost) || is_linked == (cost <= f64::from(ALIKE)), "{cost}");
                    }
                }
            }
        }
        let total = fragments.len();
        println!("{total} fragments of {edges} pixels, {apart_count} apart, {differ} pixels differ");
        assert!(differ * 50 <= edges as usize, "{differ} of {edges} pixels have other fragments");
        assert!(other_sources * 100 <= total, "{other_sources} of {total} take another pixel's light");
        let groups: Vec<u32> = frame.antialias.fragments.point_groups.read().unwrap();
        assert_eq!(groups[3] as usize, apart_count);
    }
    assert!(decided[0] > 100 && decided[1] > 100, "{decided:?} fragments are served, and are not");
    assert_silent(&context());
}

/// The light of a fragment is that at its point, or, if it is mixed, the mean over its samples.
#[test]
fn light_at_fragments_equals_the_reference() {
    let room = path_trace::world();
    let squares = World::new(&shapes::facing_squares(1.0, 1.0, 0.5), 8);
    let mut lights = light_sources(&path_trace::lights());
    // This light takes several dispatches.
    (lights[2].samples, lights[2].stride, lights[2].modulus) = (17, 11, 18);
    let (mut mixed, mut plain, mut other_decisions, mut varying) = (0, 0, 0, 0);
    for (world, size, most, distance) in
        [(&room, [23, 19], 16, 1.0), (&room, [7, 1], 6, 1.0), (&squares, [33, 29], 16, 4.0)]
    {
        let frame = Frame::new(world, &lights, &camera(size, distance), most);
        let (geometry, pixel_count) = (world.geometry(), frame.pixels.len());
        let count = frame.samples_per_edge(frame.edge_count()) as usize;
        let (samples, firsts, edge_pixels) = (frame.samples(), frame.firsts(), frame.edge_pixels());
        let (fragments, points) = (frame.fragments(), frame.fragment_surfaces());
        for ((light, [before, after]), listed) in lights.iter().zip(&frame.irradiances).zip(&frame.mixed) {
            let one = OneLight::new(&frame.buffers[0], 0, light);
            let at_points: Vec<f64> =
                points.iter().map(|point| cpu::direct::irradiance(geometry, light, point).abs()).collect();
            let contrast = f64::from(if light.kind == LIGHT_AREA { CONTRAST } else { SHADING });
            let (mut differ, mut decisions) = (0, 0);
            for (index, (fragment, point)) in fragments.iter().zip(&points).enumerate() {
                let edge = fragment.edge as usize;
                let (pixel, number) = (edge_pixels[edge], index - firsts[edge]);
                let here = at_points[index] as f32;
                let is_in_penumbra = |point| {
                    let samples = [PointSamples::lattice(light)];
                    light.kind == LIGHT_AREA && cpu::direct::sees_a_part(geometry, light, &samples, point)
                };
                let around = (0..9).filter(|place| fragment.what >> (5 + place) & 1 != 0);
                let mut expected = is_in_penumbra(point)
                    || around
                        .map(|place| before[frame.pixel_at(pixel, place) as usize])
                        .any(|there| cpu::antialias::differs(here, there, contrast));
                for link in (0..32).filter(|link| fragment.neighbours >> link & 1 != 0) {
                    let place = link / 4 + u32::from(link >= 16);
                    let other = frame.numbers[frame.pixel_at(pixel, place) as usize] as usize;
                    let other = firsts[other] + link as usize % 4;
                    expected |= is_in_penumbra(&points[other])
                        || cpu::antialias::differs(here, at_points[other] as f32, contrast);
                }
                let is_mixed = listed.binary_search(&(index as u32)).is_ok();
                decisions += usize::from(expected != is_mixed);
                let reference = if is_mixed {
                    let own = &samples[edge * count..(edge + 1) * count];
                    let members: Vec<_> =
                        (0_u32..).zip(own).filter(|(_, sample)| sample.1 == number).collect();
                    let lit = |(number, &(side, _)): (u32, &(u32, usize))| {
                        let surface = cpu::antialias::surface_on(geometry, &frame.view, pixel, number, side);
                        let samples =
                            PointSamples::of_image_point(one.point_samples(), number, one.point_step());
                        cpu::direct::irradiance_by(geometry, light, &samples, &surface)
                    };
                    let values: Vec<f64> = members.into_iter().map(lit).collect();
                    let first = &values[..values.len().min(most as usize)];
                    let mean_of = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
                    let squares: Vec<f64> = first.iter().map(|value| value * value).collect();
                    let mean = mean_of(first);
                    let varies = mean_of(&squares) - mean * mean > f64::from(SPREAD) * mean * mean;
                    varying += usize::from(varies);
                    if varies { mean_of(&values) } else { mean }
                } else {
                    at_points[index]
                };
                let found = f64::from(after[pixel_count + index]);
                differ += usize::from((found - reference).abs() > 1e-3 * (reference + 1e-2));
                *if is_mixed { &mut mixed } else { &mut plain } += 1;
            }
            // A fragment has many shadow rays, and one of them may pass an edge on the other side.
            assert!(differ * 20 <= fragments.len() + 20, "{differ} of {} differ", fragments.len());
            other_decisions += decisions;
        }
    }
    println!("{mixed} mixed, {varying} of these vary much, {plain} plain, {other_decisions} other decisions");
    assert!(mixed > 100 && plain > 500 && varying > 10, "{mixed} mixed, {varying} vary, {plain} plain");
    assert!(other_decisions * 30 <= mixed + plain, "{other_decisions} of {}", mixed + plain);
    assert_silent(&context());
}
