//! The volumetric hierarchy.

use crate::common::{assert_silent, context};
use crate::world::{FLOAT, Random, SUM, World, assert_near};
use glam::{DVec3, Vec3};
use lightpaths::cpu;
use lightpaths::gpu::barrier::COMPUTE_TO_COMPUTE;
use lightpaths::gpu::{Buffer, Context, SplitBuffer};
use lightpaths::passes::frame::hvds::{
    ClusterFlux, ClusterLight, ClusterLists, LightFlux, MIN_FRACTION, MIN_VERTICES, Pyramid, VERTICES_AROUND,
    contribution_ranges, indirect_sources,
};
use lightpaths::scene::{grid, hvds::Hvds, octree::Octree};
use lightpaths::types::{Contribution, NO_CLUSTER, OPEN};
use std::sync::Arc;

/// A base level of `count` clusters under one root.
fn two_levels(count: u32) -> Hvds {
    let mut parents = vec![count; count as usize];
    parents.push(NO_CLUSTER);
    let area = |cluster: u32| if cluster % 7 == 3 { 0.0 } else { 0.5 + cluster as f32 };
    let areas_m2: Vec<f32> = (0..=count).map(area).collect();
    Hvds {
        grid: grid::grid(Vec3::ZERO, Vec3::ONE, 8),
        levels: vec![0..count, count..count + 1],
        octree: Octree::default(),
        cell_levels: vec![0; count as usize],
        cell_clusters: Vec::new(),
        areas_m2,
        unweighted: vec![NO_CLUSTER; count as usize],
        parents,
        child_offsets: vec![0, count],
        children: (0..count).collect(),
        fragments: Vec::new(),
        inconsistent: Vec::new(),
    }
}

const PATHS: u32 = 499;

/// Random contributions in these lists, and one that no cluster reads. Contributions of entry
/// points are not reflected yet.
fn contributions(random: &mut Random, contribution_offsets: &[u32]) -> Vec<Contribution> {
    let mut contributions = Vec::new();
    for (list, run) in contribution_offsets.windows(2).enumerate() {
        contributions.extend((run[0]..run[1]).map(|_| {
            let colour = 0.5 * (1.0 + random.cube());
            let throughput = if list % 2 == 0 { Vec3::splat(2.0 * random.unit()) } else { colour };
            Contribution { throughput, ..Contribution::new(random.below(PATHS), random.below(OPEN + 1)) }
        }));
    }
    contributions.push(Contribution::new(0, OPEN));
    contributions
}

/// Input buffers of the hierarchy for one light.
struct OneLight {
    factors: Buffer,
    first_bounce: Option<Buffer>,
    flux: Buffer,
}

impl OneLight {
    fn due(&self) -> ClusterLight<'_> {
        ClusterLight { factors: &self.factors, first_bounce: self.first_bounce.as_ref(), flux: &self.flux }
    }
}

fn light(
    context: &Arc<Context>,
    factors: &[f32],
    first_bounce: Option<&[Vec3]>,
    base_count: u32,
) -> OneLight {
    OneLight {
        factors: Buffer::from_slice(context, "factors", factors).unwrap(),
        first_bounce: first_bounce
            .map(|first_bounce| Buffer::from_slice(context, "first bounce", first_bounce).unwrap()),
        flux: Pyramid::new_light_flux(context, base_count).unwrap(),
    }
}

