//! Merged rays: their contents and their order.

use crate::common::context;
use crate::gather::{random_rays, targets};
use crate::world::Random;
use glam::DVec2;
use lightpaths::cpu::gather::{unpack, unpack_change};
use lightpaths::cpu::hemisphere::Strata;
use lightpaths::gpu::Buffer;
use lightpaths::passes::gather_targets::{GatherTargetPacking, GatherTargets};
use lightpaths::passes::precompute::gather_rays::{Hemisphere, RayTable};
use lightpaths::passes::precompute::merged_rays::{Merged, MergedRayPacking, MergedRays};
use lightpaths::types::{MergedRay, NO_TARGET};
use std::collections::BTreeMap;

/// Number of rays, both gradients, and the gradients if all terms had the same sign.
type Sums = (u32, [DVec2; 2], [DVec2; 2]);

/// Merged rays hold each ray with a hit once, and the sums of the rays' weights, up to rounding.
#[test]
fn merged_rays_add_up_the_rays_that_meet_one_target() {
    let mut random = Random::new(37);
    for (rings, clusters, colour_count, min_targets) in
        [(8, 7, 0, 21), (8, 7, 3, 21), (3, 1, 0, 3), (1, 100_000, 0, 9_000)]
    {
        let strata = Strata { rings, sectors: 4 * rings };
        let packing = GatherTargetPacking::new(clusters, 3, 1.0).unwrap();
        let rows = if rings == 1 { 4_000 } else { 40 };
        let rays = random_rays(&mut random, packing, clusters, rows * strata.rays());
        let tinted = rays.iter().filter(|_| colour_count > 0);
        let colours: Vec<u32> = tinted.map(|_| random.below(colour_count.max(1))).collect();
        let packing = MergedRayPacking::new(targets(&rays), Hemisphere { rings, sectors: 4 * rings });
        assert!(packing.targets.is_sorted_by(|a, b| a < b));
        assert!(packing.targets.len() >= min_targets, "{} targets", packing.targets.len());
        let per_row = strata.rays() as usize;
        for (row, rays) in rays.chunks_exact(per_row).enumerate() {
            let colours = colours.get(row * per_row..(row + 1) * per_row).unwrap_or(&[]);
            let mut sums: BTreeMap<(u32, u32), Sums> = BTreeMap::new();
            for (index, ray) in (0_u32..).zip(rays).filter(|(_, ray)| ray.target != NO_TARGET) {
                let [ring, sector] = strata.of(index);
                let azimuth = strata.azimuth_middle(sector);
                let turn = strata.polar_middle(ring).tan() * DVec2::new(-azimuth.sin(), azimuth.cos());
                let colour = colours.get(index as usize).copied().unwrap_or(0);
                let sum = sums.entry((ray.target, colour)).or_default();
                sum.0 += 1;
                for (k, fraction) in [unpack(ray.gradient), turn].into_iter().enumerate() {
                    sum.1[k] += fraction;
                    sum.2[k] += fraction.abs();
                }
            }
            let merged_rays = packing.merged_rays(rays, colours, None);
            assert_eq!(merged_rays.len(), sums.len());
            for (Merged { ray: merged_ray, colour, .. }, (alike, (count, sum, size))) in
                merged_rays.iter().zip(&sums)
            {
                let target_index = merged_ray.target_index & ((1 << packing.target_bits) - 1);
                assert_eq!((packing.targets[target_index as usize], *colour), *alike);
                assert_eq!((merged_ray.target_index >> packing.target_bits) + 1, *count);
                let [movement, turn] = unpack_change(merged_ray.change);
                let unit = f64::from(packing.rotation_unit());
                let fractions = [(movement, 63.5, 2f64.powi(-26)), (unit * turn, 3.5, unit)];
                for (k, (packed, half_full, unit)) in fractions.iter().enumerate() {
                    // Half a step: the larger number takes more than half of the steps, or a step
                    // is the unit. Plus the f32 error of the terms.
                    let step = (sum[k].abs().max_element() / half_full).max(*unit);
                    let bound = DVec2::splat(0.5 * step) + size[k] * 1e-6;
                    let apart = (*packed - sum[k]).abs();
                    assert!(apart.cmple(bound).all(), "{k}: {apart} of {}", sum[k]);
                }
            }
        }
    }
}

/// However bindings split the table, each point has its own merged rays.
#[test]
fn merged_rays_stand_point_by_point_in_chunks() {
    let (context, mut random) = (context(), Random::new(41));
    let hemisphere = Hemisphere { rings: 2, sectors: 8 };
    let packing = GatherTargetPacking::new(501, 3, 1.0).unwrap();
    for (points, rows) in [(0, 1), (1, 1), (7, 7), (7, 3), (64, 63)] {
        let rays = random_rays(&mut random, packing, 501, points * hemisphere.rays());
        let parts = rays.chunks((rows * hemisphere.rays()) as usize);
        let buffers: Vec<Buffer> =
            parts.map(|part| Buffer::from_slice(&context, "gather rays", part).unwrap()).collect();
        let colours =
            buffers.iter().map(|_| Buffer::from_slice(&context, "ray colours", &[0_u32]).unwrap()).collect();
        let table = RayTable { rows_per_buffer: rows, buffers, colours, has_colours: false };
        let targets_of_hits = GatherTargets::of_hits(packing);
        let found = MergedRays::new(&context, table, (&targets_of_hits, &packing), hemisphere, None).unwrap();
        let packing = MergedRayPacking::new(targets(&rays), hemisphere);
        let listed: Vec<u32> = found.targets.read_range(0, packing.targets.len()).unwrap();
        assert_eq!(listed, packing.targets);
        assert_eq!(found.ray_count, targets(&rays).len() as u64);
        let mut point = 0;
        for chunk in &found.chunks {
            assert_eq!(chunk.points.start, point);
            let first: Vec<u32> = chunk.merged_ray_offsets.read().unwrap();
            assert_eq!(first.len(), chunk.points.len() + 1);
            let merged_rays: Vec<MergedRay> =
                chunk.merged_rays.read_range(0, first[first.len() - 1] as usize).unwrap();
            for run in first.windows(2) {
                let row = (point * hemisphere.rays()) as usize;
                let expected = packing.merged_rays(&rays[row..row + hemisphere.rays() as usize], &[], None);
                let own = &merged_rays[run[0] as usize..run[1] as usize];
                assert!(own.iter().eq(expected.iter().map(|merged| &merged.ray)), "point {point}");
                point += 1;
            }
        }
        assert_eq!(point, points);
    }
}
