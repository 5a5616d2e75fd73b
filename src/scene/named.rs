//! Lights, materials and meters by name.

use super::Scene;
use super::words::unknown;
use crate::{Error, Result};

impl Scene {
    /// The index of the light with this name.
    ///
    /// # Errors
    /// There is none: names that exist, and a similar one.
    pub fn light_named(&self, name: &str) -> Result<usize> {
        index("light", self.lights.iter().map(|light| light.name.as_str()), name)
    }

    /// The index of the material with this name.
    ///
    /// # Errors
    /// There is none, as for [`Self::light_named`].
    pub fn material_named(&self, name: &str) -> Result<usize> {
        index("material", self.materials.iter().map(|material| material.name.as_str()), name)
    }

    /// The index of the camera with this name.
    ///
    /// # Errors
    /// There is none, as for [`Self::light_named`].
    pub fn camera_named(&self, name: &str) -> Result<usize> {
        index("camera", self.cameras.iter().map(|camera| camera.name.as_str()), name)
    }
}

fn index<'a>(what: &str, names: impl Iterator<Item = &'a str>, name: &str) -> Result<usize> {
    let names: Vec<&str> = names.collect();
    let found = names.iter().position(|known| *known == name);
    found.ok_or_else(|| Error::Usage(unknown(what, &names, name)))
}

#[cfg(test)]
mod tests {
    use crate::scene::{LoadOptions, Scene};

    #[test]
    fn an_unknown_name_is_refused_with_a_similar_one() {
        let scene = Scene::load("box", &LoadOptions::default()).unwrap();
        assert_eq!(scene.light_named("lamp").unwrap(), 0);
        let line = scene.light_named("lump").unwrap_err().to_string();
        assert!(line.contains("`lump`") && line.contains("did you mean `lamp`?"), "{line}");
        assert!(scene.material_named("lamp").is_err());
    }
}
