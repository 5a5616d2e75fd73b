//! Edits of models: each picture equals that of a cold start.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::super::actions;
use super::super::films::FilmRecorder;
use super::super::session::Session;
use super::{SCENE, context, folder, open, picture, saved, settle};
use crate::cpu::sampling::hash;
use crate::gpu::Context;
use crate::renderer::Preview;
use crate::scene::film::Film;
use crate::scene::{LoadOptions, Scene};

/// An edit, a line of the scene file that it makes, and the lights afterwards.
type Edit<'a> = (&'a dyn Fn(&mut Session), &'a str, &'a [&'a str]);

/// The picture that the window shows.
fn codes(session: &Session) -> Vec<[u8; 4]> {
    session.picture().0.read().unwrap()
}

/// Direct light of the session's document, from a scene that was loaded with it.
fn direct_light(session: &Session, context: &Arc<Context>) -> Vec<[u8; 4]> {
    let own = session.text.as_ref().unwrap().models();
    let set = session.document.parts.models[1].changes(1, Some(&own[1]));
    let scene = Scene::load(&session.source.spec, &LoadOptions { set, ..LoadOptions::default() }).unwrap();
    let mut materials = scene.materials.clone();
    session.document.apply_materials(&mut materials);
    let lights: Vec<_> = session.document.lights.iter().map(|entry| entry.light.clone()).collect();
    let (camera, display) = (scene.cameras[0].clone(), session.display);
    let mut preview = Preview::new(context, scene).unwrap();
    preview.frame(&camera, &lights, &materials, display).unwrap();
    preview.display().read().unwrap()
}

#[test]
fn models_are_hidden_moved_and_added_like_a_cold_start() {
    edits_equal_cold_starts(SCENE);
}

/// The same if much of the light paths is kept.
#[test]
fn movable_models_are_hidden_moved_and_added_like_a_cold_start() {
    edits_equal_cold_starts(&SCENE.replace("panel.obj\"\n", "panel.obj\"\nmovable = true\n"));
}

fn edits_equal_cold_starts(scene: &str) {
    let (context, folder) = (context(), folder());
    fs::write(folder.path().join("s.toml"), scene).unwrap();
    let mut session = open(&context, &folder.path().join("s.toml"), |_| ());
    let first = picture(&mut session);
    let mut shown = vec![first.clone()];
    let names = |session: &Session| {
        session.document.lights.iter().map(|entry| entry.light.name.clone()).collect::<Vec<_>>()
    };
    assert_eq!(names(&session), ["lamp", "glow"]);
    let edits: [Edit<'_>; 4] = [
        (&|session| session.document.parts.models[1].is_hidden = true, "hidden = true", &["lamp"]),
        (
            &|session| {
                session.document.parts.models[1].is_hidden = false;
                session.document.parts.models[1].translation = DVec3::new(-0.25, 0.5, 0.0);
            },
            "translate = [-0.25, 0.5, 0.0]",
            &["lamp", "glow"],
        ),
        (
            &|session| {
                let middle = DVec3::new(0.0, 1.5, 0.25);
                session.document.parts.models[1].turn_about(middle, DVec3::new(0.0, 30.0, 90.0));
            },
            "rotate = [0.0, 30.0, 90.0]",
            &["lamp", "glow"],
        ),
        (
            &|session| {
                actions::add_model(session, &folder.path().join("cube.obj"));
                session.document.parts.models[2].translation = DVec3::new(0.0, -1.5, -0.5);
            },
            "cube.obj",
            &["lamp", "glow"],
        ),
    ];
    for (edit, line, lights) in edits {
        edit(&mut session);
        session.history.settle(&session.document);
        let now = picture(&mut session);
        assert_eq!(names(&session), lights, "{line}");
        let (text, expected) = saved(&context, &mut session, folder.path());
        assert!(text.contains(line), "{text}");
        assert!(now == expected, "{line}: not the picture of the saved scene");
        assert!(!shown.contains(&now), "{line}: nothing changes");
        shown.push(now);
    }
    // A model that cannot be read is taken back, and leaves no step.
    let steps = session.history.depths();
    actions::add_model(&mut session, Path::new("none.obj"));
    session.history.settle(&session.document);
    assert!(picture(&mut session) == shown[4]);
    assert_eq!((session.document.parts.models.len(), session.history.depths()), (3, steps));
    assert!(session.said.last().unwrap().starts_with("taken back: "), "{:?}", session.said);
    // A model that was added is removed.
    assert_eq!([1, 2].map(|model| session.is_added(model)), [false, true]);
    session.document.parts.models.remove(2);
    session.history.settle(&session.document);
    assert!(picture(&mut session) == shown[3]);
    session.history.undo(&mut session.document);
    // Undo goes back to each picture.
    for expected in shown[..4].iter().rev() {
        session.history.undo(&mut session.document);
        assert!(picture(&mut session) == *expected);
    }
    assert_eq!(names(&session), ["lamp", "glow"]);
}

#[test]
fn models_that_move_keep_edits_of_lights_and_materials() {
    let (context, folder) = (context(), folder());
    let mut session = open(&context, &folder.path().join("s.toml"), |_| ());
    settle(&mut session);
    session.document.lights[0].light.is_on = false;
    session.document.materials[0].diffuse = Vec3::new(0.7, 0.2, 0.2);
    session.history.settle(&session.document);
    settle(&mut session);
    let before = codes(&session);
    session.is_held = true;
    let held: Vec<_> = [-0.5, -0.25]
        .into_iter()
        .map(|x| {
            session.document.parts.models[1].translation.x = x;
            let generation = session.generation;
            settle(&mut session);
            assert_eq!(session.generation, generation, "a model that is held is not loaded");
            codes(&session)
        })
        .collect();
    assert!(held[0] != before && held[1] != held[0], "its direct light is shown");
    assert!(held[1] == direct_light(&session, &context), "as that of a scene which has it there");
    // It goes back to where it was: the picture of the light paths comes back.
    session.document.parts.models[1].translation.x = 0.0;
    settle(&mut session);
    session.is_held = false;
    settle(&mut session);
    assert!(codes(&session) == before);
    session.document.parts.models[1].translation.x = -0.25;
    session.history.settle(&session.document);
    let now = picture(&mut session);
    assert!(!session.document.lights[0].light.is_on && session.document.materials[0].diffuse.x == 0.7);
    let (_, expected) = saved(&context, &mut session, folder.path());
    assert!(now == expected, "not the picture of the saved scene");
    // The file changes under it: the moved model is one step back.
    fs::write(folder.path().join("s.toml"), SCENE.replace("0.2, 0.2, 0.2", "0.3, 0.3, 0.3")).unwrap();
    session.reload().unwrap().unwrap();
    settle(&mut session);
    assert_eq!(session.document.parts.models[1].translation, DVec3::ZERO);
    session.history.undo(&mut session.document);
    assert!(picture(&mut session) == now);
}

#[test]
fn no_model_is_added_to_a_scene_whose_models_are_unknown() {
    let (context, folder) = (context(), folder());
    let mut session = open(&context, &folder.path().join("s.toml"), |_| ());
    session.text = Err("it cannot be saved".into());
    actions::add_model(&mut session, &folder.path().join("cube.obj"));
    assert_eq!(session.document.parts.models.len(), 2);
    let (line, _) = session.alarm.as_ref().unwrap();
    assert_eq!(line, "not added: it cannot be saved");
}

#[test]
fn models_that_move_while_a_film_is_recorded_move_in_it() {
    let (context, folder) = (context(), folder());
    let mut session = open(&context, &folder.path().join("s.toml"), |_| ());
    settle(&mut session);
    let mut recorder = FilmRecorder::begin(&session);
    // The second one leaves the room: the scene has another origin then.
    for place in [DVec3::new(-0.25, 0.5, 0.0), DVec3::new(3.0, 0.0, 0.5)] {
        session.document.parts.models[1].translation = place;
        session.history.settle(&session.document);
        settle(&mut session);
        recorder.note(&session);
    }
    assert!(session.scene.origin.x > 0.5, "{}", session.scene.origin);
    let path = recorder.end(&session, folder.path().join("s.toml").to_str().unwrap()).unwrap();
    let (film, _) = Film::load(path.to_str().unwrap(), &LoadOptions::default()).unwrap();
    let last = film.frame_count - 1;
    let (film, scene) = Film::load_at(path.to_str().unwrap(), &LoadOptions::default(), last).unwrap();
    assert_eq!((scene.origin, &scene.triangles), (session.scene.origin, &session.scene.triangles));
    let state = film.state(last);
    assert!(state.camera.position.distance(session.camera.position) < 2e-3, "{:?}", state.camera);
}

/// `LIGHTPATHS_MOVES` sets the number of steps.
#[test]
fn random_moves_and_edits_end_like_a_cold_start() {
    let steps: u32 = std::env::var("LIGHTPATHS_MOVES").map_or(32, |steps| steps.parse().unwrap());
    let (context, folder) = (context(), folder());
    let mut session = open(&context, &folder.path().join("s.toml"), |_| ());
    // The paths of other materials depend on their albedo at load, which a saved scene has edited.
    session.document.materials[0].editable = true;
    session.history.settle(&session.document);
    let mut pictures = Vec::new();
    for step in 0..steps {
        let dice = hash(step ^ 0x30_7e5);
        let unit = |salt: u32| f64::from(hash(dice ^ salt) >> 8) / f64::from(1 << 24);
        // Some drags show direct light on the way.
        session.is_held = dice.is_multiple_of(3);
        let panel = &mut session.document.parts.models[1];
        match hash(dice) % 8 {
            0..=2 => panel.translation = DVec3::new(unit(1) - 0.75, 1.4 * unit(2) - 0.9, unit(3) - 0.75),
            3 => panel.turn_about(panel.translation, 360.0 * DVec3::new(unit(1), unit(2), unit(3))),
            4 => panel.is_hidden = !panel.is_hidden,
            // The bounds of the scene move with the room.
            5 => session.document.parts.models[0].translation.y = -0.1 * unit(1),
            6 => {
                let lamp =
                    session.document.lights.iter_mut().find(|entry| entry.light.name == "lamp").unwrap();
                lamp.light.kind = lamp.light.kind.with_emission(Vec3::splat(0.1 + unit(1) as f32));
            }
            _ => session.document.materials[0].diffuse = Vec3::splat(0.2 + 0.6 * unit(1) as f32),
        }
        if dice.is_multiple_of(5) {
            session.history.settle(&session.document);
            session.history.undo(&mut session.document);
        }
        // Most edits do not wait for the picture of the one before.
        if let Some(commands) = session.update().unwrap() {
            session.check(&commands.submit().unwrap()).unwrap();
        }
        session.is_held = false;
        session.history.settle(&session.document);
        if step % 8 == 7 || step + 1 == steps {
            let now = picture(&mut session);
            assert!(session.alarm.is_none(), "step {step}: {:?}", session.said);
            let (text, expected) = saved(&context, &mut session, folder.path());
            assert!(now == expected, "step {step}: not the picture of\n{text}");
            pictures.push(now);
        }
    }
    assert!(pictures.windows(2).any(|pair| pair[0] != pair[1]), "edits change pictures");
}
