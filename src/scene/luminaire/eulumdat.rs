//! Photometric files of European manufacturers. [Stockmar 1990]

use std::str::FromStr;

use super::ies::{ANGLES, Coordinates, Ies};

/// Lines of the ratios for room indices.
const DIRECT_RATIOS: usize = 10;
/// Lines of a set of lamps, and that of its flux.
const SET_LINES: usize = 6;
const FLUX_LINE: usize = 2;
/// Sets of lamps at most.
const SETS: usize = 20;
/// Angle of the plane C90 in the planes of LM-63. C0 is across the lamps of an EULUMDAT file, and
/// along those of an LM-63 file. [EN 13032-1, LM-63]
pub(super) const C90: f64 = 90.0;

/// The lines of a file.
struct Lines<'a> {
    lines: std::iter::Enumerate<std::str::Lines<'a>>,
    /// Numbers of the last line that are not read yet, for lists.
    rest: std::str::SplitWhitespace<'a>,
    number: usize,
}

impl<'a> Lines<'a> {
    fn line(&mut self, what: &str) -> Result<&'a str, String> {
        let (index, line) = self.lines.next().ok_or_else(|| format!("ends before the {what}"))?;
        self.number = index + 1;
        Ok(line.trim())
    }

    fn skip(&mut self, count: usize, what: &str) -> Result<(), String> {
        (0..count).try_for_each(|_| self.line(what).map(drop))
    }

    /// A number that is alone in its line.
    fn value<T: FromStr>(&mut self, what: &str) -> Result<T, String> {
        let line = self.line(what)?;
        self.parsed(line, what)
    }

    fn parsed<T: FromStr>(&self, word: &str, what: &str) -> Result<T, String> {
        // The decimal sign is a comma in some countries.
        let fault = |_| format!("has {word:?} as {what} in line {}: expected a number", self.number);
        word.replace(',', ".").parse().map_err(fault)
    }

    fn finite(&mut self, word: &str, what: &str) -> Result<f64, String> {
        let value: f64 = self.parsed(word, what)?;
        match value.is_finite() {
            true => Ok(value),
            false => Err(format!("has {word:?} as {what} in line {}: expected a number", self.number)),
        }
    }

    fn count(&mut self, what: &str, most: usize) -> Result<usize, String> {
        let count: usize = self.value(what)?;
        match (1..=most).contains(&count) {
            true => Ok(count),
            false => Err(self.fault(count, what, &format!("1 to {most}"))),
        }
    }

    fn positive(&mut self, what: &str) -> Result<f64, String> {
        let line = self.line(what)?;
        let value = self.finite(line, what)?;
        if value > 0.0 { Ok(value) } else { Err(self.fault(value, what, "a number above 0")) }
    }

    fn fault(&self, found: impl std::fmt::Display, what: &str, expected: &str) -> String {
        format!("has {found} as {what} in line {}: expected {expected}", self.number)
    }

    /// Numbers of a list, one or several in a line.
    fn list(&mut self, count: usize, what: &str) -> Result<Vec<f64>, String> {
        let mut next = || loop {
            match self.rest.next() {
                Some(word) => return self.finite(word, what),
                None => self.rest = self.line(what)?.split_whitespace(),
            }
        };
        (0..count).map(|_| next()).collect()
    }

    fn angles(&mut self, count: usize, what: &str) -> Result<Vec<f64>, String> {
        let angles = self.list(count, what)?;
        match angles.windows(2).find(|pair| pair[0] >= pair[1]) {
            Some(pair) => Err(format!(
                "has the {what} {} after {} before line {}: they must increase",
                pair[1], pair[0], self.number
            )),
            None => Ok(angles),
        }
    }
}

/// Which planes a file has.
#[derive(Clone, Copy)]
enum Symmetry {
    None,
    /// About the axis: the plane C0 stands for all.
    Axis,
    /// The plane C0–C180 is a mirror: planes from C0 to C180.
    C0,
    /// The plane C90–C270 is a mirror: planes from C270 over C0 to C90.
    C90,
    /// Both are: planes from C0 to C90.
    Both,
}

