//! How fast the device copies memory: what the bytes per second of every pass are held against.

use std::sync::Arc;

use super::measure::Summary;
use crate::error::Result;
use crate::gpu::{Buffer, Context};

/// Larger than any cache, within every device's largest binding.
const BYTES: u64 = 64 << 20;

const REPEATS: usize = 9;

/// Bytes read plus bytes written per second while copying one buffer to another, in 10⁹; the median of some runs. None
/// where the device's clock is too coarse to tell.
///
/// The context's memory peak grows by both buffers, so it should not be one whose use is reported.
///
/// # Errors
/// There is no memory for the buffers, or a Vulkan call failed.
pub(super) fn copy_gbps(context: &Arc<Context>) -> Result<Option<f64>> {
    let from = Buffer::storage(context, "copy source", BYTES)?;
    let to = Buffer::storage(context, "copy target", BYTES)?;
    // Untouched memory may not exist yet, or all be one page of zeros.
    context.run(|recorder| [&from, &to].map(|buffer| recorder.fill_zero(buffer)))?;
    let mut times = Vec::new();
    for _ in 0..REPEATS {
        let (_, passes) = context.run(|recorder| {
            recorder.pass("copy").copy(&from, &to);
        })?;
        times.extend(passes.iter().map(|pass| pass.ms));
    }
    let ms = Summary::of(times).median;
    Ok((ms > 0.0).then(|| 2.0 * BYTES as f64 / (ms * 1e6)))
}
