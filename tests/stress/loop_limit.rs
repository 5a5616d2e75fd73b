//! Lists longer than a loop's iteration limit: lavapipe silently ends loops at 65 535 iterations.

use std::ops::Range;
use std::sync::LazyLock;

use crate::common::needles::box_of_needles;
use crate::common::{assert_silent, context};
use crate::{SMALL, count, prepare, relative_mse, render, room};
use glam::{DVec3, Vec3};
use lightpaths::Result;
use lightpaths::passes::frame::hvds::ClusterFlux;
use lightpaths::passes::precompute::gather_rays::Hemisphere;
use lightpaths::passes::precompute::rays::{RayQuery, Rays};
use lightpaths::passes::precompute::visibility::accessibility::{AccessibilityPoint, open_rays};
use lightpaths::reference::{PathTracer, PhotonMapper, Progressive, TracedScene};
use lightpaths::renderer::{Layer, Renderer, Silent};
use lightpaths::scene::{Light, LightKind, LoadOptions, Naming, Quality, Scene, Triangle, shapes};
use lightpaths::types::{Contribution, ContributionRange, LOOP_TRUNCATED, OPEN};

/// A box of a metre, and a speck 200 m away: all of the box falls into a few clusters.
fn box_and_speck() -> Scene {
    let mut scene = shapes::closed_box(Vec3::ONE, 0.5);
    let far = Vec3::X * 200.0;
    let positions = [far, far + 0.01 * Vec3::X, far + 0.01 * Vec3::Y];
    scene.triangles.push(Triangle { positions, normals: [Vec3::Z; 3], material: 0, object: 0 });
    scene
}

/// Direct and indirect flux of the contributions in a range, W, weighted by accessibility.
fn shown(
    renderer: &Renderer,
    run: &ContributionRange,
    contributions: &[Contribution],
    entering: &[Vec3],
) -> [DVec3; 2] {
    let flux = |contribution: &Contribution| {
        let fraction = if run.is_unweighted == 1 {
            1.0
        } else {
            f64::from(contribution.accessibility()) / f64::from(OPEN)
        };
        fraction * contribution.throughput.as_dvec3() * entering[contribution.path() as usize].as_dvec3()
    };
    let sum = |items: Range<u32>| -> DVec3 {
        contributions[items.start as usize..items.end as usize].iter().map(flux).sum()
    };
    let emission_scale = renderer.stages().emission_scale.as_dvec3();
    [run.first..run.first_other, run.first_other..run.end].map(|items| emission_scale * sum(items))
}

#[test]
fn clusters_add_up_however_much_falls_into_them() {
    let quality = Quality { entry_points: 400_000, cells: 64, ..SMALL };
    let mut renderer = prepare(box_and_speck(), quality);
    // Without this, clusters that nothing reads stay dark.
    renderer.set_skipping(false);
    renderer.frame().unwrap();
    let entering = renderer.path_flux().unwrap();
    let contributions: Vec<Contribution> = renderer.stages().contributions.read().unwrap();
    let runs: Vec<ContributionRange> = renderer.stages().contribution_ranges.read().unwrap();
    let flux: Vec<ClusterFlux> = renderer.stages().cluster_flux.read().unwrap();
    let mut longest = 0;
    for (run, flux) in runs.iter().zip(&flux) {
        let length = run.end - run.first;
        longest = longest.max(length);
        let expected = shown(&renderer, run, &contributions, &entering);
        let emission_scale = renderer.stages().emission_scale;
        for (flux, expected) in [flux.direct, flux.indirect].into_iter().zip(expected) {
            let error = ((emission_scale * flux).as_dvec3() - expected).abs().max_element();
            assert!(
                error <= 1e-4 * expected.max_element() + 1e-9,
                "{length} contributions: {flux} W, {expected} W expected"
            );
        }
    }
    assert!(longest > 1 << 16, "{longest} contributions of a cluster");
    assert_silent(&context());
}

