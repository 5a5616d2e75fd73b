//! The renderers that a session gets from its worker. If they do not fit the device together, the
//! draft makes room.

use super::{Session, Stage};
use crate::app::demo::stage::{SharedKept, Worker};
use crate::error::{Error, Result};
use crate::renderer::Preview;
use crate::scene::Scene;

/// The light paths that the worker traces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Goal {
    /// Those of a draft, then the scene's own.
    DraftFirst,
    /// The scene's own: they do not fit beside a draft.
    OwnAlone,
    /// Those of a draft: the scene's own do not fit the device.
    DraftAlone,
}

impl Session {
    /// Takes the worker's next renderer, if it is ready.
    pub(super) fn take_renderer(&mut self) -> Result<()> {
        let Some(worker) = &mut self.worker else { return Ok(()) };
        // Asked first: a thread that has ended has sent all renderers.
        let has_ended = worker.has_ended();
        if let Some(ready) = worker.next(self.scene.lights.len()) {
            self.said.append(&mut worker.said());
            // Frames of the renderer before.
            self.end_frames(0)?;
            self.recorded = None;
            let new = ready.renderer.scene().warnings.iter().filter(|line| !self.said.contains(line));
            let new: Vec<String> = new.cloned().collect();
            self.said.extend(new);
            self.stage = Stage::Ready(Box::new(ready));
            (self.shown, self.is_unmetered) = (None, true);
            self.generation += 1;
        }
        if !has_ended {
            return Ok(());
        }
        match self.worker.take().map_or(Ok(()), Worker::end) {
            Err(error) if error.is_out_of_memory() => self.make_room(&error),
            ended => ended,
        }
    }

    /// After the scene's own light paths did not fit beside a draft, traces them without one. If
    /// they do not fit then, either, the draft comes back, and an alarm says why.
    pub(in crate::app::demo) fn make_room(&mut self, error: &Error) -> Result<()> {
        let goal = match self.goal {
            Goal::DraftFirst if self.renderer().is_some() => Goal::OwnAlone,
            Goal::OwnAlone => Goal::DraftAlone,
            Goal::DraftFirst | Goal::DraftAlone => {
                self.alarm(format!("direct light only: {error}"));
                return Ok(());
            }
        };
        if goal == Goal::OwnAlone {
            self.said.push("the draft leaves, because the light paths do not fit beside it".into());
        } else {
            self.alarm(format!("a draft only: {error}"));
        }
        self.end_frames(0)?;
        self.kept = SharedKept::default();
        let preview = match Preview::new(&self.context, self.scene.clone()) {
            Err(error) if error.is_out_of_memory() => {
                self.alarm(format!("a draft only: {error}"));
                return Ok(());
            }
            preview => Box::new(preview?),
        };
        let mut scene = self.scene.clone();
        match goal {
            Goal::DraftAlone => scene.quality.clone_from(&self.scene.draft),
            _ => scene.draft.clone_from(&self.scene.quality),
        }
        (self.recorded, self.shown, self.is_unmetered) = (None, None, true);
        self.stage = Stage::Preview(preview);
        self.generation += 1;
        self.goal = goal;
        self.start_worker(&scene)
    }

    fn start_worker(&mut self, scene: &Scene) -> Result<()> {
        self.worker =
            Some(Worker::start(&self.context, scene, self.source.store.clone(), &self.kept, &self.wake)?);
        Ok(())
    }
}
