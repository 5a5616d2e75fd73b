//! Form factors: the fraction of light paths that leave one surface and arrive at another.

use std::sync::Arc;

use crate::assert_close;
use crate::common::{assert_silent, context};
use glam::Vec3;
use lightpaths::gpu::Context;
use lightpaths::passes::frame::path_scan::HEAD;
use lightpaths::passes::precompute::entry_points::{self, Strata};
use lightpaths::passes::precompute::light_paths;
use lightpaths::passes::precompute::path_orders::LightPaths;
use lightpaths::passes::{ClusterTables, SceneBuffers};
use lightpaths::renderer::Silent;
use lightpaths::scene::{CellSizes, Naming, Scene, bvh::Bvh, grid, hvds::Hvds, shapes, surfaces};

const PATHS: u32 = 200_000;
const CELLS: u32 = 16;

/// Targets of all paths in order. The last vertex of a path has no target.
struct Walks {
    /// Material at the start of each path.
    starts: Vec<u32>,
    /// Targets along each path: one fewer than its vertices.
    targets: Vec<Vec<u32>>,
    lost: u64,
}

/// Traces the light paths of a scene as the precomputation does; all sides that see
/// something take part.
fn walk(context: &Arc<Context>, scene: &mut Scene) -> Walks {
    let bvh = Bvh::build(&scene.triangles).unwrap();
    scene.triangles = bvh.order.iter().map(|&index| scene.triangles[index as usize]).collect();
    let sees = surfaces::sides_that_see_something(&scene.triangles);
    let surfaces: Vec<_> =
        scene.triangles.iter().zip(sees).map(|(t, sees)| surfaces::surface(t, sees)).collect();
    let buffers = SceneBuffers::new(context, &bvh, scene, &surfaces).unwrap();
    let (low, high) = scene.bounds();
    let hvds = Hvds::build(&scene.triangles, &surfaces, grid::grid(low, high, CELLS));
    // Uniform density, so that all paths have the same weight.
    let strata = Strata::new(&hvds, &vec![1.0; hvds.fragments.len()], |_| 1.0, PATHS, (3, Naming::Number));
    let clusters = ClusterTables::new(&hvds, &strata.in_clusters).upload(context).unwrap();
    let entry_points = entry_points::place(context, &buffers, &clusters, &strata, 3).unwrap();
    assert!(entry_points.iter().all(|point| (point.weight - 1.0).abs() < 1e-5));
    let streams: Vec<u32> = (0..entry_points.len() as u32).collect();
    let materials = &scene.materials;
    let vertices = light_paths::trace(
        context,
        &buffers,
        &clusters,
        (materials, &CellSizes::default()),
        (&entry_points, &streams),
        7,
        &mut Silent,
    )
    .unwrap();
    let (entry_points, paths) =
        LightPaths::new(vertices, (entry_points, streams), &surfaces, materials, clusters.base_count, false);
    let mut targets = Vec::new();
    for step in &paths.steps {
        match step.material {
            HEAD => targets.push(Vec::new()),
            material => targets.last_mut().unwrap().push(material),
        }
    }
    let starts = entry_points.iter().map(|v| surfaces[v.side as usize / 2].material).collect();
    Walks { starts, targets, lost: paths.lost }
}

/// Gives each pair of triangles, a rectangle of the scene, its own material.
fn tell_rectangles_apart(scene: &mut Scene) {
    let wall = scene.materials[0].clone();
    scene.materials = vec![wall; scene.triangles.len() / 2];
    scene.triangles.iter_mut().enumerate().for_each(|(index, t)| t.material = index as u32 / 2);
}

/// Form factor of a point at height 1 over the corner of a parallel x × y rectangle.
fn corner_form_factor(x: f64, y: f64) -> f64 {
    let term = |a: f64, b: f64| a / (1.0 + a * a).sqrt() * (b / (1.0 + a * a).sqrt()).atan();
    (term(x, y) + term(y, x)) / std::f64::consts::TAU
}

