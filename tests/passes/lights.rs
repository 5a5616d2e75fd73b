//! Form factors, direct light and the sums over lights: every kind of light.

use crate::common::{assert_silent, context};
use crate::path_trace;
use crate::world::{FLOAT, Random, SUM, assert_near};
use glam::Vec3;
use lightpaths::cpu;
use lightpaths::gpu::{Buffer, Context, Recorder};
use lightpaths::passes::frame::{direct::Direct, form_factors::FormFactors, light_sum::LightSum};
use lightpaths::passes::{OneLight, light_sources};
use lightpaths::scene::{Light, LightKind};
use lightpaths::types::{LIGHT_AREA, LIGHT_DIRECTIONAL, LightSource, NO_SIDE, PathVertex};
use std::sync::Arc;

/// One in this many points may see a light past an edge that f32 moves to the other side; in
/// practice hardly any does.
pub(crate) const GRAZING: usize = 250;

/// Lights of each kind, and an area light with more samples than one dispatch takes.
pub(crate) fn lights() -> Vec<LightSource> {
    let mut lights = path_trace::lights();
    let mut many = lights[2].kind;
    if let LightKind::Area { samples, corner, .. } = &mut many {
        (*samples, *corner) = (37, Vec3::new(-0.8, 0.2, -0.4));
    }
    lights.push(Light::new("many", many));
    light_sources(&lights)
}

/// Irradiance of a surface that faces a light, if the light faces it. Errors are relative to it,
/// because cosines vanish at grazing angles.
pub(crate) fn overhead(light: &LightSource, position: Vec3) -> f64 {
    let distance = |number| {
        let u = cpu::lights::lattice_point(light, number).as_vec2();
        (light.position + u.x * light.edge_u + u.y * light.edge_v - position).length()
    };
    let inverse_squares = (0..light.samples).map(|number| f64::from(distance(number)).powi(-2)).sum::<f64>();
    match light.kind {
        LIGHT_DIRECTIONAL => 1.0,
        LIGHT_AREA => f64::from(light.area) * inverse_squares / f64::from(light.samples),
        _ => inverse_squares,
    }
}

pub(crate) fn one<'a>(table: &'a Buffer, lights: &[LightSource], index: usize) -> OneLight<'a> {
    OneLight::new(table, index as u32, &lights[index])
}

#[test]
fn form_factors_equal_the_reference() {
    let world = path_trace::world();
    let mut random = Random::new(21);
    let lights = lights();
    let table = Buffer::from_slice(&world.context, "lights", &lights).unwrap();
    let area_m2 = 0.013;
    for count in [0, 1, 63, 64, 65, 997] {
        let mut points: Vec<PathVertex> = (0..count)
            .map(|_| {
                let (position, _, side) = world.surface_point(&mut random);
                PathVertex { position, side, incoming: Vec3::ZERO, weight: 1.0, cluster: 0, lobe: 0.0 }
            })
            .collect();
        // Neighbours share a batch, as in a renderer: a shaft holds a small fraction of the scene.
        points.sort_by(|a, b| a.position.x.total_cmp(&b.position.x));
        if let [first, .., last] = &mut *points {
            // A light on the surface itself, and one just off it.
            first.position = lights[0].position;
            last.position = lights[0].position - 1e-4 * world.geometry().normal(last.side);
        }
        let pass = FormFactors::new(&world.context, &world.buffers, (&points, &[]), area_m2).unwrap();
        let in_chunks =
            FormFactors::in_chunks(&world.context, &world.buffers, (&points, &[]), area_m2, 90).unwrap();
        for (index, light) in lights.iter().enumerate() {
            // The old content does not matter.
            let factors = Buffer::from_slice(&world.context, "factors", &vec![-7.0_f32; count]).unwrap();
            let light_at = one(&table, &lights, index);
            world
                .context
                .run(|rec| pass.record(&mut rec.pass("form_factors"), &world.buffers, light_at, &factors))
                .unwrap();
            let needed: Vec<f32> = factors.read().unwrap();
            for traces_all in [false, true] {
                factors.write(&vec![-7.0_f32; count]).unwrap();
                let light_at = OneLight { traces_all, ..light_at };
                world
                    .context
                    .run(|rec| {
                        in_chunks.record(&mut rec.pass("form_factors"), &world.buffers, light_at, &factors);
                    })
                    .unwrap();
                let found: Vec<f32> = factors.read().unwrap();
                assert!(found == needed, "in parts, from shafts or from the root ({traces_all})");
            }
            let factors = needed;
            let (mut disagree, mut lit) = (0, 0);
            for (point, &device) in points.iter().zip(&factors) {
                let geometry = world.geometry();
                let reference =
                    cpu::form_factors::form_factor(geometry, point.position, point.side, light, area_m2);
                let bound = FLOAT * overhead(light, point.position).min(1e3);
                disagree += usize::from((f64::from(device) - reference).abs() > bound);
                lit += usize::from(device > 0.0);
            }
            // Any of many samples may graze an edge.
            let samples = light.samples as usize;
            assert!(
                disagree * GRAZING <= count * samples.min(5),
                "light {index}: {disagree} of {count} points disagree"
            );
            assert!(count < 900 || lit > 50, "light {index}: {lit} of {count} points are lit");
        }
    }
    assert_silent(&context());
}

