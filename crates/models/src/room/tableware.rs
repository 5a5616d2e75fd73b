//! Objects on the dining table: plates, cups, a bowl of fruit, candlesticks, an open book.

use glam::{DVec3, dvec3};

use super::Site;
use super::tables::{DINING, TABLE_HEIGHT};
use crate::model::{at, turn};
use crate::moulding::rod;
use crate::outline::{Detail, Outline};
use crate::rng::Rng;
use crate::sheet::slab;
use crate::solid::Solid;
use crate::turning::{fluted, turned};

pub(super) fn build(site: &mut Site) {
    let detail = site.detail;
    let on = at(DINING[0], TABLE_HEIGHT + 0.0006, DINING[1]);
    let [plate, cup] = [plate(detail), cup(detail)].map(Solid::smooth);
    for (number, [x, z]) in [[-0.36, -0.26], [0.38, -0.27], [-0.38, 0.27]].into_iter().enumerate() {
        site.model.place(&plate, &(on * at(x, 0.0, z)), site.finishes.porcelain);
        let side = if z < 0.0 { 0.10 } else { -0.10 };
        let cup_at = on * at(x + 0.20, 0.0, z + side) * turn(50.0 * number as f64);
        site.model.place(&cup, &cup_at, site.finishes.glaze);
    }
    fruit_bowl(site);
    let stick = candlestick(detail).smooth();
    let candle = Outline::from(0.011, 0.205, detail).to(0.0105, 0.36).arc(0.0, 0.366, 0.3, 3.0).points();
    let candle = turned(&candle, detail.cuts(14.0, 5)).smooth();
    for [x, z] in [[-0.20, 0.05], [0.22, -0.04]] {
        site.model.place(&stick, &(on * at(x, 0.0, z)), site.finishes.brass);
        site.model.place(&candle, &(on * at(x, 0.0, z)), site.finishes.paper);
    }
    open_book(site, [0.52, 0.22]);
}

fn plate(detail: Detail) -> Solid {
    let profile = Outline::from(0.07, 0.0, detail)
        .to(0.072, 0.0)
        .through(&[[0.085, 0.008], [0.128, 0.019]], 3.0)
        .arc(0.126, 0.0225, 0.9, 3.0)
        .through(&[[0.085, 0.013], [0.07, 0.0065]], 3.0);
    turned(&profile.points(), detail.cuts(40.0, 8))
}

fn cup(detail: Detail) -> Solid {
    let profile = Outline::from(0.024, 0.0, detail)
        .to(0.026, 0.0)
        .through(&[[0.030, 0.010], [0.040, 0.045], [0.043, 0.075]], 3.0)
        .arc(0.040, 0.075, 0.9, 3.0)
        .through(&[[0.036, 0.045], [0.027, 0.014]], 3.0);
    let mut cup = turned(&profile.points(), detail.cuts(26.0, 7));
    let cuts = detail.cuts(12.0, 5);
    let ear: Vec<DVec3> = (0..=cuts)
        .map(|cut| {
            let angle = std::f64::consts::PI * (cut as f64 / cuts as f64 - 0.5);
            dvec3(0.037 + 0.022 * angle.cos(), 0.043 + 0.021 * angle.sin(), 0.0)
        })
        .collect();
    cup.join(rod(&ear, detail.cuts(8.0, 3), false, |_| 0.0036));
    cup
}

