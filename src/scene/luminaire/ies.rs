//! Photometric files of the Illuminating Engineering Society. [LM-63]

use std::iter::Peekable;
use std::str::SplitWhitespace;

/// Angles of a file at most, in each of both coordinates.
pub(super) const ANGLES: usize = 2000;

/// Coordinates of a file's angles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Coordinates {
    /// Vertical angle from the axis, horizontal angle about it.
    C,
    /// The polar axis is horizontal: vertical angle about it, horizontal angle from its equator.
    B,
    /// The polar axis is vertical: horizontal angle about it, vertical angle from its equator.
    A,
}

/// What a file states.
#[derive(Clone, Debug)]
pub(super) struct Ies {
    pub(super) coordinates: Coordinates,
    /// Vertical angles, degrees, increasing.
    pub(super) vertical: Vec<f64>,
    /// Horizontal angles, degrees, increasing.
    pub(super) horizontal: Vec<f64>,
    /// cd, one list of vertical angles for each horizontal angle. All factors are applied.
    pub(super) candela: Vec<Vec<f64>>,
    /// Angle of the first plane of LM-63 in the planes of the file, degrees.
    pub(super) c0: f64,
}

/// The numbers behind the line TILT.
struct Numbers<'a>(Peekable<SplitWhitespace<'a>>);

impl Numbers<'_> {
    fn next(&mut self, what: &str) -> Result<f64, String> {
        let word = self.0.next().ok_or_else(|| format!("ends before the {what}"))?;
        let number = word.parse::<f64>().ok().filter(|number| number.is_finite());
        number.ok_or_else(|| format!("has {word:?} as {what}: expected a number"))
    }

    fn count(&mut self, what: &str) -> Result<usize, String> {
        let number = self.next(what)?;
        if number.fract() != 0.0 || !(1.0..=ANGLES as f64).contains(&number) {
            return Err(format!("has {number} as {what}: expected an integer from 1 to {ANGLES}"));
        }
        Ok(number as usize)
    }

    fn list(&mut self, count: usize, what: &str) -> Result<Vec<f64>, String> {
        (0..count).map(|_| self.next(what)).collect()
    }

    fn angles(&mut self, count: usize, what: &str) -> Result<Vec<f64>, String> {
        let angles = self.list(count, what)?;
        match angles.windows(2).find(|pair| pair[0] >= pair[1]) {
            Some(pair) => Err(format!("has the {what} {} after {}: they must increase", pair[1], pair[0])),
            None => Ok(angles),
        }
    }
}

impl Ies {
    /// Reads the text of a file of any edition.
    pub(super) fn read(text: &str) -> Result<Self, String> {
        // The first edition has no head line.
        let head = text.lines().next().unwrap_or_default();
        let states_generation = ["2002", "2019"].iter().any(|year| head.contains(year));
        let mut rest = text;
        let tilt = loop {
            let (line, after) =
                rest.split_once('\n').ok_or("is no photometric file: it has neither the line `TILT=` of LM-63, nor kind and symmetry of EULUMDAT as second and third line")?;
            rest = after;
            let line = line.trim().to_ascii_uppercase();
            if let Some(tilt) = line.strip_prefix("TILT") {
                break tilt.trim_start_matches([' ', '=']).to_owned();
            }
        };
        let separated = rest.replace(',', " ");
        let mut numbers = Numbers(separated.split_whitespace().peekable());
        if tilt == "INCLUDE" {
            // How the lamp's light depends on its tilt. A luminaire is used as it was measured.
            numbers.next("lamp's orientation")?;
            let count = numbers.count("number of tilts")?;
            numbers.list(2 * count, "tilt")?;
        }
        numbers.list(2, "number and flux of the lamps")?;
        let mut factor = numbers.next("factor of the intensities")?;
        let vertical_count = numbers.count("number of vertical angles")?;
        let horizontal_count = numbers.count("number of horizontal angles")?;
        let kind = numbers.next("photometric type")?;
        let coordinates = match kind {
            1.0 => Coordinates::C,
            2.0 => Coordinates::B,
            3.0 => Coordinates::A,
            _ => return Err(format!("has {kind} as photometric type: expected 1, 2 or 3")),
        };
        numbers.list(4, "unit and size of the luminaire")?;
        factor *= numbers.next("ballast factor")?;
        // From 2002 on the next number tells how the file was made.
        let ballast_lamp = numbers.next("ballast-lamp factor")?;
        factor *= if states_generation { 1.0 } else { ballast_lamp };
        numbers.next("input power")?;
        let vertical = numbers.angles(vertical_count, "vertical angle")?;
        let horizontal = numbers.angles(horizontal_count, "horizontal angle")?;
        let plane = |_| {
            let plane = numbers.list(vertical_count, "intensity")?;
            Ok(plane.into_iter().map(|value| (factor * value).max(0.0)).collect())
        };
        let candela = (0..horizontal_count).map(plane).collect::<Result<Vec<Vec<f64>>, String>>()?;
        Self { coordinates, vertical, horizontal, candela, c0: 0.0 }.checked()
    }

