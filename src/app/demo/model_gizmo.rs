//! The gizmo of the chosen model: a box around it, rings that turn it, and the parts of a point
//! light's gizmo in its middle. Light paths are traced anew once a drag ends; until then the box
//! shows where the model goes.

use egui::Painter;
use glam::{DVec3, Vec2, Vec3};

use super::document::Document;
use super::gizmos::{Drag, Gizmo, Part, Projection, Shape, TOLERANCE, hit, of_light, rings, turn};
use super::overlays;
use super::session::Session;
use super::ui_state::Chosen;
use crate::scene::save::PlacedModel;
use crate::scene::{Light, LightKind};

/// Step of a snapped turn, degrees.
const TURN_STEP: f64 = 15.0;

/// A drag of a model.
pub(super) struct ModelDrag {
    drag: Drag,
    model: usize,
    /// The model at the start.
    before: PlacedModel,
    /// Middle of its box at the start, recentred, and in world space.
    middle: (Vec3, DVec3),
    /// Pointer at the start, points.
    start: Vec2,
}

/// Starts a drag if the pointer is on a part of the chosen model's gizmo.
pub(super) fn begin(
    projection: &Projection,
    session: &Session,
    chosen: Chosen,
    pointer: Vec2,
) -> Option<ModelDrag> {
    let part = part_at(projection, session, chosen, pointer)?;
    let (model, corners) = chosen_box(session, chosen)?;
    let before = session.document.parts.models.get(model)?.clone();
    let middle = middle(&corners);
    let drag = Drag::begin(projection, &stand_in(middle), part, Vec3::ZERO, pointer);
    let middle = (middle, middle.as_dvec3() + session.scene.origin);
    Some(ModelDrag { drag, model, before, middle, start: pointer })
}

impl ModelDrag {
    /// The dragged part.
    pub(super) fn part(&self) -> Part {
        self.drag.part()
    }

    /// Places the model for a pointer position. `snap` rounds movements as for [`Drag::to`], and
    /// turns to 15°.
    pub(super) fn to(
        &self,
        projection: &Projection,
        pointer: Vec2,
        snap: Option<f32>,
        document: &mut Document,
    ) {
        let Some(model) = document.parts.models.get_mut(self.model) else { return };
        model.clone_from(&self.before);
        if let Part::Turn(axis) = self.part() {
            let degrees = turn(projection, self.middle.0, axis, [self.start, pointer]).to_degrees();
            let degrees = if snap.is_some() { (degrees / TURN_STEP).round() * TURN_STEP } else { degrees };
            if degrees != 0.0 {
                model.turn_about(self.middle.1, model.angles_after(axis.unit().as_dvec3(), degrees));
            }
        } else if let Some(offset) = self.drag.offset(&self.drag.to(projection, pointer, snap)) {
            model.translation += offset.as_dvec3();
        }
    }
}

/// The part of the chosen model's gizmo at the pointer.
pub(super) fn part_at(
    projection: &Projection,
    session: &Session,
    chosen: Chosen,
    pointer: Vec2,
) -> Option<Part> {
    let (_, corners) = chosen_box(session, chosen)?;
    hit(&gizmos(projection, &corners, turns(session, chosen)), pointer, TOLERANCE)
}

/// Draws the box and the gizmo of the chosen model.
pub(super) fn paint(
    painter: &Painter,
    projection: &Projection,
    session: &Session,
    chosen: Chosen,
    held: Option<Part>,
) {
    let Some((_, corners)) = chosen_box(session, chosen) else { return };
    overlays::light_gizmos(painter, &gizmos(projection, &corners, turns(session, chosen)), held);
}

fn chosen_box(session: &Session, chosen: Chosen) -> Option<(usize, [Vec3; 8])> {
    let Chosen::Model(model) = chosen else { return None };
    Some((model, session.model_corners(model)?))
}

/// Whether the model has angles; one with a matrix has none.
fn turns(session: &Session, chosen: Chosen) -> bool {
    let Chosen::Model(model) = chosen else { return false };
    session.document.parts.models.get(model).is_some_and(|model| model.matrix.is_none())
}

fn middle(corners: &[Vec3; 8]) -> Vec3 {
    corners.iter().sum::<Vec3>() / 8.0
}

/// A light whose gizmo moves the model.
fn stand_in(position: Vec3) -> LightKind {
    LightKind::Point { position, intensity: Vec3::ONE }
}

fn gizmos(projection: &Projection, corners: &[Vec3; 8], turns: bool) -> Vec<Gizmo> {
    let ends =
        |axis: usize| (0..8).filter(move |corner| corner >> axis & 1 == 0).map(move |from| (from, axis));
    let edges = (0..3).flat_map(ends).filter_map(|(from, axis)| {
        let seen = projection.segment(corners[from], corners[from | 1 << axis])?;
        Some(Shape::Guide(seen.to_vec()))
    });
    let mut gizmos = vec![Gizmo { part: Part::Middle, axis: None, shapes: edges.collect() }];
    if turns {
        gizmos.extend(rings(projection, middle(corners)));
    }
    gizmos.extend(of_light(projection, &Light::new("", stand_in(middle(corners))), Vec3::ZERO));
    gizmos
}
