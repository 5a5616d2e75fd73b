//! The window: frame, panes of the night outside, sill, and curtains on a rod.

use glam::{DVec3, dvec3};

use super::shell::WINDOW;
use super::{HALF, Site};
use crate::drapery::{Cloth, curtain};
use crate::model::at;
use crate::moulding::{drawn, mitred, rod};
use crate::outline::{Outline, circle};
use crate::panel::{block, panel};
use crate::turning::{turned, turned_ring};

pub(super) fn build(site: &mut Site) {
    let [[left, right], [sill, head]] = WINDOW;
    let wall = -HALF[1];
    let pane = block([left - 0.05, sill - 0.05, wall - 0.17], [right + 0.05, head + 0.05, wall - 0.14]);
    site.model.add(pane, site.finishes.night);
    // Two casements of two by three panes: frames of 6 cm, glazing bars of 2.
    let lines = |from: f64, to: f64, bars: &[(f64, f64)]| {
        let mut all = vec![from];
        all.extend(
            bars.iter()
                .flat_map(|(at, half)| [from + at * (to - from) - half, from + at * (to - from) + half]),
        );
        all.push(to);
        all
    };
    let xs = lines(
        left - 0.01,
        right + 0.01,
        &[(0.02, 0.03), (0.25, 0.012), (0.5, 0.05), (0.75, 0.012), (0.98, 0.03)],
    );
    let ys = lines(sill - 0.01, head + 0.01, &[(0.02, 0.03), (0.34, 0.012), (0.67, 0.012), (0.98, 0.03)]);
    // The outermost lines are doubled by the frame's: drop them.
    let (xs, ys) = (&xs[1..xs.len() - 1], &ys[1..ys.len() - 1]);
    let (xs, ys): (Vec<f64>, Vec<f64>) = (reach(xs, left, right), reach(ys, sill, head));
    let bars = panel(&xs, &ys, [wall - 0.12, wall - 0.075], |i, j| {
        (i.is_multiple_of(2) || j.is_multiple_of(2)).then_some(0)
    });
    site.model.add(bars, site.finishes.woodwork);
    let board = block([left - 0.10, sill - 0.035, wall - 0.13], [right + 0.10, sill + 0.002, wall + 0.07]);
    site.model.add(board, site.finishes.woodwork);
    let section = Outline::from(-0.07, -0.01, site.detail)
        .to(0.004, -0.01)
        .to(0.004, 0.015)
        .to(-0.02, 0.02)
        .to(-0.055, 0.03)
        .ovolo(-0.07, 0.02)
        .points();
    let path = [
        dvec3(right, sill, wall),
        dvec3(right, head, wall),
        dvec3(left, head, wall),
        dvec3(left, sill, wall),
    ];
    let casing = drawn(&section, &mitred(&path, DVec3::Z, false), false);
    site.model.add(casing, site.finishes.woodwork);
    curtains(site);
}

/// Moves the outermost lines into the wall.
fn reach(lines: &[f64], low: f64, high: f64) -> Vec<f64> {
    let mut lines = lines.to_vec();
    let last = lines.len() - 1;
    (lines[0], lines[last]) = (low - 0.01, high + 0.01);
    lines
}

fn curtains(site: &mut Site) {
    let detail = site.detail;
    let [[left, right], [_, head]] = WINDOW;
    let (y, z) = (head + 0.17, -HALF[1] + 0.11);
    let ends = [dvec3(left - 0.52, y, z), dvec3(right + 0.52, y, z)];
    let bar = rod(&ends, detail.cuts(12.0, 5), false, |_| 0.014);
    site.model.add(bar, site.finishes.brass);
    let knob = Outline::from(0.0, -0.035, detail).arc(0.0, 0.035, 1.0, 10.0).points();
    let knob = turned(&knob, detail.cuts(12.0, 5)).smooth();
    let section: Vec<_> =
        circle(0.004, detail.cuts(5.0, 3)).into_iter().map(|p| p + glam::dvec2(0.022, 0.0)).collect();
    let ring = turned_ring(&section, detail.cuts(14.0, 6)).smooth_below(80.0);
    let upright = glam::DAffine3::from_rotation_z(std::f64::consts::FRAC_PI_2);
    for (number, end) in ends.into_iter().enumerate() {
        site.model.place(&knob, &at(end.x, end.y, end.z), site.finishes.brass);
        let sign = if number == 0 { -1.0 } else { 1.0 };
        let x = if number == 0 { left - 0.11 } else { right + 0.11 };
        let cloth = Cloth {
            width: 0.70,
            drop: y - 0.04,
            folds: 7.0,
            depth: 0.045,
            tie: [1.05, 0.42],
            drawn_to: sign,
            seed: 60 + number as u64,
        };
        let cloth = curtain(detail, cloth).smooth_below(75.0);
        site.model.place(&cloth, &at(x, y - 0.022, z), site.finishes.curtain);
        let rings = if detail.is_below(0.45) { 0 } else { 8 };
        for ring_number in 0..rings {
            let across = 0.66 * ((f64::from(ring_number) + 0.5) / f64::from(rings) - 0.5);
            site.model.place(&ring, &(at(x + across, y, z) * upright), site.finishes.brass);
        }
    }
}
