//! Gather rays and clearances: the target of each ray of a cache point, and its weight in
//! the translational gradient.

use crate::common::assert_silent;
use crate::world::{Random, World, room, textured};
use glam::{DVec3, Vec3};
use lightpaths::cpu::gather::unpack;
use lightpaths::cpu::gather_rays::{Found, Tracing, translational_gradient};
use lightpaths::cpu::hemisphere::Strata;
use lightpaths::cpu::textures::unpack_colour;
use lightpaths::gpu::Buffer;
use lightpaths::passes::gather_targets::{GatherTarget, GatherTargetPacking, Met};
use lightpaths::passes::precompute::Silent;
use lightpaths::passes::precompute::gather_rays::{self, GatherTracer, Hemisphere, RayTable, Rows};
use lightpaths::passes::precompute::kept::hits::KeptHits;
use lightpaths::passes::precompute::visibility::clearance::{Clearance, ClearancePush};
use lightpaths::scene::Naming;
use lightpaths::types::{CachePoint, GatherRay, NO_TARGET};

const SEED: u32 = 5;

fn tracing(world: &World, rings: u32) -> Tracing<'_> {
    let strata = Strata { rings, sectors: 4 * rings };
    Tracing {
        geometry: world.geometry(),
        hvds: &world.hvds,
        strata,
        seed: SEED,
        naming: Naming::Number,
        entry_points: &world.in_clusters,
        min_entry_points: gather_rays::MIN_ENTRY_POINTS,
    }
}

fn trace(world: &World, points: &[CachePoint], rings: u32, packing: GatherTargetPacking) -> RayTable {
    let buffer = Buffer::from_slice(&world.context, "cache points", points).unwrap();
    let rays = gather_rays::trace(
        &world.context,
        &world.buffers,
        &world.clusters,
        &buffer,
        points.len() as u32,
        Hemisphere { rings, sectors: 4 * rings },
        packing,
        SEED,
        &mut Silent,
    );
    rays.unwrap()
}

#[test]
fn targets_and_gradient_weights_equal_the_reference() {
    for world in [World::room(), World::new(&textured(room()), 16), World::room_with_movable_leaves()] {
        targets_and_gradient_weights_equal_the_reference_in(&world);
    }
}

fn targets_and_gradient_weights_equal_the_reference_in(world: &World) {
    let packing = GatherTargetPacking::new(world.hvds.cluster_count(), world.materials.len(), 0.05).unwrap();
    let mut random = Random::new(41);
    let (mut tinted, mut other_colours, mut far_away) = (0, 0, 0);
    let (mut rays_in_all, mut disagree, mut coarse, mut lost, mut compared) = (0, 0, 0, 0, 0);
    for (rings, count) in [(1, 0), (1, 1), (1, 130), (3, 7), (4, 65), (8, 23)] {
        let points = world.cache_points(&mut random, count, 0.1);
        let tracing = tracing(world, rings);
        let table = trace(world, &points, rings, packing);
        let rays = table.read().unwrap();
        let colours: Vec<u32> =
            table.colours.iter().flat_map(|buffer| buffer.read::<u32>().unwrap()).collect();
        assert_eq!(table.has_colours, !world.coordinates.is_empty());
        let per_point = tracing.strata.rays();
        let hemisphere = Hemisphere { rings, sectors: 4 * rings };
        assert_eq!(rays.len(), count * per_point as usize);
        for ((index, point), row) in (0_u32..).zip(&points).zip(rays.chunks_exact(per_point as usize)) {
            let found: Vec<_> = (0..per_point).map(|ray| tracing.trace(point, ray)).collect();
            let far = f64::from(gather_rays::far_cells(hemisphere)) * world.hvds.grid.cell_size();
            let target = |found: &Found| {
                let is_far = found.distance > far;
                let met = |material| Met { material, is_far };
                found.target.map_or(NO_TARGET, |(cluster, material)| {
                    packing.pack(GatherTarget::Cluster(cluster), met(material))
                })
            };
            let wrong = row.iter().zip(&found).filter(|(ray, found)| ray.target != target(found)).count();
            far_away += found.iter().filter(|found| found.target.is_some() && found.distance > far).count();
            rays_in_all += row.len();
            disagree += wrong;
            let base = world.hvds.levels[0].end;
            coarse +=
                found.iter().filter(|found| found.target.is_some_and(|(cluster, _)| cluster >= base)).count();
            lost += found.iter().filter(|found| found.target.is_none() && found.distance.is_finite()).count();
            if wrong > 0 {
                continue;
            }
            // Half of the last bit of a packed root, and the error of f32 texture coordinates.
            let first = index as usize * per_point as usize;
            let is_apart = |(ray, found): &(usize, &Found)| {
                let packed = colours.get(first + ray).filter(|_| table.has_colours);
                let colour = packed.map_or(DVec3::ONE, |&packed| unpack_colour(packed));
                found.target.is_some() && (colour - found.colour).abs().max_element() > 2e-3
            };
            tinted += found.iter().filter(|found| found.colour.min_element() < 0.9).count();
            other_colours += found.iter().enumerate().filter(is_apart).count();
            let distances: Vec<_> = found.iter().map(|found| found.distance).collect();
            for ray in 0..per_point {
                // The gradient is linear in the radiances: a ray's weight is its gradient when it
                // alone is bright.
                let alone = |other: u32| f64::from(u8::from(other == ray));
                let min_distance = f64::from(packing.min_distance);
                let weight =
                    translational_gradient(tracing.strata, &distances, alone, min_distance) * min_distance;
                let stored = unpack(row[ray as usize].gradient);
                // Half of the last bit of a half, and the error of f32 distances of grazing rays.
                let bound = weight.abs().max_element() / 1024.0 + 1e-6;
                assert!(
                    (stored - weight).abs().max_element() < bound,
                    "ray {ray}: {stored}, {weight} by the reference"
                );
                compared += 1;
            }
        }
    }
    // Rays on an edge of a triangle, of a cell, or between two levels.
    println!("{other_colours} colours differ, {tinted} are dark, {disagree} of {rays_in_all} rays disagree");
    assert!(other_colours * 500 <= rays_in_all, "{other_colours} of {rays_in_all} rays have other colours");
    assert_eq!(tinted * 4 > rays_in_all, !world.coordinates.is_empty());
    assert!(disagree * 500 <= rays_in_all, "{disagree} of {rays_in_all} rays disagree");
    assert!(compared * 10 > rays_in_all * 7, "{compared} of {rays_in_all} weights were compared");
    assert!(
        coarse * 10 > rays_in_all && coarse < rays_in_all,
        "{coarse} of {rays_in_all} read coarser levels"
    );
    assert!(
        far_away * 20 > rays_in_all && far_away < rays_in_all,
        "{far_away} of {rays_in_all} are far away"
    );
    assert!(lost * 100 < rays_in_all, "{lost} of {rays_in_all} hits have no cluster");
    assert_silent(&world.context);
}

