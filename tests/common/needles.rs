//! A scene in which one ray meets more boxes than a loop has iterations.

use glam::Vec3;
use lightpaths::scene::{Scene, Triangle, shapes};

fn in_four(triangle: &Triangle) -> [Triangle; 4] {
    let [a, b, c] = triangle.positions;
    let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(a, b)| 0.5 * (a + b));
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]].map(|positions| Triangle { positions, ..*triangle })
}

/// A box with `count` needles through all of it; each needle's bounding box is that of the box. The
/// needles are too thin to be seen.
pub fn box_of_needles(count: u32) -> Scene {
    let mut scene = shapes::closed_box(Vec3::ONE, 0.5);
    scene.cameras[0].size = [16, 16];
    // Walls of many triangles, so that rays reach them late.
    for _ in 0..5 {
        scene.triangles = scene.triangles.iter().flat_map(in_four).collect();
    }
    let needle = |index: u32| {
        let low = -0.49 + 1e-7 * index as f32;
        let ends = [Vec3::new(low, -0.49, -0.49), Vec3::new(low + 0.98, 0.49, 0.49)];
        let positions = [ends[0], ends[1], ends[1] + Vec3::new(6e-8, -6e-8, 0.0)];
        Triangle { positions, normals: [Vec3::Z; 3], material: 0, object: 0 }
    };
    scene.triangles.extend((0..count).map(needle));
    scene
}
