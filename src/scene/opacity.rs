//! Opacity micromaps, as `VK_EXT_opacity_micromap` has them: the holes of triangles.
//!
//! A micromap divides each edge of its triangle into 2^level parts, and the triangle into 4^level
//! micro-triangles. Each is surface or a hole. In row r the second corner weighs r to r + 1 parts.
//! In column c the third corner weighs c to c + 1 parts. A diagonal divides the square of a row and
//! a column into a near and a far micro-triangle. The last square of a row has only the near one.
//! Numbers ascend row by row, then column by column, the near one first.

use std::fmt;
use std::hash::{DefaultHasher, Hash, Hasher};

use glam::{DVec3, Vec3Swizzles};
use rayon::prelude::*;

use super::{Triangle, clip};

/// Finest level of a micromap.
pub const MAX_LEVEL: u32 = 10;

/// The opacity micromaps of a scene.
#[derive(Clone, Default, PartialEq, Eq)]
pub struct OpacityMaps {
    /// The micromap of each triangle. Empty if no triangle has holes.
    micromaps: Vec<Micromap>,
    /// A bit for each micro-triangle; 1: it is a hole.
    words: Vec<u32>,
}

/// Location of a micromap in the list of words. Level 0: the triangle has no holes.
#[derive(Clone, Copy, Default, PartialEq, Eq)]
struct Micromap {
    first: u32,
    level: u32,
}

/// Prints a hash of the contents, since all words would be too long.
impl fmt::Debug for OpacityMaps {
    fn fmt(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        let mut hasher = DefaultHasher::new();
        self.contents().for_each(|word| word.hash(&mut hasher));
        write!(formatter, "OpacityMaps({:016x})", hasher.finish())
    }
}

impl OpacityMaps {
    /// Appends triangles without holes.
    pub fn add_full(&mut self, count: usize) {
        if !self.micromaps.is_empty() {
            self.micromaps.extend(vec![Micromap::default(); count]);
        }
    }

    /// Divides each triangle to its level, at most [`MAX_LEVEL`]; level 0: it has no holes.
    /// `is_hole` gets the index of a triangle and the corner weights of a micro-triangle's centre.
    pub fn new(levels: &[u32], is_hole: impl Fn(usize, DVec3) -> bool + Sync) -> Self {
        let bits_of = |(triangle, &level): (usize, &u32)| {
            let mut words = vec![0_u32; if level == 0 { 0 } else { word_count(level) }];
            for (number, centre) in centres(level).take(words.len() * 32).enumerate() {
                words[number / 32] |= u32::from(is_hole(triangle, centre)) << (number % 32);
            }
            words
        };
        let all: Vec<Vec<u32>> = levels.par_iter().enumerate().map(bits_of).collect();
        let mut made = Self::default();
        for (&level, words) in levels.iter().zip(all) {
            let has_holes = words.iter().any(|&word| word != 0);
            made.micromaps.push(match has_holes {
                true => Micromap { first: made.words.len() as u32, level },
                false => Micromap::default(),
            });
            made.words.extend(words.into_iter().filter(|_| has_holes));
        }
        if made.words.is_empty() { Self::default() } else { made }
    }

    /// Whether no triangle has holes.
    pub fn is_empty(&self) -> bool {
        self.micromaps.is_empty()
    }

    /// Whether a triangle has holes.
    pub fn has_holes(&self, triangle: u32) -> bool {
        self.micromap(triangle).is_some()
    }

    /// Bits of all micromaps; 1: a hole.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Triangle, first word and level of each micromap.
    pub fn micromaps(&self) -> impl Iterator<Item = (usize, [u32; 2])> {
        let all = self.micromaps.iter().enumerate().filter(|(_, map)| map.level > 0);
        all.map(|(triangle, map)| (triangle, [map.first, map.level]))
    }

    /// All contents as words, for hashes.
    pub fn contents(&self) -> impl Iterator<Item = u32> {
        self.micromaps.iter().flat_map(|map| [map.first, map.level]).chain(self.words.iter().copied())
    }

    /// Reorders the triangles; `order` lists the old indices, not necessarily all of them.
    pub fn reorder(&mut self, order: &[u32]) {
        if !self.is_empty() {
            self.micromaps = order.iter().map(|&index| self.micromaps[index as usize]).collect();
        }
    }

    /// Whether a triangle has a hole at a point, by the weights of its corners. `is_hole` in
    /// `glsl/include/triangles.glsl` mirrors it.
    pub fn is_hole(&self, triangle: u32, barycentric: DVec3) -> bool {
        let Some(map) = self.micromap(triangle) else { return false };
        let parts = 1_u32 << map.level;
        let place = barycentric.yz().clamp(glam::DVec2::ZERO, glam::DVec2::ONE) * f64::from(parts);
        let row = (place.x as u32).min(parts - 1);
        let left = parts - row;
        let column = (place.y as u32).min(left - 1);
        let within = place.x - f64::from(row) + place.y - f64::from(column);
        let is_far = within > 1.0 && column + 1 < left;
        self.hole_count(map, number(parts, row, column) + u32::from(is_far), 1) == 1
    }

