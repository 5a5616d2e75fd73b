//! Floor, walls, ceiling, skirting and cornice of the room and its corridor, and the
//! doorway between them.

use glam::{DAffine3, DVec3, dvec3};

use super::{HALF, HEIGHT, Site};
use crate::joinery::{Door, architrave, leaf};
use crate::model::{Finish, at, turn};
use crate::moulding::{drawn, mitred};
use crate::outline::Outline;
use crate::panel::{block, lines, panel};
use crate::rng::Rng;

/// The corridor's walls across x, metres.
const CORRIDOR: [f64; 2] = [3.62, 5.0];
/// The doorway along z, and its height.
const DOORWAY: [f64; 2] = [-0.35, 0.55];
const DOOR_HEIGHT: f64 = 2.1;
/// The window along x and y.
pub(super) const WINDOW: [[f64; 2]; 2] = [[1.15, 2.65], [0.85, 2.3]];

pub(super) fn build(site: &mut Site) {
    walls(site);
    floors(site);
    mouldings(site);
    doorway(site);
}

fn walls(site: &mut Site) {
    let f = &site.finishes;
    let ([x, z], [near, far]) = (HALF, CORRIDOR);
    let [low, high] = [-0.15, HEIGHT + 0.15];
    let model = &mut *site.model;
    // Walls of the room end inside those of the corridor and vice versa, so that no two
    // faces are coplanar.
    let [[left, right], [sill, head]] = WINDOW;
    let (xs, ys) = ([-x - 0.16, left, right, near - 0.06], [low, sill, head, high]);
    let window = |i: usize, j: usize| (i != 1 || j != 1).then_some(0);
    model.add(panel(&xs, &ys, [-z - 0.2, -z], window), f.wall);
    model.add(block([-x - 0.16, low, z], [near - 0.06, high, z + 0.2]), f.wall);
    model.add(block([-x - 0.2, low, -z - 0.1], [-x, high, z + 0.1]), f.wall);
    // The wall with the doorway: made in the xy plane, x running towards -z. The corridor's half
    // has the wider opening.
    let half = |wider: f64, depths: [f64; 2]| {
        let xs = [-z - 0.05, -DOORWAY[1] - wider, wider - DOORWAY[0], z + 0.05];
        let ys = [-0.05 - wider, DOOR_HEIGHT + wider, HEIGHT + 0.05 + wider];
        panel(&xs, &ys, depths, |i, j| (i != 1 || j != 0).then_some(0)).moved(&turn(90.0))
    };
    let middle = 0.5 * (x + near);
    model.add(half(0.0, [x, middle + 0.002]), f.wall);
    model.add(half(0.003, [middle - 0.002, near]), f.corridor);
    for [from, to] in [[-z - 0.2, -z], [z, z + 0.2]] {
        model.add(block([middle, low + 0.01, from - 0.01], [far + 0.1, high - 0.01, to + 0.01]), f.corridor);
    }
    model.add(block([far, low, -z - 0.1], [far + 0.2, high, z + 0.1]), f.corridor);
    model.add(block([-x - 0.1, HEIGHT, -z - 0.1], [far + 0.1, HEIGHT + 0.12, z + 0.1]), f.ceiling);
}

