//! Light meters: against closed forms and against path tracing; pictures do not depend on them.

use crate::common::edits::{TINY, scene as small_box};
use crate::common::{assert_silent, context};
use crate::{SMALL, assert_close, render};
use glam::Vec3;
use lightpaths::cpu::direct::polygon_irradiance;
use lightpaths::renderer::{Layer, Measured, Renderer, Silent, Store};
use lightpaths::scene::meter::{Meter, MeterShape};
use lightpaths::scene::photometry::{LUMENS_A_WATT, lux};
use lightpaths::scene::{Light, LightKind, Quality, Scene, Triangle, shapes};

fn at(position: Vec3, normal: Vec3) -> Meter {
    Meter { name: "meter".to_owned(), shape: MeterShape::Point { position, normal } }
}

/// A black room of 2 m with this light.
fn dark_room(kind: LightKind, meters: Vec<Meter>) -> Scene {
    let mut scene = shapes::hidden_light(0.01, 0.9, 0.0);
    // Without the screen: the last two triangles.
    scene.triangles.truncate(12);
    scene.lights = vec![Light::new("lamp", kind)];
    scene.meters = meters;
    scene
}

fn measured(scene: Scene) -> Vec<Measured> {
    let measured = render(scene, SMALL).measured().unwrap();
    assert_silent(&context());
    measured
}

/// By the definition of the units: 1 cd gives 1 lx at 1 m.
#[test]
fn a_candela_at_a_metre_is_a_lux() {
    let one = Vec3::splat((1.0 / LUMENS_A_WATT) as f32);
    let position = Vec3::new(0.0, 0.5, 0.0);
    let kind = LightKind::Point { position, intensity: one };
    let tilted = Vec3::new(0.0, 0.5, 0.75_f32.sqrt());
    let meters = vec![
        at(position - Vec3::Y, Vec3::Y),
        at(position - Vec3::Y, tilted),
        at(position - Vec3::Y, -Vec3::Y),
        at(position - 0.5 * Vec3::Y, Vec3::Y),
    ];
    let found = measured(dark_room(kind, meters));
    for (number, (point, expected)) in found.iter().zip([1.0, 0.5, 0.0, 4.0]).enumerate() {
        let lux = lux(point.irradiance());
        assert!((lux - expected).abs() <= 1e-5 * expected, "{number}: {lux} lx");
        assert!(!point.is_in_solid && point.indirect == Vec3::ZERO);
    }
}

/// Lambert's closed form of a parallelogram.
#[test]
fn an_area_light_has_its_closed_form() {
    let (corner, edge_u, edge_v) =
        (Vec3::new(-0.4, 0.9, 0.3), Vec3::new(0.7, 0.0, 0.1), Vec3::new(0.0, 0.0, -0.6));
    let kind =
        LightKind::Area { corner, edge_u: edge_v, edge_v: edge_u, radiance: Vec3::splat(2.0), samples: 10 };
    let places = [Vec3::new(0.1, -0.8, 0.2), Vec3::new(0.5, 0.3, -0.5), Vec3::new(-0.8, 0.0, 0.8)];
    let normal = Vec3::new(0.1, 1.0, 0.2).normalize();
    let found = measured(dark_room(kind, places.map(|place| at(place, normal)).to_vec()));
    for (place, point) in places.iter().zip(found) {
        let corners = [corner, corner + edge_u, corner + edge_u + edge_v, corner + edge_v];
        let corners = corners.map(|corner| (corner - *place).as_dvec3());
        let expected = 2.0 * polygon_irradiance(normal.as_dvec3(), &corners);
        assert_close(&format!("{place}"), point.direct.x.into(), expected, 2e-3);
    }
}

/// A lamp of 1000 lm in the middle of an integrating sphere: its light at a distance, and what the
/// sphere adds.
#[test]
fn a_lamp_in_lumens_lights_a_sphere_as_it_should() {
    const LUMENS: f64 = 1000.0;
    let mut scene = shapes::integrating_sphere(1.5, 4, 0.5, Vec3::ZERO, 1.0);
    scene.lights[0].set_power(LUMENS);
    scene.lights[0].kind = scene.lights[0].kind.with_kelvin(2700.0);
    let distances = [0.2_f32, 0.7, 1.3];
    scene.meters = distances.iter().map(|&distance| at(distance * Vec3::Y, -Vec3::Y)).collect();
    let around = LUMENS / scene.area_m2();
    let renderer = render(scene, Quality { cache_points: 400, ..Quality::PAPER });
    for (distance, point) in distances.iter().zip(renderer.measured().unwrap()) {
        let direct = LUMENS / (4.0 * std::f64::consts::PI * f64::from(*distance).powi(2));
        assert_close(&format!("direct, {distance} m"), lux(point.direct), direct, 1e-4);
        assert_close(&format!("all, {distance} m"), lux(point.irradiance()), direct + around, 0.01);
    }
    assert_silent(&context());
}

