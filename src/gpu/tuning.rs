//! Values that are tuned for a class of devices. No other code depends on the kind of device for
//! speed, and no value changes more than the order of sums. [`CHOICES`] lists the values that
//! `--tune` and `lightpaths tune` may replace.

use std::fmt;
use std::num::NonZero;
use std::str::FromStr;

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
    /// Shadow rays of pixels and entry points start from the roots of a shaft.
    pub shafts: bool,
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
    shafts: bool,
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
        shafts: true,
    },
    // A GPU distributes workgroups one by one, hides the latency of one subgroup behind others, and
    // loads adjacent data at once. It waits for the memory that rays read. An invocation that
    // opens the nodes of a shaft one by one waits longer than its rays do without.
    Class {
        kind: None,
        strip: u32::MAX,
        slices: Some(1),
        waiting_group: Some(64),
        scan_group: Some(256),
        record_lanes: RECORD_GROUP,
        finds_alike: true,
        shafts: false,
    },
];

/// Invocations of a gather workgroup, as in `glsl/include/record_lanes.glsl`.
const RECORD_GROUP: u32 = 64;

impl Tuning {
    /// Tuning for a device of this kind ([`super::DeviceSummary::kind`]) on a machine with this
    /// number of processor cores.
    pub fn from_device(kind: &str, limits: &Limits, cores: u32) -> Self {
        let [.., others] = &CLASSES;
        let class = CLASSES.iter().find(|class| class.kind == Some(kind)).unwrap_or(others);
        Self {
            strip: class.strip.min(limits.workgroup_count[0]),
            slices: class.slices.unwrap_or(cores).min(limits.workgroup_count[2]),
            waiting_group: class.waiting_group.unwrap_or(limits.subgroup_size),
            scan_group: class.scan_group.unwrap_or(limits.subgroup_size),
            record_lanes: class.record_lanes,
            finds_alike: class.finds_alike,
            shafts: class.shafts,
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

/// A value of a [`Tuning`] that users and measurements may replace.
pub struct Choice {
    /// As in `--tune NAME=VALUE`.
    pub name: &'static str,
    /// Values with which every kernel works, in ascending order.
    pub values: &'static [u32],
    get: fn(&Tuning) -> u32,
    set: fn(&mut Tuning, u32),
    /// Whether the limits of the device allow the value.
    fits: fn(&Limits, u32) -> bool,
}

/// All choices, in the order in which `lightpaths tune` measures them.
pub static CHOICES: [Choice; 7] = [
    Choice {
        name: "finds_alike",
        values: &[0, 1],
        get: |tuning| u32::from(tuning.finds_alike),
        set: |tuning, value| tuning.finds_alike = value == 1,
        fits: |_, _| true,
    },
    Choice {
        name: "shafts",
        values: &[0, 1],
        get: |tuning| u32::from(tuning.shafts),
        set: |tuning, value| tuning.shafts = value == 1,
        fits: |_, _| true,
    },
    // At least as many as the sums of a record (`glsl/gather.comp`), or one.
    Choice {
        name: "record_lanes",
        values: &[1, 8, 16, 32, RECORD_GROUP],
        get: |tuning| tuning.record_lanes,
        set: |tuning, value| tuning.record_lanes = value,
        fits: |_, _| true,
    },
    // Powers of two: kernels halve the group.
    Choice {
        name: "waiting_group",
        values: &[8, 16, 32, 64, 128],
        get: |tuning| tuning.waiting_group,
        set: |tuning, value| tuning.waiting_group = value,
        fits: fits_workgroup,
    },
    // Divisors of the blocks of `prefix_sum` and `path_scan`.
    Choice {
        name: "scan_group",
        values: &[8, 32, 64, 128, 256],
        get: |tuning| tuning.scan_group,
        set: |tuning, value| tuning.scan_group = value,
        fits: fits_workgroup,
    },
    // With shorter strips, a dispatch for the largest picture would have too many rows. The last
    // value is the number of workgroups that every device takes.
    Choice {
        name: "strip",
        values: &[16, 64, 256, 65_535],
        get: |tuning| tuning.strip,
        set: |tuning, value| tuning.strip = value,
        fits: |limits, value| value <= limits.workgroup_count[0],
    },
    Choice {
        name: "slices",
        values: &[1, 2, 4, 8, 16],
        get: |tuning| tuning.slices,
        set: |tuning, value| tuning.slices = value,
        fits: |limits, value| value <= limits.workgroup_count[2],
    },
];

fn fits_workgroup(limits: &Limits, invocations: u32) -> bool {
    invocations <= limits.workgroup_invocations.min(limits.workgroup_size[0])
}

impl Choice {
    /// The value of this choice in a tuning.
    pub fn value(&self, tuning: &Tuning) -> u32 {
        (self.get)(tuning)
    }

    /// The values that a device takes.
    pub fn allowed(&self, limits: &Limits) -> Vec<u32> {
        self.values.iter().copied().filter(|&value| (self.fits)(limits, value)).collect()
    }

    /// The change of this choice to a value.
    pub fn change(&'static self, value: u32) -> TuningChange {
        TuningChange { choice: self, value }
    }
}

/// Two choices are equal if they have the same name.
impl PartialEq for Choice {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl fmt::Debug for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

/// Another value for a choice, as text `NAME=VALUE`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TuningChange {
    /// What is changed.
    pub choice: &'static Choice,
    /// The new value.
    pub value: u32,
}

impl FromStr for TuningChange {
    type Err = String;

    /// Parses `NAME=VALUE`. The error names what is allowed.
    fn from_str(text: &str) -> Result<Self, String> {
        let (name, value) = text.split_once('=').unwrap_or((text, ""));
        let choice = CHOICES.iter().find(|choice| choice.name == name.trim()).ok_or_else(|| {
            let names: Vec<_> = CHOICES.iter().map(|choice| choice.name).collect();
            format!("expected NAME=VALUE, where NAME is one of {}", names.join(", "))
        })?;
        let value = value.trim().parse().ok().filter(|value| choice.values.contains(value));
        let value = value.ok_or_else(|| format!("{name} takes {}", listed(choice.values)))?;
        Ok(Self { choice, value })
    }
}

impl fmt::Display for TuningChange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}={}", self.choice.name, self.value)
    }
}

