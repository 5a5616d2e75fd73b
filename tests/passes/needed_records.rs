//! Records that a view uses: against the reference, over a sequence of views and edits.

use crate::common::assert_silent;
use crate::world::{Random, World};
use glam::Vec3;
use lightpaths::cpu::needed_records::needed_records;
use lightpaths::gpu::barrier::COMPUTE_TO_TRANSFER;
use lightpaths::gpu::{Buffer, HostBlock, Recorder, Tuning};
use lightpaths::passes::frame::blend::Blend;
use lightpaths::passes::frame::needed_records::{NeededRecords, RecordList, RecordRequest};
use lightpaths::passes::frame::primary::Primary;
use lightpaths::passes::frame::record_tree::RecordTree;
use lightpaths::passes::frame::splat::{SeenSurfaces, Splat, SplatWeight, WeightRange};
use lightpaths::passes::frame::splat_capacity::SplatCounts;
use lightpaths::passes::precompute::neighbours::{Neighbour, Neighbourhoods};
use lightpaths::scene::Camera;
use lightpaths::types::{CachePoint, View};

const SIZE: [u32; 2] = [41, 23];

fn view(position: Vec3) -> View {
    let (name, target) = ("camera".to_owned(), Vec3::new(-0.2, -0.1, 0.0));
    View::from(&Camera { name, position, target, up: Vec3::Y, fov_y_degrees: 60.0, size: SIZE })
}

/// An edge point that is none, and a dispatch size of zero.
fn no_edge_points(world: &World) -> [Buffer; 2] {
    let point = Buffer::from_slice(&world.context, "edge points", &[0_u32; 8]).unwrap();
    [point, Buffer::from_slice(&world.context, "edge point groups", &[0_u32; 4]).unwrap()]
}

/// What a view without pixels and edge points shows.
fn seen_by([nothing, point_groups]: &[Buffer; 2]) -> SeenSurfaces<'_> {
    SeenSurfaces { pixels: nothing, edge_points: nothing, point_groups }
}

/// Finds and returns the records of every pixel.
fn splat(world: &World, pass: &mut Splat, points: &[CachePoint], view: &View) -> Vec<Vec<u32>> {
    let primary = Primary::new(&world.context, SIZE[0] * SIZE[1]).unwrap();
    let cache_points = Buffer::from_slice(&world.context, "cache points", points).unwrap();
    world.context.run(|rec| primary.record(rec, &world.buffers, view)).unwrap();
    let surfaces = &world.buffers.surfaces;
    let nothing = no_edge_points(world);
    let seen = SeenSurfaces { pixels: &primary.pixels, ..seen_by(&nothing) };
    let counters = HostBlock::new(&world.context, "counters", SplatCounts::WORDS).unwrap();
    loop {
        let record = |rec: &mut Recorder| {
            pass.record(rec, surfaces, &cache_points, seen);
            rec.barrier(COMPUTE_TO_TRANSFER);
            pass.copy_counts(rec, &counters, 0);
        };
        world.context.run(record).unwrap();
        if !pass.grow(SplatCounts::read(&counters, 0)).unwrap() {
            break;
        }
    }
    let [runs, weights] = pass.lists();
    let runs: Vec<WeightRange> = runs.read().unwrap();
    let weights: Vec<SplatWeight> = weights.read().unwrap();
    let run =
        |run: &WeightRange| weights[run.first as usize..run.end as usize].iter().map(|w| w.record).collect();
    runs.iter().map(run).collect()
}

/// Reads a list and asserts that its dispatches fit.
#[track_caller]
fn read(tuning: &Tuning, list: &RecordList, rows: u32) -> Vec<u32> {
    let offsets: Vec<u32> = list.offsets.read().unwrap();
    let records: Vec<u32> = list.records.read_range(0, *offsets.last().unwrap() as usize).unwrap();
    let count = offsets.len() as u32 - 1;
    let groups: Vec<u32> = list.groups.read().unwrap();
    assert_eq!(groups.len() as u32, 3 * count.div_ceil(rows));
    for (part, groups) in (0..).zip(groups.chunks(3)) {
        let [first, end] = [part, part + 1].map(|part: u32| offsets[(part * rows).min(count) as usize]);
        let swizzled = tuning.swizzled(tuning.record_groups(end - first));
        assert!(groups == swizzled, "{groups:?} for {}", end - first);
    }
    for (record, run) in (0..).zip(offsets.windows(2)) {
        assert_eq!(run[1] - run[0], u32::from(records.binary_search(&record).is_ok()));
    }
    records
}

#[test]
fn needed_records_equal_the_reference() {
    let world = World::room();
    let mut random = Random::new(77);
    let (here, there) = (Vec3::new(0.1, 0.05, 0.45), Vec3::new(0.2, 0.1, -0.45));
    for (count, rows) in [(0, 1), (1, 1), (63, 63), (64, 10), (65, 100), (257, 86), (4099, 2000)] {
        let points = world.cache_points(&mut random, count, 0.1);
        let neighbours: Vec<Vec<u32>> = (0..count as u32)
            .map(|own| {
                let others = random.below(4);
                std::iter::once(own).chain((0..others).map(|_| random.below(count as u32))).collect()
            })
            .collect();
        let mut lists = Neighbourhoods { first: vec![0], list: Vec::new() };
        for own in &neighbours {
            lists.list.extend(own.iter().map(|&record| Neighbour { record, weight: 1.0 }));
            lists.first.push(lists.list.len() as u32);
        }
        let blend = Blend::new(&world.context, &lists).unwrap();
        let tree = RecordTree::new(&world.context, &points, &world.triangles).unwrap();
        let mut splat_pass = Splat::new(&world.context, tree.into(), SIZE, 0).unwrap();
        let nothing = no_edge_points(&world);
        let pass = NeededRecords::new(&world.context, count as u32, rows).unwrap();
        let everything = vec![(0..count as u32).collect::<Vec<_>>()];
        let mut is_current = vec![false; count];
        let mut seen = Vec::new();
        let mut lengths = Vec::new();
        for (camera, none_is_current, all) in [
            (Some(here), true, false),
            (None, true, false),
            (Some(there), false, false),
            (None, false, true),
            (None, false, false),
            (None, true, false),
        ] {
            if let Some(position) = camera {
                seen = splat(&world, &mut splat_pass, &points, &view(position));
            }
            if none_is_current {
                is_current.fill(false);
            }
            let request = RecordRequest { view_is_new: camera.is_some(), none_is_current, all };
            let record = |rec: &mut _| pass.record(rec, request, (&splat_pass, seen_by(&nothing)), &blend);
            world.context.run(record).unwrap();
            let expected = needed_records(if all { &everything } else { &seen }, &neighbours, &is_current);
            assert_eq!(
                read(world.context.tuning(), &pass.list, rows),
                expected,
                "{count} records, {request:?}"
            );
            assert_eq!(pass.listed().unwrap() as usize, expected.len());
            expected.iter().for_each(|&record| is_current[record as usize] = true);
            lengths.push(expected.len());
        }
        if count > 1000 {
            let [first, again, moved, others, none, last] = lengths[..] else { unreachable!() };
            assert!(first == again && first > 100 && first < count && moved > 100 && last > 100);
            assert!(first + moved + others == count && none == 0, "{lengths:?}");
        }
        let fixed: Vec<u32> = (0..count as u32).filter(|_| random.below(3) == 0).collect();
        let list = RecordList::fixed(&world.context, count as u32, rows, &fixed).unwrap();
        assert_eq!(read(world.context.tuning(), &list, rows), fixed);
    }
    assert_silent(&world.context);
}
