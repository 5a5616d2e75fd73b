//! Progress of a precomputation: calls back, and ends it after Ctrl+C.

use lightpaths::{Error, Progress};
use pyo3::prelude::*;

use crate::errors::raised;

/// Reports to a Python function, if there is one.
#[derive(Default)]
pub(crate) struct Watch {
    callback: Option<Py<PyAny>>,
    stage: String,
    total: u64,
    /// What a signal handler or the function raised.
    raised: Option<PyErr>,
}

impl Watch {
    pub(crate) fn new(callback: Option<Py<PyAny>>) -> Self {
        Self { callback, ..Self::default() }
    }

    /// The exception of an error: what was raised meanwhile, if that has caused it.
    pub(crate) fn exception(self, error: Error) -> PyErr {
        match (error, self.raised) {
            (Error::Cancelled, Some(raised)) => raised,
            (error, _) => raised(error),
        }
    }

    fn report(&mut self, done: u64) {
        let Some(callback) = self.callback.as_ref().filter(|_| self.raised.is_none()) else { return };
        let called = Python::attach(|py| callback.call1(py, (self.stage.as_str(), done, self.total)));
        self.raised = called.err();
    }
}

impl Progress for Watch {
    fn stage(&mut self, name: &str, total: u64) {
        (self.stage, self.total) = (name.to_owned(), total);
        self.report(0);
    }

    fn advance(&mut self, done: u64) {
        self.report(done);
    }

    fn finish(&mut self) {}

    fn is_cancelled(&mut self) -> bool {
        if self.raised.is_none() {
            self.raised = Python::attach(|py| py.check_signals()).err();
        }
        self.raised.is_some()
    }
}
