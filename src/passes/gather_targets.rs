//! Gather targets: what gather rays read where they meet the scene, and its packing. The kernel
//! `gather_rays` packs the cluster that a ray meets. Later steps list the rays that read something
//! else, and rays are packed for frames when all targets are numbered.

use crate::error::{Error, Result};
use crate::types::{GatherRay, NO_TARGET};
use std::borrow::Cow;

/// The light that a gather ray reads. With the material at its hit it is one gather target.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum GatherTarget {
    /// A cluster, by its index in the hierarchy.
    Cluster(u32),
    /// A near-field patch.
    Patch(u32),
    /// One outgoing direction of a glossy cluster.
    GlossBin(u32),
    /// A cell of the sky's octahedral table; the ray leaves the scene.
    Sky(u32),
}

/// What a gather ray met.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Met {
    /// Index of the material; 0 in the sky.
    pub material: u32,
    /// The hit is so far away that bright clusters are sampled apart.
    pub is_far: bool,
}

impl Met {
    /// A material that is not far away.
    pub fn near(material: u32) -> Self {
        Self { material, is_far: false }
    }

    fn bits(self) -> u32 {
        2 * self.material + u32::from(self.is_far)
    }
}

/// A kind of target: makes the target of an index.
pub type TargetKind = fn(u32) -> GatherTarget;

/// Number of targets of each kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct TargetCounts {
    /// Clusters of all levels.
    pub clusters: u32,
    /// Near-field patches of cache points.
    pub patches: u32,
    /// Gloss bins, those of sums included.
    pub gloss_bins: u32,
    /// Side of the sky's octahedral table; 0: rays out of the scene read nothing.
    pub sky_side: u32,
}

/// Packing of a gather ray's target and of what it met in one word, and the unit of its gradient.
/// Clusters, patches, gloss bins and cells of the sky are numbered in this order, so that the first
/// two share one list of irradiances.
#[derive(Clone, Copy, Debug)]
pub struct GatherTargetPacking {
    counts: TargetCounts,
    materials: usize,
    /// Bits of the target's number; the distance takes one and the material index the rest.
    pub cluster_bits: u32,
    /// Unit of the gradient, metres.
    pub min_distance: f32,
}

impl TargetCounts {
    fn total(&self) -> u64 {
        let Self { clusters, patches, gloss_bins, sky_side } = *self;
        [clusters, patches, gloss_bins, sky_side * sky_side].into_iter().map(u64::from).sum()
    }
}

impl GatherTargetPacking {
    /// The packing of clusters alone.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] if clusters and materials do not fit one word.
    pub fn new(clusters: u32, materials: usize, min_distance: f32) -> Result<Self> {
        let counts = TargetCounts { clusters, ..TargetCounts::default() };
        Self::of_counts(counts, materials, min_distance)
    }

    /// The packing of these targets. Rays are traced to clusters and the sky alone.
    ///
    /// # Errors
    /// [`Error::OutOfMemory`] if targets and materials do not fit one word.
    pub fn of_counts(counts: TargetCounts, materials: usize, min_distance: f32) -> Result<Self> {
        let total = counts.total();
        let cluster_bits = (total + 1).next_power_of_two().ilog2().max(1);
        // One packing is `NO_TARGET`: the topmost material index stays unused.
        if cluster_bits > 30 || materials as u64 >= 1 << (31 - cluster_bits) {
            return Err(Error::OutOfMemory(format!(
                "{total} clusters and {materials} materials do not fit the 32 bits of a gather ray; lower quality.cells"
            )));
        }
        Ok(Self { counts, materials, cluster_bits, min_distance })
    }

    /// Side of the sky's octahedral table; 0: rays out of the scene read nothing.
    pub fn sky_side(&self) -> u32 {
        self.counts.sky_side
    }

    /// Number of targets with each material, near and far away.
    pub fn max_targets(&self) -> u64 {
        2 * self.counts.total() * self.materials as u64
    }

    /// Maximum number of clusters that [`Self::new`] accepts with `materials` materials.
    pub fn max_clusters(materials: usize) -> u64 {
        let material_bits = (materials as u64 + 1).next_power_of_two().ilog2();
        (1 << (31 - material_bits)) - 1
    }

