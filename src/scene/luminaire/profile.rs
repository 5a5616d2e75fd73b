//! The intensity of a luminaire as the device reads it: an even grid of angles.

use std::f64::consts::TAU;

use super::eulumdat;
use super::ies::{Coordinates, Ies};

/// Smallest spacing of angles, degrees: of the angle from the axis, and about it.
const FINEST: [f64; 2] = [0.25, 1.0];
/// Spacing of both angles of a floodlight, degrees, whose own angles are others.
const OF_FLOODLIGHT: [f64; 2] = [1.0, 5.0];

/// Intensity in each direction over the largest one, bilinear between the nodes of a grid.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    /// Nodes from the axis to [`Self::widest`], at least two.
    pub rows: u32,
    /// Nodes about the axis, without a repetition of the first; 1: symmetric about the axis.
    pub columns: u32,
    /// Largest angle from the axis at which the file states an intensity, radians.
    pub widest: f32,
    /// Fractions, 0..=1, a column at a time, from the plane C0 on.
    pub fractions: Vec<f32>,
    /// Largest intensity, cd.
    pub peak_candela: f64,
}

impl Profile {
    /// Reads a photometric file of any edition and type. [LM-63]
    ///
    /// # Errors
    /// A clause about the file.
    pub fn from_ies(bytes: &[u8]) -> Result<Self, String> {
        Self::new(&Ies::read(&String::from_utf8_lossy(bytes).replace('\r', "\n"))?)
    }

    /// Reads a photometric file of LM-63 or EULUMDAT. The content decides, not the name.
    ///
    /// # Errors
    /// A clause about the file.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, String> {
        // Texts in the file may have any 8-bit encoding.
        let text = String::from_utf8_lossy(bytes).replace("\r\n", "\n").replace('\r', "\n");
        let has_tilt = text.lines().any(|line| line.trim_start().to_ascii_uppercase().starts_with("TILT"));
        if !has_tilt && eulumdat::is_eulumdat(&text) {
            return Self::new(&eulumdat::read(&text)?);
        }
        Self::from_ies(bytes)
    }

    fn new(ies: &Ies) -> Result<Self, String> {
        let [widest, row_step, column_step] = match ies.coordinates {
            Coordinates::C => {
                let widest = ies.vertical[ies.vertical.len() - 1];
                [widest, spacing(&ies.vertical, FINEST[0]), spacing(&ies.horizontal, FINEST[1])]
            }
            _ => [90.0, OF_FLOODLIGHT[0], OF_FLOODLIGHT[1]],
        };
        let rows = (widest / row_step).round().max(1.0) as u32 + 1;
        let columns = if ies.horizontal.len() == 1 && ies.coordinates == Coordinates::C {
            1
        } else {
            (360.0 / column_step).round() as u32
        };
        let angles = (0..columns).flat_map(|column| {
            let around = 360.0 * f64::from(column) / f64::from(columns);
            (0..rows).map(move |row| (widest * f64::from(row) / f64::from(rows - 1), around))
        });
        let candela: Vec<f64> = angles.map(|(axial, around)| ies.intensity(axial, around)).collect();
        let peak_candela = candela.iter().fold(0.0, |peak: f64, value| peak.max(*value));
        if peak_candela == 0.0 {
            return Err(format!("has no intensity at angles {row_step}° apart"));
        }
        let fractions = candela.iter().map(|value| (value / peak_candela) as f32).collect();
        Ok(Self { rows, columns, widest: widest.to_radians() as f32, fractions, peak_candela })
    }

    /// Integral of the fraction over all directions, sr: the flux over the largest intensity.
    pub fn steradians(&self) -> f64 {
        self.grid().steradians()
    }

    /// Fraction at an angle from the axis and one about it from the plane C0, radians.
    pub fn fraction(&self, axial: f64, around: f64) -> f64 {
        self.grid().fraction(axial, around)
    }

    /// The grid of fractions.
    pub(crate) fn grid(&self) -> Grid<'_> {
        let Self { rows, columns, widest, fractions, .. } = self;
        Grid { rows: *rows, columns: *columns, widest: (*widest).into(), fractions }
    }
}

/// Nodes of a [`Profile`], or of the device's copy.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Grid<'a> {
    pub(crate) rows: u32,
    pub(crate) columns: u32,
    /// Angle from the axis of the last row, radians.
    pub(crate) widest: f64,
    pub(crate) fractions: &'a [f32],
}

