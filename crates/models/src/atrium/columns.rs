//! Columns with base and capital, and the piers in the corners.

use std::f64::consts::FRAC_PI_4;

use glam::{DAffine3, DVec2, DVec3, dvec3};

use super::{BAY, COURT, GALLERY, SPRINGING, Site, sides};
use crate::model::at;
use crate::outline::{Detail, Outline};
use crate::panel::block;
use crate::sheet::leaf;
use crate::solid::Part;
use crate::turning::turned;

/// Distance of the columns of the gallery.
const UPPER_BAY: f64 = 1.5;
/// Where the arches of the gallery begin.
pub(super) const UPPER_SPRINGING: f64 = GALLERY + 2.5;

pub(super) fn build(site: &mut Site) {
    let lower = Column::new(site.detail, 0.27, SPRINGING, 1.0);
    let upper = Column::slender(site.detail, 0.115, UPPER_SPRINGING - GALLERY - 0.12);
    let acanthus = acanthus(site.detail);
    let [marble, limestone] = [site.finishes.marble, site.finishes.limestone];
    for side in sides() {
        let count = (2.0 * side.half / BAY).round() as usize;
        for number in 1..count {
            let place = side.place * at(-side.half + BAY * number as f64, 0.0, 0.0);
            site.model.place(&lower.square, &place, limestone);
            site.model.place(&lower.shaft, &place, marble);
            for turn in 0..if site.detail.is_below(0.52) { 0 } else { 8 } {
                let turn = DAffine3::from_rotation_y(FRAC_PI_4 * f64::from(turn));
                site.model.place(&acanthus, &(place * at(0.0, SPRINGING - 0.12, 0.0) * turn), limestone);
            }
        }
        let count = (2.0 * side.half / UPPER_BAY).round() as usize;
        for number in 1..count {
            let x = -side.half + UPPER_BAY * number as f64;
            let place = side.place * at(x, GALLERY + 0.12, 0.0);
            if !site.detail.is_below(0.25) {
                site.model.place(&upper.square, &place, limestone);
            }
            site.model.place(&upper.shaft, &place, marble);
        }
    }
    for (x, z) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        let corner = |y: f64| at(x * COURT[0], y, z * COURT[1]);
        site.model.place(&pier(site.detail, 0.36, SPRINGING), &corner(0.0), limestone);
        let height = UPPER_SPRINGING - GALLERY + 0.05;
        site.model.place(&pier(site.detail, 0.27, height), &corner(GALLERY - 0.05), limestone);
    }
}

/// A column on the origin: turned and square parts.
struct Column {
    shaft: Part,
    square: Part,
}

impl Column {
    /// A column of that lower radius and height; `order` scales base and capital.
    fn new(detail: Detail, radius: f64, height: f64, order: f64) -> Self {
        if detail.is_below(0.17) {
            return Self::plain(radius, height, order);
        }
        let r = radius;
        let [plinth, abacus] = [0.13 * order, 0.14 * order];
        let (foot, neck, top) = (plinth - 0.002, height - abacus - 0.30 * order, height - abacus + 0.002);
        let y = |fraction: f64| plinth + fraction * 0.24 * order;
        let profile = Outline::from(1.20 * r, foot, detail)
            .to(1.26 * r, foot)
            .arc(1.26 * r, y(0.36), 0.9, 4.0)
            .to(1.20 * r, y(0.42))
            .arc(1.13 * r, y(0.66), -0.7, 2.0)
            .to(1.15 * r, y(0.70))
            .arc(1.15 * r, y(0.92), 0.9, 3.0)
            .to(1.06 * r, y(1.0))
            .arc(r, y(1.22), -0.41, 2.0);
        // Entasis: the shaft swells a little before it narrows.
        let shaft = |fraction: f64| {
            let along = y(1.22) + fraction * (neck - 0.05 - y(1.22));
            [r * (1.0 - 0.15 * fraction * fraction + 0.02 * (std::f64::consts::PI * fraction).sin()), along]
        };
        let profile = profile.through(&[shaft(0.5), shaft(1.0)], 1.0);
        let [bell, lip] = [0.86 * r, 1.32 * r];
        let profile = profile
            .to(0.98 * r, neck - 0.05)
            .arc(0.98 * r, neck, 0.9, 3.0)
            .to(bell, neck)
            .through(
                &[[bell, neck + 0.12 * order], [0.98 * r, neck + 0.22 * order], [lip, top - 0.02 * order]],
                1.0,
            )
            .to(lip, top);
        let cuts = detail.cuts(25.0, 5);
        let shaft = turned(&profile.points(), cuts).smooth_round(cuts);
        Self { shaft, square: square(detail, 1.36 * r, [0.0, plinth], 1.46 * r, [height - abacus, height]) }
    }

