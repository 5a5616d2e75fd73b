//! Counts of commands and of read-backs: the cost of frames without a clock.

use std::ops::Sub;

/// What the host has submitted and read back since the context was opened. The difference of two
/// values counts the time between them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CommandCounts {
    /// Number of submissions.
    pub submissions: u64,
    /// Number of dispatches in them, without fills, copies and draws.
    pub dispatches: u64,
    /// Number of pipeline barriers between their commands, without those of draws.
    pub barriers: u64,
    /// Bytes read back from buffers by a submission that the host waits for. Mapped words that
    /// the host reads after a frame do not count.
    pub read_back_bytes: u64,
    /// Bytes that submissions copy to host memory, which the host reads without another one.
    pub host_copy_bytes: u64,
}

impl Sub for CommandCounts {
    type Output = Self;

    fn sub(self, before: Self) -> Self {
        Self {
            submissions: self.submissions - before.submissions,
            dispatches: self.dispatches - before.dispatches,
            barriers: self.barriers - before.barriers,
            read_back_bytes: self.read_back_bytes - before.read_back_bytes,
            host_copy_bytes: self.host_copy_bytes - before.host_copy_bytes,
        }
    }
}
