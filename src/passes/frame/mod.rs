//! Passes of a frame.

pub mod prefix_sum;