#[test]
fn every_gather_ray_is_traced_however_many_a_hemisphere_has() {
    let quality =
        Quality { entry_points: 1_000, cache_points: 40, gather_rays: 4096, occlusion: false, ..SMALL };
    let mut scene = room();
    scene.cameras[0].size = [16, 16];
    // Unwritten rays have a random target, and cause a panic.
    let renderer = render(scene, quality.clone());
    let rays = count(&renderer, "gather rays");
    assert!(rays > 100 * 1024, "{rays} rays");
    // Each ray of a closed room meets a wall.
    assert_eq!(renderer.stages().merged_rays.ray_count, rays);
    let shared = context().limits().shared_bytes;
    if shared < 4 * 65_536 {
        let mut scene = box_and_speck();
        scene.quality = Quality { gather_rays: 65_536, ..quality };
        let refusal = Renderer::new(&context(), scene, &mut Silent).map(drop).unwrap_err().to_string();
        assert!(refusal.contains("lower quality.gather_rays"), "{refusal}");
    }
    assert_silent(&context());
}

/// A picture of one tile, which holds every record of the box.
fn one_tile(cache_points: u32) -> Result<Vec<[f32; 3]>> {
    let mut scene = shapes::closed_box(Vec3::ONE, 0.5);
    let camera = &mut scene.cameras[0];
    (camera.position, camera.target) = (Vec3::splat(0.49), Vec3::ZERO);
    (camera.fov_y_degrees, camera.size) = (120.0, [16, 16]);
    scene.quality = Quality { cache_points, gather_rays: 16, ..SMALL };
    let mut renderer = Renderer::new(&context(), scene, &mut Silent)?;
    renderer.frame()?;
    renderer.layer(Layer::Indirect)
}

/// lavapipe truncates no loop at 200 000 records of a tile, so a smaller test would show nothing.
#[test]
#[ignore = "full size: make stress"]
fn a_tile_of_more_records_than_it_goes_through_is_no_picture() {
    let few = one_tile(5_000).unwrap();
    match one_tile(500_000) {
        // A device without an iteration limit.
        Ok(many) => assert!(relative_mse(&many, &few) < 0.01, "a wrong picture unreported"),
        Err(error) => {
            let said = error.to_string();
            assert!(said.contains("lower quality.cache_points"), "{said}");
        }
    }
    assert_silent(&context());
}

/// The device's result, or `None` if it was refused with this message.
#[track_caller]
fn found_or_refused<T>(found: Result<T>, says: &str) -> Option<T> {
    found.map_err(|error| assert!(error.to_string().contains(says), "{error}")).ok()
}

const OVER_ONE_ANOTHER: &str = "lie over one another less";

#[test]
fn rays_through_more_boxes_than_they_go_through_find_nothing_without_a_word() {
    let queries: Vec<RayQuery> = (0..4_000)
        .map(|index| {
            let turn = 2.399_963 * index as f32;
            let direction = Vec3::new(turn.cos(), (0.37 * turn).sin(), turn.sin());
            RayQuery { origin: Vec3::new(0.02, 0.01, -0.03), direction }
        })
        .collect();
    let [few, many] =
        [0, 120_000].map(|needles| TracedScene::new(&context(), box_of_needles(needles)).unwrap());
    let rays = Rays::new(&context()).unwrap();
    let ends = rays.trace(&few.buffers, &queries).unwrap();
    if let Some(found) = found_or_refused(rays.trace(&many.buffers, &queries), OVER_ONE_ANOTHER) {
        let is_off = found.iter().zip(&ends).filter(|(a, b)| (a.t - b.t).abs() > 1e-3 * b.t).count();
        assert!(is_off < 40, "{is_off} of {} rays end elsewhere unreported", queries.len());
    }
    // Sixteen rays for each point, and few boxes for each.
    let some_needles = TracedScene::new(&context(), box_of_needles(10_000)).unwrap();
    let points = [AccessibilityPoint { position: few.scene.triangles[0].positions[0] * 0.9, side: 0 }; 64];
    let open = |scene: &TracedScene| {
        open_rays(&context(), &scene.buffers, &points, Hemisphere::new(16), 0.4, (3, Naming::Number))
    };
    let expected = open(&few).unwrap();
    if let Some(found) = found_or_refused(open(&some_needles), OVER_ONE_ANOTHER) {
        assert_eq!(found, expected, "other rays unreported");
    }
    assert_silent(&context());
}

#[test]
fn frames_whose_kernels_were_truncated_are_no_pictures() {
    let mut renderer = render(room(), SMALL);
    // `passes::loop_limit` tests the flags that kernels write; this tests that the host reads them.
    renderer.stages().truncated_loops.write(&[LOOP_TRUNCATED]).unwrap();
    renderer.move_camera(Vec3::splat(0.1), Vec3::ZERO);
    let refusal = renderer.frame().map(drop).unwrap_err().to_string();
    assert!(refusal.contains(OVER_ONE_ANOTHER) && refusal.contains("`frame`"), "{refusal}");
    assert_silent(&context());
}

