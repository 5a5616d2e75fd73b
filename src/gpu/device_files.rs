//! Files in the user's cache folder, one for each device and driver.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::{env, fs};

use ash::vk;
use xxhash_rust::xxh3::xxh3_64;

/// Compiled pipelines of the driver.
pub(super) const PIPELINES: DeviceFile =
    DeviceFile { variable: "LIGHTPATHS_PIPELINES", folder: "pipelines", extension: "bin" };
/// Tuning that was measured.
pub(super) const TUNING: DeviceFile =
    DeviceFile { variable: "LIGHTPATHS_TUNING", folder: "tuning", extension: "json" };

/// A kind of file.
pub(super) struct DeviceFile {
    /// Environment variable with another folder; empty: there is no file.
    pub(super) variable: &'static str,
    /// Folder in the program's cache folder.
    folder: &'static str,
    extension: &'static str,
}

impl DeviceFile {
    /// The path for a device. `None` if the user has no cache folder, or if the variable is empty.
    pub(super) fn path(&self, properties: &vk::PhysicalDeviceProperties) -> Option<PathBuf> {
        self.folder().map(|folder| folder.join(format!("{}.{}", stem(properties), self.extension)))
    }

    fn folder(&self) -> Option<PathBuf> {
        cache_folder(self.variable, self.folder)
    }
}

/// A folder in the program's cache folder, or the one that an environment variable names. `None` if
/// the user has no cache folder, or if the variable is empty.
pub fn cache_folder(variable: &str, folder: &str) -> Option<PathBuf> {
    if let Some(folder) = env::var_os(variable) {
        return (!folder.is_empty()).then(|| PathBuf::from(folder));
    }
    let variable = |name: &str| env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let base = variable("XDG_CACHE_HOME").or_else(|| variable("LOCALAPPDATA"));
    let base = base.or_else(|| variable("HOME").map(|home| home.join(".cache")))?;
    Some(base.join("lightpaths").join(folder))
}

/// Drivers identify the device and version of their data by these numbers.
fn stem(properties: &vk::PhysicalDeviceProperties) -> String {
    let ids = [properties.vendor_id, properties.device_id, properties.driver_version];
    let bytes = [bytemuck::cast_slice(&ids), &properties.pipeline_cache_uuid[..]].concat();
    format!("{:016x}", xxh3_64(&bytes))
}

/// Writes under a temporary name first: another process may be reading.
pub(super) fn write(path: &Path, parts: &[&[u8]]) -> std::io::Result<()> {
    let folder = path.parent().expect("the path has a folder, see `DeviceFile::path`");
    fs::create_dir_all(folder)?;
    let mut file = tempfile::NamedTempFile::new_in(folder)?;
    for part in parts {
        file.write_all(part)?;
    }
    file.persist(path)?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_driver_has_another_file() {
        let properties = vk::PhysicalDeviceProperties::default();
        let newer = vk::PhysicalDeviceProperties { driver_version: 1, ..properties };
        let other = vk::PhysicalDeviceProperties { pipeline_cache_uuid: [1; 16], ..properties };
        assert_ne!(stem(&properties), stem(&newer));
        assert_ne!(stem(&properties), stem(&other));
    }
}