    /// As [`Self::is_hole`], at a position near the triangle's plane.
    pub fn is_hole_at(&self, triangles: &[Triangle], triangle: u32, position: DVec3) -> bool {
        self.has_holes(triangle) && self.is_hole(triangle, triangles[triangle as usize].weights_at(position))
    }

    /// Parts of each edge of a triangle.
    pub fn parts(&self, triangle: u32) -> f64 {
        self.micromap(triangle).map_or(1.0, |map| f64::from(1_u32 << map.level))
    }

    /// Fraction of a triangle's area that is surface.
    pub fn solid_fraction(&self, triangle: u32) -> f64 {
        let Some(map) = self.micromap(triangle) else { return 1.0 };
        let all = 1_u32 << (2 * map.level);
        1.0 - f64::from(self.hole_count(map, 0, all)) / f64::from(all)
    }

    /// Fraction of a convex polygon on a triangle that is surface, exactly.
    pub fn solid_fraction_of(&self, triangles: &[Triangle], triangle: u32, polygon: &[DVec3]) -> f64 {
        let Some(map) = self.micromap(triangle) else { return 1.0 };
        let parts = 1_u32 << map.level;
        // In the plane of rows (x) and columns (y).
        let place = |&corner: &DVec3| {
            let weights = triangles[triangle as usize].weights_at(corner);
            DVec3::new(weights.y, weights.z, 0.0) * f64::from(parts)
        };
        let polygon: Vec<DVec3> = polygon.iter().map(place).collect();
        let area = clip::area(&polygon);
        if area == 0.0 {
            return 1.0;
        }
        let solid: f64 = range(polygon.iter().map(|p| p.x), parts)
            .map(|row| self.solid_area_of_row(map, row, &strip(&polygon, 0, row), &polygon))
            .sum();
        (solid / area).clamp(0.0, 1.0)
    }

    /// Area of surface in a row; `in_row` is the part of the polygon there.
    fn solid_area_of_row(&self, map: Micromap, row: u32, in_row: &[DVec3], polygon: &[DVec3]) -> f64 {
        let parts = 1_u32 << map.level;
        let left = parts - row;
        let columns = range(in_row.iter().map(|p| p.y), left);
        // The polygon contains the squares of these columns: it is convex and contains their edges.
        let spans = [row, row + 1].map(|x| span(polygon, f64::from(x)));
        let inside = match spans {
            [Some(a), Some(b)] => {
                let end = (a[1].min(b[1]).max(0.0) as u32).min(left - 1);
                (a[0].max(b[0]).max(0.0).ceil() as u32).min(end)..end
            }
            _ => 0..0,
        };
        let count = 2 * inside.len() as u32;
        let holes = self.hole_count(map, number(parts, row, inside.start), count);
        let mut area = 0.5 * f64::from(count - holes);
        for column in columns.filter(|column| !inside.contains(column)) {
            let number = number(parts, row, column);
            let square = strip(in_row, 1, column);
            let diagonal = f64::from(row + column + 1);
            for (is_far, sign) in [(false, -1.0), (true, 1.0)] {
                let is_there = !is_far || column + 1 < left;
                if is_there && self.hole_count(map, number + u32::from(is_far), 1) == 0 {
                    area += clip::area(&clip::clip_by(&square, |p| sign * (p.x + p.y - diagonal)));
                }
            }
        }
        area
    }

    fn micromap(&self, triangle: u32) -> Option<Micromap> {
        self.micromaps.get(triangle as usize).copied().filter(|map| map.level > 0)
    }

    /// Number of holes among `count` micro-triangles from number `from` on.
    fn hole_count(&self, map: Micromap, from: u32, count: u32) -> u32 {
        let (mut at, end) = (from, from + count);
        let mut holes = 0;
        while at < end {
            let bits = (32 - at % 32).min(end - at);
            let word = self.words[(map.first + at / 32) as usize] >> (at % 32);
            holes += (word & (u32::MAX >> (32 - bits))).count_ones();
            at += bits;
        }
        holes
    }
}

/// Words of a micromap.
pub fn word_count(level: u32) -> usize {
    (1_usize << (2 * level)).div_ceil(32)
}

/// Number of the near micro-triangle of a row and column.
fn number(parts: u32, row: u32, column: u32) -> u32 {
    let left = parts - row;
    parts * parts - left * left + 2 * column
}

/// Corner weights at the centres of all micro-triangles, in the order of their numbers.
fn centres(level: u32) -> impl Iterator<Item = DVec3> {
    let parts = 1_u32 << level;
    (0..parts).flat_map(move |row| {
        (0..2 * (parts - row) - 1).map(move |within| {
            let third = f64::from(1 + within % 2) / 3.0;
            let [y, z] = [row, within / 2].map(|part| (f64::from(part) + third) / f64::from(parts));
            DVec3::new(1.0 - y - z, y, z)
        })
    })
}

