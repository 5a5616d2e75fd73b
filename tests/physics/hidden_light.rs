//! A light just behind a screen, both in one cell with the wall: what gather rays read where they meet the screen. [Yue §5, Figure 3]

use crate::common::{assert_silent, context};
use crate::{SMALL, render};
use glam::Vec3;
use lightpaths::renderer::{Exact, Renderer, Stage};
use lightpaths::scene::{Quality, shapes};
use lightpaths::types::{CachePoint, Record};

/// Relative errors of the irradiance gathered at cache points.
struct Errors {
    mean: f64,
    rms: f64,
    count: usize,
}

fn errors(renderer: &Renderer, exact: &[Vec3], is_meant: impl Fn(&CachePoint) -> bool) -> Errors {
    let points: Vec<CachePoint> = renderer.stages().cache_points.read().unwrap();
    let records: Vec<Record> = renderer.stages().gathered.read().unwrap();
    let (mut sum, mut expected, mut squares, mut count) = (0.0, 0.0, 0.0, 0);
    for ((point, record), exact) in points.iter().zip(&records).zip(exact) {
        if is_meant(point) {
            let error = f64::from(record.irradiance.x - exact.x);
            sum += error;
            expected += f64::from(exact.x);
            squares += (error / f64::from(exact.x)).powi(2);
            count += 1;
        }
    }
    Errors { mean: sum / expected, rms: (squares / count as f64).sqrt(), count }
}

#[test]
fn light_behind_a_screen_stays_there() {
    for occlusion in [false, true] {
        let scene = shapes::hidden_light(0.8, 0.16, 0.5);
        let quality = Quality { entry_points: 100_000, gather_rays: 144, occlusion, ..SMALL };
        let renderer = render(scene, quality);
        let exact = renderer.exact_irradiance(Exact { stage: Stage::Clusters, samples: 16, sequence: 0 }).unwrap();
        let again = renderer.exact_irradiance(Exact { stage: Stage::Clusters, samples: 16, sequence: 1 }).unwrap();
        let faces = |point: &CachePoint| point.normal.x < -0.9 && point.position.x > 0.9;
        let rest = |point: &CachePoint| point.normal.x.abs() < 0.1;
        for (what, which) in [("facing", &faces as &dyn Fn(&CachePoint) -> bool), ("rest", &rest)] {
            let e = errors(&renderer, &exact, which);
            let f = errors(&renderer, &again, which);
            println!("{occlusion} {what}: mean {:+.4} {:+.4} rms {:.4} {:.4} of {}", e.mean, f.mean, e.rms, f.rms, e.count);
        }
        for (k, v) in &renderer.statistics().unwrap().counts { println!("  {k}: {v}"); }
        println!("{:?}", renderer.statistics().unwrap().precompute_stages);
    }
    assert_silent(&context());
}

#[test]
fn diagnose() {
    for occlusion in [false, true] {
        let scene = shapes::hidden_light(0.8, 0.16, 0.5);
        let quality = Quality { entry_points: 100_000, gather_rays: 144, occlusion, ..SMALL };
        let renderer = render(scene, quality);
        let points: Vec<CachePoint> = renderer.stages().cache_points.read().unwrap();
        let rays = renderer.stages().gather_rays.read().unwrap();
        let irr: Vec<Vec3> = renderer.stages().cluster_irradiance.read().unwrap();
        let bits = (irr.len() as u32 + 1).next_power_of_two().ilog2();
        let strata = lightpaths::cpu::hemisphere::Strata { rings: 6, sectors: 24 };
        let clusters = 8735;
        let mut sums = std::collections::BTreeMap::<(String, bool), [f64; 3]>::new();
        for (i, p) in points.iter().enumerate() {
            if !(p.normal.x < -0.9 && p.position.x > 0.9) { continue; }
            for r in 0..144u32 {
                let t = rays[i * 144 + r as usize].target;
                if t == u32::MAX { continue; }
                let c = t & ((1 << bits) - 1);
                let d = lightpaths::cpu::hemisphere::frame(p.normal) * strata.direction(r, i as u32, 0);
                let o = p.position.as_dvec3();
                let s = (-0.84 - o.x) / d.x;
                let h = o + s * d;
                let w = (-1.0 - o.x) / d.x;
                let hw = o + w * d;
                let what = if h.y.abs() < 0.4 && h.z.abs() < 0.4 { format!("screen {}", ((h.y.abs().max(h.z.abs())) * 10.0) as u32) }
                    else if hw.y.abs() < 1.0 && hw.z.abs() < 1.0 { format!("wall {}", ((hw.y.abs().max(hw.z.abs())) * 10.0) as u32) } else { "sides".into() };
                let direct = if what.starts_with("wall") { 0.08 / (0.08f64.powi(2) + hw.y * hw.y + hw.z * hw.z).powf(1.5) } else { 0.0 };
                let e = sums.entry((what, c >= clusters)).or_default();
                e[0] += 1.0; e[1] += f64::from(irr[c as usize].x); e[2] += direct;
            }
        }
        for (k, e) in sums { println!("{occlusion} {k:?}: {} rays, read {:.4}, direct {:.4}", e[0], e[1] / e[0], e[2] / e[0]); }
    }
}

#[test]
fn diagnose2() {
    use lightpaths::scene::{grid, hvds::Hvds, surfaces};
    let scene = shapes::hidden_light(0.8, 0.16, 0.5);
    let quality = Quality { entry_points: 100_000, gather_rays: 144, ..SMALL };
    let renderer = render(scene, quality);
    let tri = &renderer.scene().triangles;
    let sees = surfaces::sides_that_see_something(tri);
    let surf: Vec<_> = tri.iter().zip(sees).map(|(t, s)| surfaces::surface(t, s)).collect();
    let (low, high) = renderer.scene().bounds();
    let hvds = Hvds::build(tri, &surf, grid::grid(low, high, 32), 32);
    println!("{} {:?}", hvds.cluster_count(), hvds.levels);
    let irr: Vec<Vec3> = renderer.stages().cluster_irradiance.read().unwrap();
    let flux: Vec<lightpaths::passes::frame::hvds::ClusterFlux> = renderer.stages().cluster_flux.read().unwrap();
    for p in &hvds.pieces {
        let m = p.corners.iter().sum::<Vec3>() / p.corners.len() as f32;
        if m.x < -0.8 && m.y.abs() < 0.4 && m.y >= 0.0 && m.z.abs() < 0.04 && m.z > 0.0 && surf[p.side as usize / 2].normal.x.abs() > 0.5 {
            let n = surf[p.side as usize / 2].normal * if p.side % 2 == 1 { -1.0 } else { 1.0 };
            let mut c = p.cluster;
            let mut s = String::new();
            for _ in 0..4 {
                s += &format!(" [{c}: {:.3} d {:.3} i {:.3}]", irr[c as usize].x, flux[c as usize].direct.x / hvds.areas_m2[c as usize], flux[c as usize].indirect.x / hvds.areas_m2[c as usize]);
                c = hvds.parents[c as usize];
            }
            println!("{m:.3} n {n:.1} {s}");
        }
    }
}
