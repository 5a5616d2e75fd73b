//! Traversal: nearest hits, against all triangles in f64; and no ray escapes from closed surfaces.

use crate::common::{assert_silent, random_words};
use crate::world::{Random, World, with_holes};
use glam::Vec3;
use lightpaths::passes::precompute::rays::{RayAnswer, RayQuery, Rays};
use lightpaths::scene::{LoadOptions, Scene, Triangle, shapes};
use lightpaths::types::NO_SIDE;

/// A few hundred triangles of very different size that pierce each other.
fn soup() -> Scene {
    let mut scene = shapes::facing_squares(1.0, 1.0, 0.5);
    let mut random = Random::new(3);
    let triangle = |size: f32| {
        let centre = random.cube();
        let positions = [0; 3].map(|_| centre + size * random.cube());
        Triangle { positions, normals: [Vec3::Y; 3], material: 0, object: 0 }
    };
    scene.triangles = [0.01, 0.1, 1.0].repeat(101).into_iter().map(triangle).collect();
    scene
}

/// Rays of every difficult kind around a scene of about unit size.
fn awkward_rays(world: &World, count: usize) -> Vec<RayQuery> {
    let mut random = Random::new(count as u64);
    let mut queries = Vec::new();
    for index in 0..count {
        let origin = 1.3 * random.cube();
        let (target, normal, _) = world.surface_point(&mut random);
        let along = (target - origin).normalize();
        let direction = match index % 6 {
            0 => random.sphere() * 10f32.powf(4.0 * random.unit() - 2.0),
            1 => target - origin,
            // Parallel to one axis or to a plane of two, with both signs of zero.
            2 => [Vec3::X, Vec3::NEG_Y, Vec3::Z, -Vec3::Z][random.below(4) as usize],
            3 => Vec3::new(random.unit() - 0.5, -0.0, random.unit() - 0.5),
            4 => Vec3::new(0.0, random.unit() - 0.5, random.unit() - 0.5),
            // Half a degree off the plane of a triangle that it hits.
            _ => {
                let grazing = (along - 0.992 * along.dot(normal) * normal).normalize();
                queries.push(RayQuery { origin: target - grazing, direction: grazing });
                continue;
            }
        };
        queries.push(RayQuery { origin, direction });
    }
    queries
}

/// Number of rays with different answers of device and reference. Each passes an edge on the other
/// side in f32.
fn disagreements(world: &World, queries: &[RayQuery], answers: &[RayAnswer]) -> usize {
    let geometry = world.geometry();
    let disagrees = |(query, answer): (&RayQuery, &RayAnswer)| {
        let direction = query.direction.as_dvec3();
        let Some(hit) = geometry.closest(query.origin, direction) else { return answer.side != NO_SIDE };
        // The distance from the reference's plane to the device's hit: t itself is inexact if the
        // ray grazes the plane.
        let normal = world.surfaces[hit.triangle as usize].normal.as_dvec3();
        let off_plane = ((f64::from(answer.t) - hit.t) * direction.dot(normal)).abs();
        let same_side = answer.side == geometry.side(hit.triangle, direction);
        off_plane > 1e-5 || !(same_side || hit.barycentric.min_element() < 1e-4)
    };
    queries.iter().zip(answers).filter(|&pair| disagrees(pair)).count()
}

#[test]
fn nearest_hits_equal_brute_force() {
    let teapot = Scene::load("box", &LoadOptions::default()).unwrap();
    let worlds = [
        World::room(),
        World::new(&soup(), 8),
        World::new(&teapot, 8),
        World::room_with_holes(),
        World::new(&with_holes(soup()), 8),
    ];
    for (world, largest) in worlds.iter().zip([16_385, 9_973, 3_989, 16_385, 9_973]) {
        let rays = Rays::new(&world.context).unwrap();
        for count in [0, 1, 63, 64, 65, largest] {
            let queries = awkward_rays(world, count);
            let answers = rays.trace(&world.buffers, &queries).unwrap();
            assert_eq!(answers.len(), count);
            let found = disagreements(world, &queries, &answers);
            assert!(found * 2_000 <= count, "{found} of {count} rays disagree");
        }
    }
    assert_silent(&worlds[0].context);
}

