//! Interpolation between keys: curves in time, and fades.

use glam::DVec3;

/// A curve through keys in time with a continuous first derivative: cubic Hermite segments. The
/// velocity at a key is that of the parabola through it and its two neighbours. It is at most three
/// times that of the slower adjacent segment, so that a held value stays constant and overshoot is
/// small. At both ends it is zero. Outside the keys the curve is constant.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Curve {
    /// Keys by rising time, at least one.
    keys: Vec<Key>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Key {
    time: f64,
    value: DVec3,
    velocity: DVec3,
}

impl Curve {
    /// A curve through points in space, independent of the coordinate system. Times rise; there is
    /// at least one key.
    pub(super) fn path(keys: &[(f64, DVec3)]) -> Self {
        Self::new(keys, |parabola, before, after| {
            let most = 3.0 * before.length().min(after.length());
            parabola.clamp_length_max(most)
        })
    }

    /// A curve through amounts. Each component is monotone between two keys, so that it stays in
    /// the range of these keys.
    pub(super) fn amounts(keys: &[(f64, DVec3)]) -> Self {
        Self::new(keys, |parabola, before, after| {
            let most = 3.0 * before.abs().min(after.abs());
            let rises = DVec3::select((before * after).cmpgt(DVec3::ZERO), DVec3::ONE, DVec3::ZERO);
            rises * parabola.clamp(-most, most)
        })
    }

    /// `limit` takes the parabola's velocity and those of the segments before and after.
    fn new(keys: &[(f64, DVec3)], limit: impl Fn(DVec3, DVec3, DVec3) -> DVec3) -> Self {
        let velocity = |index: usize| {
            let [before, here, after] =
                [index.wrapping_sub(1), index, index + 1].map(|index| keys.get(index).copied());
            let (Some(before), Some(here), Some(after)) = (before, here, after) else { return DVec3::ZERO };
            let (left_s, right_s) = (here.0 - before.0, after.0 - here.0);
            let (left, right) = ((here.1 - before.1) / left_s, (after.1 - here.1) / right_s);
            limit((right_s * left + left_s * right) / (left_s + right_s), left, right)
        };
        let key = |(index, &(time, value)): (usize, &_)| Key { time, value, velocity: velocity(index) };
        Self { keys: keys.iter().enumerate().map(key).collect() }
    }

    /// The value at a time, seconds.
    pub(super) fn at(&self, time: f64) -> DVec3 {
        let after = self.keys.partition_point(|key| key.time <= time);
        let (Some(from), Some(to)) = (self.keys.get(after.wrapping_sub(1)), self.keys.get(after)) else {
            return self.keys[after.saturating_sub(1)].value;
        };
        let span = to.time - from.time;
        let x = (time - from.time) / span;
        let (x2, x3) = (x * x, x * x * x);
        let blend = 3.0 * x2 - 2.0 * x3;
        from.value
            + blend * (to.value - from.value)
            + (x3 - 2.0 * x2 + x) * span * from.velocity
            + (x3 - x2) * span * to.velocity
    }

    /// The values at all keys.
    pub(super) fn values(&self) -> impl Iterator<Item = DVec3> + '_ {
        self.keys.iter().map(|key| key.value)
    }
}

/// A value that changes at certain times, at once or gradually.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Fades {
    /// Changes in the order of their time.
    changes: Vec<Change>,
    start: DVec3,
}

/// A smooth change from the value at its start.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Change {
    time: f64,
    fade: f64,
    from: DVec3,
    to: DVec3,
}

impl Fades {
    /// A constant value.
    pub(super) fn new(start: DVec3) -> Self {
        Self { changes: Vec::new(), start }
    }

    /// Changes the value to `to` from `time` on, within `fade` seconds. `time` must not precede
    /// an earlier change.
    pub(super) fn change(&mut self, time: f64, fade: f64, to: DVec3) {
        let from = self.at(time);
        self.changes.push(Change { time, fade, from, to });
    }

