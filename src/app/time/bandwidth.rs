//! The device's copy bandwidth, which the bytes per second of passes are compared with.

use std::sync::Arc;

use super::measure::Summary;
use crate::error::Result;
use crate::gpu::{Buffer, Context, Recorder};
use crate::passes::kernel_copy::KernelCopy;

/// Larger than any cache.
const BYTES: u64 = 64 << 20;

const REPEATS: usize = 9;

/// Bytes read plus bytes written per second, in 10⁹; median of several runs. `None` if the device's
/// clock is too coarse.
#[derive(Clone, Copy, Debug)]
pub(super) struct CopyRates {
    /// A buffer copy command of the device.
    pub(super) device: Option<f64>,
    /// A kernel that only copies, four words per invocation.
    pub(super) kernel_texels: Option<f64>,
    /// A kernel that only copies, one word per invocation.
    pub(super) kernel_words: Option<f64>,
}

/// Measures a device. The context's peak memory grows by two buffers, so its peak must
/// not be reported.
///
/// # Errors
/// The device lacks memory for the buffers, or a Vulkan call failed.
pub(super) fn measure(context: &Arc<Context>) -> Result<CopyRates> {
    let bytes = BYTES.min(context.limits().storage_range_bytes & !15);
    let from = Buffer::storage(context, "copy source", bytes)?;
    let to = Buffer::storage(context, "copy target", bytes)?;
    // Untouched memory may not be committed yet, or may be one shared page of zeros.
    context.run(|recorder| [&from, &to].map(|buffer| recorder.fill_zero(buffer)))?;
    let rate = |record: &dyn Fn(&mut Recorder)| -> Result<Option<f64>> {
        let mut times = Vec::new();
        for _ in 0..REPEATS {
            let (_, passes) = context.run(record)?;
            times.extend(passes.iter().map(|pass| pass.ms));
        }
        let ms = Summary::from_times(times).median;
        Ok((ms > 0.0).then(|| 2.0 * bytes as f64 / (ms * 1e6)))
    };
    let words = (bytes / 4) as u32;
    let [by_texels, by_words] = [KernelCopy::of_texels(context)?, KernelCopy::of_words(context)?];
    Ok(CopyRates {
        device: rate(&|recorder| {
            recorder.pass("copy").copy(&from, &to);
        })?,
        kernel_texels: rate(&|recorder| by_texels.record(recorder, &from, &to, words))?,
        kernel_words: rate(&|recorder| by_words.record(recorder, &from, &to, words))?,
    })
}
