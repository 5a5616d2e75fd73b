//! Edits of single properties of lights: an edit of the chosen light changes all chosen ones that
//! have the property.

use super::document::Document;
use crate::scene::{Light, LightKind};
use glam::Vec3;

/// A property and its new value.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum LightEdit {
    On(bool),
    /// Intensity, radiance or irradiance, and its unit.
    Emission(Vec3, &'static str),
    /// Power in photometric units, and its unit.
    Power(f64, &'static str),
    Kelvin(f64),
    /// Half-angle of a cone, radians.
    Angle(f32),
    Penumbra(f32),
    Group(Option<String>),
}

impl LightEdit {
    /// The group with that name. An empty name is none.
    pub(super) fn group(name: &str) -> Self {
        let name = name.trim();
        Self::Group((!name.is_empty()).then(|| name.to_owned()))
    }

    /// Edits a light if it has the property.
    pub(super) fn apply(&self, light: &mut Light) {
        let has_cone = light.luminaire.is_none();
        match self {
            Self::On(is_on) => light.is_on = *is_on,
            Self::Emission(emission, unit) if self::unit(&light.kind) == *unit => {
                light.kind = light.kind.with_emission(*emission);
            }
            Self::Power(amount, unit) if light.power().is_some_and(|(_, own)| own == *unit) => {
                light.set_power(*amount);
            }
            Self::Kelvin(kelvin) if light.power().is_some() => light.kind = light.kind.with_kelvin(*kelvin),
            Self::Group(group) if may_be_grouped(&light.kind) => light.group.clone_from(group),
            Self::Angle(_) | Self::Penumbra(_) if has_cone => {
                if let LightKind::Spot { angle, penumbra, .. } = &mut light.kind {
                    match self {
                        Self::Angle(radians) => *angle = *radians,
                        Self::Penumbra(fraction) => *penumbra = *fraction,
                        _ => (),
                    }
                }
            }
            _ => (),
        }
    }
}

/// Applies an edit to these lights.
pub(super) fn edit(document: &mut Document, lights: &[u64], edit: &LightEdit) {
    for entry in document.lights.iter_mut().filter(|entry| lights.contains(&entry.id)) {
        edit.apply(&mut entry.light);
    }
}

/// Unit of a light's emission.
pub(super) fn unit(kind: &LightKind) -> &'static str {
    match kind {
        LightKind::Point { .. } | LightKind::Spot { .. } => "W/sr",
        LightKind::Area { .. } | LightKind::Surface { .. } | LightKind::Sky { .. } => "W/m²/sr",
        LightKind::Directional { .. } => "W/m²",
    }
}

/// Whether the window can put the light into a group: emitting materials and the sky have no
/// section of a scene file that holds the group's name.
pub(super) fn may_be_grouped(kind: &LightKind) -> bool {
    !kind.is_fixed()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::demo::document::LightEntry;

    /// A point light, a spot, a sun, and an emitting surface.
    fn document() -> Document {
        let (position, intensity) = (Vec3::ZERO, Vec3::new(4.0, 2.0, 1.0));
        let kinds = [
            LightKind::Point { position, intensity },
            LightKind::Spot { position, direction: Vec3::NEG_Y, intensity, angle: 0.5, penumbra: 0.25 },
            LightKind::Directional { direction: Vec3::NEG_Y, irradiance: intensity },
            LightKind::Surface { material: 0, radiance: intensity },
        ];
        let entry = |(id, kind): (u64, &LightKind)| LightEntry { id, light: Light::new(kind.word(), *kind) };
        Document { lights: (0..).zip(&kinds).map(entry).collect(), ..Document::default() }
    }

    /// Applies an edit to all lights. Returns which of them have changed.
    fn changed(change: LightEdit) -> [bool; 4] {
        let (before, mut document) = (document(), document());
        edit(&mut document, &[0, 1, 2, 3], &change);
        [0, 1, 2, 3].map(|index| document.lights[index] != before.lights[index])
    }

    #[test]
    fn an_edit_changes_the_lights_that_have_the_property() {
        let all = [true; 4];
        assert_eq!(changed(LightEdit::On(false)), all);
        assert_eq!(changed(LightEdit::Emission(Vec3::ONE, "W/sr")), [true, true, false, false]);
        assert_eq!(changed(LightEdit::Emission(Vec3::ONE, "W/m²/sr")), [false, false, false, true]);
        assert_eq!(changed(LightEdit::Power(10.0, "lm")), [true, true, false, false]);
        assert_eq!(changed(LightEdit::Power(10.0, "lx")), [false, false, true, false]);
        assert_eq!(changed(LightEdit::Kelvin(3000.0)), [true, true, true, false]);
        assert_eq!(changed(LightEdit::Angle(0.25)), [false, true, false, false]);
        assert_eq!(changed(LightEdit::Penumbra(0.5)), [false, true, false, false]);
        assert_eq!(changed(LightEdit::group(" hall ")), [true, true, true, false]);
        assert_eq!(changed(LightEdit::group("  ")), [false; 4], "none have a group");
    }

    #[test]
    fn lights_that_are_not_chosen_stay() {
        let mut document = document();
        edit(&mut document, &[1], &LightEdit::group("hall"));
        let groups: Vec<_> = document.lights.iter().map(|entry| entry.light.group.as_deref()).collect();
        assert_eq!(groups, [None, Some("hall"), None, None]);
    }
}
