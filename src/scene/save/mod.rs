//! Saves the edited scene to a file: the text that it was loaded from, with the changes applied.
//!
//! Loading the saved file gives the same scene bit for bit: triangles, origin, lights,
//! materials, cameras, quality. The exception is coordinates next to zero far from the world's
//! origin, see `scene/numbers.rs`.

mod edits;
mod meters;
mod models;
mod paths;
mod text;

use std::collections::HashMap;
use std::path::Path;

use glam::{DVec3, Vec3};

use super::builtin::{self, Files};
use super::file::{Source, read_cameras, read_lights};
use super::material::Override;
use super::meter::{self, Meter};
use super::value::{Kind, Node, Origin, Section};
use super::{
    Camera, DisplayTransform, Light, LightKind, LoadOptions, Material, PictureKeys, Quality, Scene, fit,
    limits,
};
use crate::Result;
pub use models::PlacedModel;
pub use paths::relative_to;

/// A scene's file at the time of loading, to which edits are applied.
#[derive(Clone)]
pub struct SceneText {
    /// The source with all changes of the load options.
    source: Source,
    /// Index in the file of each camera.
    cameras: Vec<usize>,
    materials: Vec<Material>,
    origin: DVec3,
}

/// The editable parts of a scene. All else is saved as it was loaded.
#[derive(Clone, Copy, Debug)]
pub struct Edited<'a> {
    /// The first camera. Its position, target, up direction and field of view are saved, but not
    /// its name and size.
    pub camera: &'a Camera,
    /// All lights, recentred as the scene is; names identify them.
    pub lights: &'a [Light],
    /// All materials, in the scene's order.
    pub materials: &'a [Material],
    /// All light meters, recentred. `None`: as they were loaded.
    pub meters: Option<&'a [Meter]>,
    /// How the picture is displayed.
    pub display: DisplayTransform,
}

impl<'a> Edited<'a> {
    /// The editable parts of a scene. Meters stay as they were loaded: many scenes are used without
    /// their meters.
    pub fn from_scene(scene: &'a Scene) -> Self {
        Self {
            camera: &scene.cameras[0],
            lights: &scene.lights,
            materials: &scene.materials,
            meters: None,
            display: scene.picture.over(DisplayTransform::default()),
        }
    }
}

