//! Turned work: columns, balusters, legs, vases, lamp shades.

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::solid::Solid;

/// Turns a profile of (radius, height) about the y axis. It runs upwards with the outside on its
/// right, from axis to axis; a flat disc closes an end off the axis.
pub(super) fn turned(profile: &[DVec2], cuts: usize) -> Solid {
    fluted(profile, cuts, |_, _| 1.0)
}

/// Turns a profile with every radius multiplied by `swell`, a function of the angle in 0..1 of a
/// turn and the height.
pub(super) fn fluted(profile: &[DVec2], cuts: usize, swell: impl Fn(f64, f64) -> f64) -> Solid {
    let mut profile = profile.to_vec();
    let (first, last) = (profile[0], profile[profile.len() - 1]);
    if first.x > 0.0 {
        profile.insert(0, DVec2::new(0.0, first.y));
    }
    if last.x > 0.0 {
        profile.push(DVec2::new(0.0, last.y));
    }
    let mut solid = Solid::default();
    let rings: Vec<Vec<u32>> = profile.iter().map(|at| ring(&mut solid, *at, cuts, &swell)).collect();
    rings.windows(2).for_each(|pair| band(&mut solid, &pair[0], &pair[1]));
    solid
}

/// Turns a closed profile that does not touch the axis, wound counter-clockwise:
/// rings, shades, rims.
pub(super) fn turned_ring(profile: &[DVec2], cuts: usize) -> Solid {
    let mut solid = Solid::default();
    let rings: Vec<Vec<u32>> = profile.iter().map(|at| ring(&mut solid, *at, cuts, &|_, _| 1.0)).collect();
    for at in 0..rings.len() {
        band(&mut solid, &rings[at], &rings[(at + 1) % rings.len()]);
    }
    solid
}

/// One corner on the axis, or a circle of them.
fn ring(solid: &mut Solid, at: DVec2, cuts: usize, swell: &dyn Fn(f64, f64) -> f64) -> Vec<u32> {
    if at.x == 0.0 {
        return vec![solid.point(DVec3::new(0.0, at.y, 0.0))];
    }
    let corner = |cut: usize| {
        let turn = cut as f64 / cuts as f64;
        let (sine, cosine) = (TAU * turn).sin_cos();
        let radius = at.x * swell(turn, at.y);
        DVec3::new(radius * cosine, at.y, radius * sine)
    };
    (0..cuts).map(|cut| solid.point(corner(cut))).collect()
}

fn band(solid: &mut Solid, below: &[u32], above: &[u32]) {
    let cuts = below.len().max(above.len());
    for cut in 0..cuts {
        let next = (cut + 1) % cuts;
        match (below.len(), above.len()) {
            (1, 1) => {}
            (1, _) => solid.facets.push([below[0], above[cut], above[next]]),
            (_, 1) => solid.facets.push([below[cut], above[0], below[next]]),
            _ => solid.quad([below[cut], above[cut], above[next], below[next]]),
        }
    }
}
