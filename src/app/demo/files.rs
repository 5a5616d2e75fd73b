//! Saving the edited scene and the picture.

use std::path::{Path, PathBuf};

use super::session::{CHANGED, Session};
use crate::app::output::OutputFile;
use crate::app::picture;
use crate::error::{Error, Result};
use crate::image::ExrLayer;
use crate::renderer::Layer;
use crate::scene::{Light, save::Edited, save::leads_outside};

/// Saves the edited scene; returns a message.
///
/// # Errors
/// The scene's own file has changes that were not loaded; and as [`Error::Output`].
pub(super) fn save_scene(session: &mut Session, to: &str) -> Result<String> {
    let is_own = session.watch.is_own(Path::new(to));
    if is_own && (session.is_asked || !session.watch.is_as_read()) {
        return Err(Error::output(to, CHANGED));
    }
    let said = write_scene(session, Path::new(to))?;
    session.take_as_saved();
    if is_own {
        session.watch.take_own_as_read();
    }
    Ok(said)
}

/// Saves the edited scene beside its file under a free name; returns a message.
pub(super) fn save_mine(session: &mut Session) -> Result<String> {
    let path = mine(Path::new(&session.source.spec));
    save_scene(session, &path.display().to_string())
}

/// The path for the user's own version of a scene: the first free one of
/// `NAME-mine.toml`, `NAME-mine-002.toml` …
fn mine(scene: &Path) -> PathBuf {
    let stem = scene.with_extension("");
    let first = PathBuf::from(format!("{}-mine.toml", stem.display()));
    let next = |number: u32| PathBuf::from(format!("{}-mine-{number:03}.toml", stem.display()));
    let mut names = std::iter::once(first).chain((2..).map(next));
    names.find(|path| path.symlink_metadata().is_err()).expect("numbers do not end")
}

/// Writes the edited scene; it stays unsaved. Returns a message.
pub(super) fn write_scene(session: &Session, path: &Path) -> Result<String> {
    if path.extension().is_none_or(|extension| extension != "toml") {
        return Err(Error::output(path, "is no name of a scene file: let it end in .toml"));
    }
    let output = OutputFile::check(path)?;
    let text = edited_text(session, path)?;
    output.write(|out| std::io::Write::write_all(out, text.as_bytes()))?;
    let note = if leads_outside(&text, path) {
        "; its models lie elsewhere: open it with --allow-outside"
    } else {
        ""
    };
    Ok(format!("saved {}{note}", path.display()))
}

/// The text of the edited scene for a file at `path`.
pub(super) fn edited_text(session: &Session, path: &Path) -> Result<String> {
    let lights: Vec<Light> = session.document.lights.iter().map(|entry| entry.light.clone()).collect();
    let mut materials = session.scene.materials.clone();
    session.document.apply_materials(&mut materials);
    let edited = Edited {
        camera: &session.camera,
        lights: &lights,
        materials: &materials,
        meters: Some(&session.document.meters),
        display: session.display,
    };
    let text = session.text.as_ref().map_err(|why| Error::Usage(why.clone()))?;
    text.with_edits(&edited, path)
}

/// Saves the edited scene under a free name beside its usual path; returns the new path.
pub(super) fn rescue_scene(session: &Session, scene_to: &str) -> Result<PathBuf> {
    let path = free_rescue_name(Path::new(scene_to));
    write_scene(session, &path)?;
    Ok(path)
}

/// The first free one of `NAME-rescued-001.toml`, `NAME-rescued-002.toml` …
pub(super) fn free_rescue_name(scene_to: &Path) -> PathBuf {
    let stem = scene_to.with_extension("");
    let free = |number: u32| PathBuf::from(format!("{}-rescued-{number:03}.toml", stem.display()));
    (1..).map(free).find(|path| !path.exists()).expect("numbers do not end")
}

/// Saves the picture and the direct and indirect light of each light as layers of an EXR beside the
/// scene. Returns a message.
pub(super) fn save_layers(session: &mut Session, scene_to: &str) -> Result<String> {
    let stem = Path::new(scene_to).with_extension("");
    let free = |number: u32| PathBuf::from(format!("{}-lights-{number:03}.exr", stem.display()));
    let path = (1..).map(free).find(|path| !path.exists()).expect("numbers do not end");
    let output = OutputFile::check(&path)?;
    let (size, beauty, layers) = session.layers_of_lights()?;
    let named = layers.iter().map(|layer| (&*layer.name, layer.channels, &layer.pixels));
    let all = std::iter::once(("", &["R", "G", "B"][..], &beauty)).chain(named);
    let all: Vec<_> = all.map(|(name, channels, pixels)| ExrLayer { name, channels, pixels }).collect();
    picture::write_exr(&output, size, &all, &[])?;
    Ok(format!("saved {} with {} layers of lights", path.display(), layers.len()))
}

/// Saves the picture beside the scene: tone-mapped as PNG and linear as EXR. Returns a message.
pub(super) fn save_picture(session: &Session, scene_to: &str) -> Result<String> {
    let renderer = session
        .renderer()
        .ok_or_else(|| Error::Usage("the picture can be saved when the light paths are traced".to_owned()))?;
    let size = renderer.size();
    let stem = Path::new(scene_to).with_extension("");
    let free = |number: u32| PathBuf::from(format!("{}-{number:03}.png", stem.display()));
    let png = (1..).map(free).find(|path| !path.exists()).expect("numbers do not end");
    let exr = png.with_extension("exr");
    let outputs = [OutputFile::check(&png)?, OutputFile::check(&exr)?];
    let display = renderer.display()?;
    let [beauty, direct, indirect] = [Layer::Beauty, Layer::Direct, Layer::Indirect];
    let layers = [renderer.layer(beauty)?, renderer.layer(direct)?, renderer.layer(indirect)?];
    picture::write_png(&outputs[0], size, &layers[0], &display)?;
    let named = ["", "direct", "indirect"].into_iter().zip(&layers);
    let named = named.map(|(name, pixels)| ExrLayer { name, channels: &["R", "G", "B"], pixels });
    let named: Vec<_> = named.collect();
    picture::write_exr(&outputs[1], size, &named, &[])?;
    Ok(format!("saved {} and {}", png.display(), exr.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ones_own_version_replaces_no_file() {
        let folder = tempfile::tempdir().unwrap();
        let file = |name: &str| folder.path().join(name);
        for name in ["room.v2-mine.toml", "room.v2-mine-002.toml", "room.v2-mine-003.toml"] {
            assert_eq!(mine(&file("room.v2.toml")), file(name));
            std::fs::write(file(name), "").unwrap();
        }
        assert_eq!(mine(&file("model.obj")), file("model-mine.toml"));
    }
}
