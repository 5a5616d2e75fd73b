//! Cloth in folds.

use std::f64::consts::TAU;

use glam::{DVec3, dvec3};

use super::outline::Detail;
use super::rng::Rng;
use super::sheet::sheet;
use super::solid::Solid;

/// The shape of a hanging cloth.
#[derive(Clone, Copy)]
pub(super) struct Cloth {
    pub(super) width: f64,
    pub(super) drop: f64,
    /// Folds across its width, and their depth, metres from middle to crest.
    pub(super) folds: f64,
    pub(super) depth: f64,
    /// Height over its lower edge at which it is tied, and the remaining fraction of its width
    /// there; 1 is not tied.
    pub(super) tie: [f64; 2],
    /// Position across its width to which a tied cloth is drawn, -1 to 1.
    pub(super) drawn_to: f64,
    pub(super) seed: u64,
}

/// Thickness of cloth, metres.
const THICKNESS: f64 = 0.002;
/// Overhang of a fold's crest over its foot, as a fraction of its depth.
const OVERHANG: f64 = 0.25;

/// A curtain in the xy plane that hangs down from the origin.
pub(super) fn curtain(detail: Detail, cloth: Cloth) -> Solid {
    let cells = [detail.cuts(cloth.folds * 6.0, 4), detail.cuts(7.0, 2)];
    sheet(cells, THICKNESS, folds(cloth, THICKNESS))
}

/// A cloth laid over a path of (z, y) points by length instead of hanging straight.
pub(super) fn banner(detail: Detail, cloth: Cloth, path: &[[f64; 2]]) -> Solid {
    let cells = [detail.cuts(cloth.folds * 4.0, 2), detail.cuts(9.0, 4)];
    let hanging = folds(cloth, 2.0 * THICKNESS);
    sheet(cells, 2.0 * THICKNESS, move |u, v| {
        let p = hanging(u, v);
        let place = v * (path.len() - 1) as f64;
        let span = (place.floor().max(0.0) as usize).min(path.len() - 2);
        let t = place - span as f64;
        let at = |index: usize| glam::DVec2::from(path[index.min(path.len() - 1)]);
        let [p0, p1, p2, p3] = [at(span.saturating_sub(1)), at(span), at(span + 1), at(span + 2)];
        let on = 0.5
            * (2.0 * p1
                + (p2 - p0) * t
                + (2.0 * p0 - 5.0 * p1 + 4.0 * p2 - p3) * t * t
                + (3.0 * p1 - p0 - 3.0 * p2 + p3) * t * t * t);
        dvec3(p.x, on.y, on.x + p.z)
    })
}

/// The middle surface of a cloth of that thickness. It is nowhere bent so narrowly that its
/// two sides cross.
fn folds(cloth: Cloth, thickness: f64) -> impl Fn(f64, f64) -> DVec3 {
    let mut rng = Rng::new(cloth.seed);
    let [a, b, c] = [0; 3].map(|_| rng.between(0.0, TAU));
    let stretch = rng.between(0.25, 0.4);
    move |u, v| {
        let from_tie = (1.0 - v) * cloth.drop - cloth.tie[0];
        // Narrow at the tie, and wide again away from it, faster below.
        let reach = if from_tie < 0.0 { 1.2 * cloth.tie[0] } else { 0.8 * (cloth.drop - cloth.tie[0]) };
        let open = (from_tie.abs() / reach.max(1e-3)).min(1.0);
        let fraction = cloth.tie[1] + (1.0 - cloth.tie[1]) * open * open * (3.0 - 2.0 * open);
        let across = u - 0.5 + 0.012 * (TAU * u + a).sin();
        let x = cloth.width * (across * fraction + 0.5 * cloth.drawn_to * (1.0 - fraction));
        let phase = TAU * (cloth.folds * u + stretch * (TAU * u + b).sin() + 0.1 * (3.0 * v + c).sin());
        let fall = (0.55 + 0.45 * v) * (0.8 + 0.2 * (TAU * 1.7 * u + c).sin());
        let wanted = cloth.depth * fall * (0.7 + 0.3 * fraction);
        // Metres across a radian of a fold.
        let widths = cloth.width * fraction * (1.0 + 0.012 * TAU * (TAU * u + a).cos());
        let pitch = widths / (TAU * (cloth.folds + stretch * TAU * (TAU * u + b).cos()));
        let depth = below(wanted, deepest(pitch, OVERHANG * fraction, 2.0 * thickness));
        dvec3(x + OVERHANG * fraction * depth * (2.0 * phase).sin(), -v * cloth.drop, depth * phase.sin())
    }
}

/// Largest depth of folds with a crest radius of at least `radius`: with depth d, pitch p (metres a
/// radian) and overhang h, a crest's radius is (p − 2 h d)² / d.
fn deepest(pitch: f64, overhang: f64, radius: f64) -> f64 {
    let h = 2.0 * overhang;
    let half = 0.5 * radius + h * pitch;
    pitch * pitch / (half + (half * half - (h * pitch).powi(2)).sqrt())
}

/// A smooth minimum of two lengths that is never above it.
fn below(a: f64, b: f64) -> f64 {
    a * b / (a.powi(4) + b.powi(4)).powf(0.25)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLOTH: Cloth =
        Cloth { width: 1.0, drop: 2.5, folds: 6.0, depth: 0.055, tie: [1.2, 0.34], drawn_to: 1.0, seed: 3 };

    #[test]
    fn a_crest_is_as_narrow_as_asked() {
        for (pitch, overhang, radius) in [(0.02, 0.25, 0.004), (0.005, 0.1, 0.004), (0.03, 0.0, 0.01)] {
            let d = deepest(pitch, overhang, radius);
            let found = (pitch - 2.0 * overhang * d).powi(2) / d;
            assert!((found / radius - 1.0).abs() < 1e-12 && 2.0 * overhang * d < pitch, "{found} {radius}");
        }
        assert!(below(2.0, 3.0) < 2.0 && (below(1.0, 30.0) - 1.0).abs() < 1e-5);
    }

    /// Each side of the cloth, finely divided, faces the same way as its middle surface.
    #[test]
    fn two_sides_of_a_cloth_do_not_cross() {
        for seed in 0..24 {
            let middle = folds(Cloth { seed, ..CLOTH }, THICKNESS);
            let cells = [600, 60];
            let solid = sheet(cells, THICKNESS, &middle);
            let sides = solid.facets.len() / 2;
            assert!(sides > cells[0] * cells[1]);
            let crossed = solid
                .facets
                .chunks_exact(2)
                .take(2 * cells[0] * cells[1])
                .enumerate()
                .filter(|(at, pair)| {
                    let cell = at / 2;
                    let (i, j) = (cell % cells[0], cell / cells[0]);
                    let point =
                        |i: usize, j: usize| middle(i as f64 / cells[0] as f64, j as f64 / cells[1] as f64);
                    let front = (point(i + 1, j) - point(i, j)).cross(point(i, j + 1) - point(i, j));
                    let sign = if at % 2 == 0 { 1.0 } else { -1.0 };
                    pair.iter().any(|facet| {
                        let [a, b, c] = facet.map(|index| solid.points[index as usize]);
                        sign * (b - a).cross(c - a).dot(front) <= 0.0
                    })
                })
                .count();
            assert_eq!(crossed, 0, "seed {seed}");
        }
    }
}
