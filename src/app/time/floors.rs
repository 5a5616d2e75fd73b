//! Lower bound of each pass's time. It is the time of its bytes at this device's copy rate, or of
//! its rays at the device's ray rate in this scene. The longer one counts, since both may overlap.

use super::edit_costs::is_closest;
use super::measure::PassSummary;
use super::ray_rates::RayRates;

/// Rates of this device, measured in the same run.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits<'a> {
    /// Bytes read and written per second, in 10⁹.
    pub(super) copy_gbps: Option<f64>,
    /// Ray rates in the scene.
    pub(super) rays: &'a RayRates,
}

impl Limits<'_> {
    /// Lower bound of a pass's time, milliseconds. `None` if its work is not counted, or the
    /// rate is unknown.
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

    /// The bound as a fraction of the pass's time. Above one if the pass skips counted work.
    pub(super) fn fraction(&self, pass: &PassSummary) -> Option<f64> {
        self.floor_ms(pass).filter(|_| pass.ms.median > 0.0).map(|floor| floor / pass.ms.median)
    }

    /// Sum of the bounds of passes that have one, and sum of their times; milliseconds.
    pub(super) fn sums_ms(&self, passes: &[PassSummary]) -> [f64; 2] {
        let known = passes.iter().filter_map(|pass| Some([self.floor_ms(pass)?, pass.ms.median]));
        known.fold([0.0; 2], |sum, known| [sum[0] + known[0], sum[1] + known[1]])
    }
}

#[cfg(test)]
mod tests {
    use super::super::measure::Summary;
    use super::super::rates::Rates;
    use super::*;

    fn pass(name: &'static str, bytes: u64, rays: Option<u64>) -> PassSummary {
        PassSummary { name, ms: Summary::from_times([4.0]), overlapped: false, bytes, rays }
    }

    #[test]
    fn the_longer_of_bytes_and_rays_is_the_floor() {
        let device = Rates { closest_coherent: Some(1.0), any_coherent: Some(4.0), ..Rates::default() };
        let rays = RayRates { device, host: None };
        let limits = Limits { copy_gbps: Some(2.0), rays: &rays };
        // 6 MB at 2 GB/s take 3 ms; a thousand rays 1 ms, or a quarter of it towards a light.
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
