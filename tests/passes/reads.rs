//! The live set: against brute force. A frame that computes only the live set has the same bits.

use crate::common::{assert_silent, context};
use crate::world::{Random, World};
use glam::Vec3;
use lightpaths::gpu::barrier::COMPUTE_TO_COMPUTE;
use lightpaths::gpu::{Buffer, SplitBuffer};
use lightpaths::passes::frame::hvds::{
    ClusterLight, ClusterLists, MIN_VERTICES, Pyramid, contribution_ranges, indirect_sources,
};
use lightpaths::passes::frame::near_field::NearCluster;
use lightpaths::passes::gather_targets::{GatherTarget, GatherTargetPacking, TargetCounts};
use lightpaths::passes::precompute::live_clusters::LiveClusters;
use lightpaths::scene::hvds::Hvds;
use lightpaths::types::{Contribution, NO_CLUSTER, NO_TARGET, OPEN};

/// Whether a cluster is `around` or one of its descendants.
fn is_within(hvds: &Hvds, mut cluster: u32, around: u32) -> bool {
    while cluster < around {
        cluster = hvds.parents[cluster as usize];
    }
    cluster == around && cluster != NO_CLUSTER
}

#[test]
fn only_what_is_read_is_worked_out_and_it_has_the_same_bits() {
    let context = context();
    let mut random = Random::new(29);
    let hvds = World::room().hvds;
    let (clusters, base) = (hvds.cluster_count(), hvds.levels[0].len());
    let mut contribution_offsets = vec![0];
    for list in 0..2 * base {
        contribution_offsets.push(contribution_offsets[list] + random.below(40) * u32::from(list % 3 > 0));
    }
    let contribution = |_| Contribution {
        throughput: 0.5 * (1.0 + random.cube()),
        ..Contribution::new(random.below(99), OPEN)
    };
    let contributions: Vec<Contribution> = (0..=contribution_offsets[2 * base]).map(contribution).collect();
    let factors: Vec<f32> = (0..99).map(|_| 1.0 + random.unit()).collect();
    let contributions = SplitBuffer::cut(&context, "contributions", &contributions, u32::MAX).unwrap();
    let factors = Buffer::from_slice(&context, "factors", &factors).unwrap();
    let sources = indirect_sources(&hvds, &contribution_ranges(&hvds, &contribution_offsets), MIN_VERTICES);
    for (ray_count, patch_count) in [(0, 0), (1, 0), (40, 5), (40, 0), (400, 20)] {
        let near_patches: Vec<NearCluster> = (0..patch_count)
            .map(|part| {
                let cluster = random.below(clusters);
                NearCluster { cluster, record: 0, offset: Vec3::ZERO, target: clusters + part }
            })
            .collect();
        let counts = TargetCounts { clusters, patches: patch_count, ..TargetCounts::default() };
        let packing = GatherTargetPacking::of_counts(counts, 3, 1.0).unwrap();
        let words: Vec<u32> = (0..2 * ray_count)
            .map(|_| {
                // Mostly fine clusters; some rays leave the scene.
                let end = 1 + random.below(clusters + patch_count);
                let cluster = random.below(end);
                let cluster =
                    if random.below(4) == 0 { clusters + patch_count - 1 - cluster } else { cluster };
                let target = cluster | random.below(6) << packing.cluster_bits;
                if random.below(5) == 0 { NO_TARGET } else { target }
            })
            .collect();
        let targets = words.iter().copied();
        let reads = LiveClusters::from_targets(&hvds, targets, &packing, &near_patches, &sources);

        let mut read: Vec<u32> = near_patches.iter().map(|part| part.cluster).collect();
        for (target, _) in words.iter().filter_map(|&word| packing.unpack(word)) {
            if let GatherTarget::Cluster(cluster) = target {
                read.push(cluster);
            }
        }
        for cluster in 0..clusters {
            let index = cluster as usize;
            assert_eq!(reads.irradiance[index], read.contains(&cluster), "cluster {cluster}");
            let takes =
                |&of: &u32| is_within(&hvds, cluster, of) || is_within(&hvds, cluster, sources[of as usize]);
            assert_eq!(reads.flux[index], read.iter().any(takes), "flux of cluster {cluster}");
        }

        let pyramid =
            Pyramid::new(&context, (&hvds, &hvds.areas_m2), &contribution_offsets, 0.01, false).unwrap();
        let lists = ClusterLists::new(&context, &hvds.levels, &reads.flux, &reads.irradiance).unwrap();
        let worked_out = |lists| {
            let flux = Pyramid::new_light_flux(&context, hvds.levels[0].len() as u32).unwrap();
            let light = ClusterLight { factors: &factors, first_bounce: None, flux: &flux };
            context
                .run(|rec| {
                    pyramid.record_lights(rec, &[light], &contributions, lists);
                    rec.barrier(COMPUTE_TO_COMPUTE);
                    pyramid.record_sum(rec, &[(Vec3::ONE, &flux)], lists);
                })
                .unwrap();
            pyramid.irradiance.read::<Vec3>().unwrap()
        };
        let (some, all) =
            (worked_out(&lists), worked_out(&ClusterLists::all(&context, &hvds.levels).unwrap()));
        for (cluster, (some, all)) in some.iter().zip(&all).enumerate() {
            let expected = if reads.irradiance[cluster] { *all } else { Vec3::ZERO };
            assert_eq!(*some, expected, "irradiance of cluster {cluster}");
        }
        let count = reads.irradiance.iter().filter(|is_read| **is_read).count();
        assert!(ray_count < 40 || (count > 20 && count < clusters as usize), "{count} clusters are read");
    }
    context.take_redundant_barriers();
    assert_silent(&context);
}
