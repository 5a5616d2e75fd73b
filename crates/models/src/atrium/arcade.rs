//! Walls on arches, their archivolts, string course and main cornice.

use std::f64::consts::PI;

use glam::{DVec2, DVec3, dvec2, dvec3};

use super::columns::UPPER_SPRINGING;
use super::{BAY, EAVES, GALLERY, SPRINGING, Side, Site, WALL, around, sides};
use crate::model::at;
use crate::moulding::{Frame, drawn, mitred, plate};
use crate::outline::{Detail, Outline, QUARTER};
use crate::panel::block;
use crate::sheet::slab;
use crate::solid::{Part, Solid};

/// A row of round arches.
#[derive(Clone, Copy)]
struct Arches {
    bay: f64,
    radius: f64,
    springing: f64,
    top: f64,
    wall: f64,
    /// Segments of an arch at detail 1.
    cuts: f64,
}

const LOWER: Arches =
    Arches { bay: BAY, radius: 1.2, springing: SPRINGING, top: GALLERY - 0.1, wall: WALL, cuts: 19.0 };
const UPPER: Arches =
    Arches { bay: 1.5, radius: 0.57, springing: UPPER_SPRINGING, top: EAVES, wall: 0.32, cuts: 11.0 };

pub(super) fn build(site: &mut Site) {
    let [limestone, plaster] = [site.finishes.limestone, site.finishes.plaster];
    for side in sides() {
        for arches in [LOWER, UPPER] {
            let wall = arches.wall(&side, site.detail).smooth();
            site.model.place(&wall, &side.place, plaster);
            let archivolt = arches.archivolt(site.detail);
            let count = (2.0 * side.half / arches.bay).round() as usize;
            for number in 0..if site.detail.is_below(0.45) { 0 } else { count } {
                let middle = at(-side.half + arches.bay * (number as f64 + 0.5), arches.springing, 0.0);
                site.model.place(&archivolt, &(side.place * middle), limestone);
            }
        }
    }
    let course =
        drawn(&string_course(site.detail), &mitred(&around(-0.5 * WALL, GALLERY), DVec3::Y, true), true);
    site.model.add(course, limestone);
    let cornice = drawn(&cornice(site.detail), &mitred(&around(-0.16, EAVES), DVec3::Y, true), true);
    site.model.add(cornice, limestone);
    modillions(site);
}

impl Arches {
    /// The wall of one side, from arches to top, between the middles of the corner piers.
    fn wall(self, side: &Side, detail: Detail) -> Solid {
        if detail.is_below(0.21) {
            return self.plain_wall(side, detail);
        }
        let cuts = detail.cuts(self.cuts, 3);
        let pier = 0.5 * self.bay - self.radius;
        let mut foot: Vec<DVec2> = Vec::new();
        for middle in self.middles(side) {
            foot.push(dvec2(middle - self.radius - pier, self.springing));
            foot.extend(self.arc(cuts).map(|p| dvec2(middle, self.springing) + p));
        }
        let end = self.end(side);
        foot[0].x = -end;
        foot.push(dvec2(end, self.springing));
        let count = foot.len() - 1;
        let face = |z: f64| {
            let foot = &foot;
            move |u: f64, v: f64| {
                let at = foot[(u * count as f64).round() as usize];
                dvec3(at.x, at.y + v * (self.top - at.y), z)
            }
        };
        slab([count, detail.cuts(1.6, 1)], face(0.5 * self.wall), face(-0.5 * self.wall))
    }

    /// The wall as one polygon without cuts between springing line and top: half as many triangles,
    /// but long ones.
    fn plain_wall(self, side: &Side, detail: Detail) -> Solid {
        let (cuts, end) = (detail.cuts(self.cuts, 3), self.end(side));
        let mut outline = vec![dvec2(-end, self.springing)];
        for middle in self.middles(side) {
            outline.extend(self.arc(cuts).map(|p| dvec2(middle, self.springing) + p));
        }
        outline.extend([dvec2(end, self.springing), dvec2(end, self.top), dvec2(-end, self.top)]);
        let back = Frame { origin: dvec3(0.0, 0.0, -0.5 * self.wall), u: DVec3::X, v: DVec3::Y };
        plate(&outline, back, self.wall)
    }

