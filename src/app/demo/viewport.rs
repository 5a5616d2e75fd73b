//! The picture, and its pointer and key input.

use std::time::Instant;

use egui::{CentralPanel, Frame, Key, Modifiers, PointerButton, Rect, Response, Sense, Ui};
use glam::{Vec2, Vec3};

use super::canvas::{Textures, draw, framed};
use super::choice::released;
use super::coarse::{Coarse, Motion};
use super::gizmos::{Drag, Part, Projection, TOLERANCE, hit, of_light};
use super::meter_marks;
use super::model_gizmo::{self, ModelDrag};
use super::navigate::{self, Held};
use super::overlays;
use super::painting;
use super::panels::PALETTE;
use super::placing::{self, scene_size as size, surface};
use super::session::Session;
use super::ui_state::{Chosen, UiState, View};
use crate::error::Result;
use crate::scene::{Camera, LightKind};

/// Time of constant window size after which the picture is resized, seconds: a new size
/// renders from scratch.
const PATIENCE_S: f64 = 0.15;
/// Time without movement after which a large scene shows moved models, seconds.
const REST_S: f32 = 0.1;
/// Range of a picture's width and height, pixels.
const SIDES: [u32; 2] = [16, 8192];
/// Largest distance between a click and a light's mark, points.
const MARK: f32 = 10.0;
/// Camera turn per point of pointer movement, radians.
const TURN: f32 = 0.006;
/// Fraction of the distance that remains per point of the wheel.
const WHEEL: f32 = 0.996;
/// Snap step of gizmos with Ctrl, in scene sizes.
const SNAP: f32 = 0.01;
/// Speed of the flying camera, scene sizes a second.
const SPEED: f32 = 0.2;

/// Interaction state of the picture.
pub(super) struct Viewport {
    /// The size that the picture should take, and the time of that request.
    size: ([u32; 2], Instant),
    coarse: Coarse,
    /// By what the size is divided.
    divisor: u32,
    hold: Option<Hold>,
    /// Pointer position at the last movement of the held part.
    pointer: Vec2,
    /// Position of gizmos of lights at infinity; fixed during a drag.
    anchor: Vec3,
}

/// The object that the pointer holds.
enum Hold {
    /// A gizmo, the identifier of its light, and the other chosen lights at the start.
    Gizmo(Drag, u64, Vec<(u64, LightKind)>),
    Orbit(Vec3),
    Pan(f32),
    Look,
    Wipe,
    /// The brush of a light meter's region.
    Brush,
    Model(Box<ModelDrag>),
}

impl Viewport {
    /// Ends the pointer's drag.
    pub(super) fn let_go(&mut self) {
        self.hold = None;
    }

    pub(super) fn new() -> Self {
        Self {
            size: ([0, 0], Instant::now()),
            coarse: Coarse::new(),
            divisor: 1,
            hold: None,
            pointer: Vec2::ZERO,
            anchor: Vec3::ZERO,
        }
    }

    /// Draws the picture in the area that the panels leave, and gizmos its input.
    pub(super) fn show(
        &mut self,
        ui: &mut Ui,
        session: &mut Session,
        ui_state: &mut UiState,
        overlays: &mut overlays::Overlays,
        textures: Textures,
    ) -> Result<()> {
        let shown = CentralPanel::default().frame(Frame::NONE).show(ui, |ui| {
            let area = ui.max_rect();
            let response = ui.allocate_rect(area, Sense::click_and_drag());
            let flies = self.fly(ui, session, ui_state);
            self.fit(ui, session, ui_state, (area, flies));
            let area = framed(area, session.picture().1);
            let projection = projection(&session.camera, area);
            self.take(ui, &response, projection, session, ui_state)?;
            self.drag(ui, &response, session, ui_state, area)?;
            self.wheel(ui, &response, session, ui_state)?;
            draw(ui, area, textures, ui_state.split);
            let projection = self::projection(&session.camera, area);
            overlays.paint(ui, projection, area, session, ui_state)?;
            if ui_state.meters.is_open {
                meter_marks::paint(&ui.painter_at(area), projection, session, ui_state.meters.chosen);
            }
            if let Some(pointer) = response.hover_pos().filter(|_| ui_state.meters.paints) {
                ui.painter_at(area).circle_stroke(pointer, painting::BRUSH, (1.5, PALETTE[1]));
            }
            self.draw_lights(ui, &response, projection, session, ui_state);
            overlays::marks(&ui.painter_at(response.rect), response.rect, &self.marks(session, ui_state));
            Ok(())
        });
        shown.inner
    }

