//! The upper gallery: floor, balustrade, ceiling with beams, doors, and the roof of
//! pantiles over it.

use std::f64::consts::TAU;

use glam::{DVec3, dvec3};

use super::walk::{OUTER, flat};
use super::{COURT, EAVES, GALLERY, Site, around, sides, turn};
use crate::joinery::{Door, door};
use crate::model::at;
use crate::moulding::{drawn, mitred, rod};
use crate::outline::{Outline, rectangle};
use crate::panel::{block, lines, panel};
use crate::sheet::sheet;
use crate::turning::turned;

/// Distance of the columns, and height of the course on which they stand.
const BAY: f64 = 1.5;
const PLINTH: f64 = 0.12;

pub(super) fn build(site: &mut Site) {
    floors(site);
    balustrade(site);
    let shape = Door { width: 1.0, height: 2.25, panels: [1, 2] };
    let leaf = door(site.detail, shape);
    let pilaster = block([-0.16, -0.01, -0.11], [0.16, EAVES - GALLERY, 0.03]).smooth();
    for side in sides() {
        let bays = (2.0 * side.half / (2.0 * BAY)).round() as usize;
        for bay in 0..=bays {
            let x = -side.half + 2.0 * BAY * bay as f64;
            if site.detail.is_below(0.33) {
                continue;
            }
            site.model.place(&pilaster, &(side.place * at(x, GALLERY, OUTER)), site.finishes.limestone);
            if bay < bays && bay % 2 == 1 {
                let place = side.place * at(x + BAY, GALLERY, OUTER) * turn(180.0);
                let finishes = [site.finishes.oak, site.finishes.limestone, site.finishes.bronze];
                site.model.place_in(&leaf, &place, &finishes);
            }
        }
    }
    roof(site);
}

/// The gallery's floor and its ceiling: plates with the court left open; beams under the ceiling.
fn floors(site: &mut Site) {
    let line =
        |half: f64, inner: f64| [-half - OUTER - 0.02, inner - half, half - inner, half + OUTER + 0.02];
    for (y, inner, thickness) in [(GALLERY - 0.003, 0.24, 0.15), (EAVES + 0.15, 0.16, 0.16)] {
        let [xs, ys] = COURT.map(|half| line(half, inner));
        let is_open = |i: usize, j: usize| i == 1 && j == 1;
        let plate = panel(&xs, &ys, [-thickness, 0.0], |i, j| (!is_open(i, j)).then_some(0)).moved(&flat(y));
        let finish = if y > EAVES { site.finishes.oak } else { site.finishes.flagstone };
        site.model.add(plate, finish);
    }
    let beam = block([-0.08, EAVES - 0.19, 0.15], [0.08, EAVES + 0.01, OUTER + 0.01]).smooth();
    for side in sides() {
        let count = (2.0 * side.half / BAY).round() as usize;
        for number in 1..if site.detail.is_below(0.3) { 0 } else { count } {
            let place = side.place * at(-side.half + BAY * number as f64, 0.0, 0.0);
            site.model.place(&beam, &place, site.finishes.oak);
        }
    }
}

