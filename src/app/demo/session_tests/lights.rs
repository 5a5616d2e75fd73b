//! Lights that are dimmed, and measured.

use std::collections::HashSet;
use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::super::meters::fresh;
use super::super::painting::paint;
use super::super::recent::Recent;
use super::super::session::Session;
use super::super::ui_state::{Place, UiState};
use super::{context, folder, open, picture, saved, settle};
use crate::app::false_colours::values;
use crate::gpu::Context;
use crate::renderer::{Layer, Measured, Reading, Renderer, Silent};
use crate::scene::meter::Meter;
use crate::scene::{LoadOptions, Scene};

/// Renders what is due once; false if nothing is.
fn step(session: &mut Session) -> bool {
    let Some(commands) = session.update().unwrap() else { return false };
    session.check(&commands.submit().unwrap()).unwrap();
    session.end_frames(0).unwrap();
    true
}

#[test]
fn lights_that_a_drag_dims_are_mixed_until_it_ends() {
    let (context, folder) = (context(), folder());
    let mut session = open(&context, &folder.path().join("s.toml"), |_| ());
    let first = picture(&mut session);
    (session.is_held, session.may_mix) = (true, true);
    let emission = session.document.lights[0].light.kind.emission();
    let mut dimmed = Vec::new();
    for (index, gain) in [0.9, 0.5, 0.1, 0.3].into_iter().enumerate() {
        let kind = session.document.lights[0].light.kind;
        session.document.lights[0].light.kind = kind.with_emission(gain * emission);
        let before = context.command_counts();
        assert!(step(&mut session) && !step(&mut session), "each step is shown once");
        // A frame at the first step, then only its display.
        let dispatches = (context.command_counts() - before).dispatches;
        assert!(if index == 0 { dispatches > 5 } else { dispatches == 1 }, "step {index}: {dispatches}");
        dimmed.push(session.renderer().unwrap().display().unwrap());
    }
    session.is_held = false;
    assert!(step(&mut session) && !step(&mut session), "a frame follows the drag");
    let shown = session.renderer().unwrap().display().unwrap();
    let differ = |a: &[[u8; 4]], by: u8| {
        a.as_flattened().iter().zip(shown.as_flattened()).filter(|(a, b)| a.abs_diff(**b) > by).count()
    };
    assert_eq!(differ(&dimmed[3], 1), 0, "the mix of the last step shows the frame");
    assert!(differ(&dimmed[2], 1) > shown.len(), "other steps have other pictures");
    assert!(shown == saved(&context, &mut session, folder.path()).1, "the bytes of a cold start");

    // Edits in a drag that dim nothing are frames, and so is undo.
    session.is_held = true;
    session.document.lights[0].light.kind = session.document.lights[0].light.kind.with_emission(emission);
    assert!(step(&mut session));
    session.document.materials[0].diffuse = Vec3::splat(0.2);
    assert!(step(&mut session));
    let mut other = open(&context, &folder.path().join("s.toml"), |_| ());
    other.document = session.document.clone();
    let expected = picture(&mut other);
    assert!(session.renderer().unwrap().display().unwrap() == expected, "the bytes without a drag");
    session.is_held = false;
    session.document.materials[0].diffuse = session.scene.materials[0].diffuse;
    assert!(picture(&mut session) == first);
}

/// What the meters of a scene read after a cold start.
fn readings_of(context: &Arc<Context>, scene: Scene) -> Vec<Reading> {
    let mut cold = Renderer::new(context, scene, &mut Silent).unwrap();
    cold.frame().unwrap();
    let points = cold.measured().unwrap();
    Measured::by_meter(cold.scene(), &points).into_iter().map(Reading::new).collect()
}

#[test]
fn meters_are_read_saved_and_given_what_they_want() {
    let (context, folder) = (context(), folder());
    let mut session = open(&context, &folder.path().join("s.toml"), |_| ());
    let first = picture(&mut session);
    let floor = ((DVec3::new(-0.4, 0.0, 0.2) - session.scene.origin).as_vec3(), Vec3::Y);
    for is_plane in [true, false] {
        let meter = fresh(&session.document.meters, floor, 3.0, is_plane);
        session.document.meters.push(meter);
        session.history.settle(&session.document);
    }
    assert!(!session.follow_readings().unwrap(), "there are no gather rays of meters yet");
    assert!(picture(&mut session) == first, "meters change no picture");
    assert!(session.follow_readings().unwrap() && !session.follow_readings().unwrap(), "read once");
    let read = session.readings().to_vec();
    assert!(read.len() == 2 && read[0].min > 0.0 && read[0].max > read[0].mean, "{read:?}");

    let (text, _) = saved(&context, &mut session, folder.path());
    assert!(!session.has_unsaved_edits() && text.contains("[[meter]]"), "{text}");
    let scene = Scene::load(folder.path().join("saved.toml").to_str().unwrap(), &LoadOptions::default());
    let scene = scene.unwrap();
    assert_eq!(scene.meters, session.document.meters);
    assert_eq!(read, readings_of(&context, scene));

    // The lamp and the panel together give what is wanted, as one undo step.
    let (all, none) = (session.document.lights.iter().map(|entry| entry.id).collect(), HashSet::new());
    let wanted = [(0, 1.5 * read[0].mean)];
    assert!(session.find_powers(&wanted, &all).is_err() && session.find_powers(&[], &none).is_err());
    let steps = session.history.depths()[0];
    let said = session.find_powers(&wanted, &none).unwrap();
    assert!(said.len() == 1 && !said[0].contains("not reachable"), "{said:?}");
    assert_eq!(session.history.depths()[0], steps + 1);
    settle(&mut session);
    session.follow_readings().unwrap();
    let found = session.readings()[0].mean / wanted[0].1;
    assert!((found - 1.0).abs() < 0.02, "{found}");
    session.history.undo(&mut session.document);
    assert!(picture(&mut session) == first, "undone");
    // No light is too strong: a target that lights which stay exceed is missed, and said.
    let panel: HashSet<u64> = session.document.lights[1..].iter().map(|entry| entry.id).collect();
    let said = session.find_powers(&[(0, 1e-3 * read[0].mean)], &panel).unwrap();
    assert!(said[0].contains("not reachable"), "{said:?}");
}