    /// Resizes the picture to its area once the area is constant. While the user moves something
    /// and frames are slow, the picture has fewer pixels.
    fn fit(&mut self, ui: &Ui, session: &mut Session, ui_state: &UiState, (area, flies): (Rect, bool)) {
        let pixels = ui.ctx().pixels_per_point() * ui_state.scale;
        let side = |points: f32| ((points * pixels).round() as u32).clamp(SIDES[0], SIDES[1]);
        let size = [side(area.width()), side(area.height())];
        if self.size.0 != size {
            let is_first = self.size.0 == [0, 0];
            // The new size may fit the device.
            session.refused_size = None;
            self.size = (size, Instant::now());
            if is_first {
                session.camera.size = size;
            }
        }
        self.divisor = self.divisor_of(ui, session, ui_state, flies);
        let size = self.divided();
        if session.camera.size != size && session.refused_size != Some(size) {
            let waited = self.size.1.elapsed().as_secs_f64();
            if waited >= PATIENCE_S {
                session.camera.size = size;
            } else {
                ui.ctx().request_repaint_after_secs((PATIENCE_S - waited) as f32);
            }
        }
    }

    /// The size of the picture while it is coarse, or its full size.
    fn divided(&self) -> [u32; 2] {
        self.size.0.map(|side| (side / self.divisor).max(SIDES[0]))
    }

    /// By what the width and the height of the picture are divided.
    fn divisor_of(&mut self, ui: &Ui, session: &Session, ui_state: &UiState, flies: bool) -> u32 {
        // Mixed pictures are fast at every size, and films are shown as they are.
        if session.is_mixed() {
            return self.divisor;
        }
        if ui_state.is_playing || !ui_state.coarsens {
            self.coarse = Coarse::new();
            return 1;
        }
        let (holds, turns) =
            ui.input(|input| (input.pointer.any_down(), input.smooth_scroll_delta() != egui::Vec2::ZERO));
        let ms = session.costs.back().map_or(0.0, |cost| cost.frame_ms);
        let (motion, now) =
            (Motion { holds, moves: flies || turns, frames: (session.frames, ms) }, Instant::now());
        let divisor = self.coarse.follow(motion, now);
        if let Some(rest) = self.coarse.rests_in(now) {
            ui.ctx().request_repaint_after(rest);
        }
        divisor
    }

    /// What the picture lacks, and what runs beside it.
    fn marks(&self, session: &Session, ui_state: &UiState) -> Vec<String> {
        let mut marks = Vec::new();
        if ui_state.is_recording {
            marks.push("● recording".to_owned());
        }
        if ui_state.meters.paints {
            marks.push("painting a region: drag over surfaces, with Ctrl to erase".to_owned());
        }
        if self.divisor > 1 {
            marks.push(format!("1/{} of the width and height while you move", self.divisor));
        }
        if let Some(progress) = session.progress().filter(|_| !ui_state.shows_panels) {
            marks.push(format!(
                "{}, {:.0} %",
                progress.estimate.words(),
                100.0 * progress.estimate.fraction()
            ));
        }
        marks
    }

    /// Whether the picture has the size of its area, or the device refused that size.
    pub(super) fn fits(&self, session: &Session) -> bool {
        let size = self.divided();
        session.camera.size == size || session.refused_size == Some(size)
    }

    /// Moves the camera by the held keys. Returns whether it did.
    fn fly(&self, ui: &Ui, session: &mut Session, ui_state: &UiState) -> bool {
        if ui.ctx().egui_wants_keyboard_input() || ui_state.is_in_dialog {
            return false;
        }
        let (held, seconds) = ui.input(|input| {
            let down = |key| input.key_down(key) && !input.modifiers.command;
            let held = Held {
                forward: down(Key::W) || input.key_down(Key::ArrowUp),
                back: down(Key::S) || input.key_down(Key::ArrowDown),
                left: down(Key::A) || input.key_down(Key::ArrowLeft),
                right: down(Key::D) || input.key_down(Key::ArrowRight),
                up: down(Key::E),
                down: down(Key::Q),
                fast: input.modifiers.shift,
            };
            (held, input.stable_dt)
        });
        let step = held.step(seconds, SPEED * size(session));
        let flies = step != Vec3::ZERO && !ui_state.is_playing;
        if flies {
            navigate::fly(&mut session.camera, step);
            ui.ctx().request_repaint();
        }
        flies
    }