impl SceneText {
    /// Reads the text that `scene` has just been loaded from with the same arguments. The
    /// image size and the name of a chosen camera are not saved. Other changes by the options are
    /// saved as values.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub fn new(spec: &str, options: &LoadOptions, scene: &Scene) -> Result<Self> {
        let (mut source, others) = Source::prepare(spec, options)?;
        source.take_cameras(scene);
        let (camera, lights) = (scene.cameras[0].clone(), scene.lights.clone());
        let emits = lights.iter().any(|light| matches!(light.kind, LightKind::Surface { .. }));
        let sky = lights.iter().find_map(|light| match light.kind {
            LightKind::Sky { radiance, .. } => Some(radiance),
            _ => None,
        });
        // Emission has no section of a light.
        let lights: Vec<Light> = lights.into_iter().filter(|light| !light.kind.is_fixed()).collect();
        let is_lit = lights.is_empty() && sky.is_none();
        let chosen = fit::Chosen { camera, lights, sky, is_lit, said: [const { String::new() }; 2] };
        source.complete(scene.origin, |_| Ok(chosen), emits, &mut Vec::new())?;
        source.change(&others, options)?;
        let names = read_cameras(&source.file, &source.root, scene.origin)?;
        let chosen = options.camera.as_ref();
        let first = chosen.and_then(|name| names.iter().position(|camera| camera.name == *name)).unwrap_or(0);
        let mut cameras: Vec<usize> = (0..names.len()).collect();
        cameras[..=first].rotate_right(1);
        Ok(Self { source, cameras, materials: scene.materials.clone(), origin: scene.origin })
    }

    /// The scene's models, in the order of the file.
    pub fn models(&self) -> Vec<PlacedModel> {
        match self.source.root.get("model") {
            Some(Node { kind: Kind::Array(models), .. }) => models.iter().map(PlacedModel::read).collect(),
            _ => Vec::new(),
        }
    }

    /// The image of the scene's sky. `None` if it has none.
    pub fn sky_image(&self) -> Option<String> {
        let name = self.source.root.get("environment")?.get("image")?.as_text()?;
        Some(self.source.file.with_file_name(name).to_string_lossy().into_owned())
    }

    /// The images that the scene file gives to materials, by the material's name.
    pub fn material_images(&self) -> HashMap<String, String> {
        let tables = match self.source.root.get("material") {
            Some(Node { kind: Kind::Array(tables), .. }) => &tables[..],
            _ => &[],
        };
        let named = tables.iter().filter_map(|table| {
            let path = self.source.file.with_file_name(table.get("image")?.as_text()?);
            Some((table.get("name")?.as_text()?.to_owned(), path.to_string_lossy().into_owned()))
        });
        named.collect()
    }

    /// The text of the edited scene, to be saved at `to`: models' paths are relative to that.
    /// Comments, order and layout of unchanged parts stay. Removed lights are omitted, new ones
    /// follow the others, and changed materials become `[[material]]`s. If no light is left, the
    /// text has `light = []`. A model that only a built-in scene has is named by `built_in`.
    ///
    /// A scene file cannot distinguish materials with the same name: the first one that has changed
    /// applies to all.
    ///
    /// # Errors
    /// [`Error::Input`] for an edit that a scene file cannot express: a field of view of 180°.
    pub fn with_edits(&self, edited: &Edited, to: &Path) -> Result<String> {
        let mut root = self.source.root.clone();
        self.place_models(&mut root, to)?;
        if let Some(sky) = root.get_mut("environment") {
            self.place_image(sky, to)?;
        }
        if let Some(Node { kind: Kind::Array(materials), .. }) = root.get_mut("material") {
            materials.iter_mut().try_for_each(|material| self.place_image(material, to))?;
        }
        let cameras = self.edit_cameras(&mut root, edited.camera);
        let lights = edits::lights(&mut root, edited.lights, self.origin, [&self.source.file, to])?;
        edits::materials(&mut root, &self.materials, edited.materials);
        PictureKeys::read(&self.source.file, &root)?.write(&edited.display, &mut root);
        edits::emissions(&mut root, &self.materials, edited.lights);
        let mut from = vec![("camera", cameras), ("light", lights)];
        if let Some(edited) = edited.meters {
            from.push(("meter", meters::write(&mut root, edited, self.origin)));
        }
        let text = text::write(&self.source.text, &root, &from)?;
        self.check(to, &text)?;
        Ok(text)
    }

    /// Adapts the models' paths to the new location.
    fn place_models(&self, root: &mut Node, to: &Path) -> Result<()> {
        let Some(Node { kind: Kind::Array(models), .. }) = root.get_mut("model") else { return Ok(()) };
        for model in models {
            let Some(name) = model.get("file").and_then(Node::as_text) else { continue };
            let path = self.source.file.with_file_name(name);
            match self.source.files {
                Files::Embedded => {
                    let stem = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
                    if builtin::model(&stem).is_some() {
                        *model = without(model, "file");
                        model.set("built_in", node(Kind::Text(stem)));
                    }
                }
                Files::Disk(_) | Files::Memory(_) => {
                    if let Some(path) = paths::moved(&path, &self.source.file, to)? {
                        model.set("file", node(Kind::Text(path)));
                    }
                }
            }
        }
        Ok(())
    }

    /// Adapts the path of an image, of the sky or a material, to the new location.
    fn place_image(&self, table: &mut Node, to: &Path) -> Result<()> {
        let Some(name) = table.get("image").and_then(Node::as_text) else { return Ok(()) };
        let path = self.source.file.with_file_name(name);
        // The window states an absolute path.
        let is_chosen = matches!(table.get("image"), Some(Node { origin: Origin::Flag(_), .. }));
        let placed = match is_chosen && path.is_absolute() {
            true => Some(relative_to(&path, to)?),
            false => paths::moved(&path, &self.source.file, to)?,
        };
        if let Some(path) = placed {
            table.set("image", node(Kind::Text(path)));
        }
        Ok(())
    }

    /// Reorders the cameras and edits the first. Returns the old index of each.
    fn edit_cameras(&self, root: &mut Node, camera: &Camera) -> Vec<Option<usize>> {
        match root.get_mut("camera") {
            Some(Node { kind: Kind::Array(cameras), .. }) => {
                *cameras = self.cameras.iter().map(|&index| cameras[index].clone()).collect();
                if let Some(first) = cameras.first_mut() {
                    edits::camera(first, camera, self.origin);
                }
            }
            Some(table) => edits::camera(table, camera, self.origin),
            None => {}
        }
        self.cameras.iter().copied().map(Some).collect()
    }

    /// Reads the saved text without its models, so that a file that cannot be loaded
    /// is never saved.
    fn check(&self, to: &Path, text: &str) -> Result<()> {
        let root = Node::parse(to, text)?;
        let anywhere = Files::Disk(None);
        let files = if let Files::Memory(_) = self.source.files { &self.source.files } else { &anywhere };
        read_lights(to, &root, self.origin, files)?;
        read_cameras(to, &root, self.origin)?;
        meter::read_all(to, &root, self.origin)?;
        for section in Section::list(to, &root, "material", limits::MATERIALS)? {
            Override::read(&section)?;
        }
        if let Some(node) = root.get("environment") {
            crate::scene::sky::check(&Section::new(to, "environment", node)?)?;
        }
        PictureKeys::read(to, &root)?;
        match root.get("quality") {
            Some(node) => Quality::read(&Section::new(to, "quality", node)?).map(|_| ()),
            None => Ok(()),
        }
    }
}

