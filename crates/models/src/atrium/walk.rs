//! The walk behind the lower arcade: floor, outer wall, groin vaults between ribs, doors.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::{DAffine3, DVec3, dvec3};

use super::columns::pier;
use super::{BAY, COURT, GALLERY, SPRINGING, Side, Site, WALK, WALL, around, sides};
use crate::joinery::{Door, door};
use crate::model::at;
use crate::moulding::{Frame, drawn, mitred};
use crate::outline::{Outline, rectangle};
use crate::panel::{lines, panel};
use crate::sheet::slab;
use crate::solid::Solid;

/// The outer wall's face, from the columns' axes.
pub(super) const OUTER: f64 = 0.5 * WALL + WALK;
/// Top of the outer wall.
const TOP: f64 = 10.55;
/// From the columns' axes to the edge of the walk.
pub(super) const EDGE: f64 = 0.5;

pub(super) fn build(site: &mut Site) {
    floor(site);
    outer_wall(site);
    vaults(site);
    let frames = Door { width: 1.25, height: 2.5, panels: [2, 3] };
    let leaf = door(site.detail, frames);
    for side in sides() {
        let bays = (2.0 * side.half / BAY).round() as i32;
        for bay in (0..bays).filter(|bay| (bay - bays / 2) % 3 == 0) {
            let x = -side.half + BAY * (f64::from(bay) + 0.5);
            let place = side.place * at(x, 0.0, OUTER) * super::turn(180.0);
            site.model.place_in(
                &leaf,
                &place,
                &[site.finishes.oak, site.finishes.limestone, site.finishes.bronze],
            );
        }
    }
}

/// Lays a panel of the xy plane flat: its front looks up, its y runs towards -z.
pub(super) fn flat(y: f64) -> DAffine3 {
    at(0.0, y, 0.0) * DAffine3::from_rotation_x(-FRAC_PI_2)
}

/// Flagstones around the court.
fn floor(site: &mut Site) {
    let line = |half: f64, cells: usize, beside: usize| {
        let mut all = lines(-half - OUTER - 0.02, -half + EDGE, beside);
        all.pop();
        all.extend(lines(-half + EDGE, half - EDGE, cells));
        all.pop();
        all.extend(lines(half - EDGE, half + OUTER + 0.02, beside));
        all
    };
    let (along, across, beside) = match site.detail {
        detail if detail.is_below(0.18) => (12, 5, 2),
        detail if detail.is_below(0.22) => (16, 6, 3),
        _ => (32, 11, 5),
    };
    let [xs, ys] = [line(COURT[0], along, beside), line(COURT[1], across, beside)];
    let (nx, ny) = (xs.len() - 1, ys.len() - 1);
    let finish = |i: usize, j: usize| {
        let edge = i.min(nx - 1 - i).min(j.min(ny - 1 - j));
        match edge {
            _ if edge >= beside => None,
            _ if edge + 1 == beside => Some(2),
            _ => Some(u8::from((i + j).is_multiple_of(2))),
        }
    };
    let floor = panel(&xs, &ys, [-0.25, 0.0], finish).moved(&flat(0.0));
    let f = &site.finishes;
    site.model.add_in(floor, &[f.flagstone, f.terracotta, f.limestone]);
}

/// One ring, with its skirting and a moulding at the foot of the vaults.
fn outer_wall(site: &mut Site) {
    let wall = |low: f64, high: f64| rectangle([-0.25, low], [0.0, high]);
    let levels = [-0.3, GALLERY, TOP];
    let ring =
        |section: &[glam::DVec2], y: f64| drawn(section, &mitred(&around(OUTER, y), DVec3::Y, true), true);
    let mut section = wall(levels[0], levels[2]);
    section.insert(2, glam::dvec2(0.0, levels[1]));
    site.model.add(ring(&section, 0.0), site.finishes.plaster);
    let skirting = Outline::from(-0.02, -0.02, site.detail)
        .to(0.045, -0.02)
        .to(0.045, 0.16)
        .cavetto(0.015, 0.22)
        .to(-0.02, 0.22)
        .points();
    for y in [0.0, GALLERY] {
        site.model.add(ring(&skirting, y), site.finishes.limestone);
    }
    let impost = Outline::from(-0.02, -0.16, site.detail)
        .to(0.02, -0.16)
        .cavetto(0.08, -0.06)
        .to(0.08, 0.0)
        .to(-0.02, 0.0)
        .points();
    site.model.add(ring(&impost, SPRINGING - 0.01), site.finishes.limestone);
}

