//! What the user edits: lights, materials, exposure. A plain value: panels change it, the session
//! brings the renderer into line, and the history keeps copies of it.

use glam::Vec3;

use crate::scene::{Light, Material, Scene};

/// Edits that can be taken back, at most.
const MAX_STEPS: usize = 1000;

/// Everything that can be edited.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Document {
    /// In the order in which they are listed.
    pub(super) lights: Vec<LightEntry>,
    /// As in the scene.
    pub(super) materials: Vec<MaterialEdit>,
}

/// A light, and which one it is whatever becomes of its name and its place in the list.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct LightEntry {
    pub(super) id: u64,
    pub(super) light: Light,
}

/// What of a material can be edited.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct MaterialEdit {
    pub(super) diffuse: Vec3,
    pub(super) specular: Vec3,
    pub(super) exponent: f32,
}

impl Document {
    /// A scene as it was loaded.
    pub(super) fn of(scene: &Scene) -> Self {
        let entry = |(id, light): (u64, &Light)| LightEntry { id, light: light.clone() };
        Self {
            lights: (0..).zip(&scene.lights).map(entry).collect(),
            materials: scene.materials.iter().map(MaterialEdit::from_material).collect(),
        }
    }

    /// Adds a light under a name that no other has, and returns its place.
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

    /// The same with the edits in a scene's materials.
    pub(super) fn apply_materials(&self, materials: &mut [Material]) {
        for (material, edit) in materials.iter_mut().zip(&self.materials) {
            let MaterialEdit { diffuse, specular, exponent } = *edit;
            *material = Material { diffuse, specular, exponent, ..material.clone() };
        }
    }
}

impl MaterialEdit {
    pub(super) fn from_material(material: &Material) -> Self {
        let Material { diffuse, specular, exponent, .. } = *material;
        Self { diffuse, specular, exponent }
    }
}

/// Copies of the document as it was, and as it was before something was taken back.
#[derive(Clone)]
pub(super) struct History {
    past: Vec<Document>,
    future: Vec<Document>,
    /// As it was when the last edit ended.
    now: Document,
}

impl History {
    pub(super) fn new(document: &Document) -> Self {
        Self { past: Vec::new(), future: Vec::new(), now: document.clone() }
    }

    /// An edit has ended: what it changed is one step. Nothing, and false, if it changed nothing.
    pub(super) fn settle(&mut self, document: &Document) -> bool {
        if *document == self.now {
            return false;
        }
        let before = std::mem::replace(&mut self.now, document.clone());
        self.keep(before);
        self.future.clear();
        true
    }

    /// The scene was loaded again: its documents are `rebased`, and what it was before is one step
    /// back. What was taken back can still be done again.
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

    /// Replaces each document by the same on another scene.
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

    /// What was done last could not be had, and the document is what it was before: an edit is no
    /// step, and what was taken back is done again.
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

    /// Takes the last edit back, one that is under way first. False where there is none.
    pub(super) fn undo(&mut self, document: &mut Document) -> bool {
        self.settle(document);
        let Some(before) = self.past.pop() else { return false };
        self.future.push(std::mem::replace(&mut self.now, before));
        document.clone_from(&self.now);
        true
    }

    /// Does again what was taken back last. False where there is nothing.
    pub(super) fn redo(&mut self, document: &mut Document) -> bool {
        self.settle(document);
        let Some(after) = self.future.pop() else { return false };
        self.past.push(std::mem::replace(&mut self.now, after));
        document.clone_from(&self.now);
        true
    }

    /// Steps that can be taken back, and done again.
    pub(super) fn depths(&self) -> [usize; 2] {
        [self.past.len(), self.future.len()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::LightKind;

    fn light(name: &str) -> Light {
        Light {
            name: name.into(),
            kind: LightKind::Point { position: Vec3::ZERO, intensity: Vec3::ONE },
            is_on: true,
        }
    }

    fn document() -> Document {
        let edit = MaterialEdit { diffuse: Vec3::splat(0.5), specular: Vec3::ZERO, exponent: 1.0 };
        let mut document = Document { lights: Vec::new(), materials: vec![edit] };
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
            // Nothing has changed: no step.
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
        // A new edit cuts off what had been taken back; one under way is a step of its own.
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
        // An edit, before and after it has ended.
        document.materials[0].exponent = 3.0;
        for ends in [false, true] {
            if ends {
                history.settle(&document);
            }
            history.refuse(&second);
            assert!(!history.settle(&second));
            assert_eq!(history.depths(), [1, 0]);
        }
        // Something taken back.
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