#[test]
fn cluster_energies_equal_the_reference_and_parents_their_children() {
    let context = context();
    let mut random = Random::new(23);
    let room = World::room().hvds;
    assert!(room.levels.len() == 5 && room.levels[0].len() > 1_000);
    for hvds in [1, 2, 63, 64, 65, 997].map(two_levels).into_iter().chain([room]) {
        let base = hvds.levels[0].len();
        // Each cluster has two lists of very different length; every third list is empty.
        let mut contribution_offsets = vec![0];
        for list in 0..2 * base as u32 {
            let length = [0, random.below(9), random.below(70)][list as usize % 3];
            contribution_offsets.push(contribution_offsets[list as usize] + length);
        }
        let contributions = contributions(&mut random, &contribution_offsets);
        let runs = contribution_ranges(&hvds, &contribution_offsets);
        let min_area_m2 = 0.01;

        // After the entry point, paths may carry other flux.
        let factors: Vec<f32> = (0..PATHS).map(|_| 50.0 * random.unit()).collect();
        let first_bounce: Vec<Vec3> = factors.iter().map(|factor| factor * (1.0 + random.cube())).collect();
        let emission = 1.5 + random.cube();
        let pyramid =
            Pyramid::new(&context, (&hvds, &hvds.areas_m2), &contribution_offsets, min_area_m2, true)
                .unwrap();
        let all = ClusterLists::all(&context, &hvds.levels).unwrap();
        let light = light(&context, &factors, Some(&first_bounce), base as u32);
        let contribution_buffer = SplitBuffer::cut(&context, "contributions", &contributions, 97).unwrap();
        context.take_redundant_barriers();
        context
            .run(|rec| {
                pyramid.record_lights(rec, &[light.due()], &contribution_buffer, &all);
                rec.barrier(COMPUTE_TO_COMPUTE);
                pyramid.record_sum(rec, &[(emission, &light.flux)], &all);
            })
            .unwrap();
        assert_eq!(context.take_redundant_barriers(), [""; 0]);

        let scale = min_area_m2 * emission;
        let path_flux: Vec<Vec3> = factors.iter().map(|factor| factor * scale).collect();
        let reflected_flux: Vec<Vec3> =
            first_bounce.iter().map(|first_bounce| first_bounce * scale).collect();
        let reference = cpu::hvds::cluster_flux(&hvds, [&path_flux, &reflected_flux], &runs, &contributions);
        let sources =
            cpu::hvds::indirect_sources(&hvds, &runs, MIN_VERTICES, [VERTICES_AROUND, MIN_FRACTION]);
        assert_eq!(indirect_sources(&hvds, &runs, MIN_VERTICES), sources);
        let borrowing = (0..base as u32).zip(&sources).filter(|(cluster, source)| cluster != *source).count();
        assert!(base < 60 || (borrowing > base / 4 && borrowing < base), "{borrowing} of {base} borrow");
        let resolved = cpu::hvds::irradiance(&hvds, &hvds.areas_m2, &reference, &sources, min_area_m2);
        let flux: Vec<ClusterFlux> = pyramid.flux.read().unwrap();
        let irradiance: Vec<Vec3> = pyramid.irradiance.read().unwrap();
        for cluster in 0..hvds.cluster_count() as usize {
            let name = format!("cluster {cluster} over {base}");
            assert_near(flux[cluster].direct, reference[cluster][0], SUM, 0.0, &name);
            assert_near(flux[cluster].indirect, reference[cluster][1], SUM, 0.0, &name);
            assert_near(irradiance[cluster], resolved[cluster], SUM, 0.0, &name);
            if cluster >= base {
                let children = hvds.children_of(cluster as u32).iter().map(|&child| &flux[child as usize]);
                for part in [|flux: &ClusterFlux| flux.direct, |flux: &ClusterFlux| flux.indirect] {
                    let sum: DVec3 = children.clone().map(|flux| part(flux).as_dvec3()).sum();
                    assert_near(part(&flux[cluster]), sum, FLOAT, 0.0, &name);
                }
            }
        }
    }
    assert_silent(&context);
}

