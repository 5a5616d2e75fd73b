//! Names of fragments of the surface, and points on them.

use crate::cpu::sampling::{hash, hash_pair};
use crate::scene::fragment::Fragment;
use glam::Vec3;

/// Maximum number of fragments of a cluster whose clearance is measured.
const MAX_SURVEYED: usize = 16;

/// Name of a polygon on one side of a triangle, by its corners. Random decisions on it depend on
/// the name and not on its number, so that they stay as they are while other surface moves.
pub(super) fn name_of(corners: &[Vec3], is_back: bool) -> u32 {
    let bits = corners.iter().flat_map(|corner| corner.to_array()).map(f32::to_bits);
    bits.fold(u32::from(is_back), hash_pair)
}

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

/// Fragments to measure, in order: at most [`MAX_SURVEYED`] of a cluster, evenly over their names.
pub(super) fn probed_fragments(fragments: &[Fragment], names: &[u32]) -> Vec<usize> {
    let mut by_cluster: Vec<usize> = (0..fragments.len()).collect();
    by_cluster.sort_unstable_by_key(|&fragment| (fragments[fragment].cluster, names[fragment], fragment));
    let evenly = |all: &[usize]| -> Vec<usize> {
        let count = all.len().max(MAX_SURVEYED);
        let is_taken = |number: &usize| number * MAX_SURVEYED % count < MAX_SURVEYED;
        (1..=all.len()).filter(is_taken).map(|number| all[number - 1]).collect()
    };
    let clusters = by_cluster.chunk_by(|&a, &b| fragments[a].cluster == fragments[b].cluster);
    let mut probed: Vec<usize> = clusters.flat_map(evenly).collect();
    probed.sort_unstable();
    probed
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
        let names: Vec<u32> = (0..fragments.len() as u32).map(hash).collect();
        let mut taken = vec![0; 100];
        probed_fragments(&fragments, &names)
            .into_iter()
            .for_each(|i| taken[fragments[i].cluster as usize] += 1);
        assert_eq!(taken, (1..=100).map(|count| count.min(MAX_SURVEYED)).collect::<Vec<_>>());
    }

    #[test]
    fn the_probed_fragments_do_not_depend_on_the_order() {
        let fragment =
            |cluster: u32| Fragment { side: 0, cluster, area_m2: 1.0, open: 1.0, corners: Vec::new() };
        let mut named: Vec<(u32, Fragment)> = (0..200).map(|i| (hash(i), fragment(i % 3))).collect();
        let probed = |named: &[(u32, Fragment)]| {
            let (names, fragments): (Vec<u32>, Vec<Fragment>) = named.iter().cloned().unzip();
            let mut found: Vec<u32> =
                probed_fragments(&fragments, &names).into_iter().map(|fragment| names[fragment]).collect();
            found.sort_unstable();
            found
        };
        let before = probed(&named);
        named.sort_by_key(|(name, _)| *name);
        assert_eq!(probed(&named), before);
    }

    #[test]
    fn names_tell_corners_their_order_and_sides_apart() {
        let [a, b, c] = [Vec3::ZERO, Vec3::X, Vec3::Y];
        let nudged = Vec3::new(f32::from_bits(1.0f32.to_bits() + 1), 0.0, 0.0);
        let names = [(&[a, b, c], false), (&[a, b, c], true), (&[a, c, b], false), (&[a, nudged, c], false)]
            .map(|(corners, is_back)| name_of(corners, is_back));
        for (index, name) in names.iter().enumerate() {
            assert!(!names[..index].contains(name), "{names:?}");
        }
    }
}
