//! Cloth in folds.

use std::f64::consts::TAU;

use glam::{DVec3, dvec3};

use super::chance::Chance;
use super::outline::Detail;
use super::sheet::sheet;
use super::solid::Solid;

/// How a cloth hangs.
#[derive(Clone, Copy)]
pub(super) struct Cloth {
    pub(super) width: f64,
    pub(super) drop: f64,
    /// Folds across its width, and how deep they are, metres from middle to crest.
    pub(super) folds: f64,
    pub(super) depth: f64,
    /// Height over its lower edge where it is tied, and how much of its width is left there; 1 is not tied.
    pub(super) tie: [f64; 2],
    /// Where across its width it is drawn to when tied, -1 to 1.
    pub(super) drawn_to: f64,
    pub(super) seed: u64,
}

/// Thickness of cloth, metres.
const THICKNESS: f64 = 0.006;

/// A curtain in the xy plane that hangs down from the origin.
pub(super) fn curtain(detail: Detail, cloth: Cloth) -> Solid {
    let cells = [detail.cuts(cloth.folds * 6.0, 4), detail.cuts(7.0, 2)];
    sheet(cells, THICKNESS, folds(cloth))
}

/// The same, laid over a path of (z, y) points by length instead of hanging straight.
pub(super) fn banner(detail: Detail, cloth: Cloth, path: &[[f64; 2]]) -> Solid {
    let cells = [detail.cuts(cloth.folds * 4.0, 2), detail.cuts(9.0, 4)];
    let hanging = folds(cloth);
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

fn folds(cloth: Cloth) -> impl Fn(f64, f64) -> DVec3 {
    let mut chance = Chance::new(cloth.seed);
    let [a, b, c] = [0; 3].map(|_| chance.between(0.0, TAU));
    let stretch = chance.between(0.25, 0.4);
    move |u, v| {
        let from_tie = (1.0 - v) * cloth.drop - cloth.tie[0];
        // Narrow at the tie, and wide again away from it, faster below.
        let reach = if from_tie < 0.0 { 1.2 * cloth.tie[0] } else { 0.8 * (cloth.drop - cloth.tie[0]) };
        let open = (from_tie.abs() / reach.max(1e-3)).min(1.0);
        let share = cloth.tie[1] + (1.0 - cloth.tie[1]) * open * open * (3.0 - 2.0 * open);
        let across = u - 0.5 + 0.012 * (TAU * u + a).sin();
        let x = cloth.width * (across * share + 0.5 * cloth.drawn_to * (1.0 - share));
        let phase = TAU * (cloth.folds * u + stretch * (TAU * u + b).sin() + 0.1 * (3.0 * v + c).sin());
        let fall = (0.55 + 0.45 * v) * (0.8 + 0.2 * (TAU * 1.7 * u + c).sin());
        let depth = cloth.depth * fall * (0.7 + 0.3 * share);
        dvec3(x + 0.25 * depth * (2.0 * phase).sin() * share, -v * cloth.drop, depth * phase.sin())
    }
}
