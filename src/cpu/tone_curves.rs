//! References of the tone curves: from exposed linear Rec.709 to linear display values, which may
//! lie outside of 0..=1.

use crate::scene::ToneCurve;
use glam::{Mat3, Vec3};

/// Below this display value the standard curve is the identity; above it, highlights roll off.
const SHOULDER: f32 = 0.8;
/// All curves are at their ends here; squares stay finite.
const LINEAR_MAX: f32 = 1e6;

/// Display values of exposed values. Negative values and NaN give black.
pub(super) fn toned(curve: ToneCurve, linear: Vec3) -> Vec3 {
    match curve {
        ToneCurve::Standard => Vec3::from(linear.to_array().map(standard)),
        ToneCurve::None => linear,
        ToneCurve::Filmic => filmic(bounded(linear)),
        ToneCurve::Aces => aces(bounded(linear)),
        ToneCurve::Agx => agx(bounded(linear)),
    }
}

/// Negative values and NaN become 0.
pub(super) fn bounded(linear: Vec3) -> Vec3 {
    let bounded = |value: f32| if value > 0.0 { value.min(LINEAR_MAX) } else { 0.0 };
    Vec3::from(linear.to_array().map(bounded))
}

/// The identity up to 0.8, so that mid-grey and diffuse surfaces keep their sRGB values. Above it a
/// shoulder of continuous slope that reaches white only at infinity: highlights keep their shape.
pub(super) fn standard(linear: f32) -> f32 {
    if linear > SHOULDER {
        let beyond = (linear - SHOULDER) / (1.0 - SHOULDER);
        1.0 - (1.0 - SHOULDER) / (1.0 + beyond)
    } else {
        linear
    }
}

/// [Hable 2010, Uncharted 2] with exposure bias 2 and linear white 11.2.
fn filmic(linear: Vec3) -> Vec3 {
    let hable = |x: Vec3| (x * (0.15 * x + 0.05) + 0.004) / (x * (0.15 * x + 0.5) + 0.06) - 0.02 / 0.3;
    hable(2.0 * linear) / hable(Vec3::splat(11.2))
}

/// The fit of [Hill, BakingLab] to the transforms of ACES: the reference rendering transform, and
/// the output transform of sRGB displays.
fn aces(linear: Vec3) -> Vec3 {
    const INTO: Mat3 = Mat3::from_cols_array(&[
        0.59719, 0.07600, 0.02840, 0.35458, 0.90834, 0.13383, 0.04823, 0.01566, 0.83777,
    ]);
    const BACK: Mat3 = Mat3::from_cols_array(&[
        1.60475, -0.10208, -0.00327, -0.53108, 1.10813, -0.07276, -0.07367, -0.00605, 1.07602,
    ]);
    let v = INTO * linear;
    BACK * ((v * (v + 0.024_578_6) - 0.000_090_537) / (v * (0.983_729 * v + 0.432_951) + 0.238_081))
}

