//! Light paths, vertex by vertex, and the two orders in which they are stored.

use crate::common::assert_silent;
use crate::world::{Random, World};
use glam::{DVec3, Vec3};
use lightpaths::cpu::light_paths::{Walk, Walker};
use lightpaths::cpu::sampling::{hash, owen_scramble, sample_3d, sobol};
use lightpaths::cpu::textures::unpack_colour;
use lightpaths::gpu::Buffer;
use lightpaths::passes::frame::path_scan::{FROM_ENTRY, HEAD};
use lightpaths::passes::precompute::light_paths::{self, LightPathsPush, PathState};
use lightpaths::passes::precompute::path_orders::PathRange;
use lightpaths::scene::{CellSizes, Material};
use lightpaths::types::{NO_CLUSTER, PathVertex};

const SEED: u32 = 77;
const STEPS: usize = 8;

fn entry_points(world: &World, count: usize) -> Vec<PathVertex> {
    let mut random = Random::new(51);
    let mut points = Vec::new();
    while points.len() < count {
        let (position, _, side) = world.surface_point(&mut random);
        let cluster = world.geometry().cluster(&world.hvds, position, side);
        // The outside of the room has no clusters.
        if cluster != NO_CLUSTER {
            let weight = [1.0, 4.0, 0.5][points.len() % 3];
            points.push(PathVertex { position, side, incoming: Vec3::ZERO, weight, cluster, lobe: 0.0 });
        }
    }
    points
}

/// Extends live paths on the device; returns the vertices of each, with the packed colour of
/// the vertex before.
fn extend(world: &World, states: &mut Vec<PathState>) -> Vec<Vec<(PathVertex, u32)>> {
    let paths = Buffer::from_slice(&world.context, "paths", states).unwrap();
    let bytes = states.len() * STEPS * size_of::<PathVertex>();
    let vertices = Buffer::storage(&world.context, "vertices", bytes as u64).unwrap();
    let counts = Buffer::storage(&world.context, "counts", 4 * states.len() as u64).unwrap();
    let textures = &world.buffers.textures;
    let colours = vec![u32::MAX; states.len() * STEPS];
    let colours = Buffer::from_slice(&world.context, "colours", &colours).unwrap();
    let guides = Buffer::from_slice(&world.context, "guides", &CellSizes::default().guides()).unwrap();
    world.dispatch(
        light_paths::STEM,
        &[
            ("STEPS", STEPS as u32),
            ("ROULETTE_THRESHOLD", light_paths::ROULETTE_THRESHOLD.to_bits()),
            ("EDITABLE_ALBEDO", light_paths::EDITABLE_ALBEDO.to_bits()),
            ("IS_GLOSSY", u32::from(world.materials.iter().any(Material::may_be_glossy))),
            textures.constant(),
        ],
        |_| states.len() as u32,
        &LightPathsPush { grid: *world.hvds.grid, path_count: states.len() as u32, seed: SEED },
        &textures.after([
            ("Nodes", &world.buffers.nodes),
            ("Triangles", &world.buffers.triangles),
            ("Surfaces", &world.buffers.surfaces),
            ("Materials", &world.buffers.materials),
            ("Octree", &world.clusters.octree),
            ("CellClusters", &world.clusters.cell_clusters),
            ("Guides", &guides),
            ("Paths", &paths),
            ("Vertices", &vertices),
            ("VertexCounts", &counts),
            ("VertexColours", &colours),
        ]),
    );
    *states = paths.read().unwrap();
    let counts: Vec<u32> = counts.read().unwrap();
    let vertices: Vec<PathVertex> = vertices.read().unwrap();
    let vertices: Vec<_> = vertices.into_iter().zip(colours.read::<u32>().unwrap()).collect();
    vertices.chunks_exact(STEPS).zip(counts).map(|(row, count)| row[..count as usize].to_vec()).collect()
}

/// Compares the device's vertices with the reference's. Returns true if the paths part. After each
/// step the reference continues from the device's vertex, so that errors do not accumulate.
fn parts(walk: &Walk<'_>, walker: &mut Walker, found: &[(PathVertex, u32)], goes_on: bool) -> bool {
    for (vertex, colour) in found {
        let reference_colour = walk.geometry.colour_at(walker.side, walker.position);
        // Half of the last bit of a packed root, and the error of f32 texture coordinates.
        if (unpack_colour(*colour) - reference_colour).abs().max_element() > 2e-3 {
            return true;
        }
        let Some(reference) = walk.step(walker) else { return true };
        let error = (reference.position - vertex.position).length();
        let weight_error = (reference.weight - vertex.weight).abs();
        if reference.side != vertex.side
            || error > 1e-4
            || weight_error > 1e-5 * reference.weight
            || (reference.incoming - vertex.incoming).length() > 1e-4
            || (reference.lobe - vertex.lobe).abs() > 1e-5
        {
            return true;
        }
        // The cluster of the device's point, not of the reference's.
        if vertex.cluster != walk.geometry.cluster(walk.hvds, vertex.position, vertex.side) {
            return true;
        }
        // The reference's walker has moved to the vertex that the reference returned.
        if walker.position != reference.position || walker.incoming.as_vec3() != reference.incoming {
            return true;
        }
        walker.position = vertex.position;
        walker.incoming = vertex.incoming.as_dvec3();
    }
    !goes_on && walk.step(&mut walker.clone()).is_some()
}

