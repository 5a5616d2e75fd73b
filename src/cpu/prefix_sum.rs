//! Reference of the prefix sum.

/// The sum of the values before each, wrapping, and the total: one more element than
/// there are values.
pub fn prefix_sum(values: &[u32]) -> Vec<u32> {
    let mut sums = vec![0];
    let mut sum = 0_u32;
    for value in values {
        sum = sum.wrapping_add(*value);
        sums.push(sum);
    }
    sums
}
