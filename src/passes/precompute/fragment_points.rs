//! Points on fragments of the surface.

use crate::cpu::sampling::hash;
use crate::scene::fragment::Fragment;
use glam::Vec3;

/// Maximum number of fragments of a cluster whose clearance is measured.
const MAX_SURVEYED: usize = 16;

/// Uniform point in a convex polygon.
pub(super) fn point_in_polygon(corners: &[Vec3], u: [f32; 2]) -> Vec3 {
    let area = |i: usize| (corners[i] - corners[0]).cross(corners[i + 1] - corners[0]).length();
    let total: f32 = (1..corners.len() - 1).map(area).sum();
    let mut rest = u[0] * total;
    let mut fan = 1;
    while fan + 2 < corners.len() && rest > area(fan) {
        rest -= area(fan);
        fan += 1;
    }
    let along = (rest / area(fan).max(f32::MIN_POSITIVE)).clamp(0.0, 1.0).sqrt();
    let side = corners[fan].lerp(corners[fan + 1], u[1]);
    corners[0].lerp(side, along)
}

/// Point of the two-dimensional additive recurrence on the plastic number, shifted by a seed.
pub(super) fn plane_sequence(index: u32, seed: u32) -> [f32; 2] {
    // 1/g and 1/g², g³ = g + 1.
    const STEPS: [f64; 2] = [0.754_877_666_246_692_7, 0.569_840_290_998_053_2];
    let shift = [f64::from(seed), f64::from(hash(seed))].map(|bits| bits / 4_294_967_296.0);
    [0, 1].map(|axis| (shift[axis] + f64::from(index) * STEPS[axis]).fract() as f32)
}

/// Fragments to measure: at most [`MAX_SURVEYED`] of a cluster.
pub(super) fn probed_fragments(fragments: &[Fragment], base_clusters: usize) -> Vec<usize> {
    let (mut counts, mut passed) = (vec![0; base_clusters], vec![0; base_clusters]);
    fragments.iter().for_each(|fragment| counts[fragment.cluster as usize] += 1);
    let is_taken = |&fragment: &usize| {
        let cluster = fragments[fragment].cluster as usize;
        passed[cluster] += 1;
        passed[cluster] * MAX_SURVEYED % counts[cluster].max(MAX_SURVEYED) < MAX_SURVEYED
    };
    (0..fragments.len()).filter(is_taken).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cluster_is_probed_and_none_too_often() {
        let fragment =
            |cluster: u32| Fragment { side: 0, cluster, area_m2: 1.0, open: 1.0, corners: Vec::new() };
        // Clusters of 1, 2, … 100 fragments, mixed.
        let mut fragments: Vec<Fragment> = (0..100).flat_map(|c| (0..=c).map(move |_| fragment(c))).collect();
        fragments.sort_by_key(|fragment| fragment.cluster % 7);
        let mut taken = vec![0; 100];
        probed_fragments(&fragments, 100).into_iter().for_each(|i| taken[fragments[i].cluster as usize] += 1);
        assert_eq!(taken, (1..=100).map(|count| count.min(MAX_SURVEYED)).collect::<Vec<_>>());
    }
}
