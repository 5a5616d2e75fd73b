//! More of a list than loops of one invocation turn: lavapipe ends them at 65 535 without a word.

use std::ops::Range;

use crate::common::{assert_silent, context};
use crate::{SMALL, count, prepare, relative_mse, render};
use glam::{DVec3, Vec3};
use lightpaths::passes::frame::hvds::ClusterFlux;
use lightpaths::renderer::{Layer, Renderer, Silent};
use lightpaths::scene::{LoadOptions, Quality, Scene, Triangle, shapes};
use lightpaths::types::{Deposit, DepositRun, OPEN};

/// A box of a metre, and a speck 200 m away: all of the box falls into a few clusters.
fn box_and_speck() -> Scene {
    let mut scene = shapes::closed_box(Vec3::ONE, 0.5);
    let far = Vec3::X * 200.0;
    let positions = [far, far + 0.01 * Vec3::X, far + 0.01 * Vec3::Y];
    scene.triangles.push(Triangle { positions, normals: [Vec3::Z; 3], material: 0 });
    scene
}

/// Direct and indirect flux of the deposits of a run, W, as it shows.
fn shown(renderer: &Renderer, run: &DepositRun, deposits: &[Deposit], entering: &[Vec3]) -> [DVec3; 2] {
    let flux = |deposit: &Deposit| {
        let share = if run.is_whole == 1 { 1.0 } else { f64::from(deposit.openness()) / f64::from(OPEN) };
        share * deposit.throughput.as_dvec3() * entering[deposit.path() as usize].as_dvec3()
    };
    let sum = |items: Range<u32>| -> DVec3 {
        deposits[items.start as usize..items.end as usize].iter().map(flux).sum()
    };
    let tint = renderer.stages().tint.as_dvec3();
    [run.first..run.first_other, run.first_other..run.end].map(|items| tint * sum(items))
}

#[test]
fn clusters_add_up_however_much_falls_into_them() {
    let quality = Quality { entry_points: 400_000, cells: 64, ..SMALL };
    let mut renderer = prepare(box_and_speck(), quality);
    // Else what nothing reads stays dark.
    renderer.set_skipping(false);
    renderer.frame().unwrap();
    let entering = renderer.path_flux().unwrap();
    let deposits: Vec<Deposit> = renderer.stages().deposits.read().unwrap();
    let runs: Vec<DepositRun> = renderer.stages().deposit_runs.read().unwrap();
    let flux: Vec<ClusterFlux> = renderer.stages().cluster_flux.read().unwrap();
    let mut longest = 0;
    for (run, flux) in runs.iter().zip(&flux) {
        let length = run.end - run.first;
        longest = longest.max(length);
        let expected = shown(&renderer, run, &deposits, &entering);
        let tint = renderer.stages().tint;
        for (flux, expected) in [flux.direct, flux.indirect].into_iter().zip(expected) {
            let error = ((tint * flux).as_dvec3() - expected).abs().max_element();
            assert!(
                error <= 1e-4 * expected.max_element() + 1e-9,
                "{length} deposits: {flux} W, {expected} W expected"
            );
        }
    }
    assert!(longest > 1 << 16, "{longest} deposits of a cluster");
    assert_silent(&context());
}

#[test]
fn every_gather_ray_is_traced_however_many_a_hemisphere_has() {
    let quality =
        Quality { entry_points: 5_000, cache_points: 60, gather_rays: 4096, occlusion: false, ..SMALL };
    let mut scene = Scene::load("atrium", &LoadOptions::default()).unwrap();
    scene.cameras[0].size = [16, 16];
    // Rays that nobody wrote have any target, and end in a panic.
    let renderer = render(scene, quality.clone());
    assert!(count(&renderer, "gather rays") > 100 * 1024);
    let shared = context().limits().shared_bytes;
    if shared < 4 * 65_536 {
        let mut scene = box_and_speck();
        scene.quality = Quality { gather_rays: 65_536, ..quality };
        let refusal = Renderer::new(&context(), scene, &mut Silent).map(drop).unwrap_err().to_string();
        assert!(refusal.contains("lower quality.gather_rays"), "{refusal}");
    }
    assert_silent(&context());
}

/// A picture of one tile, in which every record of the box is.
fn one_tile(cache_points: u32) -> lightpaths::Result<Vec<[f32; 3]>> {
    let mut scene = shapes::closed_box(Vec3::ONE, 0.5);
    let camera = &mut scene.cameras[0];
    (camera.position, camera.target) = (Vec3::splat(0.49), Vec3::ZERO);
    (camera.fov_y_degrees, camera.size) = (120.0, [16, 16]);
    scene.quality = Quality { cache_points, gather_rays: 16, ..SMALL };
    let mut renderer = Renderer::new(&context(), scene, &mut Silent)?;
    renderer.frame()?;
    renderer.layer(Layer::Indirect)
}

#[test]
fn a_tile_of_more_records_than_it_goes_through_is_no_picture() {
    let few = one_tile(5_000).unwrap();
    match one_tile(500_000) {
        // A device whose loops turn as often as they should.
        Ok(many) => assert!(relative_mse(&many, &few) < 0.01, "a wrong picture without a word"),
        Err(error) => {
            let said = error.to_string();
            assert!(said.contains("lower quality.cache_points"), "{said}");
        }
    }
    assert_silent(&context());
}
