//! Compiled pipelines of the driver, stored on disk: a file for each device and driver in the
//! user's cache folder.
//!
//! lavapipe 22.3 stores nothing in a `VkPipelineCache`; no file is written then.

use std::path::{Path, PathBuf};

use ash::vk;
use xxhash_rust::xxh3::xxh3_64;

use super::device_files::{self, PIPELINES};
use super::names::Names;
use crate::files;

/// Start of a file; the hash of the data and the data follow.
const MAGIC: &[u8; 8] = b"lppipe01";
/// Bytes of `VkPipelineCacheHeaderVersionOne`: a cache of this length is empty.
const HEADER_BYTES: usize = 32;
/// A file that is longer is not read.
const MAX_BYTES: u64 = 256 << 20;

/// The file with the compiled pipelines of a device and driver.
pub(super) struct PipelineStore {
    path: Option<PathBuf>,
    /// Number of bytes that were read from the file.
    stored_bytes: usize,
}

impl PipelineStore {
    pub(super) fn new(properties: &vk::PhysicalDeviceProperties) -> Self {
        Self { path: PIPELINES.path(properties), stored_bytes: 0 }
    }

    /// A cache with the stored pipelines. Empty if none are stored or if the file is damaged. Null
    /// if the driver has no memory for a cache: pipelines are compiled without it.
    pub(super) fn open(&mut self, device: &ash::Device, names: &Names) -> vk::PipelineCache {
        let data = self.path.as_deref().and_then(read).unwrap_or_default();
        self.stored_bytes = data.len();
        let info = vk::PipelineCacheCreateInfo::default().initial_data(&data);
        // SAFETY: the device is alive; the data are as this device's driver wrote them,
        // by their hash.
        let Ok(cache) = (unsafe { device.create_pipeline_cache(&info, None) }) else {
            return vk::PipelineCache::null();
        };
        names.set_name(cache, "compiled pipelines");
        cache
    }

    /// Stores the cache if it has grown since it was read. Failures are ignored: the next
    /// start compiles again.
    pub(super) fn save(&self, device: &ash::Device, cache: vk::PipelineCache) {
        let Some(path) = self.path.as_ref().filter(|_| cache != vk::PipelineCache::null()) else { return };
        // SAFETY: device and cache are alive, and nothing is compiled any more.
        let Ok(data) = (unsafe { device.get_pipeline_cache_data(cache) }) else { return };
        if data.len() > HEADER_BYTES && data.len() != self.stored_bytes {
            let _ = write(path, &data);
        }
    }
}

fn read(path: &Path) -> Option<Vec<u8>> {
    let bytes = files::read(path, MAX_BYTES).ok()?;
    let (hash, data) = bytes.strip_prefix(MAGIC)?.split_first_chunk::<8>()?;
    (u64::from_le_bytes(*hash) == xxh3_64(data)).then(|| data.to_vec())
}

fn write(path: &Path, data: &[u8]) -> std::io::Result<()> {
    device_files::write(path, &[MAGIC, &xxh3_64(data).to_le_bytes(), data])
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    #[test]
    fn data_come_back_and_damaged_files_do_not() {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let path = folder.path().join("new").join("a.bin");
        assert_eq!(read(&path), None);
        write(&path, b"compiled").expect("it can be written");
        assert_eq!(read(&path).as_deref(), Some(&b"compiled"[..]));
        let mut bytes = fs::read(&path).expect("it is there");
        *bytes.last_mut().expect("it is not empty") ^= 1;
        fs::write(&path, &bytes).expect("it can be written");
        assert_eq!(read(&path), None);
        for length in 0..bytes.len() {
            fs::write(&path, &bytes[..length]).expect("it can be written");
            assert_eq!(read(&path), None, "{length} bytes");
        }
    }
}
