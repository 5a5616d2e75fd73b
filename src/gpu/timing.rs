//! GPU timestamps: two for each pass, read when the submission is done.

use ash::vk;

use super::VkResultExt;
use super::device::Limits;
use super::names::Names;
use crate::error::Result;

/// Device time of one pass.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PassTiming {
    /// The pass's stem.
    pub name: &'static str,
    /// Milliseconds from the first command's start to the last command's end.
    pub ms: f64,
    /// No barrier is between this pass and a neighbour. The device may have run both at once, and
    /// `ms` divides their common time arbitrarily.
    pub overlapped: bool,
    /// Number of recorded dispatches, without fills and copies.
    pub dispatches: u32,
    /// Number of barriers recorded from here to the begin of the next pass. The first pass has the
    /// barriers before it, too.
    pub barriers: u32,
}

/// Queries per pool. A recording that needs more gets another pool.
const POOL_QUERIES: u32 = 256;

/// The timestamps of one recording, kept for reuse by later ones.
#[derive(Default)]
pub(super) struct Timestamps {
    pools: Vec<vk::QueryPool>,
    used: u32,
}

impl Timestamps {
    /// Resets all timestamps. None may be pending on the device.
    pub(super) fn reset(&mut self, device: &ash::Device) {
        for &pool in &self.pools {
            // SAFETY: the pool has as many queries, and no submission writes them any more.
            unsafe { device.reset_query_pool(pool, 0, POOL_QUERIES) };
        }
        self.used = 0;
    }

    /// Writes a timestamp once every earlier command is done.
    pub(super) fn write(
        &mut self,
        (device, sync2, names): (&ash::Device, &ash::khr::synchronization2::Device, &Names),
        commands: vk::CommandBuffer,
    ) -> Result<()> {
        let pool_index = (self.used / POOL_QUERIES) as usize;
        if pool_index == self.pools.len() {
            let info = vk::QueryPoolCreateInfo::default()
                .query_type(vk::QueryType::TIMESTAMP)
                .query_count(POOL_QUERIES);
            // SAFETY: the device and every object in the description are alive.
            let pool = unsafe { device.create_query_pool(&info, None) }.vk("vkCreateQueryPool")?;
            // SAFETY: the pool has as many queries, and no submission writes them any more.
            unsafe { device.reset_query_pool(pool, 0, POOL_QUERIES) };
            names.set_name(pool, "timestamps of passes");
            self.pools.push(pool);
        }
        let stage = vk::PipelineStageFlags2::ALL_COMMANDS;
        // SAFETY: the commands are being recorded, and what they name lives until they have run.
        unsafe {
            sync2.cmd_write_timestamp2(commands, stage, self.pools[pool_index], self.used % POOL_QUERIES);
        }
        self.used += 1;
        Ok(())
    }

    /// The timestamps 2i and 2i + 1, for each i, in ticks. The submission must be done.
    pub(super) fn read(&self, device: &ash::Device) -> Result<Vec<[u64; 2]>> {
        let mut ticks = vec![0_u64; self.used as usize];
        for (&pool, chunk) in self.pools.iter().zip(ticks.chunks_mut(POOL_QUERIES as usize)) {
            // SAFETY: the pool has as many queries, and no submission writes them any more.
            unsafe { device.get_query_pool_results(pool, 0, chunk, vk::QueryResultFlags::TYPE_64) }
                .vk("vkGetQueryPoolResults")?;
        }
        let (spans, _) = ticks.as_chunks::<2>();
        Ok(spans.to_vec())
    }

    pub(super) fn destroy(&mut self, device: &ash::Device) {
        for pool in self.pools.drain(..) {
            // SAFETY: it is ours, made by this device, and no submission uses it any more.
            unsafe { device.destroy_query_pool(pool, None) };
        }
    }
}

/// Milliseconds between two ticks. The counter wraps at its number of valid bits, and its period is
/// not a whole number of nanoseconds on every device.
pub(super) fn milliseconds(begin: u64, end: u64, limits: &Limits) -> f64 {
    let mask = u64::MAX >> (64 - limits.timestamp_bits);
    let ticks = end.wrapping_sub(begin) & mask;
    ticks as f64 * f64::from(limits.timestamp_period_ns) * 1e-6
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_wrap_at_the_valid_bits_and_keep_the_period_whole() {
        let limits = Limits { timestamp_bits: 36, timestamp_period_ns: 52.08, ..Limits::default() };
        assert_eq!(milliseconds((1 << 36) - 500, 500, &limits), 1000.0 * f64::from(52.08_f32) * 1e-6);
        let limits = Limits { timestamp_bits: 64, timestamp_period_ns: 1.0, ..Limits::default() };
        assert_eq!(milliseconds(u64::MAX, 999_999, &limits), 1.0);
    }
}
