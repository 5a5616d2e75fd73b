//! Twin of the antialiasing: which pixels show an edge, and what their samples see.

use crate::cpu::primary::{Seen, seen_through};
use crate::cpu::rays::Geometry;
use crate::cpu::sampling::sample_3d;
use crate::types::{NO_SIDE, PixelSurface, Surface, View};
use glam::{DVec3, Vec3};

/// What makes an edge between two pixels.
#[derive(Clone, Copy)]
pub struct Thresholds {
    /// Cosine below which two normals do.
    pub crease: f64,
    /// Distance off the other's plane that does, in pixel widths.
    pub step: f64,
    /// Relative difference of direct irradiance that does.
    pub contrast: f64,
}

/// Whether two neighbouring pixels with that direct irradiance (W/m²) show an edge between them.
pub fn is_edge(
    thresholds: Thresholds,
    surfaces: &[Surface],
    [a, b]: [&PixelSurface; 2],
    direct: [Vec3; 2],
) -> bool {
    if a.side == NO_SIDE || b.side == NO_SIDE {
        return a.side != b.side;
    }
    let material = |pixel: &PixelSurface| surfaces[pixel.side as usize / 2].material;
    let [normal_a, normal_b] = [a, b].map(|pixel| pixel.normal.as_dvec3());
    let apart = b.position.as_dvec3() - a.position.as_dvec3();
    let off_plane = apart.dot(normal_a).abs().min(apart.dot(normal_b).abs());
    let width = f64::from(a.footprint.max(b.footprint)).sqrt();
    let [one, other] = direct.map(Vec3::as_dvec3);
    material(a) != material(b)
        || normal_a.dot(normal_b) < thresholds.crease
        || off_plane > thresholds.step * width
        || (one - other).abs().cmpgt(thresholds.contrast * one.max(other)).any()
}

/// Which pixels of an image, row by row, show an edge towards the pixel above, left, right or below.
pub fn edges(
    thresholds: Thresholds,
    surfaces: &[Surface],
    [width, height]: [u32; 2],
    pixels: &[PixelSurface],
    direct: &[Vec3],
) -> Vec<bool> {
    let shows_edge = |index: usize| {
        let (x, y) = (index as u32 % width, index as u32 / width);
        let beside = [
            (y > 0).then(|| index - width as usize),
            (x > 0).then(|| index - 1),
            (x + 1 < width).then_some(index + 1),
            (y + 1 < height).then_some(index + width as usize),
        ];
        beside.into_iter().flatten().any(|other| {
            let pair = [&pixels[index], &pixels[other]];
            is_edge(thresholds, surfaces, pair, [direct[index], direct[other]])
        })
    };
    (0..pixels.len()).map(shows_edge).collect()
}

/// Samples that each of so many edge pixels gets: `most`, or what there is room for; none where that is fewer than four.
pub fn samples_per_edge(edge_count: u32, most: u32, capacity: u32) -> u32 {
    let share = capacity.checked_div(edge_count).unwrap_or(capacity).min(most);
    if share < 4 { 0 } else { share }
}

/// What sample number `sample` of a pixel sees.
pub fn sample(geometry: Geometry<'_>, view: &View, pixel: u32, sample: u32) -> Option<Seen> {
    let corner = Vec3::new((pixel % view.width) as f32, (pixel / view.width) as f32, 0.0);
    seen_through(geometry, view, (corner + sample_3d(sample, pixel)).as_dvec3().truncate())
}

/// How far a pixel's surface is from being that of a sample; nothing may come from a pixel that sees none.
pub fn dissimilarity(found: &Seen, pixel: &PixelSurface) -> f64 {
    if pixel.side == NO_SIDE {
        return f64::INFINITY;
    }
    let apart: DVec3 = pixel.position.as_dvec3() - found.hit.position;
    let turned = 1.0 - found.normal.dot(pixel.normal.as_dvec3());
    turned
        + apart.dot(found.normal).abs() / found.footprint.sqrt()
        + 1e-3 * apart.length_squared() / found.footprint
}

/// The least dissimilarity that a sample of a pixel finds among the pixel and the eight around it, and who has it: the pixel
/// itself where it will do.
pub fn source(view: &View, pixels: &[PixelSurface], pixel: u32, found: &Seen) -> (f64, u32) {
    let own = dissimilarity(found, &pixels[pixel as usize]);
    if own <= 0.01 {
        return (own, pixel);
    }
    let (x, y) = (pixel % view.width, pixel / view.width);
    let mut best = (own, pixel);
    for down in y.saturating_sub(1)..=(y + 1).min(view.height - 1) {
        for across in x.saturating_sub(1)..=(x + 1).min(view.width - 1) {
            let other = down * view.width + across;
            let cost = dissimilarity(found, &pixels[other as usize]);
            if cost < best.0 {
                best = (cost, other);
            }
        }
    }
    best
}
