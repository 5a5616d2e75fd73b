//! Lights that a drag dims: their pictures are mixed, and no frame is rendered until the drag ends.

use super::document::LightEntry;
use super::view_request::ViewRequest;
use crate::renderer::Mix;
use glam::Vec3;

/// Largest relative difference between the gains of lights that are dimmed as one.
const SAME: f32 = 1e-5;

/// Lights that differ from an earlier request by one factor in each channel.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Dimmed {
    /// Identifiers, in the document's order.
    pub(super) lights: Vec<u64>,
    pub(super) gains: Vec3,
}

/// A mix under way.
pub(super) struct Dimming {
    /// The request whose picture has the lights.
    pub(super) base: ViewRequest,
    pub(super) lights: Vec<u64>,
    pub(super) mix: Mix,
}

impl Dimmed {
    /// What dims the lights of `base`. `None` if the request differs in anything else, if the
    /// factors differ, or if no other light is on: such a frame is as fast.
    pub(super) fn new(base: &ViewRequest, requested: &ViewRequest) -> Option<Self> {
        let mut undimmed = requested.document.clone();
        if undimmed.lights.len() != base.document.lights.len() {
            return None;
        }
        let (mut lights, mut gains, mut others) = (Vec::new(), [None; 3], false);
        for (entry, before) in undimmed.lights.iter_mut().zip(&base.document.lights) {
            let [from, to] = [before, &*entry].map(|entry| entry.light.kind.emission());
            entry.light.kind = entry.light.kind.with_emission(from);
            if from == to || !entry.light.is_on {
                others |= entry.light.is_active();
                continue;
            }
            lights.push(entry.id);
            for (channel, gain) in gains.iter_mut().enumerate() {
                let own = gain_of(from[channel], to[channel])?;
                match (&gain, own) {
                    (Some(gain), Some(own)) if f32::abs(gain - own) > SAME * own.abs() => return None,
                    (None, Some(_)) => *gain = own,
                    _ => (),
                }
            }
        }
        let is_same = (&undimmed, &requested.camera, requested.display, requested.weights)
            == (&base.document, &base.camera, base.display, base.weights);
        let gains = Vec3::from(gains.map(|gain| gain.unwrap_or(1.0)));
        (is_same && others && !lights.is_empty()).then_some(Self { lights, gains })
    }
}

/// The gain of a channel; `Some(None)` if it is dark and stays so, `None` if it has no gain.
fn gain_of(from: f32, to: f32) -> Option<Option<f32>> {
    match (from, to) {
        (0.0, 0.0) => Some(None),
        (0.0, _) => None,
        _ => Some(Some(to / from)),
    }
}

impl Dimming {
    /// The gains of a request whose lights are those of the mix.
    pub(super) fn gains(&self, requested: &ViewRequest) -> Option<Vec3> {
        let dimmed = Dimmed::new(&self.base, requested)?;
        (dimmed.lights == self.lights).then_some(dimmed.gains)
    }
}

/// The request with these lights dark.
pub(super) fn without(requested: &ViewRequest, lights: &[u64]) -> ViewRequest {
    let mut dark = requested.clone();
    let is_dimmed = |entry: &&mut LightEntry| lights.contains(&entry.id);
    for entry in dark.document.lights.iter_mut().filter(is_dimmed) {
        entry.light.kind = entry.light.kind.with_emission(Vec3::ZERO);
    }
    dark
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::demo::document::Document;
    use crate::scene::{DisplayTransform, Light, LightKind, LoadOptions, Scene};

    fn lamp(intensity: [f32; 3]) -> Light {
        Light::new("lamp", LightKind::Point { position: Vec3::ZERO, intensity: Vec3::from(intensity) })
    }

    fn request(lamps: &[[f32; 3]]) -> ViewRequest {
        let scene = Scene::load("box", &LoadOptions::default()).unwrap();
        let mut document = Document::from_scene(&scene, Vec::new());
        for intensity in lamps {
            document.add(lamp(*intensity));
        }
        let camera = scene.cameras[0].clone();
        ViewRequest { document, camera, display: DisplayTransform::default(), weights: [1.0; 2] }
    }

    fn dim(request: &ViewRequest, index: usize, emission: [f32; 3]) -> ViewRequest {
        let mut dimmed = request.clone();
        let light = &mut dimmed.document.lights[index].light;
        light.kind = light.kind.with_emission(Vec3::from(emission));
        dimmed
    }

    #[test]
    fn one_gain_in_each_channel_dims_lights() {
        let base = request(&[[4.0, 2.0, 0.0], [2.0, 4.0, 0.0]]);
        let ids: Vec<u64> = base.document.lights.iter().map(|entry| entry.id).collect();
        assert_eq!(Dimmed::new(&base, &base), None);
        let one = dim(&base, 1, [1.0, 4.0, 0.0]);
        let gains = Vec3::new(0.25, 2.0, 1.0);
        assert_eq!(Dimmed::new(&base, &one), Some(Dimmed { lights: vec![ids[1]], gains }));
        // A second light follows with the same gains, and not with others.
        let both = dim(&one, 2, [0.5, 8.0, 0.0]);
        assert_eq!(Dimmed::new(&base, &both), Some(Dimmed { lights: vec![ids[1], ids[2]], gains }));
        assert_eq!(Dimmed::new(&base, &dim(&one, 2, [0.5, 9.0, 0.0])), None);
        // Dark channels have no gain, and a black light has every one.
        assert_eq!(Dimmed::new(&base, &dim(&base, 1, [4.0, 2.0, 1.0])), None);
        let black = dim(&base, 1, [0.0; 3]);
        assert_eq!(Dimmed::new(&base, &black).map(|dimmed| dimmed.gains), Some(Vec3::new(0.0, 0.0, 1.0)));
        assert_eq!(without(&one, &[ids[1]]).document, black.document);
    }

    #[test]
    fn other_changes_are_no_dimming() {
        let base = request(&[[4.0, 2.0, 1.0]]);
        let dimmed = dim(&base, 1, [2.0, 1.0, 0.5]);
        assert!(Dimmed::new(&base, &dimmed).is_some());
        let mut moved = dimmed.clone();
        moved.document.lights[0].light.kind = moved.document.lights[0].light.kind.moved_to(Vec3::ONE);
        assert_eq!(Dimmed::new(&base, &moved), None);
        let mut turned = dimmed.clone();
        turned.camera.target += Vec3::X;
        assert_eq!(Dimmed::new(&base, &turned), None);
        let mut exposed = dimmed.clone();
        exposed.display.exposure_stops += 1.0;
        assert_eq!(Dimmed::new(&base, &exposed), None);
        let mut fewer = dimmed.clone();
        fewer.document.lights.pop();
        assert_eq!(Dimmed::new(&base, &fewer), None);
        // A light that is off changes no picture; without another light, a frame is as fast.
        let mut off = base.clone();
        off.document.lights[1].light.is_on = false;
        assert_eq!(Dimmed::new(&off, &dim(&off, 1, [2.0, 1.0, 0.5])), None);
        assert_eq!(Dimmed::new(&off, &dim(&off, 0, [0.1; 3])), None);
    }
}