fn balustrade(site: &mut Site) {
    let detail = site.detail;
    let course = rectangle([-0.18, -0.02], [0.18, PLINTH]);
    let ring = drawn(&course, &mitred(&around(0.0, GALLERY), DVec3::Y, true), true);
    site.model.add(ring, site.finishes.limestone);
    if detail.is_below(0.205) {
        return parapet(site);
    }
    let profile = Outline::from(0.05, PLINTH - 0.002, detail)
        .to(0.05, PLINTH + 0.05)
        .to(0.028, PLINTH + 0.08)
        .through(&[[0.060, PLINTH + 0.22], [0.026, PLINTH + 0.50]], 1.49)
        .to(0.045, PLINTH + 0.58)
        .to(0.045, PLINTH + 0.67);
    let cuts = detail.cuts(7.0, 4);
    let baluster = turned(&profile.points(), cuts).smooth_round(cuts);
    let section = Outline::from(-0.06, PLINTH + 0.66, detail)
        .to(0.06, PLINTH + 0.66)
        .to(0.09, PLINTH + 0.70)
        .to(0.09, PLINTH + 0.74)
        .arc(0.06, PLINTH + 0.78, 0.41, 2.0)
        .to(-0.06, PLINTH + 0.78)
        .arc(-0.09, PLINTH + 0.74, 0.41, 2.0)
        .to(-0.09, PLINTH + 0.70)
        .to(-0.06, PLINTH + 0.66);
    let mut section = section.points();
    section.pop();
    let ends = [dvec3(-0.5 * BAY + 0.09, 0.0, 0.0), dvec3(0.5 * BAY - 0.09, 0.0, 0.0)];
    let rail = if detail.is_below(0.36) {
        block([-0.66, PLINTH + 0.66, -0.09], [0.66, PLINTH + 0.78, 0.09]).smooth()
    } else {
        drawn(&section, &mitred(&ends, DVec3::Y, false), false).smooth()
    };
    let count = if detail.is_below(0.4) { 0 } else { 3 };
    let filling = block([-0.66, PLINTH - 0.01, -0.025], [0.66, PLINTH + 0.67, 0.025]).smooth();
    for side in sides() {
        for bay in 0..(2.0 * side.half / BAY).round() as usize {
            let place = side.place * at(-side.half + BAY * (bay as f64 + 0.5), GALLERY, 0.0);
            site.model.place(&rail, &place, site.finishes.limestone);
            if count == 0 {
                site.model.place(&filling, &place, site.finishes.marble);
            }
            for number in 0..count {
                let x = 1.12 * ((number as f64 + 0.5) / count as f64 - 0.5);
                site.model.place(&baluster, &(place * at(x, 0.0, 0.0)), site.finishes.marble);
            }
        }
    }
}

/// Replaces the balusters of a coarse model: a thin wall and its rail, which run around the court
/// through the columns.
fn parapet(site: &mut Site) {
    let path = mitred(&around(0.0, GALLERY), DVec3::Y, true);
    let wall = drawn(&rectangle([-0.025, PLINTH - 0.01], [0.025, PLINTH + 0.67]), &path, true);
    site.model.add(wall, site.finishes.marble);
    let rail = drawn(&rectangle([-0.08, PLINTH + 0.66], [0.08, PLINTH + 0.78]), &path, true);
    site.model.add(rail, site.finishes.limestone);
}

fn roof(site: &mut Site) {
    let detail = site.detail;
    let [eaves, ridge] = [[-0.72, EAVES + 0.43], [OUTER + 0.2, EAVES + 1.5]];
    for side in sides() {
        // A coarse roof is flat, as high as its crests.
        let usual = (2.0 * side.half / 0.27).round() as usize;
        let tiles = if detail.is_below(0.15) { 0 } else { detail.count(usual, 8) };
        // Crests and hollows need four segments each.
        let cells = [(tiles * detail.cuts(4.0, 2)).max(1), detail.cuts(1.0, 1)];
        let tiles = sheet(cells, 0.03, |u, v| {
            let z = eaves[0] + v * (ridge[0] - eaves[0]);
            let wave = 0.045 * (TAU * tiles as f64 * u).cos();
            // Tiles run downwards, front up: v from the ridge.
            dvec3((1.0 - 2.0 * u) * (side.half + z), eaves[1] + v * (ridge[1] - eaves[1]) + wave, z)
        });
        site.model.place(&tiles.smooth_below(80.0), &side.place, site.finishes.terracotta);
    }
    for (x, z) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        let corner =
            |[outside, y]: [f64; 2]| dvec3(x * (COURT[0] + outside), y + 0.03, z * (COURT[1] + outside));
        let path = lines(0.0, 1.0, 2);
        let path: Vec<DVec3> = path.iter().map(|&t| corner(eaves).lerp(corner(ridge), t)).collect();
        let hip = rod(&path, detail.cuts(10.0, 5), false, |_| 0.11);
        site.model.add(hip, site.finishes.terracotta);
    }
}
