//! The document: the lights, materials and models that the user edits. It is a plain value. Panels
//! change it, the session applies it to the renderer, and the history stores copies of it.

use glam::Vec3;

use crate::scene::meter::Meter;
use crate::scene::save::PlacedModel;
use crate::scene::{Light, Material, Scene};

/// Longest undo history, in edits.
const MAX_STEPS: usize = 1000;

/// The editable state of a scene.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Document {
    /// In the order of the panel's list.
    pub(super) lights: Vec<LightEntry>,
    /// In the scene's order.
    pub(super) materials: Vec<MaterialEdit>,
    /// In the order of the scene file; new ones follow.
    pub(super) meters: Vec<Meter>,
    pub(super) parts: Parts,
}

/// What the scene is loaded with. An edit of it loads the scene anew.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Parts {
    /// In the order of the scene file; models that the user added follow.
    pub(super) models: Vec<PlacedModel>,
    /// Path of the sky's image that the user has chosen. `None`: the sky of the scene file.
    pub(super) sky_image: Option<String>,
    /// What the user has chosen for each material, in the scene's order. `None`: as it was loaded.
    pub(super) images: Vec<Option<ChosenImage>>,
}

/// What the user has chosen as the image of a material, with the diffuse albedo of that time: the
/// roulette of light paths depends on it, and later edits change it without tracing.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum ChosenImage {
    /// No image: the material has this colour.
    Colour(Vec3),
    /// The image at this path, which is multiplied with that.
    File(String, Vec3),
}

/// A light with an identifier that survives renaming and reordering.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LightEntry {
    pub(super) id: u64,
    pub(super) light: Light,
}

/// The editable properties of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MaterialEdit {
    pub(super) diffuse: Vec3,
    pub(super) specular: Vec3,
    pub(super) exponent: f32,
    /// Its light paths let it become glossy. An edit of this traces them again.
    pub(super) editable: bool,
}

impl Document {
    /// The document of a freshly loaded scene with these models.
    pub(super) fn from_scene(scene: &Scene, models: Vec<PlacedModel>) -> Self {
        let entry = |(id, light): (u64, &Light)| LightEntry { id, light: light.clone() };
        Self {
            lights: (0..).zip(&scene.lights).map(entry).collect(),
            materials: scene.materials.iter().map(MaterialEdit::from_material).collect(),
            meters: scene.meters.clone(),
            parts: Parts { models, sky_image: None, images: vec![None; scene.materials.len()] },
        }
    }

    /// Adds a light under a unique name and returns its index.
    pub(super) fn add(&mut self, mut light: Light) -> usize {
        let stem = light.name.trim_end_matches(|c: char| c.is_ascii_digit()).to_owned();
        let is_taken = |name: &str| self.lights.iter().any(|entry| entry.light.name == name);
        if is_taken(&light.name) {
            let free = (2..).map(|number| format!("{stem}{number}")).find(|name| !is_taken(name));
            light.name = free.expect("numbers do not end");
        }
        let id = self.lights.iter().map(|entry| entry.id + 1).max().unwrap_or(0);
        self.lights.push(LightEntry { id, light });
        self.lights.len() - 1
    }

    /// Writes the edits into the scene's materials.
    pub(super) fn apply_materials(&self, materials: &mut [Material]) {
        for (material, edit) in materials.iter_mut().zip(&self.materials) {
            let MaterialEdit { diffuse, specular, exponent, editable } = *edit;
            *material = Material { diffuse, specular, exponent, editable, ..material.clone() };
        }
    }
}

impl Document {
    /// Whether each material may become glossy.
    pub(super) fn editable(&self) -> Vec<bool> {
        self.materials.iter().map(|edit| edit.editable).collect()
    }
}

impl MaterialEdit {
    pub(super) fn from_material(material: &Material) -> Self {
        let Material { diffuse, specular, exponent, editable, .. } = *material;
        Self { diffuse, specular, exponent, editable }
    }
}

/// The undo and redo steps of a document.
#[derive(Clone)]
pub(super) struct History {
    past: Vec<Document>,
    future: Vec<Document>,
    /// The document at the end of the last edit.
    now: Document,
}

impl History {
    pub(super) fn new(document: &Document) -> Self {
        Self { past: Vec::new(), future: Vec::new(), now: document.clone() }
    }

    /// Ends an edit and makes its change one step. Returns false if nothing changed.
    pub(super) fn settle(&mut self, document: &Document) -> bool {
        if *document == self.now {
            return false;
        }
        let before = std::mem::replace(&mut self.now, document.clone());
        self.keep(before);
        self.future.clear();
        true
    }

    /// Records a reload of the scene as one step. All stored documents are converted by `rebased`,
    /// and the steps that can be redone stay.
    pub(super) fn reload(
        &mut self,
        document: &Document,
        rebased: impl Fn(&Document) -> Document,
        loaded: &Document,
    ) {
        self.settle(document);
        self.rebase(rebased);
        let before = std::mem::replace(&mut self.now, loaded.clone());
        if before != self.now {
            self.keep(before);
        }
    }

