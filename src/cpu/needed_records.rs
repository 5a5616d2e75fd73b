//! Reference of the search for records that a view needs.

/// The stale records that blending reads for the records of the pixels, in ascending order.
/// `weights`: records of each pixel; `neighbours`: records from which each record is blended.
pub fn needed_records(weights: &[Vec<u32>], neighbours: &[Vec<u32>], is_current: &[bool]) -> Vec<u32> {
    let mut seen: Vec<u32> = weights.concat();
    seen.sort_unstable();
    seen.dedup();
    let mut needed: Vec<u32> = seen.iter().flat_map(|&record| neighbours[record as usize].clone()).collect();
    needed.retain(|&record| !is_current[record as usize]);
    needed.sort_unstable();
    needed.dedup();
    needed
}
