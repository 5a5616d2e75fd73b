//! The layer of `tests/faults` between a program and its driver.

#![allow(dead_code, reason = "each test binary uses a part")]

use std::collections::BTreeMap;
use std::path::Path;
use std::process::Command;

use tempfile::TempDir;

/// The folder in which the loader finds the layer.
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

    /// Inserts the layer between the command and the driver, above the validation layer, which sees
    /// the same calls as the driver. `tests/faults` documents `faults`.
    pub fn afflict(&self, command: &mut Command, faults: &str) {
        let folder = self.folder.path();
        match std::env::var("VK_LAYER_PATH") {
            // The variable replaces all other folders.
            Ok(path) => command.env("VK_LAYER_PATH", format!("{}:{path}", folder.display())),
            Err(_) => command.env("VK_ADD_LAYER_PATH", folder),
        };
        command.env("VK_INSTANCE_LAYERS", "VK_LAYER_LIGHTPATHS_faults");
        command.env("LIGHTPATHS_FAULTS", faults);
    }
}

/// Number of calls of each function in a program that has ended. Empty if the program
/// did not finish.
pub fn calls_in(file: &Path) -> BTreeMap<String, u64> {
    let text = std::fs::read_to_string(file).unwrap_or_default();
    let call =
        |line: &str| line.split_once(' ').map(|(name, count)| (name.to_owned(), count.parse().unwrap()));
    text.lines().map(|line| call(line).unwrap()).collect()
}

/// Asserts that each object was destroyed. Failed calls create none, so none of the counted
/// calls may fail.
pub fn assert_all_destroyed(calls: &BTreeMap<String, u64>, case: &str) {
    const MADE: [(&[&str], &str); 17] = [
        (&["vkAllocateMemory"], "vkFreeMemory"),
        (&["vkCreateBuffer"], "vkDestroyBuffer"),
        (&["vkCreateBufferView"], "vkDestroyBufferView"),
        (&["vkCreateCommandPool"], "vkDestroyCommandPool"),
        (&["vkCreateDescriptorPool"], "vkDestroyDescriptorPool"),
        (&["vkCreateDescriptorSetLayout"], "vkDestroyDescriptorSetLayout"),
        (&["vkCreateFence"], "vkDestroyFence"),
        (&["vkCreateImage"], "vkDestroyImage"),
        (&["vkCreateImageView"], "vkDestroyImageView"),
        (&["vkCreateComputePipelines", "vkCreateGraphicsPipelines"], "vkDestroyPipeline"),
        (&["vkCreatePipelineCache"], "vkDestroyPipelineCache"),
        (&["vkCreatePipelineLayout"], "vkDestroyPipelineLayout"),
        (&["vkCreateQueryPool"], "vkDestroyQueryPool"),
        (&["vkCreateSampler"], "vkDestroySampler"),
        (&["vkCreateSemaphore"], "vkDestroySemaphore"),
        (&["vkCreateShaderModule"], "vkDestroyShaderModule"),
        (&["vkCreateSwapchainKHR"], "vkDestroySwapchainKHR"),
    ];
    let count = |name: &str| calls.get(name).copied().unwrap_or(0);
    for (made, destroyed) in MADE {
        let made_count: u64 = made.iter().map(|name| count(name)).sum();
        assert_eq!(made_count, count(destroyed), "{case}: {made:?} and {destroyed}");
    }
    let is_end = |name: &&String| name.starts_with("vkDestroy") || name.starts_with("vkFree");
    let is_known = |name: &String| MADE.iter().any(|(_, destroyed)| destroyed == name);
    assert!(calls.keys().filter(is_end).all(is_known), "{case}: {calls:?}");
}