impl Symmetry {
    /// Index of the first plane, and the number of planes. `count` is that of the circle.
    fn planes(self, count: usize) -> (usize, usize) {
        match self {
            Self::None => (0, count),
            Self::Axis => (0, 1),
            Self::C0 => (0, count / 2 + 1),
            Self::C90 => (3 * count / 4, count / 2 + 1),
            Self::Both => (0, count / 4 + 1),
        }
    }

    /// The angles of planes that equal the one at `angle`, degrees.
    fn mirrored(self, angle: f64) -> Vec<f64> {
        let all = match self {
            Self::None | Self::Axis => vec![angle],
            Self::C0 => vec![angle, -angle],
            Self::C90 => vec![angle, 180.0 - angle],
            Self::Both => vec![angle, -angle, 180.0 - angle, 180.0 + angle],
        };
        all.into_iter().map(|angle| angle.rem_euclid(360.0)).collect()
    }

    /// What the number of planes is a multiple of.
    fn divisor(self) -> usize {
        match self {
            Self::None | Self::Axis => 1,
            Self::C0 => 2,
            Self::C90 | Self::Both => 4,
        }
    }
}

/// Whether a text may be an EULUMDAT file: its second and third lines are the kind of the luminaire
/// and the symmetry.
pub(super) fn is_eulumdat(text: &str) -> bool {
    let mut lines = text.lines().skip(1).map(|line| line.trim().parse::<u32>());
    matches!((lines.next(), lines.next()), (Some(Ok(0..=3)), Some(Ok(_))))
}

/// Reads the text of a file. The intensities are those of its first set of lamps.
pub(super) fn read(text: &str) -> Result<Ies, String> {
    let lines = text.lines().enumerate();
    let mut lines = Lines { lines, rest: "".split_whitespace(), number: 0 };
    lines.skip(2, "kind of luminaire")?;
    let symmetry = match lines.value("symmetry")? {
        0_u32 => Symmetry::None,
        1 => Symmetry::Axis,
        2 => Symmetry::C0,
        3 => Symmetry::C90,
        4 => Symmetry::Both,
        other => return Err(lines.fault(other, "symmetry", "0 to 4")),
    };
    let plane_count = lines.count("number of planes", ANGLES)?;
    if plane_count % symmetry.divisor() != 0 {
        let expected = format!("a multiple of {} with this symmetry", symmetry.divisor());
        return Err(lines.fault(plane_count, "number of planes", &expected));
    }
    lines.skip(1, "distance of the planes")?;
    let angle_count = lines.count("number of angles", ANGLES)?;
    // Distance of the angles, texts, sizes, and ratios that follow from the intensities.
    lines.skip(17, "conversion factor")?;
    let conversion = lines.positive("conversion factor")?;
    lines.skip(1, "tilt")?;
    let sets = lines.count("number of lamp sets", SETS)?;
    lines.skip(FLUX_LINE, "flux of the lamps")?;
    let flux_lm = lines.positive("flux of the lamps")?;
    lines.skip(sets * SET_LINES - FLUX_LINE - 1, "lamp sets")?;
    lines.skip(DIRECT_RATIOS, "direct ratios")?;
    let planes = lines.angles(plane_count, "plane")?;
    let vertical = lines.angles(angle_count, "angle")?;
    // The file states cd for 1000 lm of the lamps. The losses of the luminaire are in them.
    let factor = conversion * flux_lm / 1000.0;
    let (first, count) = symmetry.planes(plane_count);
    let mut circle: Vec<(f64, Vec<f64>)> = Vec::new();
    for index in first..first + count {
        let values = lines.list(angle_count, "intensity")?;
        let candela: Vec<f64> = values.into_iter().map(|value| (factor * value).max(0.0)).collect();
        for angle in symmetry.mirrored(planes[index % plane_count]) {
            if !circle.iter().any(|(known, _)| (known - angle).abs() < 1e-6) {
                circle.push((angle, candela.clone()));
            }
        }
    }
    circle.sort_by(|a, b| a.0.total_cmp(&b.0));
    if circle.len() > 1 {
        circle.push((circle[0].0 + 360.0, circle[0].1.clone()));
    }
    let (horizontal, candela) = circle.into_iter().unzip();
    Ies { coordinates: Coordinates::C, vertical, horizontal, candela, c0: C90 }.checked()
}