fn listed(values: &[u32]) -> String {
    values.iter().map(u32::to_string).collect::<Vec<_>>().join(", ")
}

/// Where a value of a tuning is from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TuningSource {
    /// The class of the device.
    Class,
    /// The file of `lightpaths tune`.
    Stored,
    /// The caller, as by `--tune`.
    Given,
}

impl TuningSource {
    /// The name in tables and files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Class => "class",
            Self::Stored => "tuned",
            Self::Given => "given",
        }
    }
}

/// A tuning with the source of each value.
#[derive(Clone, Debug)]
pub struct Tuned {
    /// The values in force.
    pub tuning: Tuning,
    /// The values of the device's class.
    pub class: Tuning,
    sources: [TuningSource; CHOICES.len()],
    /// Why the stored values are ignored, if they are.
    pub warning: Option<String>,
}

impl Tuned {
    pub(super) fn from_class(class: Tuning) -> Self {
        Self { tuning: class, class, sources: [TuningSource::Class; CHOICES.len()], warning: None }
    }

    pub(super) fn with_warning(self, warning: String) -> Self {
        Self { warning: Some(warning), ..self }
    }

    /// Makes a change.
    ///
    /// # Errors
    /// The device does not take the value; the text names what it takes.
    pub(super) fn apply(
        &mut self,
        change: TuningChange,
        source: TuningSource,
        limits: &Limits,
    ) -> Result<(), String> {
        let TuningChange { choice, value } = change;
        let allowed = choice.allowed(limits);
        if !allowed.contains(&value) {
            return Err(format!("{change}: for this device, {} takes {}", choice.name, listed(&allowed)));
        }
        (choice.set)(&mut self.tuning, value);
        let index = CHOICES.iter().position(|other| other == choice);
        self.sources[index.expect("every choice is listed")] = source;
        Ok(())
    }

    /// Each choice with its value and the source of it.
    pub fn values(&self) -> impl Iterator<Item = (&'static Choice, u32, TuningSource)> {
        CHOICES.iter().zip(self.sources).map(|(choice, source)| (choice, choice.value(&self.tuning), source))
    }
}

/// All values in one line, as in "record_lanes 1 (class), strip 16 (given)".
impl fmt::Display for Tuned {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words = self
            .values()
            .map(|(choice, value, source)| format!("{} {value} ({})", choice.name, source.name()));
        f.write_str(&words.collect::<Vec<_>>().join(", "))
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
            let Tuning { strip, slices, waiting_group, scan_group, record_lanes, finds_alike, shafts } =
                Tuning::from_device(kind, &limits, 6);
            [
                strip,
                slices,
                waiting_group,
                scan_group,
                record_lanes,
                u32::from(finds_alike),
                u32::from(shafts),
            ]
        };
        assert_eq!(tuning(CPU, limits()), [16, 6, 8, 8, 1, 0, 1]);
        assert_eq!(tuning("discrete GPU", limits()), [65535, 1, 64, 256, 64, 1, 0]);
        assert_eq!(
            tuning(CPU, Limits { workgroup_count: [10, 65535, 3], ..limits() }),
            [10, 3, 8, 8, 1, 0, 1]
        );
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

    #[test]
    fn changes_are_parsed_and_errors_name_what_is_allowed() {
        for choice in &CHOICES {
            for &value in choice.values {
                let change = choice.change(value);
                assert_eq!(change.to_string().parse(), Ok(change));
            }
        }
        for (text, words) in [
            ("", "one of finds_alike, shafts, record_lanes, waiting_group, scan_group, strip, slices"),
            ("lanes=8", "one of finds_alike"),
            ("record_lanes", "record_lanes takes 1, 8, 16, 32, 64"),
            ("record_lanes=4", "record_lanes takes 1, 8, 16, 32, 64"),
            ("finds_alike=yes", "finds_alike takes 0, 1"),
        ] {
            let error = text.parse::<TuningChange>().expect_err(text);
            assert!(error.contains(words), "{text}: {error}");
        }
    }

    #[test]
    fn a_change_sets_one_value_within_the_limits() {
        let limits = Limits { workgroup_invocations: 64, workgroup_size: [128; 3], ..limits() };
        let class = Tuning::from_device(CPU, &limits, 6);
        for choice in &CHOICES {
            for &value in choice.values {
                let mut tuned = Tuned::from_class(class);
                let result = tuned.apply(choice.change(value), TuningSource::Given, &limits);
                let is_allowed = value <= 64 || choice.name == "strip";
                assert_eq!(result.is_ok(), is_allowed, "{result:?}");
                for (other, found, source) in tuned.values() {
                    let is_changed = is_allowed && other == choice;
                    assert_eq!(found, if is_changed { value } else { other.value(&class) });
                    assert_eq!(source == TuningSource::Given, is_changed);
                }
            }
        }
    }

    /// Tests set all values of a GPU on a processor.
    #[test]
    fn each_value_of_a_gpu_is_a_choice() {
        let limits = Limits { workgroup_count: [65_535; 3], ..limits() };
        let gpu = Tuning::from_device("discrete GPU", &limits, 6);
        for choice in &CHOICES {
            assert!(choice.values.contains(&choice.value(&gpu)), "{}", choice.name);
        }
    }
}
