//! Reduction of many samples to few keys.

use glam::DVec3;

use super::curve::Curve;

/// Time after which a constant value counts as held, and must stay constant in the film. Shorter
/// pauses are part of a movement: hands move less often than screens are drawn.
pub(super) const HOLD_S: f64 = 0.2;
/// Tolerance of albedos, and of logarithms of exponents.
pub(super) const LOOK_TOLERANCE: f64 = 1e-3;
/// A fade ends if this many samples in a row cannot be its end.
const PATIENCE: usize = 4;

/// The ends of held intervals: samples between which nothing changes. The value is constant before
/// the first and after the last. Empty if nothing changes at all.
pub(super) fn corners<V: PartialEq>(samples: &[(f64, V)]) -> Vec<usize> {
    let mut found = Vec::new();
    let mut start = 0;
    for end in 0..samples.len() {
        let is_last = end + 1 == samples.len();
        if !is_last && samples[end + 1].1 == samples[start].1 {
            continue;
        }
        let is_held = samples[end].0 - samples[start].0 >= HOLD_S;
        if start > 0 && (is_held || is_last) {
            found.push(start);
        }
        if !is_last && (is_held || start == 0) {
            found.push(end);
        }
        start = end + 1;
    }
    found.dedup();
    found
}

/// The samples that become keys of a curve through all samples within tolerance. `excess` takes the
/// sample and the curve's value; at most one is acceptable. The loop ends because the curve meets
/// the samples at its keys.
pub(super) fn keys(
    samples: &[(f64, DVec3)],
    curve: fn(&[(f64, DVec3)]) -> Curve,
    excess: &dyn Fn(DVec3, DVec3) -> f64,
) -> Vec<usize> {
    let corners = corners(samples);
    let mut keys = if corners.is_empty() { vec![0] } else { corners.clone() };
    let through = |keys: &[usize]| curve(&keys.iter().map(|&key| samples[key]).collect::<Vec<_>>());
    let miss = |curve: &Curve, index: usize| excess(samples[index].1, curve.at(samples[index].0));
    loop {
        let curve = through(&keys);
        let worst = keys.windows(2).filter_map(|ends| {
            let misses = (ends[0] + 1..ends[1]).map(|index| (miss(&curve, index), index));
            misses.filter(|(miss, _)| *miss > 1.0).max_by(|a, b| a.0.total_cmp(&b.0))
        });
        let added: Vec<usize> = worst.map(|(_, index)| index).collect();
        if added.is_empty() {
            break;
        }
        keys.extend(added);
        keys.sort_unstable();
    }
    // A removed key changes the velocity of its neighbours, and so four spans. Spans
    // further out stay.
    let mut at = 1;
    while at + 1 < keys.len() {
        let window = at.saturating_sub(3)..=(at + 3).min(keys.len() - 1);
        let without: Vec<usize> = keys[window].iter().copied().filter(|key| *key != keys[at]).collect();
        let curve = through(&without);
        let mut touched = keys[at.saturating_sub(2)]..keys[(at + 2).min(keys.len() - 1)];
        let is_fixed = corners.binary_search(&keys[at]).is_ok();
        if is_fixed || touched.any(|index| miss(&curve, index) > 1.0) {
            at += 1;
        } else {
            keys.remove(at);
        }
    }
    keys
}

/// The reflectance of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Look {
    pub(super) diffuse: DVec3,
    pub(super) specular: DVec3,
    pub(super) exponent: f64,
}

impl Look {
    /// The film's look at the fraction `x` of a fade between two looks.
    fn fade(self, to: Self, x: f64) -> Self {
        let blend = x * x * (3.0 - 2.0 * x);
        let is_diffuse = self.specular == DVec3::ZERO;
        let ln = self.exponent.ln() + blend * (to.exponent.ln() - self.exponent.ln());
        Self {
            diffuse: self.diffuse + blend * (to.diffuse - self.diffuse),
            specular: self.specular + blend * (to.specular - self.specular),
            exponent: if is_diffuse { to.exponent } else { ln.exp() },
        }
    }

    /// Whether `found` is within tolerance. The exponent of a diffuse material is ignored.
    fn is_met_by(self, found: Self) -> bool {
        let albedos = (self.diffuse - found.diffuse).abs().max((self.specular - found.specular).abs());
        let sharpness = (self.exponent / found.exponent).ln().abs();
        let is_diffuse = self.specular == DVec3::ZERO;
        albedos.max_element() <= LOOK_TOLERANCE && (is_diffuse || sharpness <= LOOK_TOLERANCE)
    }
}

/// Changes of a material: first and last sample of each; equal if the change is at once. A
/// change from the first sample on starts with an instant change, since only one change can
/// begin at a time.
pub(super) fn fades(samples: &[(f64, Look)], before: Look) -> Vec<[usize; 2]> {
    let mut changes = Vec::new();
    if samples[0].1 != before {
        changes.push([0, 0]);
    }
    let corners = corners(samples);
    let is_met = |start: usize, end: usize| {
        let [(from_s, from), (to_s, to)] = [samples[start], samples[end]];
        samples[start + 1..end]
            .iter()
            .all(|(time, look)| look.is_met_by(from.fade(to, (time - from_s) / (to_s - from_s))))
    };
    let mut start = 0;
    while start + 1 < samples.len() {
        if samples[start + 1].1 == samples[start].1 {
            start += 1;
            continue;
        }
        let mut best = start + 1;
        let is_taken = changes.last() == Some(&[0, 0]) && start == 0;
        for end in start + 1..samples.len() {
            if is_taken || end > best + PATIENCE {
                break;
            }
            if is_met(start, end) {
                best = end;
            }
            if corners.binary_search(&end).is_ok() {
                break;
            }
        }
        changes.push(if best == start + 1 { [best, best] } else { [start, best] });
        start = best;
    }
    changes
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(values: &[f64]) -> Vec<(f64, DVec3)> {
        (0..).zip(values).map(|(index, &x)| (f64::from(index) / 10.0, DVec3::splat(x))).collect()
    }

    #[test]
    fn holds_end_in_corners() {
        let found = |values| corners(&samples(values));
        assert_eq!(found(&[1.0]), [0; 0]);
        assert_eq!(found(&[1.0; 9]), [0; 0]);
        assert_eq!(found(&[1.0, 1.0, 1.0, 2.0, 2.0]), [2, 3]);
        assert_eq!(found(&[0.0, 1.0, 1.0, 2.0, 2.0, 2.0, 3.0]), [0, 3, 5, 6]);
    }

    #[test]
    fn movements_take_few_keys_and_jumps_two() {
        let excess = |wanted: DVec3, found: DVec3| wanted.distance(found) / 1e-3;
        let thin = |values: &[f64]| keys(&samples(values), Curve::path, &excess);
        assert_eq!(thin(&[3.0; 20]), [0]);
        assert_eq!(thin(&[3.0, 3.0, 3.0, 3.0, 5.0, 5.0, 5.0]), [3, 4]);
        let smooth: Vec<f64> = (0..100).map(|i| (f64::from(i) * 0.05).sin()).collect();
        let found = thin(&smooth);
        assert!(found.len() < 25, "{found:?}");
        let curve = Curve::path(&found.iter().map(|&key| samples(&smooth)[key]).collect::<Vec<_>>());
        let all = samples(&smooth);
        assert!(all.iter().all(|(time, value)| excess(*value, curve.at(*time)) <= 1.0));
    }
}
