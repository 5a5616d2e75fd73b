//! Faces narrower than a pixel: no pixel's centre shows them, and their indirect light is not that
//! of the faces beside them.

use crate::common::{assert_silent, context};
use crate::path_tracer::trace;
use crate::{SMALL, render};
use glam::Vec3;
use lightpaths::reference::Progressive;
use lightpaths::renderer::Layer;
use lightpaths::scene::{LightKind, Material, OpacityMaps, Quality, Scene, Triangle, shapes};

const SIZE: [u32; 2] = [36, 54];
const LEDGES: u32 = 6;

/// A wall with ledges in the sun. The tops of the ledges are half as high as a pixel and receive
/// much indirect light; their fronts receive none.
fn ledges() -> Scene {
    let mut scene = shapes::facing_squares(1.0, 0.0, 0.8);
    scene.triangles.clear();
    let mut quad = |corner: [f32; 2], end: [f32; 2]| {
        let [[y0, z0], [y1, z1]] = [corner, end];
        let [a, b, c, d] = [[-1.0, y0, z0], [1.0, y0, z0], [1.0, y1, z1], [-1.0, y1, z1]].map(Vec3::from);
        let normal = (b - a).cross(c - a).normalize();
        for positions in [[a, b, c], [a, c, d]] {
            scene.triangles.push(Triangle { positions, normals: [normal; 3], material: 0, object: 0 });
        }
    };
    for number in 0..LEDGES {
        let y = 0.3 * number as f32;
        // Front, top, and the wall up to the next ledge.
        quad([y, 0.06], [y + 0.08, 0.06]);
        quad([y + 0.08, 0.06], [y + 0.08, 0.0]);
        quad([y + 0.08, 0.0], [y + 0.3, 0.0]);
        quad([y, 0.0], [y, 0.06]);
    }
    let camera = &mut scene.cameras[0];
    (camera.position, camera.target, camera.up) =
        (Vec3::new(0.0, 2.2, 5.0), Vec3::new(0.0, 0.9, 0.0), Vec3::Y);
    (camera.fov_y_degrees, camera.size) = (17.0, SIZE);
    let direction = Vec3::new(-0.2, -0.8, -0.6).normalize();
    scene.lights[0].kind = LightKind::Directional { direction, irradiance: Vec3::splat(3.0) };
    scene
}

/// Without edge points, 8 % of the light is missing, and the relative RMS is 0.16. What is left is
/// of the corners beside the ledges.
#[test]
fn faces_narrower_than_a_pixel_have_their_own_indirect_light() {
    let quality = Quality {
        entry_points: 200_000,
        cache_points: 10_000,
        gather_rays: 512,
        cells: 128,
        edge_samples: 16,
        ..SMALL
    };
    let scene = ledges();
    let traced = trace(scene.clone(), SIZE, 2048).picture().unwrap().indirect;
    let found = render(scene, quality).layer(Layer::Indirect).unwrap();
    let sum = |picture: &[[f32; 3]]| picture.iter().map(|colour| f64::from(colour[0])).sum::<f64>();
    let ratio = sum(&found) / sum(&traced);
    let squares = found.iter().zip(&traced).map(|(a, b)| f64::from(a[0] - b[0]).powi(2)).sum::<f64>();
    let error = (squares / traced.iter().map(|b| f64::from(b[0]).powi(2)).sum::<f64>()).sqrt();
    println!("energy {ratio:.4}, relative RMS {error:.4}");
    assert!((ratio - 1.0).abs() < 0.03 && error < 0.1, "energy {ratio}, RMS {error}");
    assert_silent(&context());
}

/// Albedos of a wall that fills the picture, and of a stripe on it or before it that is a third as
/// wide as a pixel and crosses a column of pixels in sixteen rows.
const ALBEDOS: [f32; 2] = [0.2, 0.8];
const ROWS: u8 = 32;
/// Of a pixel, metres.
const PIXEL: f32 = 2.0 / ROWS as f32;
/// Of the stripe, in pixels.
const WIDTH: f32 = 0.3;

