//! Framed pictures: layers of painted board behind one another, the nearest lowest.

use std::f64::consts::TAU;

use glam::{DAffine3, DVec3, dvec3};

use super::{HALF, Site};
use crate::model::{Finish, at, turn};
use crate::moulding::{drawn, mitred};
use crate::outline::Outline;
use crate::panel::block;
use crate::sheet::slab;
use crate::turning::turned;

pub(super) fn build(site: &mut Site) {
    let [x, z] = HALF;
    let right = |z: f64, y: f64| at(x, y, z) * turn(-90.0);
    let corridor = at(5.0, 1.55, 0.10) * turn(-90.0);
    for (number, (place, [w, h], frame)) in [
        (right(-1.42, 1.62), [0.84, 0.60], site.finishes.brass),
        (right(1.75, 1.60), [0.5, 0.66], site.finishes.walnut),
        (corridor, [0.56, 0.72], site.finishes.walnut),
        (at(-x, 1.6, 0.2) * turn(90.0), [1.1, 0.74], site.finishes.brass),
        (at(0.6, 1.6, z) * turn(180.0), [0.9, 0.62], site.finishes.walnut),
    ]
    .into_iter()
    .enumerate()
    {
        landscape(site, &place, [w, h], frame, number as f64);
    }
}

/// A landscape of that width and height, its middle on the origin of a wall that looks to +z.
fn landscape(site: &mut Site, place: &DAffine3, [w, h]: [f64; 2], frame: Finish, seed: f64) {
    let detail = site.detail;
    let (x, y) = (0.5 * w, 0.5 * h);
    let path = [[x, -y], [x, y], [-x, y], [-x, -y]].map(|[x, y]| dvec3(x, y, 0.0));
    let section = Outline::from(-0.055, -0.006, detail)
        .to(0.004, -0.006)
        .to(0.004, 0.014)
        .cavetto(-0.016, 0.024)
        .to(-0.022, 0.024)
        .to(-0.036, 0.032)
        .ovolo(-0.055, 0.018);
    let section = section.points();
    let moulding = drawn(&section, &mitred(&path, DVec3::Z, true), true).smooth();
    site.model.place(&moulding, place, frame);
    let [sky, hills, field, sun] = site.finishes.paints;
    let (x, y) = (x + 0.002, y + 0.002);
    site.model.place(&block([-x, -y, -0.004], [x, y, 0.001]).smooth(), place, sky);
    let disc = turned(&[[0.11 * h, 0.0], [0.11 * h, 0.0015]].map(glam::DVec2::from), detail.cuts(28.0, 8));
    let upright = at(0.22 * w, 0.20 * h, 0.0005) * DAffine3::from_rotation_x(0.5 * std::f64::consts::PI);
    site.model.place(&disc.smooth(), &(*place * upright), sun);
    let ridge = |level: f64, rough: f64, phase: f64| {
        move |u: f64| {
            h * (level + rough * ((TAU * 0.9 * u + phase).sin() + 0.4 * (TAU * 2.3 * u + 2.0 * phase).sin()))
        }
    };
    let layers = [(ridge(0.08, 0.09, seed), hills, 0.003), (ridge(-0.16, 0.05, 1.7 + seed), field, 0.005)];
    let cells = [detail.cuts(22.0, if detail.is_below(0.17) { 4 } else { 6 }), detail.cuts(1.0, 1)];
    for (top, finish, depth) in layers {
        let face = |z: f64| {
            let top = &top;
            move |u: f64, v: f64| dvec3(x * (2.0 * u - 1.0), -y + v * (top(u) + y), z)
        };
        let layer = slab(cells, face(depth), face(depth - 0.0045)).smooth();
        site.model.place(&layer, place, finish);
    }
}