fn fruit_bowl(site: &mut Site) {
    let detail = site.detail;
    let on = at(DINING[0] + 0.01, TABLE_HEIGHT + 0.0006, DINING[1] + 0.02);
    let profile = Outline::from(0.055, 0.0, detail)
        .to(0.06, 0.0)
        .through(&[[0.05, 0.015], [0.10, 0.045], [0.145, 0.085]], 3.0)
        .arc(0.139, 0.087, 0.9, 3.0)
        .through(&[[0.095, 0.053], [0.045, 0.026]], 3.0);
    let bowl = turned(&profile.points(), detail.cuts(48.0, 9)).smooth();
    site.model.place(&bowl, &on, site.finishes.porcelain);
    let mut rng = Rng::new(41);
    let fruit = |lobes: f64| {
        let profile = Outline::from(0.0, -0.033, detail).through(
            &[[0.014, -0.035], [0.033, -0.014], [0.037, 0.008], [0.024, 0.032], [0.008, 0.031], [0.0, 0.027]],
            2.0,
        );
        let swell = move |turn: f64, y: f64| {
            1.0 + 0.02 * lobes * (std::f64::consts::TAU * 5.0 * turn).cos() * (-y / 0.035).max(0.0)
        };
        fluted(&profile.points(), detail.cuts(20.0, 6), swell).smooth_below(70.0)
    };
    let [orange, apple] = [fruit(0.0), fruit(1.0)];
    let ring = [0.062; 5].into_iter().chain([0.0, 0.022]).enumerate();
    for (number, radius) in ring {
        let angle = std::f64::consts::TAU * number as f64 / 5.0;
        let y = if number < 5 { 0.081 } else { 0.128 + 0.0005 * number as f64 };
        let lift = if number == 5 { -0.03 } else { 0.03 };
        let p = if number < 5 {
            dvec3(radius * angle.cos(), y, radius * angle.sin())
        } else {
            dvec3(lift, y, radius)
        };
        let place = on * at(p.x, p.y, p.z) * turn(rng.between(0.0, 360.0));
        let lean = glam::DAffine3::from_rotation_x(rng.between(-0.4, 0.4));
        let (part, finish) = if rng.fraction() < 0.5 {
            (&orange, site.finishes.fruit[0])
        } else {
            (&apple, site.finishes.fruit[1])
        };
        site.model.place(part, &(place * lean), finish);
    }
}

fn candlestick(detail: Detail) -> Solid {
    let profile = Outline::from(0.05, 0.0, detail)
        .arc(0.046, 0.008, 0.6, 3.0)
        .through(&[[0.018, 0.022], [0.010, 0.05]], 3.0)
        .arc(0.010, 0.066, 0.9, 4.0)
        .through(&[[0.008, 0.10], [0.013, 0.14], [0.008, 0.165]], 3.0)
        .arc(0.010, 0.178, 0.8, 3.0)
        .through(&[[0.024, 0.196]], 2.0)
        .arc(0.022, 0.200, 0.8, 2.0)
        .to(0.0125, 0.200)
        .to(0.0125, 0.21);
    turned(&profile.points(), detail.cuts(20.0, 6))
}

/// An open book on the table: two blocks of leaves that curve to the spine, some loose leaves, and
/// the cover below.
fn open_book(site: &mut Site, [x, z]: [f64; 2]) {
    let detail = site.detail;
    let place = at(DINING[0] + x, TABLE_HEIGHT + 0.0006, DINING[1] + z) * turn(158.0);
    let (w, h) = (0.15, 0.22);
    let curve = |t: f64| 0.021 * (std::f64::consts::PI * t.powf(0.6)).sin() * (1.0 - 0.45 * t) + 0.007;
    let cells = [detail.cuts(12.0, 4), 1];
    let mut leaves = Solid::default();
    for side in [-1.0, 1.0] {
        let face = |u: f64| if side > 0.0 { u } else { 1.0 - u };
        let top = |u: f64, v: f64| dvec3(side * (0.0012 + w * face(u)), curve(face(u)), h * (0.5 - v));
        let bottom = |u: f64, v: f64| dvec3(side * (0.0012 + w * face(u)), 0.0034, h * (0.5 - v));
        leaves.join(slab(cells, top, bottom));
        for leaf in 1..if detail.is_below(0.3) { 1 } else { 5 } {
            let lift = f64::from(leaf) * 0.16;
            // Turned about the spine, and bent back towards their ends.
            let at = |u: f64, v: f64, more: f64| {
                let t = face(u);
                let angle = lift * (1.0 - 0.55 * t) + 0.05 * v;
                let (p, q) = (w * t, curve(t) + 0.0015 + more);
                dvec3(
                    side * (0.0012 + p * angle.cos() - 0.3 * q * angle.sin()),
                    q + p * angle.sin(),
                    h * (0.5 - v),
                )
            };
            leaves.join(slab(cells, |u, v| at(u, v, 0.0006), |u, v| at(u, v, 0.0)));
        }
    }
    site.model.place(&leaves.smooth(), &place, site.finishes.paper);
    let cover = crate::panel::block([-w - 0.006, 0.0, -0.5 * h - 0.005], [w + 0.006, 0.003, 0.5 * h + 0.005]);
    site.model.place(&cover.smooth(), &place, site.finishes.covers[0]);
}
