//! The frame plan: the passes of each edit. The frame's barriers are sufficient, and
//! none is redundant.

use crate::common::{assert_silent, context};
use crate::world::textured;
use glam::Vec3;
use lightpaths::reference::TracedScene;
use lightpaths::renderer::{Renderer, Silent, Work};
use lightpaths::scene::{Light, LightKind, Quality, Scene, shapes};

/// Passes of the camera.
const VIEW: &[&str] = &["primary", "edge_samples"];
/// Passes before the first light of a new view.
const BATCHES: &[&str] = &["pixel_batches"];
/// Passes that trace a light's irradiance at pixels.
const LAYER: &[&str] = &["direct", "shadow_edges"];
/// Passes that carry energy from the light paths to the clusters.
const ENERGY: &[&str] = &["hvds", "gather", "near_field", "bright"];
/// Passes that carry it to the records of the last view.
const SAME_RECORDS: &[&str] = &["gather", "blend"];
/// Passes that carry it to records that must be found first.
const RECORDS: &[&str] = &["needed_records", "gather", "blend"];
/// Passes that render the picture from records and irradiance buffers.
const PICTURE: &[&str] = &["splat_apply", "compose", "tonemap"];

fn scene() -> Scene {
    let mut scene = shapes::closed_box(Vec3::new(1.0, 0.8, 1.2), 0.6);
    scene.quality =
        Quality { entry_points: 3_000, cache_points: 300, gather_rays: 64, cells: 8, ..Quality::DRAFT };
    scene.cameras[0].size = [33, 17];
    // Without the last two triangles, shadows have edges.
    scene.triangles.truncate(scene.triangles.len() - 2);
    scene
}

fn area_light(radiance: Vec3) -> LightKind {
    let (edge_u, edge_v) = (Vec3::new(0.2, 0.0, 0.0), Vec3::new(0.0, 0.0, 0.2));
    // This light takes several dispatches.
    LightKind::Area { corner: Vec3::new(0.1, 0.3, 0.1), edge_u, edge_v, radiance, samples: 20 }
}

/// Asserts that the next frame runs exactly these passes.
#[track_caller]
fn expect(renderer: &mut Renderer, what: &str, passes: &[&[&str]]) {
    let report = renderer.frame().unwrap();
    let names: Vec<&str> = report.passes.iter().map(|pass| pass.name).collect();
    assert_eq!(names, passes.concat(), "{what}");
    assert_eq!(context().take_redundant_barriers(), [""; 0], "{what}");
    assert!(report.passes.iter().all(|pass| !pass.overlapped), "{what}");
    // An idle frame gathers the records that the view did not use; the next one does nothing.
    let idle = if names.contains(&"hvds") { RECORDS } else { &[] };
    let passes = renderer.frame().unwrap().passes;
    assert!(passes.iter().map(|pass| pass.name).eq(idle.iter().copied()), "{what}, and then {passes:?}");
    assert_eq!(context().take_redundant_barriers(), [""; 0], "{what}, and then");
    assert!(renderer.frame().unwrap().passes.is_empty(), "{what}, and then nothing");
}

#[test]
fn each_edit_redoes_what_depends_on_it_and_no_more() {
    each_edit_redoes_what_depends_on_it_in(scene(), VIEW);
    let with_colours = [VIEW, &["pixel_colours"]].concat();
    each_edit_redoes_what_depends_on_it_in(textured(scene()), &with_colours);
}