impl Grid<'_> {
    /// Integral of the fraction over all directions, sr.
    pub(crate) fn steradians(&self) -> f64 {
        let step = self.widest / f64::from(self.rows - 1);
        let ring = |(row, pair): (usize, &[f32])| {
            let [from, to] = [row as f64 * step, (row + 1) as f64 * step];
            let [before, after] = [pair[0], pair[1]].map(f64::from);
            // ∫ of the linear function times the sine, by parts.
            before * from.cos() - after * to.cos() + (after - before) / step * (to.sin() - from.sin())
        };
        let plane = |fractions: &[f32]| fractions.windows(2).enumerate().map(ring).sum::<f64>();
        let planes = self.fractions.chunks(self.rows as usize).map(plane);
        TAU * planes.sum::<f64>() / f64::from(self.columns)
    }

    /// The bilinear fraction at these angles, radians. Mirrors `glsl/include/lights.glsl`.
    pub(crate) fn fraction(&self, axial: f64, around: f64) -> f64 {
        if axial > self.widest {
            return 0.0;
        }
        let at = |place: u32| f64::from(self.fractions[place as usize]);
        let row = axial / self.widest * f64::from(self.rows - 1);
        let low = (row as u32).min(self.rows - 2);
        let column = (around / TAU).rem_euclid(1.0) * f64::from(self.columns);
        let first = (column as u32).min(self.columns - 1);
        let second = if first + 1 == self.columns { 0 } else { first + 1 };
        let of_column = |column: u32| {
            let place = column * self.rows + low;
            let weight = row - f64::from(low);
            (1.0 - weight) * at(place) + weight * at(place + 1)
        };
        let weight = column - f64::from(first);
        (1.0 - weight) * of_column(first) + weight * of_column(second)
    }
}

