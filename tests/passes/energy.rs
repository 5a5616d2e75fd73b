//! Form factors, path flux and the volumetric hierarchy.

use crate::common::{assert_silent, context};
use crate::world::{FLOAT, Random, SUM, World, assert_near};
use glam::{DVec3, Vec3};
use lightpaths::cpu;
use lightpaths::gpu::Buffer;
use lightpaths::gpu::barrier::COMPUTE_TO_COMPUTE;
use lightpaths::passes::frame::form_factors::FormFactors;
use lightpaths::passes::frame::hvds::{ClusterFlux, LEAST_VERTICES, Pyramid, indirect_sources};
use lightpaths::scene::{grid, hvds::Hvds};
use lightpaths::types::{Deposit, LightSource, NO_CLUSTER, PathVertex};

/// One in a thousand points sees the light past an edge that f32 moves to the other side; in practice none does.
const GRAZING: usize = 1_000;

fn entry_points(world: &World, random: &mut Random, count: usize) -> Vec<PathVertex> {
    let point = |_| {
        let (position, _, side) = world.surface_point(random);
        PathVertex { position, side, incoming: Vec3::ZERO, weight: 1.0, cluster: 0, lobe: 0.0 }
    };
    (0..count).map(point).collect()
}

#[test]
fn form_factors_and_flux_equal_their_twins() {
    let world = World::room();
    let mut random = Random::new(21);
    let all = [
        LightSource::point(Vec3::new(0.1, 0.7, -0.2), Vec3::new(1.0, 2.0, 3.0)),
        LightSource::point(Vec3::new(-0.9, -0.7, 0.45), Vec3::new(1e4, 0.0, 1e-4)),
        LightSource::point(Vec3::new(0.5, 3.0, 0.0), Vec3::ONE),
    ];
    for (count, light_count) in [(0, 1), (1, 1), (63, 2), (64, 3), (65, 3), (997, 3), (997, 1), (257, 0)] {
        let mut points = entry_points(&world, &mut random, count);
        if let [first, .., last] = &mut *points {
            // A light on the surface itself, and one just off it.
            first.position = all[0].position;
            last.position = all[0].position - 1e-4 * world.geometry().normal(last.side);
        }
        let area_m2 = 0.013;
        let lights = &all[..light_count];
        let moved: Vec<_> = (0..).zip(lights.iter().map(|light| light.position)).collect();
        let buffer = Buffer::from_slice(&world.context, "lights", lights).unwrap();
        let pass = FormFactors::new(&world.context, &points, area_m2, light_count as u32, true).unwrap();
        let reflected = Buffer::storage(&world.context, "reflected flux", 12 * count as u64).unwrap();
        world
            .context
            .run(|rec| {
                pass.record(rec, &world.buffers, &moved);
                rec.barrier(COMPUTE_TO_COMPUTE);
                pass.record_flux(rec, &buffer, light_count as u32, Some(&reflected));
            })
            .unwrap();

        let factors: Vec<f32> = pass.factors.read().unwrap();
        let mut disagree = 0;
        for (light, row) in lights.iter().zip(factors.chunks_exact(count.max(1))) {
            for (point, &device) in points.iter().zip(row) {
                let twin = cpu::form_factors::form_factor(
                    world.geometry(),
                    point.position,
                    point.side,
                    light.position,
                    area_m2,
                );
                // Relative to the factor straight below the light at that distance: the cosine cancels at grazing angles.
                let scale = 1.0 / f64::from((light.position - point.position).length_squared() + area_m2);
                disagree += usize::from((f64::from(device) - twin).abs() > FLOAT * scale);
            }
        }
        assert!(disagree * GRAZING <= count, "{disagree} of {count} points disagree");
        assert!(count < 900 || factors.iter().filter(|&&factor| factor > 0.0).count() > count / 8);

        let flux: Vec<Vec3> = pass.flux.read().unwrap();
        assert_eq!(reflected.read::<Vec3>().unwrap(), flux, "a copy, for the passes of what shines");
        let twin = cpu::path_flux::path_flux(lights, &factors, count, area_m2);
        for (device, twin) in flux.iter().zip(twin) {
            assert_near(*device, twin, FLOAT, 0.0, "path flux");
        }
    }
    assert_silent(&world.context);
}

/// Only the lights that moved get new form factors.
#[test]
fn form_factors_of_lights_at_rest_stay() {
    let world = World::room();
    let points = entry_points(&world, &mut Random::new(22), 100);
    let pass = FormFactors::new(&world.context, &points, 0.01, 3, false).unwrap();
    pass.factors.write(&[-1.0_f32; 300]).unwrap();
    world.context.run(|rec| pass.record(rec, &world.buffers, &[(1, Vec3::ZERO)])).unwrap();
    let factors: Vec<f32> = pass.factors.read().unwrap();
    assert!(factors[..100].iter().chain(&factors[200..]).all(|&factor| factor == -1.0));
    assert!(factors[100..200].iter().all(|&factor| factor >= 0.0));
    assert_silent(&world.context);
}

