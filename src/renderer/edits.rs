//! What can be edited between frames.

#[cfg(doc)]
use super::Edit;
use super::Renderer;
use crate::error::Result;
use crate::scene::{Light, LightKind};
use crate::types::View;
use glam::Vec3;

impl Renderer {
    /// Moves the light of that index, of any kind but the directional one; the next frame wants [`Edit::Light`].
    ///
    /// # Errors
    /// The device failed.
    pub fn move_light(&mut self, light: usize, to: Vec3) -> Result<()> {
        self.set_light(light, self.scene.lights[light].kind.moved_to(to))
    }

    /// Replaces a light: its kind, place, direction or colour; the next frame wants [`Edit::Light`]. A change of emission
    /// alone traces nothing.
    ///
    /// # Errors
    /// The device failed.
    pub fn set_light(&mut self, light: usize, kind: LightKind) -> Result<()> {
        let old = std::mem::replace(&mut self.scene.lights[light].kind, kind);
        if old.with_emission(Vec3::ONE) != kind.with_emission(Vec3::ONE) {
            self.lights.moved(light);
        }
        self.lights.upload(&self.scene.lights)
    }

    /// Switches a light; the next frame wants [`Edit::Light`]. It keeps what was traced of it.
    ///
    /// # Errors
    /// The device failed.
    pub fn switch_light(&mut self, light: usize, is_on: bool) -> Result<()> {
        self.lights.switch(light, is_on);
        self.lights.upload(&self.scene.lights)
    }

    /// Whether a light is on.
    pub fn light_is_on(&self, light: usize) -> bool {
        self.lights.is_on(light)
    }

    /// Adds a light behind the others; the next frame wants [`Edit::Light`].
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn add_light(&mut self, light: Light) -> Result<()> {
        self.lights.add()?;
        self.scene.lights.push(light);
        self.lights.upload(&self.scene.lights)
    }

    /// Removes a light; those behind it move up by one. The next frame wants [`Edit::Light`].
    ///
    /// # Errors
    /// The device failed.
    pub fn remove_light(&mut self, light: usize) -> Result<Light> {
        self.lights.remove(light);
        let removed = self.scene.lights.remove(light);
        self.lights.upload(&self.scene.lights)?;
        Ok(removed)
    }

    /// Changes a material's diffuse albedo; the next frame wants [`Edit::Material`]. Exact downwards; far above the albedo at
    /// load, paths that would matter were ended early, and indirect light comes out low.
    ///
    /// # Errors
    /// The device failed.
    pub fn set_diffuse(&mut self, material: usize, diffuse: Vec3) -> Result<()> {
        self.scene.materials[material].diffuse = diffuse;
        self.buffers.materials.write(&crate::passes::reflectances(&self.scene.materials))
    }

    /// Looks from elsewhere; the image keeps its size; the next frame wants [`Edit::View`].
    pub fn move_camera(&mut self, position: Vec3, target: Vec3) {
        let camera = &mut self.scene.cameras[0];
        (camera.position, camera.target) = (position, target);
        self.view = View::from(&*camera);
    }

    /// Brightens the displayed picture by so many stops, from the next frame on.
    pub fn set_exposure(&mut self, stops: f32) {
        self.exposure_stops = stops;
    }
}
