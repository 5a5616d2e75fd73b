//! Test light: random radiance, by which records are compared before any light is known. In a field
//! of test light each cluster has the sum of random signs: its own, and those of all clusters
//! around it. So test light varies at every scale of the hierarchy. The mean squared difference of
//! two gathers over many fields is that of the radiance they see: a random projection keeps
//! distances between gathers. [Achlioptas]

use crate::cpu::sampling::{hash, hash_pair};
use crate::passes::frame::near_field::NearCluster;
use crate::passes::gather_targets::{GatherTarget, GatherTargetPacking};
use crate::passes::precompute::merged_rays::MergedRayLists;
use crate::types::NO_CLUSTER;
use rayon::prelude::*;

/// Number of fields. Squares of differences scatter by a third of their mean.
pub(super) const FIELDS: usize = 16;

/// A value in each field.
pub(super) type Values = [f32; FIELDS];

/// Test light of each record of a table.
pub(super) struct TestRecords {
    /// Mean over the rays of each record; rays without a hit bring nothing.
    pub(super) values: Vec<Values>,
    /// Mean square of what single rays bring.
    pub(super) mean_square: f32,
    /// Variance that rays give a record, at most, relative to that.
    noise: f32,
}

/// A random sign in each field.
fn signs(bits: u32) -> Values {
    std::array::from_fn(|field| if bits >> field & 1 == 0 { 1.0 } else { -1.0 })
}

fn add(values: &mut Values, other: &Values, weight: f32) {
    for (value, other) in values.iter_mut().zip(other) {
        *value += weight * other;
    }
}

/// Test light of each cluster. `parents`: the cluster around each, which has a higher index.
fn of_clusters(parents: &[u32]) -> Vec<Values> {
    let mut values: Vec<Values> = (0..parents.len() as u32).map(|cluster| signs(hash(!cluster))).collect();
    for cluster in (0..parents.len()).rev().filter(|&cluster| parents[cluster] != NO_CLUSTER) {
        let parent = values[parents[cluster] as usize];
        add(&mut values[cluster], &parent, 1.0);
    }
    values
}

/// Test light of a cell of the sky's table, which has `side` cells along each side: a sign of each
/// square of 1, 2, 4 … cells around it.
fn of_sky(cell: u32, side: u32) -> Values {
    let mut values = Values::default();
    for level in 0..=side.ilog2() {
        let [x, y] = [(cell % side) >> level, (cell / side) >> level];
        add(&mut values, &signs(hash_pair(hash_pair(x, y), !level)), 1.0);
    }
    values
}

impl TestRecords {
    /// What the records of these merged rays, `rays` each, gather of test light. `bins`: the
    /// cluster of each gloss bin.
    pub(super) fn new(
        lists: &MergedRayLists,
        target_bits: u32,
        rays: u32,
        packing: &GatherTargetPacking,
        (parents, patches, bins): (&[u32], &[NearCluster], &[u32]),
    ) -> Self {
        let clusters = of_clusters(parents);
        let of_target = |&word: &u32| match packing.unpack(word) {
            Some((GatherTarget::Cluster(cluster), _)) => clusters[cluster as usize],
            Some((GatherTarget::Patch(patch), _)) => clusters[patches[patch as usize].cluster as usize],
            Some((GatherTarget::Sky(cell), _)) => of_sky(cell, packing.sky_side()),
            Some((GatherTarget::GlossBin(bin), _)) => clusters[bins[bin as usize] as usize],
            None => Values::default(),
        };
        let targets: Vec<Values> = lists.targets.par_iter().map(of_target).collect();
        let mut first = 0;
        let ends: Vec<[usize; 2]> = lists
            .counts
            .iter()
            .map(|&count| {
                let start = first;
                first += count as usize;
                [start, first]
            })
            .collect();
        let mask = 1_u32.checked_shl(target_bits).map_or(u32::MAX, |end| end - 1);
        let of_record = |&[start, end]: &[usize; 2]| {
            let (mut sum, mut squares, mut hits) = (Values::default(), 0.0, 0.0);
            for ray in &lists.merged_rays[start..end] {
                let value = &targets[(ray.target_index & mask) as usize];
                let count = (ray.target_index.checked_shr(target_bits).unwrap_or(0) + 1) as f32;
                add(&mut sum, value, count / rays as f32);
                squares += count * value.iter().map(|value| value * value).sum::<f32>();
                hits += count;
            }
            (sum, f64::from(squares), f64::from(hits))
        };
        let of_records: Vec<(Values, f64, f64)> = ends.par_iter().map(of_record).collect();
        let total = |of: fn(&(Values, f64, f64)) -> f64| of_records.iter().map(of).sum::<f64>();
        let mean_square = (total(|record| record.1) / total(|record| record.2).max(1.0)) as f32;
        Self {
            values: of_records.into_iter().map(|record| record.0).collect(),
            mean_square: mean_square / FIELDS as f32,
            noise: 1.0 / rays as f32,
        }
    }