/// In an integrating sphere indirect irradiance is Φ/A·ρ/(1−ρ) everywhere, also in mid-air and for
/// every orientation; direct irradiance is that of the lamp.
#[test]
fn in_an_integrating_sphere_every_meter_reads_the_same() {
    const FLUX_W: f32 = 10.0;
    let mut scene = shapes::integrating_sphere(1.5, 4, 0.5, Vec3::ZERO, FLUX_W);
    let places = [Vec3::new(0.7, 0.2, 0.1), Vec3::new(0.0, -1.2, 0.3), Vec3::new(-0.3, 0.4, -0.9)];
    let normals = [Vec3::Y, Vec3::X, Vec3::new(0.6, 0.0, -0.8)];
    scene.meters = places.iter().flat_map(|place| normals.map(|normal| at(*place, normal))).collect();
    let expected = f64::from(FLUX_W) / scene.area_m2();
    let renderer = render(scene, Quality { cache_points: 400, ..Quality::PAPER });
    let found = renderer.measured().unwrap();
    let mean = found.iter().map(|point| f64::from(point.indirect.y)).sum::<f64>() / found.len() as f64;
    assert_close("mean", mean, expected, 3e-3);
    for (number, point) in found.iter().enumerate() {
        assert_close(&format!("meter {number}"), point.indirect.y.into(), expected, 0.02);
    }
    assert_silent(&context());
}

fn with_meters(may_be_glossy: bool) -> Scene {
    let mut scene = small_box(may_be_glossy);
    let plane = MeterShape::Plane {
        corner: Vec3::new(-0.6, 0.1, 0.6),
        edge_u: 1.2 * Vec3::X,
        edge_v: -1.2 * Vec3::Z,
        grid: [4, 3],
    };
    scene.meters =
        vec![Meter { name: "plane".to_owned(), shape: plane }, at(Vec3::new(0.0, 0.0, 0.8), -Vec3::Z)];
    scene
}

/// Also where a surface has a lobe, which the gather rays of meters read as others do.
#[test]
fn meters_agree_with_path_tracing() {
    for is_glossy in [false, true] {
        let mut scene = with_meters(true);
        let teapot = scene.materials.iter_mut().find(|material| material.editable).unwrap();
        if is_glossy {
            (teapot.diffuse, teapot.specular, teapot.exponent) = (Vec3::splat(0.1), Vec3::splat(0.8), 12.0);
        }
        let quality = Quality { entry_points: 100_000, cache_points: 400, ..Quality::PAPER };
        let renderer = render(scene, quality);
        let (found, exact) = (renderer.measured().unwrap(), renderer.measured_by_paths(1 << 16).unwrap());
        assert_eq!(found.len(), 13);
        let mean = |points: &[Measured]| points.iter().map(|point| lux(point.indirect)).sum::<f64>();
        assert_close("mean", mean(&found), mean(&exact), 0.005);
        for (number, (found, exact)) in found.iter().zip(&exact).enumerate() {
            assert_eq!(found.direct, exact.direct);
            assert_close(&format!("{number}"), lux(found.indirect), lux(exact.indirect), 0.015);
        }
    }
    assert_silent(&context());
}

/// A solid is a closed surface without a camera.
#[test]
fn a_meter_in_a_solid_says_so() {
    let mut scene = with_meters(false);
    let room = shapes::hidden_light(0.01, 0.9, 0.5).triangles;
    let centre = Vec3::new(0.0, 0.5, 0.6);
    // The room's walls as a cube of 0.2 m, from outside.
    let cube = room[..12].iter().map(|wall| {
        let [p0, p1, p2] = wall.positions.map(|corner| centre + 0.1 * corner);
        Triangle {
            positions: [p0, p2, p1],
            normals: wall.normals.map(|normal| -normal),
            material: 0,
            object: 0,
        }
    });
    scene.triangles.extend(cube);
    scene.meters.push(at(centre, Vec3::Y));
    let found = render(scene, TINY).measured().unwrap();
    let in_solids: Vec<usize> = (0..found.len()).filter(|&point| found[point].is_in_solid).collect();
    assert_eq!(in_solids, [13]);
    assert_eq!(found[13].irradiance(), Vec3::ZERO);
    assert!(found[..13].iter().all(|point| point.irradiance() != Vec3::ZERO));
    assert_silent(&context());
}

#[test]
fn pictures_do_not_depend_on_meters() {
    let bits = |scene: Scene| {
        let pixels = render(scene, TINY).layer(Layer::Beauty).unwrap();
        pixels.iter().flatten().map(|value| value.to_bits()).collect::<Vec<_>>()
    };
    assert!(bits(with_meters(false)) == bits(small_box(false)));
    assert_silent(&context());
}

/// Stored light paths hold those of meters, and measured values follow edits as pictures do.
#[test]
fn stored_meters_read_the_same_and_follow_edits() {
    let folder = tempfile::tempdir().unwrap();
    let store = Store::File(folder.path().join("paths"));
    let scene = Scene { quality: TINY, ..with_meters(true) };
    let moved = Vec3::new(0.3, 0.4, 0.2);
    let read = |store: &Store, scene: Scene| {
        let mut renderer = Renderer::cached(&context(), scene, store, &mut Silent, &mut |_| ()).unwrap();
        renderer.frame().unwrap();
        let before = renderer.measured().unwrap();
        renderer.move_light(0, moved).unwrap();
        renderer.frame().unwrap();
        [before, renderer.measured().unwrap()]
    };
    let Store::File(file) = &store else { panic!("a file") };
    Renderer::store(&context(), scene.clone(), file, &mut Silent).unwrap();
    let stored = read(&store, scene.clone());
    let mut fresh = Renderer::new(&context(), scene.clone(), &mut Silent).unwrap();
    fresh.frame().unwrap();
    assert!(stored[0] == fresh.measured().unwrap());
    let mut start = scene;
    start.lights[0].kind = start.lights[0].kind.moved_to(moved);
    let mut cold = Renderer::new(&context(), start, &mut Silent).unwrap();
    cold.frame().unwrap();
    assert!(stored[1] == cold.measured().unwrap());
    assert!(stored[0] != stored[1]);
    assert_silent(&context());
}
