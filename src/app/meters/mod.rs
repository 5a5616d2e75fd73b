//! The commands that measure: `measure` and `solve`.

mod least_squares;
pub(super) mod measure;
mod search;
pub(super) mod solve;

#[cfg(feature = "window")]
pub(in crate::app) use search::{Found, Goal, Wish};

use super::args::{CacheArgs, DeviceArgs, SceneArgs};
use crate::error::{Error, Result};
use crate::gpu::Context;
use crate::renderer::{Measured, Renderer};
use crate::scene::Scene;
use std::sync::Arc;

/// Side of the picture, which is not shown.
const SIDE: u32 = 16;

/// Opens a scene for its meters.
fn open(
    spec: &str,
    scene_args: &SceneArgs,
    cache_args: &CacheArgs,
    device_args: &DeviceArgs,
) -> Result<(Arc<Context>, Renderer)> {
    let store = cache_args.store()?;
    let mut scene = scene_args.load_with_meters(spec)?;
    if scene.meters.is_empty() {
        return Err(Error::Usage(format!(
            "{spec} has no meter: add [[meter]] with kind, position and normal to the scene file, \
             see `lightpaths help scene`"
        )));
    }
    scene.cameras[0].size = [SIDE; 2];
    scene.quality.edge_samples = 0;
    scene.warnings.iter().for_each(|warning| device_args.warn(warning));
    let context = device_args.open()?;
    let renderer = device_args.renderer_from(store.as_ref(), &context, scene)?;
    Ok((context, renderer))
}

/// Renders a frame with these lights on and all others off, and measures.
fn measure_with(renderer: &mut Renderer, is_on: impl Fn(usize) -> bool) -> Result<Vec<Measured>> {
    for light in 0..renderer.scene().lights.len() {
        renderer.switch_light(light, is_on(light))?;
    }
    renderer.frame()?;
    renderer.measured()
}

/// The lights that are on and not black.
pub(in crate::app) fn active(scene: &Scene) -> Vec<usize> {
    (0..scene.lights.len()).filter(|&light| scene.lights[light].is_active()).collect()
}