    /// Starts a drag where the pointer is pressed, or chooses the clicked item.
    fn take(
        &mut self,
        ui: &Ui,
        response: &Response,
        projection: Projection,
        session: &mut Session,
        ui_state: &mut UiState,
    ) -> Result<()> {
        let modifiers = ui.input(|input| input.modifiers);
        if response.clicked_by(PointerButton::Primary)
            // The release event has the clicked point; the pointer may have moved since.
            && let Some((pointer, modifiers)) = ui.input(|input| input.events.iter().find_map(released))
            // egui gives a click to the item under the last position of its frame.
            && response.rect.contains(pointer)
        {
            if ui_state.meters.paints {
                let area = framed(response.rect, session.picture().1);
                let (way, seen) = ((vec(pointer), vec(pointer)), self::projection(&session.camera, area));
                painting::brush(way, (area, seen), modifiers.command, session, ui_state)?;
            } else if modifiers.command && modifiers.shift {
                let place = surface(session, projection, vec(pointer))?;
                placing::aim(session, ui_state, place, self.anchor);
            } else {
                self.choose((vec(pointer), modifiers), projection, session, ui_state)?;
            }
        }
        if std::mem::take(&mut ui_state.snaps_light) {
            let pointer = response.hover_pos();
            let place = pointer.map_or(Ok(None), |pointer| surface(session, projection, vec(pointer)))?;
            placing::snap(session, ui_state, place);
        }
        if !response.drag_started() {
            return Ok(());
        }
        let Some(start) = ui.input(|input| input.pointer.press_origin()).map(vec) else { return Ok(()) };
        let seen = surface(session, projection, start)?;
        let pivot = seen.map_or(session.camera.target, |place| place.position);
        self.pointer = start;
        let depth = (pivot - projection.eye()).dot(projection.forward()).max(1e-3 * size(session));
        let is_primary = response.drag_started_by(PointerButton::Primary);
        let on_wipe = ui_state.split.is_some_and(|wipe| {
            (response.rect.left() + wipe * response.rect.width() - start.x).abs() < TOLERANCE
        });
        if is_primary
            && !ui_state.meters.paints
            && let Some(drag) = model_gizmo::begin(&projection, session, ui_state.chosen, start)
        {
            self.hold = Some(Hold::Model(Box::new(drag)));
            return Ok(());
        }
        let part = self.part_at(start, projection, session, ui_state).filter(|_| !ui_state.meters.paints);
        self.hold = Some(match part {
            Some((part, id)) if is_primary => {
                let lights = &session.document.lights;
                let kind = lights.iter().find(|entry| entry.id == id);
                let Some(kind) = kind.map(|entry| entry.light.kind) else { return Ok(()) };
                let others = lights.iter().filter(|entry| entry.id != id && ui_state.has_chosen(entry.id));
                let others = others.map(|entry| (entry.id, entry.light.kind)).collect();
                Hold::Gizmo(Drag::begin(&projection, &kind, part, self.anchor, start), id, others)
            }
            _ if is_primary && on_wipe => Hold::Wipe,
            _ if is_primary && ui_state.meters.paints => Hold::Brush,
            _ if response.drag_started_by(PointerButton::Middle) || modifiers.shift => Hold::Pan(depth),
            _ if response.drag_started_by(PointerButton::Secondary) || modifiers.command => Hold::Look,
            _ => Hold::Orbit(pivot),
        });
        Ok(())
    }

    /// Moves the held part.
    fn drag(
        &mut self,
        ui: &Ui,
        response: &Response,
        session: &mut Session,
        ui_state: &mut UiState,
        area: Rect,
    ) -> Result<()> {
        let released = ui.input(|input| input.events.iter().find_map(released));
        // A released part stays at the point of release, even if the pointer has moved since.
        let pointer = match released.filter(|_| response.drag_stopped()) {
            Some((released, _)) => Some(released),
            None if response.dragged() => response.interact_pointer_pos(),
            None => None,
        };
        let Some(pointer) = pointer else {
            if !ui.input(|input| input.pointer.any_down()) {
                self.hold = None;
            }
            return Ok(());
        };
        let before = std::mem::replace(&mut self.pointer, vec(pointer));
        let moved = vec(pointer) - before;
        let modifiers = ui.input(|input| input.modifiers);
        let snap = modifiers.command.then_some(SNAP * size(session));
        let camera = &mut session.camera;
        match &self.hold {
            Some(Hold::Gizmo(drag, id, others)) => {
                let kind = drag.to(&projection(camera, area), vec(pointer), snap);
                placing::drag(&mut session.document, (*id, kind), others, drag.offset(&kind));
            }
            Some(Hold::Model(drag)) => {
                drag.to(&projection(camera, area), vec(pointer), snap, &mut session.document);
                if session.awaits_rest() {
                    ui.ctx().request_repaint_after_secs(REST_S);
                }
            }
            Some(Hold::Wipe) => {
                ui_state.split = Some(((pointer.x - area.left()) / area.width().max(1.0)).clamp(0.0, 1.0));
            }
            Some(Hold::Orbit(pivot)) => navigate::orbit(camera, *pivot, TURN * moved),
            Some(Hold::Pan(depth)) => navigate::pan(camera, moved, area.height(), *depth),
            Some(Hold::Look) => navigate::look(camera, -TURN * moved),
            Some(Hold::Brush) => {
                let (way, seen) = ((before, vec(pointer)), projection(camera, area));
                painting::brush(way, (area, seen), modifiers.command, session, ui_state)?;
            }
            None => (),
        }
        if !response.dragged() {
            self.hold = None;
        }
        Ok(())
    }

