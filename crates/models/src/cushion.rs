//! Blocks with rounded or chamfered edges: cushions, seats, stones.

use std::collections::BTreeMap;

use glam::{DVec3, dvec3};

use super::outline::Detail;
use super::solid::Solid;

/// Segments around an edge that has `usual` at detail 1; zero makes a chamfer.
pub(super) fn edge_cuts(detail: Detail, usual: f64) -> usize {
    if detail.is_below(0.2) { 0 } else { detail.cuts(usual, 1) }
}

/// A block of these half sizes with edges rounded to `radius`: `edge` segments around an
/// edge, `inside` between two edges. With `edge` zero it is chamfered, without segments
/// between the edges.
pub(super) fn rounded(half: DVec3, radius: f64, edge: usize, inside: usize) -> Solid {
    if edge == 0 {
        return chamfered(half, radius);
    }
    let count = 2 * edge + inside;
    // Lines across one axis: a quarter circle seen from its axis at both ends, equal steps between.
    let line = |index: usize, half: f64| {
        let (low, core) = (index.min(count - index), half - radius);
        if low <= edge {
            let slope = (std::f64::consts::FRAC_PI_4 * (1.0 - low as f64 / edge as f64)).tan();
            let place = core + radius * slope;
            if index < count - index { -place } else { place }
        } else {
            core * (2.0 * (index - edge) as f64 / inside as f64 - 1.0)
        }
    };
    let place = |lattice: [usize; 3]| {
        let on = dvec3(line(lattice[0], half.x), line(lattice[1], half.y), line(lattice[2], half.z));
        let core = on.clamp(-(half - radius), half - radius);
        core + radius * (on - core).normalize()
    };
    let mut solid = Solid::default();
    let mut known = BTreeMap::new();
    for axis in 0..3 {
        for end in [0, count] {
            let lattice = |i: usize, j: usize| {
                let mut lattice = [0; 3];
                (lattice[axis], lattice[(axis + 1) % 3], lattice[(axis + 2) % 3]) = (end, i, j);
                lattice
            };
            for j in 0..count {
                for i in 0..count {
                    let corners = [[i, j], [i + 1, j], [i + 1, j + 1], [i, j + 1]];
                    let mut corners = corners.map(|[i, j]| {
                        let lattice = lattice(i, j);
                        *known.entry(lattice).or_insert_with(|| solid.point(place(lattice)))
                    });
                    if end == 0 {
                        corners.reverse();
                    }
                    solid.bent_quad(corners);
                }
            }
        }
    }
    solid
}

/// A block whose edges and corners are cut off, `depth` from their original position.
fn chamfered(half: DVec3, depth: f64) -> Solid {
    let mut solid = Solid::default();
    // Three points for each of the eight corners, one on each face. Bit a of the corner is its side
    // on axis a.
    let corners: Vec<[u32; 3]> = (0..8)
        .map(|corner| {
            let sign = |axis: usize| if corner >> axis & 1 == 1 { 1.0 } else { -1.0 };
            let sign = dvec3(sign(0), sign(1), sign(2));
            DVec3::AXES.map(|face| solid.point(sign * (half - depth * (DVec3::ONE - face))))
        })
        .collect();
    // The block is convex and its middle is the origin, so all facets face away from it.
    let outwards = |solid: &Solid, [a, b, c]: [u32; 3]| {
        let [p, q, r] = [a, b, c].map(|index| solid.points[index as usize]);
        (q - p).cross(r - p).dot(p) > 0.0
    };
    let quad = |solid: &mut Solid, [a, b, c, d]: [u32; 4]| {
        solid.quad(if outwards(solid, [a, b, c]) { [a, b, c, d] } else { [d, c, b, a] });
    };
    for axis in 0..3 {
        let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
        for side in [0, 1 << axis] {
            let face = [0, 1 << next, 1 << next | 1 << last, 1 << last];
            quad(&mut solid, face.map(|other: usize| corners[side | other][axis]));
            // The edge along the last axis between this face and the next axis's.
            for other in [0, 1 << next] {
                let [from, to] = [side | other, side | other | 1 << last];
                quad(
                    &mut solid,
                    [corners[from][axis], corners[to][axis], corners[to][next], corners[from][next]],
                );
            }
        }
    }
    for [a, b, c] in corners {
        let facet = if outwards(&solid, [a, b, c]) { [a, b, c] } else { [a, c, b] };
        solid.facets.push(facet);
    }
    solid
}

/// A cushion: rounded, and swollen by `swell` metres in the middle of its top and bottom.
pub(super) fn cushion(half: DVec3, radius: f64, swell: f64, edge: usize, inside: usize) -> Solid {
    rounded(half, radius, edge, inside).bend(|p| {
        let [across, along] =
            [p.x / half.x, p.z / half.z].map(|fraction| (1.0 - fraction * fraction).max(0.0));
        dvec3(p.x, p.y + p.y / half.y * swell * (across * along).sqrt(), p.z)
    })
}
