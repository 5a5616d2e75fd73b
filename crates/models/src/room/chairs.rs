//! Chairs with turned legs, bent back posts and spindles.

use glam::{DAffine3, DVec3, dvec3};

use super::Site;
use super::tables::{DINING, TOP, turned_leg};
use crate::cushion::{cushion, edge_cuts};
use crate::model::{at, turn};
use crate::moulding::rod;
use crate::outline::{Detail, Outline};
use crate::sheet::slab;
use crate::solid::{Part, Solid};
use crate::turning::turned;

const SEAT: f64 = 0.455;
/// Half the seat along x and z.
const HALF: [f64; 2] = [0.215, 0.205];

pub(super) fn build(site: &mut Site) {
    let chair = Chair::new(site.detail);
    let place = at(DINING[0], 0.0, DINING[1]);
    // Two along each side and one at the end that was pushed back.
    let [x, z] = TOP;
    let places = [
        at(-0.36, 0.0, -z - 0.14) * turn(3.0),
        at(0.37, 0.0, -z - 0.10) * turn(-4.0),
        at(-0.38, 0.0, z + 0.13) * turn(178.0),
        at(x + 0.22, 0.0, -0.06) * turn(-68.0),
    ];
    for chair_place in places {
        chair.place(site, &(place * chair_place));
    }
}

/// A chair on the origin that looks to +z.
struct Chair {
    leg: Part,
    seat: Part,
    frame: Part,
}

impl Chair {
    fn new(detail: Detail) -> Self {
        let (edge, inside) = (edge_cuts(detail, 2.0), detail.cuts(5.0, 1));
        let seat = cushion(dvec3(HALF[0] + 0.012, 0.022, HALF[1] + 0.012), 0.019, 0.012, edge, inside);
        let leg = turned_leg(detail, 0.021, SEAT - 0.03);
        Self { leg, seat: seat.smooth(), frame: frame(detail) }
    }

    fn place(&self, site: &mut Site, place: &DAffine3) {
        for x in [-1.0, 1.0] {
            let at = *place * at(x * (HALF[0] - 0.015), 0.0, HALF[1] - 0.015);
            site.model.place(&self.leg, &at, site.finishes.oak);
        }
        site.model.place(&self.seat, &(*place * at(0.0, SEAT, 0.0)), site.finishes.pillows[1]);
        site.model.place(&self.frame, place, site.finishes.oak);
    }
}

/// Where a back post is at a height: it leans back above the seat and stands out a little below.
fn post(x: f64, y: f64) -> DVec3 {
    let lean =
        if y > SEAT { 0.20 * (y - SEAT) + 0.10 * (y - SEAT) * (y - SEAT) } else { 0.10 * (SEAT - y).powi(2) };
    dvec3(x * (HALF[0] - 0.012 + 0.02 * (y - SEAT).max(0.0)), y, -HALF[1] + 0.018 - lean)
}

/// Back posts, rails, spindles, crest and stretchers.
fn frame(detail: Detail) -> Part {
    let mut frame = Solid::default();
    let [min_along, min_across] = if detail.is_below(0.18) { [3, 2] } else { [4, 4] };
    let (cuts, around) = (detail.cuts(12.0, min_along), detail.cuts(10.0, 4));
    for x in [-1.0, 1.0] {
        let path: Vec<DVec3> =
            (0..=cuts).map(|cut| post(x, 0.93 * cut as f64 / cuts as f64 - 0.001)).collect();
        frame.join(rod(&path, around, false, |t| 0.0165 - 0.004 * (2.0 * t - 1.0).powi(2)));
    }
    // The crest: a bent board between the posts' heads.
    let bow = |u: f64, y: f64| {
        let p = post(2.0 * u - 1.0, y);
        dvec3(1.06 * p.x, y, p.z - 0.035 * (1.0 - (2.0 * u - 1.0).powi(2)))
    };
    let rise = |u: f64| 0.028 * (1.0 - (2.0 * u - 1.0).powi(2));
    let board = |low: f64, high: f64, crown: f64, depth: f64| {
        move |u: f64, v: f64| bow(u, low + v * (high - low + crown * rise(u))) + DVec3::Z * depth
    };
    let cells = [detail.cuts(14.0, min_across), detail.cuts(3.0, 1)];
    frame.join(slab(cells, board(0.855, 0.945, 1.0, 0.009), board(0.855, 0.945, 1.0, -0.009)));
    frame.join(slab(cells, board(0.545, 0.575, 0.0, 0.007), board(0.545, 0.575, 0.0, -0.007)));
    for number in 0..5 {
        let u = 0.22 + 0.14 * f64::from(number);
        let path: Vec<DVec3> =
            (0..=cuts / 2).map(|cut| bow(u, 0.56 + 0.31 * cut as f64 / (cuts / 2) as f64)).collect();
        frame.join(rod(&path, detail.cuts(8.0, 3), false, |t| {
            0.0055 + 0.003 * (std::f64::consts::PI * t).sin()
        }));
    }
    // Stretchers between the legs, and rails under the seat.
    let [x, z] = [HALF[0] - 0.015, HALF[1] - 0.015];
    for (y, thick) in [(0.17, 0.010), (SEAT - 0.045, 0.016)] {
        for side in [-1.0, 1.0] {
            frame.join(stretcher(detail, dvec3(side * x, y, z), post(side, y), thick));
        }
        frame.join(stretcher(
            detail,
            dvec3(-x, y + 0.05 * (SEAT - y), z),
            dvec3(x, y + 0.05 * (SEAT - y), z),
            thick,
        ));
        frame.join(stretcher(detail, post(-1.0, y + 0.01), post(1.0, y + 0.01), thick));
    }
    frame.smooth()
}

/// A turned rail between two points.
fn stretcher(detail: Detail, from: DVec3, to: DVec3, thick: f64) -> Solid {
    let along = to - from;
    let h = along.length();
    let profile = Outline::from(0.6 * thick, 0.0, detail).through(
        &[[0.75 * thick, 0.2 * h], [thick, 0.5 * h], [0.75 * thick, 0.8 * h], [0.6 * thick, h]],
        1.0,
    );
    let turn = glam::DQuat::from_rotation_arc(DVec3::Y, along / h);
    let place = DAffine3::from_rotation_translation(turn, from);
    turned(&profile.points(), detail.cuts(8.0, 3)).moved(&place)
}
