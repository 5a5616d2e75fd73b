//! The chandelier, the floor lamp, and the corridor's ceiling lamp.

use std::f64::consts::{PI, TAU};

use glam::{DVec3, dvec3};

use super::{HALF, HEIGHT, Site};
use crate::model::{at, turn};
use crate::moulding::rod;
use crate::outline::{Outline, circle};
use crate::turning::{turned, turned_ring};

/// The light of the room, under the chandelier.
pub(super) const LAMP: [f64; 3] = [-1.35, 1.95, 0.15];

pub(super) fn build(site: &mut Site) {
    chandelier(site);
    floor_lamp(site);
    corridor_lamp(site);
}

/// A ring with six candles on a stem, above the light. No surface is near the light, and the ring's
/// shadow falls on the ceiling.
fn chandelier(site: &mut Site) {
    let detail = site.detail;
    const OVER: f64 = 0.30;
    let place = at(LAMP[0], LAMP[1] + OVER, LAMP[2]);
    let up = HEIGHT - LAMP[1] - OVER;
    let rose = Outline::from(0.02, up - 0.035, detail).arc(0.085, up + 0.003, -0.3, 4.0).points();
    site.model.place(&turned(&rose, detail.cuts(28.0, 8)).smooth(), &place, site.finishes.brass);
    let (radius, cuts) = (0.36, detail.cuts(64.0, 12));
    let hoop: Vec<_> = circle(0.009, detail.cuts(10.0, 4))
        .into_iter()
        .map(|p| glam::dvec2(radius + p.x, p.y - 0.02))
        .collect();
    site.model.place(&turned_ring(&hoop, cuts).smooth_below(80.0), &place, site.finishes.brass);
    let hub = Outline::from(0.0, 0.25, detail)
        .through(&[[0.030, 0.28], [0.014, 0.33]], 3.0)
        .to(0.007, 0.35)
        .to(0.007, up - 0.03)
        .points();
    site.model.place(&turned(&hub, detail.cuts(16.0, 5)).smooth(), &place, site.finishes.brass);
    let bow = |t: f64| {
        dvec3(radius * (0.5 - 0.5 * (PI * t).cos()).powf(0.8), 0.30 - 0.32 * t + 0.05 * (TAU * t).sin(), 0.0)
    };
    let steps = detail.cuts(14.0, 5);
    let path: Vec<DVec3> = (0..=steps).map(|step| bow(step as f64 / steps as f64)).collect();
    let arm = rod(&path, detail.cuts(8.0, 4), false, |_| 0.0055).smooth();
    let cup = Outline::from(0.006, -0.012, detail)
        .through(&[[0.012, 0.0], [0.030, 0.012]], 3.0)
        .arc(0.027, 0.014, 0.9, 3.0)
        .to(0.012, 0.008);
    let cup = turned(&cup.points(), detail.cuts(16.0, 5)).smooth();
    let candle = Outline::from(0.011, 0.006, detail).to(0.011, 0.10).arc(0.0, 0.108, 0.35, 3.0).points();
    let candle = turned(&candle, detail.cuts(12.0, 4)).smooth();
    for number in 0..6 {
        let place = place * turn(60.0 * f64::from(number) + 12.0);
        site.model.place(&arm, &place, site.finishes.brass);
        let end = place * at(radius, 0.0, 0.0);
        site.model.place(&cup, &end, site.finishes.brass);
        site.model.place(&candle, &end, site.finishes.paper);
    }
}

/// A foot, a stem and a pleated shade, between bookcase and sofa.
fn floor_lamp(site: &mut Site) {
    let detail = site.detail;
    let place = at(0.42, 0.0, -HALF[1] + 0.34);
    let stem = Outline::from(0.145, -0.001, detail)
        .arc(0.140, 0.018, 0.6, 3.0)
        .through(&[[0.05, 0.035], [0.014, 0.06]], 4.0)
        .to(0.011, 0.70)
        .arc(0.011, 0.74, 0.9, 4.0)
        .to(0.010, 1.42)
        .arc(0.010, 1.45, 0.9, 4.0)
        .to(0.006, 1.62);
    site.model.place(&turned(&stem.points(), detail.cuts(24.0, 7)).smooth(), &place, site.finishes.brass);
    // A thin cone, closed over its rims; pleats run down it.
    let [low, high] = [[0.225, 1.36], [0.145, 1.63]];
    let t = 0.0035;
    let wall = [[low[0] - t, low[1]], [low[0], low[1]], [high[0], high[1]], [high[0] - t, high[1]]];
    let pleats = detail.cuts(44.0, 9);
    let shade = turned_ring(&wall.map(glam::DVec2::from), 2 * pleats).bend(|p| {
        let angle = p.z.atan2(p.x);
        let fold = 1.0 + 0.012 * (pleats as f64 * angle).cos();
        dvec3(p.x * fold, p.y, p.z * fold)
    });
    site.model.place(&shade.smooth_below(60.0), &place, site.finishes.shade);
    for number in 0..3 {
        let spoke =
            rod(&[dvec3(0.004, 1.60, 0.0), dvec3(0.151, 1.60, 0.0)], detail.cuts(5.0, 3), false, |_| 0.002);
        site.model.place(&spoke.smooth(), &(place * turn(120.0 * f64::from(number))), site.finishes.brass);
    }
}

/// A shallow dish under the corridor's ceiling.
fn corridor_lamp(site: &mut Site) {
    let detail = site.detail;
    let dish = Outline::from(0.0, HEIGHT - 0.075, detail)
        .through(&[[0.09, HEIGHT - 0.065], [0.15, HEIGHT - 0.035]], 4.0)
        .arc(0.15, HEIGHT - 0.02, 0.8, 3.0)
        .to(0.05, HEIGHT + 0.002);
    let dish = turned(&dish.points(), detail.cuts(32.0, 9)).smooth();
    site.model.place(&dish, &at(4.32, 0.0, 0.95), site.finishes.porcelain);
}