/// Per-light irradiance buffers and their sum equal the result from path flux. A light's
/// buffer is the same to the bit, whichever other lights are stale. Lights that are off do not
/// change the sum.
#[test]
fn cluster_light_equals_the_reference_and_adds_up() {
    let context = context();
    let mut random = Random::new(29);
    for (count, light_count) in [(1, 1), (63, 2), (64, 3), (65, 4), (997, 5), (131, 9), (40, 0)] {
        let hvds = two_levels(count);
        let mut contribution_offsets = vec![0];
        for list in 0..2 * count {
            let length = [random.below(70), 0, random.below(9)][list as usize % 3];
            contribution_offsets.push(contribution_offsets[list as usize] + length);
        }
        let contributions = contributions(&mut random, &contribution_offsets);
        let runs = contribution_ranges(&hvds, &contribution_offsets);
        let entry_area_m2 = 0.01;
        let rows: Vec<Vec<f32>> =
            (0..light_count).map(|_| (0..PATHS).map(|_| 50.0 * random.unit()).collect()).collect();
        let is_glossy = light_count % 2 == 1;
        let mut behind = |row: &Vec<f32>| -> Vec<Vec3> {
            row.iter().map(|&f| if is_glossy { f * (1.0 + random.cube()) } else { Vec3::splat(f) }).collect()
        };
        let first_bounce: Vec<Vec<Vec3>> = rows.iter().map(&mut behind).collect();
        let emissions: Vec<Vec3> = rows.iter().map(|_| 1.5 + random.cube()).collect();

        let pyramid =
            Pyramid::new(&context, (&hvds, &hvds.areas_m2), &contribution_offsets, entry_area_m2, is_glossy)
                .unwrap();
        let all = ClusterLists::all(&context, &hvds.levels).unwrap();
        assert_eq!(pyramid.base_count(), count);
        let lights = || -> Vec<OneLight> {
            let rows = rows.iter().zip(&first_bounce);
            rows.map(|(row, first_bounce)| light(&context, row, is_glossy.then_some(first_bounce), count))
                .collect()
        };
        let (lights, alone) = (lights(), lights());
        let contribution_buffer =
            SplitBuffer::cut(&context, "contributions", &contributions, u32::MAX).unwrap();
        let cut = SplitBuffer::cut(&context, "contributions", &contributions, 61).unwrap();
        let due: Vec<ClusterLight<'_>> = lights.iter().map(OneLight::due).collect();
        let lit: Vec<(Vec3, &Buffer)> =
            emissions.iter().copied().zip(lights.iter().map(|l| &l.flux)).collect();
        context.take_redundant_barriers();
        context
            .run(|rec| {
                pyramid.record_lights(rec, &due, &contribution_buffer, &all);
                rec.barrier(COMPUTE_TO_COMPUTE);
                pyramid.record_sum(rec, &lit, &all);
            })
            .unwrap();
        if light_count > 0 {
            assert_eq!(context.take_redundant_barriers(), [""; 0]);
        }
        for ((row, first_bounce), (light, alone)) in
            rows.iter().zip(&first_bounce).zip(lights.iter().zip(&alone))
        {
            let reference = cpu::hvds::light_flux(row, first_bounce, &runs, &contributions);
            let device: Vec<LightFlux> = light.flux.read().unwrap();
            for (cluster, (device, reference)) in device.iter().zip(reference).enumerate() {
                let name = format!("cluster {cluster} of {count}");
                assert_near(Vec3::splat(device.direct), reference[0], SUM, 0.0, &name);
                assert_near(device.indirect, reference[1], SUM, 0.0, &name);
            }
            let record = |rec: &mut _| pyramid.record_lights(rec, &[alone.due()], &cut, &all);
            context.run(record).unwrap();
            let bits = |light: &OneLight| light.flux.read::<u32>().unwrap();
            assert!(
                bits(light) == bits(alone),
                "alone and among others, from contributions in one part and in many"
            );
        }

        let sum = |of: &dyn Fn(usize, usize) -> Vec3| -> Vec<Vec3> {
            let sum = |path| emissions.iter().enumerate().map(|(light, e)| e * of(light, path)).sum::<Vec3>();
            (0..PATHS as usize).map(|path| entry_area_m2 * sum(path)).collect()
        };
        let path_flux = sum(&|light, path| Vec3::splat(rows[light][path]));
        let reflected_flux = sum(&|light, path| first_bounce[light][path]);
        let reference = cpu::hvds::cluster_flux(&hvds, [&path_flux, &reflected_flux], &runs, &contributions);
        let sources =
            cpu::hvds::indirect_sources(&hvds, &runs, MIN_VERTICES, [VERTICES_AROUND, MIN_FRACTION]);
        let resolved = cpu::hvds::irradiance(&hvds, &hvds.areas_m2, &reference, &sources, entry_area_m2);
        let irradiance: Vec<Vec3> = pyramid.irradiance.read().unwrap();
        let flux: Vec<ClusterFlux> = pyramid.flux.read().unwrap();
        for cluster in 0..hvds.cluster_count() as usize {
            let name = format!("cluster {cluster} over {count}, {light_count} lights");
            assert_near(flux[cluster].direct, reference[cluster][0], SUM, 0.0, &name);
            assert_near(flux[cluster].indirect, reference[cluster][1], SUM, 0.0, &name);
            assert_near(irradiance[cluster], resolved[cluster], SUM, 0.0, &name);
        }

        // Every second light is off: left out, or black.
        let sum = |lights: &[(Vec3, &Buffer)]| {
            context.run(|rec| pyramid.record_sum(rec, lights, &all)).unwrap();
            pyramid.flux.read::<u32>().unwrap()
        };
        let black = lit
            .iter()
            .enumerate()
            .map(|(light, (emission, flux))| (if light % 2 == 0 { *emission } else { Vec3::ZERO }, *flux));
        let [left_out, black] = [lit.iter().copied().step_by(2).collect::<Vec<_>>(), black.collect()];
        assert!(sum(&left_out) == sum(&black), "{light_count} lights over {count}");
    }
    assert_silent(&context);
}