/// The `KEY=VALUE` change ([`LoadOptions::set`]) that gives a scene's sky an image.
pub fn sky_change(image: &str) -> String {
    format!("environment.image={}", toml_edit::Value::from(image))
}

/// The `KEY=VALUE` changes that give all materials of that name an image and its factor.
pub fn image_changes(material: &str, image: &str, tint: Vec3) -> [String; 2] {
    let material = toml_edit::Value::from(material);
    let image = toml_edit::Value::from(image);
    [format!("material.{material}.image={image}"), format!("material.{material}.tint={:?}", tint.to_array())]
}

/// The `KEY=VALUE` change that gives all materials of that name a colour instead of an image.
pub fn colour_change(material: &str, diffuse: Vec3) -> String {
    format!("material.{}.diffuse={:?}", toml_edit::Value::from(material), diffuse.to_array())
}

/// Whether a scene file with that text at `file` names files outside of its folder. Opening it
/// then needs permission.
pub fn leads_outside(text: &str, file: &Path) -> bool {
    let Ok(root) = Node::parse(file, text) else { return false };
    let in_list = |section, key| {
        let tables = match root.get(section).map(|node| &node.kind) {
            Some(Kind::Array(tables)) => &tables[..],
            _ => &[],
        };
        tables.iter().filter_map(move |table: &Node| table.get(key)?.as_text())
    };
    let image = root.get("environment").and_then(|sky| sky.get("image")?.as_text());
    in_list("model", "file")
        .chain(in_list("light", "ies"))
        .chain(in_list("material", "image"))
        .chain(image)
        .any(|name| Files::beside(file).locate(&file.with_file_name(name)).is_err())
}

fn node(kind: Kind) -> Node {
    Node { origin: Origin::Flag("edited".to_owned()), kind }
}

/// A table without one of its keys.
fn without(table: &Node, key: &str) -> Node {
    let mut table = table.clone();
    if let Kind::Table(entries) = &mut table.kind {
        entries.retain(|(name, _)| name != key);
    }
    table
}
