//! The bookcase, its books, and other objects in it.

use glam::{DAffine3, DVec3, dvec2, dvec3};

use super::{HALF, Site};
use crate::model::{at, turn};
use crate::moulding::{Frame, drawn, mitred, plate};
use crate::outline::{Detail, Outline};
use crate::panel::{block, panel};
use crate::rng::Rng;
use crate::solid::Part;
use crate::turning::turned;

/// Its left end along the back wall, width, height and depth, metres.
const LEFT: f64 = -1.85;
const SIZE: [f64; 3] = [2.0, 2.25, 0.30];
const SHELVES: usize = 6;
const BOARD: f64 = 0.024;

pub(super) fn build(site: &mut Site) {
    let place = at(LEFT, 0.0, -HALF[1] + 0.021);
    carcass(site, &place);
    let mut rng = Rng::new(11);
    let (width, rise) = (SIZE[0] / 2.0, (SIZE[1] - 0.12) / SHELVES as f64);
    for module in 0..2 {
        for shelf in 0..SHELVES {
            let x = width * f64::from(module) + if module == 0 { BOARD } else { 0.5 * BOARD };
            let room = width - 1.5 * BOARD;
            let y = 0.12 + rise * shelf as f64 + 0.5 * BOARD;
            let place = place * at(x, y, 0.0);
            let ornament = matches!((module, shelf), (0, 4) | (1, 2) | (1, 5));
            let filled = if ornament { 0.62 * room } else { room - rng.between(0.01, 0.16) };
            row(site, &place, filled, rise - BOARD, &mut rng);
            if ornament {
                let p = place * at(filled + 0.5 * (room - filled), 0.0, 0.16);
                let pot = vessel(site.detail, 0.075, 0.20 + 0.02 * f64::from(module)).smooth();
                let finish = if module == 0 { site.finishes.glaze } else { site.finishes.porcelain };
                site.model.place(&pot, &p, finish);
            }
        }
    }
}

/// Sides, shelves and plinth in one piece, the back, and a cornice.
fn carcass(site: &mut Site, place: &DAffine3) {
    let [width, height, depth] = SIZE;
    let xs = [0.0, BOARD, 0.5 * width - 0.5 * BOARD, 0.5 * width + 0.5 * BOARD, width - BOARD, width];
    let mut ys = vec![-0.002];
    let rise = (height - 0.12) / SHELVES as f64;
    for shelf in 0..=SHELVES {
        let y = 0.12 + rise * shelf as f64;
        ys.extend([if shelf == 0 { 0.06 } else { y - 0.5 * BOARD }, y + 0.5 * BOARD]);
    }
    let is_board = |i: usize, j: usize| (i.is_multiple_of(2) || j % 2 == 1).then_some(0);
    let carcass =
        panel(&xs, &ys, [0.0, depth], |i, j| if j == 0 { Some(0) } else { is_board(i, j) }).smooth();
    site.model.place(&carcass, place, site.finishes.walnut);
    let back = block([0.01, 0.01, -0.018], [width - 0.01, height - 0.01, 0.008]).smooth();
    site.model.place(&back, place, site.finishes.walnut);
    let cornice = Outline::from(-0.01, -0.03, site.detail)
        .to(0.006, -0.03)
        .cavetto(0.03, 0.0)
        .to(0.036, 0.0)
        .ovolo(0.046, 0.018)
        .to(0.046, 0.024)
        .to(-0.01, 0.024);
    let path =
        [[width, 0.0], [width, depth], [0.0, depth], [0.0, 0.0]].map(|[x, z]| dvec3(x, height + 0.015, z));
    // The path around the front has the bookcase on its right.
    let frames = mitred(&path.map(|p| dvec3(p.x, p.y, p.z)), DVec3::Y, false);
    let frames: Vec<Frame> = frames.into_iter().map(|f| Frame { u: -f.u, ..f }).rev().collect();
    let cornice = drawn(&cornice.points(), &frames, false).smooth();
    site.model.place(&cornice, place, site.finishes.walnut);
}

