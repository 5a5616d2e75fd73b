//! From points to clusters: entry points are in the clusters of the tables, and none is lost,
//! wherever walls are in the grid.

use crate::common::assert_silent;
use crate::world::{Random, World};
use glam::{UVec3, Vec3};
use lightpaths::cpu;
use lightpaths::passes::precompute::entry_points::{Strata, place};
use lightpaths::scene::{Naming, grid::CellGrid, shapes};
use lightpaths::types::{Grid, NO_CLUSTER, PathVertex};

const SEED: u32 = 9;

/// Matches each point of the device with the nearest unused reference point on the same side.
fn match_points(device: &[PathVertex], mut references: Vec<PathVertex>) {
    assert_eq!(device.len(), references.len());
    for point in device {
        let distance = |reference: &PathVertex| match reference.side == point.side {
            true => reference.position.distance(point.position),
            false => f32::INFINITY,
        };
        let nearest = (0..references.len())
            .min_by(|&a, &b| distance(&references[a]).total_cmp(&distance(&references[b])));
        let reference = references.swap_remove(nearest.unwrap());
        assert!(distance(&reference) < 1e-6, "{point:?} has no reference: {reference:?}");
        assert_eq!((point.weight, point.incoming), (reference.weight, Vec3::ZERO));
    }
}

#[test]
fn entry_points_equal_the_reference() {
    let walled = World::new(&shapes::thin_wall(), 16);
    let split: Vec<u32> = walled.hvds.split_clusters().collect();
    assert!(split.len() > 20, "the wall stands on the room's walls");
    entry_points_equal_the_reference_in(&World::room());
    entry_points_equal_the_reference_in(&walled);
}

fn entry_points_equal_the_reference_in(world: &World) {
    let namings = [Naming::Number, Naming::Place].repeat(3);
    for (count, naming) in [0, 1, 63, 64, 65, 2_003].into_iter().zip(namings) {
        let strata = Strata::new(&world.hvds, &world.densities, |_| 1.0, count, (SEED, naming));
        let points = place(&world.context, &world.buffers, &world.clusters, &strata, SEED).unwrap();
        for point in &points {
            let cluster = world.geometry().cluster(&world.hvds, point.position, point.side);
            assert!(cluster == point.cluster && cluster != NO_CLUSTER, "{point:?} belongs to {cluster}");
        }
        let patches: Vec<_> = strata
            .patches
            .iter()
            .map(|patch| ([patch.p0, patch.p1, patch.p2], patch.side, patch.weight, patch.stream))
            .collect();
        let references = cpu::entry_points::entry_points(
            world.geometry(),
            &world.hvds,
            &patches,
            &strata.point_offsets,
            SEED,
        );
        match_points(&points, references);
    }
    assert_silent(&world.context);
}

#[test]
fn no_random_point_of_a_surface_is_lost() {
    let world = World::room();
    let mut random = Random::new(61);
    let mut lost = 0;
    for _ in 0..200_000 {
        let (position, _, side) = world.surface_point(&mut random);
        let is_active = world.surfaces[side as usize / 2].side_is_active(side % 2 == 1);
        lost += u32::from(is_active && world.geometry().cluster(&world.hvds, position, side) == NO_CLUSTER);
    }
    assert_eq!(lost, 0);
}

/// Walls exactly on cell boundaries, a pull beside them, and in between. The grid's numbers
/// are powers of two.
#[test]
fn no_vertex_of_a_box_is_lost_wherever_its_walls_lie_in_the_grid() {
    let cell = 0.125;
    for offset in (0..=64).step_by(4).chain([1, 63]) {
        let mut scene = shapes::closed_box(Vec3::new(10.0, 6.0, 8.0) * cell, 0.7);
        let shift = Vec3::splat(offset as f32 * cell / 64.0);
        for triangle in &mut scene.triangles {
            triangle.positions = triangle.positions.map(|p| p + shift);
        }
        let grid = CellGrid::new(Grid {
            low: Vec3::splat(-8.0 * cell),
            inverse_cell: 1.0 / cell,
            cells: UVec3::splat(16),
            pull: cell / 64.0,
        });
        let world = World::on_grid(&scene, grid);
        let strata = Strata::new(&world.hvds, &world.densities, |_| 1.0, 1_009, (SEED, Naming::Number));
        let points = place(&world.context, &world.buffers, &world.clusters, &strata, SEED).unwrap();
        assert!(points.iter().all(|point| point.cluster != NO_CLUSTER), "{offset}/64 of a cell");
        let (_, paths) = world.light_paths(points, 0).unwrap();
        assert!(paths.steps.len() > 3_000);
        assert_eq!(paths.lost, 0, "{offset}/64 of a cell");
        assert_silent(&world.context);
    }
}