    /// Middles of a side's arches along it.
    fn middles(self, side: &Side) -> impl Iterator<Item = f64> {
        let (half, bay) = (side.half, self.bay);
        (0..(2.0 * half / bay).round() as usize).map(move |number| -half + bay * (number as f64 + 0.5))
    }

    /// End of a side's wall: inside the corner, short of the other side's wall, so that neither
    /// face is visible there.
    fn end(self, side: &Side) -> f64 {
        side.half + 0.5 * self.wall - 0.01
    }

    /// The intrados from left to right, around the middle of its springing line.
    fn arc(self, cuts: usize) -> impl Iterator<Item = DVec2> {
        (0..=cuts).map(move |cut| {
            let angle = PI * (1.0 - cut as f64 / cuts as f64);
            self.radius * dvec2(angle.cos(), angle.sin())
        })
    }

    /// A moulding around the arch on the wall's face towards the court.
    fn archivolt(self, detail: Detail) -> Part {
        let (w, d) = (0.16 * self.radius, 0.045 * self.radius);
        // From the intrados outwards, and out of the wall.
        let section = Outline::from(-0.004, -0.01, detail)
            .to(w, -0.01)
            .to(w, d)
            .to(0.78 * w, d)
            .to(0.68 * w, 0.5 * d)
            .to(-0.004, 0.5 * d);
        let section = section.points();
        let cuts = detail.cuts(self.cuts, 3);
        let face = dvec3(0.0, 0.0, -0.5 * self.wall);
        // Sections advance towards u × v: from right to left on this face.
        let frames: Vec<Frame> = self
            .arc(cuts)
            .map(|p| Frame { origin: p.extend(0.0) + face, u: p.extend(0.0) / self.radius, v: DVec3::NEG_Z })
            .collect();
        drawn(&section, &frames.into_iter().rev().collect::<Vec<_>>(), false).smooth()
    }
}

/// Over the lower arches: `u` out of the wall, `v` upwards from the gallery's floor.
fn string_course(detail: Detail) -> Vec<DVec2> {
    Outline::from(-0.02, -0.42, detail)
        .to(0.03, -0.42)
        .to(0.03, -0.36)
        .cavetto(0.10, -0.26)
        .to(0.10, -0.22)
        .arc(0.18, -0.12, QUARTER, 3.0)
        .to(0.22, -0.12)
        .to(0.22, -0.02)
        .to(0.20, 0.0)
        .to(-0.02, 0.0)
        .points()
}

/// Under the roof.
fn cornice(detail: Detail) -> Vec<DVec2> {
    Outline::from(-0.02, -0.30, detail)
        .to(0.03, -0.30)
        .to(0.05, -0.24)
        .to(0.05, -0.16)
        .cavetto(0.11, -0.08)
        .to(0.13, -0.08)
        .to(0.13, 0.12)
        .to(0.42, 0.12)
        .to(0.42, 0.22)
        .arc(0.48, 0.29, -QUARTER, 3.0)
        .arc(0.54, 0.36, QUARTER, 3.0)
        .to(0.54, 0.40)
        .to(-0.02, 0.40)
        .points()
}

/// Brackets under the cornice.
fn modillions(site: &mut Site) {
    let bracket = block([-0.06, EAVES - 0.03, -0.40], [0.06, EAVES + 0.13, -0.125]).smooth();
    for side in sides() {
        let count = (2.0 * side.half / 0.5).round() as usize;
        for number in 0..if site.detail.is_below(0.5) { 0 } else { count } {
            let x = (side.half - 0.45) * ((2 * number + 1) as f64 / count as f64 - 1.0);
            let place = side.place * at(x, 0.0, -0.16);
            site.model.place(&bracket, &place, site.finishes.limestone);
        }
    }
}