    /// Converts each stored document to another scene.
    pub(super) fn rebase(&mut self, rebased: impl Fn(&Document) -> Document) {
        for document in self.past.iter_mut().chain(&mut self.future).chain([&mut self.now]) {
            *document = rebased(document);
        }
    }

    fn keep(&mut self, before: Document) {
        self.past.push(before);
        if self.past.len() > MAX_STEPS {
            self.past.remove(0);
        }
    }

    /// The state before the edit under way, the undone or the last one that satisfies `is_wanted`.
    pub(super) fn nearest(&self, is_wanted: impl Fn(&Document) -> bool) -> Option<&Document> {
        let states = [Some(&self.now), self.future.last(), self.past.last()];
        states.into_iter().flatten().find(|document| is_wanted(document))
    }

    /// Reverts the last step because the device refused it; `document` is the state before. An edit
    /// leaves no step, and an undone step is redone.
    pub(super) fn refuse(&mut self, document: &Document) {
        if *document == self.now {
            return;
        }
        if self.future.last() == Some(document) {
            self.redo(&mut self.now.clone());
        } else if self.past.last() == Some(document) {
            self.past.pop();
            self.now = document.clone();
        }
    }

    /// Undoes the last edit, or the edit under way. False if there is none.
    pub(super) fn undo(&mut self, document: &mut Document) -> bool {
        self.settle(document);
        let Some(before) = self.past.pop() else { return false };
        self.future.push(std::mem::replace(&mut self.now, before));
        document.clone_from(&self.now);
        true
    }

    /// Redoes the edit that was undone last. False if there is none.
    pub(super) fn redo(&mut self, document: &mut Document) -> bool {
        self.settle(document);
        let Some(after) = self.future.pop() else { return false };
        self.past.push(std::mem::replace(&mut self.now, after));
        document.clone_from(&self.now);
        true
    }

    /// Numbers of steps to undo and to redo.
    pub(super) fn depths(&self) -> [usize; 2] {
        [self.past.len(), self.future.len()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::LightKind;

    fn light(name: &str) -> Light {
        Light::new(name, LightKind::Point { position: Vec3::ZERO, intensity: Vec3::ONE })
    }

    fn document() -> Document {
        let (diffuse, specular) = (Vec3::splat(0.5), Vec3::ZERO);
        let edit = MaterialEdit { diffuse, specular, exponent: 1.0, editable: false };
        let mut document = Document { materials: vec![edit], ..Document::default() };
        document.add(light("lamp"));
        document
    }

    #[test]
    fn names_and_numbers_of_lights_are_their_own() {
        let mut document = document();
        assert_eq!(document.add(light("lamp")), 1);
        document.add(light("lamp2"));
        let names: Vec<&str> = document.lights.iter().map(|entry| entry.light.name.as_str()).collect();
        assert_eq!(names, ["lamp", "lamp2", "lamp3"]);
        document.lights.remove(0);
        document.add(light("lamp"));
        let ids: Vec<u64> = document.lights.iter().map(|entry| entry.id).collect();
        assert_eq!(ids, [1, 2, 3]);
    }

    #[test]
    fn what_was_done_can_be_taken_back_and_done_again() {
        let mut document = document();
        let mut history = History::new(&document);
        let mut states = vec![document.clone()];
        for step in 1..5 {
            document.materials[0].exponent = step as f32 * 10.0;
            history.settle(&document);
            // No change, no step.
            history.settle(&document);
            states.push(document.clone());
        }
        for expected in states.iter().rev().skip(1) {
            assert!(history.undo(&mut document));
            assert_eq!(document, *expected);
        }
        assert!(!history.undo(&mut document));
        for expected in &states[1..] {
            assert!(history.redo(&mut document));
            assert_eq!(document, *expected);
        }
        assert!(!history.redo(&mut document));
        // A new edit clears the redo steps. An edit under way is a step of its own.
        history.undo(&mut document);
        document.lights[0].light.is_on = false;
        assert!(!history.redo(&mut document));
        assert_eq!(history.depths(), [4, 0]);
        assert!(history.undo(&mut document) && document.lights[0].light.is_on);
    }

    #[test]
    fn what_could_not_be_had_is_no_step() {
        let mut document = document();
        let mut history = History::new(&document);
        let first = document.clone();
        document.materials[0].exponent = 2.0;
        history.settle(&document);
        let second = document.clone();
        // An edit, while it is under way and after its end.
        document.materials[0].exponent = 3.0;
        for ends in [false, true] {
            if ends {
                history.settle(&document);
            }
            history.refuse(&second);
            assert!(!history.settle(&second));
            assert_eq!(history.depths(), [1, 0]);
        }
        // An undone step.
        document = second.clone();
        assert!(history.undo(&mut document) && document == first);
        history.refuse(&second);
        assert!(!history.settle(&second));
        assert_eq!(history.depths(), [1, 0]);
        document = second;
        assert!(history.undo(&mut document) && document == first);
    }

    #[test]
    fn the_oldest_steps_are_forgotten() {
        let mut document = document();
        let mut history = History::new(&document);
        for step in 0..MAX_STEPS + 10 {
            document.materials[0].exponent = step as f32 + 2.0;
            history.settle(&document);
        }
        assert_eq!(history.depths(), [MAX_STEPS, 0]);
    }
}
