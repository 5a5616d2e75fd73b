//! Doors with frames and handles.

use std::f64::consts::FRAC_PI_2;

use glam::{DAffine3, DVec3, dvec3};

use super::model::at;
use super::moulding::{drawn, mitred};
use super::outline::{Detail, Outline};
use super::panel::{block, panel};
use super::solid::{Part, Solid};
use super::turning::turned_ring;

/// A panelled door: its opening, metres, and its panels across and up.
#[derive(Clone, Copy)]
pub(super) struct Door {
    pub(super) width: f64,
    pub(super) height: f64,
    pub(super) panels: [usize; 2],
}

/// A closed door with its frame, in front of a wall: it stands on the origin, faces +z and reaches
/// 2 cm into the wall. Finishes: leaf, frame, handle.
pub(super) fn door(detail: Detail, door: Door) -> Part {
    let mut all = leaf(detail, door);
    all.finish_as(0);
    all.join(architrave(detail, door.width, door.height, 0.14));
    all.finish_as(1);
    all.join(handle(detail).bend(|p| p + dvec3(0.40 * door.width, 1.0, 0.062)));
    all.finish_as(2);
    all.smooth()
}

/// A door's leaf of 6 cm with sunk panels, standing on the origin, its front at z = 0.06.
pub(super) fn leaf(detail: Detail, door: Door) -> Solid {
    let half = 0.5 * door.width;
    let [across, up] = door.panels;
    let mut solid = block([-half, -0.002, -0.02], [half, door.height, 0.035]);
    // Stiles and rails of 10 cm, a bottom rail twice as high.
    let cuts = |from: f64, to: f64, count: usize, first: f64| {
        let open = (to - from - first - 0.1 * count as f64) / count as f64;
        let mut at = from;
        let mut all = vec![from];
        for number in 0..count {
            at += if number == 0 { first } else { 0.1 };
            all.push(at);
            at += open;
            all.push(at);
        }
        all.push(to);
        all
    };
    let (xs, ys) = (cuts(-half, half, across, 0.1), cuts(0.004, door.height, up, 0.2));
    if detail.is_below(0.42) {
        return solid;
    }
    let is_frame = |i: usize, j: usize| (i.is_multiple_of(2) || j.is_multiple_of(2)).then_some(0);
    solid.join(panel(&xs, &ys, [0.03, 0.06], is_frame));
    for i in (1..xs.len() - 1).step_by(2) {
        for j in (1..ys.len() - 1).step_by(2) {
            let path = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
            let path = path.map(|[i, j]| dvec3(xs[i], ys[j], 0.06));
            let bead = Outline::from(-0.004, -0.03, detail)
                .to(0.022, -0.03)
                .to(0.006, 0.004)
                .to(-0.004, 0.004)
                .points();
            solid.join(drawn(&bead, &mitred(&path, DVec3::Z, true), true));
        }
    }
    solid
}

/// A moulded frame of that width around an opening over the origin, in front of a wall whose face
/// is z = 0.
pub(super) fn architrave(detail: Detail, width: f64, height: f64, face: f64) -> Solid {
    let half = 0.5 * width;
    // Seen from the front the path goes up on the right and down on the left: the opening is
    // on its left.
    let path = [
        dvec3(half, -0.002, 0.0),
        dvec3(half, height, 0.0),
        dvec3(-half, height, 0.0),
        dvec3(-half, -0.002, 0.0),
    ];
    let section = Outline::from(-face, -0.02, detail)
        .to(0.006, -0.02)
        .to(0.006, 0.065)
        .to(-0.3 * face, 0.065)
        .to(-0.38 * face, 0.075)
        .to(-0.8 * face, 0.085)
        .to(-face, 0.085)
        .points();
    drawn(&section, &mitred(&path, DVec3::Z, false), false)
}

/// A ring on a plate; the plate alone on a coarse model.
fn handle(detail: Detail) -> Solid {
    let mut solid = block([-0.025, -0.07, -0.01], [0.025, 0.09, 0.012]);
    if detail.is_below(0.195) {
        return solid;
    }
    let section: Vec<glam::DVec2> = super::outline::circle(0.007, detail.cuts(6.0, 4))
        .into_iter()
        .map(|p| p + glam::dvec2(0.045, 0.0))
        .collect();
    let ring = turned_ring(&section, detail.cuts(14.0, 6));
    let upright = at(0.0, -0.02, 0.02) * DAffine3::from_rotation_x(FRAC_PI_2);
    solid.join(ring.moved(&upright));
    solid
}
