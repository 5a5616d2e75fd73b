//! Scale, place, walls on cell boundaries and slivers.

use crate::common::{assert_silent, context, random_words};
use crate::{SMALL, count, prepare, relative_mse, render, room};
use std::fmt::Write;

use glam::{DVec3, Vec3};
use lightpaths::passes::frame::hvds::ClusterFlux;
use lightpaths::renderer::{Layer, Renderer};
use lightpaths::scene::{Light, LightKind, LoadOptions, Quality, Scene, Triangle, shapes};
use lightpaths::types::{CachePoint, Contribution, ContributionRange, OPEN};

/// The room, loaded from files with a scale and a translation; its light is as bright on the
/// walls as before.
fn placed(scale: f64, to: DVec3) -> Scene {
    let room = room();
    let vector = |v: DVec3| format!("[{:e},{:e},{:e}]", v.x, v.y, v.z);
    let place = |p: Vec3| vector(scale * p.as_dvec3() + to);
    let mut model = String::new();
    for triangle in &room.triangles {
        triangle.positions.iter().for_each(|p| writeln!(model, "v {} {} {}", p.x, p.y, p.z).unwrap());
        model.push_str("f -3 -2 -1\n");
    }
    let spec = format!(
        "[[model]]\nfile = \"room.obj\"\nscale = {scale:e}\ntranslate = {}\n\
         [camera]\nposition = {}\ntarget = {}\nfov_y = {}\nsize = [64, 48]\n\
         [[light]]\nkind = \"point\"\nposition = {}\nintensity = {}\n",
        vector(to),
        place(room.cameras[0].position),
        place(room.cameras[0].target),
        room.cameras[0].fov_y_degrees,
        place(room.lights[0].kind.position().unwrap()),
        vector(DVec3::splat(scale * scale)),
    );
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("room.obj"), model).unwrap();
    let file = folder.path().join("room.toml");
    std::fs::write(&file, spec).unwrap();
    Scene::load(file.to_str().unwrap(), &LoadOptions::default()).unwrap()
}

#[test]
fn scale_and_place_change_nothing() {
    let picture = |scale: f64, to: f64| {
        let renderer = render(placed(scale, DVec3::new(to, -to, 0.7 * to)), SMALL);
        assert_eq!(count(&renderer, "path vertices outside all clusters"), 0, "scale {scale}, moved by {to}");
        assert_eq!(count(&renderer, "pixels without a covering record"), 0, "scale {scale}, moved by {to}");
        [Layer::Direct, Layer::Indirect].map(|layer| renderer.layer(layer).unwrap())
    };
    let reference = picture(1.0, 0.0);
    for (scale, to) in [(1e-3, 0.0), (3.0, 0.0), (1e4, 1e5), (1e-3, 1e5)] {
        let image = picture(scale, to);
        for ((name, image), reference) in ["direct", "indirect"].iter().zip(&image).zip(&reference) {
            let error = relative_mse(image, reference);
            println!("scale {scale}, moved by {to}: {name} relMSE {error:e}");
            assert!(error <= 1e-3, "scale {scale}, moved by {to}: {name} relMSE {error:e}");
        }
    }
    assert_silent(&context());
}

/// Flux of the contributions of all vertices; the flux that base clusters and their unweighted ones
/// should hold, weighted by accessibility; and the flux that a level holds, W.
fn energies(renderer: &Renderer) -> [f64; 3] {
    let stages = renderer.stages();
    let entering = renderer.path_flux().unwrap();
    let contributions: Vec<Contribution> = stages.contributions.read().unwrap();
    let flux = |d: &Contribution| f64::from(d.throughput.x) * f64::from(entering[d.path() as usize].x);
    let contributed = contributions.iter().map(flux).sum();
    let runs: Vec<ContributionRange> = stages.contribution_ranges.read().unwrap();
    let counts = |run: &ContributionRange, d: &Contribution| match run.is_unweighted {
        0 => f64::from(d.accessibility()) / f64::from(OPEN),
        _ => 1.0,
    };
    let of_run = |run: &ContributionRange| -> f64 {
        contributions[run.first as usize..run.end as usize].iter().map(|d| counts(run, d) * flux(d)).sum()
    };
    let shown = runs.iter().map(of_run).sum();
    let clusters: Vec<ClusterFlux> = stages.cluster_flux.read().unwrap();
    let held: f64 = clusters.iter().map(|flux| f64::from(flux.direct.x) + f64::from(flux.indirect.x)).sum();
    // One level is finer than the requested cells.
    let levels = f64::from(renderer.scene().quality.cells.ilog2() + 2);
    [contributed, shown, held / levels]
}