#[test]
fn segments_are_free_where_the_nearest_hit_lies_beyond_their_end() {
    let world = World::new(&soup(), 8);
    let queries = awkward_rays(&world, 5_000);
    let hits = Rays::new(&world.context).unwrap().trace(&world.buffers, &queries).unwrap();
    let segments = Rays::of_segments(&world.context).unwrap();
    // Segments that end before, just before, just after and far after the hit.
    for (fraction, is_hit) in [(0.5, false), (0.999, false), (1.001, true), (20.0, true)] {
        let shorten = |(query, hit): (&RayQuery, &RayAnswer)| {
            let length = if hit.side == NO_SIDE { 1e3 } else { fraction * hit.t };
            RayQuery { origin: query.origin, direction: length * query.direction }
        };
        let shortened: Vec<RayQuery> = queries.iter().zip(&hits).map(shorten).collect();
        let answers = segments.trace(&world.buffers, &shortened).unwrap();
        let is_right = |(answer, hit): (&RayAnswer, &RayAnswer)| {
            let expected = is_hit && hit.side != NO_SIDE;
            (answer.side != NO_SIDE) == expected && (answer.t >= 0.0) == expected
        };
        let wrong = answers.iter().zip(&hits).filter(|&pair| !is_right(pair)).count();
        // Rays that pass an edge on its other side after their direction is rounded again.
        assert!(wrong <= 5, "{wrong} of 5000 segments of {fraction} of the way");
    }
    assert!(hits.iter().filter(|hit| hit.side != NO_SIDE).count() > 1_000);
    assert_silent(&world.context);
}

/// Rays with a reach find what rays without one find, and nothing beyond it.
#[test]
fn rays_end_at_their_reach() {
    let world = World::new(&soup(), 8);
    let rays = Rays::new(&world.context).unwrap();
    let queries = awkward_rays(&world, 5_000);
    let endless = rays.trace(&world.buffers, &queries).unwrap();
    for reach in [0.01, 0.7, 1.5] {
        let within = rays.trace_within(&world.buffers, &queries, reach).unwrap();
        let near = endless.iter().filter(|hit| hit.side != NO_SIDE && hit.t <= reach).count();
        assert!((500..4_500).contains(&near) || reach == 0.01, "{near} of 5000 hits within {reach}");
        let expected = endless.iter().map(|hit| if hit.t <= reach { hit.side } else { NO_SIDE });
        let wrong = within.iter().zip(expected).filter(|(answer, expected)| answer.side != *expected).count();
        // A hit at the reach itself.
        assert!(wrong <= 2, "{wrong} of 5000 rays within {reach}");
    }
    assert_silent(&world.context);
}

#[test]
fn rays_that_agree_with_the_reference_are_not_all_misses() {
    let world = World::room();
    let mut answers =
        Rays::new(&world.context).unwrap().trace(&world.buffers, &awkward_rays(&world, 600)).unwrap();
    let queries = awkward_rays(&world, 600);
    assert_eq!(disagreements(&world, &queries, &answers), 0);
    assert!(answers.iter().filter(|answer| answer.side == NO_SIDE).count() < 300);
    for answer in &mut answers {
        answer.t *= 1.001;
    }
    assert!(disagreements(&world, &queries, &answers) > 300, "the comparison sees a distance that is off");
}

#[test]
fn edges_and_corners_of_a_box_are_hit() {
    let world = World::new(&shapes::closed_box(Vec3::new(2.0, 1.0, 4.0), 0.5), 8);
    let mut queries = Vec::new();
    for x in [-1.0, 0.0, 1.0] {
        for y in [-0.5, 0.0, 0.5] {
            for z in [-2.0, 0.0, 2.0] {
                queries.push(RayQuery { origin: Vec3::ZERO, direction: Vec3::new(x, y, z) });
            }
        }
    }
    queries.retain(|query| query.direction != Vec3::ZERO);
    let answers = Rays::new(&world.context).unwrap().trace(&world.buffers, &queries).unwrap();
    for (query, answer) in queries.iter().zip(&answers) {
        assert!((answer.t - 1.0).abs() < 1e-6, "towards {}: {answer:?}", query.direction);
        assert_eq!(answer.side % 2, 0, "the fronts are inside");
    }
    assert_silent(&world.context);
}