    pub(super) fn checked(self) -> Result<Self, String> {
        let peak = self.candela.iter().flatten().fold(0.0, |peak: f64, value| peak.max(*value));
        if !(peak > 0.0 && peak <= 1e15) {
            return Err(format!("has {peak} cd as largest intensity: expected above 0 and at most 1e15"));
        }
        let [first, last] = ends(&self.vertical);
        let is_right = match self.coordinates {
            Coordinates::C => (first == 0.0 || first == 90.0) && last <= 180.0 && last > first,
            Coordinates::A | Coordinates::B => first >= -90.0 && last <= 90.0,
        };
        if !is_right {
            return Err(format!("has vertical angles from {first} to {last}: expected 0 to 90 or 180"));
        }
        let [first, last] = ends(&self.horizontal);
        let is_right = match self.coordinates {
            Coordinates::C => {
                self.horizontal.len() == 1
                    || (first == 0.0 && [90.0, 180.0, 360.0].contains(&last))
                    || (first == 0.0 && last > 180.0 && last < 360.0)
                    || (first == 90.0 && last == 270.0)
            }
            Coordinates::A | Coordinates::B => (first == 0.0 || first >= -90.0) && last <= 90.0,
        };
        if !is_right {
            let expected = "expected one, or 0 to 90, 180 or 360, or 90 to 270";
            return Err(format!("has horizontal angles from {first} to {last}: {expected}"));
        }
        Ok(self)
    }

    /// Intensity in a direction, cd. `axial`: angle from the axis; `around`: about it; degrees.
    pub(super) fn intensity(&self, axial: f64, around: f64) -> f64 {
        let [vertical, horizontal] = match self.coordinates {
            Coordinates::C => [axial, self.folded((around + self.c0).rem_euclid(360.0))],
            other => of_floodlight(other, axial, around, self.horizontal[0] >= 0.0),
        };
        let Some([(low, plane_weight), (high, _)]) = self.planes(horizontal) else { return 0.0 };
        let Some([(below, weight), (above, _)]) = neighbours(&self.vertical, vertical) else { return 0.0 };
        let of_plane = |plane: usize| {
            let plane = &self.candela[plane];
            weight * plane[below] + (1.0 - weight) * plane[above]
        };
        plane_weight * of_plane(low) + (1.0 - plane_weight) * of_plane(high)
    }

    /// The planes beside a horizontal angle. The last one of a full circle may be left out.
    fn planes(&self, horizontal: f64) -> Option<[(usize, f64); 2]> {
        let last = self.horizontal.len() - 1;
        let end = self.horizontal[last];
        if self.coordinates == Coordinates::C && end > 180.0 && horizontal > end {
            let above = (horizontal - end) / (360.0 - end);
            return Some([(last, 1.0 - above), (0, above)]);
        }
        neighbours(&self.horizontal, horizontal)
    }

    /// The horizontal angle, 0 to 360 degrees, in the part that the file states.
    fn folded(&self, angle: f64) -> f64 {
        let [first, last] = ends(&self.horizontal);
        if self.horizontal.len() == 1 {
            return first;
        }
        let half = if angle > 180.0 { 360.0 - angle } else { angle };
        match last {
            90.0 => half.min(180.0 - half),
            180.0 => half,
            _ if first == 90.0 => {
                if angle < 90.0 {
                    180.0 - angle
                } else if angle > 270.0 {
                    540.0 - angle
                } else {
                    angle
                }
            }
            _ => angle,
        }
    }
}

/// Vertical and horizontal angle of a floodlight, degrees, of which both are zero on its axis. A
/// file with horizontal angles from 0 on is symmetric.
fn of_floodlight(coordinates: Coordinates, axial: f64, around: f64, is_symmetric: bool) -> [f64; 2] {
    let (sin, cos) = axial.to_radians().sin_cos();
    let (up, side) = around.to_radians().sin_cos();
    // The axis, to the side, up.
    let [z, x, y] = [cos, sin * side, sin * up];
    let [vertical, horizontal] = match coordinates {
        Coordinates::A => [y.asin(), x.atan2(z)],
        _ => [y.atan2(z), x.asin()],
    };
    let horizontal = horizontal.to_degrees();
    [vertical.to_degrees(), if is_symmetric { horizontal.abs() } else { horizontal }]
}

fn ends(angles: &[f64]) -> [f64; 2] {
    [angles[0], angles[angles.len() - 1]]
}

/// The entries beside an angle with their weights. `None` outside of the list.
fn neighbours(angles: &[f64], angle: f64) -> Option<[(usize, f64); 2]> {
    let [first, last] = ends(angles);
    if !(first - 1e-9..=last + 1e-9).contains(&angle) {
        return None;
    }
    let above = angles.partition_point(|known| *known <= angle).min(angles.len() - 1);
    let below = above.saturating_sub(1);
    let weight = match angles[above] - angles[below] {
        0.0 => 1.0,
        width => ((angles[above] - angle) / width).clamp(0.0, 1.0),
    };
    Some([(below, weight), (above, 1.0 - weight)])
}
