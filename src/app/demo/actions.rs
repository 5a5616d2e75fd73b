//! What keys ask for.

use super::desk::{Chosen, Desk, Request, View};
use super::navigate;
use super::panels::fresh_light;
use super::session::Session;
use super::shortcuts::Action;
use super::viewport::Viewport;
use crate::scene::Camera;

/// Does it.
pub(super) fn act(action: Action, session: &mut Session, desk: &mut Desk, viewport: &mut Viewport) {
    let size = session.camera.size;
    match action {
        Action::Help => desk.shows_help = !desk.shows_help,
        Action::Panels => desk.shows_panels = !desk.shows_panels,
        Action::Undo | Action::Redo => {
            // What is being dragged would come back at once.
            viewport.let_go();
            let history = &mut session.history;
            let document = &mut session.document;
            if action == Action::Undo {
                history.undo(document)
            } else {
                history.redo(document)
            };
        }
        Action::Save => desk.requests.push(Request::Save),
        Action::Screenshot => desk.requests.push(Request::Screenshot),
        Action::Record => desk.requests.push(Request::Record),
        Action::Play => desk.requests.push(Request::Play),
        Action::Vsync => desk.requests.push(Request::Vsync),
        Action::Fullscreen => desk.requests.push(Request::Fullscreen),
        Action::Memory => desk.requests.push(Request::Memory),
        Action::Settled => desk.requests.push(Request::Settled),
        Action::Quit => desk.requests.push(Request::Quit),
        Action::Beauty => desk.view = View::Beauty,
        Action::Direct => desk.view = View::Direct,
        Action::Indirect => desk.view = View::Indirect,
        Action::CachePoints => desk.view = View::CachePoints,
        Action::Cells => desk.view = next_level(desk.view, session),
        Action::Inspect => desk.view = View::Inspect,
        Action::Split => desk.split = if desk.split.is_some() { None } else { Some(0.5) },
        Action::FrameAll => {
            let (low, high) = session.scene.bounds();
            navigate::frame_box(&mut session.camera, low, high);
        }
        Action::ResetCamera => session.camera = Camera { size, ..session.scene.cameras[0].clone() },
        Action::AddLight => {
            let light = fresh_light(session, "point");
            let place = session.document.add(light);
            desk.chosen = Chosen::Light(session.document.lights[place].id);
        }
        Action::RemoveLight => {
            if let Chosen::Light(chosen) = desk.chosen {
                session.document.lights.retain(|entry| entry.id != chosen);
                desk.chosen = Chosen::Nothing;
            }
        }
        Action::SwitchLight => {
            if let Chosen::Light(chosen) = desk.chosen {
                let light = session.document.lights.iter_mut().find(|entry| entry.id == chosen);
                light.into_iter().for_each(|entry| entry.light.is_on = !entry.light.is_on);
            }
        }
        Action::Brighter => session.exposure_stops += 0.5,
        Action::Darker => session.exposure_stops -= 0.5,
        Action::Larger => desk.text_scale = (desk.text_scale * 1.1).min(3.0),
        Action::Smaller => desk.text_scale = (desk.text_scale / 1.1).max(0.5),
    }
}

fn next_level(view: View, session: &Session) -> View {
    let levels = session.renderer().map_or(1, crate::renderer::Renderer::hvds_level_count);
    match view {
        View::Cells(level) => View::Cells((level + 1) % levels.max(1)),
        _ => View::Cells(0),
    }
}
