//! Vulkan calls that fail: the layer of `tests/faults` between the program and its driver.

use std::path::PathBuf;
use std::process::Command;

use tempfile::TempDir;

use crate::demo::Demo;
use crate::scenarios::SOON;

/// Faults of one process, which can be changed while it runs.
pub struct Faults {
    folder: TempDir,
}

impl Faults {
    /// None yet.
    pub fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let layer = std::env::current_exe().unwrap().with_file_name("liblightpaths_faults.so");
        assert!(layer.is_file(), "cargo builds {} with this test", layer.display());
        let manifest = format!(
            "{{\"file_format_version\": \"1.1.2\", \"layer\": {{\"name\": \"VK_LAYER_LIGHTPATHS_faults\", \"type\": \"GLOBAL\", \
             \"library_path\": {layer:?}, \"api_version\": \"1.3.0\", \"implementation_version\": \"1\", \
             \"description\": \"lets calls fail\"}}}}"
        );
        std::fs::write(folder.path().join("faults.json"), manifest).unwrap();
        Self { folder }
    }

    /// Puts the layer between the command and the driver, above the validation layer: that one sees what the driver sees.
    pub fn afflict(&self, command: &mut Command) {
        let folder = self.folder.path();
        match std::env::var("VK_LAYER_PATH") {
            // It hides all other places.
            Ok(path) => command.env("VK_LAYER_PATH", format!("{}:{path}", folder.display())),
            Err(_) => command.env("VK_ADD_LAYER_PATH", folder),
        };
        command.env("VK_INSTANCE_LAYERS", "VK_LAYER_LIGHTPATHS_faults");
        command.env("LIGHTPATHS_FAULTS", format!("@{}", self.file().display()));
    }

    /// From now on these faults, as `tests/faults` describes them, and no others.
    pub fn set(&self, faults: &str) {
        // All at once: the process may be reading it.
        let new = self.folder.path().join("new");
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
        self.folder.path().join("faults")
    }
}
