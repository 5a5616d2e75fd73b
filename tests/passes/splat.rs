//! Splatting: the records that each pixel uses, and its irradiance from them.

use crate::common::assert_silent;
use crate::world::{Random, SUM, World, assert_near};
use glam::{Mat3, Vec3};
use lightpaths::cpu;
use lightpaths::cpu::records::{MIN_WEIGHT, Tolerance, cover_weight, record_weight};
use lightpaths::gpu::barrier::{COMPUTE_TO_COMPUTE, COMPUTE_TO_TRANSFER};
use lightpaths::gpu::{Buffer, HostBlock};
use lightpaths::passes::frame::primary::Primary;
use lightpaths::passes::frame::record_tree::RecordTree;
use lightpaths::passes::frame::splat::{SeenSurfaces, Splat, SplatWeight, WeightRange};
use lightpaths::passes::frame::splat_capacity::SplatCounts;
use lightpaths::scene::Camera;
use lightpaths::types::{CachePoint, NO_SIDE, PixelSurface, Record, View};

fn view(size: [u32; 2], position: Vec3) -> View {
    let name = "camera".to_owned();
    View::from(&Camera {
        name,
        position,
        target: Vec3::new(-0.2, -0.1, 0.0),
        up: Vec3::Y,
        fov_y_degrees: 80.0,
        size,
    })
}

struct Splatted {
    pixels: Vec<PixelSurface>,
    /// Records of each pixel and their weights.
    fractions: Vec<Vec<SplatWeight>>,
    uncovered: [u32; 2],
    irradiance: Vec<Vec3>,
    repeats: u32,
}

fn splat(world: &World, view: &View, points: &[CachePoint], records: &[Record]) -> Splatted {
    let size = [view.width, view.height];
    let context = &world.context;
    let primary = Primary::new(context, size[0] * size[1]).unwrap();
    let cache_points = Buffer::from_slice(context, "cache points", points).unwrap();
    let record_buffer = Buffer::from_slice(context, "records", records).unwrap();
    let tree = RecordTree::new(context, points, &world.triangles).unwrap();
    let mut pass = Splat::new(context, tree.into(), size, size[0] * size[1]).unwrap();
    context.run(|rec| primary.record(rec, &world.buffers, view)).unwrap();
    // All pixels are edge points, too.
    let count = size[0] * size[1];
    let [x, y, z] = context.tuning().swizzled(count.div_ceil(64));
    let point_groups = Buffer::from_slice(context, "edge point groups", &[x, y, z, count]).unwrap();
    let pixels = &primary.pixels;
    let seen = SeenSurfaces { pixels, edge_points: pixels, point_groups: &point_groups };
    let counters = HostBlock::new(context, "counters", SplatCounts::WORDS).unwrap();
    let mut repeats = 0;
    loop {
        let surfaces = &world.buffers.surfaces;
        context
            .run(|rec| {
                pass.record(rec, surfaces, &cache_points, seen);
                rec.barrier(COMPUTE_TO_COMPUTE);
                pass.record_apply(rec, seen, &record_buffer);
                rec.barrier(COMPUTE_TO_TRANSFER);
                pass.copy_counts(rec, &counters, 0);
            })
            .unwrap();
        if !pass.grow(SplatCounts::read(&counters, 0)).unwrap() {
            break;
        }
        repeats += 1;
        assert!(repeats < 3, "each list is lengthened once at the most");
    }
    let SplatCounts { relaxed, uncovered, .. } = SplatCounts::read(&counters, 0);
    let [runs, weights] = pass.lists();
    let weights: Vec<SplatWeight> = weights.read().unwrap();
    let fractions = |runs: &Buffer| {
        let runs: Vec<WeightRange> = runs.read_range(0, count as usize).unwrap();
        let of_run = |run: &WeightRange| weights[run.first as usize..run.end as usize].to_vec();
        runs.iter().map(of_run).collect::<Vec<_>>()
    };
    let (fractions, at_edges) = (fractions(runs), fractions(pass.edge_ranges()));
    let words = |weights: &Vec<Vec<SplatWeight>>| {
        weights.iter().flatten().map(|found| (found.record, found.weight.to_bits())).collect::<Vec<_>>()
    };
    assert!(words(&fractions) == words(&at_edges), "edge points and pixels have the same records");
    let irradiance: Vec<Vec3> = pass.irradiance().read().unwrap();
    assert!(irradiance == pass.edge_irradiance().read::<Vec3>().unwrap(), "and the same light");
    Splatted {
        pixels: primary.pixels.read().unwrap(),
        fractions,
        // Pixels and edge points take relaxed records.
        uncovered: [relaxed / 2, uncovered],
        irradiance,
        repeats,
    }
}

