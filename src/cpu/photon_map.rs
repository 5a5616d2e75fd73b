//! Reference of the photon map.

use crate::cpu::photons::{BUCKETS, Cells};
use glam::Vec3;

/// Non-empty slots in the order of their photons' buckets; and the first of each bucket, then
/// the end twice.
pub fn photon_map(cells: Cells, slots: &[Option<Vec3>]) -> (Vec<u32>, Vec<u32>) {
    let mut order: Vec<(u32, u32)> =
        (0..).zip(slots).filter_map(|(slot, p)| Some((cells.bucket_of((*p)?), slot))).collect();
    order.sort_by_key(|pair| pair.0);
    let mut entry_offsets = vec![0; BUCKETS as usize + 1];
    for &(bucket, _) in &order {
        entry_offsets[bucket as usize + 1] += 1;
    }
    for bucket in 1..entry_offsets.len() {
        entry_offsets[bucket] += entry_offsets[bucket - 1];
    }
    entry_offsets.push(slots.len() as u32);
    (order.into_iter().map(|pair| pair.1).collect(), entry_offsets)
}