    /// Base, shaft and bell as three cones of six sides, under a square abacus.
    fn plain(r: f64, height: f64, order: f64) -> Self {
        let (under, neck) = (height - 0.14 * order, height - 0.44 * order);
        let profile =
            [[1.5 * r, -0.002], [1.02 * r, 0.42 * order], [0.88 * r, neck], [1.36 * r, under + 0.002]];
        let shaft = turned(&profile.map(DVec2::from), 6).smooth_round(6);
        let half = 1.46 * r;
        let abacus = block([-half, under, -half], [half, height + 0.004, half]);
        Self { shaft, square: abacus.smooth() }
    }

    /// A column with fewer members.
    fn slender(detail: Detail, r: f64, height: f64) -> Self {
        let (foot, neck, top) = (0.08, height - 0.26, height - 0.085);
        if detail.is_below(0.25) {
            let profile = [[1.4 * r, 0.0], [1.1 * r, 0.12], [0.86 * r, neck], [1.7 * r, height + 0.004]];
            let shaft =
                turned(&profile.map(DVec2::from), 4).moved(&DAffine3::from_rotation_y(FRAC_PI_4)).smooth();
            return Self { shaft, square: Part::default() };
        }
        let profile = Outline::from(1.28 * r, foot - 0.002, detail)
            .arc(1.22 * r, foot + 0.06, 0.8, 2.0)
            .to(1.10 * r, foot + 0.08)
            .to(r, foot + 0.13)
            .through(&[[0.97 * r, 0.5 * height], [0.86 * r, neck]], 1.0)
            .arc(0.86 * r, neck + 0.035, 0.9, 2.0)
            .to(0.80 * r, neck + 0.035)
            .through(&[[0.86 * r, neck + 0.10], [1.34 * r, top]], 1.0);
        let cuts = detail.cuts(17.0, 4);
        let shaft = turned(&profile.points(), cuts).smooth_round(cuts);
        Self { shaft, square: square(detail, 1.34 * r, [0.0, foot], 1.44 * r, [top - 0.002, height]) }
    }
}

/// Plinth and abacus: mouldings turned in four cuts.
fn square(detail: Detail, foot: f64, [y0, y1]: [f64; 2], head: f64, [y2, y3]: [f64; 2]) -> Part {
    let diagonal = std::f64::consts::SQRT_2;
    let plinth = Outline::from(diagonal * foot, y0 - 0.002, detail).to(diagonal * foot, y1).points();
    let hollow = y2 + 0.55 * (y3 - y2);
    let abacus = Outline::from(0.86 * diagonal * head, y2, detail)
        .arc(diagonal * 0.97 * head, hollow, -0.41, 2.0)
        .to(diagonal * head, hollow)
        .to(diagonal * head, y3 + 0.004)
        .points();
    let quarter = DAffine3::from_rotation_y(FRAC_PI_4);
    let mut both = turned(&plinth, 4);
    both.join(turned(&abacus, 4));
    both.moved(&quarter).smooth()
}

/// A square pier with foot and head, half as wide as `half`.
pub(super) fn pier(detail: Detail, half: f64, height: f64) -> Part {
    let h = half * std::f64::consts::SQRT_2;
    if detail.is_below(0.195) {
        return plain_pier(h, height);
    }
    let profile = Outline::from(1.22 * h, -0.002, detail)
        .to(1.22 * h, 0.16)
        .arc(h, 0.30, -0.41, 2.0)
        .to(h, height - 0.32)
        .to(1.07 * h, height - 0.30)
        .to(h, height - 0.28)
        .to(h, height - 0.20)
        .arc(1.2 * h, height - 0.08, -0.41, 2.0)
        .to(1.24 * h, height - 0.08)
        .to(1.24 * h, height + 0.004);
    let quarter = DAffine3::from_rotation_y(FRAC_PI_4);
    turned(&profile.points(), 4).moved(&quarter).smooth()
}

/// A pier with a splayed foot and head, without mouldings; `h` is half its diagonal.
fn plain_pier(h: f64, height: f64) -> Part {
    let profile = [
        [1.22 * h, -0.002],
        [h, 0.30],
        [h, height - 0.24],
        [1.24 * h, height - 0.08],
        [1.24 * h, height + 0.004],
    ];
    let quarter = DAffine3::from_rotation_y(FRAC_PI_4);
    turned(&profile.map(DVec2::from), 4).moved(&quarter).smooth()
}

/// A leaf of a capital, its tip rolled outwards; the origin is on the axis under the abacus.
fn acanthus(detail: Detail) -> Part {
    let cells = [detail.cuts(2.0, 2), detail.cuts(4.0, 2)];
    let middle = |u: f64, v: f64| -> DVec3 {
        let across = 2.0 * u - 1.0;
        let width = 0.085 * (1.0 - 0.25 * v) * (1.0 - 0.45 * (v - 0.75).max(0.0) / 0.25);
        let lean = 0.245 + 0.03 * v + 0.10 * v.powi(4);
        let rise = -0.28 + 0.23 * v - 0.05 * ((v - 0.72).max(0.0) / 0.28).powi(2);
        dvec3(lean - 0.02 * across * across, rise, -across * width)
    };
    leaf(cells, |_| 0.022, middle).smooth_below(70.0)
}