/// Middle of the stripe's left side at a height.
fn left_of_stripe(y: f32) -> f32 {
    PIXEL * (0.4 + y / 1.5)
}

/// Triangles between two vertical lines, each by its lower and upper end.
fn strip([[a, d], [b, c]]: [[Vec3; 2]; 2], material: u32) -> [Triangle; 2] {
    let triangle = |positions| Triangle { positions, normals: [Vec3::Z; 3], material, object: 0 };
    [triangle([a, b, c]), triangle([a, c, d])]
}

/// The picture of a wall at z = 0, lit from the camera.
fn wall(triangles: Vec<Triangle>) -> Scene {
    let mut scene = shapes::facing_squares(1.0, 0.0, ALBEDOS[0]);
    scene.triangles = triangles;
    scene.materials.push(Material { diffuse: Vec3::splat(ALBEDOS[1]), ..scene.materials[0].clone() });
    let camera = &mut scene.cameras[0];
    let height = 1.0 / (10.0_f32.to_radians()).tan();
    (camera.position, camera.target, camera.up) = (Vec3::new(0.0, 0.0, height), Vec3::ZERO, Vec3::Y);
    (camera.fov_y_degrees, camera.size) = (20.0, [ROWS.into(); 2]);
    scene.lights[0].kind = LightKind::Directional { direction: -Vec3::Z, irradiance: Vec3::splat(3.0) };
    scene
}

/// The stripe is a part of the wall.
fn striped() -> Scene {
    let line = |offset: f32| [-1.5, 1.5].map(|y| Vec3::new(left_of_stripe(y) + offset, y, 0.0));
    let lines = [-3.0, 0.0, WIDTH * PIXEL, 3.0].map(line);
    let strips = lines.windows(2).zip([0, 1, 0]);
    wall(strips.flat_map(|(ends, material)| strip([ends[0], ends[1]], material)).collect())
}

/// The stripe is what holes leave of a card close to the wall.
fn striped_by_holes() -> Scene {
    let line = |x: f32, z: f32| [-1.5, 1.5].map(|y| Vec3::new(x, y, z));
    let whole = strip([line(-3.0, 0.0), line(3.0, 0.0)], 0);
    let card = strip([line(-0.2, 1e-3), line(0.2, 1e-3)], 1);
    let mut scene = wall([whole, card].concat());
    let levels = [0, 0, 8, 8];
    scene.opacity = OpacityMaps::new(&levels, |triangle, centre| {
        let [a, b, c] = scene.triangles[triangle].positions.map(Vec3::as_dvec3);
        let place = (centre.x * a + centre.y * b + centre.z * c).as_vec3();
        !(0.0..WIDTH * PIXEL).contains(&(place.x - left_of_stripe(place.y)))
    });
    scene
}

/// Every row of pixels shows the same part of the stripe. Where no middle of a pixel meets it, a
/// row showed none.
#[test]
fn a_stripe_between_the_middles_of_pixels_is_seen_in_every_row() {
    let [dark, light] = ALBEDOS.map(|albedo| f64::from(albedo) * 3.0 / std::f64::consts::PI);
    // Holes are looked for at up to eight points along each side of a pixel.
    for (what, scene, tolerance) in
        [("of the wall", striped(), 0.05), ("of a card", striped_by_holes(), 0.15)]
    {
        let found = render(scene, Quality { edge_samples: 16, ..SMALL }).layer(Layer::Direct).unwrap();
        for (row, pixels) in found.chunks_exact(ROWS.into()).enumerate() {
            let sum: f64 = pixels.iter().map(|colour| f64::from(colour[0])).sum();
            let covered = (sum - dark * f64::from(ROWS)) / (light - dark);
            let off = (covered - f64::from(WIDTH)).abs();
            assert!(off < tolerance, "{what}, row {row}: {covered} of a pixel");
        }
    }
    assert_silent(&context());
}
