//! Sessions without a window: drafts, edits of materials, snapshots, documents on disk.

mod images;
mod lights;
mod models;
mod own_records;

use std::fs;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use glam::{DVec3, Vec3};
use tempfile::TempDir;

use super::actions;
use super::files;
use super::placing;
use super::recent::Recent;
use super::session::{Session, Source};
use super::ui_state::{Chosen, Place, Request, UiState};
use super::watch::Watch;
use crate::app::exposure::Exposure;
use crate::error::Error;
use crate::gpu::{Context, ContextOptions};
use crate::image::{self, ExrLayer, automatic_stops};
use crate::renderer::{Layer, Renderer, Silent};
use crate::scene::{DisplayTransform, Light, LightKind, LoadOptions, Quality, Scene, ToneCurve};

/// A closed cube of two metres.
const ROOM: &str = "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nv -1 2 -1\nv 1 2 -1\nv 1 2 1\nv -1 2 1\n\
f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 4 1 5 8\nf 2 3 7 6\n";

/// A square of half a metre, of an emitting material.
const PANEL: &str = "mtllib panel.mtl\nusemtl glow\nv 0 1 0\nv 0.5 1 0\nv 0.5 1 0.5\nv 0 1 0.5\nf 1 2 3 4\n";
const GLOW: &str = "newmtl glow\nKd 0.5 0.5 0.5\nKe 2 2 2\n";

const SCENE: &str = "[[model]]\nfile = \"room.obj\"\n[[model]]\nfile = \"panel.obj\"\n\
[camera]\nposition = [0, 1, 0.9]\ntarget = [0, 1, 0]\nsize = [48, 48]\n\
[[light]]\nname = \"lamp\"\nkind = \"point\"\nposition = [0.2, 1.6, 0.1]\nintensity = [0.2, 0.2, 0.2]\n\
[quality]\nentry_points = 2000\ncache_points = 200\ngather_rays = 16\ncells = 8\n";

fn context() -> Arc<Context> {
    Context::new(&ContextOptions { validation: true, ..ContextOptions::default() }).unwrap()
}