#[cfg(test)]
mod tests {
    use super::super::Profile;
    use super::*;
    use std::f64::consts::PI;

    /// A file with `planes` in the circle and an angle each 5 degrees up to `widest`. `intensity`
    /// is in cd for 1000 lm of angle and plane, degrees. The lamps have 2000 lm.
    fn file(symmetry: u32, planes: usize, widest: usize, intensity: impl Fn(f64, f64) -> f64) -> String {
        let angles = widest / 5 + 1;
        let mut text = format!("Maker\r\n3\r\n{symmetry}\r\n{planes}\r\n15\r\n{angles}\r\n5\r\n");
        // Report, name, number, file, date; nine sizes; fractions of the flux.
        text += &format!("R\r\nLicht \u{fc}ber 5\r\n\r\nf.ldt\r\n\r\n{}100\r\n80\r\n", "600\r\n".repeat(9));
        text += "1,0\r\n0\r\n2\r\n1\r\nLED\r\n2000\r\n3000 K\r\n1B\r\n20,5\r\n2\r\nLED\r\n9\r\n\r\n\r\n\r\n";
        text += &"0.5\r\n".repeat(DIRECT_RATIOS);
        let all: Vec<f64> = (0..planes).map(|plane| 360.0 * plane as f64 / planes as f64).collect();
        all.iter().for_each(|plane| text += &format!("{plane}\r\n"));
        (0..angles).for_each(|angle| text += &format!("{}\r\n", 5 * angle));
        let (first, count) = [Symmetry::None, Symmetry::Axis, Symmetry::C0, Symmetry::C90, Symmetry::Both]
            [symmetry as usize]
            .planes(planes);
        for index in first..first + count {
            for angle in 0..angles {
                let value = intensity(5.0 * angle as f64, all[index % planes]);
                text += &format!("{}\r\n", value.to_string().replace('.', ","));
            }
        }
        text
    }

    fn profile(text: &str) -> Profile {
        Profile::from_bytes(text.as_bytes()).unwrap_or_else(|why| panic!("{why}"))
    }

    #[test]
    fn fluxes_are_closed_forms() {
        let even = profile(&file(1, 24, 180, |_, _| 7.0));
        assert_eq!((even.columns, even.peak_candela), (1, 14.0));
        assert!((even.peak_candela * even.steradians() - 14.0 * 4.0 * PI).abs() < 1e-9);
        // A Lambertian panel: π times its peak. Linear interpolation loses h²/12 of it: 6e-4.
        let panel = profile(&file(1, 1, 90, |angle, _| 100.0 * angle.to_radians().cos()));
        let flux = panel.peak_candela * panel.steradians();
        assert!((flux / (200.0 * PI) - 1.0).abs() < 7e-4, "{flux}");
    }

