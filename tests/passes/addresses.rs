//! Scene lists that are too long for a binding are read through addresses: kernels give the same
//! results as with bound lists.

use crate::common::assert_silent;
use crate::world::{Random, World};
use lightpaths::gpu::Buffer;
use lightpaths::gpu::spirv::HAS_CUTOUTS;
use lightpaths::passes::gather_targets::GatherTargetPacking;
use lightpaths::passes::precompute::Silent;
use lightpaths::passes::precompute::entry_points::{Strata, place};
use lightpaths::passes::precompute::gather_rays::{self, Hemisphere};
use lightpaths::passes::precompute::rays::{RayQuery, Rays};
use lightpaths::scene::Naming;
use lightpaths::types::{GatherRay, Node, Surface, Triangle};

const SEED: u32 = 11;

/// Output bytes of kernels that read nodes, triangles and surfaces, in this order.
fn made(world: &World) -> [Vec<u8>; 4] {
    let World { context, buffers, clusters, .. } = world;
    let mut random = Random::new(23);
    let queries: Vec<_> =
        (0..3_000).map(|_| RayQuery { origin: random.cube() * 0.4, direction: random.sphere() }).collect();
    let answers = Rays::new(context).unwrap().trace(buffers, &queries).unwrap();
    assert!(answers.iter().filter(|answer| answer.t > 0.0).count() > 2_000);

    let strata = Strata::new(&world.hvds, &world.densities, |_| 1.0, 3_000, (SEED, Naming::Number));
    let entry_points = place(context, buffers, clusters, &strata, SEED).unwrap();
    let (entry_points, paths) = world.light_paths(entry_points, SEED).unwrap();
    assert!(paths.steps.len() > 1_000);

    let points = world.cache_points(&mut random, 200, 0.2);
    let points = Buffer::from_slice(context, "cache points", &points).unwrap();
    let packing = GatherTargetPacking::new(world.hvds.cluster_count(), world.materials.len(), 0.05).unwrap();
    let hemisphere = Hemisphere::new(64);
    let table =
        gather_rays::trace(context, buffers, clusters, &points, 200, hemisphere, packing, SEED, &mut Silent)
            .unwrap();
    let rays: Vec<GatherRay> = table.read().unwrap();
    [
        bytemuck::cast_slice(&answers).to_vec(),
        bytemuck::cast_slice(&entry_points).to_vec(),
        bytemuck::cast_slice(&paths.steps).to_vec(),
        bytemuck::cast_slice(&rays).to_vec(),
    ]
}

#[test]
fn lists_behind_addresses_are_the_lists() {
    for mut world in [World::room(), World::textured_glossy_room(), World::room_with_holes()] {
        let bound = made(&world);
        let context = world.context.clone();
        let [nodes, triangles, surfaces] =
            [&world.buffers.nodes, &world.buffers.triangles, &world.buffers.surfaces];
        let lists: (Vec<Node>, Vec<Triangle>, Vec<Surface>) =
            (nodes.read().unwrap(), triangles.read().unwrap(), surfaces.read().unwrap());
        world.buffers.nodes = Buffer::address_of(&context, "nodes", &lists.0).unwrap();
        let triangles = Buffer::address_of(&context, "triangles", &lists.1).unwrap();
        world.buffers.triangles =
            if world.opacity.is_empty() { triangles } else { triangles.with_constant(HAS_CUTOUTS) };
        world.buffers.surfaces = Buffer::address_of(&context, "surfaces", &lists.2).unwrap();
        assert_eq!(world.buffers.nodes.bytes() as usize, size_of::<Node>(), "one item is bound");
        let followed: Vec<Surface> = world.buffers.surfaces.followed().read().unwrap();
        assert_eq!(bytemuck::cast_slice::<_, u8>(&followed), bytemuck::cast_slice::<_, u8>(&lists.2));
        for (what, (bound, behind)) in
            ["rays", "entry points", "paths", "gather rays"].iter().zip(bound.iter().zip(&made(&world)))
        {
            assert!(bound == behind, "{what} differ");
        }
        assert_silent(&context);
    }
}
