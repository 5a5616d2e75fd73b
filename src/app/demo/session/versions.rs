//! Other versions of the session's scene: changed files, presets, shaders and models. Edits stay.

use std::collections::HashMap;

use glam::Vec3;

use super::{Session, Source, Stage};
use crate::app::demo::document::{ChosenImage, Document, Parts};
use crate::app::demo::rebase::Rebase;
use crate::app::demo::watch::Watch;
use crate::error::{Error, Result};
use crate::renderer::{Renderer, Work};
use crate::scene::save::{PlacedModel, SceneText, colour_change, image_changes, sky_change};
use crate::scene::{Camera, LoadOptions, Material, Scene};

impl Session {
    /// Takes lights, materials, models and camera of another scene file over, as one edit.
    ///
    /// # Errors
    /// As [`Scene::load`].
    pub(in crate::app::demo) fn restore(&mut self, spec: &str) -> Result<()> {
        let allow_outside = self.source.options.allow_outside;
        let options = LoadOptions { allow_outside, ..LoadOptions::default() };
        let scene = Scene::load(spec, &options)?;
        let text = SceneText::new(spec, &options, &scene)?;
        let rebase = Rebase::new(&scene, &self.scene);
        self.document = rebase.document(&Document::from_scene(&scene, text.models()));
        let own = self.text.as_ref().ok();
        let sky = own.and_then(SceneText::sky_image);
        self.document.parts.sky_image = text.sky_image().filter(|image| sky.as_ref() != Some(image));
        let own = own.map(SceneText::material_images).unwrap_or_default();
        self.document.parts.images = chosen_images((&self.scene, &own), (&scene, &text.material_images()));
        self.camera = Camera { size: self.camera.size, ..rebase.camera(&scene.cameras[0]) };
        self.history.settle(&self.document);
        Ok(())
    }

    /// Reloads the scene, as one undo step. Returns the conversion of the edits. `None` if the
    /// scene cannot be read: the session stays, and a note gives the reason.
    pub(in crate::app::demo) fn reload(&mut self) -> Result<Option<Rebase>> {
        let Source { spec, options, .. } = self.source.clone();
        let watch = Watch::new(&spec);
        let scene = match Scene::load(&spec, &options) {
            Ok(scene) => scene,
            Err(error) => {
                self.said.push(not_loaded(&error));
                return Ok(None);
            }
        };
        let rebase = Rebase::new(&self.scene, &scene);
        let (document, mut history) = (self.document.clone(), self.history.clone());
        let file_models = self.models.len();
        self.replace(scene, watch, &rebase)?;
        let own = self.models.clone();
        let rebased = |document: &Document| {
            let mut document = rebase.document(document);
            document.parts.models = models_of(&own, document.parts.models.split_at(file_models));
            document
        };
        self.snapshots.rebase(rebased, |camera| rebase.camera(camera));
        history.reload(&document, rebased, &self.document);
        self.history = history;
        Ok(Some(rebase))
    }

    /// Why the scene's current files cannot be loaded. `None` if they can.
    pub(in crate::app::demo) fn why_unloadable(&self) -> Option<String> {
        Scene::load(&self.source.spec, &self.source.options).err().map(|error| not_loaded(&error))
    }

    /// Retraces the light paths with another preset; edits stay.
    ///
    /// # Errors
    /// The files have changed since they were read, which the user decides separately;
    /// and as [`Scene::load`].
    pub(in crate::app::demo) fn choose_preset(&mut self, preset: &str) -> Result<()> {
        if self.is_asked || !self.watch.is_as_read() {
            return Err(Error::Usage(format!("{} {CHANGED}", self.source.spec)));
        }
        let before = self.source.options.preset.replace(preset.to_owned());
        let done = self.load_parts();
        if done.is_err() {
            self.source.options.preset = before;
        }
        done
    }