    /// Number of a target: for clusters and patches, its place in the list of irradiances.
    pub fn number(&self, target: GatherTarget) -> u32 {
        let TargetCounts { clusters, patches, gloss_bins, .. } = self.counts;
        match target {
            GatherTarget::Cluster(cluster) => cluster,
            GatherTarget::Patch(patch) => clusters + patch,
            GatherTarget::GlossBin(bin) => clusters + patches + bin,
            GatherTarget::Sky(cell) => clusters + patches + gloss_bins + cell,
        }
    }

    /// Packs a target and what the ray met.
    pub fn pack(&self, target: GatherTarget, met: Met) -> u32 {
        self.number(target) | met.bits() << self.cluster_bits
    }

    /// Target of a word, and what the ray met. `None` for [`NO_TARGET`] and for a number beyond all
    /// targets that there are.
    pub fn unpack(&self, word: u32) -> Option<(GatherTarget, Met)> {
        if word == NO_TARGET {
            return None;
        }
        let TargetCounts { clusters, patches, gloss_bins, sky_side } = self.counts;
        let mut number = word & ((1 << self.cluster_bits) - 1);
        let kinds: [(u32, TargetKind); 4] = [
            (clusters, GatherTarget::Cluster),
            (patches, GatherTarget::Patch),
            (gloss_bins, GatherTarget::GlossBin),
            (sky_side * sky_side, GatherTarget::Sky),
        ];
        for (count, kind) in kinds {
            if number < count {
                let bits = word >> self.cluster_bits;
                return Some((kind(number), Met { material: bits / 2, is_far: bits % 2 == 1 }));
            }
            number -= count;
        }
        None
    }
}

/// A ray of a table that reads something else than the cluster that it meets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Reader {
    /// Index of the ray in its table.
    pub ray: u32,
    /// What it reads, by its index among the targets of its kind.
    pub index: u32,
}

/// The gather target of each ray of a table.
pub struct GatherTargets {
    hits: GatherTargetPacking,
    /// Readers of each kind of target, by ray. Kinds have no rays in common.
    readers: Vec<(TargetKind, Vec<Reader>)>,
}

impl GatherTargets {
    /// All rays read the clusters that they meet, as the kernel has packed them.
    pub fn of_hits(hits: GatherTargetPacking) -> Self {
        Self { hits, readers: Vec::new() }
    }

    /// The targets with these readers of a kind, which are in the order of their rays.
    #[must_use]
    pub fn with(mut self, kind: TargetKind, readers: Vec<Reader>) -> Self {
        debug_assert!(readers.is_sorted_by(|a, b| a.ray < b.ray));
        self.readers.push((kind, readers));
        self
    }

    /// Target of consecutive rays of the table, from ray `first` on, and what they met. `None` for
    /// a ray without a hit.
    pub fn of_rays(&self, first: usize, rays: &[GatherRay]) -> Vec<Option<(GatherTarget, Met)>> {
        let mut targets: Vec<_> = rays.iter().map(|ray| self.hits.unpack(ray.target)).collect();
        for (kind, readers) in &self.readers {
            let start = readers.partition_point(|reader| (reader.ray as usize) < first);
            for reader in &readers[start..] {
                let Some(target) = targets.get_mut(reader.ray as usize - first) else { break };
                *target = target.map(|(_, met)| (kind(reader.index), met));
            }
        }
        targets
    }

    /// Whether rays as traced are packed like that: they read clusters alone, by the same bits.
    fn are_packed(&self, packing: &GatherTargetPacking) -> bool {
        self.readers.is_empty() && self.hits.cluster_bits == packing.cluster_bits
    }