    /// Root mean square difference between these records and their weighted mean, beyond the noise
    /// of their rays, relative to the test light of single rays. The weights' sizes sum to 1.
    pub(super) fn disagreement(&self, weighted: impl Iterator<Item = (u32, f32)> + Clone) -> f32 {
        let mut mean = Values::default();
        for (record, weight) in weighted.clone() {
            add(&mut mean, &self.values[record as usize], weight.abs());
        }
        let variance = |(record, weight): (u32, f32)| {
            let pairs = self.values[record as usize].iter().zip(&mean);
            weight.abs() * pairs.map(|(value, mean)| (value - mean).powi(2)).sum::<f32>()
        };
        let variance = weighted.map(variance).sum::<f32>() / FIELDS as f32;
        (variance / self.mean_square.max(f32::MIN_POSITIVE) - self.noise).max(0.0).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::passes::gather_targets::{Met, TargetCounts};
    use crate::types::MergedRay;

    #[test]
    fn clusters_of_one_parent_have_its_test_light_in_common() {
        // Two halves of four leaves each, and a root around both.
        let parents: Vec<u32> = (0..8).map(|leaf| 8 + leaf / 4).chain([10, 10, NO_CLUSTER]).collect();
        let values = of_clusters(&parents);
        let product = |a: usize, b: usize| -> f32 { (0..FIELDS).map(|k| values[a][k] * values[b][k]).sum() };
        let mean = |pairs: &[(usize, usize)]| -> f32 {
            pairs.iter().map(|&(a, b)| product(a, b)).sum::<f32>() / (pairs.len() * FIELDS) as f32
        };
        let pairs = |is_wanted: fn(usize, usize) -> bool| -> Vec<(usize, usize)> {
            (0..8).flat_map(|a| (0..a).map(move |b| (a, b))).filter(|&(a, b)| is_wanted(a, b)).collect()
        };
        let own: Vec<(usize, usize)> = (0..8).map(|a| (a, a)).collect();
        let [same, near, far] =
            [own, pairs(|a, b| a / 4 == b / 4), pairs(|a, b| a / 4 != b / 4)].map(|p| mean(&p));
        assert!(far + 0.3 < near && near + 0.3 < same, "{far}, {near}, {same}");
    }

    #[test]
    fn records_that_see_the_same_agree() {
        let packing = GatherTargetPacking::of_counts(
            TargetCounts { clusters: 6, sky_side: 4, ..Default::default() },
            1,
            1.0,
        )
        .unwrap();
        let word = |target| packing.pack(target, Met::near(0));
        let targets: Vec<u32> = (0..6)
            .map(|c| word(GatherTarget::Cluster(c)))
            .chain((0..16).map(|c| word(GatherTarget::Sky(c))))
            .collect();
        let target_bits = 5;
        let ray = |target: u32, count: u32| MergedRay {
            target_index: target | (count - 1) << target_bits,
            change: 0,
        };
        // Of 64 rays each: the first two see the same, the third something else, the fourth
        // nothing, the last one the sky.
        let merged_rays =
            vec![ray(0, 32), ray(1, 32), ray(0, 32), ray(1, 32), ray(2, 64), ray(6, 24), ray(21, 40)];
        let lists =
            MergedRayLists { targets, counts: vec![2, 2, 1, 0, 2], merged_rays, ..Default::default() };
        let parents = [NO_CLUSTER; 6];
        let found = TestRecords::new(&lists, target_bits, 64, &packing, (&parents, &[], &[]));
        assert_eq!(found.values[3], Values::default());
        let half = |a, b| found.disagreement([(a, 0.5_f32), (b, -0.5)].into_iter());
        assert_eq!((half(0, 1), found.disagreement([(2, 1.0)].into_iter())), (0.0, 0.0));
        for other in [2, 3, 4] {
            assert!(half(0, other) > 0.2, "{other}: {}", half(0, other));
        }
        let slight = found.disagreement([(0, 0.95_f32), (2, 0.05)].into_iter());
        assert!(slight > 0.0 && slight < half(0, 2));
    }
}
