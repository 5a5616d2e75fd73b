//! Rays from inside closed surfaces, started as the passes start them.

use crate::common::{assert_silent, context, random_words};
use glam::Vec3;
use lightpaths::cpu::math::{ClearDistance, frame_around};
use lightpaths::passes::SceneBuffers;
use lightpaths::passes::precompute::rays::{RayQuery, Rays};
use lightpaths::scene::bvh::Bvh;
use lightpaths::scene::{Scene, Triangle, shapes, surfaces};
use lightpaths::types::NO_SIDE;

/// Number of `count` rays that leave a closed scene. They start at points of its surface away from
/// edges, off the surface as in `glsl/include/bvh.glsl`, with uniform directions over the
/// half-space before it.
fn escaped(mut scene: Scene, centre: Vec3, count: u64) -> u64 {
    let context = context();
    for triangle in &mut scene.triangles {
        triangle.positions = triangle.positions.map(|p| p + centre);
    }
    let bvh = Bvh::build(&scene.triangles).unwrap();
    scene.reorder(&bvh.order);
    let faces: Vec<_> =
        scene.triangles.iter().map(|triangle| surfaces::surface(triangle, [true; 2])).collect();
    let buffers = SceneBuffers::new(&context, &bvh, &scene, &faces).unwrap();
    let rays = Rays::new(&context).unwrap();
    let clear = ClearDistance::new(&bvh.nodes[0], &scene.cell_sizes).at(Vec3::ZERO);
    let unit = |word: u32| (word >> 8) as f32 / 16_777_216.0;
    let (mut left, mut found, mut seed) = (count, 0, 1);
    while left > 0 {
        let batch = left.min(u64::from(Rays::LIMIT));
        let words = random_words(seed, 5 * batch as usize);
        let query = |w: &[u32]| {
            let triangle = &scene.triangles[w[0] as usize % scene.triangles.len()];
            let [a, b, c] = triangle.positions;
            let (r, s) = (unit(w[1]).sqrt(), unit(w[2]));
            let across = (b - a).cross(c - a).length();
            let least = 4.0 * clear / across * Vec3::new(b.distance(c), c.distance(a), a.distance(b));
            let weights = Vec3::new(1.0 - r, r * (1.0 - s), r * s).max(least.min(Vec3::splat(0.25)));
            let position = (weights.x * a + weights.y * b + weights.z * c) / weights.element_sum();
            let normal = triangle.geometric_normal();
            let (height, angle) = (unit(w[3]), std::f32::consts::TAU * unit(w[4]));
            let flat = (1.0 - height * height).max(0.0).sqrt();
            let direction = frame_around(normal) * Vec3::new(flat * angle.cos(), flat * angle.sin(), height);
            RayQuery { origin: position + clear * normal, direction }
        };
        let queries: Vec<RayQuery> = words.chunks_exact(5).map(query).collect();
        let answers = rays.trace(&buffers, &queries).unwrap();
        // Misses, and hits of the outer side of a wall.
        found += answers.iter().filter(|answer| answer.side % 2 == 1).count() as u64;
        (left, seed) = (left - batch, seed + 1);
    }
    assert_silent(&context);
    found
}

fn check(count: u64) {
    let sphere = || shapes::integrating_sphere(1.0, 3, 0.5, Vec3::ZERO, 1.0);
    for (name, scene, centre, fraction) in [
        ("sphere", sphere(), Vec3::ZERO, 1),
        ("sphere beside the origin", sphere(), Vec3::new(30.0, -20.0, 10.0), 10),
        ("box", shapes::closed_box(Vec3::new(2.0, 1.5, 1.0), 0.5), Vec3::ZERO, 10),
        ("fine sphere", shapes::integrating_sphere(1.0, 6, 0.5, Vec3::ZERO, 1.0), Vec3::ZERO, 10),
    ] {
        let found = escaped(scene, centre, count / fraction);
        println!("{name}: {found} of {} rays escaped", count / fraction);
        assert_eq!(found, 0, "{name}");
    }
}

#[test]
fn no_ray_escapes_from_where_paths_go_on() {
    check(1_000_000);
}

#[test]
#[ignore = "full size: make stress"]
fn no_ray_of_a_hundred_million_escapes() {
    check(100_000_000);
}

/// Rays from a strip of 22 m by 2 cm, as a step has along its edge. Rounding at its far corners is
/// larger than the distance at which rays start.
#[test]
fn no_ray_meets_the_sliver_that_it_leaves() {
    let context = context();
    let (across, along) = (Vec3::new(0.0, 0.015, -0.015), Vec3::new(22.3, 0.0, 0.0));
    let corner = Vec3::new(-11.15, -5.259, -3.65);
    let corners = [corner, corner + along, corner + along + across, corner + across];
    let normals = [along.cross(across).normalize(); 3];
    let triangles = [[0, 1, 2], [0, 2, 3]].map(|indices: [usize; 3]| Triangle {
        positions: indices.map(|index| corners[index]),
        normals,
        material: 0,
        object: 0,
    });
    let scene = Scene { triangles: triangles.to_vec(), ..shapes::closed_box(Vec3::ONE, 0.5) };
    let bvh = Bvh::build(&scene.triangles).unwrap();
    let faces: Vec<_> = triangles.iter().map(|triangle| surfaces::surface(triangle, [true; 2])).collect();
    let buffers = SceneBuffers::new(&context, &bvh, &scene, &faces).unwrap();
    let rays = Rays::new(&context).unwrap();
    let clear = ClearDistance::new(&bvh.nodes[0], &scene.cell_sizes).at(Vec3::ZERO);
    let unit = |word: u32| (word >> 8) as f32 / 16_777_216.0;
    let query = |w: &[u32]| {
        let place = corner + (0.05 + 0.9 * unit(w[0])) * along + (0.05 + 0.9 * unit(w[1])) * across;
        let (height, angle) = (0.05 + 0.95 * unit(w[2]), std::f32::consts::TAU * unit(w[3]));
        let flat = (1.0 - height * height).max(0.0).sqrt();
        let direction = frame_around(normals[0]) * Vec3::new(flat * angle.cos(), flat * angle.sin(), height);
        RayQuery { origin: place + clear * normals[0], direction }
    };
    let queries: Vec<RayQuery> = random_words(1, 4 << 16).chunks_exact(4).map(query).collect();
    let answers = rays.trace(&buffers, &queries).unwrap();
    let met = answers.iter().filter(|answer| answer.side != NO_SIDE).count();
    assert_eq!(met, 0, "of {}", queries.len());
    assert_silent(&context);
}
