//! What can be edited between frames. Each edit marks what it puts out of date; the next frame redoes that.

use super::Renderer;
use super::changes::{Changes, Work};
use crate::error::Result;
use crate::scene::{Light, LightKind};
use crate::types::View;
use glam::Vec3;

impl Renderer {
    /// Moves the light of that index, of any kind but the directional one.
    ///
    /// # Errors
    /// The device failed.
    pub fn move_light(&mut self, light: usize, to: Vec3) -> Result<()> {
        self.set_light(light, self.scene.lights[light].kind.moved_to(to))
    }

    /// Replaces a light: its kind, place, direction or colour. A change of emission
    /// alone traces nothing.
    ///
    /// # Errors
    /// The device failed.
    pub fn set_light(&mut self, light: usize, kind: LightKind) -> Result<()> {
        let old = std::mem::replace(&mut self.scene.lights[light].kind, kind);
        if old == kind {
            return Ok(());
        }
        if old.with_emission(Vec3::ONE) != kind.with_emission(Vec3::ONE) {
            self.lights.moved(light);
        }
        self.changes.emission |= old.emission() != kind.emission();
        self.lights.upload(&self.scene.lights)
    }

    /// Switches a light. It keeps what was traced of it.
    ///
    /// # Errors
    /// The device failed.
    pub fn switch_light(&mut self, light: usize, is_on: bool) -> Result<()> {
        self.changes.emission |= self.lights.switch(light, is_on);
        self.lights.upload(&self.scene.lights)
    }

    /// Whether a light is on.
    pub fn light_is_on(&self, light: usize) -> bool {
        self.lights.is_on(light)
    }

    /// Adds a light behind the others.
    ///
    /// # Errors
    /// The device lacks memory or failed.
    pub fn add_light(&mut self, light: Light) -> Result<()> {
        self.lights.add()?;
        self.changes.emission = true;
        self.scene.lights.push(light);
        self.lights.upload(&self.scene.lights)
    }

    /// Removes a light; those behind it move up by one.
    ///
    /// # Errors
    /// The device failed.
    pub fn remove_light(&mut self, light: usize) -> Result<Light> {
        self.lights.remove(light);
        self.changes.emission = true;
        let removed = self.scene.lights.remove(light);
        self.lights.upload(&self.scene.lights)?;
        Ok(removed)
    }

    /// Changes a material's diffuse albedo. Exact downwards; far above the albedo at
    /// load, paths that would matter were ended early, and indirect light comes out low.
    ///
    /// # Errors
    /// The device failed.
    pub fn set_diffuse(&mut self, material: usize, diffuse: Vec3) -> Result<()> {
        let old = std::mem::replace(&mut self.scene.materials[material].diffuse, diffuse);
        if old == diffuse {
            return Ok(());
        }
        self.changes.materials = true;
        self.buffers.materials.write(&crate::passes::reflectances(&self.scene.materials))
    }

    /// Looks from elsewhere; the image keeps its size.
    pub fn move_camera(&mut self, position: Vec3, target: Vec3) {
        let camera = &mut self.scene.cameras[0];
        if (camera.position, camera.target) == (position, target) {
            return;
        }
        (camera.position, camera.target) = (position, target);
        self.view = View::from(&*camera);
        self.view_changed();
    }

    /// Brightens the displayed picture by so many stops, from the next frame on.
    pub fn set_exposure(&mut self, stops: f32) {
        self.changes.exposure |= self.exposure_stops != stops;
        self.exposure_stops = stops;
    }

    /// Makes the next frame do that work although nothing has changed.
    pub fn force(&mut self, work: Work) {
        match work {
            Work::Everything => {
                self.changes = Changes::ALL;
                (0..self.scene.lights.len()).for_each(|light| self.lights.moved(light));
            }
            Work::Light(light) => self.lights.moved(light),
            Work::Colour => self.changes.emission = true,
            Work::View => self.view_changed(),
            Work::Material => self.changes.materials = true,
        }
    }

    /// Whether frames leave out what cannot change the picture, which they do unless told otherwise: stages that depend on
    /// nothing that was edited, lights that are off, rays that cannot bring light.
    pub fn set_skipping(&mut self, skips: bool) {
        self.skips = skips;
        self.lights.traces_all = !skips;
    }

    pub(super) fn view_changed(&mut self) {
        self.changes.view = true;
        self.lights.view_changed();
    }
}
