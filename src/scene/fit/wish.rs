//! What the user and the models' formats decide about a chosen camera.

use std::path::Path;

use super::up::Up;
use crate::scene::value::{Kind, Node};
use crate::{Error, Result};

/// Where a chosen camera stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Place {
    /// In the model, a room.
    Inside,
    /// Around the model.
    Outside,
}

/// Decisions about a chosen camera. `None`: rays decide.
#[derive(Clone, Copy, Debug, Default)]
pub(in crate::scene) struct Wish {
    pub(in crate::scene) place: Option<Place>,
    pub(in crate::scene) up: Option<Up>,
}

impl Wish {
    /// Refuses flags for a scene that has a camera.
    pub(in crate::scene) fn refuse_for(self, file: &Path) -> Result<()> {
        let flag = match (self.place, self.up) {
            (None, None) => return Ok(()),
            (Some(Place::Inside), _) => "--inside",
            (Some(Place::Outside), _) => "--outside",
            (None, Some(_)) => "--up",
        };
        Err(Error::Usage(format!(
            "{flag} is for scenes without a camera, and {} has one: use --camera or --set camera.position=…",
            file.display()
        )))
    }

    /// The decisions for the models of a scene file: glTF states that +Y is up.
    pub(in crate::scene) fn for_models(self, root: &Node) -> Self {
        let is_gltf = |model: &Node| {
            let path = model.get("file").and_then(Node::as_text).map(Path::new);
            let ending = path.and_then(Path::extension).map(|ending| ending.to_ascii_lowercase());
            ending.is_some_and(|ending| ending == "gltf" || ending == "glb")
        };
        let states_up = match root.get("model") {
            Some(Node { kind: Kind::Array(models), .. }) => models.iter().all(is_gltf),
            _ => false,
        };
        Self { up: self.up.or(states_up.then_some(Up::Y)), ..self }
    }
}