#[test]
fn direct_irradiances_equal_the_reference() {
    let world = path_trace::world();
    let mut random = Random::new(71);
    let lights = lights();
    let table = Buffer::from_slice(&world.context, "lights", &lights).unwrap();
    for (size, slot_count) in
        [([1, 1], 0), ([7, 9], 5), ([8, 8], 64), ([9, 7], 65), ([31, 17], 130), ([64, 3], 1)]
    {
        let pixel_count = (size[0] * size[1]) as usize;
        let mut points = world.pixels(&mut random, pixel_count);
        for point in points.iter_mut().step_by(7).skip(1) {
            point.side = NO_SIDE;
        }
        let pixels = Buffer::from_slice(&world.context, "points", &points).unwrap();
        let pass = Direct::new(&world.context, size, slot_count).unwrap();
        world.context.run(|rec| pass.record_batches(rec, &world.buffers, &pixels)).unwrap();
        let value_count = pixel_count + slot_count as usize;
        assert_eq!(pass.point_count() as usize, value_count);
        for (index, light) in lights.iter().enumerate() {
            let irradiance =
                Buffer::from_slice(&world.context, "irradiance", &vec![-7.0_f32; value_count]).unwrap();
            let light_at = one(&table, &lights, index);
            world
                .context
                .run(|rec| {
                    let mut scope = rec.pass("direct");
                    pass.record(&mut scope, &world.buffers, light_at, &pixels, &irradiance);
                })
                .unwrap();
            let irradiance: Vec<f32> = irradiance.read().unwrap();
            assert!(irradiance[pixel_count..].iter().all(|value| *value == -7.0), "slots are left alone");
            let mut disagree = 0;
            for (&device, point) in irradiance.iter().zip(&points) {
                let reference = cpu::direct::irradiance(world.geometry(), light, point);
                disagree += usize::from(
                    (f64::from(device) - reference).abs() > FLOAT * overhead(light, point.position),
                );
            }
            let allowed = points.len() * (light.samples as usize).min(5);
            assert!(
                disagree * GRAZING <= allowed,
                "light {index}: {disagree} of {} points differ",
                points.len()
            );
            assert!(points.len() < 500 || irradiance.iter().filter(|value| **value > 0.0).count() > 30);
        }
    }
    assert_silent(&context());
}

