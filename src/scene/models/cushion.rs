//! Blocks with rounded edges: cushions, seats, stones.

use std::collections::BTreeMap;

use glam::{DVec3, dvec3};

use super::solid::Solid;

/// A block of these half sizes with edges rounded to `radius`: `edge` segments around an edge, `inside` between two edges.
pub(super) fn rounded(half: DVec3, radius: f64, edge: usize, inside: usize) -> Solid {
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

/// A cushion: rounded, and swollen by `swell` metres in the middle of its top and bottom.
pub(super) fn cushion(half: DVec3, radius: f64, swell: f64, edge: usize, inside: usize) -> Solid {
    rounded(half, radius, edge, inside).bend(|p| {
        let [across, along] = [p.x / half.x, p.z / half.z].map(|share| (1.0 - share * share).max(0.0));
        dvec3(p.x, p.y + p.y / half.y * swell * (across * along).sqrt(), p.z)
    })
}
