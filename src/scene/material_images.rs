//! Images that the scene file gives to materials.

use std::collections::{HashMap, HashSet};
use std::path::Path;
use std::sync::Arc;

use glam::DVec2;

use super::builtin::Files;
use super::geometry::Mesh;
use super::limits;
use super::material::Material;
use super::reading::Reading;
use super::texture::{BOUNDED, Image, Texture};
use super::value::{Kind, Node, Origin, Section};
use crate::Result;

/// Width of an image on faces without image coordinates, metres.
const WIDTH_M: f64 = 1.0;

/// The image that a `[[material]]` states.
pub(super) struct Given {
    image: Arc<Image>,
    /// Its size on faces without image coordinates, metres.
    size: DVec2,
}

impl Given {
    /// Gives the image to the material, which all of `meshes` have.
    pub(super) fn apply<'m>(&self, material: &mut Material, meshes: impl Iterator<Item = &'m mut Mesh>) {
        material.texture = Some(Texture { image: self.image.clone(), is_clamped: false, is_atlas: false });
        for mesh in meshes {
            mesh.colours.clear();
            mesh.laid_size = Some(self.size);
        }
    }
}

/// Names of the materials that the scene file gives an image: their faces need image coordinates.
pub(super) fn names(root: &Node) -> HashSet<String> {
    let Some(Node { kind: Kind::Array(materials), .. }) = root.get("material") else {
        return HashSet::new();
    };
    let named = materials.iter().filter(|material| material.get("image").is_some());
    named.filter_map(|material| Some(material.get("name")?.as_text()?.to_owned())).collect()
}

/// Reads the images of all `[[material]]`s that state one, by the material's name.
///
/// # Errors
/// An image is missing or damaged: unlike a model's, which is left out, the user has asked for it.
pub(super) fn read(
    file: &Path,
    root: &Node,
    files: &Files,
    reading: &mut Reading,
) -> Result<HashMap<String, Given>> {
    let mut given = HashMap::new();
    for section in Section::list(file, root, "material", limits::MATERIALS)? {
        let (Some(material), Some(name)) = (section.text("name")?, section.text("image")?) else { continue };
        let path = file.with_file_name(name);
        // The user's image may lie anywhere, also beside a built-in scene.
        let is_users = matches!(section.get("image"), Some(Node { origin: Origin::Flag(_), .. }));
        reading.files = match files {
            Files::Disk(_) | Files::Embedded if is_users => Files::Disk(None),
            files => files.clone(),
        };
        let decoded = reading.image(&path);
        let decoded = decoded.map_err(|why| section.fault_at("image", format!("{name:?} {why}")))?;
        let place = || format!("{}: material {material:?}", file.display());
        if decoded.is_bounded {
            reading.notes.add(BOUNDED, place);
        }
        if decoded.alpha.is_some() {
            reading.notes.add("the transparency of images is passed over", place);
        }
        if let Some(damage) = decoded.damage {
            reading.notes.add_named("images are damaged", &format!("{name:?} {damage}"), place);
        }
        let [width, height] = decoded.image.size.map(f64::from);
        let metres = section.number("image_width", 1e-6..=1e6)?.unwrap_or(WIDTH_M);
        let size = metres * DVec2::new(1.0, height / width);
        given.insert(material.to_owned(), Given { image: decoded.image, size });
    }
    Ok(given)
}
