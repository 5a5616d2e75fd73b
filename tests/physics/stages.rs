//! Ablation: stages replaced by exact references.

use crate::common::{assert_silent, context};
use crate::{SMALL, render};
use glam::Vec3;
use lightpaths::passes::precompute::Silent;
use lightpaths::renderer::{Exact, Layer, Renderer, Stage, Work};
use lightpaths::scene::{Quality, shapes};

const EXACT: [Stage; 3] = [Stage::Splat, Stage::Clusters, Stage::Gather];

#[test]
fn exact_irradiance_in_the_integrating_sphere_is_the_closed_form() {
    let (flux, albedo) = (10.0, 0.5);
    let scene = shapes::integrating_sphere(1.5, 3, albedo, Vec3::new(0.3, 0.4, 0.2), flux);
    let renderer = render(scene, SMALL);
    let expected =
        f64::from(flux) / renderer.scene().area_m2() * f64::from(albedo) / (1.0 - f64::from(albedo));
    for stage in [Stage::Clusters, Stage::Gather] {
        let means = [0, 1].map(|sequence| {
            let found = renderer.exact_irradiance(Exact { stage, samples: 2, sequence }).unwrap();
            let emission_scale = renderer.stages().emission_scale;
            let errors: Vec<f64> =
                found.iter().map(|e| f64::from(emission_scale.y * e.y) / expected - 1.0).collect();
            let count = errors.len() as f64;
            let mean = errors.iter().sum::<f64>() / count;
            let rms = (errors.iter().map(|error| error * error).sum::<f64>() / count).sqrt();
            println!("{stage:?}: mean {:+.3} %, RMS {:.3} %", 100.0 * mean, 100.0 * rms);
            // The error of the mean of some hundred points, by the spread of one; each point is
            // within a tenth.
            assert!(mean.abs() <= 4.0 * rms / count.sqrt() && rms <= 0.1, "{stage:?}: {mean}, {rms}");
            mean
        });
        assert_ne!(means[0], means[1], "two sequences are two estimates");
    }
    assert_silent(&context());
}

#[test]
fn the_frame_stays_as_it_was() {
    let scene = shapes::closed_box(Vec3::new(2.0, 1.5, 1.0), 0.7);
    let mut renderer = render(scene, Quality { cache_points: 200, ..SMALL });
    let before = renderer.layer(Layer::Beauty).unwrap();
    let indirect = renderer.layer(Layer::Indirect).unwrap();
    for stage in EXACT {
        let exact = Exact { stage, samples: 1, sequence: 0 };
        let found = renderer.layer_with_exact(exact, Layer::Indirect).unwrap();
        assert!(found != indirect, "{stage:?} changes something");
        assert!(
            renderer.layer_with_exact(exact, Layer::Indirect).unwrap() == found,
            "and the same each time"
        );
        assert!(renderer.layer(Layer::Beauty).unwrap() == before, "{stage:?}: the picture");
        renderer.force(Work::View);
        renderer.frame().unwrap();
        assert!(renderer.layer(Layer::Beauty).unwrap() == before, "{stage:?}: the next frame");
    }
    assert_silent(&context());
}

/// A frame sums only the clusters of the live set, and rays of an exact stage meet others.
#[test]
fn exact_stages_work_out_what_frames_leave_out() {
    let mut scene = shapes::closed_box(Vec3::new(2.0, 1.5, 1.0), 0.7);
    scene.quality = Quality { cache_points: 3, ..SMALL };
    let mut renderer = Renderer::new(&context(), scene, &mut Silent).unwrap();
    renderer.frame().unwrap();
    let fluxes = |renderer: &Renderer| renderer.stages().cluster_flux.read::<u32>().unwrap();
    let of_frame = fluxes(&renderer);
    let exact = |stage| Exact { stage, samples: 1, sequence: 0 };
    let found = |renderer: &Renderer| {
        EXACT.map(|stage| renderer.layer_with_exact(exact(stage), Layer::Indirect).unwrap())
    };
    let left_out = found(&renderer);
    assert!(fluxes(&renderer) != of_frame, "something was left out");
    renderer.set_skipping(false);
    renderer.frame().unwrap();
    assert!(found(&renderer) == left_out);
    assert_silent(&context());
}
