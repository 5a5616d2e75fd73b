//! Values that are tuned for a class of devices. No other code depends on the kind of device for
//! speed, and no value changes more than the order of sums.

use std::num::NonZero;

use super::device::{CPU, Limits};
use super::spirv::LOCAL_SIZE;

/// Values for a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tuning {
    /// Maximum number of adjacent workgroups that are taken one after
    /// another; see [`Tuning::swizzled`].
    pub strip: u32,
    /// Runs of workgroups, one for each thread of the device.
    pub slices: u32,
    /// Invocations of a workgroup with many barriers.
    pub waiting_group: u32,
    /// Invocations that share a block of a scan.
    pub scan_group: u32,
    /// Invocations that gather at a cache point.
    pub record_lanes: u32,
    /// Points of one triangle that see a light alike take one shadow ray.
    pub finds_alike: bool,
}

/// Tuning of a class of devices, within the device's limits.
struct Class {
    /// As in [`super::DeviceSummary::kind`]. `None`: all other kinds; comes last.
    kind: Option<&'static str>,
    strip: u32,
    /// `None`: one for each processor core.
    slices: Option<u32>,
    /// `None`: one subgroup.
    waiting_group: Option<u32>,
    /// `None`: one subgroup.
    scan_group: Option<u32>,
    record_lanes: u32,
    finds_alike: bool,
}

const CLASSES: [Class; 2] = [
    // lavapipe gives each core one run of consecutive workgroups, all of the same length, and the
    // frame waits for the last run. Strips go to the runs in turn, so that each run gets some of
    // the costly half of the picture, and adjacent workgroups still share the cache. lavapipe runs
    // the subgroups of a workgroup in turn and switches between them at each barrier, which costs
    // more than short sums. So a workgroup has one subgroup, whose lanes go through long runs of a
    // scan. lavapipe loads the data of the lanes of a subgroup one by one, adjacent or not. So each
    // lane has a cache point, and none waits. The search for points that see a light alike costs
    // more than rays from the roots of a shaft.
    Class {
        kind: Some(CPU),
        strip: 16,
        slices: None,
        waiting_group: None,
        scan_group: None,
        record_lanes: 1,
        finds_alike: false,
    },
    // A GPU distributes workgroups one by one, hides the latency of one subgroup behind others, and
    // loads adjacent data at once. It waits for the memory that rays read.
    Class {
        kind: None,
        strip: u32::MAX,
        slices: Some(1),
        waiting_group: Some(64),
        scan_group: Some(256),
        record_lanes: RECORD_GROUP,
        finds_alike: true,
    },
];

/// Invocations of a gather workgroup, as in `glsl/include/record_lanes.glsl`.
const RECORD_GROUP: u32 = 64;

impl Tuning {
    /// Tuning for a device of this kind, on a machine with `cores` cores.
    pub(super) fn from_device(kind: &str, limits: &Limits, cores: u32) -> Self {
        let [.., others] = &CLASSES;
        let class = CLASSES.iter().find(|class| class.kind == Some(kind)).unwrap_or(others);
        Self {
            strip: class.strip.min(limits.workgroup_count[0]),
            slices: class.slices.unwrap_or(cores).min(limits.workgroup_count[2]),
            waiting_group: class.waiting_group.unwrap_or(limits.subgroup_size),
            scan_group: class.scan_group.unwrap_or(limits.subgroup_size),
            record_lanes: class.record_lanes,
            finds_alike: class.finds_alike,
        }
    }

    /// Number of cores of this machine.
    pub(super) fn cores() -> u32 {
        std::thread::available_parallelism().map_or(1, NonZero::get) as u32
    }

    /// Specialisation constants of the tuning. A [`Pipeline`](super::Pipeline) takes them if its
    /// shader has them.
    pub(super) fn constants(&self) -> [(&'static str, u32); 5] {
        let group = (LOCAL_SIZE[0], self.waiting_group);
        let alike = ("FINDS_ALIKE", u32::from(self.finds_alike));
        [("STRIP", self.strip), ("SLICES", self.slices), group, ("RECORD_LANES", self.record_lanes), alike]
    }

    /// Workgroups along each axis for one-dimensional work of `groups` workgroups: strips along x,
    /// which go to the slices along z in turn. A device that takes workgroups by x, then y, then z
    /// finishes a slice before the next. `flat_workgroup` in `glsl/include/dispatch.glsl` numbers
    /// them in this order; kernels that compute workgroup counts for others use it, too.
    pub fn swizzled(&self, groups: u32) -> [u32; 3] {
        let of_slice = groups.div_ceil(self.slices);
        [of_slice.min(self.strip), of_slice.div_ceil(self.strip), self.slices]
    }

    /// Number of workgroups that gather `records` records.
    pub fn record_groups(&self, records: u32) -> u32 {
        records.div_ceil(RECORD_GROUP / self.record_lanes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn limits() -> Limits {
        Limits { workgroup_count: [65535; 3], subgroup_size: 8, ..Limits::default() }
    }

    #[test]
    fn all_records_are_gathered_by_no_more_workgroups_than_it_takes() {
        for (kind, groups) in [(CPU, [0, 1, 1, 2]), ("discrete GPU", [0, 1, 64, 65])] {
            assert_eq!(
                [0, 1, 64, 65].map(|records| Tuning::from_device(kind, &limits(), 6).record_groups(records)),
                groups
            );
        }
    }

    #[test]
    fn each_kind_has_its_class_and_limits_bound_it() {
        let tuning = |kind, limits| {
            let Tuning { strip, slices, waiting_group, scan_group, record_lanes, finds_alike } =
                Tuning::from_device(kind, &limits, 6);
            [strip, slices, waiting_group, scan_group, record_lanes, u32::from(finds_alike)]
        };
        assert_eq!(tuning(CPU, limits()), [16, 6, 8, 8, 1, 0]);
        assert_eq!(tuning("discrete GPU", limits()), [65535, 1, 64, 256, 64, 1]);
        assert_eq!(tuning(CPU, Limits { workgroup_count: [10, 65535, 3], ..limits() }), [10, 3, 8, 8, 1, 0]);
    }

    /// Each workgroup occurs once. There is less than a row of all slices in excess, and each layer
    /// has the same number.
    #[test]
    fn all_workgroups_are_dealt() {
        for (kind, most) in [(CPU, 6_000_000), ("discrete GPU", 4_000_000_000_u32)] {
            let tuning = Tuning::from_device(kind, &limits(), 6);
            for groups in [0, 1, 2, 95, 96, 97, 5000, most] {
                let [x, y, z] = tuning.swizzled(groups);
                let swizzled = u64::from(x) * u64::from(y) * u64::from(z);
                assert!(swizzled >= u64::from(groups), "{groups}: {x} {y} {z}");
                assert!(swizzled < u64::from(groups) + u64::from(x * z).max(1), "{groups}: {x} {y} {z}");
                assert!(y <= 65535, "{groups}: {x} {y} {z}");
            }
        }
    }
}