fn worlds() -> [World; 4] {
    [World::room(), World::textured_room(), World::glossy_room(), World::textured_glossy_room()]
}

#[test]
fn vertices_equal_the_reference() {
    for world in worlds() {
        vertices_equal_the_reference_in(&world);
    }
}

fn vertices_equal_the_reference_in(world: &World) {
    let walk = Walk {
        geometry: world.geometry(),
        materials: &world.reflectances(),
        hvds: &world.hvds,
        seed: SEED,
        roulette_threshold: f64::from(light_paths::ROULETTE_THRESHOLD),
        editable_albedo: f64::from(light_paths::EDITABLE_ALBEDO),
    };
    for count in [0, 1, 63, 64, 65, 4_999] {
        let state = |(path, entry): (u32, &PathVertex)| PathState {
            position: entry.position,
            side: entry.side,
            throughput: Vec3::splat(entry.weight),
            incoming: Vec3::ZERO,
            path,
            stream: hash(path),
            depth: 0,
            is_alive: 1,
        };
        let mut states: Vec<_> = (0..).zip(&entry_points(world, count)).map(state).collect();
        let walker = |state: &PathState| Walker {
            position: state.position,
            side: state.side,
            throughput: state.throughput.as_dvec3(),
            incoming: DVec3::ZERO,
            stream: state.stream,
            depth: 0,
        };
        let mut walkers: Vec<_> = states.iter().map(walker).collect();
        let (mut parted, mut vertices, mut rounds) = (0, 0, 0);
        // Images make the walls darker, and paths shorter.
        let least = if world.coordinates.is_empty() { 2 * count } else { count / 2 };
        while !states.is_empty() {
            let rows = extend(world, &mut states);
            let mut survivors = Vec::new();
            for (state, row) in states.iter().zip(&rows) {
                let walker = &mut walkers[state.path as usize];
                vertices += row.len();
                let goes_on = state.is_alive == 1;
                if parts(&walk, walker, row, goes_on) {
                    parted += 1;
                } else if goes_on {
                    survivors.push(*state);
                }
            }
            states = survivors;
            rounds += 1;
        }
        // Rays near an edge, and roulette close to its threshold.
        assert!(parted * 500 <= count, "{parted} of {count} paths part from the reference");
        assert!(count < 1_000 || (vertices > least && rounds > 1), "{vertices} vertices in {rounds} rounds");
    }
    assert_silent(&world.context);
}

#[test]
fn paths_are_stored_whole_in_both_orders() {
    for world in worlds() {
        paths_are_stored_whole_in(&world);
    }
}