/// Rows of points that stay are kept, in whatever order the points come.
#[test]
fn kept_hits_change_no_ray() {
    let world = World::room_with_movable_leaves();
    assert!(world.buffers.movable.is_some());
    let packing = GatherTargetPacking::new(world.hvds.cluster_count(), world.materials.len(), 0.05).unwrap();
    let hemisphere = Hemisphere { rings: 4, sectors: 16 };
    let points = world.cache_points(&mut Random::new(47), 90, 0.1);
    let trace = |points: &[CachePoint], rows: Rows<'_>| {
        let buffer = Buffer::from_slice(&world.context, "cache points", points).unwrap();
        let tracer = GatherTracer {
            context: &world.context,
            scene: &world.buffers,
            clusters: &world.clusters,
            hemisphere,
            packing,
            seed: SEED,
        };
        let traced = tracer.trace((&buffer, &rows), &mut Silent);
        let (table, traced) = traced.unwrap();
        let words = |ray: &GatherRay| [ray.target, ray.gradient];
        (table.read().unwrap().iter().map(words).collect::<Vec<_>>(), traced)
    };
    let (reference, alone) = trace(&points, Rows::none(90));
    // Room for all but ten.
    let mut hits = KeptHits::new(&world.context, [1, 2], [64, 80]).unwrap();
    let mut keep = |points: &[CachePoint]| {
        let assigned = hits.assign(points);
        let found = trace(points, Rows::new(&hits, assigned.rows.clone()));
        hits.fill(assigned);
        found
    };
    let (first, all) = keep(&points[..60]);
    let turned: Vec<CachePoint> = points.iter().rev().copied().collect();
    let (second, others) = keep(&turned);
    let rows = |rays: &[[u32; 2]]| rays.chunks_exact(64).map(<[_]>::to_vec).collect::<Vec<_>>();
    assert_eq!(rows(&first), rows(&reference)[..60]);
    assert_eq!(rows(&second).into_iter().rev().collect::<Vec<_>>(), rows(&reference));
    // Rays below the surface are not traced.
    assert!(alone.fixed > 90 * 32 && all.fixed < alone.fixed && alone.fixed == all.fixed + others.fixed);
    assert!(others.movable == alone.movable && (1..90 * 64).contains(&alone.movable), "{alone:?}");
    assert_silent(&world.context);
}

const UNTOUCHED: Clearance = Clearance { distance: -1.0, occluder: Vec3::ZERO, inner: 0 };