fn random_records(random: &mut Random, points: &[CachePoint]) -> Vec<Record> {
    let record = |point: &CachePoint| {
        let mut matrix = || Mat3::from_cols(random.cube(), random.cube(), random.cube());
        let (translation, rotation) = (matrix(), matrix());
        Record { position: point.position, irradiance: 1.0 + random.cube(), translation, rotation }
    };
    points.iter().map(record).collect()
}

/// Number of weights of a pixel above which `splat_weights` weighs them again: `KEPT` there.
const KEPT: usize = 8;
/// Weights below this may round to zero on one side.
const HAIR: f32 = 1e-4;

/// Checks the list of one pixel. Returns its kind: covered, reached by a relaxed record, or
/// uncovered and served by the best record.
fn check_pixel(
    world: &World,
    pixel: &PixelSurface,
    points: &[CachePoint],
    fractions: &[SplatWeight],
) -> [u32; 3] {
    let is_active = |side: u32| world.surfaces[side as usize / 2].side_is_active(side % 2 == 1);
    if pixel.side == NO_SIDE || !is_active(pixel.side) {
        assert_eq!(fractions.len(), 0, "what sees no surface receives no light");
        return [0; 3];
    }
    let facet = world.geometry().normal(pixel.side);
    let is_covered = fractions.first().is_none_or(|fraction| fraction.weight > 0.0);
    let within = if is_covered { Tolerance::VALID } else { Tolerance::RELAXED };
    let reference = cpu::splat::splat(pixel, facet, points, within);
    let covering = cpu::splat::splat(pixel, facet, points, Tolerance::VALID);
    let covered: f32 = covering.iter().map(|&(_, weight)| weight).sum();
    let rounding = HAIR * covering.len().max(1) as f32;
    if is_covered && !fractions.is_empty() {
        assert!(covered >= MIN_WEIGHT - rounding, "{covering:?} do not cover {}", pixel.position);
    } else if !fractions.is_empty() {
        assert!(covered < MIN_WEIGHT + rounding, "{covering:?} cover {}", pixel.position);
    }
    let mut used: Vec<u32> = fractions.iter().map(|fraction| fraction.record).collect();
    used.sort_unstable();
    assert!(used.is_sorted_by(|a, b| a < b), "no record twice");
    let weight_of =
        |record: u32| record_weight(pixel.position, pixel.normal, facet, &points[record as usize], within);
    if let [only] = fractions
        && weight_of(only.record) <= 0.0
        && reference.iter().all(|&(_, weight)| weight < HAIR)
    {
        assert_eq!(only.weight, -1.0, "an uncovered pixel has one record");
        let fitness = |point: &CachePoint| cpu::splat::fitness(pixel, point);
        let best = points.iter().map(fitness).fold(f32::NEG_INFINITY, f32::max);
        let chosen = fitness(&points[only.record as usize]);
        assert!(best - chosen <= 1e-3 * best.abs().max(1.0), "{chosen} was chosen, the best is {best}");
        return [0, 0, 1];
    }
    for &(record, weight) in &reference {
        let found = fractions.iter().any(|fraction| fraction.record == record);
        assert!(
            found || weight < HAIR,
            "record {record} of weight {weight} is missing at {}",
            pixel.position
        );
    }
    let sum: f64 = fractions.iter().map(|fraction| f64::from(weight_of(fraction.record))).sum();
    let sign = if is_covered { 1.0 } else { -1.0 };
    for fraction in fractions {
        let weight = f64::from(weight_of(fraction.record)) / sum;
        // The metric has a square root of 1 - cos, which loses seven bits near zero.
        let bound = 1e-3 / sum.max(1e-3);
        assert!(
            (sign * f64::from(fraction.weight) - weight).abs() < bound,
            "{fraction:?}, {weight} by the reference"
        );
    }
    assert!(!fractions.is_empty() || points.is_empty(), "while there are records, no pixel goes without");
    // Pixels whose valid records weigh little take relaxed ones, too, and count as covered.
    let is_valid = is_covered || !covering.is_empty();
    [u32::from(is_valid && !fractions.is_empty()), u32::from(!is_valid), 0]
}

