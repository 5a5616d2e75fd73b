//! The least time of each pass: what its bytes take at the rate at which this device copies memory,
//! or its rays at the rate at which it follows such rays through this scene, whichever is longer,
//! for both may go on at once.

use super::measure::PassSummary;
use super::ray_rates::RayRates;
use crate::passes::frame::{antialias::Antialias, primary::Primary};

/// What this device can do, as measured in the same run.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits<'a> {
    /// 10⁹ bytes a second, read and written.
    pub(super) copy_gbps: Option<f64>,
    /// In the scene.
    pub(super) rays: &'a RayRates,
}

impl Limits<'_> {
    /// The least time of a pass, milliseconds; none if nothing of what it does is counted, or known
    /// how fast it could be.
    pub(super) fn floor_ms(&self, pass: &PassSummary) -> Option<f64> {
        let bytes = self.copy_gbps.filter(|_| pass.bytes > 0).map(|gbps| pass.bytes as f64 / (1e6 * gbps));
        let rate = if is_closest(pass.name) {
            self.rays.device.closest_coherent
        } else {
            self.rays.device.any_coherent
        };
        let rays =
            pass.rays.filter(|&rays| rays > 0).zip(rate).map(|(rays, rate)| rays as f64 / (1e3 * rate));
        match (bytes, rays) {
            (Some(bytes), Some(rays)) => Some(bytes.max(rays)),
            (bytes, rays) => bytes.or(rays),
        }
    }

    /// The least time as a share of what the pass took: above one where it need not do all that it
    /// is counted for.
    pub(super) fn share(&self, pass: &PassSummary) -> Option<f64> {
        self.floor_ms(pass).filter(|_| pass.ms.median > 0.0).map(|floor| floor / pass.ms.median)
    }

    /// Sum of the least times of those passes that have one, and of what these took; milliseconds.
    pub(super) fn sums_ms(&self, passes: &[PassSummary]) -> [f64; 2] {
        let known = passes.iter().filter_map(|pass| Some([self.floor_ms(pass)?, pass.ms.median]));
        known.fold([0.0; 2], |sum, known| [sum[0] + known[0], sum[1] + known[1]])
    }
}

/// Whether a pass asks for closest hits. Those of frames are the camera's; all other rays go
/// to a light.
fn is_closest(pass: &str) -> bool {
    [Primary::STEM, Antialias::STEM].contains(&pass)
}

#[cfg(test)]
mod tests {
    use super::super::measure::Summary;
    use super::super::ray_rates::Rates;
    use super::*;

    fn pass(name: &'static str, bytes: u64, rays: Option<u64>) -> PassSummary {
        PassSummary { name, ms: Summary::of([4.0]), overlapped: false, bytes, rays }
    }

    #[test]
    fn the_longer_of_bytes_and_rays_is_the_floor() {
        let device = Rates { closest_coherent: Some(1.0), any_coherent: Some(4.0), ..Rates::default() };
        let rays = RayRates { device, host: None };
        let limits = Limits { copy_gbps: Some(2.0), rays: &rays };
        // 6 MB at 2 GB/s are 3 ms; a thousand rays 1 ms, or a quarter of it towards a light.
        assert_eq!(limits.floor_ms(&pass("tonemap", 6_000_000, None)), Some(3.0));
        assert_eq!(limits.floor_ms(&pass("primary", 6_000_000, Some(1_000))), Some(3.0));
        assert_eq!(limits.floor_ms(&pass("primary", 6_000, Some(1_000))), Some(1.0));
        assert_eq!(limits.floor_ms(&pass("direct", 6_000, Some(10_000))), Some(2.5));
        assert_eq!(limits.floor_ms(&pass("gloss_base", 0, None)), None);
        let passes = [pass("tonemap", 6_000_000, None), pass("gloss_base", 0, None)];
        assert_eq!(limits.sums_ms(&passes), [3.0, 4.0], "of a pass without floor nothing counts");
        let unknown = Limits { copy_gbps: None, rays: &RayRates { device: Rates::default(), host: None } };
        assert_eq!(unknown.floor_ms(&pass("primary", 6_000, Some(1_000))), None);
    }
}
