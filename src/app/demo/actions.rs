//! The actions that keys are bound to.

use std::path::Path;

use super::dialogs::{IMAGES, LUMINAIRES, OTHER_IMAGES, PANORAMAS, Purpose};
use super::images::choose_image;
use super::light_edit::{self, LightEdit};
use super::navigate;
use super::panels::{fresh_light, middle_of_view};
use super::placing;
use super::session::Session;
use super::shortcuts::Action;
use super::ui_state::{Beside, Chosen, Request, UiState, View};
use super::viewport::Viewport;
use crate::app::false_colours::Quantity;
use crate::scene::luminaire::Luminaire;
use crate::scene::save::PlacedModel;
use crate::scene::{Camera, Light, ToneCurve};

/// Applies one action to the session.
pub(super) fn act(action: Action, session: &mut Session, ui_state: &mut UiState, viewport: &mut Viewport) {
    let (size, chosen) = (session.camera.size, ui_state.chosen_lights());
    match action {
        Action::Help => ui_state.shows_help = !ui_state.shows_help,
        Action::Panels => ui_state.shows_panels = !ui_state.shows_panels,
        Action::Undo | Action::Redo => {
            // Otherwise the drag would restore the edited value in the next frame.
            viewport.let_go();
            let history = &mut session.history;
            let document = &mut session.document;
            if action == Action::Undo {
                history.undo(document)
            } else {
                history.redo(document)
            };
        }
        Action::Open => ui_state.requests.push(Request::Ask(Purpose::Open)),
        Action::SaveAs => ui_state.requests.push(Request::Ask(Purpose::Save)),
        Action::Save => ui_state.requests.push(Request::Save),
        Action::Screenshot => ui_state.requests.push(Request::Screenshot),
        Action::Layers => ui_state.requests.push(Request::Layers),
        Action::Record => ui_state.requests.push(Request::Record),
        Action::Play => ui_state.requests.push(Request::Play),
        Action::Vsync => ui_state.requests.push(Request::Vsync),
        Action::Fullscreen => ui_state.requests.push(Request::Fullscreen),
        Action::Memory => ui_state.requests.push(Request::Memory),
        Action::Settled => ui_state.requests.push(Request::Settled),
        Action::Quit => ui_state.requests.push(Request::Quit),
        Action::QuitAnyway => ui_state.requests.push(Request::QuitAnyway),
        Action::Beauty => ui_state.view = View::Beauty,
        Action::Direct => ui_state.view = View::Direct,
        Action::Indirect => ui_state.view = View::Indirect,
        Action::CachePoints => ui_state.view = View::CachePoints,
        Action::Cells => ui_state.view = next_level(ui_state.view, session),
        Action::Inspect => ui_state.view = View::Inspect,
        Action::FalseColours => {
            let quantity = match ui_state.view {
                View::FalseColours(Quantity::Lux) => Quantity::Nits,
                _ => Quantity::Lux,
            };
            (ui_state.view, ui_state.light_range) = (View::FalseColours(quantity), None);
        }
        Action::Split if ui_state.shows_monte_carlo() => ui_state.split = None,
        Action::Split => ui_state.toggle_beside(Beside::MonteCarlo),
        Action::ShowError => {
            let is_shown = ui_state.split.is_some() && ui_state.beside == Beside::Error;
            ui_state.beside = if is_shown { Beside::MonteCarlo } else { Beside::Error };
            ui_state.split = ui_state.split.or(Some(0.5));
        }
        Action::Snapshot => ui_state.requests.push(Request::Snapshot),
        Action::SplitSnapshot => match session.snapshots.newest().map(|newest| newest.id) {
            _ if ui_state.snapshot_beside().is_some() => ui_state.split = None,
            Some(newest) => ui_state.toggle_beside(Beside::Snapshot(newest)),
            None => session.alarm("there is no snapshot: N keeps one".to_owned()),
        },
        Action::ContactSheet => ui_state.requests.push(Request::ContactSheet),
        Action::Histogram => ui_state.shows_histogram = !ui_state.shows_histogram,
        Action::Zebra => ui_state.shows_zebra = !ui_state.shows_zebra,
        Action::FrameAll => {
            let (low, high) = session.scene.bounds();
            navigate::frame_box(&mut session.camera, low, high);
        }
        Action::ResetCamera => session.camera = Camera { size, ..session.scene.cameras[0].clone() },
        Action::AddLight => {
            let light = fresh_light(session, "point");
            let place = session.document.add(light);
            ui_state.choose(Chosen::Light(session.document.lights[place].id));
        }
        Action::RemoveLight => placing::remove(session, ui_state, &chosen),
        Action::DuplicateLight => placing::duplicate(session, ui_state, &chosen),
        Action::SnapLight => ui_state.snaps_light = true,
        Action::SwitchLight => {
            let mut lights = session.document.lights.iter();
            let primary = chosen.first().and_then(|id| lights.find(|entry| entry.id == *id));
            if let Some(is_on) = primary.map(|entry| entry.light.is_on) {
                light_edit::edit(&mut session.document, &chosen, &LightEdit::On(!is_on));
            }
        }
        Action::Brighter => session.expose(session.display.exposure_stops + 0.5),
        Action::Darker => session.expose(session.display.exposure_stops - 0.5),
        Action::FollowExposure => session.follow_exposure(!session.follows_exposure()),
        Action::NextTone => {
            let next = (session.display.tone.code() as usize + 1) % ToneCurve::ALL.len();
            session.display.tone = ToneCurve::ALL[next];
        }
        Action::Larger => ui_state.text_scale = (ui_state.text_scale * 1.1).min(3.0),
        Action::Smaller => ui_state.text_scale = (ui_state.text_scale / 1.1).max(0.5),
    }
}

