//! The court: steps, paving, and the fountain in its middle.

use glam::{DAffine3, DVec3};

use super::walk::{EDGE, flat};
use super::{COURT, GROUND, Site, around};
use crate::model::at;
use crate::moulding::{drawn, mitred};
use crate::outline::Outline;
use crate::panel::{lines, panel};
use crate::turning::{fluted, turned, turned_ring};

pub(super) fn build(site: &mut Site) {
    steps(site);
    paving(site);
    fountain(site);
}

/// Three steps down from the walk; its edge is the first.
fn steps(site: &mut Site) {
    let section = Outline::from(-0.02, -0.6, site.detail)
        .to(0.70, -0.6)
        .to(0.70, -0.315)
        .arc(0.685, -0.30, 0.41, 2.0)
        .to(0.35, -0.30)
        .to(0.35, -0.165)
        .arc(0.335, -0.15, 0.41, 2.0)
        .to(-0.02, -0.15)
        .points();
    let steps = drawn(&section, &mitred(&around(-EDGE, 0.0), DVec3::Y, true), true);
    site.model.add(steps, site.finishes.limestone);
}

/// Marble and slate in a border of porphyry.
fn paving(site: &mut Site) {
    let [x, z] = COURT.map(|half| half - EDGE - 0.68);
    let [nx, ny] = if site.detail.is_below(0.2) { [15, 5] } else { [30, 9] };
    let [xs, ys] = [lines(-x, x, nx), lines(-z, z, ny)];
    let finish = |i: usize, j: usize| {
        let edge = i.min(nx - 1 - i).min(j.min(ny - 1 - j));
        Some(if edge == 0 { 2 } else { u8::from((i + j).is_multiple_of(2)) })
    };
    let paving = panel(&xs, &ys, [-0.2, 0.0], finish).moved(&flat(GROUND));
    let f = &site.finishes;
    site.model.add_in(paving, &[f.marble, f.slate, f.porphyry]);
}

/// A basin of eight sides, a stem, a fluted bowl and a finial.
fn fountain(site: &mut Site) {
    let detail = site.detail;
    let wall = Outline::from(1.12, -0.002, detail)
        .to(1.36, -0.002)
        .to(1.36, 0.10)
        .cavetto(1.28, 0.18)
        .to(1.28, 0.40)
        .cavetto(1.36, 0.48)
        .arc(1.36, 0.56, 0.8, 3.0)
        .to(1.12, 0.56);
    let octant = at(0.0, GROUND, 0.0) * DAffine3::from_rotation_y(std::f64::consts::PI / 8.0);
    let basin = turned_ring(&wall.points(), 8).smooth_below(30.0);
    site.model.place(&basin, &octant, site.finishes.marble);
    let pool = Outline::from(1.13, 0.05, detail).to(1.13, 0.38).points();
    site.model.place(&turned(&pool, 8).smooth(), &octant, site.finishes.slate);

    let stem = Outline::from(0.34, 0.36, detail)
        .to(0.34, 0.46)
        .cavetto(0.22, 0.56)
        .torus(0.22, 0.64)
        .through(&[[0.13, 0.80], [0.11, 1.00], [0.17, 1.16]], 3.0)
        .torus(0.17, 1.22)
        .to(0.10, 1.22);
    let cuts = detail.cuts(20.0, 8);
    let place = at(0.0, GROUND, 0.0);
    site.model.place(&turned(&stem.points(), cuts).smooth(), &place, site.finishes.marble);
    let bowl = Outline::from(0.10, 1.20, detail)
        .through(&[[0.36, 1.24], [0.60, 1.36], [0.72, 1.52]], 3.0)
        .arc(0.68, 1.55, 0.9, 3.0)
        .through(&[[0.56, 1.42], [0.34, 1.33], [0.12, 1.30]], 2.0);
    let gadroons = |turn: f64, y: f64| {
        let lower = ((1.46 - y) / 0.2).clamp(0.0, 1.0);
        1.0 + 0.035 * lower * (std::f64::consts::TAU * 16.0 * turn).cos().abs()
    };
    let bowl = fluted(&bowl.points(), detail.cuts(64.0, 12), gadroons);
    site.model.place(&bowl.smooth(), &place, site.finishes.marble);
    let finial = Outline::from(0.10, 1.29, detail)
        .through(&[[0.06, 1.42], [0.07, 1.52]], 2.0)
        .torus(0.07, 1.57)
        .through(&[[0.10, 1.68], [0.05, 1.80], [0.0, 1.88]], 3.0);
    let finial = turned(&finial.points(), detail.cuts(12.0, 6));
    site.model.place(&finial.smooth(), &place, site.finishes.bronze);
}
