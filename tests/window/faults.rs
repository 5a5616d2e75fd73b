//! Vulkan calls that fail: the layer of `tests/faults` between the program and its driver.

use std::path::PathBuf;
use std::process::Command;

use crate::demo::Demo;
use crate::layer::Layer;
use crate::scenarios::SOON;

/// Faults of one process, which can be changed while it runs.
pub struct Faults {
    layer: Layer,
}

impl Faults {
    /// None yet.
    pub fn new() -> Self {
        Self { layer: Layer::new() }
    }

    /// Puts the layer between the command and the driver.
    pub fn afflict(&self, command: &mut Command) {
        self.layer.afflict(command, &format!("@{}", self.file().display()));
    }

    /// The file of [`crate::layer::calls_in`].
    pub fn calls(&self) -> PathBuf {
        self.layer.folder.path().join("calls")
    }

    /// From now on these faults, as `tests/faults` describes them, and no others.
    pub fn set(&self, faults: &str) {
        // All at once: the process may be reading it.
        let new = self.layer.folder.path().join("new");
        std::fs::write(&new, faults).unwrap();
        std::fs::rename(new, self.file()).unwrap();
    }

    /// Sets faults, lets something happen, and waits until each has come about.
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
