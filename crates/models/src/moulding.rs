//! Sections swept along a path: cornices, skirtings, frames, archivolts, rods and stems.

use glam::{DVec2, DVec3};

use super::outline::{circle, fill};
use super::solid::Solid;

/// Position and plane of a section: `u` and `v` span the plane, and the path continues towards
/// `u × v`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Frame {
    pub(super) origin: DVec3,
    pub(super) u: DVec3,
    pub(super) v: DVec3,
}

/// Sweeps a section (closed, counter-clockwise) through frames. A closed path returns to its first
/// frame; the ends of an open one are capped.
pub(super) fn drawn(section: &[DVec2], frames: &[Frame], is_closed: bool) -> Solid {
    let mut solid = Solid::default();
    let rings: Vec<Vec<u32>> = frames
        .iter()
        .map(|f| section.iter().map(|s| solid.point(f.origin + s.x * f.u + s.y * f.v)).collect())
        .collect();
    let ways = if is_closed { rings.len() } else { rings.len() - 1 };
    for way in 0..ways {
        let (here, there) = (&rings[way], &rings[(way + 1) % rings.len()]);
        for at in 0..section.len() {
            let next = (at + 1) % section.len();
            solid.bent_quad([here[at], here[next], there[next], there[at]]);
        }
    }
    if !is_closed {
        let (first, last) = (&rings[0], &rings[rings.len() - 1]);
        for triangle in fill(section) {
            let [a, b, c] = triangle.map(|at| at as usize);
            solid.facets.push([first[a], first[c], first[b]]);
            solid.facets.push([last[a], last[b], last[c]]);
        }
    }
    solid
}

/// Frames along a path in a plane, mitred at its corners: `v` is `up`, across the plane, and `u` is
/// to the left of the path.
pub(super) fn mitred(path: &[DVec3], up: DVec3, is_closed: bool) -> Vec<Frame> {
    let count = path.len();
    let way = |from: usize| (path[(from + 1) % count] - path[from]).normalize();
    (0..count)
        .map(|at| {
            let before = if at > 0 || is_closed { way((at + count - 1) % count) } else { way(at) };
            let after = if at + 1 < count || is_closed { way(at) } else { before };
            let [left_before, left_after] = [up.cross(before), up.cross(after)];
            let bisector = (left_before + left_after).normalize();
            Frame { origin: path[at], u: bisector / bisector.dot(left_after), v: up }
        })
        .collect()
}

/// A round rod along a path; `radius` takes the fraction of the path, 0..1.
pub(super) fn rod(path: &[DVec3], cuts: usize, is_closed: bool, radius: impl Fn(f64) -> f64) -> Solid {
    let count = path.len();
    let tangent = |at: usize| {
        let before = if at > 0 {
            at - 1
        } else if is_closed {
            count - 1
        } else {
            0
        };
        let after = if at + 1 < count {
            at + 1
        } else if is_closed {
            0
        } else {
            at
        };
        (path[after] - path[before]).normalize()
    };
    let mut frames = Vec::with_capacity(count);
    let mut side = tangent(0).any_orthonormal_vector();
    for (at, &origin) in path.iter().enumerate() {
        let way = tangent(at);
        // Parallel transport: no twist.
        side = (side - side.dot(way) * way).normalize();
        let r = radius(at as f64 / (count - 1) as f64);
        frames.push(Frame { origin, u: r * side, v: r * way.cross(side) });
    }
    drawn(&circle(1.0, cuts), &frames, is_closed)
}

/// Extrudes a plane outline (counter-clockwise as seen from where `depth` points) to a plate.
pub(super) fn plate(outline: &[DVec2], frame: Frame, depth: f64) -> Solid {
    let normal = frame.u.cross(frame.v).normalize();
    drawn(outline, &[frame, Frame { origin: frame.origin + depth * normal, ..frame }], false)
}
