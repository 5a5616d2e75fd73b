//! Reference of the search for records that a view needs.

/// Records that blending reads for those that pixels name, in ascending order, without those
/// that are current. `weights`: records of each pixel; `neighbours`: records that each record
/// is blended from.
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
