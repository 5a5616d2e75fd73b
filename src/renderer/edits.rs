//! Edits between frames. Each edit marks the results that it makes stale; the next
//! frame updates them.

use super::Renderer;
use super::changes::{Changes, Edited, Work};
use crate::error::{Error, Result};
use crate::passes::frame::gloss::is_little;
use crate::passes::precompute::path_orders::editable_bits;
use crate::scene::{Camera, Light, LightKind, Material};
use crate::types::View;
use glam::Vec3;
use std::ops::Range;

impl Renderer {
    /// Moves a light of any kind except directional lights.
    ///
    /// # Errors
    /// The device failed.
    pub fn move_light(&mut self, light: usize, to: Vec3) -> Result<()> {
        self.set_light(light, self.scene.lights[light].kind.moved_to(to))
    }

    /// Replaces a light: kind, position, direction or colour. A change of emission
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
        self.lights_changed()
    }

    /// Switches a light on or off. Its cached contributions stay.
    ///
    /// # Errors
    /// The device failed.
    pub fn switch_light(&mut self, light: usize, is_on: bool) -> Result<()> {
        self.scene.lights[light].is_on = is_on;
        self.lights_changed()
    }

    /// Whether a light is on.
    pub fn light_is_on(&self, light: usize) -> bool {
        self.scene.lights[light].is_on
    }

    /// Appends a light to the scene.
    ///
    /// # Errors
    /// The device lacks memory or failed; the light is then not added.
    pub fn add_light(&mut self, light: Light) -> Result<()> {
        self.lights.add()?;
        self.scene.lights.push(light);
        let changed = self.lights_changed();
        if changed.is_err() {
            self.lights.remove(self.scene.lights.len() - 1);
            self.scene.lights.pop();
        }
        changed
    }

    /// Removes a light and returns it. The indices of later lights decrease by one.
    ///
    /// # Errors
    /// The device failed.
    pub fn remove_light(&mut self, light: usize) -> Result<Light> {
        self.lights.remove(light);
        let removed = self.scene.lights.remove(light);
        self.lights_changed()?;
        Ok(removed)
    }

    fn lights_changed(&mut self) -> Result<()> {
        self.closed.is_due = true;
        let [emission, emission_scale] = self.lights.upload(&self.scene.lights)?;
        self.changes.emission |= emission;
        self.changes.emission_scale |= emission_scale;
        Ok(())
    }

    /// Changes a material's diffuse albedo, as [`Self::set_material`] does. The colours of its
    /// image are multiplied with it.
    ///
    /// # Errors
    /// The device failed.
    pub fn set_diffuse(&mut self, material: usize, diffuse: Vec3) -> Result<()> {
        let Material { specular, exponent, .. } = self.scene.materials[material];
        self.set_material(material, diffuse, specular, exponent)
    }

    /// Changes a material's diffuse and specular albedo and its Phong exponent. Albedos that
    /// reflect too much are lowered ([`Material::bound_albedo`]). If the material is editable, the
    /// picture equals that of a cold start bit by bit. If not, light paths were sampled for the old
    /// albedo: far above it, indirect light is noisier and tends to be too low.
    ///
    /// # Errors
    /// The material gets a lobe, but had none and is not editable; the device failed.
    pub fn set_material(
        &mut self,
        material: usize,
        diffuse: Vec3,
        specular: Vec3,
        exponent: f32,
    ) -> Result<()> {
        let old = &self.scene.materials[material];
        let mut new = Material { diffuse, specular, exponent, ..old.clone() };
        new.conserve_energy();
        new.bound_albedo();
        if new == *old {
            return Ok(());
        }
        let may_be_glossy = self.gloss.as_ref().is_some_and(|gloss| gloss.may_be_glossy(material));
        if new.specular != Vec3::ZERO && !may_be_glossy {
            return Err(Error::Usage(format!(
                "material `{}` cannot become glossy: its light paths were traced for a diffuse surface; declare `editable = true` in the scene file",
                new.name
            )));
        }
        let has_lobe = |material: &Material| material.specular != Vec3::ZERO;
        // The clusters that pixels' rays read depend on the weight of the lobe beside the albedo.
        let lobes = has_lobe(old) != has_lobe(&new)
            || (has_lobe(&new) && (old.exponent != new.exponent || is_little(old) != is_little(&new)));
        self.scene.materials[material] = new;
        let bit = editable_bits(&self.scene.materials)[material];
        self.changes.edited = match self.changes.edited {
            Edited::Some(bits) if bit != 0 => Edited::Some(bits | bit),
            _ => Edited::All,
        };
        self.changes.materials = true;
        self.lights.paths_changed();
        if lobes {
            self.lobes_changed();
        }
        if let Some(gloss) = &mut self.gloss {
            gloss.edited(&self.scene.materials);
        }
        self.buffers.materials.write(&crate::passes::reflectances(&self.scene.materials))
    }

    /// Ranges of the vertex array whose paths the edited materials reflect. `None` if all paths
    /// may be affected.
    pub(super) fn edited_paths(&self) -> Option<Vec<Range<u32>>> {
        let Edited::Some(bits) = self.changes.edited else { return None };
        let groups = self.path_groups.iter().filter(|group| group.materials & bits != 0);
        Some(groups.map(|group| group.steps.clone()).collect())
    }

    /// Moves the camera. The size of the image stays.
    pub fn move_camera(&mut self, position: Vec3, target: Vec3) {
        self.set_camera(&Camera { position, target, ..self.scene.cameras[0].clone() });
    }

    /// Replaces the camera. The size of the image stays.
    pub fn set_camera(&mut self, camera: &Camera) {
        let old = &mut self.scene.cameras[0];
        let camera = Camera { size: old.size, ..camera.clone() };
        if *old == camera {
            return;
        }
        self.view = View::from(&camera);
        *old = camera;
        self.closed.is_due = true;
        self.view_changed();
    }

    /// Brightens the displayed picture by `stops`, from the next frame on.
    pub fn set_exposure(&mut self, stops: f32) {
        self.changes.exposure |= self.exposure_stops != stops;
        self.exposure_stops = stops;
    }

    /// Sets the weights of direct and indirect light, 0..=1, from the next frame on; [1, 1] is the
    /// picture. Image layers do not depend on them.
    pub fn set_light_weights(&mut self, light_weights: [f32; 2]) {
        self.changes.emission_scale |= self.light_weights != light_weights;
        self.light_weights = light_weights;
    }

    /// Makes the next frame do this work without a change.
    pub fn force(&mut self, work: Work) {
        match work {
            Work::Everything => {
                self.changes = Changes { size: self.changes.size, ..Changes::ALL };
                (0..self.scene.lights.len()).for_each(|light| self.lights.moved(light));
                self.lights.view_changed();
            }
            Work::Light(light) => self.lights.moved(light),
            Work::Colour if self.lights.active_sources().count() == 1 => self.changes.emission_scale = true,
            Work::Colour => self.changes.emission = true,
            Work::View => self.view_changed(),
            Work::Material => {
                self.changes.materials = true;
                self.changes.edited = Edited::All;
                self.lights.paths_changed();
            }
        }
    }

    /// Sets whether frames skip work that cannot change the picture; by default they do. Skipped
    /// are stages without a changed input, lights that are off, rays that cannot bring light,
    /// records that no pixel uses, and clusters outside the live set.
    pub fn set_skipping(&mut self, skips: bool) {
        self.skips = skips;
        self.lights.traces_all = !skips;
    }

    fn lobes_changed(&mut self) {
        self.changes.lobes = true;
        self.lights.lobes_changed();
    }

    pub(super) fn view_changed(&mut self) {
        self.changes.view = true;
        self.lights.view_changed();
    }
}
