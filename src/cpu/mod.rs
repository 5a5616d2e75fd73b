//! Slow, obvious twins of the passes: same inputs, same outputs, no cleverness. Tests hold the device against them.

pub mod math;
pub mod prefix_sum;
pub mod records;
