//! Cut-outs: opacity maps of materials become opacity micromaps of triangles.

use std::sync::Arc;

use glam::{DVec2, DVec3, IVec2, Vec2, Vec3};

use super::alpha::Alpha;
use super::geometry::Assembled;
use super::opacity::{MAX_LEVEL, OpacityMaps, word_count};
use super::texture::Image;

/// Words of all micromaps together: 64 MiB.
const MAX_WORDS: usize = 1 << 24;
/// Words of all micromaps together up to which they are finer than texels: 1 MiB.
const FINE_WORDS: usize = 1 << 18;
/// Levels by which they may be finer: micro-triangles of a quarter of a texel. Those of a texel's
/// size, if they did not align with the texels, covered 2 % more than the image.
const FINER: u32 = 2;

/// The note on an opacity map for which [`Alpha::is_grey`] holds.
pub(super) const CUT_AT_HALF: &str = "opacity is cut at one half: a surface is opaque or a hole";

/// Where a material is surface.
#[derive(Clone, Default)]
pub(super) enum Coverage {
    /// All of it is surface.
    #[default]
    Full,
    /// None of it is surface: its triangles are left out.
    Hidden,
    /// The opacity map decides.
    Cutout(Cutout),
    /// It lets this fraction of light of each colour pass, and reflects nothing.
    Pane(Vec3),
}

/// The opacity map of a material.
#[derive(Clone)]
pub(super) struct Cutout {
    pub(super) alpha: Arc<Alpha>,
    /// Whether the outermost texels continue outside of the map; otherwise it repeats.
    pub(super) is_clamped: bool,
    /// The surface is where the alpha is at least this large.
    pub(super) cutoff: f64,
}

/// The opacity map of an image without an alpha channel: its luminance, by Rec.709.
pub(super) fn luminance(image: &Image) -> Arc<Alpha> {
    let luminance = |&[r, g, b]: &[u8; 3]| {
        let [r, g, b] = [r, g, b].map(u32::from);
        ((2126 * r + 7152 * g + 722 * b + 5000) / 10_000) as u8
    };
    Arc::new(Alpha { size: image.size, values: image.codes.iter().map(luminance).collect() })
}

impl Cutout {
    /// Whether a point is a hole: u from the left, v from below, the map 1 wide and high.
    /// Bilinear between the middles of texels.
    fn is_hole(&self, uv: DVec2) -> bool {
        let Alpha { size: [width, height], values } = &*self.alpha;
        let place = DVec2::new(uv.x, 1.0 - uv.y);
        let place = match self.is_clamped {
            true => place.clamp(DVec2::ZERO, DVec2::ONE),
            false => place - place.floor(),
        };
        let between = place * DVec2::new(f64::from(*width), f64::from(*height)) - 0.5;
        let low = between.floor();
        let fraction = between - low;
        let texel = |across, down| {
            let place = low.as_ivec2() + IVec2::new(across, down);
            let inside = |place: i32, size: u32| match self.is_clamped {
                true => place.clamp(0, size as i32 - 1),
                false => place.rem_euclid(size as i32),
            };
            let [x, y] = [inside(place.x, *width), inside(place.y, *height)].map(|place| place as usize);
            f64::from(values[y * *width as usize + x]) / 255.0
        };
        let mix = |a: f64, b: f64, along: f64| a + (b - a) * along;
        let above = mix(texel(0, 0), texel(1, 0), fraction.x);
        let below = mix(texel(0, 1), texel(1, 1), fraction.x);
        mix(above, below, fraction.y) < self.cutoff
    }

    /// Level at which no micro-triangle is wider or higher than a texel.
    fn level(&self, coordinates: &[Vec2; 3]) -> u32 {
        let [a, b, c] = coordinates.map(Vec2::as_dvec2);
        let size = DVec2::from(self.alpha.size.map(f64::from));
        let texels = ((a.max(b).max(c) - a.min(b).min(c)) * size).max_element();
        // Coordinates are rounded.
        (texels - 1e-3).max(1.0).log2().ceil().clamp(1.0, 32.0) as u32
    }
}

