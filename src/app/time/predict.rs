//! `time --predict`: the time of a frame on a device of which only rates are known, from what the
//! frame costs without a clock.
//!
//! A pass takes the longer of its bytes and its rays at their rates, as in `floors.rs`. To that it
//! adds a fixed time for each dispatch with its barrier. Fills and copies have a barrier and no
//! dispatch, so the larger of both numbers counts. Passes wait for each other: a frame takes their
//! sum. Without these waits, the commands between two barriers start together: the fixed time
//! counts once a barrier.

use std::str::FromStr;

use super::edit_costs::{EditCost, PassCost};

/// Rates of a device.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub(super) struct AssumedRates {
    /// Bytes read and written per second, in 10⁹.
    pub(super) gbps: f64,
    /// Rays per second, in 10⁹.
    pub(super) grays: f64,
    /// Time of a dispatch together with its barrier, µs.
    pub(super) us: f64,
}

/// Rates that are not given. They are round numbers for a GPU of a data centre.
const DEFAULT: AssumedRates = AssumedRates { gbps: 3000.0, grays: 1.5, us: 3.0 };

impl AssumedRates {
    /// Time of a pass, milliseconds.
    pub(super) fn pass_ms(&self, pass: &PassCost) -> f64 {
        self.work_ms(pass) + 1e-3 * self.us * f64::from(pass.dispatches.max(pass.barriers))
    }

    /// Time of a frame, milliseconds.
    pub(super) fn edit_ms(&self, edit: &EditCost) -> f64 {
        edit.passes.iter().map(|pass| self.pass_ms(pass)).sum()
    }

    /// Time of the same frame without waits between passes, milliseconds.
    pub(super) fn free_ms(&self, edit: &EditCost) -> f64 {
        let work_ms: f64 = edit.passes.iter().map(|pass| self.work_ms(pass)).sum();
        work_ms + 1e-3 * self.us * edit.free_barriers as f64
    }

    /// Time of a pass's bytes and rays, milliseconds.
    fn work_ms(&self, pass: &PassCost) -> f64 {
        let bytes_ms = pass.bytes as f64 / (1e6 * self.gbps);
        let rays_ms = pass.rays as f64 / (1e6 * self.grays);
        bytes_ms.max(rays_ms)
    }
}

impl FromStr for AssumedRates {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let refuse = || {
            "expected rates by name with commas between them, gbps and grays above 0 and us not below 0, as in \
             gbps=3000,grays=1.5,us=3"
                .to_owned()
        };
        let mut rates = DEFAULT;
        let mut seen = Vec::new();
        for pair in text.split(',') {
            let (name, number) = pair.split_once('=').ok_or_else(refuse)?;
            let name = name.trim();
            let number: f64 = number.trim().parse().map_err(|_| refuse())?;
            let (rate, may_be_zero) = match name {
                "gbps" => (&mut rates.gbps, false),
                "grays" => (&mut rates.grays, false),
                "us" => (&mut rates.us, true),
                _ => return Err(refuse()),
            };
            if !number.is_finite() || number < 0.0 || (number == 0.0 && !may_be_zero) {
                return Err(refuse());
            }
            if seen.contains(&name) {
                return Err(format!("{name} is there twice"));
            }
            *rate = number;
            seen.push(name);
        }
        Ok(rates)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::CommandCounts;
    use crate::renderer::FrameCounts;

    const RATES: AssumedRates = AssumedRates { gbps: 2.0, grays: 0.5, us: 100.0 };

    fn pass(bytes: u64, rays: u64, [dispatches, barriers]: [u32; 2]) -> PassCost {
        PassCost { name: "pass", dispatches, barriers, bytes, rays }
    }

    #[test]
    fn a_pass_takes_the_longer_of_bytes_and_rays_and_its_dispatches() {
        // 6 MB at 2 GB/s take 3 ms, and so do 1.5 million rays at 0.5 Grays/s.
        assert_eq!(RATES.pass_ms(&pass(6_000_000, 1_000_000, [0, 0])), 3.0);
        assert_eq!(RATES.pass_ms(&pass(1_000_000, 1_500_000, [0, 0])), 3.0);
        // A dispatch and its barrier are one step. A fill has a barrier alone.
        assert_eq!(RATES.pass_ms(&pass(0, 0, [5, 5])), 0.5);
        assert_eq!(RATES.pass_ms(&pass(0, 0, [5, 3])), 0.5);
        assert_eq!(RATES.pass_ms(&pass(0, 0, [3, 5])), 0.5);
        assert_eq!(RATES.pass_ms(&pass(6_000_000, 0, [10, 10])), 4.0);
    }

    #[test]
    fn a_frame_takes_the_sum_of_its_passes() {
        let edit = EditCost {
            name: "edit",
            commands: CommandCounts::default(),
            free_barriers: 2,
            counts: FrameCounts::default(),
            gathered: 0,
            passes: vec![pass(6_000_000, 0, [1, 2]), pass(0, 1_500_000, [3, 1])],
        };
        assert_eq!(RATES.edit_ms(&edit), 3.2 + 3.3);
        assert_eq!(RATES.free_ms(&edit), 3.0 + 3.0 + 0.2);
        assert_eq!(RATES.edit_ms(&EditCost { passes: Vec::new(), ..edit }), 0.0);
    }

    #[test]
    fn rates_have_names_and_defaults() {
        assert_eq!("gbps=2,grays=0.5,us=100".parse(), Ok(RATES));
        assert_eq!("us=100, grays=0.5 ,gbps=2".parse(), Ok(RATES));
        assert_eq!("us=0".parse(), Ok(AssumedRates { us: 0.0, ..DEFAULT }));
        for bad in
            ["", "3000,1.5,3", "gbps", "gbps=", "gbps=0", "grays=-1", "us=-1", "us=nan", "gbps=inf", "mbps=3"]
        {
            let error = bad.parse::<AssumedRates>().unwrap_err();
            assert!(error.contains("as in gbps=3000,grays=1.5,us=3"), "{bad}: {error}");
        }
        assert_eq!("us=1,us=2".parse::<AssumedRates>(), Err("us is there twice".to_owned()));
    }
}