    /// The options of the scene with the parts of the document.
    fn options(&self) -> LoadOptions {
        let mut options = self.source.options.clone();
        let Parts { models, sky_image, images } = &self.document.parts;
        for (number, model) in models.iter().enumerate() {
            options.set.extend(model.changes(number, self.models.get(number)));
        }
        options.set.extend(sky_image.iter().map(|image| sky_change(image)));
        for (material, image) in self.scene.materials.iter().zip(images) {
            match image {
                Some(ChosenImage::File(image, tint)) => {
                    options.set.extend(image_changes(&material.name, image, *tint));
                }
                Some(ChosenImage::Colour(diffuse)) => {
                    options.set.push(colour_change(&material.name, *diffuse));
                }
                None => (),
            }
        }
        options
    }

    /// Loads the scene anew if its parts differ from the document's, and prepares it again if its
    /// meters do. Takes an edit back that cannot be loaded.
    pub(super) fn follow_parts(&mut self) {
        if self.is_held || self.document.parts == self.loaded {
            return self.follow_meters();
        }
        let done = match self.is_asked || !self.watch.is_as_read() {
            true => Err(Error::Usage(format!("{} {CHANGED}", self.source.spec))),
            false => self.load_parts(),
        };
        if let Err(error) = done {
            match self.history.nearest(|document| document.parts == self.loaded) {
                Some(before) => self.document = before.clone(),
                None => self.document.parts.clone_from(&self.loaded),
            }
            self.history.refuse(&self.document);
            self.has_gone_back = true;
            self.alarm(format!("taken back: {error}"));
        }
    }

    /// Traces light paths anew if the meters differ: each has gather rays of its own.
    fn follow_meters(&mut self) {
        if self.is_held || self.paints || self.document.meters == self.scene.meters {
            return;
        }
        if let Err(error) = self.prepare_open(self.scene.clone()) {
            self.document.meters.clone_from(&self.scene.meters);
            self.history.refuse(&self.document);
            self.has_gone_back = true;
            self.alarm(format!("taken back: {error}"));
        }
    }

    /// Traces light paths again if the user has made a diffuse material glossy, or undone that.
    pub(super) fn follow_editable(&mut self) {
        let editable = self.document.editable();
        if self.is_held || editable == self.traced_editable {
            return;
        }
        let mut scene = self.scene.clone();
        for (index, material) in scene.materials.iter_mut().enumerate() {
            // A film may have made others editable.
            if editable[index] != self.traced_editable[index] {
                material.editable = editable[index];
            }
        }
        if let Err(error) = self.prepare_open(scene) {
            for (index, edit) in self.document.materials.iter_mut().enumerate() {
                if std::mem::replace(&mut edit.editable, self.traced_editable[index]) && !edit.editable {
                    edit.specular = Vec3::ZERO;
                }
            }
            self.history.refuse(&self.document);
            self.has_gone_back = true;
            self.alarm(format!("taken back: {error}"));
        }
    }

    fn load_parts(&mut self) -> Result<()> {
        let (options, watch) = (self.options(), Watch::new(&self.source.spec));
        let mut scene = Scene::load(&self.source.spec, &options)?;
        let text = SceneText::new(&self.source.spec, &options, &scene).map_err(|error| error.to_string());
        let models = self.models.clone();
        let document = Rebase::new(&self.scene, &scene).document(&self.document);
        for (material, edit) in scene.materials.iter_mut().zip(&document.materials) {
            material.editable = edit.editable;
        }
        self.prepare_again(scene, watch)?;
        (self.text, self.models) = (text, models);
        self.loaded.clone_from(&self.document.parts);
        Ok(())
    }

    /// Prepares another version of the same scene; edits stay. `watch`: its files, taken before
    /// they were read.
    fn prepare_again(&mut self, mut scene: Scene, watch: Watch) -> Result<()> {
        let rebase = Rebase::new(&self.scene, &scene);
        let (document, saved) = (rebase.document(&self.document), rebase.document(&self.saved));
        scene.meters.clone_from(&document.meters);
        let (mut history, is_asked) = (self.history.clone(), self.is_asked);
        history.rebase(|document| rebase.document(document));
        self.replace(scene, watch, &rebase)?;
        self.snapshots.rebase(|document| rebase.document(document), |camera| rebase.camera(camera));
        self.traced_editable = document.editable();
        (self.document, self.saved, self.history) = (document, saved, history);
        self.is_asked = is_asked;
        Ok(())
    }

