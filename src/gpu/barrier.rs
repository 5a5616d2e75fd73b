//! The vocabulary of barriers. Call sites name the kinds of commands before and after, never a
//! pipeline stage or an access mask.
//!
//! All are global memory barriers: on a single compute queue, a barrier for one buffer gains
//! nothing. The source is a pipeline stage with all its writes, the destination a pipeline stage
//! with all its reads and writes. The writes of one submission are visible to the next without
//! any of these.

use ash::vk;

/// An execution and memory dependency between commands recorded before it and commands
/// recorded after it.
#[derive(Clone, Copy, Debug)]
pub struct Barrier {
    pub(super) name: &'static str,
    source: (vk::PipelineStageFlags2, vk::AccessFlags2),
    destination: (vk::PipelineStageFlags2, vk::AccessFlags2),
}

const COMPUTE: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::COMPUTE_SHADER;
const INDIRECT: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::DRAW_INDIRECT;
const TRANSFER: vk::PipelineStageFlags2 = vk::PipelineStageFlags2::ALL_TRANSFER;

const COMPUTE_WRITES: vk::AccessFlags2 = vk::AccessFlags2::SHADER_WRITE;
const COMPUTE_ALL: vk::AccessFlags2 = vk::AccessFlags2::from_raw(
    vk::AccessFlags2::SHADER_READ.as_raw() | vk::AccessFlags2::SHADER_WRITE.as_raw(),
);
const TRANSFER_WRITES: vk::AccessFlags2 = vk::AccessFlags2::TRANSFER_WRITE;
const TRANSFER_ALL: vk::AccessFlags2 = vk::AccessFlags2::from_raw(
    vk::AccessFlags2::TRANSFER_READ.as_raw() | vk::AccessFlags2::TRANSFER_WRITE.as_raw(),
);

/// Dispatches before, dispatches after.
pub const COMPUTE_TO_COMPUTE: Barrier = Barrier {
    name: "COMPUTE_TO_COMPUTE",
    source: (COMPUTE, COMPUTE_WRITES),
    destination: (COMPUTE, COMPUTE_ALL),
};

/// Dispatches before; after, dispatches whose group counts or data they wrote.
pub const COMPUTE_TO_INDIRECT: Barrier = Barrier {
    name: "COMPUTE_TO_INDIRECT",
    source: (COMPUTE, COMPUTE_WRITES),
    destination: (
        vk::PipelineStageFlags2::from_raw(COMPUTE.as_raw() | INDIRECT.as_raw()),
        vk::AccessFlags2::from_raw(COMPUTE_ALL.as_raw() | vk::AccessFlags2::INDIRECT_COMMAND_READ.as_raw()),
    ),
};

/// Dispatches before, fills and copies after.
pub const COMPUTE_TO_TRANSFER: Barrier = Barrier {
    name: "COMPUTE_TO_TRANSFER",
    source: (COMPUTE, COMPUTE_WRITES),
    destination: (TRANSFER, TRANSFER_ALL),
};

/// Fills and copies before, dispatches after, indirect ones too.
pub const TRANSFER_TO_COMPUTE: Barrier = Barrier {
    name: "TRANSFER_TO_COMPUTE",
    source: (TRANSFER, TRANSFER_WRITES),
    destination: COMPUTE_TO_INDIRECT.destination,
};

/// Fills and copies before, fills and copies after.
pub const TRANSFER_TO_TRANSFER: Barrier = Barrier {
    name: "TRANSFER_TO_TRANSFER",
    source: (TRANSFER, TRANSFER_WRITES),
    destination: (TRANSFER, TRANSFER_ALL),
};

/// Copies before; after, the host reads mapped memory.
pub(super) const TRANSFER_TO_HOST: Barrier = Barrier {
    name: "TRANSFER_TO_HOST",
    source: (TRANSFER, TRANSFER_WRITES),
    destination: (vk::PipelineStageFlags2::HOST, vk::AccessFlags2::HOST_READ),
};

/// Dispatches before; after, the host reads mapped memory.
pub(super) const COMPUTE_TO_HOST: Barrier = Barrier {
    name: "COMPUTE_TO_HOST",
    source: (COMPUTE, COMPUTE_WRITES),
    destination: TRANSFER_TO_HOST.destination,
};

/// Everything submitted before, everything in this recording after. Every recording begins with it.
pub(super) const SUBMISSION: Barrier = Barrier {
    name: "SUBMISSION",
    source: (vk::PipelineStageFlags2::ALL_COMMANDS, vk::AccessFlags2::MEMORY_WRITE),
    destination: (
        vk::PipelineStageFlags2::ALL_COMMANDS,
        vk::AccessFlags2::from_raw(
            vk::AccessFlags2::MEMORY_READ.as_raw() | vk::AccessFlags2::MEMORY_WRITE.as_raw(),
        ),
    ),
};

/// Where on the device an access happens, as a set of bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Places(u8);

impl Places {
    pub(super) const NONE: Self = Self(0);
    pub(super) const COMPUTE: Self = Self(1);
    pub(super) const INDIRECT: Self = Self(2);
    pub(super) const TRANSFER: Self = Self(4);

    pub(super) fn meets(self, other: Self) -> bool {
        self.0 & other.0 != 0
    }

    pub(super) fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    fn from_stages(stages: vk::PipelineStageFlags2) -> Self {
        [(COMPUTE, Self::COMPUTE), (INDIRECT, Self::INDIRECT), (TRANSFER, Self::TRANSFER)]
            .into_iter()
            .filter(|(stage, _)| stages.contains(*stage))
            .fold(Self::NONE, |places, (_, place)| places.with(place))
    }
}

impl Barrier {
    /// The accesses that the barrier waits for. A compute source includes the fetch of indirect
    /// group counts, an earlier pipeline stage of a dispatch.
    pub(super) fn places_before(self) -> Places {
        let places = Places::from_stages(self.source.0);
        if places.meets(Places::COMPUTE) { places.with(Places::INDIRECT) } else { places }
    }

    /// The accesses that wait for the barrier.
    pub(super) fn places_after(self) -> Places {
        Places::from_stages(self.destination.0)
    }

    pub(super) fn memory_barrier(self) -> vk::MemoryBarrier2<'static> {
        vk::MemoryBarrier2::default()
            .src_stage_mask(self.source.0)
            .src_access_mask(self.source.1)
            .dst_stage_mask(self.destination.0)
            .dst_access_mask(self.destination.1)
    }
}