#[test]
fn regions_are_painted_erased_saved_and_given_what_they_want() {
    let (context, folder) = (context(), folder());
    let mut session = open(&context, &folder.path().join("s.toml"), |_| ());
    let first = picture(&mut session);
    let mut ui_state = UiState::new("s.toml", Recent::none());
    let origin = session.scene.origin;
    let place = |x: f64, y: f64, z: f64, normal| Place {
        position: (DVec3::new(x, y, z) - origin).as_vec3(),
        normal,
        material: 0,
    };
    // Across an edge: floor and wall. A second stroke over the first adds nothing.
    let floor: Vec<Place> =
        (0..20).map(|step| place(-0.9 + 0.05 * f64::from(step), 0.0, 0.2, Vec3::Y)).collect();
    let wall: Vec<Place> = (0..20).map(|step| place(-1.0, 0.05 * f64::from(step), 0.2, Vec3::X)).collect();
    session.paints = true;
    for stroke in [&floor, &wall, &floor] {
        paint(&mut session, &mut ui_state, stroke, false);
        session.history.settle(&session.document);
    }
    let counts = |session: &Session| session.document.meters.iter().map(Meter::count).collect::<Vec<_>>();
    let all = counts(&session);
    assert!(all.len() == 1 && (20..=40).contains(&all[0]), "{all:?}");
    assert_eq!(session.history.depths()[0], 2, "a stroke that adds nothing is no step");
    let points = session.document.meters[0].points();
    let nearest = |index: usize| {
        let others = points.iter().enumerate().filter(|(other, _)| *other != index);
        others.map(|(_, (at, _))| at.distance(points[index].0)).fold(f32::MAX, f32::min)
    };
    assert!((0..points.len()).all(|index| (0.05..0.15).contains(&nearest(index))), "evenly spaced");
    paint(&mut session, &mut ui_state, &wall[10..], true);
    session.history.settle(&session.document);
    assert!(counts(&session)[0] < all[0], "erased");
    let generation = session.generation;
    assert!(picture(&mut session) == first && session.generation == generation, "not measured while painted");
    session.paints = false;
    assert!(picture(&mut session) == first && session.follow_readings().unwrap());
    let read = session.readings().to_vec();
    assert!(session.generation > generation && read[0].min > 0.0, "{read:?}");

    let (text, _) = saved(&context, &mut session, folder.path());
    assert!(text.contains("kind = \"region\""), "{text}");
    let file = folder.path().join("saved.toml");
    let scene = Scene::load(file.to_str().unwrap(), &LoadOptions::default()).unwrap();
    assert_eq!(scene.meters, session.document.meters);
    assert_eq!(read, readings_of(&context, scene));

    let wanted = [(0, 0.5 * read[0].mean)];
    session.find_powers(&wanted, &HashSet::new()).unwrap();
    settle(&mut session);
    session.follow_readings().unwrap();
    let found = session.readings()[0].mean / wanted[0].1;
    assert!((found - 1.0).abs() < 0.02, "{found}");
    // What is erased whole is gone.
    paint(&mut session, &mut ui_state, &[&floor[..], &wall].concat(), true);
    assert!(session.document.meters.is_empty() && ui_state.meters.chosen.is_none());
    paint(&mut session, &mut ui_state, &[], false);
    assert!(session.document.meters.is_empty(), "beside the scene");
}

#[test]
fn contributions_of_lights_add_up_to_the_illuminance_and_change_no_picture() {
    let (context, folder) = (context(), folder());
    let mut session = open(&context, &folder.path().join("s.toml"), |_| ());
    assert!(!session.follow_contributions().unwrap(), "no light paths yet");
    let first = picture(&mut session);
    let whole = values(&session.renderer().unwrap().layer(Layer::Irradiance).unwrap());
    assert!(session.contributions().is_empty());
    assert!(session.follow_contributions().unwrap());
    assert!(picture(&mut session) == first, "the picture is shown again");
    assert!(!session.follow_contributions().unwrap(), "found once");
    let names: Vec<&str> = session.contributions().iter().map(|one| one.light.as_str()).collect();
    assert_eq!(names, ["lamp", "glow"]);
    for (pixel, whole) in whole.iter().enumerate() {
        let sum: f64 = session.contributions().iter().map(|one| f64::from(one.lux[pixel])).sum();
        assert!((sum - whole).abs() < 2e-3 * whole.max(1.0), "{pixel}: {sum} of {whole} lx");
    }
    // A light that is off contributes nothing, and dimmed ones are those of the new picture.
    session.document.lights[1].light.is_on = false;
    session.history.settle(&session.document);
    settle(&mut session);
    assert!(session.contributions().is_empty(), "those of another picture");
    assert!(session.follow_contributions().unwrap());
    settle(&mut session);
    assert_eq!(session.contributions().len(), 1);
    session.is_held = true;
    session.document.lights[1].light.is_on = true;
    settle(&mut session);
    assert!(!session.follow_contributions().unwrap(), "not while something moves");
}