fn next_level(view: View, session: &Session) -> View {
    let levels = session.renderer().map_or(1, crate::renderer::Renderer::hvds_level_count);
    match view {
        View::Cells(level) => View::Cells((level + 1) % levels.max(1)),
        _ => View::Cells(0),
    }
}

/// Adds the model of a file where the file puts it. Refused if the scene's own models are unknown,
/// because the new one would take the place of the first.
pub(super) fn add_model(session: &mut Session, path: &Path) {
    if let Err(why) = &session.text {
        session.alarm(format!("not added: {why}"));
        return;
    }
    // Relative paths would count from the scene file.
    let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    session.document.parts.models.push(PlacedModel::of_file(&path.to_string_lossy()));
}

/// Takes the file that was dropped on the window: opens a scene, adds a luminaire or a
/// model, or takes an image as the sky or as that of the chosen material.
pub(super) fn drop_file(session: &mut Session, ui_state: &mut UiState, path: &Path) {
    let is_scene = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    take_file(session, ui_state, if is_scene { Purpose::Open } else { Purpose::Add }, path);
}

/// Takes the file that the user has chosen.
pub(super) fn take_file(session: &mut Session, ui_state: &mut UiState, purpose: Purpose, path: &Path) {
    match purpose {
        Purpose::Open => {
            ui_state.to_open = Some(path.to_string_lossy().into_owned());
            ui_state.requests.push(Request::Open);
        }
        Purpose::Save => {
            ui_state.save_to = path.to_string_lossy().into_owned();
            ui_state.requests.push(Request::Save);
        }
        Purpose::Add => add_file(session, ui_state, path),
        Purpose::Sky => choose_sky(session, path),
        Purpose::Image => choose_image(session, &ui_state.chosen, path),
    }
}

/// Whether the name of a file has one of these endings.
fn is_one_of(path: &Path, endings: &[&str]) -> bool {
    let extension = path.extension().and_then(|extension| extension.to_str());
    extension.is_some_and(|own| endings.iter().any(|ending| own.eq_ignore_ascii_case(ending)))
}

/// Makes an image the sky of the scene.
fn choose_sky(session: &mut Session, path: &Path) {
    if let Err(why) = &session.text {
        session.alarm(format!("the sky stays: {why}"));
        return;
    }
    // Relative paths would count from the scene file.
    let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    session.document.parts.sky_image = Some(path.to_string_lossy().into_owned());
}

/// Adds a luminaire, a sky, the image of the chosen material, or a model.
fn add_file(session: &mut Session, ui_state: &mut UiState, path: &Path) {
    if is_one_of(path, &LUMINAIRES) {
        add_luminaire(session, ui_state, path);
    } else if is_one_of(path, &PANORAMAS) {
        choose_sky(session, path);
    } else if is_one_of(path, &[&IMAGES[..], &OTHER_IMAGES].concat()) {
        choose_image(session, &ui_state.chosen, path);
    } else {
        add_model(session, path);
    }
}

/// Adds a luminaire in the middle of the view, and chooses it.
pub(super) fn add_luminaire(session: &mut Session, ui_state: &mut UiState, path: &Path) {
    // Relative paths would count from the scene file.
    let path = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    let luminaire = match Luminaire::open(&path) {
        Ok(luminaire) => luminaire,
        Err(why) => return session.alarm(format!("not added: {why}")),
    };
    let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let place = session.document.add(Light::measured(name, luminaire, middle_of_view(session)));
    ui_state.choose(Chosen::Light(session.document.lights[place].id));
}