fn folder() -> TempDir {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in
        [("s.toml", SCENE), ("room.obj", ROOM), ("panel.obj", PANEL), ("panel.mtl", GLOW), ("cube.obj", ROOM)]
    {
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

fn open(context: &Arc<Context>, file: &Path, change: impl FnOnce(&mut Scene)) -> Session {
    let spec = file.to_str().unwrap().to_owned();
    let options = LoadOptions::default();
    let watch = Watch::new(&spec);
    let mut scene = Scene::load(&spec, &options).unwrap();
    change(&mut scene);
    let source = Source {
        spec,
        options,
        store: None,
        exposure: Exposure::Stops(0.0),
        display: DisplayTransform::default(),
    };
    Session::new(context, source, scene, watch, Arc::new(|| ())).unwrap()
}

/// Renders until the session is up to date. Returns the pictures of each renderer that it had.
fn settle(session: &mut Session) -> Vec<Vec<[u8; 4]>> {
    let mut pictures = Vec::new();
    let mut generation = session.generation;
    loop {
        let commands = session.update().unwrap();
        let is_still = commands.is_none();
        if let Some(commands) = commands {
            session.check(&commands.submit().unwrap()).unwrap();
        }
        session.end_frames(0).unwrap();
        if let Some(renderer) = session.renderer().filter(|_| session.generation > generation) {
            pictures.push(renderer.display().unwrap());
            generation = session.generation;
        }
        if is_still && session.progress().is_none() {
            return pictures;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn picture(session: &mut Session) -> Vec<[u8; 4]> {
    settle(session);
    session.renderer().unwrap().display().unwrap()
}

fn cold_start(context: &Arc<Context>, scene: Scene) -> Vec<[u8; 4]> {
    let mut renderer = Renderer::new(context, scene, &mut Silent).unwrap();
    renderer.frame().unwrap();
    renderer.display().unwrap()
}

#[test]
fn a_draft_comes_before_the_picture_and_each_is_that_of_its_settings() {
    let (context, folder) = (context(), folder());
    let file = folder.path().join("s.toml");
    let draft = |scene: &Scene| Quality { entry_points: 500, cache_points: 50, ..scene.quality.clone() };
    let mut session = open(&context, &file, |scene| scene.draft = draft(scene));
    let pictures = settle(&mut session);
    let scene = Scene::load(file.to_str().unwrap(), &LoadOptions::default()).unwrap();
    let coarse = Scene { quality: draft(&scene), ..scene.clone() };
    let expected = [coarse, scene].map(|scene| cold_start(&context, scene));
    assert!(expected[0] != expected[1], "a draft differs");
    assert!(pictures == expected, "{} pictures", pictures.len());
}

#[test]
fn a_draft_makes_room_and_comes_back_where_the_light_paths_do_not_fit() {
    let (context, folder) = (context(), folder());
    let file = folder.path().join("s.toml");
    let draft = |scene: &Scene| Quality { entry_points: 500, cache_points: 50, ..scene.quality.clone() };
    let mut session = open(&context, &file, |scene| scene.draft = draft(scene));
    let own = settle(&mut session);
    // As if the device had refused the light paths that it took.
    let full = || Error::OutOfMemory("too small".into());
    session.make_room(&full()).unwrap();
    assert!(session.renderer().is_none(), "nothing but direct light is held");
    let again = settle(&mut session);
    assert!(again == own[1..] && session.alarm.is_none(), "{:?}", session.said);
    session.make_room(&full()).unwrap();
    assert!(settle(&mut session) == own[..1], "the draft");
    assert_eq!(session.alarm.as_ref().unwrap().0, format!("a draft only: {}", full()));
    session.make_room(&full()).unwrap();
    assert_eq!(session.alarm.as_ref().unwrap().0, format!("direct light only: {}", full()));
}

/// The picture of what the session would save.
fn saved(context: &Arc<Context>, session: &mut Session, folder: &Path) -> (String, Vec<[u8; 4]>) {
    let file = folder.join("saved.toml");
    files::save_scene(session, file.to_str().unwrap()).unwrap();
    let scene = Scene::load(file.to_str().unwrap(), &LoadOptions::default()).unwrap();
    (fs::read_to_string(&file).unwrap(), cold_start(context, scene))
}

#[test]
fn a_diffuse_material_becomes_glossy_like_a_cold_start() {
    let (context, folder) = (context(), folder());
    let mut session = open(&context, &folder.path().join("s.toml"), |_| ());
    let first = picture(&mut session);
    let (generation, said) = (session.generation, session.said.clone());
    let wall = session.scene.materials.iter().position(|material| material.name != "glow").unwrap();
    let polish = |session: &mut Session, specular: f32| {
        let edit = &mut session.document.materials[wall];
        (edit.diffuse, edit.specular) = (Vec3::splat(0.3), Vec3::splat(specular));
        (edit.exponent, edit.editable) = (30.0, true);
    };
    // While the pointer is pressed, no light paths are traced.
    session.is_held = true;
    polish(&mut session, 0.2);
    let held = picture(&mut session);
    assert_eq!((session.generation, &session.said), (generation, &said), "nothing is refused");
    assert_eq!(session.document.materials[wall].specular, Vec3::splat(0.2), "the edit stays");
    session.is_held = false;
    polish(&mut session, 0.4);
    session.history.settle(&session.document);
    let glossy = picture(&mut session);
    assert!(session.generation > generation && glossy != first && glossy != held);
    let (text, expected) = saved(&context, &mut session, folder.path());
    assert!(text.contains("editable = true") && text.contains("specular = [0.4, 0.4, 0.4]"), "{text}");
    assert!(glossy == expected, "not the picture of the saved scene");

    // Further edits need no light paths, also to diffuse and back.
    let generation = session.generation;
    polish(&mut session, 0.0);
    session.history.settle(&session.document);
    let diffuse = picture(&mut session);
    let (_, expected) = saved(&context, &mut session, folder.path());
    assert!(diffuse == expected && diffuse != first, "not the picture of the saved scene");
    session.history.undo(&mut session.document);
    assert!(picture(&mut session) == glossy && session.generation == generation);

    // A model moves: the material stays glossy.
    session.document.parts.models[1].translation = DVec3::new(-0.25, 0.5, 0.0);
    session.history.settle(&session.document);
    let moved = picture(&mut session);
    let (_, expected) = saved(&context, &mut session, folder.path());
    assert!(moved == expected && moved != glossy, "not the picture of the saved scene");
    session.history.undo(&mut session.document);
    assert!(picture(&mut session) == glossy);

    // The edit is one step, which undo, redo and a reload of the file convert.
    session.history.undo(&mut session.document);
    assert!(picture(&mut session) == first, "undone");
    assert!(!session.document.materials[wall].editable);
    session.history.redo(&mut session.document);
    assert!(picture(&mut session) == glossy, "done again");
    fs::write(folder.path().join("s.toml"), SCENE.replace("0.2, 0.2, 0.2", "0.3, 0.3, 0.3")).unwrap();
    session.reload().unwrap().unwrap();
    settle(&mut session);
    assert!(!session.document.materials[wall].editable, "the file has a diffuse one");
    session.history.undo(&mut session.document);
    assert!(picture(&mut session) == glossy, "the edits are one step back");
}

#[test]
fn copies_of_lights_have_their_own_names_and_places() {
    let (context, folder) = (context(), folder());
    let mut session = open(&context, &folder.path().join("s.toml"), |_| ());
    let mut ui_state = UiState::new("s", Recent::none());
    session.document.lights[0].light.group = Some("g".to_owned());
    let sun = LightKind::Directional { direction: Vec3::NEG_Y, irradiance: Vec3::ONE };
    let sun_id = session.document.add(Light::new("sun", sun));
    let sun_id = session.document.lights[sun_id].id;
    ui_state.choose_lights(&[0, sun_id]);
    placing::duplicate(&mut session, &mut ui_state, &[0, sun_id]);
    let lights: Vec<&Light> = session.document.lights.iter().map(|entry| &entry.light).collect();
    let names: Vec<&str> = lights.iter().map(|light| light.name.as_str()).collect();
    assert_eq!(names, ["lamp", "glow", "sun", "lamp2", "sun2"]);
    assert_eq!((lights[3].group.as_deref(), lights[4].kind), (Some("g"), sun));
    // A twentieth of the scene's diagonal to the camera's right, which is x.
    let (low, high) = session.scene.bounds();
    let offset = lights[3].kind.position().unwrap() - lights[0].kind.position().unwrap();
    assert!(offset.distance(0.05 * (high - low).length() * Vec3::X) < 1e-6, "{offset}");
    let copies: Vec<u64> = session.document.lights[3..].iter().map(|entry| entry.id).collect();
    assert_eq!(ui_state.chosen_lights(), copies);
    // The surface of a model has no copy.
    placing::duplicate(&mut session, &mut ui_state, &[1]);
    assert_eq!((session.document.lights.len(), ui_state.chosen_lights()), (5, copies.clone()));
    let (line, _) = session.alarm.as_ref().unwrap();
    assert_eq!(line, "not copied: `glow` is part of the model or the sky");
    placing::remove(&mut session, &mut ui_state, &copies[..1]);
    assert_eq!((session.document.lights.len(), ui_state.chosen_lights()), (4, copies[1..].to_vec()));
}

#[test]
fn lights_that_cannot_be_placed_are_named() {
    let (context, folder) = (context(), folder());
    let mut session = open(&context, &folder.path().join("s.toml"), |_| ());
    let mut ui_state = UiState::new("s", Recent::none());
    let place = Place { position: Vec3::ZERO, normal: Vec3::Y, material: 0 };
    let before = session.document.clone();
    let alarm = |session: &mut Session| session.alarm.take().unwrap().0;
    ui_state.choose(Chosen::Light(1));
    placing::snap(&mut session, &ui_state, Some(place));
    assert!(alarm(&mut session).starts_with("not moved: `glow` has no position"));
    placing::aim(&mut session, &ui_state, Some(place), Vec3::ONE);
    assert!(alarm(&mut session).starts_with("not aimed: only spots"));
    placing::snap(&mut session, &ui_state, None);
    assert!(alarm(&mut session).starts_with("no traced surface is under the pointer"));
    ui_state.choose(Chosen::Nothing);
    placing::aim(&mut session, &ui_state, Some(place), Vec3::ONE);
    assert!(alarm(&mut session).starts_with("no light is chosen"));
    placing::duplicate(&mut session, &mut ui_state, &[]);
    assert!(alarm(&mut session).starts_with("no light is chosen"));
    assert!(session.document == before);
}

#[test]
fn a_snapshot_restores_its_edits_as_one_step() {
    let (context, folder) = (context(), folder());
    let mut session = open(&context, &folder.path().join("s.toml"), |_| ());
    let first = picture(&mut session);
    assert_eq!(session.keep_snapshot().unwrap(), "Snapshot 1");
    let home = session.camera.position;
    session.document.lights[0].light.is_on = false;
    session.history.settle(&session.document);
    session.document.materials[0].diffuse = Vec3::new(0.7, 0.2, 0.2);
    session.history.settle(&session.document);
    session.camera.position.x += 0.1;
    session.display = DisplayTransform { tone: ToneCurve::Agx, ..DisplayTransform::exposed(1.0) };
    session.follow_exposure(true);
    let edited = picture(&mut session);
    assert!(edited != first && session.snapshots.newest().is_some_and(|kept| kept.codes == first));

    session.restore_snapshot(0);
    assert!(picture(&mut session) == first, "the picture of the snapshot");
    assert_eq!((session.camera.position, session.follows_exposure()), (home, false));
    assert_eq!(session.history.depths(), [3, 0], "one step");
    session.history.undo(&mut session.document);
    let lamp = &session.document.lights[0].light;
    assert!(!lamp.is_on && session.document.materials[0].diffuse.x == 0.7, "the step is undone");

    // Snapshots follow the scene when its file changes: a new light renumbers the others.
    let more = "[[light]]\nname = \"new\"\nkind = \"point\"\nposition = [0, 0.5, 0]\n\
                intensity = [0.1, 0.1, 0.1]\n[quality]";
    fs::write(folder.path().join("s.toml"), SCENE.replace("[quality]", more)).unwrap();
    session.reload().unwrap().unwrap();
    let reloaded = picture(&mut session);
    session.restore_snapshot(0);
    let restored = picture(&mut session);
    assert!(reloaded != first && restored == first, "the lights of the snapshot, without the new one");
}

#[test]
fn the_exposure_follows_the_picture_until_it_is_locked() {
    let (context, folder) = (context(), folder());
    let mut session = open(&context, &folder.path().join("s.toml"), |_| ());
    settle(&mut session);
    let expected = |session: &Session| {
        let radiance = session.renderer().unwrap().layer(Layer::Beauty).unwrap();
        automatic_stops(&radiance)
    };
    assert!(session.display.exposure_stops == 0.0 && expected(&session) != 0.0);
    session.follow_exposure(true);
    settle(&mut session);
    let first = session.display.exposure_stops;
    assert_eq!(first, expected(&session));
    // A quarter of the light is two stops.
    for entry in &mut session.document.lights {
        entry.light.kind = entry.light.kind.with_emission(0.25 * entry.light.kind.emission());
    }
    settle(&mut session);
    assert!((session.display.exposure_stops - first - 2.0).abs() < 0.011, "{:?}", session.display);
    session.follow_exposure(false);
    let locked = session.display.exposure_stops;
    session.document.lights[0].light.is_on = false;
    settle(&mut session);
    assert_eq!(session.display.exposure_stops, locked);
    assert!((expected(&session) - locked).abs() > 0.05, "the picture has changed");
    // A change by hand locks, too.
    session.follow_exposure(true);
    settle(&mut session);
    session.expose(-1.0);
    settle(&mut session);
    assert_eq!((session.display.exposure_stops, session.follows_exposure()), (-1.0, false));
}

/// A panorama, brighter on one side, in these colours.
fn panorama(file: &Path, colour: [f32; 3]) {
    let bright = |texel: usize| if texel % 8 < 3 { 2.0 } else { 0.2 };
    let pixels: Vec<_> = (0..32).map(|texel| colour.map(|value| value * bright(texel))).collect();
    let layer = ExrLayer { name: "", channels: &["R", "G", "B"], pixels: &pixels };
    image::write_exr(fs::File::create(file).unwrap(), [8, 4], &[layer]).unwrap();
}

#[test]
fn an_image_becomes_the_sky_like_a_cold_start() {
    let (context, folder) = (context(), folder());
    // A floor alone: the sky is seen.
    fs::write(folder.path().join("room.obj"), "v -1 0 -1\nv 1 0 -1\nv 1 0 1\nv -1 0 1\nf 4 3 2 1\n").unwrap();
    let [grey, coloured] = ["grey.exr", "sun.EXR"].map(|name| folder.path().join(name));
    panorama(&grey, [1.0; 3]);
    panorama(&coloured, [1.0, 0.7, 0.4]);
    let mut session = open(&context, &folder.path().join("s.toml"), |_| ());
    let mut ui_state = UiState::new("s", Recent::none());
    let names = |session: &Session| {
        session.document.lights.iter().map(|entry| entry.light.name.clone()).collect::<Vec<_>>()
    };
    let mut shown = vec![picture(&mut session)];
    for (file, line, lights) in [
        (&grey, "image = \"grey.exr\"", &["lamp", "glow", "sky"][..]),
        (&coloured, "image = \"sun.EXR\"", &["lamp", "glow", "sky (red)", "sky (green)", "sky (blue)"]),
    ] {
        actions::drop_file(&mut session, &mut ui_state, file);
        session.history.settle(&session.document);
        let now = picture(&mut session);
        assert_eq!(names(&session), lights);
        let (text, expected) = saved(&context, &mut session, folder.path());
        assert!(text.contains(line), "{text}");
        assert!(now == expected, "{line}: not the picture of the saved scene");
        assert!(!shown.contains(&now), "{line}: nothing changes");
        shown.push(now);
    }
    // A file that is no image is taken back, and leaves no step.
    let steps = session.history.depths();
    fs::write(folder.path().join("bad.hdr"), "a poem").unwrap();
    actions::drop_file(&mut session, &mut ui_state, &folder.path().join("bad.hdr"));
    session.history.settle(&session.document);
    assert!(picture(&mut session) == shown[2]);
    assert_eq!(session.history.depths(), steps);
    let said = session.said.last().unwrap();
    assert!(said.starts_with("taken back: ") && said.contains("bad.hdr"), "{said}");

    for (before, lights) in [(1, &["lamp", "glow", "sky"][..]), (0, &["lamp", "glow"])] {
        assert!(session.history.undo(&mut session.document));
        assert!(picture(&mut session) == shown[before], "undone to {before}");
        assert_eq!(names(&session), lights);
    }
    assert!(session.history.redo(&mut session.document));
    assert!(picture(&mut session) == shown[1], "redone");
}

#[test]
fn a_luminaire_is_added_from_its_file_and_other_files_are_refused() {
    let (context, folder) = (context(), folder());
    let mut session = open(&context, &folder.path().join("s.toml"), |_| ());
    let mut ui_state = UiState::new("s", Recent::none());
    let lamp = folder.path().join("lamp.IES");
    let text = "IESNA:LM-63-2002\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 10\n0 90\n0\n500 0\n";
    fs::write(&lamp, text).unwrap();
    let before = session.document.lights.len();
    actions::drop_file(&mut session, &mut ui_state, &lamp);
    let added = &session.document.lights[before];
    assert_eq!((added.light.name.as_str(), ui_state.chosen), ("lamp2", Chosen::Light(added.id)));
    assert!((added.light.luminaire.as_ref().unwrap().profile.peak_candela - 500.0).abs() < 1e-9);
    fs::write(&lamp, "a poem").unwrap();
    actions::drop_file(&mut session, &mut ui_state, &lamp);
    assert_eq!(session.document.lights.len(), before + 1);
    let eulumdat = folder.path().join("Lamp.LDT");
    fs::write(&eulumdat, include_bytes!("../../../../fuzz/corpus/luminaire/good_ldt")).unwrap();
    assert!(session.alarm.as_ref().unwrap().0.contains("is no photometric file"));
    actions::drop_file(&mut session, &mut ui_state, &eulumdat);
    let added = session.document.lights[before + 1].light.luminaire.as_ref().unwrap();
    assert!((added.profile.peak_candela - 100.0).abs() < 1e-9);
    // A scene takes the place of the open one.
    actions::drop_file(&mut session, &mut ui_state, Path::new("t.toml"));
    assert_eq!((ui_state.to_open.as_deref(), &ui_state.requests[..]), (Some("t.toml"), &[Request::Open][..]));
}