fn each_edit_redoes_what_depends_on_it_in(scene: Scene, view: &[&str]) {
    let context = context();
    let mut renderer = Renderer::new(&context, scene, &mut Silent).unwrap();
    context.take_redundant_barriers();
    let renderer = &mut renderer;
    let (sum, factors, scan, clusters): (&[&str], &[&str], &[&str], &[&str]) =
        (&["direct_sum"], &["form_factors"], &["path_scan"], &["hvds_light"]);
    let all = &[view, BATCHES, LAYER, sum, factors, scan, clusters, ENERGY, &["splat"], RECORDS, PICTURE];
    let moved = &[LAYER, sum, factors, clusters, ENERGY, RECORDS, PICTURE];
    let recoloured = &[sum, ENERGY, RECORDS, PICTURE];
    // The colour of a single light is the last factor of the picture.
    let rescaled: &[&[&str]] = &[&["compose", "tonemap"]];
    expect(renderer, "the first frame", all);

    renderer.move_light(0, Vec3::new(0.1, 0.2, 0.0)).unwrap();
    expect(renderer, "a light moves", moved);
    renderer.move_light(0, Vec3::new(0.1, 0.2, 0.0)).unwrap();
    expect(renderer, "it stays where it is", &[]);
    let kind = renderer.scene().lights[0].kind;
    renderer.set_light(0, kind.with_emission(Vec3::new(1.0, 2.0, 3.0))).unwrap();
    expect(renderer, "the only light changes its colour", rescaled);
    renderer.set_light(0, area_light(Vec3::ONE)).unwrap();
    expect(renderer, "a light changes its kind", moved);
    renderer.add_light(Light::new("second", kind)).unwrap();
    expect(renderer, "a light is added", moved);
    renderer.set_light(1, kind.with_emission(Vec3::new(2.0, 1.0, 0.5))).unwrap();
    expect(renderer, "one of two lights changes its colour", recoloured);
    renderer.switch_light(1, false).unwrap();
    expect(renderer, "a light is switched off", recoloured);
    renderer.move_light(0, Vec3::new(-0.1, 0.2, 0.0)).unwrap();
    expect(renderer, "another one moves", moved);
    renderer.switch_light(1, true).unwrap();
    expect(renderer, "a light is switched on again", recoloured);
    renderer.switch_light(1, true).unwrap();
    expect(renderer, "it is on already", &[]);
    renderer.switch_light(1, false).unwrap();
    renderer.move_light(1, Vec3::ZERO).unwrap();
    expect(renderer, "a light is switched off and moves", recoloured);
    renderer.move_light(1, Vec3::new(0.0, 0.1, 0.0)).unwrap();
    renderer.switch_light(1, true).unwrap();
    expect(renderer, "a light comes on elsewhere", moved);
    renderer.set_light(1, kind.with_emission(Vec3::ZERO)).unwrap();
    expect(renderer, "a light turns black and moves", recoloured);
    renderer.remove_light(0).unwrap();
    expect(renderer, "a light is removed", recoloured);

    renderer.move_camera(Vec3::new(0.1, 0.0, 0.4), Vec3::ZERO);
    expect(renderer, "the camera moves, no light is active", &[view, &["splat"], PICTURE]);
    renderer.set_light(0, kind).unwrap();
    expect(renderer, "light again", &[&[BATCHES], &moved[..]].concat());
    renderer.move_camera(Vec3::new(0.2, 0.0, 0.4), Vec3::ZERO);
    expect(renderer, "the camera moves", &[view, BATCHES, LAYER, sum, &["splat"], PICTURE]);
    renderer.move_camera(Vec3::new(0.2, 0.0, 0.4), Vec3::ZERO);
    expect(renderer, "the camera stays", &[]);
    renderer.set_diffuse(0, Vec3::new(0.5, 0.4, 0.3)).unwrap();
    expect(renderer, "an albedo changes", &[scan, clusters, ENERGY, RECORDS, PICTURE]);
    renderer.set_diffuse(0, Vec3::new(0.5, 0.4, 0.3)).unwrap();
    expect(renderer, "an albedo stays", &[]);
    renderer.add_light(Light::new("third", kind)).unwrap();
    expect(renderer, "a light is added beside one that stays", moved);
    renderer.switch_light(1, false).unwrap();
    renderer.set_diffuse(0, Vec3::new(0.4, 0.4, 0.3)).unwrap();
    expect(
        renderer,
        "an albedo changes while a light is off",
        &[sum, scan, clusters, ENERGY, RECORDS, PICTURE],
    );
    renderer.switch_light(1, true).unwrap();
    expect(renderer, "the light comes on", &[sum, clusters, ENERGY, RECORDS, PICTURE]);
    renderer.remove_light(1).unwrap();
    expect(renderer, "it is removed", recoloured);
    renderer.set_exposure(1.0);
    expect(renderer, "the exposure changes", &[&["tonemap"]]);

    for (work, passes) in [
        (Work::Everything, &all[..]),
        (Work::Light(0), moved),
        (Work::Colour, rescaled),
        (Work::View, &[view, BATCHES, LAYER, sum, &["splat"], PICTURE]),
        (Work::Material, &[scan, clusters, ENERGY, RECORDS, PICTURE]),
    ] {
        renderer.force(work);
        expect(renderer, &format!("{work:?}"), passes);
    }
    let passes_of = |renderer: &mut Renderer, what: &str, passes: &[&[&str]]| {
        let found = renderer.frame().unwrap().passes;
        assert!(found.iter().map(|pass| pass.name).eq(passes.concat()), "{what}: {found:?}");
        assert_eq!(context.take_redundant_barriers(), [""; 0], "{what}");
    };
    renderer.move_light(0, Vec3::new(0.2, 0.2, 0.0)).unwrap();
    passes_of(renderer, "a light moves", moved);
    renderer.move_light(0, Vec3::new(0.2, 0.3, 0.0)).unwrap();
    let same = &[LAYER, sum, factors, clusters, ENERGY, SAME_RECORDS, PICTURE];
    passes_of(renderer, "it moves on under the same view", same);
    renderer.move_camera(Vec3::new(-0.2, 0.0, 0.4), Vec3::ZERO);
    passes_of(renderer, "then the camera", &[view, BATCHES, LAYER, sum, &["splat"], RECORDS, PICTURE]);
    renderer.set_exposure(2.0);
    passes_of(renderer, "then the exposure", &[&["tonemap"]]);
    passes_of(renderer, "an idle frame", &[RECORDS]);
    renderer.move_camera(Vec3::new(0.2, 0.0, 0.4), Vec3::ZERO);
    passes_of(renderer, "the camera again", &[view, BATCHES, LAYER, sum, &["splat"], PICTURE]);
    renderer.set_skipping(false);
    let all =
        &[view, BATCHES, LAYER, sum, factors, scan, clusters, ENERGY, &["splat"], SAME_RECORDS, PICTURE];
    passes_of(renderer, "nothing is left out", all);
    assert_silent(&context);
}

