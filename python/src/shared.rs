//! A renderer that several Python objects share: itself, its lights, materials and camera.

use std::sync::{Arc, Mutex};

use lightpaths::renderer::Kept;
use lightpaths::{Context, Error, Renderer, Result, Scene};
use pyo3::prelude::*;

use crate::errors::raised;
use crate::progress::Watch;

/// A renderer, and what it reports beside pictures.
pub(crate) struct State {
    pub(crate) renderer: Renderer,
    pub(crate) context: Arc<Context>,
    /// What the precomputation left for the next scene in which models have moved.
    pub(crate) kept: Kept,
    /// Wall-clock time of the last frame, milliseconds.
    pub(crate) frame_ms: Option<f64>,
    /// Of the scene, its precomputation and the cache.
    pub(crate) warnings: Vec<String>,
}

impl State {
    /// Renders the scene as it is now, with own records. Does nothing if the last frame shows it.
    ///
    /// An enclosure that a light and the camera have entered takes part from then on, as in a new
    /// renderer: that needs another precomputation.
    pub(crate) fn update(&mut self, watch: &mut Watch) -> Result<()> {
        self.renderer.open_enclosures(watch)?;
        if !self.renderer.is_current() {
            let mut frame_ms = self.renderer.frame()?.frame_ms;
            if self.renderer.refine()? > 0 {
                frame_ms += self.renderer.frame()?.frame_ms;
            }
            self.frame_ms = Some(frame_ms);
        }
        Ok(())
    }

    /// Replaces the scene. If that fails, the scene before stays.
    pub(crate) fn set_scene(&mut self, scene: Scene, watch: &mut Watch) -> Result<()> {
        let mut renderer = Renderer::new_keeping(&self.context, scene, &mut self.kept, watch)?;
        renderer.set_serialised(false);
        self.warnings.clone_from(&renderer.scene().warnings);
        (self.renderer, self.frame_ms) = (renderer, None);
        Ok(())
    }
}

#[derive(Clone)]
pub(crate) struct Shared(Arc<Mutex<State>>);

impl Shared {
    pub(crate) fn new(state: State) -> Self {
        Self(Arc::new(Mutex::new(state)))
    }

    /// Works on the renderer while other Python threads run. The interpreter is always released
    /// before the lock is taken: a thread that holds the lock may wait for the interpreter.
    pub(crate) fn with<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut State) -> Result<T> + Send,
    ) -> PyResult<T> {
        py.detach(|| self.locked(work)).map_err(raised)
    }

    /// The same with a picture of the scene as it is now.
    pub(crate) fn with_picture<T: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut State) -> Result<T> + Send,
    ) -> PyResult<T> {
        self.watched(py, Watch::default(), |state, watch| {
            state.update(watch)?;
            work(state)
        })
    }

    /// The same with work that may trace light paths, and reports to `watch`.
    pub(crate) fn watched<T: Send>(
        &self,
        py: Python<'_>,
        mut watch: Watch,
        work: impl FnOnce(&mut State, &mut Watch) -> Result<T> + Send,
    ) -> PyResult<T> {
        let done = py.detach(|| self.locked(|state| work(state, &mut watch)));
        done.map_err(|error| watch.exception(error))
    }

    fn locked<T>(&self, work: impl FnOnce(&mut State) -> Result<T>) -> Result<T> {
        let Ok(mut state) = self.0.lock() else {
            return Err(Error::Usage("this renderer has failed before: make another".to_owned()));
        };
        work(&mut state)
    }
}
