//! The sofa, its cushions, and the plant beside it.

use glam::{DAffine3, DVec3, dvec3};

use super::{HALF, Site};
use crate::cushion::{cushion, edge_cuts, rounded};
use crate::model::{at, turn};
use crate::moulding::rod;
use crate::outline::Detail;
use crate::plants::{tree, urn};
use crate::solid::Part;
use crate::turning::turned;

/// Half its length, and where it stands.
const LENGTH: f64 = 1.05;
const PLACE: [f64; 2] = [1.75, -HALF[1] + 0.72];

pub(super) fn build(site: &mut Site) {
    let detail = site.detail;
    let place = at(PLACE[0], 0.0, PLACE[1]) * turn(-2.0);
    let part = |half: [f64; 3], radius: f64, swell: f64| soft(detail, half, radius, swell);
    let blue = site.finishes.upholstery;
    let base = part([LENGTH, 0.10, 0.43], 0.035, 0.0);
    site.model.place(&base, &(place * at(0.0, 0.22, 0.0)), blue);
    let back = part([LENGTH - 0.02, 0.30, 0.09], 0.06, 0.0);
    let lean = DAffine3::from_rotation_x(-0.12);
    site.model.place(&back, &(place * at(0.0, 0.56, -0.36) * lean), blue);
    let arm = part([0.10, 0.24, 0.44], 0.07, 0.0);
    let seat = part([(LENGTH - 0.13) / 3.0 - 0.004, 0.075, 0.34], 0.05, 0.022);
    let support = part([(LENGTH - 0.13) / 3.0 - 0.006, 0.19, 0.075], 0.055, 0.02);
    for sign in [-1.0, 1.0] {
        site.model.place(&arm, &(place * at(sign * (LENGTH - 0.03), 0.40, 0.0)), blue);
    }
    for number in -1..=1 {
        let x = f64::from(number) * 2.0 * (LENGTH - 0.13) / 3.0;
        site.model.place(&seat, &(place * at(x, 0.385, 0.08)), blue);
        let lean = DAffine3::from_rotation_x(-0.22);
        site.model.place(&support, &(place * at(x, 0.625, -0.215) * lean), blue);
    }
    let foot =
        turned(&[[0.018, -0.001], [0.026, 0.135]].map(glam::DVec2::from), detail.cuts(12.0, 5)).smooth();
    for [x, z] in [[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]] {
        let place = place * at(x * (LENGTH - 0.10), 0.0, z * 0.36);
        site.model.place(&foot, &place, site.finishes.walnut);
    }
    pillows(site, &place);
    let pot = urn(detail, 0.19, 0.36).smooth();
    let corner = at(HALF[0] - 0.34, 0.0, -HALF[1] + 0.34);
    site.model.place_in(&pot, &corner, &[site.finishes.porcelain, site.finishes.soil]);
    let plant = tree(detail, 1.15, 20, 9).smooth_below(60.0);
    site.model.place_in(&plant, &(corner * at(0.0, 0.32, 0.0)), &[site.finishes.walnut, site.finishes.leaf]);
}

/// A padded block.
fn soft(detail: Detail, half: [f64; 3], radius: f64, swell: f64) -> Part {
    let (edge, inside) = (edge_cuts(detail, 3.0), detail.cuts(if swell > 0.0 { 8.0 } else { 3.0 }, 1));
    let half = DVec3::from(half);
    if swell > 0.0 { cushion(half, radius, swell, edge, inside) } else { rounded(half, radius, edge, inside) }
        .smooth()
}

/// Pillows with corners drawn out, and a throw over an arm.
fn pillows(site: &mut Site, place: &DAffine3) {
    let detail = site.detail;
    let (edge, inside) = (detail.cuts(2.0, 1), detail.cuts(10.0, 2));
    let half = 0.21;
    // Flat, then blown up: thick in the middle, thin at the seam, which is drawn in between the
    // corners.
    let pillow = rounded(dvec3(half, 0.02, half), 0.015, edge, inside)
        .bend(|p| {
            let [u, v] = [p.x / half, p.z / half];
            let full = ((1.0 - u * u).max(0.0) * (1.0 - v * v).max(0.0)).powf(0.4);
            let draw = |along: f64| 1.0 - 0.09 * (1.0 - along * along).max(0.0);
            dvec3(p.x * draw(v), p.y * (0.35 + 3.4 * full), p.z * draw(u))
        })
        .smooth();
    for (number, [x, turned, roll]) in
        [[-0.66, 0.25, 0.10], [0.70, -0.30, -0.12], [0.42, -0.08, 0.05]].into_iter().enumerate()
    {
        let lean = DAffine3::from_rotation_x(1.17)
            * DAffine3::from_rotation_z(turned)
            * DAffine3::from_rotation_y(roll + if number == 2 { 0.4 } else { 0.0 });
        let depth = if number == 2 { 0.12 } else { 0.02 };
        let place = *place * at(x, 0.655, depth) * lean;
        site.model.place(&pillow, &place, site.finishes.pillows[number % 2]);
    }
    let piping: Vec<DVec3> = [-1.0, 1.0].map(|x| dvec3(x * (LENGTH - 0.15), 0.305, 0.432)).to_vec();
    let piping = rod(&piping, detail.cuts(8.0, 4), false, |_| 0.006).smooth();
    site.model.place(&piping, place, site.finishes.upholstery);
}
