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