/// Books along x from the origin, over that width, on a shelf of that height.
fn row(site: &mut Site, place: &DAffine3, width: f64, room: f64, rng: &mut Rng) {
    let mut x = 0.004;
    let tall = rng.between(0.72, 0.9) * room;
    let thick = if site.detail.is_below(0.3) { 1.9 } else { 1.0 };
    while x < width - 0.06 {
        // Sets stand together: some books of one size and colour.
        let volumes = if rng.fraction() < 0.25 { 2 + rng.pick(4) } else { 1 };
        let size =
            dvec3(thick * rng.between(0.018, 0.05), tall * rng.between(0.72, 1.1), rng.between(0.15, 0.215));
        let book = book(site.detail, size);
        let cover = site.finishes.covers[rng.pick(6)];
        for _ in 0..volumes {
            if x + size.x > width {
                break;
            }
            let shove = rng.between(0.0, 0.022);
            let lean = if x + 2.6 * size.x > width { 4.0 } else { rng.between(-0.3, 0.3) };
            let place = place
                * at(x + if lean > 1.0 { 0.02 } else { 0.0 }, 0.001, 0.255 - shove)
                * DAffine3::from_rotation_z(f64::to_radians(lean));
            site.model.place_in(&book, &place, &[cover, site.finishes.paper]);
            x += size.x + 0.0015;
        }
        x += rng.between(0.0, 0.004);
    }
}

/// A book that stands on the origin with its spine to +z and its width along +x.
/// Finishes: cover, paper.
pub(super) fn book(detail: Detail, size: DVec3) -> Part {
    if detail.is_below(0.4) {
        return block([0.0, 0.0, -size.z], [size.x, size.y, 0.0]).smooth();
    }
    const BOARD: f64 = 0.0028;
    let (w, d) = (size.x, size.z);
    // Seen from above, with z upwards in the plane: counter-clockwise around the boards and
    // the rounded spine.
    let outline = Outline::from(0.0, -d, detail)
        .to(BOARD, -d)
        .to(BOARD, -0.006)
        .arc(w - BOARD, -0.006, -0.3, 2.0)
        .to(w - BOARD, -d)
        .to(w, -d)
        .to(w, -0.004)
        .arc(0.0, -0.004, 0.3, 3.0);
    // The plane's y is -z, so it is left-handed seen from above and needs the opposite winding.
    let outline: Vec<_> = outline.points.into_iter().map(|p| dvec2(p.x, -p.y)).rev().collect();
    let frame = Frame { origin: DVec3::ZERO, u: DVec3::X, v: DVec3::NEG_Z };
    let mut book = plate(&outline, frame, size.y);
    book.finish_as(0);
    let pages = block([BOARD - 0.0005, 0.004, 0.004 - d], [w - BOARD + 0.0005, size.y - 0.004, -0.008]);
    book.join(pages);
    book.finish_as(1);
    book.smooth_below(50.0)
}

/// A small vase of that radius and height.
pub(super) fn vessel(detail: Detail, r: f64, h: f64) -> crate::solid::Solid {
    let profile = Outline::from(0.5 * r, 0.0, detail)
        .to(0.55 * r, 0.0)
        .through(&[[0.98 * r, 0.30 * h], [0.9 * r, 0.55 * h], [0.42 * r, 0.80 * h], [0.5 * r, 0.97 * h]], 3.0)
        .arc(0.42 * r, 0.97 * h, 0.9, 3.0)
        .through(&[[0.34 * r, 0.80 * h], [0.3 * r, 0.7 * h]], 2.0);
    turned(&profile.points(), detail.cuts(24.0, 7))
}

/// Books lying on each other, on the origin.
pub(super) fn stack(site: &mut Site, place: &DAffine3, count: usize, rng: &mut Rng) {
    let mut y = 0.0005;
    for number in 0..count {
        let size = dvec3(rng.between(0.02, 0.04), rng.between(0.21, 0.27), rng.between(0.15, 0.18));
        let book = book(site.detail, size);
        let cover = site.finishes.covers[rng.pick(6)];
        // Laid on its side: its width becomes its height.
        let lie = turn(rng.between(-16.0, 16.0) + 90.0 * (number % 2) as f64)
            * at(-0.5 * size.y, size.x, 0.5 * size.z)
            * DAffine3::from_rotation_z(-std::f64::consts::FRAC_PI_2);
        site.model.place_in(&book, &(*place * at(0.0, y, 0.0) * lie), &[cover, site.finishes.paper]);
        y += size.x + 0.0008;
    }
}