/// Boxes with walls a whole number of cells apart, as the grid counts and as a user would count. No
/// flux is lost, and the energy is that of any box. Returns the mean error of the energy, which is
/// noise in each box, and the number of boxes in this mean. Narrower boxes do not count: their
/// light is so near to two walls that entry points sample it by chance, with any grid.
fn check_walls(steps: impl Iterator<Item = u32>, quality: &Quality) -> (f64, u32) {
    let cells = quality.cells as f32;
    let (mut sum, mut boxes) = (0.0, 0);
    for step in steps {
        // One axis sets the cell size.
        for size in [
            Vec3::new(1.0, step as f32 / (cells - 1.0), 0.5),
            Vec3::new(step as f32 / cells, 1.0, step as f32 / (cells - 1.0)),
        ] {
            let mut renderer = prepare(shapes::closed_box(size, 0.5), quality.clone());
            // Without skipping, frames also sum coarse levels that nothing reads.
            renderer.set_skipping(false);
            renderer.frame().unwrap();
            assert_eq!(count(&renderer, "path vertices outside all clusters"), 0, "{size}");
            let met = renderer.stages().merged_rays.ray_count;
            assert_eq!(met, count(&renderer, "gather rays"), "{size}: gather rays with a target");
            let [contributed, shown, held] = energies(&renderer);
            let error = contributed / (8.0 * std::f64::consts::PI) - 1.0;
            println!("{size}: contributed {:+.3} %, held {:+.1e}", 100.0 * error, held / shown - 1.0);
            assert!((held / shown - 1.0).abs() <= 1e-5, "{size}: {held} W of {shown} W");
            if size.min_element() > 0.1 {
                assert!(error.abs() <= 0.01, "{size}: {:+.3} % of its energy", 100.0 * error);
                (sum, boxes) = (sum + error, boxes + 1);
            }
        }
    }
    assert_silent(&context());
    println!("mean of {boxes} boxes: {:+.4} %", 100.0 * sum / f64::from(boxes));
    (sum / f64::from(boxes), boxes)
}

#[test]
fn walls_on_cell_boundaries_lose_no_energy() {
    check_walls([1, 3, 8, 15].into_iter(), &SMALL);
}

#[test]
#[ignore = "full size: make stress"]
fn walls_on_every_cell_boundary_lose_no_energy() {
    let quality = Quality { entry_points: 100_000, cache_points: 500, cells: 64, ..SMALL };
    let (error, boxes) = check_walls(1..64, &quality);
    assert!(boxes > 100 && error.abs() <= 1e-3, "{error}");
}

/// Needles across the corners of cells, of these alternating widths, metres.
fn slivers(cell: f32, widths: [f32; 2]) -> Vec<Triangle> {
    let unit = |word: u32| (f64::from(word) / f64::from(u32::MAX)) as f32;
    random_words(11, 1200)
        .chunks_exact(6)
        .map(|words| {
            let corner = Vec3::new(unit(words[0]), unit(words[1]), unit(words[2])) * 0.9 - 0.45;
            let corner = (corner / cell).round() * cell;
            let along = (Vec3::new(unit(words[3]), unit(words[4]), unit(words[5])) - 0.5).normalize();
            let across = along.any_orthonormal_vector() * widths[words[0] as usize % 2];
            let positions = [corner - 0.05 * along, corner + 0.05 * along, corner + across];
            let mut triangle = Triangle { positions, normals: [Vec3::Y; 3], material: 0, object: 0 };
            triangle.normals = [triangle.geometric_normal(); 3];
            triangle
        })
        .collect()
}

