//! A floor and a wall upright on its edge: perpendicular squares, one bounce from wall to floor.

use crate::common::{assert_silent, context};
use crate::{assert_close, direct, render};
use glam::{DVec3, Vec3};
use lightpaths::renderer::Layer;
use lightpaths::scene::{LightKind, Material, Quality, Scene, Triangle, shapes};
use std::f64::consts::PI;

/// Albedos: the floor is so dark that its light on the wall does not count, 0.01·0.8·0.2 of
/// its own light.
const FLOOR: f64 = 0.01;
const WALL: f64 = 0.8;
const LIGHT: DVec3 = DVec3::new(0.1, 0.6, 0.3);

/// The camera sees the floor at y = 0 from above; the wall stands on its edge at z = -1/2.
pub(crate) fn scene() -> Scene {
    let mut scene = shapes::facing_squares(1.0, 0.0, FLOOR as f32);
    scene.triangles.truncate(2);
    // The green channel keeps the paths alive.
    scene.materials[0].diffuse = Vec3::new(FLOOR as f32, 0.9, 0.0);
    scene.materials.push(Material { diffuse: Vec3::splat(WALL as f32), ..scene.materials[0].clone() });
    let corners = [(-0.5, 0.0), (0.5, 0.0), (0.5, 1.0), (-0.5, 1.0)].map(|(x, y)| Vec3::new(x, y, -0.5));
    for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
        let positions = [corners[a], corners[b], corners[c]];
        scene.triangles.push(Triangle { positions, normals: [Vec3::Z; 3], material: 1, object: 0 });
    }
    let camera = &mut scene.cameras[0];
    (camera.position, camera.up, camera.fov_y_degrees) = (Vec3::Y, Vec3::NEG_Z, 35.0);
    camera.size = [32, 32];
    scene.lights[0].kind = LightKind::Point { position: LIGHT.as_vec3(), intensity: Vec3::ONE };
    scene
}

/// Red radiance of a point of the floor by light of the wall, W/m²/sr.
fn radiance(at: DVec3) -> f64 {
    const STEPS: u32 = 100;
    let mut irradiance = 0.0;
    for i in 0..STEPS * STEPS {
        let along = |i: u32| (f64::from(i) + 0.5) / f64::from(STEPS);
        let patch = DVec3::new(along(i % STEPS) - 0.5, along(i / STEPS), -0.5);
        let to_light = LIGHT - patch;
        let radiosity = WALL * to_light.z / to_light.length().powi(3);
        let to_patch = patch - at;
        irradiance += radiosity * to_patch.y * -to_patch.z / (PI * to_patch.length_squared().powi(2));
    }
    FLOOR / PI * irradiance / f64::from(STEPS * STEPS)
}

/// Ratio of a picture's indirect light to the integral over the wall, over all pixels.
pub(crate) fn ratio(positions: &[Option<DVec3>], indirect: &[[f32; 3]]) -> f64 {
    let (mut value, mut expected) = (0.0, 0.0);
    for (position, pixel) in positions.iter().zip(indirect) {
        value += f64::from(pixel[0]);
        expected += radiance(position.expect("the floor fills the image"));
    }
    println!("{:+.3} %", 100.0 * (value / expected - 1.0));
    value / expected
}

#[test]
fn a_wall_lights_the_floor_beside_it() {
    let quality = Quality {
        preset: "test",
        entry_points: 100_000,
        cache_points: 1_000,
        gather_rays: 576,
        edge_samples: 0,
        ..Quality::DRAFT
    };
    let renderer = render(scene(), quality);
    let indirect = renderer.layer(Layer::Indirect).unwrap();
    assert_close("mean indirect light", ratio(&direct::positions(&renderer), &indirect), 1.0, 0.01);
    assert_silent(&context());
}
