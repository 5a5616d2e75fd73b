//! Kernels that trace rays report truncated loops: lavapipe ends all loops of an invocation after
//! 65 535 iterations.

use crate::common::assert_silent;
use crate::common::needles::box_of_needles;
use crate::gloss::lights;
use crate::world::{Random, World, glossy};
use glam::Vec3;
use lightpaths::gpu::barrier::COMPUTE_TO_COMPUTE;
use lightpaths::gpu::{Buffer, Recorder};
use lightpaths::passes::OneLight;
use lightpaths::passes::frame::antialias::{Antialias, SeenFragments};
use lightpaths::passes::frame::bin_reads::BinReads;
use lightpaths::passes::frame::direct::Direct;
use lightpaths::passes::frame::form_factors::FormFactors;
use lightpaths::passes::frame::gloss_pixels::GlossPixels;
use lightpaths::passes::frame::primary::Primary;
use lightpaths::passes::gather_targets::GatherTargetPacking;
use lightpaths::passes::precompute::Silent;
use lightpaths::passes::precompute::gather_rays::{self, Hemisphere};
use lightpaths::passes::precompute::rays::{RayQuery, Rays};
use lightpaths::passes::reference::photon_reach;
use lightpaths::types::{LOOP_TRUNCATED, PathVertex, PixelSurface, View};

const SIZE: [u32; 2] = [24, 16];
const PIXELS: u32 = SIZE[0] * SIZE[1];

/// A glossy room with `count` needles through all of it.
fn needles(count: u32) -> World {
    let mut scene = box_of_needles(count);
    let material = scene.materials[0].clone();
    scene.materials = vec![material; 2];
    World::new(&glossy(scene), 4)
}

fn points(world: &World, count: usize) -> Vec<PathVertex> {
    let mut random = Random::new(3);
    let point = |_| {
        let (position, _, side) = world.surface_point(&mut random);
        PathVertex { position, side, incoming: Vec3::ZERO, weight: 1.0, cluster: 0, lobe: 0.0 }
    };
    (0..count).map(point).collect()
}

/// Pixels that see one wall.
fn wall(world: &World) -> Vec<PixelSurface> {
    let is_behind = |corner: &Vec3| (corner.z + 0.5).abs() < 1e-4;
    let triangle = world.triangles.iter().position(|t| t.positions.iter().all(is_behind)).unwrap();
    let pixel = |index: u32| {
        let place = Vec3::new((index % SIZE[0]) as f32 / 24.0, (index / SIZE[0]) as f32 / 24.0, 0.0);
        let position = Vec3::new(-0.45, -0.45, -0.5) + 0.8 * place;
        PixelSurface { position, side: 2 * triangle as u32, normal: Vec3::Z, footprint: 1e-3 }
    };
    (0..PIXELS).map(pixel).collect()
}

/// Whether this device truncates loops at all.
fn ends_loops(world: &World) -> bool {
    let query = RayQuery { origin: Vec3::new(0.02, 0.01, -0.03), direction: Vec3::new(-0.5, 0.4, 0.3) };
    Rays::new(&world.context).unwrap().trace(&world.buffers, &[query]).is_err()
}

/// Asserts that kernels report it if the device truncated their loops.
fn assert_said(world: &mut World, is_truncated: bool, name: &str, record: impl Fn(&World, &mut Recorder)) {
    world.buffers.truncated_loops = Buffer::host_flag(&world.context, "truncated").unwrap();
    let run = world.context.run(|rec| record(world, rec));
    run.unwrap();
    assert_eq!(world.buffers.truncated_loops.read_flag() == LOOP_TRUNCATED, is_truncated, "{name}");
    assert_eq!(world.buffers.refuse_truncated_loops(name, 0).is_err(), is_truncated, "{name}");
}

/// One test for both, because the world of needles takes seconds to build.
#[test]
fn truncation_in_frames_is_reported_and_those_of_the_precomputation_and_of_photons_are_refused() {
    for count in [0, 70_000] {
        let mut world = needles(count);
        let is_truncated = ends_loops(&world);
        println!("{count} needles: loops are truncated: {is_truncated}");
        assert!(count > 0 || !is_truncated);
        kernels_of_frames_say_it_in(&mut world, is_truncated);
        kernels_of_the_precomputation_and_of_photons_are_refused_in(&mut world, is_truncated);
    }
}

