//! Snapshots of the session: keeping them, and restoring their edits.

use super::{Session, Stage};
use crate::app::demo::view_request::ViewRequest;
use crate::app::render::layers;
use crate::error::{Error, Result};
use crate::renderer::Layer;
use crate::scene::Camera;

/// Size of a picture, its pixels, and the layers of its lights.
type PictureLayers = ([u32; 2], Vec<[f32; 3]>, Vec<layers::Layer>);

impl Session {
    /// Keeps the shown picture and its edits. Returns the snapshot's name.
    ///
    /// # Errors
    /// There is no renderer yet, or too many snapshots; or the device failed.
    pub(in crate::app::demo) fn keep_snapshot(&mut self) -> Result<String> {
        let (Stage::Ready(ready), Some(shown)) = (&self.stage, &self.shown) else {
            let why = "a snapshot can be kept when the light paths are traced";
            return Err(Error::Usage(why.to_owned()));
        };
        let size = ready.renderer.size();
        self.snapshots.refuse_excess(size[0] as usize * size[1] as usize)?;
        let codes = ready.renderer.display()?;
        let radiance = ready.renderer.layer(Layer::Beauty)?;
        Ok(self.snapshots.keep(shown.clone(), size, radiance, codes))
    }

    /// Size and pixels of the picture, and the layers of its lights. It renders a frame for each
    /// light, and then the picture again.
    ///
    /// # Errors
    /// There are no light paths yet, or too many lights; or the device failed.
    pub(in crate::app::demo) fn layers_of_lights(&mut self) -> Result<PictureLayers> {
        self.end_frames(0)?;
        let Stage::Ready(ready) = &mut self.stage else {
            let why = "the layers can be saved when the light paths are traced";
            return Err(Error::Usage(why.to_owned()));
        };
        // Frames of other lights were shown.
        self.shown = None;
        let beauty = ready.renderer.layer(Layer::Beauty)?;
        let layers = layers::of_lights(&mut ready.renderer)?;
        Ok((ready.renderer.size(), beauty, layers))
    }

    /// Restores the edits of a snapshot: lights, materials and models as one step of the history;
    /// the camera and how radiance is displayed. It locks the exposure.
    pub(in crate::app::demo) fn restore_snapshot(&mut self, id: u64) {
        let Some(snapshot) = self.snapshots.get(id) else { return };
        let ViewRequest { document, camera, display, .. } = snapshot.shown.clone();
        self.history.settle(&self.document);
        self.document = document;
        self.history.settle(&self.document);
        self.camera = Camera { size: self.camera.size, ..camera };
        self.follow_exposure(false);
        self.display = display;
    }
}