    /// Moves the camera closer or away: wheel, two fingers, pinch.
    fn wheel(&self, ui: &Ui, response: &Response, session: &mut Session, ui_state: &UiState) -> Result<()> {
        let Some(pointer) = response.hover_pos().filter(|_| !ui_state.is_playing) else { return Ok(()) };
        let (scroll, pinch) = ui.input(|input| (input.smooth_scroll_delta().y, input.zoom_delta()));
        let factor = WHEEL.powf(scroll) / pinch;
        if factor != 1.0 && factor.is_finite() {
            let projection = projection(&session.camera, response.rect);
            let seen = surface(session, projection, vec(pointer))?;
            let towards = seen.map_or(session.camera.target, |place| place.position);
            let size = size(session);
            navigate::dolly(&mut session.camera, towards, factor, size);
        }
        Ok(())
    }

    /// Chooses the light whose mark was clicked, else the surface there.
    fn choose(
        &mut self,
        (pointer, modifiers): (Vec2, Modifiers),
        projection: Projection,
        session: &Session,
        ui_state: &mut UiState,
    ) -> Result<()> {
        let marks = session.document.lights.iter().filter_map(|entry| {
            let (mark, _) = projection.project(entry.light.kind.position()?)?;
            Some((mark.distance(pointer), entry.id))
        });
        if let Some((away, id)) = marks.min_by(|a, b| a.0.total_cmp(&b.0))
            && away < MARK
        {
            if modifiers.command {
                ui_state.toggle_chosen(id);
            } else {
                ui_state.choose(Chosen::Light(id));
            }
            return Ok(());
        }
        ui_state.place = surface(session, projection, pointer)?;
        match ui_state.place {
            Some(place) if ui_state.view != View::Inspect => {
                ui_state.choose(Chosen::Material(place.material));
            }
            Some(_) => (),
            None => ui_state.choose(Chosen::Nothing),
        }
        Ok(())
    }

    fn part_at(
        &self,
        pointer: Vec2,
        projection: Projection,
        session: &Session,
        ui_state: &UiState,
    ) -> Option<(Part, u64)> {
        let Chosen::Light(id) = ui_state.chosen else { return None };
        let entry = session.document.lights.iter().find(|entry| entry.id == id)?;
        Some((hit(&of_light(&projection, &entry.light, self.anchor), pointer, TOLERANCE)?, id))
    }

    /// Draws a mark for each light, and the gizmos of the chosen one.
    fn draw_lights(
        &mut self,
        ui: &Ui,
        response: &Response,
        projection: Projection,
        session: &Session,
        ui_state: &UiState,
    ) {
        let painter = ui.painter_at(response.rect);
        if self.hold.is_none() {
            self.anchor = projection.eye() + 0.15 * size(session) * projection.forward();
        }
        let pointer = response.hover_pos().map(vec);
        let held = match &self.hold {
            Some(Hold::Model(drag)) => Some(drag.part()),
            Some(_) => None,
            None => pointer.and_then(|at| model_gizmo::part_at(&projection, session, ui_state.chosen, at)),
        };
        model_gizmo::paint(&painter, &projection, session, ui_state.chosen, held);
        for entry in &session.document.lights {
            let is_chosen = ui_state.chosen == Chosen::Light(entry.id);
            if let Some((mark, _)) = entry.light.kind.position().and_then(|place| projection.project(place)) {
                overlays::mark(&painter, mark, entry, ui_state.has_chosen(entry.id));
                if pointer.is_some_and(|pointer| pointer.distance(mark) < MARK) && !is_chosen {
                    overlays::caption(&painter, mark, &entry.light.name);
                }
            }
            if is_chosen {
                let gizmos = of_light(&projection, &entry.light, self.anchor);
                let held = match &self.hold {
                    Some(Hold::Gizmo(drag, ..)) => Some(drag.part()),
                    Some(_) => None,
                    None => pointer.and_then(|pointer| hit(&gizmos, pointer, TOLERANCE)),
                };
                overlays::light_gizmos(&painter, &gizmos, held);
            }
        }
    }
}

/// The projection of the picture's area.
fn projection(camera: &Camera, area: Rect) -> Projection {
    Projection::new(camera, vec(area.min), Vec2::new(area.width(), area.height()))
}

fn vec(point: egui::Pos2) -> Vec2 {
    Vec2::new(point.x, point.y)
}
