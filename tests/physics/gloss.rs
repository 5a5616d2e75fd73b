//! Surfaces that shine, against the path tracer: seen by the camera, by other surfaces, and by each other.

use crate::common::{assert_silent, context};
use crate::lights::room;
use crate::path_tracer::trace;
use crate::{SMALL, render};
use glam::Vec3;
use lightpaths::metrics::{debiased_relmse, energy_ratio};
use lightpaths::reference::Progressive;
use lightpaths::renderer::Layer;
use lightpaths::scene::{Light, LightKind, Material, Quality, Scene};

const QUALITY: Quality =
    Quality { edge_samples: 16, cache_points: 2_000, gather_rays: 144, gloss_rays: 32, ..SMALL };

/// The room with a block that shines on a floor that does, too, lit by a lamp and a panel.
fn shining(exponent: f32, editable: bool) -> Scene {
    let lamp = LightKind::Point { position: Vec3::new(0.2, 0.3, 0.1), intensity: Vec3::splat(0.5) };
    let mut scene = room(lamp);
    scene.lights.push(Light {
        name: "panel".to_owned(),
        kind: LightKind::Area {
            corner: Vec3::new(0.59, -0.1, -0.3),
            edge_u: Vec3::new(0.0, 0.0, 0.5),
            edge_v: Vec3::new(0.0, 0.3, 0.0),
            radiance: Vec3::new(2.0, 3.0, 4.0),
            samples: 10,
        },
        is_on: true,
    });
    let lobe = |specular| Material {
        diffuse: Vec3::new(0.2, 0.25, 0.3),
        specular,
        exponent,
        editable,
        ..scene.materials[0].clone()
    };
    let (block, floor) = (lobe(Vec3::splat(0.6)), lobe(Vec3::new(0.3, 0.4, 0.5)));
    scene.materials.extend([block, floor]);
    let half_height = 0.49;
    for triangle in &mut scene.triangles {
        let is_inside = triangle.positions.iter().all(|p| p.x.abs() < 0.55 && p.z.abs() < 0.65);
        let is_floor = triangle.positions.iter().all(|p| p.y < -half_height);
        triangle.material = if is_inside { 1 } else { 2 * u32::from(is_floor) };
    }
    assert!(scene.triangles.iter().filter(|triangle| triangle.material == 1).count() == 12);
    scene
}

/// Noise-free relMSE of the picture, and energy by layer.
fn errors(scene: Scene, samples: u32) -> [f64; 3] {
    errors_at(scene, samples, QUALITY)
}

fn errors_at(scene: Scene, samples: u32, quality: Quality) -> [f64; 3] {
    let tracer = trace(scene.clone(), scene.cameras[0].size, samples);
    let renderer = render(scene, quality);
    let picture = tracer.picture().unwrap();
    let halves = tracer.halves().unwrap();
    let layer = |layer| renderer.layer(layer).unwrap();
    [
        debiased_relmse(&layer(Layer::Beauty), [&halves[0], &halves[1]]),
        energy_ratio(&layer(Layer::Direct), &picture.direct),
        energy_ratio(&layer(Layer::Indirect), &picture.indirect),
    ]
}

/// [Yue §5]: up to 40 without a visible difference. Sharper lobes show an error that grows: what they send to other surfaces is
/// blurred, and the reference's own noise with it; their energy is right.
#[test]
fn lobes_broad_and_sharp_hold_against_the_path_tracer() {
    for exponent in [1.0, 10.0, 40.0, 200.0, 1000.0] {
        let [relmse, direct, indirect] = errors(shining(exponent, false), 192);
        println!("exponent {exponent}: relMSE {relmse:.2e}, direct {direct:.4}, indirect {indirect:.4}");
        assert!(exponent > 40.0 || relmse < 2e-3, "exponent {exponent}: relMSE {relmse:.2e}");
        assert!((direct - 1.0).abs() < 0.01, "exponent {exponent}: {direct} of the direct light");
        assert!((indirect - 1.0).abs() < 0.01, "exponent {exponent}: {indirect} of the indirect light");
    }
    assert_silent(&context());
}

