//! Edits between frames. Each edit marks the results that it makes stale; the next
//! frame updates them.

use super::Renderer;
use super::dirty::Work;
use super::plan::LightResults;
use crate::error::{Error, Result};
use crate::passes::frame::{form_factors::FormFactors, gloss::is_little};
use crate::passes::precompute;
use crate::passes::precompute::path_orders::editable_bits;
use crate::scene::luminaire::Luminaire;
use crate::scene::{Camera, DisplayTransform, Light, LightKind, Material};
use crate::types::View;
use glam::Vec3;

impl Renderer {
    /// Moves a light of any kind except directional lights.
    ///
    /// # Errors
    /// The device failed.
    pub fn move_light(&mut self, light: usize, to: Vec3) -> Result<()> {
        self.set_light(light, self.world.scene.lights[light].kind.moved_to(to))
    }

    /// Replaces a light: kind, position, direction or colour. A change of emission
    /// alone traces nothing.
    ///
    /// # Errors
    /// The device failed.
    pub fn set_light(&mut self, light: usize, kind: LightKind) -> Result<()> {
        let old = std::mem::replace(&mut self.world.scene.lights[light].kind, kind);
        if old == kind {
            return Ok(());
        }
        if old.with_emission(Vec3::ONE) != kind.with_emission(Vec3::ONE) {
            self.dirty.light_moved(light);
        }
        self.lights_changed()
    }

    /// Replaces the measured intensities of a spot, or takes them away.
    ///
    /// # Errors
    /// The device failed.
    pub fn set_luminaire(&mut self, light: usize, luminaire: Option<Luminaire>) -> Result<()> {
        let own = &mut self.world.scene.lights[light].luminaire;
        if *own == luminaire {
            return Ok(());
        }
        *own = luminaire;
        self.dirty.light_moved(light);
        self.lights_changed()
    }

    /// Switches a light on or off. Its cached contributions stay.
    ///
    /// # Errors
    /// The device failed.
    pub fn switch_light(&mut self, light: usize, is_on: bool) -> Result<()> {
        self.world.scene.lights[light].is_on = is_on;
        self.lights_changed()
    }

    /// Whether a light is on.
    pub fn light_is_on(&self, light: usize) -> bool {
        self.world.scene.lights[light].is_on
    }

    /// Appends a light to the scene.
    ///
    /// # Errors
    /// The device lacks memory or failed; the light is then not added.
    pub fn add_light(&mut self, light: Light) -> Result<()> {
        self.lights.add()?;
        self.world.scene.lights.push(light);
        self.dirty.lights.push(LightResults::ALL);
        let changed = self.lights_changed();
        if changed.is_err() {
            self.lights.remove(self.world.scene.lights.len() - 1);
            self.world.scene.lights.pop();
            self.dirty.lights.pop();
        }
        changed
    }

    /// Removes a light and returns it. The indices of later lights decrease by one.
    ///
    /// # Errors
    /// The device failed.
    pub fn remove_light(&mut self, light: usize) -> Result<Light> {
        self.lights.remove(light);
        self.dirty.lights.remove(light);
        let removed = self.world.scene.lights.remove(light);
        self.lights_changed()?;
        Ok(removed)
    }

    fn lights_changed(&mut self) -> Result<()> {
        self.world.enclosures.is_due = true;
        let edited = self.lights.edit(&self.world.scene.lights)?;
        self.dirty.uploads.lights = true;
        self.dirty.uploads.emission |= self.world.buffers.emission.is_used();
        self.dirty.changes.emission |= edited.emission;
        self.dirty.changes.composition |= edited.composition;
        for light in edited.new_beams {
            let stale = &mut self.dirty.lights[light];
            (stale.factors, stale.clusters, stale.hits) = (true, true, true);
        }
        Ok(())
    }

    /// Changes a material's diffuse albedo, as [`Self::set_material`] does. The colours of its
    /// image are multiplied with it.
    ///
    /// # Errors
    /// The device failed.
    pub fn set_diffuse(&mut self, material: usize, diffuse: Vec3) -> Result<()> {
        let Material { specular, exponent, .. } = self.world.scene.materials[material];
        self.set_material(material, diffuse, specular, exponent)
    }

    /// Changes a material's diffuse and specular albedo and its Phong exponent. Albedos that
    /// reflect too much are lowered ([`Material::clamp_albedo`]). If the material is editable, the
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
        let old = &self.world.scene.materials[material];
        let mut new = Material { diffuse, specular, exponent, ..old.clone() };
        new.conserve_energy();
        new.clamp_albedo();
        if new == *old {
            return Ok(());
        }
        let may_be_glossy = self.transport.gloss.as_ref().is_some_and(|gloss| gloss.may_be_glossy(material));
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
        self.world.scene.materials[material] = new;
        let bit = editable_bits(&self.world.scene.materials)[material];
        self.dirty.material_changed((bit != 0).then_some(bit));
        self.dirty.uploads.materials = true;
        let gloss = self.transport.gloss.as_mut();
        let others_read_records = gloss.is_some_and(|gloss| gloss.edited(&self.world.scene.materials));
        if lobes || others_read_records {
            self.dirty.lobes_changed();
        }
        Ok(())
    }

    /// Moves the camera. The size of the image stays.
    pub fn move_camera(&mut self, position: Vec3, target: Vec3) {
        self.set_camera(&Camera { position, target, ..self.world.scene.cameras[0].clone() });
    }

    /// Replaces the camera. The size of the image stays.
    pub fn set_camera(&mut self, camera: &Camera) {
        let old = &mut self.world.scene.cameras[0];
        let camera = Camera { size: old.size, ..camera.clone() };
        if *old == camera {
            return;
        }
        self.image.view = View::from(&camera);
        *old = camera;
        self.world.enclosures.is_due = true;
        self.dirty.view_changed();
    }

    /// Brightens the displayed picture by `stops`, from the next frame on.
    pub fn set_exposure(&mut self, stops: f32) {
        self.set_display_transform(DisplayTransform {
            exposure_stops: stops,
            ..self.image.display_transform
        });
    }

    /// Sets how radiance is displayed, from the next frame on.
    pub fn set_display_transform(&mut self, display: DisplayTransform) {
        self.dirty.changes.display_transform |= self.image.display_transform != display;
        self.image.display_transform = display;
    }

    /// Sets the weights of direct and indirect light, 0..=1, from the next frame on; [1, 1] is the
    /// picture. Image layers do not depend on them.
    pub fn set_light_weights(&mut self, weights: [f32; 2]) {
        self.dirty.changes.composition |= self.image.light_weights != weights;
        self.image.light_weights = weights;
    }

    /// Whether a shader runs before the first frame. If it is replaced, the change shows in a new
    /// renderer only; of other shaders, after [`Work::Everything`].
    #[doc(hidden)]
    pub fn runs_before_frames(stem: &str) -> bool {
        stem == FormFactors::BATCHES_STEM || precompute::STEMS.contains(&stem)
    }

    /// Makes the next frame do this work without a change.
    #[doc(hidden)]
    pub fn force(&mut self, work: Work) {
        self.dirty.force(work, self.lights.active_parts().count() == 1);
    }

    /// Sets whether frames skip work that cannot change the picture; by default they do. Skipped
    /// are stages without a changed input, lights that are off, rays that cannot bring light,
    /// records that no pixel uses, and clusters outside the live set.
    pub fn set_skipping(&mut self, skips: bool) {
        self.dirty.skips = skips;
        self.lights.traces_all = !skips;
    }
}