fn vaults(site: &mut Site) {
    let cuts = 2 * site.detail.cuts(3.0, 1);
    let strips = sides().map(|side| {
        let bays = (2.0 * side.half / BAY).round() as usize;
        (side.place * at(-side.half, 0.0, 0.5 * WALL), bays)
    });
    for (place, bays) in strips {
        let vault = vault(bays, cuts).smooth();
        site.model.place(&vault, &place, site.finishes.vault);
    }
    let corner = vault(1, cuts).smooth();
    let [x, z] = COURT.map(|half| half + 0.5 * WALL);
    for [x, z] in [[x, z], [-x - WALK, z], [x, -z - WALK], [-x - WALK, -z - WALK]] {
        site.model.place(&corner, &at(x, 0.0, z), site.finishes.vault);
    }
    let rib_of = |width: f64| rib(site, width).smooth();
    let [narrow, wide] = [rib_of(0.36), rib_of(0.62)];
    let pilaster = pier(site.detail, 0.2, SPRINGING);
    for side in sides() {
        let Side { place, half } = side;
        let bays = (2.0 * half / BAY).round() as usize;
        for number in 0..=bays {
            // Ribs in the corners stand behind the piers and close the gaps of the walls
            // between the vaults.
            let (rib, shift) = match number {
                0 => (&wide, -0.25 * WALL),
                _ if number == bays => (&wide, 0.25 * WALL),
                _ if site.detail.is_below(0.3) => continue,
                _ => (&narrow, 0.0),
            };
            let place = place * at(-half + BAY * number as f64 + shift, 0.0, 0.0);
            site.model.place(
                rib,
                &(place * at(0.0, SPRINGING, 0.5 * (WALL + WALK))),
                site.finishes.limestone,
            );
            if site.detail.is_below(0.35) {
                continue;
            }
            site.model.place(&pilaster, &(place * at(0.0, 0.0, OUTER)), site.finishes.limestone);
        }
    }
}

/// Groin vaults over square bays in a row along x, the walk in z. The origin is the first corner,
/// at floor level.
fn vault(bays: usize, cuts: usize) -> Solid {
    let radius = 0.5 * BAY;
    // Equal angles across the barrel, so that the grid's diagonals are the groins.
    let step = |fraction: f64| -(PI * fraction).cos() * radius;
    let height = |offset: f64| (radius * radius - offset * offset).max(0.0).sqrt();
    let split = |u: f64| {
        let line = (u * (bays * cuts) as f64).round() as usize;
        (line / cuts, (line % cuts) as f64 / cuts as f64)
    };
    let along = |u: f64| {
        let (bay, fraction) = split(u);
        (BAY * bay as f64 + radius + step(fraction), step(fraction))
    };
    let front = |u: f64, v: f64| {
        let ((x, dx), dz) = (along(u), step(v));
        dvec3(x, SPRINGING + height(dx).max(height(dz)), radius + dz)
    };
    let back = |u: f64, v: f64| dvec3(along(u).0, GALLERY - 0.08, radius + step(v));
    slab([bays * cuts, cuts], front, back)
}

/// A transverse arch across the walk, around the middle of its springing line.
fn rib(site: &Site, width: f64) -> Solid {
    let (half, radius, cuts) = (0.5 * width, 0.5 * WALK, site.detail.cuts(12.0, 5));
    // Chamfered unless the model is coarse.
    let chamfer = if site.detail.is_below(0.14) { 0.0 } else { 0.05 };
    let section = Outline::from(0.04, half, site.detail)
        .to(-0.07, half)
        .to(-0.11, half - chamfer)
        .to(-0.11, chamfer - half)
        .to(-0.07, -half)
        .to(0.04, -half)
        .points();
    let frames: Vec<Frame> = (0..=cuts)
        .map(|cut| {
            let angle = PI * (1.0 - cut as f64 / cuts as f64);
            let radial = dvec3(0.0, angle.sin(), angle.cos());
            Frame { origin: radius * radial, u: radial, v: DVec3::NEG_X }
        })
        .collect();
    drawn(&section, &frames, false)
}
