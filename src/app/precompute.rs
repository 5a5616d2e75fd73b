//! `lightpaths precompute`: writes a scene's light paths to a file.

use std::fs;
use std::path::PathBuf;

use clap::Args;

use super::args::{DeviceArgs, SceneArgs, device_label};
use super::output::OutputFile;
use super::overlap;
use crate::error::{Error, Result};
use crate::renderer::Renderer;

/// Trace a scene's light paths and keep them in a file
///
/// `--cache FILE` of other commands takes them from there, as long as scene, settings, device and
/// program are the same; lights may differ, and so may the picture's size. The pictures are those
/// of fresh light paths, to the bit.
#[derive(Debug, Args)]
pub(super) struct Precompute {
    /// A .toml scene file, a .glb, .gltf, .obj, .ply or .stl model, or a built-in scene
    #[arg(default_value = "box")]
    scene: String,
    /// The file to write
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten, next_help_heading = "Scene")]
    scene_args: SceneArgs,
    #[command(flatten, next_help_heading = "Device and messages")]
    device_args: DeviceArgs,
}

impl Precompute {
    pub(super) fn run(self) -> Result<()> {
        OutputFile::check(&self.output)?;
        let scene = self.scene_args.load(&self.scene)?;
        overlap::refuse_inputs([&*self.output], &scene.inputs)?;
        scene.warnings.iter().for_each(|warning| self.device_args.warn(warning));
        if scene.quality.entry_points == 0 {
            return Err(Error::Usage("without entry points there are no light paths to keep".to_owned()));
        }
        let said = scene.warnings.len();
        let context = self.device_args.open()?;
        // A symbolic link stays a link.
        let file = fs::canonicalize(&self.output).unwrap_or_else(|_| self.output.clone());
        let mut progress = self.device_args.progress();
        let (scene, written) = Renderer::store(&context, scene, &file, progress.as_mut())?;
        scene.warnings.iter().skip(said).for_each(|warning| self.device_args.warn(warning));
        self.device_args.report_validation(&context);
        super::print_line(&format!(
            "{}: light paths of {}, {:.1} MiB, precompute {:.2} s, {}",
            self.output.display(),
            scene.name,
            written.bytes as f64 / f64::from(1 << 20),
            written.precompute_s,
            device_label(&context)
        ))
    }
}