#[test]
fn sums_over_lights_equal_the_reference() {
    let context = context();
    let mut random = Random::new(5);
    let sizes = [(0, 1), (1, 1), (63, 2), (64, 3), (65, 4), (997, 5), (997, 8), (257, 0), (10, 9)];
    let passes = [LightSum::new(&context).unwrap(), LightSum::of_colours(&context).unwrap()];
    for ((is_colour, pass), (count, light_count)) in
        [false, true].iter().zip(&passes).flat_map(|pass| sizes.map(|size| (pass, size)))
    {
        let mut value = || if *is_colour { 0.5 * (1.0 + random.cube()) } else { Vec3::splat(random.unit()) };
        let rows: Vec<Vec<Vec3>> = (0..light_count).map(|_| (0..count).map(|_| value()).collect()).collect();
        let emissions: Vec<Vec3> = rows.iter().map(|_| 1.5 + random.cube()).collect();
        let upload = |row: &Vec<Vec3>| match is_colour {
            true => Buffer::from_slice(&context, "row", row),
            false => {
                Buffer::from_slice(&context, "row", &row.iter().map(|value| value.x).collect::<Vec<_>>())
            }
        };
        let buffers: Vec<Buffer> = rows.iter().map(|row| upload(row).unwrap()).collect();
        let sums = Buffer::from_slice(&context, "sums", &vec![Vec3::NAN; count]).unwrap();
        let of_buffers: Vec<_> = emissions.iter().copied().zip(&buffers).collect();
        let record = |rec: &mut Recorder| {
            pass.record(&mut rec.pass("light_sum"), &of_buffers, count as u32, 0.25, &sums);
        };
        context.run(record).unwrap();
        let of_rows: Vec<_> = emissions.iter().copied().zip(rows.iter().map(Vec::as_slice)).collect();
        let reference = cpu::light_sum::light_sum(&of_rows, count, 0.25);
        for (device, reference) in sums.read::<Vec3>().unwrap().into_iter().zip(reference) {
            assert_near(device, reference, SUM, 0.0, "sum");
        }
    }
    assert_silent(&context);
}

/// The sum without a light that is off equals, to the bit, the sum with a black light.
#[test]
fn sums_do_not_depend_on_places() {
    let context = context();
    sums_do_not_depend_on_places_in(&context, &LightSum::new(&context).unwrap(), 1000);
    sums_do_not_depend_on_places_in(&context, &LightSum::of_colours(&context).unwrap(), 3 * 1000);
    assert_silent(&context);
}

fn sums_do_not_depend_on_places_in(context: &Arc<Context>, pass: &LightSum, row_floats: usize) {
    let mut random = Random::new(6);
    let rows: Vec<Buffer> = (0..7)
        .map(|_| {
            let row: Vec<f32> = (0..row_floats).map(|_| random.unit()).collect();
            Buffer::from_slice(context, "row", &row).unwrap()
        })
        .collect();
    let emissions: Vec<Vec3> = rows.iter().map(|_| 1.5 + random.cube()).collect();
    let sum = |lights: &[usize], dark: &[usize]| {
        let emission = |light: &usize| if dark.contains(light) { Vec3::ZERO } else { emissions[*light] };
        let of_lights: Vec<_> = lights.iter().map(|light| (emission(light), &rows[*light])).collect();
        let sums = Buffer::storage(context, "sums", 12_000).unwrap();
        context.run(|rec| pass.record(&mut rec.pass("light_sum"), &of_lights, 1000, 0.3, &sums)).unwrap();
        sums.read::<u32>().unwrap()
    };
    let all = [0, 1, 2, 3, 4, 5, 6];
    for on in [vec![0, 2, 3, 4, 5, 6], vec![1, 6], vec![5], vec![1, 2, 3, 4, 5]] {
        let off: Vec<usize> = all.into_iter().filter(|light| !on.contains(light)).collect();
        assert!(sum(&on, &[]) == sum(&all, &off), "{on:?}");
    }
    assert!(sum(&all, &[]) != sum(&[6, 5, 4, 3, 2, 1, 0], &[]), "order shows");
}

#[test]
fn lattices_hold_a_point_in_every_row_and_column() {
    for samples in [1, 2, 3, 4, 6, 10, 12, 16, 30, 37, 64, 4096] {
        let mut kind = path_trace::lights()[2].kind;
        if let LightKind::Area { samples: own, .. } = &mut kind {
            *own = samples;
        }
        let light = light_sources(&[Light::new("area", kind)])[0];
        let points: Vec<_> = (0..samples).map(|number| cpu::lights::lattice_point(&light, number)).collect();
        for axis in [0, 1] {
            let mut places: Vec<u32> =
                points.iter().map(|point| (point.to_array()[axis] * f64::from(samples)) as u32).collect();
            places.sort_unstable();
            assert!(places.into_iter().eq(0..samples), "{samples}");
        }
        let apart =
            |a: usize| points[..a].iter().map(|b| (points[a] - *b).length()).fold(f64::INFINITY, f64::min);
        let nearest = (0..points.len().min(200)).map(apart).fold(f64::INFINITY, f64::min);
        assert!(nearest * f64::from(samples).sqrt() > 0.6, "{samples}: {nearest}");
    }
}
