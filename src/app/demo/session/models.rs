//! The models of the session, as its document places them.

use std::sync::Arc;
use std::time::{Duration, Instant};

use glam::{DVec3, Vec3};

use super::Session;
use crate::app::demo::document::Parts;
use crate::error::Result;
use crate::renderer::Preview;
use crate::scene::save::PlacedModel;
use crate::scene::{Emission, Scene};

/// Longest step of a drag that follows the pointer; the window waits for each.
const PATIENCE: Duration = Duration::from_millis(150);

/// Direct light of models that the pointer moves.
pub(super) struct Moving {
    pub(super) preview: Box<Preview>,
    /// Where its models are.
    parts: Parts,
    /// Where the document had them last.
    asked: Parts,
    /// Time of the last step.
    took: Duration,
}

impl Session {
    /// Corners of a box around a model where the document has it, recentred; bit k of an index says
    /// at which end of axis k the corner was at load. `None`: the model is hidden, or not loaded.
    pub(in crate::app::demo) fn model_corners(&self, model: usize) -> Option<[Vec3; 8]> {
        let [low, high] = (*self.scene.model_boxes.get(model)?)?;
        let (from, to) = (self.loaded.models.get(model)?, self.document.parts.models.get(model)?);
        Some(std::array::from_fn(|corner| {
            let is_high = [0, 1, 2].map(|axis| corner >> axis & 1 == 1);
            carried((from, to), self.scene.origin, Vec3::select(is_high.into(), high, low))
        }))
    }

    /// The models of the scene file, without the user's edits.
    pub(in crate::app::demo) fn file_models(&self) -> &[PlacedModel] {
        &self.models
    }

    /// Whether the user has added the model, so that the scene file lacks it.
    pub(in crate::app::demo) fn is_added(&self, model: usize) -> bool {
        model >= self.models.len()
    }

    /// Shows the direct light of models that the pointer moves. Once it is released, the stage's
    /// own picture comes back, or that of light paths that are traced anew.
    pub(super) fn follow_moving(&mut self) -> Result<()> {
        if !self.is_held {
            if self.moving.is_some() {
                self.end_frames(0)?;
                (self.moving, self.recorded, self.shown) = (None, None, None);
            }
            return Ok(());
        }
        let parts = &self.document.parts;
        let shown = self.moving.as_ref().map_or(&self.loaded, |moving| &moving.parts);
        if parts == shown || !differ_in_place(&self.loaded.models, &parts.models) {
            return Ok(());
        }
        if let Some(moving) = self.moving.as_mut().filter(|moving| moving.took > PATIENCE)
            && moving.asked != *parts
        {
            // A slow step waits until the pointer rests.
            moving.asked.clone_from(parts);
            return Ok(());
        }
        let (start, parts) = (Instant::now(), parts.clone());
        self.end_frames(0)?;
        self.recorded = None;
        let scene = self.moved_scene();
        let preview = match self.moving.take() {
            Some(Moving { mut preview, .. }) => preview.set_scene(scene).map(|()| preview),
            None => Preview::new(&self.context, scene).map(Box::new),
        };
        match preview {
            Ok(preview) => {
                let (asked, took) = (parts.clone(), start.elapsed());
                self.moving = Some(Moving { preview, parts, asked, took });
            }
            // The box around the model still shows where it goes.
            Err(error) if error.is_out_of_memory() => self.shown = None,
            Err(error) => return Err(error),
        }
        Ok(())
    }

    /// Whether the picture waits until the pointer rests to show moved models.
    pub(in crate::app::demo) fn awaits_rest(&self) -> bool {
        self.moving.as_ref().is_some_and(|moving| moving.parts != self.document.parts)
    }

    /// The scene with its models where the document has them. Panes stay.
    fn moved_scene(&self) -> Scene {
        let mut scene = self.scene.clone();
        let origin = scene.origin;
        let places = self.loaded.models.iter().zip(&self.document.parts.models);
        for (place, objects) in places.zip(&scene.model_objects).filter(|((from, to), _)| from != to) {
            let foot = carried(place, origin, Vec3::ZERO);
            let own = scene.triangles.iter_mut().filter(|triangle| objects.contains(&triangle.object));
            for triangle in own {
                triangle.positions = triangle.positions.map(|corner| carried(place, origin, corner));
                triangle.normals = triangle.normals.map(|normal| carried(place, origin, normal) - foot);
            }
        }
        if !scene.emission.surfaces.is_empty() {
            let sky = scene.emission.sky.clone();
            scene.emission = Arc::new(Emission::new(&scene.triangles, &scene.materials, sky));
        }
        scene
    }
}

/// Where a recentred point of a model is after the model was placed anew.
fn carried((from, to): (&PlacedModel, &PlacedModel), origin: DVec3, point: Vec3) -> Vec3 {
    (from.carried(point.as_dvec3() + origin, to) - origin).as_vec3()
}

/// Whether the same models are shown, some at another place.
fn differ_in_place(from: &[PlacedModel], to: &[PlacedModel]) -> bool {
    let is_same = |(from, to): (&PlacedModel, &PlacedModel)| {
        from.file == to.file && from.is_hidden == to.is_hidden && from.matrix == to.matrix
    };
    from != to && from.len() == to.len() && from.iter().zip(to).all(is_same)
}