/// Rows or columns, below `end`, that an interval overlaps.
fn range(values: impl Iterator<Item = f64>, end: u32) -> std::ops::Range<u32> {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), v| (a.min(v), b.max(v)));
    let last = (high.max(0.0).ceil() as u32).min(end);
    (low.max(0.0) as u32).min(last)..last
}

/// The part of a polygon in a row (`axis` 0) or a column (1).
fn strip(polygon: &[DVec3], axis: usize, index: u32) -> Vec<DVec3> {
    let low = f64::from(index);
    clip::clip_by(&clip::clip_by(polygon, |p| p[axis] - low), |p| low + 1.0 - p[axis])
}

/// Lowest and highest y of a convex polygon at x. `None` if it does not reach there.
fn span(polygon: &[DVec3], x: f64) -> Option<[f64; 2]> {
    let mut found: Option<[f64; 2]> = None;
    for (i, &b) in polygon.iter().enumerate() {
        let a = polygon[(i + polygon.len() - 1) % polygon.len()];
        if (a.x - x) * (b.x - x) > 0.0 {
            continue;
        }
        let along = if a.x == b.x { 0.0 } else { (x - a.x) / (b.x - a.x) };
        for y in [a.y + along * (b.y - a.y), if a.x == b.x { b.y } else { a.y + along * (b.y - a.y) }] {
            let [low, high] = found.unwrap_or([y, y]);
            found = Some([low.min(y), high.max(y)]);
        }
    }
    found
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;
    use glam::Vec3;

    fn triangle() -> Triangle {
        let positions = [Vec3::new(0.2, 0.1, -0.3), Vec3::new(1.7, 0.4, 0.2), Vec3::new(0.5, 1.9, 0.6)];
        Triangle { positions, normals: [Vec3::Z; 3], material: 0, object: 0 }
    }

    fn at(weights: DVec3) -> DVec3 {
        let [a, b, c] = triangle().positions.map(Vec3::as_dvec3);
        weights.x * a + weights.y * b + weights.z * c
    }

    /// Holes without any regularity.
    fn speckled(level: u32) -> OpacityMaps {
        let is_hole =
            |_, centre: DVec3| (1e4 * centre.dot(DVec3::new(0.3, 1.7, 2.9))).sin() > 0.2 || centre.x > 0.6;
        OpacityMaps::new(&[level], is_hole)
    }

    #[test]
    fn a_centre_has_the_bit_that_it_was_given() {
        for level in 1..=MAX_LEVEL {
            let maps = speckled(level);
            let holes = centres(level).enumerate().filter(|&(number, centre)| {
                let is_hole = maps.is_hole(0, centre);
                assert_eq!(is_hole, maps.words[number / 32] >> (number % 32) & 1 == 1, "{level} {number}");
                assert_eq!(is_hole, maps.is_hole_at(&[triangle()], 0, at(centre)), "{level} {number}");
                is_hole
            });
            let all = 4_usize.pow(level);
            assert_eq!(1.0 - holes.count() as f64 / all as f64, maps.solid_fraction(0));
        }
    }

    /// Sums over pieces of the triangle equal the whole, and one piece equals a fine count.
    #[test]
    fn fractions_of_polygons_are_exact() {
        for level in [1, 2, 4, 7] {
            let (maps, triangles) = (speckled(level), [triangle()]);
            let whole: Vec<DVec3> = [DVec3::X, DVec3::Y, DVec3::Z].map(at).to_vec();
            assert!((maps.solid_fraction_of(&triangles, 0, &whole) - maps.solid_fraction(0)).abs() < 1e-9);
            let mut sum = 0.0;
            for x in 0..7 {
                for y in 0..5 {
                    let cut = |polygon: &[DVec3], axis: usize, low: f64, high: f64| {
                        clip::clip_by(&clip::clip_by(polygon, |p| p[axis] - low), |p| high - p[axis])
                    };
                    let [x, y] = [f64::from(x), f64::from(y)];
                    let piece = cut(&cut(&whole, 0, 0.3 * x, 0.3 * x + 0.3), 1, 0.4 * y, 0.4 * y + 0.4);
                    sum += maps.solid_fraction_of(&triangles, 0, &piece) * clip::area(&piece);
                }
            }
            let expected = maps.solid_fraction(0) * triangle().area_m2();
            assert!((sum / expected - 1.0).abs() < 1e-9, "{level}: {sum} of {expected}");
        }
    }

    #[test]
    fn triangles_without_holes_have_no_micromap() {
        assert!(OpacityMaps::new(&[0, 3], |_, _| false).is_empty());
        let mut maps = OpacityMaps::new(&[2, 0, 3], |triangle, _| triangle == 2);
        assert_eq!(maps.words().len(), 2);
        maps.reorder(&[2, 0, 1]);
        assert_eq!(maps.micromaps().collect::<Vec<_>>(), [(0, [0, 3])]);
        assert_eq!([0, 1, 2].map(|triangle| maps.solid_fraction(triangle)), [0.0, 1.0, 1.0]);
    }
}