/// The finest spacing of a list of angles, so that an even list is met.
fn spacing(angles: &[f64], finest: f64) -> f64 {
    let steps = angles.windows(2).map(|pair| pair[1] - pair[0]);
    steps.fold(180.0, f64::min).max(finest)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// A file with that intensity, cd, at each pair of vertical and horizontal angle, degrees.
    fn file(kind: u32, vertical: &[f64], horizontal: &[f64], intensity: impl Fn(f64, f64) -> f64) -> String {
        let words = |numbers: &[f64]| numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
        let mut text = format!(
            "IESNA:LM-63-2002\r\n[TEST] closed form\r\nTILT=NONE\r\n1 -1 1 {} {} {kind} 2 0 0 0\r\n1 1.0001 10\r\n{}\r\n{}\r\n",
            vertical.len(),
            horizontal.len(),
            words(vertical),
            words(horizontal)
        );
        for around in horizontal {
            let plane: Vec<f64> = vertical.iter().map(|axial| intensity(*axial, *around)).collect();
            text += &format!("{}\r\n", words(&plane));
        }
        text
    }

    fn steps(from: f64, to: f64, count: usize) -> Vec<f64> {
        (0..=count).map(|step| from + (to - from) * step as f64 / count as f64).collect()
    }

    fn read(text: &str) -> Profile {
        Profile::from_ies(text.as_bytes()).unwrap()
    }

    #[test]
    fn fluxes_are_closed_forms() {
        let even = read(&file(1, &steps(0.0, 180.0, 36), &[0.0], |_, _| 7.0));
        assert!((even.peak_candela * even.steradians() - 7.0 * 4.0 * PI).abs() < 1e-9);
        // A Lambertian panel of 100 cd: π·100 lm. Linear interpolation loses h²/12 of it.
        let panel =
            read(&file(1, &steps(0.0, 90.0, 36), &[0.0], |axial, _| 100.0 * axial.to_radians().cos()));
        let flux = panel.peak_candela * panel.steradians();
        assert!((flux / (100.0 * PI) - 1.0).abs() < 3e-4, "{flux}");
        // One half of the circle is dark: 181 of 360 planes are lit.
        let half = |_: f64, around: f64| if around <= 180.0 { 1.0 } else { 0.0 };
        let half = read(&file(1, &steps(0.0, 180.0, 18), &steps(0.0, 360.0, 360), half));
        let lit = 4.0 * PI * 181.0 / 360.0;
        assert!((half.steradians() / lit - 1.0).abs() < 1e-6, "{}", half.steradians());
    }

    #[test]
    fn parts_of_the_circle_are_completed() {
        let cosine =
            |axial: f64, around: f64| 2.0 + axial.to_radians().sin() * (2.0 * around.to_radians()).cos();
        let vertical = steps(0.0, 90.0, 9);
        let whole = read(&file(1, &vertical, &steps(0.0, 360.0, 24), cosine));
        for horizontal in
            [steps(0.0, 90.0, 6), steps(0.0, 180.0, 12), steps(90.0, 270.0, 12), steps(0.0, 345.0, 23)]
        {
            let part = read(&file(1, &vertical, &horizontal, cosine));
            assert_eq!((part.rows, part.columns), (whole.rows, whole.columns));
            let error = part.fractions.iter().zip(&whole.fractions).map(|(a, b)| (a - b).abs());
            assert!(error.fold(0.0, f32::max) < 1e-6, "{horizontal:?}");
        }
        // Another mirror plane.
        let sine = |axial: f64, around: f64| 2.0 + axial.to_radians().sin() * around.to_radians().sin();
        let whole = read(&file(1, &vertical, &steps(0.0, 360.0, 24), sine));
        let part = read(&file(1, &vertical, &steps(90.0, 270.0, 12), sine));
        let error = part.fractions.iter().zip(&whole.fractions).map(|(a, b)| (a - b).abs());
        assert!(error.fold(0.0, f32::max) < 1e-6);
    }

    #[test]
    fn uneven_angles_keep_their_intensities() {
        let vertical = [0.0, 2.5, 5.0, 10.0, 20.0, 40.0, 90.0];
        let profile = read(&file(1, &vertical, &[0.0], |axial, _| 100.0 - axial));
        for axial in [0.0_f64, 3.0, 17.0, 66.0, 90.0] {
            let found = profile.fraction(axial.to_radians(), 1.0) * profile.peak_candela;
            assert!((found - (100.0 - axial)).abs() < 1e-3, "{axial}: {found}");
        }
        assert_eq!(profile.fraction(91.0_f64.to_radians(), 0.0), 0.0);
        // A light to the upper side alone.
        let up = read(&file(1, &steps(90.0, 180.0, 18), &[0.0], |_, _| 5.0));
        assert_eq!((up.fraction(1.0, 0.0), up.fraction(2.0, 0.0)), (0.0, 1.0));
    }

    /// A beam along the axis is the same in all coordinates.
    #[test]
    fn floodlights_are_turned_to_their_axis() {
        let beam = |cosine: f64| 1000.0 * cosine.max(0.0).powi(8);
        let angles = steps(-90.0, 90.0, 90);
        let cosines = |vertical: f64, horizontal: f64| {
            beam(vertical.to_radians().cos() * horizontal.to_radians().cos())
        };
        for kind in [2, 3] {
            for horizontal in [&angles[..], &angles[45..]] {
                let flood = read(&file(kind, &angles, horizontal, cosines));
                for (axial, around) in [(0.0_f64, 0.0), (0.3, 1.0), (0.8, 4.0), (1.4, 2.0)] {
                    let found = flood.fraction(axial, around) * flood.peak_candela;
                    assert!((found - beam(axial.cos())).abs() < 3.0, "{kind}, {axial}: {found}");
                }
            }
        }
        // A light to the right of the axis alone, and one above it.
        let right = read(&file(2, &angles, &angles, |_, h| if h > 0.0 { 1.0 } else { 0.0 }));
        assert!(right.fraction(0.5, 0.0) > 0.99 && right.fraction(0.5, PI) < 0.01);
        let above = read(&file(3, &angles, &angles, |v, _| if v > 0.0 { 1.0 } else { 0.0 }));
        assert!(above.fraction(0.5, 0.5 * PI) > 0.99 && above.fraction(0.5, 1.5 * PI) < 0.01);
    }

    #[test]
    fn all_factors_apply_and_editions_differ() {
        let text = |head: &str| {
            format!(
                "{head}TILT=INCLUDE\n1\n3\n0 45 90\n1 0.9 0.8\n1 1000 2.0\n2 1 1 1 0,0,0\n0.9 0.5 10\n0 90\n0\n10 10\n"
            )
        };
        assert!((read(&text("")).peak_candela - 10.0 * 2.0 * 0.9 * 0.5).abs() < 1e-9);
        assert!((read(&text("IESNA:LM-63-2019\n")).peak_candela - 10.0 * 2.0 * 0.9).abs() < 1e-9);
    }

    #[test]
    fn faults_are_named() {
        let fault = |text: &str| Profile::from_ies(text.as_bytes()).unwrap_err();
        assert!(fault("solid").contains("TILT"));
        let good = file(1, &[0.0, 90.0], &[0.0], |_, _| 1.0);
        assert!(fault(&good.replace("\r\n1 1\r\n", "\r\n1\r\n")).contains("ends before the intensity"));
        assert!(fault(&good.replace("0 90\r\n", "90 0\r\n")).contains("increase"));
        assert!(fault(&good.replace("1 -1 1 2", "1 -1 1 2.5")).contains("integer"));
        assert!(fault(&good.replace("\r\n1 1\r\n", "\r\n0 0\r\n")).contains("largest intensity"));
        assert!(fault(&good.replace("\r\n1 1\r\n", "\r\n1 x\r\n")).contains("expected a number"));
        assert!(fault(&file(1, &[10.0, 90.0], &[0.0], |_, _| 1.0)).contains("vertical angles"));
        assert!(fault(&file(1, &[0.0, 90.0], &[0.0, 45.0], |_, _| 1.0)).contains("horizontal angles"));
        let spike = |axial: f64, _: f64| if axial == 0.05 { 1.0 } else { 0.0 };
        assert!(fault(&file(1, &[0.0, 0.05, 0.1, 90.0], &[0.0], spike)).contains("0.25° apart"));
        // Line ends of old systems.
        assert!(Profile::from_ies(good.replace("\r\n", "\r").as_bytes()).is_ok());
    }
}