fn paths_are_stored_whole_in(world: &World) {
    let is_glossy = world.materials.iter().any(Material::may_be_glossy);
    for count in [0, 1, 64, 65, 9_001] {
        let entries = entry_points(world, count);
        let traced = entries.clone();
        let base = world.hvds.levels[0].len();
        let (entries, paths) = world.light_paths(entries, SEED).unwrap();
        // Each cluster has two lists: entry points, and other vertices.
        assert_eq!(paths.contribution_offsets.len(), 2 * base + 1);
        assert_eq!(paths.contributions.len(), paths.contribution_offsets[2 * base] as usize + 1);
        assert_eq!(paths.steps.len() as u64, u64::from(paths.contribution_offsets[2 * base]) + paths.lost);

        // The same walk in the test's own rounds.
        let mut expected: Vec<Vec<(PathVertex, u32)>> =
            traced.iter().map(|&entry| vec![(entry, u32::MAX)]).collect();
        let mut states: Vec<_> = (0..)
            .zip(&traced)
            .map(|(path, e)| PathState {
                position: e.position,
                side: e.side,
                throughput: Vec3::splat(e.weight),
                incoming: Vec3::ZERO,
                path,
                stream: hash(path),
                depth: 0,
                is_alive: 1,
            })
            .collect();
        while !states.is_empty() {
            for (row, state) in extend(world, &mut states).into_iter().zip(&states) {
                expected[state.path as usize].extend(row);
            }
            states.retain(|state| state.is_alive == 1);
        }
        // Material 1 is editable: paths that it reflects after their entry point come last.
        let is_edited = |vertices: &Vec<(PathVertex, u32)>| {
            let targets = vertices.get(1..vertices.len() - 1).unwrap_or(&[]);
            let material = |vertex: &PathVertex| world.surfaces[vertex.side as usize / 2].material;
            is_glossy && targets.iter().any(|(vertex, _)| material(vertex) == 1)
        };
        expected.sort_by_key(is_edited);
        assert!(expected.iter().zip(&entries).all(|(path, entry)| path[0].0.position == entry.position));
        // The streams follow the entry points.
        let number = |entry: &PathVertex| traced.iter().position(|traced| traced.position == entry.position);
        let streams = entries.iter().map(|entry| hash(number(entry).unwrap() as u32));
        assert!(count > 65 || paths.streams == streams.collect::<Vec<_>>());
        assert_eq!(paths.streams.len(), count);
        let first_edited: usize =
            expected.iter().filter(|path| !is_edited(path)).map(|path| path.len()).sum();
        let groups = [
            PathRange { materials: 0, steps: 0..first_edited as u32 },
            PathRange { materials: 1, steps: first_edited as u32..paths.steps.len() as u32 },
        ];
        let groups: Vec<_> =
            groups.into_iter().filter(|group| is_glossy && !group.steps.is_empty()).collect();
        assert_eq!(paths.ranges, groups);
        assert!(count < 1_000 || !is_glossy || groups.len() == 2);

        let (mut steps, mut colours) = (paths.steps.iter(), paths.colours.iter());
        let has_images = !world.coordinates.is_empty();
        let mut taken = vec![false; paths.contributions.len()];
        for (path, vertices) in expected.iter().enumerate() {
            let mut material = HEAD;
            for (vertex, colour) in vertices {
                let step = steps.next().unwrap();
                if has_images {
                    assert_eq!(colours.next(), Some(colour));
                }
                if is_glossy {
                    let arrivals = &paths.arrivals;
                    let contribution = step.contribution as usize;
                    assert_eq!(arrivals.lobes[paths.steps.len() - steps.len() - 1], vertex.lobe);
                    assert_eq!(
                        (arrivals.incoming[contribution], arrivals.sides[contribution]),
                        (vertex.incoming, vertex.side)
                    );
                    if let [_, (second, colour), ..] = &**vertices {
                        assert_eq!(arrivals.departures[path], second.incoming);
                        assert_eq!(arrivals.entry_colours[path], *colour);
                    }
                }
                let list = 2 * vertex.cluster as usize + usize::from(material != HEAD);
                assert_eq!((step.material, step.weight), (material, vertex.weight));
                let is_entry = material == HEAD;
                material = world.surfaces[vertex.side as usize / 2].material;
                if is_entry && world.materials[material as usize].may_be_glossy() {
                    material = FROM_ENTRY;
                }
                assert_ne!(vertex.cluster, NO_CLUSTER, "no vertex is lost");
                assert!(
                    (paths.contribution_offsets[list]..paths.contribution_offsets[list + 1])
                        .contains(&step.contribution)
                );
                assert!(
                    !std::mem::replace(&mut taken[step.contribution as usize], true),
                    "contributions are used once"
                );
                assert_eq!(paths.contributions[step.contribution as usize].path(), path as u32);
            }
        }
        assert!(steps.next().is_none() && colours.next().is_none());
        assert_eq!(paths.lost, 0);
        assert_eq!(paths.arrivals.lobes.is_empty(), !is_glossy || count == 0);
    }
    assert_silent(&world.context);
}

/// The reference's samples are stratified: 256 of them fall evenly into any 256 boxes of one shape
/// in two neighbouring axes.
#[test]
fn samples_are_stratified() {
    for seed in [0, 9] {
        let points: Vec<Vec3> = (0..256).map(|index| sample_3d(index, seed)).collect();
        for (a, b) in [(0, 1), (1, 2)] {
            for bits in 0..=8 {
                let (columns, rows) = (1_u32 << bits, 1_u32 << (8 - bits));
                let mut counts = vec![0; 256];
                for point in &points {
                    let cell = |value: f32, cells: u32| (value * cells as f32) as u32;
                    counts[(cell(point[a], columns) * rows + cell(point[b], rows)) as usize] += 1;
                }
                // The first two dimensions make perfect nets, the second and third nets
                // of quality 1.
                let bound = if a == 0 { 1 } else { 2 };
                assert!(counts.iter().all(|&count| count <= bound), "axes {a} and {b}, {columns}×{rows}");
            }
        }
    }
    assert_eq!(sobol(1), [1 << 31; 3]);
    assert_eq!(sobol(3), [0xc000_0000, 0x4000_0000, 0x4000_0000]);
    // A scramble keeps the order of halves, quarters and so on: equal prefixes stay equal.
    for bits in 1..32 {
        let (x, y) = (0x1234_5678_u32, 0x1234_5678 ^ 0xffff_ffff_u32 >> bits);
        assert_eq!((owen_scramble(x, 3) ^ owen_scramble(y, 3)) >> (32 - bits), 0);
    }
}