/// The fit of degree 6 of [Wrensch 2023] to AgX, base look [Sobotka 2022].
fn agx(linear: Vec3) -> Vec3 {
    const INSET: Mat3 = Mat3::from_cols_array(&[
        0.842_479_06,
        0.042_328_24,
        0.042_375_655,
        0.078_433_6,
        0.878_468_64,
        0.078_433_6,
        0.079_223_745,
        0.079_166_13,
        0.879_143,
    ]);
    const OUTSET: Mat3 = Mat3::from_cols_array(&[
        1.196_879,
        -0.052_896_85,
        -0.052_971_635,
        -0.098_020_88,
        1.151_903_1,
        -0.098_043_45,
        -0.099_029_74,
        -0.098_961_18,
        1.151_073_7,
    ]);
    const LOW: f32 = -12.473_93;
    const HIGH: f32 = 4.026_069;
    let stops = (INSET * linear).to_array().map(|value| value.max(1e-10).log2().clamp(LOW, HIGH));
    let x = (Vec3::from(stops) - LOW) / (HIGH - LOW);
    let y = x * (x * (x * (x * (x * (15.5 * x - 40.14) + 31.96) - 6.868) + 0.4298) + 0.1191) - 0.002_32;
    // The curve ends in the codes of a display with a pure exponent of 2.2.
    Vec3::from((OUTSET * y).to_array().map(|value| value.max(0.0).powf(2.2)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use ToneCurve::{Aces, Agx, Filmic};

    fn grey(curve: ToneCurve, value: f64) -> [f64; 3] {
        toned(curve, Vec3::splat(value as f32)).to_array().map(f64::from)
    }

    /// Exposed values from 2⁻¹⁶ to 2⁸, in steps of 1/32 stop.
    fn sweep() -> impl Iterator<Item = f64> {
        (-512..256).map(|step| (f64::from(step) / 32.0).exp2())
    }

    #[test]
    fn black_stays_black_and_greys_grow() {
        for curve in ToneCurve::ALL {
            let black = grey(curve, 0.0);
            assert!(black.iter().all(|value| *value < 1e-6), "{curve:?}: {black:?}");
            let greens: Vec<f64> = sweep().map(|value| grey(curve, value)[1]).collect();
            assert!(greens.is_sorted(), "{curve:?}");
            assert!(greens.last().is_some_and(|white| *white > 0.99), "{curve:?}");
        }
    }

    #[test]
    fn greys_stay_grey() {
        // The rows of the matrices add up to 1: those of ACES to 1e-5, those of AgX to 2.3e-4.
        for (curve, error) in [(ToneCurve::Standard, 0.0), (ToneCurve::None, 0.0), (Filmic, 0.0)]
            .into_iter()
            .chain([(Aces, 3e-5), (Agx, 8e-4)])
        {
            for value in sweep() {
                let [r, g, b] = grey(curve, value);
                let spread = r.max(g).max(b) - r.min(g).min(b);
                assert!(spread <= error, "{curve:?} at {value}: {r} {g} {b}");
            }
        }
    }

    /// Hable's formula as he writes it, in f64.
    #[test]
    fn filmic_is_hables_formula() {
        let [a, b, c, d, e, f, w] = [0.15, 0.50, 0.10, 0.20, 0.02, 0.30, 11.2];
        let tone = |x: f64| ((x * (a * x + c * b) + d * e) / (x * (a * x + b) + d * f)) - e / f;
        for value in sweep() {
            let expected = tone(2.0 * value) / tone(w);
            assert!((grey(Filmic, value)[0] - expected).abs() < 1e-6 * expected.max(1.0), "{value}");
        }
        // Half of the linear white is white.
        assert!((grey(Filmic, 5.6)[0] - 1.0).abs() < 1e-6);
    }

    /// Greys and colours over the sweep.
    fn colours() -> impl Iterator<Item = [f64; 3]> {
        const PARTS: [[f64; 3]; 4] = [[1.0, 1.0, 1.0], [1.0, 0.3, 0.05], [0.02, 1.0, 0.4], [0.2, 0.0, 1.0]];
        sweep().flat_map(|value| PARTS.map(|parts| parts.map(|part| part * value)))
    }

    fn times(rows: [[f64; 3]; 3], v: [f64; 3]) -> [f64; 3] {
        rows.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
    }

    #[track_caller]
    fn assert_near(curve: ToneCurve, linear: [f64; 3], expected: [f64; 3]) {
        let found = toned(curve, Vec3::from(linear.map(|value| value as f32))).to_array();
        for (found, expected) in found.into_iter().zip(expected) {
            assert!((f64::from(found) - expected).abs() < 1e-5, "{linear:?}: {found}, not {expected}");
        }
    }

    /// Hill's code, row by row in f64.
    #[test]
    fn aces_is_hills_fit() {
        let into = [[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]];
        let back =
            [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]];
        let fit = |v: f64| {
            let a = v * (v + 0.024_578_6) - 0.000_090_537;
            let b = v * (0.983_729 * v + 0.432_951_0) + 0.238_081;
            a / b
        };
        for linear in colours() {
            assert_near(Aces, linear, times(back, times(into, linear).map(fit)));
        }
    }

    /// Wrensch's code, row by row in f64, with the polynomial by powers.
    #[test]
    fn agx_is_wrenschs_fit() {
        let inset = [
            [0.842_479_062_253_094, 0.078_433_599_999_999_2, 0.079_223_745_147_764_3],
            [0.042_328_242_261_012_3, 0.878_468_636_469_772, 0.079_166_127_460_543_4],
            [0.042_375_654_905_705_1, 0.078_433_6, 0.879_142_973_793_104],
        ];
        let outset = [
            [1.196_879_005_120_17, -0.098_020_881_140_136_8, -0.099_029_744_079_720_5],
            [-0.052_896_851_757_456_2, 1.151_903_129_904_17, -0.098_961_176_844_843_3],
            [-0.052_971_635_514_443_8, -0.098_043_450_117_124_1, 1.151_073_672_641_16],
        ];
        let terms = [-0.002_32, 0.1191, 0.4298, -6.868, 31.96, -40.14, 15.5];
        let sigmoid = |value: f64| {
            let x = ((value.log2() + 12.473_93) / (4.026_069 + 12.473_93)).clamp(0.0, 1.0);
            (0..).zip(terms).map(|(power, term)| term * x.powi(power)).sum()
        };
        for linear in colours() {
            let expected = times(outset, times(inset, linear).map(sigmoid));
            assert_near(Agx, linear, expected.map(|value| value.max(0.0).powf(2.2)));
        }
        // Middle grey is half of the codes of its display.
        let middle = grey(Agx, 0.18)[1].powf(1.0 / 2.2);
        assert!((middle - 0.5).abs() < 5e-3, "{middle}");
        // A bright red turns towards white.
        let [red, brighter] = [1.0, 16.0].map(|value| toned(Agx, Vec3::new(value, 0.0, 0.0)));
        assert!(brighter.y / brighter.x > 2.0 * red.y / red.x, "{red} {brighter}");
    }
}