/// A base level of `count` clusters under one root.
fn two_levels(count: u32) -> Hvds {
    let mut first_children = vec![0; count as usize + 1];
    first_children.push(count);
    let mut parents = vec![count; count as usize];
    parents.push(NO_CLUSTER);
    Hvds {
        grid: grid::grid(Vec3::ZERO, Vec3::ONE, 8),
        levels: vec![0..count, count..count + 1],
        cell_first: Vec::new(),
        cell_clusters: Vec::new(),
        areas_m2: (0..=count)
            .map(|cluster| if cluster % 7 == 3 { 0.0 } else { 0.5 + cluster as f32 })
            .collect(),
        parents,
        first_children,
        pieces: Vec::new(),
    }
}

#[test]
fn cluster_energies_equal_the_twin_and_parents_their_children() {
    let context = context();
    let mut random = Random::new(23);
    let room = World::room().hvds;
    assert!(room.levels.len() == 5 && room.levels[0].len() > 1_000);
    for hvds in [1, 2, 63, 64, 65, 997].map(two_levels).into_iter().chain([room]) {
        let base = hvds.levels[0].len();
        let path_flux: Vec<Vec3> = (0..499).map(|_| 1e3 * (1.0 + random.cube())).collect();
        // Two lists a cluster, of very different length, every third of them empty.
        let mut first_deposits = vec![0];
        for list in 0..2 * base as u32 {
            let length = [0, random.below(9), random.below(70)][list as usize % 3];
            first_deposits.push(first_deposits[list as usize] + length);
        }
        let deposit = |_| Deposit { throughput: 0.5 * (1.0 + random.cube()), path: random.below(499) };
        let deposits: Vec<Deposit> = (0..=first_deposits[2 * base]).map(deposit).collect();
        let least_area_m2 = 0.01;

        let pyramid = Pyramid::new(&context, &hvds, &first_deposits, least_area_m2).unwrap();
        // Behind the entry point paths may carry another flux.
        let reflected_flux: Vec<Vec3> = path_flux.iter().map(|&flux| flux * random.unit()).collect();
        let reflected_flux_buffer = Buffer::from_slice(&context, "reflected flux", &reflected_flux).unwrap();
        let path_flux_buffer = Buffer::from_slice(&context, "path flux", &path_flux).unwrap();
        let deposit_buffer = Buffer::from_slice(&context, "deposits", &deposits).unwrap();
        context.take_redundant_barriers();
        context
            .run(|rec| pyramid.record(rec, &path_flux_buffer, &reflected_flux_buffer, &deposit_buffer))
            .unwrap();
        assert_eq!(context.take_redundant_barriers(), [""; 0]);

        let twin = cpu::hvds::cluster_flux(&hvds, [&path_flux, &reflected_flux], &first_deposits, &deposits);
        let sources = cpu::hvds::indirect_sources(&hvds, &first_deposits, LEAST_VERTICES);
        assert_eq!(indirect_sources(&hvds, &first_deposits, LEAST_VERTICES), sources);
        let borrowing = (0..base as u32).zip(&sources).filter(|(cluster, source)| cluster != *source).count();
        assert!(base < 60 || (borrowing > base / 4 && borrowing < base), "{borrowing} of {base} borrow");
        let resolved = cpu::hvds::irradiance(&hvds, &twin, &sources, least_area_m2);
        let flux: Vec<ClusterFlux> = pyramid.flux.read().unwrap();
        let irradiance: Vec<Vec3> = pyramid.irradiance.read().unwrap();
        for cluster in 0..hvds.cluster_count() as usize {
            let name = format!("cluster {cluster} over {base}");
            assert_near(flux[cluster].direct, twin[cluster][0], SUM, 0.0, &name);
            assert_near(flux[cluster].indirect, twin[cluster][1], SUM, 0.0, &name);
            assert_near(irradiance[cluster], resolved[cluster], SUM, 0.0, &name);
            if cluster >= base {
                let children =
                    hvds.first_children[cluster] as usize..hvds.first_children[cluster + 1] as usize;
                for part in [|flux: &ClusterFlux| flux.direct, |flux: &ClusterFlux| flux.indirect] {
                    let sum: DVec3 = flux[children.clone()].iter().map(|flux| part(flux).as_dvec3()).sum();
                    assert_near(part(&flux[cluster]), sum, FLOAT, 0.0, &name);
                }
            }
        }
    }
    assert_silent(&context);
}
