//! `lightpaths init`: writes the scene file that a model alone stands for.

use std::fmt::Write;
use std::path::{Path, PathBuf};

use clap::Args;

use super::args::{DeviceArgs, SceneArgs};
use super::output::OutputFile;
use crate::error::{Error, Result};
use crate::scene::save::{Edited, SceneText, leads_outside};
use crate::scene::{Material, Scene, is_model};

/// Materials that the file lists; models may have thousands.
const MATERIALS: usize = 32;

/// Write the scene file that a model alone stands for
///
/// It states the camera and the lights that `render MODEL` uses, and lists the materials as
/// comments, so that all of them can be edited.
#[derive(Debug, Args)]
pub(super) struct Init {
    /// A .glb, .gltf, .obj, .ply or .stl model, a .toml scene file, or a built-in scene
    scene: String,
    /// The scene file to write; it must not exist [default: the model's name with .toml]
    #[arg(short, long, value_name = "FILE.toml")]
    output: Option<PathBuf>,
    #[command(flatten, next_help_heading = "Scene")]
    scene_args: SceneArgs,
    #[command(flatten, next_help_heading = "Device and messages")]
    device_args: DeviceArgs,
}

impl Init {
    pub(super) fn run(self) -> Result<()> {
        let path = self.output.clone().unwrap_or_else(|| Path::new(&self.scene).with_extension("toml"));
        if path.extension().is_none_or(|extension| extension != "toml") {
            return Err(Error::output(&path, "is no name of a scene file: let it end in .toml"));
        }
        if path.symlink_metadata().is_ok() {
            return Err(Error::output(&path, "exists: name another file with -o, or delete it"));
        }
        let output = OutputFile::check(&path)?;
        let scene = self.scene_args.load_with_meters(&self.scene)?;
        let text = SceneText::new(&self.scene, &self.scene_args.options(), &scene)?;
        let text = text.with_edits(&Edited::from_scene(&scene), &path)?;
        let text = commented(&self.scene, &scene, &text);
        output.write(|out| std::io::Write::write_all(out, text.as_bytes()))?;
        if leads_outside(&text, &path) {
            self.device_args.warn("the models lie elsewhere: open the scene with --allow-outside");
        }
        super::print_line(&format!("{}: the scene of {}", path.display(), self.scene))
    }
}

/// The text with what was assumed and the materials as comments.
fn commented(spec: &str, scene: &Scene, text: &str) -> String {
    let mut all = format!("# {}: keys, units and ranges are in `lightpaths help scene`.\n", one_line(spec));
    for warning in &scene.warnings {
        let _ = writeln!(all, "# {}", one_line(warning));
    }
    if is_model(spec) {
        all += "# A model alone is exposed automatically: render PNG files with --exposure auto.\n";
    }
    all += "\n";
    all += text.trim_start();
    if !scene.materials.is_empty() {
        all += "\n# Materials as the model states them. Sections without # replace its values.\n";
        scene.materials.iter().take(MATERIALS).for_each(|material| all += &section(material));
    }
    all
}

fn section(material: &Material) -> String {
    let Material { name, diffuse, specular, exponent, texture, editable, emission, .. } = material;
    let name = toml_edit::Value::from(name.as_str()).to_string();
    let name = name.trim();
    // `diffuse` would replace the image.
    let key = if texture.is_some() { "tint" } else { "diffuse" };
    let mut text = format!("#\n# [[material]]\n# name = {name}\n# {key} = {}\n", vector(*diffuse));
    if material.may_be_glossy() {
        let _ = writeln!(text, "# specular = {}\n# exponent = {exponent}", vector(*specular));
    }
    if *emission != glam::Vec3::ZERO {
        let _ = writeln!(text, "# emission = {}", vector(*emission));
    }
    text + &format!("# editable = {editable}\n")
}

fn vector(value: glam::Vec3) -> String {
    format!("[{}, {}, {}]", value.x, value.y, value.z)
}

/// A line of a comment: names come from files of strangers.
fn one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