#[test]
fn clearances_equal_the_reference() {
    let world = World::room();
    let mut random = Random::new(42);
    let far = 0.4;
    // Workgroups of a CPU device, of a GPU, and of one thread.
    let sizes = [(1, 0, 8), (1, 1, 64), (4, 63, 64), (4, 64, 8), (4, 65, 1), (8, 31, 64)];
    for ((rings, count, group), naming) in sizes.into_iter().zip([Naming::Number, Naming::Place].repeat(3)) {
        let points = world.cache_points(&mut random, count, 0.1);
        let tracing = Tracing { naming, ..tracing(&world, rings) };
        let side_bits = naming.side_bits();
        let candidates = Buffer::from_slice(&world.context, "candidates", &points).unwrap();
        let clearances =
            Buffer::from_slice(&world.context, "clearances", &vec![UNTOUCHED; count + 2]).unwrap();
        world.dispatch(
            "clearance",
            &[("RINGS", rings), ("SECTORS", 4 * rings), ("local_size_x", group)],
            |pipeline| count as u32 * pipeline.local_size()[0],
            &ClearancePush { candidate_count: count as u32, seed: SEED, side_bits, scene_size: far },
            &[
                ("Nodes", &world.buffers.nodes),
                ("Triangles", &world.buffers.triangles),
                ("Surfaces", &world.buffers.surfaces),
                ("Candidates", &candidates),
                ("Clearances", &clearances),
            ],
        );
        let mut found: Vec<Clearance> = clearances.read().unwrap();
        let behind = found.split_off(count);
        assert!(behind.iter().all(|c| c.distance == -1.0), "nothing is written past the last candidate");
        let reference: Vec<_> = points.iter().map(|point| tracing.clearance(point, far)).collect();
        // A ray that passes an edge in f32 may have been the nearest.
        let differs = |(device, (distance, wall)): (&Clearance, &(f64, DVec3))| {
            (f64::from(device.distance) - distance).abs() > 1e-4 * distance
                || (device.occluder.as_dvec3() - wall).length() > 1e-3 * wall.length()
        };
        let differ = found.iter().zip(&reference).filter(|&pair| differs(pair)).count();
        assert!(differ * 30 <= count, "{differ} of {count} clearances differ");
        let some = |is: &dyn Fn(&(f64, DVec3)) -> bool| count < 60 || reference.iter().any(is);
        assert!(some(&|&(t, _)| t == f64::from(far)) && some(&|&(t, _)| t < 0.1));
        assert!(some(&|&(_, wall)| wall != DVec3::ZERO) && some(&|&(_, wall)| wall == DVec3::ZERO));
    }
    assert_silent(&world.context);
}

/// Two sides in three are inner ones, as if many points were in solids. The nearest hit of some
/// others is of an active side.
#[test]
fn points_in_solids_have_no_clearance() {
    let mut world = World::room();
    for (index, surface) in world.surfaces.iter_mut().enumerate().filter(|(index, _)| index % 3 != 0) {
        surface.deactivate_side(index % 2 == 0);
        surface.deactivate_side(index % 3 == 1);
    }
    let surfaces = Buffer::from_slice(&world.context, "surfaces", &world.surfaces).unwrap();
    let (count, far) = (200, 10.0);
    let tracing = Tracing { naming: Naming::Place, ..tracing(&world, 4) };
    for group in [1, 8, 64] {
        let points = world.cache_points(&mut Random::new(43), count, 0.1);
        let candidates = Buffer::from_slice(&world.context, "candidates", &points).unwrap();
        let clearances = Buffer::from_slice(&world.context, "clearances", &vec![UNTOUCHED; count]).unwrap();
        world.dispatch(
            "clearance",
            &[("RINGS", 4), ("SECTORS", 16), ("local_size_x", group)],
            |pipeline| count as u32 * pipeline.local_size()[0],
            &ClearancePush { candidate_count: count as u32, seed: SEED, side_bits: 1, scene_size: far },
            &[
                ("Nodes", &world.buffers.nodes),
                ("Triangles", &world.buffers.triangles),
                ("Surfaces", &surfaces),
                ("Candidates", &candidates),
                ("Clearances", &clearances),
            ],
        );
        let found: Vec<Clearance> = clearances.read().unwrap();
        let reference: Vec<bool> = points.iter().map(|point| tracing.is_in_solid(point, far)).collect();
        let differ =
            found.iter().zip(&reference).filter(|(found, is)| (found.distance < 0.0) != **is).count();
        let inner = reference.iter().filter(|&&is| is).count();
        assert!(differ * 50 <= count, "{differ} of {count} points differ");
        assert!(inner > 50 && inner < count - 10, "{inner} of {count} points are in a solid");
    }
    assert_silent(&world.context);
}