/// One of three lights moves: the others' rays are not traced again.
#[test]
fn lights_that_stay_trace_nothing() {
    let context = context();
    let mut scene = scene();
    scene.lights[0].kind = area_light(Vec3::ONE);
    for x in [-0.2, 0.2] {
        let kind = LightKind::Point { position: Vec3::new(x, 0.2, 0.0), intensity: Vec3::ONE };
        scene.lights.push(Light::new(format!("{x}"), kind));
    }
    let mut renderer = Renderer::new(&context, scene, &mut Silent).unwrap();
    let report = renderer.frame().unwrap();
    assert_eq!([report.rays["form_factors"], report.rays["direct"]], [22 * 3_000, 22 * 33 * 17]);
    assert_eq!(report.lights_unchanged, [0.0; 2]);
    for (light, samples) in [(0, 20), (1, 1), (2, 1)] {
        renderer.move_light(light, Vec3::new(0.1, 0.1, 0.1)).unwrap();
        let report = renderer.frame().unwrap();
        let rays = [report.rays["form_factors"], report.rays["direct"]];
        assert_eq!(rays, [samples * 3_000, samples * 33 * 17], "light {light}");
        assert!(report.lights_unchanged.iter().all(|fraction| (fraction - 2.0 / 3.0).abs() < 1e-9));
    }
    assert_silent(&context);
}

/// A light that is off in the scene is not traced until it is switched on.
#[test]
fn lights_that_the_scene_has_off_emit_nothing() {
    let context = context();
    let mut scene = scene();
    scene.lights.push(Light { is_on: false, ..Light::new("off", area_light(Vec3::ONE)) });
    assert_eq!(TracedScene::new(&context, scene.clone()).unwrap().light_sources.rows.len(), 1);
    let mut renderer = Renderer::new(&context, scene, &mut Silent).unwrap();
    assert_eq!(renderer.frame().unwrap().rays["form_factors"], 3_000);
    assert!(!renderer.light_is_on(1));
    renderer.switch_light(1, true).unwrap();
    assert_eq!(renderer.frame().unwrap().rays["form_factors"], 20 * 3_000);
    assert!(renderer.scene().lights[1].is_on);
    assert_silent(&context);
}

/// A repeated pass runs without the others and leaves the same results as a frame.
#[test]
fn a_pass_alone_is_repeated() {
    let mut renderer = Renderer::new(&context(), scene(), &mut Silent).unwrap();
    renderer.force(Work::Everything);
    renderer.frame().unwrap();
    for name in ["primary", "form_factors", "hvds", "gather", "compose"] {
        let report = renderer.replay(name).unwrap();
        assert!(!report.passes.is_empty() && report.passes.iter().all(|pass| pass.name == name), "{name}");
    }
    let idle = renderer.frame().unwrap();
    assert!(idle.passes.iter().any(|pass| pass.name == "tonemap"), "the next frame redoes everything");
    assert_silent(&context());
}