/// Rays from inside the sphere around `centre`: towards every corner and the middle of every edge,
/// then at random.
fn inside_out(world: &World, centre: Vec3, radius: f32, count: usize) -> Vec<RayQuery> {
    let mut random = Random::new(11);
    let mut queries = Vec::with_capacity(count);
    for origin in [Vec3::ZERO, Vec3::new(0.3, -0.2, 0.1), Vec3::new(0.0, 0.85, 0.0)] {
        let origin = centre + radius * origin;
        for triangle in &world.triangles {
            let [p0, p1, p2] = triangle.positions;
            for target in [p0, p1, p2, 0.5 * (p0 + p1), 0.5 * (p1 + p2), 0.5 * (p2 + p0)] {
                queries.push(RayQuery { origin, direction: target - origin });
            }
        }
    }
    let words = random_words(5, 3 * count);
    let mut axis =
        words.chunks_exact(3).map(|w| Vec3::new(w[0] as f32, w[1] as f32, w[2] as f32) / 2f32.powi(31) - 1.0);
    while queries.len() < count {
        let direction = axis.next().unwrap();
        let origin = centre + 0.5 * radius * random.cube();
        queries
            .push(RayQuery { origin, direction: if direction == Vec3::ZERO { Vec3::X } else { direction } });
    }
    queries
}

#[test]
fn no_ray_escapes_from_a_closed_sphere() {
    for (centre, radius, count) in [
        (Vec3::ZERO, 1.0, 2_000_003),
        (Vec3::new(30.0, -20.0, 10.0), 1.0, 200_003),
        (Vec3::ZERO, 1e-3, 200_003),
    ] {
        let mut scene = shapes::integrating_sphere(radius, 3, 0.5, Vec3::ZERO, 1.0);
        for triangle in &mut scene.triangles {
            triangle.positions = triangle.positions.map(|p| p + centre);
        }
        let world = World::new(&scene, 8);
        let queries = inside_out(&world, centre, radius, count);
        let answers = Rays::new(&world.context).unwrap().trace(&world.buffers, &queries).unwrap();
        let escaped = answers.iter().filter(|answer| answer.side % 2 == 1).count();
        assert_eq!(escaped, 0, "rays of {count} around {centre} left the sphere or came in from outside");
        for (query, answer) in queries.iter().zip(&answers) {
            let reached = (query.origin + answer.t * query.direction - centre).length() / radius;
            assert!((0.99..1.000_1).contains(&reached), "{query:?} stopped at {reached} radii");
        }
        assert_silent(&world.context);
    }
}

/// Rays from inside a box to points of its twelve edges.
fn to_edges(centre: Vec3, size: Vec3, count: usize) -> Vec<RayQuery> {
    let mut random = Random::new(7);
    let ray = |index: usize| {
        let mut place = random.cube().map(|along| 0.999 * along);
        let signs = [1, 2].map(|bit| if (index / 3) & bit == 0 { -1.0 } else { 1.0 });
        place[(index + 1) % 3] = signs[0];
        place[(index + 2) % 3] = signs[1];
        let origin = centre + 0.3 * size * random.cube();
        // The same rounding as of the walls' corners.
        RayQuery { origin, direction: (0.5 * size * place + centre) - origin }
    };
    (0..count).map(ray).collect()
}

/// Axis-aligned walls have boxes of zero thickness. A ray to an edge enters one wall's box where it
/// leaves the other's. Rounding alone decides whether it meets both or one; without widened boxes,
/// it might meet none.
#[test]
fn no_ray_escapes_from_a_closed_box() {
    for (size, centre) in
        [(Vec3::new(2.0, 1.5, 1.0), Vec3::ZERO), (Vec3::splat(0.77), Vec3::new(17.3, -5.1, 0.9))]
    {
        let mut scene = shapes::closed_box(size, 0.5);
        for triangle in &mut scene.triangles {
            triangle.positions = triangle.positions.map(|p| p + centre);
        }
        let world = World::new(&scene, 8);
        let mut queries = inside_out(&world, centre, 0.5 * size.min_element(), 300_007);
        queries.extend(to_edges(centre, size, 40_000));
        let answers = Rays::new(&world.context).unwrap().trace(&world.buffers, &queries).unwrap();
        assert!(answers.iter().all(|answer| answer.side % 2 == 0), "rays left the box around {centre}");
        assert_silent(&world.context);
    }
}

#[test]
fn sides_of_nothing_are_odd() {
    // The tests above count a miss as a back side.
    assert_eq!(NO_SIDE % 2, 1);
    let world = World::new(&shapes::facing_squares(1.0, 1.0, 0.5), 8);
    let past = RayQuery { origin: Vec3::ZERO, direction: Vec3::X };
    let answers = Rays::new(&world.context).unwrap().trace(&world.buffers, &[past]).unwrap();
    assert_eq!((answers[0].side, answers[0].t), (NO_SIDE, -1.0));
}