    /// The value at a time, seconds.
    pub(super) fn at(&self, time: f64) -> DVec3 {
        let begun = self.changes.partition_point(|change| change.time <= time);
        let Some(change) = begun.checked_sub(1).map(|last| self.changes[last]) else { return self.start };
        let x = (time - change.time) / change.fade;
        // Without a fade the change is at once: 0/0 is NaN, and not below one.
        if x < 1.0 { change.from + x * x * (3.0 - 2.0 * x) * (change.to - change.from) } else { change.to }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An orbit with a hold and an uneven pace.
    const KEYS: [(f64, DVec3); 6] = [
        (1.0, DVec3::new(0.0, 1.0, 4.0)),
        (2.0, DVec3::new(2.0, 1.5, 3.0)),
        (4.0, DVec3::new(4.0, 2.0, 0.0)),
        (5.5, DVec3::new(4.0, 2.0, 0.0)),
        (6.0, DVec3::new(3.0, 0.5, -1.0)),
        (8.0, DVec3::new(1.0, 0.0, -1.0)),
    ];

    fn both() -> [Curve; 2] {
        [Curve::path(&KEYS), Curve::amounts(&KEYS)]
    }

    fn velocity(curve: &Curve, time: f64) -> DVec3 {
        (curve.at(time + 1e-6) - curve.at(time - 1e-6)) / 2e-6
    }

    #[test]
    fn curves_pass_through_their_keys_and_end_there() {
        for curve in both() {
            for (time, value) in KEYS {
                assert!(curve.at(time).distance(value) < 1e-12, "{time}");
            }
            assert_eq!((curve.at(-3.0), curve.at(1e6)), (KEYS[0].1, KEYS[5].1));
            assert_eq!(curve.at(5.0), KEYS[2].1, "a value that is held stays put");
        }
        assert_eq!(Curve::path(&KEYS[..1]).at(0.3), KEYS[0].1);
    }

    #[test]
    fn velocity_is_continuous_and_zero_at_ends_and_holds() {
        for curve in both() {
            for (index, (time, _)) in KEYS.into_iter().enumerate() {
                let [left, right] = [-2e-5, 2e-5].map(|step| velocity(&curve, time + step));
                assert!(left.distance(right) < 2e-3, "{time}: {left}, {right}");
                let rests = [0, 2, 3, 5].contains(&index);
                assert_eq!(left.length().max(right.length()) < 2e-3, rests, "{time}: {left}, {right}");
            }
        }
    }

    #[test]
    fn amounts_stay_between_their_keys_and_paths_turn_with_the_world() {
        let curve = Curve::amounts(&KEYS);
        for pair in KEYS.windows(2) {
            let (low, high) = (pair[0].1.min(pair[1].1), pair[0].1.max(pair[1].1));
            for step in 0..=100 {
                let value = curve.at(pair[0].0 + (pair[1].0 - pair[0].0) * f64::from(step) / 100.0);
                assert!(value.cmpge(low - 1e-12).all() && value.cmple(high + 1e-12).all(), "{value}");
            }
        }
        let turn = glam::DQuat::from_axis_angle(DVec3::new(1.0, 2.0, 3.0).normalize(), 0.7);
        let turned = Curve::path(&KEYS.map(|(time, value)| (time, turn * value)));
        for step in 0..=70 {
            let time = 1.0 + 0.1 * f64::from(step);
            assert!(turned.at(time).distance(turn * Curve::path(&KEYS).at(time)) < 1e-12, "{time}");
        }
    }

    #[test]
    fn an_orbit_of_few_keys_is_nearly_round() {
        let place = |angle: f64| DVec3::new(angle.cos(), 0.0, angle.sin());
        let keys: Vec<_> = (0..=8).map(|i| (f64::from(i), place(f64::from(i) * 0.6))).collect();
        let curve = Curve::path(&keys);
        for step in 10..70 {
            let radius = curve.at(0.1 * f64::from(step)).length();
            assert!((radius - 1.0).abs() < 0.01, "{step}: {radius}");
        }
    }

    #[test]
    fn changes_jump_or_fade_from_what_is_there() {
        let mut value = Fades::new(DVec3::ZERO);
        value.change(1.0, 0.0, DVec3::ONE);
        value.change(2.0, 2.0, DVec3::splat(3.0));
        value.change(3.0, 1.0, DVec3::ZERO);
        let at = |time: f64| value.at(time).x;
        assert_eq!([0.0, 0.999, 1.0, 2.0].map(at), [0.0, 0.0, 1.0, 1.0]);
        assert_eq!(at(3.0), 2.0, "half-way when the next change begins");
        assert_eq!([at(3.5), at(4.0), at(9.0)], [1.0, 0.0, 0.0]);
    }
}