fn kernels_of_frames_say_it_in(world: &mut World, is_truncated: bool) {
    let context = world.context.clone();
    let view = View {
        position: Vec3::new(0.1, 0.05, 0.4),
        pixel_area: 1e-3,
        right: Vec3::X,
        width: SIZE[0],
        up: Vec3::Y,
        height: SIZE[1],
        forward: Vec3::NEG_Z,
    };
    let primary = Primary::new(&context, PIXELS).unwrap();
    assert_said(world, is_truncated, "primary", |world, rec| primary.record(rec, &world.buffers, &view));

    let antialias = Antialias::new(&context, SIZE, 4).unwrap();
    assert_said(world, is_truncated, "edge_samples", |world, rec| {
        antialias.record(rec, &world.buffers, &view, &primary.pixels);
    });
    let direct = Direct::new(&context, SIZE, antialias.capacity.fragments).unwrap();
    let sources = &lights()[..1];
    let table = Buffer::from_slice(&context, "lights", sources).unwrap();
    let light = OneLight::new(&table, 0, &sources[0]);
    let irradiance = Buffer::storage(&context, "irradiance", 4 * u64::from(direct.point_count())).unwrap();
    assert_said(world, is_truncated, "direct", |world, rec| {
        direct.record_batches(rec, &world.buffers, &primary.pixels);
        rec.barrier(COMPUTE_TO_COMPUTE);
        direct.record(&mut rec.pass("direct"), &world.buffers, light, &primary.pixels, &irradiance);
    });
    let groups = Antialias::groups(&context).unwrap();
    assert_said(world, is_truncated, "fragment_direct, or later kernels", |world, rec| {
        let mut pass = rec.pass("shadow_edges");
        antialias.record_light(
            &mut pass,
            &world.buffers,
            &view,
            light,
            &primary.pixels,
            (&irradiance, &groups),
        );
    });
    // A wall without edges, half of it lit. The mesh has edges in other places.
    world.buffers.mesh_edge_count = 0;
    let pixels = Buffer::from_slice(&context, "pixels", &wall(world)).unwrap();
    let half: Vec<f32> =
        (0..PIXELS).map(|pixel| f32::from(u8::from(pixel % SIZE[0] < SIZE[0] / 2))).collect();
    irradiance.write(&half).unwrap();
    context.run(|rec| antialias.record(rec, &world.buffers, &view, &pixels)).unwrap();
    assert_eq!(antialias.edge_count().unwrap(), 0);
    assert_said(world, is_truncated, "shadow_edges", |world, rec| {
        let mut pass = rec.pass("shadow_edges");
        antialias.record_light(&mut pass, &world.buffers, &view, light, &pixels, (&irradiance, &groups));
    });
    assert!(Antialias::counted(&groups).unwrap() > 0);

    let entries = points(world, 500);
    let pass = FormFactors::new(&context, &world.buffers, (&entries, &[]), 0.01).unwrap();
    let factors = Buffer::storage(&context, "factors", 4 * entries.len() as u64).unwrap();
    assert_said(world, is_truncated, "form_factors", |world, rec| {
        pass.record(&mut rec.pass("form_factors"), &world.buffers, light, &factors);
    });

    let packing = GatherTargetPacking::new(world.hvds.cluster_count(), world.materials.len(), 0.05).unwrap();
    let pass =
        GlossPixels::new(&context, &world.buffers, PIXELS, 4, packing.cluster_bits, [true; 2]).unwrap();
    let bins = BinReads::none(&context).unwrap();
    let without_edges = Antialias::new(&context, SIZE, 0).unwrap();
    let seen = SeenFragments { pixels: &primary.pixels, antialias: &without_edges };
    assert_said(world, is_truncated, "gloss_rays", |world, rec| {
        pass.record_rays(rec, &world.buffers, (&world.clusters, &bins), seen, &view, 5);
    });
    let irradiance = Buffer::storage(&context, "irradiance", 4 * u64::from(pass.capacity)).unwrap();
    assert_said(world, is_truncated, "highlights", |world, rec| {
        let mut open = rec.pass(GlossPixels::HIGHLIGHTS_STEM);
        pass.record_highlights(&mut open, &world.buffers, light, (view.position, 5), &irradiance);
    });
    assert_silent(&context);
}

fn kernels_of_the_precomputation_and_of_photons_are_refused_in(world: &mut World, is_truncated: bool) {
    let context = &world.context.clone();
    let entries = points(world, 300);
    let paths = world.light_paths(entries, 5);
    assert_eq!(
        paths.err().map(|error| error.to_string().contains("`light_paths`")),
        is_truncated.then_some(true)
    );

    let cache_points = world.cache_points(&mut Random::new(4), 40, 0.1);
    let packing = GatherTargetPacking::new(world.hvds.cluster_count(), world.materials.len(), 0.05).unwrap();
    let buffer = Buffer::from_slice(context, "cache points", &cache_points).unwrap();
    let rays = gather_rays::trace(
        context,
        &world.buffers,
        &world.clusters,
        &buffer,
        40,
        Hemisphere::new(16),
        packing,
        5,
        &mut Silent,
    );
    assert_eq!(
        rays.err().map(|error| error.to_string().contains("`gather_rays`")),
        is_truncated.then_some(true)
    );

    // The flag stays set, so a new one is needed.
    world.buffers.truncated_loops = Buffer::host_flag(context, "truncated").unwrap();
    let entries: Vec<[Vec3; 3]> = cache_points.iter().map(|p| [p.position, p.normal, Vec3::ONE]).collect();
    let entries = Buffer::from_slice(context, "points", &entries).unwrap();
    let reaches = photon_reach::trace(context, &world.buffers, &entries, 40, 1.0, &mut 0.0);
    assert_eq!(
        reaches.err().map(|error| error.to_string().contains("`photon_reach`")),
        is_truncated.then_some(true)
    );
    assert_silent(context);
}
