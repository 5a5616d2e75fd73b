//! Furnishings: banners over the balustrade, curtains between columns, plants.

use std::f64::consts::PI;

use glam::{DVec3, dvec3};

use super::{BAY, COURT, GALLERY, GROUND, SPRINGING, Side, Site, sides};
use crate::drapery::{Cloth, banner, curtain};
use crate::model::at;
use crate::moulding::rod;
use crate::plants::{agave, tree, urn};
use crate::turning::turned_ring;

/// Lower bays of a long side with a banner over them, and with a curtain.
const BANNERS: [usize; 4] = [0, 2, 5, 7];
const CURTAINS: [usize; 2] = [1, 6];

pub(super) fn build(site: &mut Site) {
    for (number, side) in sides().into_iter().enumerate() {
        if number < 2 {
            for (at, bay) in BANNERS.into_iter().enumerate() {
                hang_banner(site, &side, bay, (at + number) % 3, (10 * number + bay) as u64);
            }
            for (at, bay) in CURTAINS.into_iter().enumerate() {
                hang_curtain(site, &side, bay, (at + 2 * number) % 3, (40 + 10 * number + bay) as u64);
            }
        } else {
            hang_banner(site, &side, 1, number % 3, 80 + number as u64);
        }
    }
    plants(site);
}

fn middle(side: &Side, bay: usize) -> f64 {
    -side.half + BAY * (bay as f64 + 0.5)
}

/// Over the rail, over the string course and down the wall.
fn hang_banner(site: &mut Site, side: &Side, bay: usize, colour: usize, seed: u64) {
    // Few cells cut the corner over the string course, which must stay hidden.
    let clear = if site.detail.is_below(0.2) { 0.04 } else { 0.0 };
    let path = [
        [0.16, GALLERY + 0.42],
        [0.13, GALLERY + 0.80],
        [0.0, GALLERY + 0.945],
        [-0.15, GALLERY + 0.80],
        [-0.42 - clear, GALLERY + 0.22],
        [-0.565 - clear, GALLERY - 0.22],
        [-0.565 - clear, GALLERY - 0.62],
        [-0.55, GALLERY - 1.02],
        [-0.55, GALLERY - 1.42],
    ];
    let cloth =
        Cloth { width: 1.02, drop: 1.0, folds: 4.5, depth: 0.035, tie: [0.0, 1.0], drawn_to: 0.0, seed };
    let cloth = banner(site.detail, cloth, &path).smooth_below(75.0);
    // Between two columns of the gallery, not before one.
    let place = side.place * at(middle(side, bay) + 0.25 * BAY, 0.0, 0.0);
    site.model.place(&cloth, &place, site.finishes.cloth[colour]);
}

/// On a rod between two columns, drawn to one of them.
fn hang_curtain(site: &mut Site, side: &Side, bay: usize, colour: usize, seed: u64) {
    let (detail, y) = (site.detail, SPRINGING - 0.42);
    let x = middle(side, bay);
    let half = 0.5 * BAY - 0.2;
    let bar = rod(&[dvec3(-half, 0.0, 0.0), dvec3(half, 0.0, 0.0)], detail.cuts(8.0, 5), false, |_| 0.02);
    let place = side.place * at(x, y, 0.0);
    site.model.place(&bar.smooth_below(80.0), &place, site.finishes.bronze);
    for (number, sign) in [-1.0, 1.0].into_iter().enumerate() {
        let cloth = Cloth {
            width: 1.15,
            drop: y - 0.06,
            folds: 6.0,
            depth: 0.055,
            tie: [1.25, 0.34],
            drawn_to: sign,
            seed: seed + 100 * number as u64,
        };
        let cloth = curtain(detail, cloth).smooth_below(75.0);
        let place = place * at(sign * 0.56, -0.025, 0.0);
        site.model.place(&cloth, &place, site.finishes.cloth[colour]);
        let section: Vec<_> = crate::outline::circle(0.009, detail.cuts(3.0, 3))
            .into_iter()
            .map(|p| p + glam::dvec2(0.035, 0.0))
            .collect();
        let ring = turned_ring(&section, detail.cuts(7.0, 5)).smooth_below(80.0);
        let upright = glam::DAffine3::from_rotation_z(0.5 * PI);
        for number in 0..if detail.is_below(0.5) { 0 } else { 5 } {
            let x = 1.1 * ((number as f64 + 0.5) / 5.0 - 0.5);
            site.model.place(&ring, &(place * at(x, 0.017, 0.0) * upright), site.finishes.bronze);
        }
    }
}

fn plants(site: &mut Site) {
    let (detail, f) = (site.detail, &site.finishes);
    let pot = urn(detail, 0.36, 0.62).smooth();
    let small = urn(detail, 0.26, 0.46).smooth();
    let [x, z] = COURT;
    let places: [DVec3; 8] = [
        dvec3(2.6, GROUND, 2.35),
        dvec3(2.6, GROUND, -2.35),
        dvec3(-2.6, GROUND, 2.35),
        dvec3(-2.6, GROUND, -2.35),
        dvec3(x - 1.75, GROUND, z - 1.75),
        dvec3(x - 1.75, GROUND, 1.75 - z),
        dvec3(1.75 - x, GROUND, z - 1.75),
        dvec3(1.75 - x, GROUND, 1.75 - z),
    ];
    for (number, p) in places.into_iter().enumerate() {
        let seed = number as u64;
        let place = at(p.x, p.y, p.z) * super::turn(40.0 * number as f64);
        if number < 4 {
            site.model.place_in(&small, &place, &[f.terracotta, f.soil]);
            let plant = agave(detail, 0.62, 20, seed).smooth_below(60.0);
            site.model.place(&plant, &(place * at(0.0, 0.42, 0.0)), f.leaf);
        } else {
            site.model.place_in(&pot, &place, &[f.terracotta, f.soil]);
            let plant = tree(detail, 1.9, 15, seed).smooth_below(60.0);
            site.model.place_in(&plant, &(place * at(0.0, 0.56, 0.0)), &[f.oak, f.leaf]);
        }
    }
}