/// What shines sends on to what does not, in as many directions as its lobe asks for; an editable lobe has to do with those of the
/// settings, and that is told.
#[test]
fn light_sent_on_is_as_sharp_as_its_lobe() {
    for (exponent, editable, directions, bound) in [
        (40.0, false, 144, 5e-4),
        (200.0, false, 625, 8e-4),
        (1000.0, false, 2916, 2.5e-3),
        (200.0, true, 144, f64::INFINITY),
    ] {
        let scene = shining(exponent, editable);
        let renderer = render(scene.clone(), QUALITY);
        let statistics = renderer.statistics().unwrap();
        assert_eq!(statistics.counts["directions of the sphere"], directions);
        let is_blurred = renderer.scene().warnings.iter().any(|warning| warning.contains("blurred"));
        assert_eq!(is_blurred, editable);
        if editable {
            continue;
        }
        let tracer = trace(scene.clone(), [40, 30], 1024);
        let albedo = tracer.traced_scene().first_hits().unwrap().albedo;
        let only = |layer: &[[f32; 3]]| -> Vec<[f32; 3]> {
            let pixels = layer.iter().zip(&albedo).filter(|(_, albedo)| albedo[0] > 0.5);
            pixels.map(|(pixel, _)| *pixel).collect()
        };
        let halves = tracer.halves().unwrap().map(|half| only(&half));
        assert!(halves[0].len() > 100);
        let [beauty, indirect] =
            [Layer::Beauty, Layer::Indirect].map(|layer| only(&renderer.layer(layer).unwrap()));
        let relmse = debiased_relmse(&beauty, [&halves[0], &halves[1]]);
        let energy = energy_ratio(&indirect, &only(&tracer.picture().unwrap().indirect));
        println!("exponent {exponent}, sent on: relMSE {relmse:.2e}, indirect {energy:.4}");
        assert!(relmse < bound && (energy - 1.0).abs() < 0.01, "{exponent}: {relmse:.2e}, {energy}");
    }
    assert_silent(&context());
}

/// Paths that are cosine sampled, so that materials may be edited, carry the same light; also after an edit from matt to shining.
#[test]
fn editable_surfaces_shine_alike() {
    // Over six seeds of 50 000 entry points indirect light has a mean of 0.9999 and scatters by 0.65 %.
    let many = Quality { entry_points: 200_000, ..QUALITY };
    let [relmse, direct, indirect] = errors_at(shining(20.0, true), 192, many);
    println!("editable: relMSE {relmse:.2e}, direct {direct:.4}, indirect {indirect:.4}");
    assert!(relmse < 2e-3);
    assert!((direct - 1.0).abs() < 0.01 && (indirect - 1.0).abs() < 0.01);
    let mut matt = shining(20.0, true);
    matt.materials[1..].iter_mut().for_each(|material| material.specular = Vec3::ZERO);
    let shining = render(shining(20.0, true), QUALITY);
    let mut edited = render(matt, QUALITY);
    for (index, material) in shining.scene().materials.iter().enumerate().skip(1) {
        edited.set_material(index, material.diffuse, material.specular, material.exponent).unwrap();
    }
    edited.frame().unwrap();
    assert!(edited.layer(Layer::Beauty).unwrap() == shining.layer(Layer::Beauty).unwrap());
    // What was not declared editable cannot start to shine.
    let refused = edited.set_material(0, Vec3::splat(0.5), Vec3::splat(0.2), 10.0).unwrap_err();
    assert!(refused.to_string().contains("editable = true"), "{refused}");
    assert_silent(&context());
}

/// Without light paths nothing is known of what surfaces send to each other: highlights are all that a glossy surface adds, and they are
/// those of the whole picture.
#[test]
fn direct_light_alone_is_that_of_the_whole_picture() {
    for exponent in [2.0, 20.0, 400.0] {
        let scene = shining(exponent, false);
        let whole = render(scene.clone(), QUALITY);
        let alone = render(scene, Quality { entry_points: 0, cache_points: 0, ..QUALITY });
        let direct = alone.layer(Layer::Direct).unwrap();
        assert!(direct.as_flattened().iter().all(|value| value.is_finite()), "exponent {exponent}");
        assert!(direct == whole.layer(Layer::Direct).unwrap(), "exponent {exponent}");
        let beauty = alone.layer(Layer::Beauty).unwrap();
        for (beauty, direct) in beauty.as_flattened().iter().zip(direct.as_flattened()) {
            assert!((beauty - direct).abs() <= 1e-6 * direct, "{beauty} instead of {direct}");
        }
    }
    assert_silent(&context());
}
