//! Failing Vulkan calls: the layer of `tests/faults` between the program and its driver.

use std::path::PathBuf;
use std::process::Command;

use crate::demo::Demo;
use crate::layer::Layer;
use crate::scenarios::SOON;

/// Faults of one process, which a test can change while it runs.
pub struct Faults {
    layer: Layer,
}

impl Faults {
    /// Creates a list without faults.
    pub fn new() -> Self {
        Self { layer: Layer::new() }
    }

    /// Inserts the layer between the command and the driver.
    pub fn afflict(&self, command: &mut Command) {
        self.layer.afflict(command, &format!("@{}", self.file().display()));
    }

    /// The file of [`crate::layer::calls_in`].
    pub fn calls(&self) -> PathBuf {
        self.layer.folder.path().join("calls")
    }

    /// Replaces the faults, in the notation of `tests/faults`.
    pub fn set(&self, faults: &str) {
        // Renamed into place, because the process may be reading the file.
        let new = self.layer.folder.path().join("new");
        std::fs::write(&new, faults).unwrap();
        std::fs::rename(new, self.file()).unwrap();
    }

    /// Sets faults, runs an action, and waits until each fault has occurred.
    pub fn strike(&self, demo: &Demo, faults: &str, act: impl FnOnce()) {
        let mark = demo.mark();
        self.set(faults);
        act();
        for fault in faults.split(',') {
            let name = fault.split(':').next().unwrap();
            demo.wait_for_line_since(mark, &format!("faults: {name},"), SOON);
        }
    }

    fn file(&self) -> PathBuf {
        self.layer.folder.path().join("faults")
    }
}
