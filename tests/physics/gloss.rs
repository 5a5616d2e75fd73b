//! Glossy surfaces against the path tracer: seen by the camera, by other surfaces, and
//! by each other.

use crate::common::{assert_silent, context};
use crate::lights::room;
use crate::path_tracer::trace;
use crate::{SMALL, render};
use glam::Vec3;
use lightpaths::metrics::{debiased_relmse, energy_ratio};
use lightpaths::reference::{Picture, Progressive};
use lightpaths::renderer::Layer;
use lightpaths::scene::{Light, LightKind, Material, Quality, Scene, Triangle, shapes};
use std::f32::consts::TAU;
use std::sync::LazyLock;

const QUALITY: Quality =
    Quality { edge_samples: 16, cache_points: 2_000, gather_rays: 144, gloss_rays: 32, ..SMALL };

/// Settings for tests that compare pictures with each other only.
const SKETCH: Quality = Quality { entry_points: 2_000, cache_points: 100, gather_rays: 36, ..QUALITY };

/// The room with a glossy block and a glossy floor, lit by a point light and an area light.
fn glossy(exponent: f32, editable: bool) -> Scene {
    let lamp = LightKind::Point { position: Vec3::new(0.2, 0.3, 0.1), intensity: Vec3::splat(0.5) };
    let mut scene = room(lamp);
    let panel = LightKind::Area {
        corner: Vec3::new(0.59, -0.1, -0.3),
        edge_u: Vec3::new(0.0, 0.0, 0.5),
        edge_v: Vec3::new(0.0, 0.3, 0.0),
        radiance: Vec3::new(2.0, 3.0, 4.0),
        samples: 10,
    };
    scene.lights.push(Light::new("panel", panel));
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

/// One scene of [`glossy`] by both methods.
struct Case {
    exponent: f32,
    beauty: Vec<[f32; 3]>,
    direct: Vec<[f32; 3]>,
    indirect: Vec<[f32; 3]>,
    halves: [Vec<[f32; 3]>; 2],
    truth: Picture,
    /// Albedo of each pixel.
    albedo: Vec<[f32; 3]>,
    directions: u64,
}

impl Case {
    fn new(scene: Scene, samples: u32, quality: Quality) -> Self {
        let tracer = trace(scene.clone(), scene.cameras[0].size, samples);
        let exponent = scene.materials[scene.materials.len() - 1].exponent;
        let renderer = render(scene, quality);
        let layer = |layer| renderer.layer(layer).unwrap();
        Self {
            exponent,
            beauty: layer(Layer::Beauty),
            direct: layer(Layer::Direct),
            indirect: layer(Layer::Indirect),
            halves: tracer.halves().unwrap(),
            truth: tracer.picture().unwrap(),
            albedo: tracer.traced_scene().first_hits().unwrap().albedo,
            directions: renderer.statistics().unwrap().counts["directions of the sphere"],
        }
    }

    /// Noise-free relMSE of the picture, and energy by layer.
    fn errors(&self) -> [f64; 3] {
        let [a, b] = &self.halves;
        [
            debiased_relmse(&self.beauty, [a, b]),
            energy_ratio(&self.direct, &self.truth.direct),
            energy_ratio(&self.indirect, &self.truth.indirect),
        ]
    }

    /// Noise-free relMSE of the pixels that are not glossy, and the energy of their indirect light.
    fn errors_sent_on(&self) -> [f64; 2] {
        let only = |layer: &[[f32; 3]]| -> Vec<[f32; 3]> {
            let pixels = layer.iter().zip(&self.albedo).filter(|(_, albedo)| albedo[0] > 0.5);
            pixels.map(|(pixel, _)| *pixel).collect()
        };
        let [a, b] = [0, 1].map(|half: usize| only(&self.halves[half]));
        assert!(a.len() > 100);
        [
            debiased_relmse(&only(&self.beauty), [&a, &b]),
            energy_ratio(&only(&self.indirect), &only(&self.truth.indirect)),
        ]
    }
}

/// Cases that several tests use.
static CASES: LazyLock<[Case; 3]> =
    LazyLock::new(|| [1.0, 40.0, 200.0].map(|exponent| Case::new(glossy(exponent, false), 256, QUALITY)));

/// [Yue §5]: exponents up to 40 have no visible difference. Sharper lobes have a growing
/// error: their light on other surfaces is blurred, and so is the reference's own noise. Their
/// energy is right.
#[track_caller]
fn check_lobe(case: &Case, tolerance: f64) {
    let exponent = case.exponent;
    let [relmse, direct, indirect] = case.errors();
    println!("exponent {exponent}: relMSE {relmse:.2e}, direct {direct:.4}, indirect {indirect:.4}");
    assert!(exponent > 40.0 || relmse < 6e-4, "exponent {exponent}: relMSE {relmse:.2e}");
    assert!((direct - 1.0).abs() < 0.01, "exponent {exponent}: {direct} of the direct light");
    assert!((indirect - 1.0).abs() < tolerance, "exponent {exponent}: {indirect} of the indirect light");
}

/// Over seeds, indirect light of 50 000 entry points scatters by 0.65 %: the bound is
/// three times that.
#[test]
fn lobes_broad_and_sharp_hold_against_the_path_tracer() {
    CASES.iter().for_each(|case| check_lobe(case, 0.02));
    assert_silent(&context());
}

/// Light of glossy surfaces on diffuse ones, in as many direction bins as the lobe needs.
#[track_caller]
fn check_sent_on(case: &Case, directions: u64, bound: f64, tolerance: f64) {
    let exponent = case.exponent;
    assert_eq!(case.directions, directions, "exponent {exponent}");
    let [relmse, energy] = case.errors_sent_on();
    println!("exponent {exponent}, sent on: relMSE {relmse:.2e}, indirect {energy:.4}");
    assert!(relmse < bound && (energy - 1.0).abs() < tolerance, "{exponent}: {relmse:.2e}, {energy}");
}

/// Over three seeds, relMSE at an exponent of 200 is 3e-4 to 5e-4. The number of direction bins
/// would show a blur.
#[test]
fn light_sent_on_is_as_sharp_as_its_lobe() {
    check_sent_on(&CASES[1], 144, 5e-4, 0.02);
    check_sent_on(&CASES[2], 625, 8e-4, 0.02);
    assert_silent(&context());
}

#[test]
#[ignore = "full size: make stress"]
fn sharp_lobes_hold_against_the_path_tracer() {
    for (exponent, directions, bound) in
        [(10.0, 144, 5e-4), (40.0, 144, 5e-4), (200.0, 625, 8e-4), (1000.0, 2916, 2.5e-3)]
    {
        let case = Case::new(glossy(exponent, false), 1024, QUALITY);
        check_lobe(&case, 0.01);
        check_sent_on(&case, directions, bound, 0.01);
    }
    assert_silent(&context());
}

/// A sharper lobe gets more direction bins. An editable one gets the number of the settings,
/// with a warning.
#[test]
fn directions_follow_the_sharpest_lobe() {
    for (exponent, editable, directions) in [(1000.0, false, 2916), (200.0, true, 144)] {
        let renderer = render(glossy(exponent, editable), SKETCH);
        assert_eq!(renderer.statistics().unwrap().counts["directions of the sphere"], directions);
        let is_blurred = renderer.scene().warnings.iter().any(|warning| warning.contains("blurred"));
        assert_eq!(is_blurred, editable);
    }
    // Without cache points, no surface reads the outgoing light of another, so nothing is blurred.
    let renderer = render(glossy(200.0, true), Quality { cache_points: 0, ..SKETCH });
    assert_eq!(renderer.scene().warnings, [""; 0]);
    assert_silent(&context());
}

/// Cosine-sampled paths, as editable materials need them, carry the same light.
fn check_editable(entry_points: u32, tolerance: f64) {
    let case = Case::new(glossy(20.0, true), 192, Quality { entry_points, ..QUALITY });
    let [relmse, direct, indirect] = case.errors();
    println!("editable: relMSE {relmse:.2e}, direct {direct:.4}, indirect {indirect:.4}");
    assert!(relmse < 2e-3);
    assert!((direct - 1.0).abs() < 0.01 && (indirect - 1.0).abs() < tolerance);
    assert_silent(&context());
}

/// Over six seeds of 50 000 entry points indirect light has a mean of 0.9999 and scatters by 0.65
/// %: the bound is three times that.
#[test]
fn editable_surfaces_reflect_alike() {
    check_editable(50_000, 0.02);
}

#[test]
#[ignore = "full size: make stress"]
fn editable_surfaces_reflect_alike_by_many_paths() {
    check_editable(200_000, 0.01);
}

#[test]
fn surfaces_edited_from_diffuse_to_glossy_are_as_good_as_loaded() {
    let mut diffuse = glossy(20.0, true);
    diffuse.materials[1..].iter_mut().for_each(|material| material.specular = Vec3::ZERO);
    let glossy = render(glossy(20.0, true), SKETCH);
    let mut edited = render(diffuse, SKETCH);
    for (index, material) in glossy.scene().materials.iter().enumerate().skip(1) {
        edited.set_material(index, material.diffuse, material.specular, material.exponent).unwrap();
    }
    edited.frame().unwrap();
    assert!(edited.layer(Layer::Beauty).unwrap() == glossy.layer(Layer::Beauty).unwrap());
    // A material that is not editable cannot become glossy.
    let refused = edited.set_material(0, Vec3::splat(0.5), Vec3::splat(0.2), 10.0).unwrap_err();
    assert!(refused.to_string().contains("editable = true"), "{refused}");
    assert_silent(&context());
}

/// An edit of the walls alone decides whether the strong lobes of floor and block take records or
/// rays. Exponents above 100 change nothing else that rays depend on.
#[test]
fn lobes_move_between_rays_and_records_as_loaded() {
    let of_walls = |specular: f32| {
        let mut scene = glossy(110.0, false);
        let (diffuse, specular) = (Vec3::splat(0.3), Vec3::splat(specular));
        scene.materials[0] =
            Material { diffuse, specular, exponent: 110.0, editable: true, ..scene.materials[0].clone() };
        render(scene, Quality { gather_rays: 256, ..SKETCH })
    };
    let loaded = [0.1, 0.4].map(of_walls);
    let pictures = loaded.each_ref().map(|renderer| renderer.layer(Layer::Beauty).unwrap());
    assert!(pictures[0] != pictures[1]);
    // Rays are traced for the first edit: the scene was loaded with records.
    let [_, mut edited] = loaded;
    for (specular, picture) in [(0.1, &pictures[0]), (0.4, &pictures[1])] {
        edited.set_material(0, Vec3::splat(0.3), Vec3::splat(specular), 110.0).unwrap();
        edited.set_skipping(true);
        edited.frame().unwrap();
        assert!(edited.layer(Layer::Beauty).unwrap() == *picture, "specular albedo {specular}");
    }
    assert_silent(&context());
}

/// Without light paths there is no light between surfaces. A glossy surface adds only highlights,
/// and they equal those of the whole picture.
#[test]
fn direct_light_alone_is_that_of_the_whole_picture() {
    for case in &*CASES {
        let exponent = case.exponent;
        let alone = render(glossy(exponent, false), Quality { entry_points: 0, cache_points: 0, ..QUALITY });
        let direct = alone.layer(Layer::Direct).unwrap();
        assert!(direct.as_flattened().iter().all(|value| value.is_finite()), "exponent {exponent}");
        assert!(direct == case.direct, "exponent {exponent}");
        let beauty = alone.layer(Layer::Beauty).unwrap();
        for (beauty, direct) in beauty.as_flattened().iter().zip(direct.as_flattened()) {
            assert!((beauty - direct).abs() <= 1e-6 * direct, "{beauty} instead of {direct}");
        }
    }
    assert_silent(&context());
}

/// Pixels whose indirect light is more than twice that of each of their neighbours.
fn dots(indirect: &[[f32; 3]], width: usize) -> usize {
    let height = indirect.len() / width;
    let value = |x: usize, y: usize| indirect[y * width + x][1];
    let is_dot = |x: usize, y: usize| {
        let around = (y - 1..=y + 1).flat_map(|v| (x - 1..=x + 1).map(move |u| (u, v)));
        let brightest = around.filter(|&place| place != (x, y)).map(|(u, v)| value(u, v)).fold(0.0, f32::max);
        value(x, y) > 2.0 * brightest
    };
    (1..height - 1).flat_map(|y| (1..width - 1).map(move |x| (x, y))).filter(|&(x, y)| is_dot(x, y)).count()
}

/// Broad lobes on every surface take their light from records, so that no pixel stands out. Lobes
/// that are too sharp for records take it from few rays.
#[test]
fn broad_gloss_on_every_surface_has_no_bright_dots() {
    let lamp = LightKind::Point { position: Vec3::new(0.2, 0.3, 0.1), intensity: Vec3::splat(0.5) };
    let of = |exponent: f32| {
        let mut scene = room(lamp);
        scene.cameras[0].size = [160, 120];
        for material in &mut scene.materials {
            (material.diffuse, material.specular) = (Vec3::splat(0.05), Vec3::splat(0.4));
            material.exponent = exponent;
        }
        scene
    };
    let quality = Quality { edge_samples: 0, ..QUALITY };
    let broad = Case::new(of(20.0), 64, quality.clone());
    let [relmse, _, indirect] = broad.errors();
    println!("relMSE {relmse:.2e}, indirect {indirect:.4}");
    assert!(relmse < 3e-2 && (indirect - 1.0).abs() < 0.03, "relMSE {relmse:.2e}, indirect {indirect}");
    let sharp = render(of(80.0), quality).layer(Layer::Indirect).unwrap();
    let [broad, sharp] = [&broad.indirect, &sharp].map(|indirect| dots(indirect, 160));
    assert!(broad == 0 && sharp > 20, "{broad} dots of broad lobes, {sharp} of sharp ones");
    assert_silent(&context());
}

/// Three glossy rods before the walls, one to two pixels wide and almost upright.
fn rods() -> Scene {
    const SIDES: u32 = 16;
    const RADIUS: f32 = 0.012;
    let mut scene = shapes::closed_box(Vec3::new(1.2, 1.0, 1.4), 0.6);
    let specular = Vec3::splat(0.6);
    let rod =
        Material { diffuse: Vec3::splat(0.05), specular, exponent: 200.0, ..scene.materials[0].clone() };
    scene.materials.push(rod);
    for place in [-1.0, 0.0, 1.0_f32] {
        let around = |side: u32| {
            let (sine, cosine) = (TAU * side as f32 / SIDES as f32).sin_cos();
            let normal = Vec3::new(cosine, 0.0, sine);
            let at = |y: f32| Vec3::new(0.3 * place + 0.1 * place * y, y, 0.0) + RADIUS * normal;
            ([at(-0.4), at(0.4)], normal)
        };
        for side in 0..SIDES {
            let ([a, b], [n, m]) =
                ([around(side).0, around(side + 1).0], [around(side).1, around(side + 1).1]);
            let mut add = |positions, normals| {
                scene.triangles.push(Triangle { positions, normals, material: 1, object: 0 });
            };
            add([a[0], a[1], b[1]], [n, n, m]);
            add([a[0], b[1], b[0]], [n, m, m]);
        }
    }
    let camera = &mut scene.cameras[0];
    (camera.position, camera.target) = (Vec3::new(0.0, 0.0, 0.65), Vec3::ZERO);
    (camera.fov_y_degrees, camera.size) = (70.0, [96, 72]);
    let kind = LightKind::Point { position: Vec3::new(0.25, 0.3, 0.3), intensity: Vec3::splat(0.5) };
    scene.lights = vec![Light::new("lamp", kind)];
    scene
}

/// A rod's highlight is narrower than a pixel, and stands in one row of pixels. A pixel shows its
/// part of it, whatever stands at the pixel's middle, and however the samples fall.
#[test]
fn highlights_narrower_than_pixels_equal_the_path_tracer() {
    let scene = rods();
    let of_seed = |seed: u32| {
        let mut scene = scene.clone();
        scene.quality.seed = seed;
        let size = scene.cameras[0].size;
        trace(scene, size, 384)
    };
    let tracers = [1, 2].map(of_seed);
    let [a, b] = tracers.each_ref().map(|tracer| tracer.picture().unwrap().direct);
    let albedo = tracers[0].traced_scene().first_hits().unwrap().albedo;
    let direct = render(scene, Quality { edge_samples: 16, ..SKETCH }).layer(Layer::Direct).unwrap();
    let relmse = debiased_relmse(&direct, [&a, &b]);
    let energy = energy_ratio(&direct, &a);
    let of_rods = albedo.iter().filter(|albedo| albedo[0] < 0.5).count();
    println!("relMSE {relmse:.2e}, energy {energy:.4}, {of_rods} pixels show a rod");
    assert!((100..600).contains(&of_rods), "{of_rods} pixels");
    assert!(relmse < 2.5e-3, "relMSE {relmse:.2e}");
    assert!((energy - 1.0).abs() < 0.015, "{energy} of the light");
    assert_silent(&context());
}
