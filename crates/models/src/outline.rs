//! Plane outlines of straight lines and arcs: profiles of mouldings and of turned work.

use std::f64::consts::TAU;

use glam::{DVec2, dvec2};

/// Fineness of curves. 1 is the size class of the paper's scene; lengths of triangles go
/// with its inverse.
#[derive(Clone, Copy, Debug)]
pub(super) struct Detail(pub(super) f64);

impl Detail {
    /// Number of segments of a curve that has `usual` of them at detail 1.
    pub(super) fn cuts(self, usual: f64, least: usize) -> usize {
        ((usual * self.0).round() as usize).max(least)
    }

    /// Whether the model is coarser than `detail`, for parts that are then omitted or simplified.
    pub(super) fn is_below(self, detail: f64) -> bool {
        self.0 < detail
    }

    /// Number of small repeated objects. A coarse model has fewer, a fine one the usual number.
    pub(super) fn count(self, usual: usize, least: usize) -> usize {
        ((usual as f64 * (1.3 * self.0).min(1.0)).round() as usize).max(least)
    }
}

/// A polyline under construction.
#[derive(Clone, Debug)]
pub(super) struct Outline {
    pub(super) points: Vec<DVec2>,
    detail: Detail,
}

impl Outline {
    pub(super) fn from(x: f64, y: f64, detail: Detail) -> Self {
        Self { points: vec![dvec2(x, y)], detail }
    }

    /// Continues straight to a point.
    pub(super) fn to(mut self, x: f64, y: f64) -> Self {
        self.points.push(dvec2(x, y));
        self
    }

    /// Continues on an arc to a point. `bulge` is the tangent of a quarter of its angle, positive
    /// for a counter-clockwise arc: 1 is a half circle and √2 − 1 a quarter. It has `usual`
    /// segments at detail 1.
    pub(super) fn arc(mut self, x: f64, y: f64, bulge: f64, usual: f64) -> Self {
        let (start, end) = (self.points[self.points.len() - 1], dvec2(x, y));
        let cuts = self.detail.cuts(usual, 1);
        let chord = end - start;
        let centre = 0.5 * (start + end) + (1.0 - bulge * bulge) / (4.0 * bulge) * chord.perp();
        let angle = 4.0 * bulge.atan();
        for cut in 1..cuts {
            let turned = DVec2::from_angle(angle * cut as f64 / cuts as f64).rotate(start - centre);
            self.points.push(centre + turned);
        }
        self.points.push(end);
        self
    }

    /// A quarter circle or ellipse-like quarter, convex to the right of the path.
    pub(super) fn ovolo(self, x: f64, y: f64) -> Self {
        self.arc(x, y, QUARTER, 3.0)
    }

    /// A quarter circle, hollow to the right of the path.
    pub(super) fn cavetto(self, x: f64, y: f64) -> Self {
        self.arc(x, y, -QUARTER, 3.0)
    }

    /// A half circle, convex to the right of the path.
    pub(super) fn torus(self, x: f64, y: f64) -> Self {
        self.arc(x, y, 0.9, 5.0)
    }

    /// A smooth curve through points: a Catmull-Rom spline, `usual` segments between two of them
    /// at detail 1.
    pub(super) fn through(mut self, points: &[[f64; 2]], usual: f64) -> Self {
        let start = self.points[self.points.len() - 1];
        let all: Vec<DVec2> = std::iter::once(start).chain(points.iter().map(|p| DVec2::from(*p))).collect();
        let cuts = self.detail.cuts(usual, 1);
        let at = |index: usize| all[index.min(all.len() - 1)];
        for span in 0..points.len() {
            let [p0, p1, p2, p3] = [at(span.saturating_sub(1)), at(span), at(span + 1), at(span + 2)];
            let (m1, m2) = (0.5 * (p2 - p0), 0.5 * (p3 - p1));
            for cut in 1..=cuts {
                let t = cut as f64 / cuts as f64;
                let (t2, t3) = (t * t, t * t * t);
                let [a, b] = [2.0 * t3 - 3.0 * t2 + 1.0, t3 - 2.0 * t2 + t];
                self.points.push(a * p1 + b * m1 + (1.0 - a) * p2 + (t3 - t2) * m2);
            }
        }
        self
    }

    /// The points. A coarse model drops points that are almost on the line
    /// between their neighbours.
    pub(super) fn points(self) -> Vec<DVec2> {
        let tolerance = if self.detail.0 < 0.8 { 0.03 * (0.8 - self.detail.0) } else { 0.0 };
        let mut kept: Vec<DVec2> = vec![self.points[0]];
        for pair in self.points[1..].windows(2) {
            let (before, chord) = (kept[kept.len() - 1], pair[1] - kept[kept.len() - 1]);
            let off = chord.perp_dot(pair[0] - before).abs() / chord.length().max(1e-9);
            if off > tolerance || tolerance == 0.0 {
                kept.push(pair[0]);
            }
        }
        kept.extend(self.points.last());
        kept
    }
}

/// Bulge of a quarter circle.
pub(super) const QUARTER: f64 = std::f64::consts::SQRT_2 - 1.0;

/// A circle around the origin, counter-clockwise.
pub(super) fn circle(radius: f64, cuts: usize) -> Vec<DVec2> {
    (0..cuts).map(|cut| radius * DVec2::from_angle(TAU * cut as f64 / cuts as f64)).collect()
}

/// A rectangle from the corner (x0, y0), counter-clockwise.
pub(super) fn rectangle([x0, y0]: [f64; 2], [x1, y1]: [f64; 2]) -> Vec<DVec2> {
    vec![dvec2(x0, y0), dvec2(x1, y0), dvec2(x1, y1), dvec2(x0, y1)]
}

/// Triangles that fill a simple counter-clockwise polygon: ears are cut off, the best shaped first.
pub(super) fn fill(polygon: &[DVec2]) -> Vec<[u32; 3]> {
    let mut left: Vec<u32> = (0..polygon.len() as u32).collect();
    let at = |index: u32| polygon[index as usize];
    let turn = |a: u32, b: u32, c: u32| (at(b) - at(a)).perp_dot(at(c) - at(a));
    let mut triangles = Vec::with_capacity(polygon.len());
    while left.len() > 3 {
        let count = left.len();
        let corners = |ear: usize| [left[(ear + count - 1) % count], left[ear], left[(ear + 1) % count]];
        let is_ear = |ear: &usize| {
            let [a, b, c] = corners(*ear);
            let inside = |p: &u32| {
                ![a, b, c].contains(p)
                    && turn(a, b, *p) >= 0.0
                    && turn(b, c, *p) >= 0.0
                    && turn(c, a, *p) >= 0.0
            };
            turn(a, b, c) > 1e-12 && !left.iter().any(inside)
        };
        // The area over the longest side squared.
        let shape = |ear: usize| {
            let [a, b, c] = corners(ear);
            let sides = [at(a) - at(b), at(b) - at(c), at(c) - at(a)].map(DVec2::length_squared);
            turn(a, b, c) / sides.into_iter().fold(0.0, f64::max)
        };
        let best = (0..count).filter(is_ear).max_by(|a, b| shape(*a).total_cmp(&shape(*b)));
        let ear = best.expect("a simple polygon that is wound counter-clockwise has an ear");
        triangles.push(corners(ear));
        left.remove(ear);
    }
    triangles.push([left[0], left[1], left[2]]);
    triangles
}
