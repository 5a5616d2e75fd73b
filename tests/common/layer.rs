//! The layer of `tests/faults` between a program and its driver.

use std::process::Command;

use tempfile::TempDir;

/// Where the loader finds the layer.
pub struct Layer {
    pub folder: TempDir,
}

impl Layer {
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

    /// Puts the layer between the command and the driver, above the validation layer: that one sees what the driver sees. The faults
    /// are as `tests/faults` describes them.
    pub fn afflict(&self, command: &mut Command, faults: &str) {
        let folder = self.folder.path();
        match std::env::var("VK_LAYER_PATH") {
            // It hides all other places.
            Ok(path) => command.env("VK_LAYER_PATH", format!("{}:{path}", folder.display())),
            Err(_) => command.env("VK_ADD_LAYER_PATH", folder),
        };
        command.env("VK_INSTANCE_LAYERS", "VK_LAYER_LIGHTPATHS_faults");
        command.env("LIGHTPATHS_FAULTS", faults);
    }
}