/// Planks of three colours and random lengths; tiles in the corridor.
fn floors(site: &mut Site) {
    let f = &site.finishes;
    let ([x, z], middle) = (HALF, 0.5 * (HALF[0] + CORRIDOR[0]));
    let [along, rows] = if site.detail.is_below(0.3) { [9, 16] } else { [30, 40] };
    let mut rng = Rng::new(7);
    let mut colours = Vec::new();
    for _ in 0..rows {
        let (mut colour, mut left) = (0, 0);
        for _ in 0..along {
            if left == 0 {
                (colour, left) = (rng.pick(3) as u8, 3 + rng.pick(5));
            }
            left -= 1;
            colours.push(colour);
        }
    }
    let down = DAffine3::from_rotation_x(-std::f64::consts::FRAC_PI_2);
    let (xs, ys) = (lines(-x - 0.05, middle, along), lines(-z - 0.05, z + 0.05, rows));
    let parquet = panel(&xs, &ys, [-0.12, 0.0], |i, j| Some(colours[j * along + i]));
    site.model.add_in(parquet.moved(&down), &f.parquet);
    let (nx, nz) = if site.detail.is_below(0.3) { (3, 11) } else { (6, 21) };
    let (xs, ys) = (lines(middle, CORRIDOR[1] + 0.05, nx), lines(-z - 0.06, z + 0.06, nz));
    let tiles = panel(&xs, &ys, [-0.13, -0.001], |i, j| Some(u8::from((i + j).is_multiple_of(2))));
    site.model.add_in(tiles.moved(&down), &f.tiles);
    let threshold =
        block([HALF[0] - 0.015, -0.03, DOORWAY[0] - 0.01], [CORRIDOR[0] + 0.015, 0.012, DOORWAY[1] + 0.01]);
    site.model.add(threshold, f.oak);
}

fn mouldings(site: &mut Site) {
    let detail = site.detail;
    let skirting = Outline::from(-0.01, -0.01, detail)
        .to(0.018, -0.01)
        .to(0.018, 0.085)
        .cavetto(0.008, 0.105)
        .ovolo(0.002, 0.12)
        .to(-0.01, 0.12)
        .points();
    // v runs downwards from the ceiling's edge, so the loop's left is outside.
    let cornice = Outline::from(-0.01, -0.11, detail)
        .to(0.012, -0.11)
        .to(0.012, -0.095)
        .cavetto(0.075, -0.03)
        .to(0.085, -0.03)
        .ovolo(0.10, -0.012)
        .to(0.11, -0.012)
        .to(0.11, 0.01)
        .to(-0.01, 0.01)
        .points();
    let [x, z] = HALF;
    let [low, high] = [DOORWAY[0] - 0.11, DOORWAY[1] + 0.11];
    let point = |[x, z]: [f64; 2]| dvec3(x, 0.0, z);
    let paths = [
        [[x, low], [x, -z], [-x, -z], [-x, z], [x, z], [x, high]],
        [
            [CORRIDOR[0], high],
            [CORRIDOR[0], z],
            [CORRIDOR[1], z],
            [CORRIDOR[1], -z],
            [CORRIDOR[0], -z],
            [CORRIDOR[0], low],
        ],
    ];
    let woodwork = site.finishes.woodwork;
    for path in paths {
        let run = drawn(&skirting, &mitred(&path.map(point), DVec3::Y, false), false);
        site.model.add(run, woodwork);
    }
    for [left, right] in [[-x, x], CORRIDOR] {
        let path = [[left, z], [right, z], [right, -z], [left, -z]].map(point).map(|p| p + DVec3::Y * HEIGHT);
        site.model.add(drawn(&cornice, &mitred(&path, DVec3::Y, true), true), site.finishes.ceiling);
    }
}

/// Frames on both sides and the door, standing open against the wall.
fn doorway(site: &mut Site) {
    let (width, middle) = (DOORWAY[1] - DOORWAY[0], 0.5 * (DOORWAY[0] + DOORWAY[1]));
    let frame =
        architrave(site.detail, width, DOOR_HEIGHT, 0.09).bend(|p| dvec3(p.x, p.y, 0.45 * p.z)).smooth();
    let sides: [(f64, f64, Finish); 2] =
        [(HALF[0], -90.0, site.finishes.woodwork), (CORRIDOR[0], 90.0, site.finishes.woodwork)];
    for (x, degrees, finish) in sides {
        site.model.place(&frame, &(at(x, 0.0, middle) * turn(degrees)), finish);
    }
    let door = Door { width: width - 0.02, height: DOOR_HEIGHT - 0.02, panels: [2, 3] };
    let door = leaf(site.detail, door).bend(|p| dvec3(p.x + 0.5 * width, p.y + 0.012, 0.6 * p.z)).smooth();
    let hinge = at(HALF[0] - 0.07, 0.0, DOORWAY[1] + 0.03) * turn(-99.0);
    site.model.place(&door, &hinge, site.finishes.woodwork);
}