/// Makes the micromaps of triangles whose materials have an opacity map, and leaves out triangles
/// that are nothing but a hole. `coverages` are those of the materials.
pub(super) fn cut(
    assembled: &mut Assembled,
    coverages: &[Coverage],
    warnings: &mut Vec<String>,
) -> OpacityMaps {
    let Assembled { triangles, coordinates, colours, .. } = assembled;
    let cutout = |triangle: usize| match &coverages[triangles[triangle].material as usize] {
        Coverage::Cutout(cutout) => Some(cutout),
        _ => None,
    };
    // Triangles without coordinates show the map's lower left corner.
    let corners = |triangle: usize| coordinates.get(triangle).copied().unwrap_or_default();
    let of_triangle = |triangle: usize| cutout(triangle).map_or(0, |cutout| cutout.level(&corners(triangle)));
    let wanted: Vec<u32> = (0..triangles.len()).map(of_triangle).collect();
    if wanted.iter().all(|&level| level == 0) {
        return OpacityMaps::default();
    }
    let levels = refined(bounded(&wanted, warnings));
    let is_hole = |triangle: usize, centre: DVec3| {
        let [a, b, c] = corners(triangle).map(Vec2::as_dvec2);
        cutout(triangle).is_some_and(|cutout| cutout.is_hole(centre.x * a + centre.y * b + centre.z * c))
    };
    let mut maps = OpacityMaps::new(&levels, is_hole);
    let order: Vec<u32> =
        (0..triangles.len() as u32).filter(|&triangle| maps.solid_fraction(triangle) > 0.0).collect();
    if order.len() < triangles.len() {
        *triangles = order.iter().map(|&index| triangles[index as usize]).collect();
        if !coordinates.is_empty() {
            *coordinates = order.iter().map(|&index| coordinates[index as usize]).collect();
        }
        if !colours.is_empty() {
            *colours = order.iter().map(|&index| colours[index as usize]).collect();
        }
        maps.reorder(&order);
    }
    maps
}

/// The levels, bounded so that all micromaps fit. Adds a warning if any is lower than wanted.
fn bounded(wanted: &[u32], warnings: &mut Vec<String>) -> Vec<u32> {
    let total = |most: u32| -> usize {
        wanted.iter().filter(|&&level| level > 0).map(|&level| word_count(level.min(most))).sum()
    };
    let most = (1..=MAX_LEVEL).rev().find(|&most| total(most) <= MAX_WORDS).unwrap_or(1);
    let coarser = wanted.iter().filter(|&&level| level > most).count();
    if coarser > 0 {
        warnings.push(format!(
            "holes of {coarser} triangles are coarser than the texels of their opacity map: {} parts of an edge can be stored; divide the triangles",
            1 << most
        ));
    }
    wanted.iter().map(|&level| level.min(most)).collect()
}

/// The levels, finer than wanted by one number as long as all micromaps stay small.
fn refined(levels: Vec<u32>) -> Vec<u32> {
    let finer =
        |by: u32| levels.iter().map(move |&level| if level == 0 { 0 } else { (level + by).min(MAX_LEVEL) });
    let total = |by: u32| -> usize { finer(by).filter(|&level| level > 0).map(word_count).sum() };
    let by = (1..=FINER).rev().find(|&by| total(by) <= FINE_WORDS).unwrap_or(0);
    finer(by).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cutout(size: [u32; 2], values: Vec<u8>) -> Cutout {
        Cutout { alpha: Arc::new(Alpha { size, values }), is_clamped: false, cutoff: 0.5 }
    }

    #[test]
    fn holes_are_where_the_interpolated_alpha_is_below_the_cutoff() {
        let half = cutout([2, 1], vec![255, 0]);
        for (u, is_hole) in
            [(0.0, false), (0.25, false), (0.49, false), (0.51, true), (0.99, true), (1.1, false)]
        {
            assert_eq!(half.is_hole(DVec2::new(u, 0.3)), is_hole, "{u}");
        }
        let below = cutout([1, 2], vec![255, 0]);
        assert!(below.is_hole(DVec2::new(0.5, 0.2)) && !below.is_hole(DVec2::new(0.5, 0.8)));
    }

    #[test]
    fn a_micro_triangle_is_no_larger_than_a_texel() {
        let map = cutout([8, 4], vec![0; 32]);
        let level = |x: f32, y: f32| map.level(&[Vec2::ZERO, Vec2::new(x, 0.0), Vec2::new(0.0, y)]);
        assert_eq!([level(1.0, 1.0), level(0.5, 0.5), level(1.01, 1.0)], [3, 2, 4]);
        assert_eq!([level(0.0, 0.0), level(0.01, 4.0)], [1, 4]);
    }

    #[test]
    fn levels_are_bounded_with_a_warning() {
        let mut warnings = Vec::new();
        assert_eq!(bounded(&[0, 3, 8], &mut warnings), [0, 3, 8]);
        assert!(warnings.is_empty());
        assert_eq!(bounded(&[0, 3, 12], &mut warnings), [0, 3, 10]);
        assert_eq!(bounded(&vec![8; 20_000], &mut warnings), vec![7; 20_000]);
        assert!(
            warnings[0].starts_with("holes of 1 triangles") && warnings[1].contains("128 parts"),
            "{warnings:?}"
        );
    }

    #[test]
    fn small_micromaps_are_finer_than_texels() {
        assert_eq!(refined(vec![0, 3, 7, 9]), [0, 5, 9, 10]);
        // 512 bytes each at level 6, 2 KiB at level 7.
        assert_eq!(refined(vec![6; 300]), vec![7; 300]);
        assert_eq!(refined(vec![6; 600]), vec![6; 600]);
    }
}
