//! Direct light: inverse square law and Lambert's cosine, and no singularity where a light
//! touches a surface.

use crate::common::{assert_silent, context};
use crate::{SMALL, assert_close, render};
use glam::{DVec3, Vec3};
use lightpaths::renderer::{Layer, Renderer};
use lightpaths::scene::{LightKind, Scene, shapes};
use lightpaths::types::{Contribution, Record};
use std::f64::consts::PI;

/// Direct irradiance of each pixel, first channel, W/m².
fn irradiance(renderer: &Renderer) -> Vec<f64> {
    let albedo = renderer.scene().materials[0].diffuse.as_dvec3();
    let radiance = renderer.layer(Layer::Direct).unwrap();
    radiance.iter().map(|pixel| f64::from(pixel[0]) * PI / albedo.x).collect()
}

/// Hit of each pixel's ray, from its depth. `None` if the ray left the scene.
pub(crate) fn positions(renderer: &Renderer) -> Vec<Option<DVec3>> {
    let camera = &renderer.scene().cameras[0];
    let [right, up, forward] = camera.frame().map(Vec3::as_dvec3);
    let [width, height] = camera.size.map(f64::from);
    let tan = (0.5 * f64::from(camera.fov_y_degrees)).to_radians().tan();
    let depths = renderer.layer(Layer::Depth).unwrap();
    let position = |(index, depth): (usize, &[f32; 3])| {
        let (column, row) = (index as u32 % camera.size[0], index as u32 / camera.size[0]);
        let x = (2.0 * (f64::from(column) + 0.5) / width - 1.0) * tan * width / height;
        let y = (1.0 - 2.0 * (f64::from(row) + 0.5) / height) * tan;
        let depth = f64::from(depth[0]);
        depth.is_finite().then(|| camera.position.as_dvec3() + depth * (forward + x * right + y * up))
    };
    depths.iter().enumerate().map(position).collect()
}

/// A unit square seen from above, without other surface, under a light of 1 W/sr.
fn square() -> Scene {
    let mut scene = shapes::facing_squares(1.0, 0.0, 0.5);
    scene.triangles.truncate(2);
    let camera = &mut scene.cameras[0];
    (camera.position, camera.up, camera.size) = (Vec3::Y, Vec3::NEG_Z, [256, 192]);
    scene.lights[0].kind = LightKind::Point { position: Vec3::Y, intensity: Vec3::ONE };
    scene
}

#[test]
fn inverse_square_law_and_lambert_cosine() {
    let mut renderer = render(square(), SMALL);
    let positions = positions(&renderer);
    for light in [[0.0, 1.0, 0.0], [0.0, 2.0, 0.0], [0.3, 0.25, -0.1], [-3.0, 1.0, 4.0], [0.5, 0.2, 0.5]] {
        let light = Vec3::from(light);
        renderer.move_light(0, light).unwrap();
        renderer.frame().unwrap();
        let mut lit = 0;
        for (position, value) in positions.iter().zip(irradiance(&renderer)) {
            let Some(position) = position else { continue };
            let to_light = light.as_dvec3() - *position;
            let expected = to_light.y / to_light.length().powi(3);
            assert_close(&format!("light at {light}, {position}"), value, expected, 1e-3);
            lit += 1;
        }
        assert!(lit > 20_000, "the square fills the image");
    }
    renderer.move_light(0, Vec3::NEG_Y).unwrap();
    renderer.frame().unwrap();
    assert!(irradiance(&renderer).iter().all(|value| *value == 0.0), "no light from behind");
    assert_silent(&context());
}

#[test]
fn lights_on_surfaces_are_bounded_and_leave_the_far_field_alone() {
    let mut renderer = render(shapes::closed_box(Vec3::ONE, 0.5), SMALL);
    let mut black = render(shapes::closed_box(Vec3::ONE, 0.0), SMALL);
    let positions = positions(&renderer);
    let floor = Vec3::new(0.1, -0.5, -0.1);
    let corner = Vec3::new(-0.5, -0.5, -0.5);
    for light in [floor, floor + 1e-6 * Vec3::Y, floor + 1e-3 * Vec3::Y, corner, corner + Vec3::splat(1e-6)] {
        renderer.move_light(0, light).unwrap();
        renderer.frame().unwrap();
        let direct = irradiance(&renderer);
        assert!(direct.iter().all(|value| value.is_finite() && *value >= 0.0), "light at {light}");
        // In a black room, the flux that enters the paths equals the sum of all contributions;
        // clusters near edges hold some of it twice.
        black.move_light(0, light).unwrap();
        black.frame().unwrap();
        let flux = black.path_flux().unwrap();
        let contributions: Vec<Contribution> = black.stages().contributions.read().unwrap();
        let entering: f64 = contributions
            .iter()
            .map(|d| f64::from(d.throughput.x) * f64::from(flux[d.path() as usize].x))
            .sum();
        assert!(
            entering > 0.0 && entering <= 4.0 * PI * 1.01,
            "light at {light}: {entering} W of 4π W enter"
        );
        let records: Vec<Record> = renderer.stages().records.read().unwrap();
        assert!(records.iter().all(|record| record.irradiance.is_finite()), "light at {light}");
        // The back wall, away from the corner.
        for (position, value) in positions.iter().zip(direct) {
            let position = position.unwrap();
            let to_light = light.as_dvec3() - position;
            if position.z < -0.4999 && to_light.length() > 0.7 && light.z > -0.4 {
                let expected = to_light.z / to_light.length().powi(3);
                assert_close(&format!("light at {light}, {position}"), value, expected, 3e-3);
            }
        }
    }
    assert_silent(&context());
}

#[test]
fn light_shut_into_a_solid_lights_nothing() {
    let mut scene = shapes::closed_box(Vec3::ONE, 0.5);
    let solid: Vec<_> = scene
        .triangles
        .iter()
        .map(|triangle| {
            let [a, b, c] = triangle.positions.map(|p| 0.3 * p - Vec3::new(0.0, 0.2, 0.2));
            let mut outward = *triangle;
            (outward.positions, outward.normals) = ([a, c, b], triangle.normals.map(|n| -n));
            outward
        })
        .collect();
    scene.triangles.extend(solid);
    let mut renderer = render(scene, SMALL);
    assert!(irradiance(&renderer).iter().any(|value| *value > 0.0));
    renderer.move_light(0, Vec3::new(0.01, -0.22, -0.17)).unwrap();
    renderer.frame().unwrap();
    assert!(irradiance(&renderer).iter().all(|value| *value == 0.0), "direct");
    assert!(renderer.layer(Layer::Indirect).unwrap().iter().all(|pixel| *pixel == [0.0; 3]), "indirect");
    assert_silent(&context());
}
