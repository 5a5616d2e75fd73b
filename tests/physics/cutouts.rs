//! Cut-outs are holes for all methods: a card with a chequerboard of holes against the same card
//! made of squares.

use crate::common::{assert_silent, context};
use crate::path_tracer::trace;
use crate::{assert_close, render};
use glam::{DVec3, Vec3};
use lightpaths::reference::{PhotonMapper, Progressive};
use lightpaths::renderer::{Layer, Renderer, Silent};
use lightpaths::scene::{Light, LightKind, OpacityMaps, Quality, Scene, Triangle, shapes};

const SIZE: [u32; 2] = [64, 48];
/// Squares along each side of the card.
const SQUARES: u32 = 8;
/// Corner and edges of the card.
const CORNER: Vec3 = Vec3::new(-0.7, 0.1, -0.6);
const EDGE: f32 = 1.3;

fn square(corner: Vec3, edge: f32) -> [Triangle; 2] {
    let [p0, p1, p2, p3] = [Vec3::ZERO, Vec3::Z, Vec3::X + Vec3::Z, Vec3::X].map(|p| corner + edge * p);
    let triangle = |positions| Triangle { positions, normals: [Vec3::Y; 3], material: 1, object: 0 };
    [triangle([p0, p1, p2]), triangle([p0, p2, p3])]
}

/// A box without a lid, whose card hangs under a lamp and the sun.
fn open_box(card: impl IntoIterator<Item = Triangle>) -> Scene {
    let mut scene = shapes::closed_box(Vec3::new(2.0, 1.6, 1.8), 0.6);
    scene.triangles.retain(|triangle| triangle.geometric_normal().y > -0.5);
    let mut material = scene.materials[0].clone();
    material.diffuse = Vec3::new(0.7, 0.4, 0.2);
    scene.materials.push(material);
    scene.triangles.extend(card);
    let light = |name: &str, kind| Light::new(name, kind);
    scene.lights = vec![
        light("lamp", LightKind::Point { position: Vec3::new(0.3, 0.65, 0.2), intensity: Vec3::splat(0.8) }),
        light(
            "sun",
            LightKind::Directional {
                direction: Vec3::new(0.3, -1.0, -0.2).normalize(),
                irradiance: Vec3::splat(2.0),
            },
        ),
    ];
    scene.cameras[0].position = Vec3::new(0.75, 0.72, 0.85);
    scene.cameras[0].target = Vec3::new(-0.2, -0.3, -0.2);
    scene.cameras[0].fov_y_degrees = 75.0;
    scene
}

/// The card as squares, half of them left out.
fn of_squares() -> Scene {
    let step = EDGE / SQUARES as f32;
    let is_there = |index: &u32| (index / SQUARES + index % SQUARES).is_multiple_of(2);
    let place =
        |index: u32| CORNER + step * Vec3::new((index % SQUARES) as f32, 0.0, (index / SQUARES) as f32);
    open_box((0..SQUARES * SQUARES).filter(is_there).flat_map(|index| square(place(index), step)))
}

/// The card as two triangles with holes.
fn with_holes() -> Scene {
    let mut scene = open_box(square(CORNER, EDGE));
    let levels: Vec<u32> =
        scene.triangles.iter().map(|triangle| SQUARES.ilog2() * triangle.material).collect();
    let triangles = scene.triangles.clone();
    scene.opacity = OpacityMaps::new(&levels, |triangle, centre| {
        let [p0, p1, p2] = triangles[triangle].positions.map(Vec3::as_dvec3);
        let place = centre.x * p0 + centre.y * p1 + centre.z * p2 - CORNER.as_dvec3();
        let square = (place * f64::from(SQUARES) / f64::from(EDGE)).as_uvec3();
        !(square.x + square.z).is_multiple_of(2)
    });
    scene
}

/// A closed box with holes in its lid, under the sun. Its camera is inside.
fn with_holes_in_the_lid() -> Scene {
    let mut scene = shapes::closed_box(Vec3::new(2.0, 1.6, 1.8), 0.6);
    let level = |triangle: &Triangle| 3 * u32::from(triangle.geometric_normal().y < -0.5);
    let levels: Vec<u32> = scene.triangles.iter().map(level).collect();
    scene.opacity = OpacityMaps::new(&levels, |_, centre| (8.0 * centre.y).floor() % 3.0 == 1.0);
    scene.lights[0].kind = LightKind::Directional {
        direction: Vec3::new(0.3, -1.0, -0.2).normalize(),
        irradiance: Vec3::splat(2.0),
    };
    scene
}

fn sum(layer: &[[f32; 3]]) -> DVec3 {
    layer.iter().map(|pixel| DVec3::from(pixel.map(f64::from))).sum()
}

/// Compares the energy of both layers with the reference's.
#[track_caller]
fn check(what: &str, found: [&[[f32; 3]]; 2], expected: [&[[f32; 3]]; 2], tolerance: f64) {
    for (layer, (found, expected)) in ["direct", "indirect"].iter().zip(found.into_iter().zip(expected)) {
        let ratio = sum(found) / sum(expected);
        println!("{what}, {layer}: {:+.3} %", 100.0 * (ratio - 1.0));
        for channel in 0..3 {
            assert_close(&format!("{what}, {layer}"), ratio[channel], 1.0, tolerance);
        }
    }
}

fn layers(renderer: &Renderer) -> [Vec<[f32; 3]>; 2] {
    [Layer::Direct, Layer::Indirect].map(|layer| renderer.layer(layer).unwrap())
}

/// No closed surface with holes is an enclosure or a solid.
#[test]
fn the_sun_lights_a_closed_box_through_holes() {
    let scene = with_holes_in_the_lid();
    let expected = trace(scene.clone(), SIZE, 256).picture().unwrap();
    let mut small = scene;
    small.cameras[0].size = SIZE;
    let quality = Quality { preset: "test", entry_points: 200_000, cache_points: 3_000, ..Quality::DRAFT };
    let renderer = render(small, quality);
    let [direct, indirect] = layers(&renderer);
    check("light paths", [&direct, &indirect], [&expected.direct, &expected.indirect], 0.005);
    assert_silent(&context());
}

#[test]
fn light_passes_holes_as_it_passes_gaps_between_squares() {
    let [cut, squares] = [with_holes(), of_squares()];
    assert!((cut.area_m2() / squares.area_m2() - 1.0).abs() < 1e-5);
    let pictures = [&cut, &squares].map(|scene| trace(scene.clone(), SIZE, 512).picture().unwrap());
    let [of_cut, of_squares] = [&pictures[0], &pictures[1]].map(|p| [&*p.direct, &*p.indirect]);
    check("path tracer", of_cut, of_squares, 0.005);

    let mut small = cut;
    small.cameras[0].size = SIZE;
    let mut mapper = PhotonMapper::new(&context(), small.clone(), &mut Silent).unwrap();
    mapper.add_samples(64).unwrap();
    let picture = mapper.picture().unwrap();
    check("photon mapper", [&picture.direct, &picture.indirect], of_cut, 0.01);

    let quality = Quality {
        preset: "test",
        entry_points: 400_000,
        cache_points: 6_000,
        gather_rays: 256,
        cells: 32,
        ..Quality::DRAFT
    };
    let renderer = render(small, quality);
    let [direct, indirect] = layers(&renderer);
    check("light paths", [&direct, &indirect], of_cut, 0.005);
    check("light paths and squares", [&direct, &indirect], of_squares, 0.005);
    assert_silent(&context());
}