#[test]
fn slivers_make_no_firefly() {
    const ALBEDO: f32 = 0.5;
    let mut scene = shapes::closed_box(Vec3::ONE, ALBEDO);
    let cell = 1.0 / (SMALL.cells as f32 - 1.0);
    let light = Vec3::ZERO;
    let clear = 0.35;
    scene.triangles.extend(
        slivers(cell, [1e-3, 1e-6])
            .into_iter()
            .filter(|t| t.positions.iter().all(|p| p.distance(light) > clear)),
    );
    scene.lights = vec![Light::new("lamp", LightKind::Point { position: light, intensity: Vec3::ONE })];
    let renderer = render(scene, SMALL);
    // Direct light is at most that of the nearest point. Indirect light is at most that of the
    // brightest surface all around.
    let bound = ALBEDO / (1.0 - ALBEDO) / (clear * clear);
    let radiance = renderer.layer(Layer::Indirect).unwrap();
    let brightest = radiance.iter().map(|pixel| pixel[0] * std::f32::consts::PI / ALBEDO).fold(0.0, f32::max);
    println!("brightest {brightest}, bound {bound}");
    assert!(brightest <= bound, "{brightest} W/m², {bound} W/m² at most");
    // An edge point on a needle may have relaxed records alone.
    assert_eq!(count(&renderer, "pixels that take the nearest record"), 0);
    assert_silent(&context());
}

/// Needles that are wide enough for many rays, and too small for many entry points. Pictures of
/// three seeds differ little more than those of the empty room.
#[test]
fn slivers_make_no_noise() {
    let mut scene = shapes::closed_box(Vec3::ONE, 0.5);
    let (lamp, clear) = (Vec3::ZERO, 0.2);
    let needles = slivers(1.0 / (SMALL.cells as f32 - 1.0), [4e-3; 2]).into_iter();
    scene.triangles.extend(needles.filter(|t| t.positions.iter().all(|p| p.distance(lamp) > clear)));
    let kind = LightKind::Point { position: lamp, intensity: Vec3::ONE };
    scene.lights = vec![Light::new("lamp", kind)];
    let picture = |seed| {
        let renderer = render(scene.clone(), Quality { seed, ..SMALL });
        renderer.layer(Layer::Indirect).unwrap()
    };
    let [first, second, third] = [1, 7, 13].map(picture);
    let errors = [&second, &third].map(|other| relative_mse(&first, other));
    println!("relMSE between seeds {errors:?}");
    assert!(errors[0].max(errors[1]) <= 2.5e-4, "{errors:?}");
    assert_silent(&context());
}

/// Balls of one radius, each of 320 triangles with smooth normals, fronts outside.
fn balls(radius: f32, places: &[Vec3]) -> Vec<Triangle> {
    let ball = shapes::integrating_sphere(radius, 2, 0.5, Vec3::ZERO, 1.0).triangles;
    let moved = |place: Vec3| {
        // The sphere's fronts are inside.
        move |triangle: &Triangle| {
            let ([a, b, c], [l, m, n]) =
                (triangle.positions.map(|p| p + place), triangle.normals.map(|n| -n));
            Triangle { positions: [a, c, b], normals: [l, n, m], ..*triangle }
        }
    };
    places.iter().flat_map(|&place| ball.iter().map(moved(place))).collect()
}

/// Records are far too few for the curvature: large balls could take all of them, and small
/// ones come later.
#[test]
fn a_small_budget_reaches_all_surfaces() {
    const SMALL_RADIUS: f32 = 0.03;
    let mut scene = shapes::closed_box(Vec3::new(1.0, 0.8, 1.2), 0.5);
    let corners = |x: f32, y: f32, z: [f32; 2]| {
        [(-x, z[0]), (x, z[0]), (-x, z[1]), (x, z[1])].map(|(x, z)| Vec3::new(x, y, z))
    };
    let large = corners(0.3, -0.2, [-0.4, 0.2]);
    let small = [corners(0.3, 0.15, [-0.5, -0.1]), corners(0.15, 0.25, [-0.4, -0.2])].concat();
    scene.triangles.extend(balls(0.12, &large));
    scene.triangles.extend(balls(SMALL_RADIUS, &small));
    scene.cameras[0].size = [64, 48];
    let renderer = render(scene, Quality { cache_points: 2_500, ..SMALL });
    let points: Vec<CachePoint> = renderer.stages().cache_points.read().unwrap();
    for place in small {
        let near = points.iter().filter(|point| point.position.distance(place) < 1.01 * SMALL_RADIUS);
        let count = near.count();
        // Caps of 30° that overlap by a third: a few dozen cover a sphere.
        assert!((25..200).contains(&count), "{count} records on the ball at {place}");
    }
    assert_eq!(count(&renderer, "pixels that take the nearest record"), 0);
    assert_silent(&context());
}
