//! The gizmo of the chosen model: a box around it, and the parts of a point light's gizmo in its
//! middle. Light paths are traced anew once a drag ends; until then the box shows where it goes.

use egui::Painter;
use glam::{DVec3, Vec2, Vec3};

use super::document::Document;
use super::gizmos::{Drag, Gizmo, Part, Projection, Shape, TOLERANCE, hit, of_light};
use super::overlays;
use super::session::Session;
use super::ui_state::Chosen;
use crate::scene::{Light, LightKind};

/// A drag of a model.
pub(super) struct ModelDrag {
    drag: Drag,
    model: usize,
    /// Its offset at the start, world space, metres.
    before: DVec3,
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
    let before = session.document.parts.models.get(model)?.translation;
    let middle = stand_in(&corners);
    Some(ModelDrag { drag: Drag::begin(projection, &middle, part, Vec3::ZERO, pointer), model, before })
}

impl ModelDrag {
    /// The dragged part.
    pub(super) fn part(&self) -> Part {
        self.drag.part()
    }

    /// Places the model for a pointer position; `snap` as for [`Drag::to`].
    pub(super) fn to(
        &self,
        projection: &Projection,
        pointer: Vec2,
        snap: Option<f32>,
        document: &mut Document,
    ) {
        let offset = self.drag.offset(&self.drag.to(projection, pointer, snap));
        if let Some(model) = document.parts.models.get_mut(self.model) {
            model.translation = self.before + offset.unwrap_or(Vec3::ZERO).as_dvec3();
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
    hit(&gizmos(projection, &corners), pointer, TOLERANCE)
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
    overlays::light_gizmos(painter, &gizmos(projection, &corners), held);
}

fn chosen_box(session: &Session, chosen: Chosen) -> Option<(usize, [Vec3; 8])> {
    let Chosen::Model(model) = chosen else { return None };
    Some((model, session.model_corners(model)?))
}

/// A light in the middle of the box, whose gizmo moves the model.
fn stand_in(corners: &[Vec3; 8]) -> LightKind {
    LightKind::Point { position: corners.iter().sum::<Vec3>() / 8.0, intensity: Vec3::ONE }
}

fn gizmos(projection: &Projection, corners: &[Vec3; 8]) -> Vec<Gizmo> {
    let ends =
        |axis: usize| (0..8).filter(move |corner| corner >> axis & 1 == 0).map(move |from| (from, axis));
    let edges = (0..3).flat_map(ends).filter_map(|(from, axis)| {
        let seen = projection.segment(corners[from], corners[from | 1 << axis])?;
        Some(Shape::Guide(seen.to_vec()))
    });
    let mut gizmos = vec![Gizmo { part: Part::Middle, axis: None, shapes: edges.collect() }];
    gizmos.extend(of_light(projection, &Light::new("", stand_in(corners)), Vec3::ZERO));
    gizmos
}
