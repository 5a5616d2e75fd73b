//! Animation: applies the state of a scene at some time as edits.

use super::Renderer;
use crate::error::Result;
use crate::scene::film::{MaterialState, State};

#[doc(hidden)]
impl Renderer {
    /// Brings the scene into this state. Unchanged properties cost nothing.
    ///
    /// # Errors
    /// A material that is not editable becomes glossy; the device failed.
    pub fn set_state(&mut self, state: &State) -> Result<()> {
        self.set_camera(&state.camera);
        for &(light, kind, is_on) in &state.lights {
            self.set_light(light, kind)?;
            if self.light_is_on(light) != is_on {
                self.switch_light(light, is_on)?;
            }
        }
        for &MaterialState { material, diffuse, specular, exponent } in &state.materials {
            self.set_material(material, diffuse, specular, exponent)?;
        }
        Ok(())
    }
}