    /// Those rays, each with its target packed for frames.
    pub fn packed<'a>(
        &self,
        packing: &GatherTargetPacking,
        first: usize,
        rays: &'a [GatherRay],
    ) -> Cow<'a, [GatherRay]> {
        if self.are_packed(packing) {
            return rays.into();
        }
        let pack = |(ray, target): (&GatherRay, Option<(GatherTarget, Met)>)| GatherRay {
            target: target.map_or(NO_TARGET, |(target, met)| packing.pack(target, met)),
            ..*ray
        };
        rays.iter().zip(self.of_rays(first, rays)).map(pack).collect::<Vec<_>>().into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clusters_and_materials_fill_the_word_of_a_gather_ray() {
        for materials in [1, 2, 3, 4, 100, 1023, 1024] {
            let most = GatherTargetPacking::max_clusters(materials) as u32;
            let packing = GatherTargetPacking::new(most, materials, 1.0).unwrap();
            // The packed last cluster and last material differ from `NO_TARGET`.
            let met = Met { material: materials as u32 - 1, is_far: true };
            let last = packing.pack(GatherTarget::Cluster(most - 1), met);
            assert_ne!(last, NO_TARGET, "{materials} materials");
            assert!(GatherTargetPacking::new(most + 1, materials, 1.0).is_err(), "{materials} materials");
        }
        let counts = TargetCounts { clusters: u32::MAX, patches: u32::MAX, ..TargetCounts::default() };
        assert!(GatherTargetPacking::of_counts(counts, 1, 1.0).is_err());
    }

    #[test]
    fn every_target_is_packed_and_unpacked() {
        let kinds = [GatherTarget::Cluster, GatherTarget::Patch, GatherTarget::GlossBin, GatherTarget::Sky];
        for numbers in [[5, 0, 0, 0], [5, 3, 2, 0], [7, 0, 4, 9], [1, 1, 1, 1]] {
            let [clusters, patches, gloss_bins, sky] = numbers;
            let counts = TargetCounts { clusters, patches, gloss_bins, sky_side: u32::isqrt(sky) };
            let packing = GatherTargetPacking::of_counts(counts, 3, 1.0).unwrap();
            let targets = kinds.iter().zip(numbers).flat_map(|(kind, count)| (0..count).map(kind));
            let mut next = 0;
            for target in targets {
                assert_eq!(packing.number(target), next);
                next += 1;
                for (material, is_far) in (0..3).flat_map(|material| [(material, false), (material, true)]) {
                    let met = Met { material, is_far };
                    assert_eq!(packing.unpack(packing.pack(target, met)), Some((target, met)));
                }
            }
            assert_eq!(packing.unpack(next), None, "a number beyond all targets");
            assert_eq!(packing.unpack(NO_TARGET), None);
        }
    }

    #[test]
    fn readers_take_their_rays_from_clusters_in_any_part_of_a_table() {
        let hits = GatherTargetPacking::new(4, 2, 1.0).unwrap();
        let hit = |cluster| GatherRay {
            target: hits.pack(GatherTarget::Cluster(cluster), Met::near(1)),
            gradient: cluster,
        };
        let nothing = GatherRay { target: NO_TARGET, gradient: 9 };
        let rays = [hit(0), nothing, hit(2), hit(3), hit(1)];
        let reader = |(ray, index)| Reader { ray, index };
        let targets = GatherTargets::of_hits(hits)
            .with(GatherTarget::Patch, vec![reader((1, 0)), reader((2, 6))])
            .with(GatherTarget::GlossBin, vec![reader((4, 5))]);
        let expected = [
            Some(GatherTarget::Cluster(0)),
            None,
            Some(GatherTarget::Patch(6)),
            Some(GatherTarget::Cluster(3)),
            Some(GatherTarget::GlossBin(5)),
        ]
        .map(|target| target.map(|target| (target, Met::near(1))));
        let counts = TargetCounts { clusters: 4, patches: 7, gloss_bins: 6, sky_side: 0 };
        let packing = GatherTargetPacking::of_counts(counts, 2, 1.0).unwrap();
        for (first, end) in (0..5).flat_map(|first| (first..=5).map(move |end| (first, end))) {
            assert_eq!(targets.of_rays(first, &rays[first..end]), expected[first..end]);
            for (ray, packed) in
                rays[first..end].iter().zip(targets.packed(&packing, first, &rays[first..end]).iter())
            {
                assert_eq!(packed.gradient, ray.gradient);
            }
        }
        assert!(GatherTargets::of_hits(hits).are_packed(&hits) && !targets.are_packed(&hits));
        let unpacked: Vec<_> =
            targets.packed(&packing, 0, &rays).iter().map(|ray| packing.unpack(ray.target)).collect();
        assert_eq!(unpacked, expected);
    }
}
