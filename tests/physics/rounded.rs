//! Coarse meshes with smooth normals: their line between light and shadow is as smooth as that of a
//! fine mesh.

use crate::common::{assert_silent, context};
use crate::path_tracer::trace;
use crate::{SMALL, render};
use glam::Vec3;
use lightpaths::reference::Progressive;
use lightpaths::renderer::Layer;
use lightpaths::scene::{LightKind, Quality, Scene, Triangle, shapes};
use std::f32::consts::{PI, TAU};

const SIZE: [u32; 2] = [72, 72];

/// A unit sphere of `meridians` × `parallels` facets with smooth normals in the sun, seen from the
/// side.
fn ball([meridians, parallels]: [u32; 2]) -> Scene {
    let mut scene = shapes::facing_squares(1.0, 0.0, 0.8);
    scene.triangles.clear();
    let corner = |column: u32, row: u32| {
        let (azimuth, polar) = (TAU * column as f32 / meridians as f32, PI * row as f32 / parallels as f32);
        Vec3::new(polar.sin() * azimuth.cos(), polar.cos(), polar.sin() * azimuth.sin())
    };
    for (column, row) in (0..meridians * parallels).map(|place| (place % meridians, place / meridians)) {
        let [a, b] = [corner(column, row), corner(column, row + 1)];
        let [c, d] = [corner(column + 1, row + 1), corner(column + 1, row)];
        let facets = [(row + 1 < parallels, [a, c, b]), (row > 0, [a, d, c])];
        for (_, positions) in facets.into_iter().filter(|(is_whole, _)| *is_whole) {
            scene.triangles.push(Triangle { positions, normals: positions, material: 0, object: 0 });
        }
    }
    let camera = &mut scene.cameras[0];
    (camera.position, camera.target, camera.up) = (Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO, Vec3::Y);
    (camera.fov_y_degrees, camera.size) = (30.0, SIZE);
    scene.lights[0].kind = LightKind::Directional {
        direction: Vec3::new(-1.0, -0.3, -0.4).normalize(),
        irradiance: Vec3::splat(3.0),
    };
    scene
}

/// Largest light that `found` lacks beside `fine`, over the pixels well inside the outline.
fn lost(found: &[[f32; 3]], fine: &[[f32; 3]]) -> f32 {
    // Image radius of the sphere, in half heights of the picture.
    let radius = (1.0_f32 / 5.0).asin().tan() / 15.0_f32.to_radians().tan();
    let place = |index: usize| {
        let [x, y] = [index as u32 % SIZE[0], index as u32 / SIZE[0]];
        [x, y].map(|coordinate| (coordinate as f32 + 0.5) / (0.5 * SIZE[0] as f32) - 1.0)
    };
    let is_inside = |index: usize| {
        let [x, y] = place(index);
        x.hypot(y) < 0.92 * radius
    };
    let lost = |index: usize| fine[index][0] - found[index][0];
    (0..fine.len()).filter(|&index| is_inside(index)).map(lost).fold(0.0, f32::max)
}

/// A fine sphere has at most 0.76 W/m²/sr. On facets without a lift 0.09 is lost; within a pixel of
/// the line between light and shadow the light changes by 0.02.
#[test]
fn shadow_lines_do_not_follow_the_facets() {
    let quality = Quality { entry_points: 0, cache_points: 0, edge_samples: 16, ..SMALL };
    let direct = |scene: Scene| render(scene, quality.clone()).layer(Layer::Direct).unwrap();
    let fine = direct(ball([192, 96]));
    for facets in [[16, 10], [12, 8]] {
        let coarse = ball(facets);
        let traced = trace(coarse.clone(), SIZE, 64).picture().unwrap().direct;
        let [rendered, traced] = [direct(coarse), traced].map(|picture| lost(&picture, &fine));
        println!("{facets:?}: {rendered:.4} lost, {traced:.4} by the path tracer");
        assert!(rendered < 0.03 && traced < 0.03, "{facets:?}: {rendered}, {traced}");
    }
    assert_silent(&context());
}

/// An octahedron with one normal at each corner is no ball: a light behind it shows nowhere.
#[test]
fn steep_normals_lift_nothing() {
    let quality = Quality { entry_points: 0, cache_points: 0, edge_samples: 0, ..SMALL };
    let mut scene = ball([4, 2]);
    let towards = Vec3::new(0.0, 0.3, -1.0).normalize();
    scene.lights[0].kind = LightKind::Directional { direction: -towards, irradiance: Vec3::splat(3.0) };
    let seen = render(scene, quality).layer(Layer::Direct).unwrap();
    assert!(seen.iter().all(|pixel| *pixel == [0.0; 3]));
    assert_silent(&context());
}
