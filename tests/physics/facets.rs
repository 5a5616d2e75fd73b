//! Surfaces of many flat facets, as in meshes without normals: their direct light equals the path
//! tracer's, also where facets meet.

use crate::common::{assert_silent, context};
use crate::path_tracer::trace;
use crate::{SMALL, render};
use glam::Vec3;
use lightpaths::metrics::energy_ratio;
use lightpaths::reference::Progressive;
use lightpaths::renderer::Layer;
use lightpaths::scene::{LightKind, Quality, Scene, Triangle, shapes};

const SIDE: u32 = 40;

/// A square of 2·[`SIDE`]² facets seen from above, with height `height` over -1..1.
fn relief(height: impl Fn(f32, f32) -> f32) -> Scene {
    let mut scene = shapes::facing_squares(1.0, 0.0, 0.5);
    scene.triangles.clear();
    let corner = |column: u32, row: u32| {
        let [x, z] = [column, row].map(|place| 2.0 * place as f32 / SIDE as f32 - 1.0);
        Vec3::new(x, height(x, z), z)
    };
    for (column, row) in (0..SIDE * SIDE).map(|index| (index % SIDE, index / SIDE)) {
        let [a, b] = [corner(column, row), corner(column, row + 1)];
        let [c, d] = [corner(column + 1, row + 1), corner(column + 1, row)];
        for positions in [[a, b, c], [a, c, d]] {
            let mut facet = Triangle { positions, normals: [Vec3::Y; 3], material: 0, object: 0 };
            facet.normals = [facet.geometric_normal(); 3];
            scene.triangles.push(facet);
        }
    }
    let camera = &mut scene.cameras[0];
    (camera.position, camera.target, camera.up) = (Vec3::new(0.0, 6.0, 0.01), Vec3::ZERO, Vec3::NEG_Z);
    // No outline is in view: along one, sixteen samples resolve the covered fraction of a
    // pixel only roughly.
    camera.fov_y_degrees = 11.0;
    scene.lights[0].kind =
        LightKind::Point { position: Vec3::new(0.8, 3.0, 0.5), intensity: Vec3::splat(10.0) };
    scene
}

/// Height over a place of the ground, m.
type Height = dyn Fn(f32, f32) -> f32;

#[test]
fn facets_keep_their_direct_light() {
    let bowl = |x: f32, z: f32| 0.5 * (x * x + z * z);
    let dome = |x: f32, z: f32| -0.5 * (x * x + z * z);
    let trough = |x: f32, _: f32| 0.6 * x * x;
    let bumps = |x: f32, z: f32| 0.03 * (9.0 * x).sin() * (7.0 * z).cos();
    let reliefs: [(&str, &Height); 4] =
        [("bowl", &bowl), ("dome", &dome), ("trough", &trough), ("bumps", &bumps)];
    let quality = Quality { entry_points: 0, cache_points: 0, edge_samples: 16, ..SMALL };
    for (name, height) in reliefs {
        let mut scene = relief(height);
        let size = [100, 75];
        scene.cameras[0].size = size;
        let tracer = trace(scene.clone(), size, 32);
        let found = render(scene, quality.clone()).layer(Layer::Direct).unwrap();
        let energy = energy_ratio(&found, &tracer.picture().unwrap().direct);
        println!("{name}: {energy:.5}");
        assert!((energy - 1.0).abs() < 1e-3, "{name}: {energy}");
    }
    assert_silent(&context());
}
