//! Light that surfaces and the sky send to a viewer, on the device.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Recorder};
use crate::scene::material::Sides;
use crate::scene::{Emission, Light, LightKind, Material};
use crate::types::Background;
use glam::{Vec3, Vec4};
use std::sync::Arc;

/// Bindings of shaders that see surfaces and the sky.
pub struct EmissionBuffers {
    /// Radiance that each material emits; in w, the sides: 0 the front, 1 both, -1 the back.
    emitted: Buffer,
    background: Buffer,
    texels: Buffer,
    /// Sides of each material that emit, as in `emitted`.
    sides: Vec<f32>,
    emission: Arc<Emission>,
}

impl EmissionBuffers {
    /// Allocates the buffers and uploads the sky. [`Self::record_upload`] uploads the rest.
    ///
    /// # Errors
    /// The device lacks memory.
    pub fn new(context: &Arc<Context>, materials: &[Material], emission: Arc<Emission>) -> Result<Self> {
        let none = [Vec3::ZERO];
        let texels = emission.sky.as_ref().map_or(&none[..], |sky| &*sky.environment.texels);
        let emitted = vec![Vec4::ZERO; materials.len().max(1)];
        Ok(Self {
            emitted: Buffer::from_slice(context, "emitted", &emitted)?,
            background: Buffer::storage(context, "background", size_of::<Background>() as u64)?,
            texels: Buffer::from_slice(context, "sky texels", texels)?,
            sides: materials.iter().map(sides).collect(),
            emission,
        })
    }

    /// The specialisation constant of shaders that see emission.
    pub fn constant(&self) -> (&'static str, u32) {
        ("HAS_EMISSION", u32::from(self.is_used()))
    }

    /// Whether some surface emits, or there is a sky.
    pub fn is_used(&self) -> bool {
        !self.emission.surfaces.is_empty() || self.emission.sky.is_some()
    }

    /// Whether there is a sky.
    pub fn has_sky(&self) -> bool {
        self.emission.sky.is_some()
    }

    /// The bindings of shaders that see the sky alone.
    pub fn sky(&self) -> [(&'static str, &Buffer); 2] {
        [("Backgrounds", &self.background), ("SkyTexels", &self.texels)]
    }

    /// The bindings of these shaders.
    pub fn bindings(&self) -> [(&'static str, &Buffer); 3] {
        let [background, texels] = self.sky();
        [("Emitted", &self.emitted), background, texels]
    }

    /// Uploads what the lights that are on emit. A transfer.
    pub fn record_upload(&self, rec: &mut Recorder, lights: &[Light]) {
        let mut emitted = vec![Vec4::ZERO; self.sides.len().max(1)];
        let mut background = Background { tint: Vec3::ZERO, width: 0, turn: Vec3::ZERO, height: 0 };
        for light in lights.iter().filter(|light| light.is_on) {
            match light.kind {
                LightKind::Surface { material, radiance } => {
                    emitted[material as usize] = radiance.extend(self.sides[material as usize]);
                }
                LightKind::Sky { radiance, turn, channel } => {
                    let Some(sky) = &self.emission.sky else { continue };
                    [background.width, background.height] = sky.environment.size;
                    background.tint += radiance;
                    match channel {
                        Some(channel) => background.turn[usize::from(channel)] = turn,
                        None => background.turn = Vec3::splat(turn),
                    }
                }
                _ => (),
            }
        }
        rec.upload(&self.emitted, &emitted);
        rec.upload(&self.background, &[background]);
    }
}

fn sides(material: &Material) -> f32 {
    match material.emitting_sides {
        Some(Sides::Front) => 0.0,
        Some(Sides::Back) => -1.0,
        Some(Sides::Both) | None => 1.0,
    }
}