/// Form factor from one square to a parallel, coaxial one at distance 1: the exact form factor of a
/// point, averaged over the first square by the midpoint rule.
fn square_form_factor(from: f64, to: f64) -> f64 {
    const STEPS: u32 = 400;
    let middle = |i: u32| from * ((f64::from(i) + 0.5) / f64::from(STEPS) - 0.5);
    let mut sum = 0.0;
    for i in 0..STEPS {
        for j in 0..STEPS {
            let (x, y) = (middle(i), middle(j));
            for (sx, sy) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
                sum += corner_form_factor(0.5 * to + sx * x, 0.5 * to + sy * y);
            }
        }
    }
    sum / f64::from(STEPS * STEPS)
}

/// Fraction of the paths from each of two squares that arrive at the other.
fn exchanged(scene: &mut Scene) -> [f64; 2] {
    // No surface absorbs: a path ends where it leaves the scene.
    tell_rectangles_apart(scene);
    let walks = walk(&context(), scene);
    assert_eq!(walks.lost, 0);
    [0, 1].map(|square| {
        let lengths = walks.starts.iter().zip(&walks.targets).filter(|(start, _)| **start == square);
        let arrived = lengths.clone().filter(|(_, targets)| !targets.is_empty()).count();
        arrived as f64 / lengths.count() as f64
    })
}

#[test]
fn facing_unit_squares_exchange_what_the_closed_form_says() {
    assert_close("the integral itself", square_form_factor(1.0, 1.0), 0.199_825, 1e-5);
    let measured = exchanged(&mut shapes::facing_squares(1.0, 1.0, 1.0));
    for fraction in measured {
        // 100 000 independent paths for each square would have 0.6 % of noise; stratified ones have
        // far less.
        assert_close("form factor", fraction, 0.199_825, 0.005);
    }
    assert_silent(&context());
}

#[test]
fn perpendicular_unit_squares_exchange_what_the_closed_form_says() {
    let mut scene = shapes::facing_squares(1.0, 1.0, 1.0);
    // The upper square becomes a wall on the lower one's edge.
    let corners = [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(x, y)| Vec3::new(x, y, -0.5));
    for (triangle, [a, b, c]) in scene.triangles[2..].iter_mut().zip([[0, 1, 2], [0, 2, 3]]) {
        (triangle.positions, triangle.normals) = ([corners[a], corners[b], corners[c]], [Vec3::Z; 3]);
    }
    for fraction in exchanged(&mut scene) {
        assert_close("form factor", fraction, 0.200_044, 0.005);
    }
    assert_silent(&context());
}

#[test]
fn unequal_squares_obey_reciprocity() {
    let mut scene = shapes::facing_squares(1.0, 1.0, 1.0);
    for position in scene.triangles[2..].iter_mut().flat_map(|triangle| &mut triangle.positions) {
        *position *= Vec3::new(2.0, 1.0, 2.0);
    }
    let [small, large] = exchanged(&mut scene);
    assert_close("from the small square", small, square_form_factor(1.0, 2.0), 0.01);
    assert_close("from the large square", large, square_form_factor(2.0, 1.0), 0.01);
    assert_close("reciprocity", 4.0 * large, small, 0.01);
    assert_silent(&context());
}

#[test]
fn rows_of_a_closed_box_sum_to_one() {
    let mut scene = shapes::closed_box(Vec3::ONE, 0.9);
    tell_rectangles_apart(&mut scene);
    let walks = walk(&context(), &mut scene);
    assert_eq!(walks.lost, 0);
    // Roulette starts after six reflections at the earliest (0.9⁶ > ½): a shorter path has escaped
    // from the box.
    assert!(walks.targets.iter().all(|targets| targets.len() >= 6), "no path escapes");
    for from in 0..6 {
        let mut row = [0_u32; 6];
        let paths = walks.starts.iter().zip(&walks.targets).filter(|(start, _)| **start == from);
        paths.for_each(|(_, targets)| row[targets[1] as usize] += 1);
        let total: u32 = row.iter().sum();
        for (to, &count) in (0..6).zip(&row) {
            // The opposite wall has an index larger by three.
            let expected = if to == from {
                0.0
            } else if to == (from + 3) % 6 {
                0.199_825
            } else {
                0.200_044
            };
            let fraction = f64::from(count) / f64::from(total);
            assert!(
                (fraction - expected).abs() <= 0.003,
                "from wall {from} to wall {to}: {fraction} for {expected}"
            );
        }
    }
    assert_silent(&context());
}