#[test]
fn every_pixel_has_the_records_that_brute_force_finds() {
    let world = World::room();
    let mut random = Random::new(81);
    let inside = Vec3::new(0.1, 0.05, 0.45);
    let among_records = world.surface_point(&mut random).0;
    for (size, count, radius, position) in [
        ([1, 1], 0, 0.1, inside),
        ([1, 1], 1, 3.0, inside),
        ([16, 16], 64, 0.3, inside),
        ([17, 15], 65, 0.3, inside),
        ([50, 37], 800, 0.1, inside),
        ([50, 37], 800, 0.02, among_records + 1e-3),
        // From far outside, behind walls: everything is small.
        ([33, 47], 257, 0.2, Vec3::new(6.0, 4.0, 9.0)),
        // More weights than the list has capacity for.
        ([130, 70], 790, 1.5, inside),
    ] {
        let mut points = world.cache_points(&mut random, count, radius);
        if size[0] == 50 {
            // Some are so far away that only their relaxed radius reaches the surface.
            points.iter_mut().for_each(|point| {
                point.normal = (point.normal + 0.4 * random.cube()).normalize();
            });
        }
        let records = random_records(&mut random, &points);
        let splatted = splat(&world, &view(size, position), &points, &records);
        let mut tally = [0; 3];
        for ((pixel, fractions), device) in
            splatted.pixels.iter().zip(&splatted.fractions).zip(&splatted.irradiance)
        {
            let became = check_pixel(&world, pixel, &points, fractions);
            tally = [0, 1, 2].map(|i| tally[i] + became[i]);
            let given: Vec<_> = fractions
                .iter()
                .map(|fraction| (records[fraction.record as usize], fraction.weight))
                .collect();
            let reference = cpu::splat_apply::splat_apply(pixel, &given);
            // Gradients far from their records are large and may cancel.
            assert_near(*device, reference, SUM, 1.0, "irradiance");
        }
        assert_eq!(splatted.uncovered, tally[1..], "{size:?}, {count} records");
        assert_eq!(splatted.repeats > 0, radius == 1.5, "{size:?} took {} repeats", splatted.repeats);
        let most = splatted.fractions.iter().map(Vec::len).max().unwrap();
        assert!(most > KEPT || count != 790, "{size:?}: {most} at a pixel");
        assert!(count < 800 || radius < 0.1 || tally[0] > 100 && tally[1] > 10, "{tally:?}");
    }
    assert_silent(&world.context);
}

/// Some devices silently end the loops of an invocation after 65 535 iterations.
#[test]
fn many_uncovered_pixels_among_many_records_have_the_one_that_fits_best() {
    let world = World::room();
    let mut random = Random::new(82);
    let mut points = world.cache_points(&mut random, 100_000, 1e-6);
    // Neighbours in the list are roughly neighbours in space.
    points.sort_by(|a, b| a.position.x.total_cmp(&b.position.x));
    let records = random_records(&mut random, &points);
    let splatted = splat(&world, &view([128, 96], Vec3::new(0.1, 0.05, 0.45)), &points, &records);
    assert!(splatted.uncovered[1] > 10_000, "{:?}", splatted.uncovered);
    for (pixel, fractions) in splatted.pixels.iter().zip(&splatted.fractions).step_by(97) {
        check_pixel(&world, pixel, &points, fractions);
    }
    assert_silent(&world.context);
}

/// If smooth shading hides a sharp edge, the facet decides: a record on a facet that faces away is
/// not used, even if its shading normal is the same.
#[test]
fn facets_at_a_sharp_edge_share_no_records() {
    let normal = Vec3::new(0.0, 0.8, 0.6);
    let record = CachePoint {
        position: Vec3::ZERO,
        radius: 1.0,
        normal,
        side: 0,
        occluder: Vec3::ZERO,
        facet: Vec3::Y,
        inverse_reach: 0.0,
        stream: 0,
    };
    let there = Vec3::new(0.1, 0.0, 0.0);
    assert!(cover_weight(there, normal, Vec3::Y, &record, Tolerance::VALID) > 0.85);
    assert!(
        cover_weight(there, normal, Vec3::new(0.0, 0.98, 0.2).normalize(), &record, Tolerance::VALID) > 0.85
    );
    assert_eq!(cover_weight(there, normal, Vec3::Z, &record, Tolerance::VALID), 0.0);
}