    /// A symmetry with an intensity that has it, of angle and plane.
    type Case<'a> = (u32, &'a dyn Fn(f64, f64) -> f64);

    /// Files that leave planes out are the same as the whole matrix.
    #[test]
    fn symmetries_are_those_of_the_whole_matrix() {
        let c0 = |angle: f64, plane: f64| 3.0 + angle.to_radians().sin() * plane.to_radians().cos();
        let c90 = |angle: f64, plane: f64| 3.0 + angle.to_radians().sin() * plane.to_radians().sin();
        let both = |angle: f64, plane: f64| 3.0 + angle.to_radians().sin() * (2.0 * plane.to_radians()).cos();
        let axis = |angle: f64, _: f64| 3.0 + angle.to_radians().cos();
        let cases: [Case<'_>; 4] = [(1, &axis), (2, &c0), (3, &c90), (4, &both)];
        for (symmetry, intensity) in cases {
            let whole = profile(&file(0, 24, 90, intensity));
            let part = profile(&file(symmetry, 24, 90, intensity));
            for (axial, around) in (0..600).map(|i| (f64::from(i % 20) * 0.08, f64::from(i) * 0.37)) {
                let [a, b] = [&whole, &part].map(|profile| profile.fraction(axial, around));
                assert!((a - b).abs() < 1e-6, "{symmetry}: {a}, {b} at {axial}, {around}");
            }
        }
    }

    /// A luminaire with most light across its lamps, in both formats.
    #[test]
    fn planes_are_those_of_the_same_luminaire_in_lm63() {
        // Across the lamps: C0 here, 90 degrees there. Both count to the same side.
        let across = |angle: f64, from_across: f64| {
            (5.0 + angle.to_radians().sin()
                * (from_across.to_radians().cos() + 0.5 * from_across.to_radians().sin()))
            .round()
        };
        let here = profile(&file(0, 24, 90, across));
        let mut ies = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 2 19 25 1 2 0 0 0\n1 1 10\n".to_owned();
        let words = |count: u32, step: f64| (0..count).map(move |i| (step * f64::from(i)).to_string());
        ies += &(words(19, 5.0).collect::<Vec<_>>().join(" ") + "\n");
        ies += &(words(25, 15.0).collect::<Vec<_>>().join(" ") + "\n");
        for plane in 0..25 {
            let value =
                |angle: u32| across(5.0 * f64::from(angle), 15.0 * f64::from(plane) + 90.0).to_string();
            ies += &((0..19).map(value).collect::<Vec<_>>().join(" ") + "\n");
        }
        let there = profile(&ies);
        assert_eq!(here, there);
        assert!(here.fraction(1.5, 0.0) != here.fraction(1.5, 0.5 * PI), "the planes differ");
    }

    #[test]
    fn faults_name_their_line() {
        let good = file(2, 4, 90, |_, _| 1.0);
        let with = |line: usize, text: &str| {
            let mut lines: Vec<&str> = good.lines().collect();
            lines[line - 1] = text;
            Profile::from_bytes(lines.join("\n").as_bytes()).map(drop)
        };
        assert_eq!(with(1, "another maker"), Ok(()));
        for (line, text, word) in [
            (3, "5", "5 as symmetry in line 3: expected 0 to 4"),
            (4, "0", "0 as number of planes in line 4"),
            (4, "x", "\"x\" as number of planes in line 4: expected a number"),
            (4, "5", "in line 4: expected a multiple of 2"),
            (6, "5000", "in line 6: expected 1 to 2000"),
            (24, "0", "0 as conversion factor in line 24"),
            (26, "0", "number of lamp sets in line 26"),
            (29, "", "as flux of the lamps in line 29"),
            (29, "-3", "flux of the lamps in line 29: expected a number above 0"),
            (50, "0", "they must increase"),
            (80, "NaN", "\"NaN\" as intensity in line 80"),
        ] {
            let fault = with(line, text).unwrap_err();
            assert!(fault.contains(word), "line {line}, {text:?}: {fault}");
        }
        let short: String = good.lines().take(90).flat_map(|line| [line, "\n"]).collect();
        let fault = Profile::from_bytes(short.as_bytes()).unwrap_err();
        assert_eq!(fault, "ends before the intensity");
        let fault = Profile::from_bytes(b"Maker\nround\n1\n").unwrap_err();
        assert!(fault.contains("TILT") && fault.contains("EULUMDAT"), "{fault}");
    }
}
