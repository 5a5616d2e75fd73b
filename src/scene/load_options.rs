//! What a user changes of a scene when it is loaded.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

use super::fit::{Place, Up};

/// Files by path that are read instead of the disk's.
pub type Memory = Arc<BTreeMap<PathBuf, Vec<u8>>>;

/// A user's changes to a scene at load.
#[derive(Clone, Debug, Default)]
pub struct LoadOptions {
    /// `KEY=VALUE` changes to the scene file, in order: `camera.size=[64,64]`,
    /// `light.lamp.position=[0,1,0]`.
    pub set: Vec<String>,
    /// Quality preset that replaces `[quality]` except the seed; `set` still changes its numbers.
    pub preset: Option<String>,
    /// Image size in pixels, for every camera.
    pub size: Option<[u32; 2]>,
    /// Name of the camera to put first.
    pub camera: Option<String>,
    /// Whether a file may name files outside of the folder of the user's file. Paths in `set`
    /// may lie anywhere.
    pub allow_outside: bool,
    /// Where a camera is placed if the scene has none [default: chosen by rays].
    pub place: Option<Place>,
    /// Which way is up for such a camera [default: chosen by the model's shape].
    pub up: Option<Up>,
    /// Files that are read instead of the disk's.
    pub memory: Option<Memory>,
}
