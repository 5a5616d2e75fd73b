//! A movable crate moves in a room. Random decisions are named by place, so the picture changes
//! where the crate's light does, and the noise elsewhere stays.

use std::collections::HashSet;

use crate::common::{assert_silent, context};
use glam::Vec3;
use lightpaths::renderer::{Layer, Renderer, Silent};
use lightpaths::scene::{LightKind, Material, Quality, Scene, Triangle, shapes};
use lightpaths::types::CachePoint;

/// Half the edge of the crate, metres.
const HALF: f32 = 0.2;
/// Cache points further from the crate than this are far from it, metres.
const FAR: f32 = 2.0;

/// The crate's triangles.
fn crate_at(middle: Vec3) -> impl Iterator<Item = Triangle> {
    [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z].into_iter().flat_map(move |normal| {
        let u = normal.any_orthogonal_vector();
        let v = normal.cross(u);
        let corner = |a: f32, b: f32| middle + HALF * (normal + a * u + b * v);
        let [p, q, r, s] = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
        [[p, q, r], [p, r, s]].map(|positions| Triangle {
            positions,
            normals: [normal; 3],
            material: 1,
            object: 0,
        })
    })
}

/// A room of 6×2.5×4 m with the crate on its floor.
fn room(middle: Vec3, seed: u32) -> Scene {
    let mut scene = shapes::closed_box(Vec3::new(6.0, 2.5, 4.0), 0.6);
    let wood = Material { diffuse: Vec3::new(0.5, 0.3, 0.1), ..scene.materials[0].clone() };
    scene.materials.push(wood);
    scene.triangles.extend(crate_at(middle));
    let position = Vec3::new(0.4, 0.5, 0.3);
    scene.lights[0].kind = LightKind::Point { position, intensity: Vec3::ONE };
    scene.cameras[0].size = [48, 48];
    scene.model_is_movable = vec![true];
    scene.quality = Quality { seed, ..Quality::DRAFT };
    scene
}

/// Indirect light, and the cache points.
fn render(middle: Vec3, seed: u32) -> (Vec<f64>, Vec<CachePoint>) {
    let mut renderer = Renderer::new(&context(), room(middle, seed), &mut Silent).unwrap();
    renderer.frame().unwrap();
    let layer = renderer.layer(Layer::Indirect).unwrap();
    let light = layer.iter().map(|pixel| f64::from(pixel[0] + pixel[1] + pixel[2])).collect();
    (light, renderer.cache_points().unwrap())
}

/// Mean of the squared difference over the squared mean.
fn change(a: &[f64], b: &[f64]) -> f64 {
    let mean = a.iter().sum::<f64>() / a.len() as f64;
    a.iter().zip(b).map(|(a, b)| ((a - b) / mean).powi(2)).sum::<f64>() / a.len() as f64
}

#[test]
fn noise_stays_where_nothing_moves() {
    let middle = Vec3::new(-2.2, -1.05, -1.1);
    let (still, before) = render(middle, 1);
    let (moved, after) = render(middle + 0.01 * Vec3::X, 1);
    let (other, _) = render(middle, 2);
    // A cache point's place, and the random stream of its gather rays.
    let name = |point: &CachePoint| {
        let [x, y, z] = point.position.to_array().map(f32::to_bits);
        [x, y, z, point.stream]
    };
    let far = |point: &&CachePoint| point.position.distance(middle) > FAR;
    let names: HashSet<_> = after.iter().map(name).collect();
    let all = before.iter().filter(far).count();
    let kept = before.iter().filter(far).filter(|point| names.contains(&name(point))).count();
    let [by_move, by_seed] = [&moved, &other].map(|picture| change(&still, picture));
    println!("{kept} of {all} points are kept; change {by_move:.2e}, by a seed {by_seed:.2e}");
    assert!(all > 1000 && kept == all, "{kept} of {all} far points are kept");
    assert!(by_move > 0.0 && by_move * 10.0 < by_seed, "{by_move:.2e}, by a seed {by_seed:.2e}");
    assert_silent(&context());
}
