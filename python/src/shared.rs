//! A renderer that several Python objects share: itself, its lights, materials and camera.

use std::sync::{Arc, Mutex};

use lightpaths::{Error, Renderer, Result};
use pyo3::prelude::*;

use crate::errors::raised;
use crate::progress::Watch;

/// A renderer, and what it reports beside pictures.
pub(crate) struct State {
    pub(crate) renderer: Renderer,
    /// Wall-clock time of the last frame, milliseconds.
    pub(crate) frame_ms: Option<f64>,
}

impl State {
    /// Renders the scene as it is now. Does nothing if the last frame shows it.
    ///
    /// An enclosure that a light and the camera have entered takes part from then on, as in a new
    /// renderer: that needs another precomputation.
    pub(crate) fn update(&mut self, watch: &mut Watch) -> Result<()> {
        self.renderer.open_enclosures(watch)?;
        if !self.renderer.is_current() {
            self.frame_ms = Some(self.renderer.frame()?.frame_ms);
        }
        Ok(())
    }
}

#[derive(Clone)]
pub(crate) struct Shared(Arc<Mutex<State>>);

impl Shared {
    pub(crate) fn new(renderer: Renderer) -> Self {
        Self(Arc::new(Mutex::new(State { renderer, frame_ms: None })))
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
        let mut watch = Watch::default();
        let done = py.detach(|| {
            self.locked(|state| {
                state.update(&mut watch)?;
                work(state)
            })
        });
        done.map_err(|error| watch.exception(error))
    }

    fn locked<T>(&self, work: impl FnOnce(&mut State) -> Result<T>) -> Result<T> {
        let Ok(mut state) = self.0.lock() else {
            return Err(Error::Usage("this renderer has failed before: make another".to_owned()));
        };
        work(&mut state)
    }
}