/// The mean of a few samples for each pixel.
fn sampled<T: Progressive>(tracer: Result<T>, samples: u32) -> Result<Vec<[f32; 3]>> {
    let mut tracer = tracer?;
    tracer.add_samples(samples)?;
    Ok(tracer.picture()?.beauty)
}

#[test]
fn paths_through_more_boxes_than_they_go_through_are_no_picture() {
    let picture = |needles| sampled(PathTracer::new(&context(), box_of_needles(needles), &mut Silent), 4);
    let expected = picture(0).unwrap();
    if let Some(found) = found_or_refused(picture(120_000), OVER_ONE_ANOTHER) {
        assert!(relative_mse(&found, &expected) < 0.01, "a wrong picture unreported");
    }
    assert_silent(&context());
}

/// The atrium with its light divided into `count` equal lights at one position behind the leaves.
fn atrium_of_lamps(count: u16) -> Scene {
    static ATRIUM: LazyLock<Scene> =
        LazyLock::new(|| Scene::load("atrium", &LoadOptions::default()).unwrap());
    let mut scene = ATRIUM.clone();
    scene.cameras[0].size = [16, 12];
    let position = Vec3::new(-14.0, 8.5, -7.0) - scene.origin.as_vec3();
    let intensity = Vec3::splat(1000.0 / f32::from(count));
    let lamp = |index| Light::new(format!("lamp {index}"), LightKind::Point { position, intensity });
    scene.lights = (0..count).map(lamp).collect();
    scene
}

#[test]
fn more_lights_than_a_vertex_asks_are_no_picture() {
    let context = context();
    let path = |lamps| sampled(PathTracer::new(&context, atrium_of_lamps(lamps), &mut Silent), 2);
    let photon = |lamps| sampled(PhotonMapper::new(&context, atrium_of_lamps(lamps), &mut Silent), 2);
    let expected = path(1).unwrap();
    if let Some(found) = found_or_refused(path(1024), "fewer lights") {
        assert!(relative_mse(&found, &expected) < 1e-6, "a wrong picture unreported");
    }
    // Photons are distributed to lights differently; nearly all visible light comes straight
    // from the lights.
    if let Some(found) = found_or_refused(photon(512), "fewer lights") {
        let energy = |picture: &[[f32; 3]]| picture.as_flattened().iter().map(|v| f64::from(*v)).sum::<f64>();
        let ratio = energy(&found) / energy(&photon(1).unwrap());
        assert!((ratio - 1.0).abs() < 0.02, "{ratio} of the light unreported");
    }
    assert_silent(&context);
}

#[test]
fn cells_that_are_wide_beside_most_of_the_surface_are_told() {
    let quality = |cells| Quality { cells, entry_points: 2_000, cache_points: 200, ..SMALL };
    let told = |scene: Scene, cells| {
        let renderer = prepare(scene, quality(cells));
        let warnings = renderer.scene().warnings.iter();
        warnings.filter(|warning| warning.contains("cells are")).cloned().collect::<Vec<String>>()
    };
    let [coarse, fine] = [64, 128].map(|cells| told(box_and_speck(), cells));
    assert!(coarse.len() == 1 && coarse[0].ends_with("raise quality.cells"), "{coarse:?}");
    assert!(fine.len() == 1 && fine[0].contains("leave out what is far"), "{fine:?}");
    assert_eq!(told(shapes::closed_box(Vec3::ONE, 0.5), 8), [""; 0]);
    // The cells of the draft preset, in the smallest built-in scene.
    let scene = Scene::load("box", &LoadOptions::default()).unwrap();
    assert_eq!(told(scene, Quality::DRAFT.cells), [""; 0]);
    assert_silent(&context());
}

#[test]
#[ignore = "full size: make stress"]
fn no_built_in_scene_has_cells_that_are_wide() {
    for name in ["box", "room", "atrium"] {
        let mut scene = Scene::load(name, &LoadOptions::default()).unwrap();
        scene.quality = Quality { entry_points: 2_000, cache_points: 200, ..Quality::DRAFT };
        let renderer = Renderer::new(&context(), scene, &mut Silent).unwrap();
        let warnings = &renderer.scene().warnings;
        assert!(!warnings.iter().any(|warning| warning.contains("cells are")), "{name}: {warnings:?}");
    }
    assert_silent(&context());
}
