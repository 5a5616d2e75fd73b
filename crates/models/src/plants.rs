//! Plants in pots.

use std::f64::consts::TAU;

use glam::{DAffine3, DVec3, dvec3};

use super::model::at;
use super::moulding::rod;
use super::outline::{Detail, Outline};
use super::panel::lines;
use super::rng::Rng;
use super::sheet::{leaf, lozenge};
use super::solid::Solid;
use super::turning::turned;

/// An urn of that radius and height on the origin, with its soil; finishes: urn, soil.
pub(super) fn urn(detail: Detail, r: f64, height: f64) -> Solid {
    let h = height;
    if detail.is_below(0.18) {
        return plain_urn(r, h);
    }
    let profile = Outline::from(0.62 * r, -0.002, detail)
        .to(0.62 * r, 0.06 * h)
        .arc(0.42 * r, 0.16 * h, -0.41, 2.0)
        .arc(0.42 * r, 0.21 * h, 0.9, 2.0)
        .through(&[[0.78 * r, 0.42 * h], [0.95 * r, 0.66 * h], [0.84 * r, 0.88 * h]], 1.49)
        .to(0.98 * r, 0.91 * h)
        .arc(0.98 * r, h, 0.9, 3.0)
        .to(0.86 * r, h)
        .to(0.80 * r, 0.90 * h);
    let mut urn = turned(&profile.points(), detail.cuts(14.0, 4));
    urn.finish_as(0);
    let soil = Outline::from(0.6 * r, 0.86 * h, detail).to(0.815 * r, 0.91 * h).to(0.4 * r, 0.94 * h);
    urn.join(turned(&soil.points(), detail.cuts(10.0, 4)));
    urn.finish_as(1);
    urn
}

/// An urn of four cones and four sides; its soil closes it.
fn plain_urn(r: f64, h: f64) -> Solid {
    const SIDES: usize = 4;
    let profile =
        [[0.62 * r, -0.002], [0.46 * r, 0.2 * h], [0.95 * r, 0.66 * h], [0.98 * r, h], [0.80 * r, 0.93 * h]];
    let mut urn = turned(&profile.map(glam::DVec2::from), SIDES);
    urn.finishes = vec![0; urn.facets.len() - SIDES];
    urn.finish_as(1);
    urn
}

/// A rosette of arching leaves of that length on the origin.
pub(super) fn agave(detail: Detail, length: f64, leaves: usize, seed: u64) -> Solid {
    let mut rng = Rng::new(seed);
    let mut plant = Solid::default();
    let count = detail.count(leaves, 6);
    for number in 0..count {
        let fraction = number as f64 / count as f64;
        let length = length * (1.0 - 0.35 * fraction) * rng.between(0.85, 1.1);
        // Outer leaves lie flat, inner ones stand.
        let rise = 0.35 + 0.95 * fraction + rng.between(-0.1, 0.1);
        let turn = TAU * (number as f64 * 0.381_966 + rng.between(-0.02, 0.02));
        let blade = blade(detail, length, 0.085 * length, rise, 0.9 - 0.5 * fraction);
        plant.join(blade.moved(&DAffine3::from_rotation_y(turn)));
    }
    plant
}

/// A leaf from the axis along +x: it starts at the angle `rise`, radians, and bends down by `fall`
/// over its length.
fn blade(detail: Detail, length: f64, half_width: f64, rise: f64, fall: f64) -> Solid {
    let cells = [detail.cuts(4.0, 2), detail.cuts(2.0, 2)];
    let is_plain = detail.is_below(0.16);
    // A lozenge of the same width has three quarters of the area.
    let half_width = if is_plain { 1.33 * half_width } else { half_width };
    let width = move |u: f64| half_width * (0.45 + 1.4 * u * (1.0 - u)) * (1.04 - u.powi(3)).max(0.04);
    // Thinner than its bending radius; otherwise its upper side would fold over.
    let thickness = move |u| (0.3 * width(u)).min(0.012);
    let middle = move |u: f64, v: f64| {
        let across = 2.0 * v - 1.0;
        let angle = |t: f64| rise - fall * t * t;
        // The mean direction up to `u` approximates the integral along a gently bent line.
        let mean = (angle(0.0) + 4.0 * angle(0.5 * u) + angle(u)) / 6.0;
        let width = width(u);
        let hollow = 0.5 * width * across * across;
        let along = 0.03 + length * u;
        let (sine, cosine) = mean.sin_cos();
        dvec3(along * cosine - hollow * sine, along * sine + hollow * cosine, -across * width)
    };
    if is_plain { lozenge(thickness(0.5), middle) } else { leaf(cells, thickness, middle) }
}

/// A small tree of that height: a leaning stem, branches and broad leaves. Finishes: wood, leaf.
pub(super) fn tree(detail: Detail, height: f64, branches: usize, seed: u64) -> Solid {
    let mut rng = Rng::new(seed);
    let mut plant = Solid::default();
    let mut foliage = Solid::default();
    let cuts = detail.cuts(4.0, 3);
    let stem = |t: f64| dvec3(0.05 * (5.0 * t).sin(), t * height, 0.04 * (4.0 * t + 1.0).sin());
    // A coarse model's stem bends once, and its branches are straight.
    let [bends, arch] = if detail.is_below(0.16) { [2, 1] } else { [4, 2] };
    let path: Vec<DVec3> = lines(0.0, 1.0, bends).into_iter().map(stem).collect();
    plant.join(rod(&path, cuts, false, |t| 0.022 - 0.014 * t));
    let count = detail.count(branches, 5);
    for number in 0..count {
        let fraction = 0.35 + 0.65 * (number as f64 + 0.5) / count as f64;
        let turn = TAU * (number as f64 * 0.381_966) + rng.between(-0.3, 0.3);
        let reach = height * (0.30 - 0.16 * (fraction - 0.35)) * rng.between(0.8, 1.15);
        let lift = rng.between(0.35, 0.75);
        let out = dvec3(turn.cos(), lift, turn.sin()).normalize();
        let tip = |t: f64| stem(fraction) + out * (reach * t) - DVec3::Y * (0.35 * reach * t * t);
        let path: Vec<DVec3> = lines(0.0, 1.0, arch).into_iter().map(tip).collect();
        plant.join(rod(&path, cuts.min(8), false, |t| 0.008 - 0.005 * t));
        for at_leaf in 0..if detail.is_below(0.35) { 2 } else { 3 } {
            let t = 0.5 + 0.25 * f64::from(at_leaf);
            let turn = -turn + if at_leaf % 2 == 0 { 0.8 } else { -0.8 } + rng.between(-0.4, 0.4);
            let p = tip(t.min(1.0));
            let size = rng.between(0.10, 0.15) * height.sqrt();
            let blade = blade(detail, size, 0.42 * size, rng.between(-0.1, 0.5), 0.9);
            foliage.join(blade.moved(&(at(p.x, p.y, p.z) * DAffine3::from_rotation_y(turn))));
        }
    }
    plant.finish_as(0);
    plant.join(foliage);
    plant.finish_as(1);
    plant
}