    /// Requests a picture from replaced shaders. Returns whether light paths are traced again,
    /// because one of the shaders traces them.
    pub(in crate::app::demo) fn shaders_replaced(&mut self, stems: &[&str]) -> Result<bool> {
        if stems.iter().any(|stem| Renderer::runs_before_frames(stem)) {
            self.prepare_open(self.scene.clone())?;
            return Ok(true);
        }
        self.shown = None;
        if let Stage::Ready(ready) = &mut self.stage {
            ready.renderer.force(Work::Everything);
        }
        Ok(false)
    }

    /// Prepares the open scene again because the camera and a light are in one enclosure.
    pub(super) fn open_enclosure(&mut self) -> Result<()> {
        let mut scene = self.scene.clone();
        scene.interior_viewpoints.push(self.camera.position);
        self.said.push("the camera and a light are in one enclosure: light paths are traced again".into());
        self.prepare_open(scene)
    }

    /// Prepares another version of the open scene.
    pub(in crate::app::demo) fn prepare_open(&mut self, scene: Scene) -> Result<()> {
        let (watch, text, models) = (self.watch.clone(), self.text.clone(), self.models.clone());
        let loaded = self.loaded.clone();
        self.prepare_again(scene, watch)?;
        (self.text, self.models, self.loaded) = (text, models, loaded);
        Ok(())
    }

    /// Replaces the scene; camera, notes and snapshots stay.
    fn replace(&mut self, scene: Scene, watch: Watch, rebase: &Rebase) -> Result<()> {
        let next = Self::new(&self.context, self.source.clone(), scene, watch, self.wake.clone())?;
        let before = std::mem::replace(self, next);
        self.snapshots = before.snapshots;
        self.camera = rebase.camera(&before.camera);
        self.generation = before.generation;
        (self.display, self.unmetered) = (before.display, before.unmetered);
        self.follows_exposure = before.follows_exposure;
        (self.version, self.alarm, self.times_passes) =
            (before.version, before.alarm.clone(), before.times_passes);
        let new = std::mem::replace(&mut self.said, before.said.clone());
        self.said.extend(new.into_iter().filter(|line| !before.said.contains(line)));
        Ok(())
    }
}

/// What a user has chosen who turned the images of `own` into those of `edited`. Maps: images that
/// the scene files state.
fn chosen_images(
    own: (&Scene, &HashMap<String, String>),
    edited: (&Scene, &HashMap<String, String>),
) -> Vec<Option<ChosenImage>> {
    let chosen = |material: &Material| {
        let counterpart = edited.0.materials.iter().find(|other| other.name == material.name)?;
        let image = edited.1.get(&material.name);
        match image.filter(|image| own.1.get(&material.name) != Some(image)) {
            Some(image) => Some(ChosenImage::File(image.clone(), counterpart.diffuse)),
            None if material.texture.is_some() && counterpart.texture.is_none() => {
                Some(ChosenImage::Colour(counterpart.diffuse))
            }
            None => None,
        }
    };
    own.0.materials.iter().map(chosen).collect()
}

/// The models of a scene file, each where the user had it `before`; then the `added` models.
fn models_of(own: &[PlacedModel], (before, added): (&[PlacedModel], &[PlacedModel])) -> Vec<PlacedModel> {
    let mut before = before.to_vec();
    let mut place = |model: &PlacedModel| {
        let found = before.iter().position(|old| old.file == model.file && old.matrix == model.matrix);
        found.map_or_else(|| model.clone(), |place| before.remove(place))
    };
    let mut models: Vec<PlacedModel> = own.iter().map(&mut place).collect();
    models.extend_from_slice(added);
    models
}

/// The message if changed files on disk prevent an action.
pub(in crate::app::demo) const CHANGED: &str = "has changed on disk: load it again or keep yours first";

fn not_loaded(error: &Error) -> String {
    format!("not loaded again: {error}")
}
