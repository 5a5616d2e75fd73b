//! Shafts hold every triangle that may hide a light from their points, and few others.

use crate::common::{assert_silent, context};
use crate::path_trace;
use crate::world::{Random, World};
use glam::Vec3;
use lightpaths::cpu::shafts::hiders;
use lightpaths::gpu::{Buffer, Recorder};
use lightpaths::passes::frame::shafts::{PointBatch, SHAFT_WORDS, Shafts};
use lightpaths::passes::{OneLight, light_sources};
use lightpaths::types::{LightSource, Node};

/// Points of a batch in these tests.
const POINTS: usize = 12;

/// Points on one side in a disc of width `width`, and `strays` points anywhere.
fn points(world: &World, random: &mut Random, width: f32, strays: usize) -> Vec<(Vec3, u32)> {
    let (centre, _, side) = world.surface_point(random);
    let [p0, p1, p2] = world.triangles[side as usize / 2].positions;
    let mut near = || {
        let step = width * (random.unit() - 0.5) * (p1 - p0).normalize()
            + width * (random.unit() - 0.5) * (p2 - p0).normalize();
        (centre + step, side)
    };
    let mut found: Vec<_> = (strays..POINTS).map(|_| near()).collect();
    found.extend((0..strays).map(|_| {
        let (position, _, side) = world.surface_point(random);
        (position, side)
    }));
    found
}

fn batch(world: &World, points: &[(Vec3, u32)]) -> PointBatch {
    let geometry = world.geometry();
    let origins = points.iter().map(|&(p, side)| geometry.offset_origin(p, geometry.normal(side)));
    let normal = geometry.normal(points[0].1);
    let spread = points.iter().map(|&(_, side)| (geometry.normal(side) - normal).length());
    PointBatch {
        low: origins.clone().reduce(Vec3::min).unwrap(),
        high: origins.reduce(Vec3::max).unwrap(),
        spread: spread.fold(0.0, f32::max),
        normal,
    }
}

/// Triangles at or below the roots of a shaft.
fn reached([triangles, open]: [&[u32]; 2], nodes: &[Node]) -> Vec<u32> {
    let mut found = triangles.to_vec();
    let mut open = open.to_vec();
    while let Some(index) = open.pop() {
        let node = &nodes[index as usize];
        let (first, count) = node.inner_children();
        open.extend(first..first + count);
        for meta in [node.children.z, node.children.w].into_iter().flat_map(u32::to_le_bytes) {
            let (first, count) = (u32::from(meta & 31), (meta >> 5).count_ones());
            if meta & 31 < 24 {
                found.extend((first..first + count).map(|place| node.children.y + place));
            }
        }
    }
    found
}

/// Words of the shafts from batches to a light.
fn shafts_of(
    world: &World,
    lights: &[LightSource],
    index: u32,
    batches: &[PointBatch],
    all: bool,
) -> Vec<u32> {
    let table = Buffer::from_slice(&world.context, "lights", lights).unwrap();
    let light = OneLight { traces_all: all, ..OneLight::new(&table, index, &lights[index as usize]) };
    let shafts = Shafts::new(&world.context, batches.len() as u32).unwrap();
    shafts.batches.write(batches).unwrap();
    let record = |rec: &mut Recorder| shafts.record(&mut rec.pass("shafts"), &world.buffers, light);
    world.context.run(record).unwrap();
    let words: Vec<u32> = shafts.roots.read().unwrap();
    let list: Vec<u32> = shafts.list.read().unwrap();
    let mut listed = list[4..][..list[3] as usize].to_vec();
    listed.sort_unstable();
    let deep = (0..batches.len() as u32).filter(|&batch| !roots_of(&words, batch as usize)[1].is_empty());
    assert!(listed.iter().copied().eq(deep), "batches with nodes are listed, each once");
    let swizzled = if list[3] == 0 { [0; 3] } else { world.context.tuning().swizzled(list[3]) };
    assert_eq!(list[..3], swizzled, "{} batches", list[3]);
    words
}

/// Triangles and nodes at which rays of a batch start.
fn roots_of(words: &[u32], batch: usize) -> [&[u32]; 2] {
    let words = &words[batch * SHAFT_WORDS as usize..][..SHAFT_WORDS as usize];
    let [triangles, nodes] = [words[0] & 0xffff, words[0] >> 16].map(|count| count as usize);
    [&words[1..=triangles], &words[words.len() - nodes..]]
}

#[test]
fn nothing_that_hides_a_light_is_missed() {
    for world in path_trace::worlds() {
        let mut random = Random::new(61);
        let nodes: Vec<Node> = world.buffers.nodes.read().unwrap();
        let lights = light_sources(&path_trace::lights());
        let groups: Vec<_> = [(0.0, 0), (0.02, 0), (0.2, 0), (0.02, 1), (0.0, POINTS - 1)]
            .into_iter()
            .flat_map(|shape| [shape; 40])
            .map(|(width, strays)| points(&world, &mut random, width, strays))
            .collect();
        let batches: Vec<_> = groups.iter().map(|points| batch(&world, points)).collect();
        for index in 0..lights.len() as u32 {
            let words = shafts_of(&world, &lights, index, &batches, false);
            let (mut hiding, mut kept) = (0, 0);
            for (number, points) in groups.iter().enumerate() {
                let own = reached(roots_of(&words, number), &nodes);
                let hiders = hiders(world.geometry(), &lights[index as usize], points);
                let missed: Vec<_> = hiders.iter().filter(|hider| !own.contains(hider)).collect();
                assert!(missed.is_empty(), "light {index}, batch {number}: {missed:?} of {hiders:?} missed");
                if number < 80 {
                    (hiding, kept) = (hiding + hiders.len(), kept + own.len());
                }
            }
            // Narrow shafts keep few triangles that hide nothing; without shafts, a batch would
            // keep over sixty.
            assert!(kept <= 3 * hiding + 80 * 3, "light {index}: {kept} kept, {hiding} hide something");
        }
    }
    assert_silent(&context());
}

#[test]
fn batches_without_points_or_turned_away_have_no_roots_and_all_rays_start_at_the_tree_s() {
    let world = path_trace::world();
    let lights = light_sources(&path_trace::lights());
    let light = lights[0].position;
    let batch =
        |position: Vec3, normal: Vec3| PointBatch { low: position, high: position, spread: 0.0, normal };
    let away = batch(light + 0.3 * Vec3::Y, Vec3::Y);
    let none = PointBatch { low: Vec3::splat(1e30), high: Vec3::splat(-1e30), ..away };
    let batches = [away, none, batch(light + 0.3 * Vec3::Y, Vec3::NEG_Y)];
    let words = shafts_of(&world, &lights, 0, &batches, false);
    assert_eq!([0, 1].map(|number| roots_of(&words, number).concat()), [[0; 0]; 2]);
    let words = shafts_of(&world, &lights, 0, &batches, true);
    assert_eq!([0, 1, 2].map(|number| roots_of(&words, number)), [[&[] as &[u32], &[0]]; 3]);
    assert_silent(&context());
}
