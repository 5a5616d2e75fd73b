//! A distant reader sees the open regions of a cluster more often than its crevices, which receive
//! less light. So some clusters are weighted by ambient accessibility for distant readers. Their
//! *unweighted* clusters hold the same surface without weights, for readers nearby. Unweighted
//! clusters have their own hierarchy; on each level they follow the other clusters.

use crate::scene::hvds::Hvds;
use crate::types::NO_CLUSTER;

/// Largest distance of a nearby reader, in base cells (`glsl/include/target.glsl`).
pub const NEARBY: f32 = 2.0;

impl Hvds {
    /// The clusters with unweighted ones of the marked base clusters. Fragments stay with
    /// the weighted clusters.
    #[must_use]
    pub fn with_unweighted(mut self, has_unweighted: &[bool]) -> Self {
        // A cluster has an unweighted one if one of its children does.
        let mut has = has_unweighted.to_vec();
        has.resize(self.parents.len(), false);
        for cluster in 0..has.len() {
            if has[cluster] && self.parents[cluster] != NO_CLUSTER {
                has[self.parents[cluster] as usize] = true;
            }
        }
        // New numbers of the clusters, and of their unweighted ones, which follow on each level.
        let (mut own, mut unweighted) = (vec![0; has.len()], vec![NO_CLUSTER; has.len()]);
        let mut end = 0;
        for level in &mut self.levels {
            let first = end;
            for cluster in level.clone() {
                own[cluster as usize] = end;
                end += 1;
            }
            for cluster in level.clone().filter(|&cluster| has[cluster as usize]) {
                unweighted[cluster as usize] = end;
                end += 1;
            }
            *level = first..end;
        }
        let (mut parents, mut areas_m2) = (vec![NO_CLUSTER; end as usize], vec![0.0; end as usize]);
        for (cluster, &parent) in self.parents.iter().enumerate() {
            areas_m2[own[cluster] as usize] = self.areas_m2[cluster];
            if parent != NO_CLUSTER {
                parents[own[cluster] as usize] = own[parent as usize];
                if has[cluster] {
                    parents[unweighted[cluster] as usize] = unweighted[parent as usize];
                }
            }
        }
        unweighted.truncate(has_unweighted.len());
        (self.parents, self.areas_m2, self.unweighted) = (parents, areas_m2, unweighted);
        self.link_children();
        let exact = self.areas_m2[..self.levels[0].len()].iter().map(|&area| f64::from(area));
        self.areas_m2 = self.sum_levels(self.copied_to_unweighted(exact.collect()));
        self
    }

    /// Area of each cluster that distant readers see, m². It differs from the cluster's area if
    /// there is an unweighted cluster. `samples` of each cluster: the visible weight and the total
    /// weight of its sample points. Without samples, the whole area counts.
    pub fn shown_m2(&self, samples: &[[f64; 2]]) -> Vec<f32> {
        let areas = self.areas_m2[..self.levels[0].len()].iter().map(|&area| f64::from(area));
        let mut shown: Vec<f64> = areas.collect();
        for (cluster, &[open, all]) in samples.iter().enumerate() {
            if self.unweighted[cluster] != NO_CLUSTER && all > 0.0 {
                shown[cluster] *= open / all;
            }
        }
        self.sum_levels(shown)
    }

    /// Copies values of base clusters to their unweighted clusters.
    pub(super) fn copied_to_unweighted(&self, mut of_base: Vec<f64>) -> Vec<f64> {
        for (cluster, &unweighted) in
            self.unweighted.iter().enumerate().filter(|(_, unweighted)| **unweighted != NO_CLUSTER)
        {
            of_base[unweighted as usize] = of_base[cluster];
        }
        of_base
    }

    /// Sums values of base clusters over every cluster of every level.
    pub(super) fn sum_levels(&self, mut sums: Vec<f64>) -> Vec<f32> {
        sums.resize(self.parents.len(), 0.0);
        for (cluster, &parent) in self.parents.iter().enumerate() {
            if parent != NO_CLUSTER {
                sums[parent as usize] += sums[cluster];
            }
        }
        sums.into_iter().map(|sum| sum as f32).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Triangle, grid, surfaces};
    use glam::Vec3;

    #[test]
    fn wholes_nest_and_hold_what_their_clusters_hold() {
        let corner = |a: f32| Vec3::new(a.sin(), (1.7 * a).cos(), (2.3 * a).sin());
        let triangle = |index: u32| {
            let positions = [0.0, 0.9, 2.1].map(|shift| corner(index as f32 + shift));
            Triangle { positions, normals: [Vec3::Y; 3], material: 0, object: 0 }
        };
        let triangles: Vec<Triangle> = (0..7).map(triangle).collect();
        let surfaces: Vec<_> = triangles.iter().map(|t| surfaces::surface(t, [true; 2])).collect();
        let (low, high) = (Vec3::splat(-1.0), Vec3::splat(1.0));
        let plain = Hvds::build(&triangles, &surfaces, grid::grid(low, high, 8));
        let base = plain.levels[0].len();
        let has_unweighted: Vec<bool> = (0..base).map(|cluster| cluster % 5 != 1).collect();
        let hvds = plain.clone().with_unweighted(&has_unweighted);

        let area = |hvds: &Hvds, cluster: u32| f64::from(hvds.areas_m2[cluster as usize]);
        for (level, before) in hvds.levels.iter().zip(&plain.levels) {
            let own = level.start..level.start + before.len() as u32;
            for (now, before) in own.clone().zip(before.clone()) {
                assert!((area(&hvds, now) - area(&plain, before)).abs() < 1e-6);
            }
            let unweighted: f64 = (own.end..level.end).map(|cluster| area(&hvds, cluster)).sum();
            let divided = (0..base as u32).filter(|cluster| has_unweighted[*cluster as usize]);
            let held: f64 = divided.map(|cluster| area(&plain, cluster)).sum();
            assert!(unweighted > 0.0 && (unweighted - held).abs() < 1e-4 * held, "{unweighted} of {held}");
        }
        for cluster in base..hvds.cluster_count() as usize {
            let children = hvds.children_of(cluster as u32);
            if cluster >= hvds.levels[0].end as usize {
                assert!(!children.is_empty());
                children.iter().for_each(|&child| assert_eq!(hvds.parents[child as usize], cluster as u32));
            }
        }

        // Half of the clusters are half visible; the others have no samples.
        let samples: Vec<[f64; 2]> =
            (0..base).map(|c| if c % 2 == 0 { [1.5, 3.0] } else { [0.0; 2] }).collect();
        let shown_m2 = hvds.shown_m2(&samples);
        for (cluster, &has_unweighted) in has_unweighted.iter().enumerate() {
            let fraction = if cluster % 2 == 0 && has_unweighted { 0.5 } else { 1.0 };
            assert!((shown_m2[cluster] - fraction * plain.areas_m2[cluster]).abs() < 1e-6);
            if has_unweighted {
                assert_eq!(shown_m2[hvds.unweighted[cluster] as usize], plain.areas_m2[cluster]);
            }
        }
        let root = hvds.levels.last().unwrap().clone();
        let sum = |level: std::ops::Range<u32>| level.map(|c| f64::from(shown_m2[c as usize])).sum::<f64>();
        assert!((sum(root) - sum(hvds.levels[0].clone())).abs() < 1e-4);
    }
}
