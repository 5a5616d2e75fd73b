//! Dining table, coffee table, rug.

use glam::{DVec3, dvec3};

use super::bookcase::{stack, vessel};
use super::{Site, lamps::LAMP};
use crate::cushion::{edge_cuts, rounded};
use crate::model::{at, turn};
use crate::moulding::rod;
use crate::outline::{Detail, Outline};
use crate::panel::{block, lines, panel};
use crate::plants::agave;
use crate::rng::Rng;
use crate::solid::Part;
use crate::turning::turned;

/// Where the dining table stands: under the lamp.
pub(super) const DINING: [f64; 2] = [LAMP[0], LAMP[2]];
/// Half its top along x and z, and its height.
pub(super) const TOP: [f64; 2] = [0.80, 0.46];
pub(super) const TABLE_HEIGHT: f64 = 0.755;
/// Where the coffee table stands, and its height.
const COFFEE: [f64; 2] = [1.75, -0.62];
const COFFEE_HEIGHT: f64 = 0.42;

pub(super) fn build(site: &mut Site) {
    let detail = site.detail;
    let place = at(DINING[0], 0.0, DINING[1]);
    let (edge, inside) = (edge_cuts(detail, 2.0), detail.cuts(4.0, 1));
    let top = rounded(dvec3(TOP[0], 0.016, TOP[1]), 0.0155, edge, inside).smooth();
    site.model.place(&top, &(place * at(0.0, TABLE_HEIGHT - 0.016, 0.0)), site.finishes.walnut);
    let leg = turned_leg(detail, 0.038, TABLE_HEIGHT - 0.03);
    let [x, z] = [TOP[0] - 0.10, TOP[1] - 0.10];
    for [sx, sz] in [[1.0, 1.0], [-1.0, 1.0], [1.0, -1.0], [-1.0, -1.0]] {
        site.model.place(&leg, &(place * at(sx * x, 0.0, sz * z)), site.finishes.walnut);
    }
    let [low, high] = [TABLE_HEIGHT - 0.13, TABLE_HEIGHT - 0.03];
    for sign in [-1.0, 1.0] {
        let long = block([-x + 0.03, low, sign * z - 0.011], [x - 0.03, high, sign * z + 0.011]).smooth();
        let short = block([sign * x - 0.011, low, -z + 0.03], [sign * x + 0.011, high, z - 0.03]).smooth();
        site.model.place(&long, &place, site.finishes.walnut);
        site.model.place(&short, &place, site.finishes.walnut);
    }
    coffee_table(site);
    rug(site);
}

/// A turned leg with a square block at its head, standing on the origin.
pub(super) fn turned_leg(detail: Detail, r: f64, h: f64) -> Part {
    let profile = Outline::from(0.45 * r, -0.001, detail)
        .to(0.5 * r, -0.001)
        .through(&[[0.62 * r, 0.04 * h], [0.45 * r, 0.09 * h]], 2.0)
        .arc(0.45 * r, 0.13 * h, 0.9, 3.0)
        .through(
            &[[0.52 * r, 0.22 * h], [0.72 * r, 0.42 * h], [0.98 * r, 0.60 * h], [0.6 * r, 0.70 * h]],
            2.5,
        )
        .arc(0.6 * r, 0.74 * h, 0.9, 3.0)
        .through(&[[0.9 * r, 0.78 * h], [0.7 * r, 0.81 * h]], 2.0);
    let mut leg = turned(&profile.points(), detail.cuts(18.0, 5));
    leg.join(block([-r, 0.805 * h, -r], [r, h, r]));
    leg.smooth()
}

/// A round board on three bowed legs, with books and a plant.
fn coffee_table(site: &mut Site) {
    let detail = site.detail;
    let place = at(COFFEE[0], 0.0, COFFEE[1]);
    let (r, h) = (0.44, COFFEE_HEIGHT);
    let top =
        Outline::from(r - 0.03, h - 0.028, detail).arc(r, h - 0.010, 0.35, 3.0).arc(r - 0.008, h, 0.41, 3.0);
    let top = turned(&top.points(), detail.cuts(56.0, 12)).smooth();
    site.model.place(&top, &place, site.finishes.oak);
    let cuts = detail.cuts(14.0, 3);
    let bow = |t: f64| {
        dvec3(0.30 + 0.10 * (1.0 - t).powi(2) - 0.07 * (std::f64::consts::PI * t).sin(), t * (h - 0.02), 0.0)
    };
    let path: Vec<DVec3> = (0..=cuts).map(|cut| bow(cut as f64 / cuts as f64)).collect();
    let leg = rod(&path, detail.cuts(12.0, 4), false, |t| 0.013 + 0.009 * t).smooth();
    for number in 0..4 {
        site.model.place(&leg, &(place * turn(45.0 + 90.0 * f64::from(number))), site.finishes.oak);
    }
    let on = place * at(0.0, h, 0.0);
    stack(site, &(on * at(-0.17, 0.0, 0.08)), 3, &mut Rng::new(21));
    let vase = vessel(detail, 0.065, 0.16).smooth();
    let spot = on * at(0.14, 0.0005, -0.10);
    site.model.place(&vase, &spot, site.finishes.glaze);
    let plant = agave(detail, 0.24, 14, 5).smooth_below(60.0);
    site.model.place(&plant, &(spot * at(0.0, 0.13, 0.0)), site.finishes.leaf);
}

/// A woven rug with borders and a medallion, and fringes at its ends.
fn rug(site: &mut Site) {
    let detail = site.detail;
    let (nx, ny) = match detail {
        detail if detail.is_below(0.25) => (15, 9),
        detail if detail.is_below(0.28) => (31, 21),
        _ => (49, 33),
    };
    let [x, z] = [1.45, 0.95];
    let finish = |i: usize, j: usize| {
        let edge = i.min(nx - 1 - i).min(j.min(ny - 1 - j));
        let [u, v] =
            [(i as f64 + 0.5) / nx as f64, (j as f64 + 0.5) / ny as f64].map(|t| (2.0 * t - 1.0).abs());
        let diamond = 1.5 * u + v;
        Some(match edge {
            0 => 2,
            1 | 2 if nx > 20 => 1,
            3 if nx > 20 => 2,
            _ if (0.55..0.66).contains(&diamond) || diamond < 0.22 => 2,
            _ if diamond < 0.55 => 1,
            _ if (1.35..1.45).contains(&diamond) => 2,
            _ => 0,
        })
    };
    let rug = panel(&lines(-x, x, nx), &lines(-z, z, ny), [0.0005, 0.009], finish);
    let flat = rug.moved(&glam::DAffine3::from_rotation_x(-std::f64::consts::FRAC_PI_2));
    let place = at(1.7, 0.0, -0.55) * turn(-3.0);
    let flat = flat.smooth();
    site.model.place_in(&flat, &place, &site.finishes.rug);
    let mut rng = Rng::new(31);
    let strands = if detail.is_below(0.5) { 0 } else { detail.count(56, 8) };
    for number in 0..strands {
        let across = z * (2.0 * (number as f64 + 0.5) / strands as f64 - 1.0);
        for end in [-1.0, 1.0] {
            let drift = rng.between(-0.012, 0.012);
            let path =
                [0.0, 0.5, 1.0].map(|t| dvec3(end * (x - 0.004 + 0.075 * t), 0.0045, across + drift * t * t));
            let strand = rod(&path, detail.cuts(5.0, 3), false, |t| 0.0038 - 0.0015 * t).smooth_below(80.0);
            site.model.place(&strand, &place, site.finishes.rug[2]);
        }
    }
}
