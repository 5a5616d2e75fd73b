//! The mixer: lights alone, and dimmed. Its changes are edits like others, so that undo takes them
//! back and a frame shows them exactly.

use std::collections::HashMap;

use super::document::{Document, LightEntry};
use crate::scene::photometry::lux;
use glam::Vec3;

/// State of the mixer that is no part of the scene.
#[derive(Default)]
pub(super) struct Mixer {
    /// The light that is alone, and which lights were on before.
    alone: Option<(u64, HashMap<u64, bool>)>,
    /// Emission of each light at 100 %: as it was when the mixer first saw it.
    full: HashMap<u64, Vec3>,
}

impl Mixer {
    /// Whether only this light is on.
    pub(super) fn is_alone(&self, light: u64) -> bool {
        self.alone.as_ref().is_some_and(|(alone, _)| *alone == light)
    }

    /// Switches all other lights off, or all lights back to what they were.
    pub(super) fn toggle_alone(&mut self, document: &mut Document, light: u64) {
        let before = match self.alone.take() {
            Some((alone, before)) => {
                for entry in &mut document.lights {
                    entry.light.is_on = before.get(&entry.id).copied().unwrap_or(entry.light.is_on);
                }
                if alone == light {
                    return;
                }
                before
            }
            None => document.lights.iter().map(|entry| (entry.id, entry.light.is_on)).collect(),
        };
        document.lights.iter_mut().for_each(|entry| entry.light.is_on = entry.id == light);
        self.alone = Some((light, before));
    }

    fn full(&mut self, entry: &LightEntry) -> Vec3 {
        let emission = entry.light.kind.emission();
        *self.full.entry(entry.id).or_insert(if emission == Vec3::ZERO { Vec3::ONE } else { emission })
    }

    /// Luminous power of the light in percent of its full one.
    pub(super) fn percent(&mut self, entry: &LightEntry) -> f64 {
        100.0 * lux(entry.light.kind.emission()) / lux(self.full(entry)).max(f64::MIN_POSITIVE)
    }

    /// Dims the light to this percentage; its colour stays, also through 0 %.
    pub(super) fn dim(&mut self, entry: &mut LightEntry, percent: f64) {
        let (before, emission) = (self.percent(entry), entry.light.kind.emission());
        if before > 0.0 {
            self.full.insert(entry.id, emission * (100.0 / before) as f32);
        }
        let full = self.full(entry);
        entry.light.kind = entry.light.kind.with_emission(full * (0.01 * percent) as f32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Light, LightKind};

    fn document() -> Document {
        let intensity = Vec3::new(4.0, 2.0, 1.0);
        let kind = LightKind::Point { position: Vec3::ZERO, intensity };
        let light =
            |id: u64, is_on| LightEntry { id, light: Light { is_on, ..Light::new(format!("{id}"), kind) } };
        Document {
            lights: vec![light(3, true), light(5, false), light(8, true)],
            materials: Vec::new(),
            models: Vec::new(),
            sky_image: None,
        }
    }

    fn on(document: &Document) -> Vec<bool> {
        document.lights.iter().map(|entry| entry.light.is_on).collect()
    }

    #[test]
    fn a_light_is_alone_until_it_is_asked_for_again() {
        let (mut mixer, mut document) = (Mixer::default(), document());
        mixer.toggle_alone(&mut document, 5);
        assert_eq!(on(&document), [false, true, false]);
        mixer.toggle_alone(&mut document, 3);
        assert!(mixer.is_alone(3) && !mixer.is_alone(5));
        assert_eq!(on(&document), [true, false, false]);
        mixer.toggle_alone(&mut document, 3);
        assert_eq!(on(&document), [true, false, true]);
        assert!(!mixer.is_alone(3));
    }

    #[test]
    fn dimmed_lights_keep_their_colour() {
        let (mut mixer, mut document) = (Mixer::default(), document());
        let entry = &mut document.lights[0];
        let full = entry.light.kind.emission();
        for percent in [50.0, 0.0, 200.0, 100.0] {
            mixer.dim(entry, percent);
            let emission = entry.light.kind.emission();
            assert!((emission - full * (0.01 * percent) as f32).length() < 1e-5, "{percent}: {emission}");
            assert!((mixer.percent(entry) - percent).abs() < 1e-4);
        }
        // A new colour is kept through black.
        let blue = Vec3::new(0.0, 0.5, 4.0);
        entry.light.kind = entry.light.kind.with_emission(blue);
        let percent = mixer.percent(entry);
        mixer.dim(entry, 0.0);
        mixer.dim(entry, percent);
        assert!((entry.light.kind.emission() - blue).length() < 1e-5);
    }
}
