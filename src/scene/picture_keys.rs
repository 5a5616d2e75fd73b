//! The `[picture]` of a scene file: how the picture is displayed.

use std::path::Path;

use super::value::{Kind, Node, Origin, Section};
use super::{DisplayTransform, ToneCurve, WhiteBalance, keys, numbers};
use crate::Result;

/// Range of the exposure, stops.
const EXPOSURE: std::ops::RangeInclusive<f64> = -50.0..=50.0;

/// What a scene file states about the display of its picture. `None`: nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PictureKeys {
    /// The picture is brightened by this many stops.
    pub exposure: Option<f32>,
    /// The curve from exposed values to display values.
    pub tone: Option<ToneCurve>,
    /// Colour temperature of the white, K.
    pub white_balance: Option<f32>,
    /// Distance of the white from the black bodies; see [`WhiteBalance::tint`].
    pub tint: Option<f32>,
}

impl PictureKeys {
    /// Reads the section of a file.
    pub(super) fn read(file: &Path, root: &Node) -> Result<Self> {
        let Some(node) = root.get("picture") else { return Ok(Self::default()) };
        let section = Section::new(file, "picture", node)?;
        section.only(&keys::names("picture", None))?;
        let number = |key, range| Ok(section.number(key, range)?.map(|value| value as f32));
        let wide = |range: std::ops::RangeInclusive<f32>| f64::from(*range.start())..=f64::from(*range.end());
        let tone = section.text("tone")?.map(ToneCurve::parse).transpose();
        Ok(Self {
            exposure: number("exposure", EXPOSURE)?,
            tone: tone.map_err(|expected| section.fault_at("tone", expected))?,
            white_balance: number("white_balance", wide(WhiteBalance::KELVIN))?,
            tint: number("tint", wide(WhiteBalance::TINT))?,
        })
    }

    /// The display transform with these values in place of those of `display`.
    pub fn over(&self, display: DisplayTransform) -> DisplayTransform {
        let white = display.white_balance;
        DisplayTransform {
            exposure_stops: self.exposure.unwrap_or(display.exposure_stops),
            white_balance: WhiteBalance {
                kelvin: self.white_balance.unwrap_or(white.kelvin),
                tint: self.tint.unwrap_or(white.tint),
            },
            tone: self.tone.unwrap_or(display.tone),
        }
    }

    /// Writes the keys whose values differ from those in force.
    pub(super) fn write(&self, wanted: &DisplayTransform, root: &mut Node) {
        let own = self.over(DisplayTransform::default());
        let number = |value: f32| Kind::Float(numbers::plain(value));
        let [old, new] = [own.white_balance, wanted.white_balance];
        let changed = [
            ("exposure", own.exposure_stops != wanted.exposure_stops, number(wanted.exposure_stops)),
            ("tone", own.tone != wanted.tone, Kind::Text(wanted.tone.name().to_owned())),
            ("white_balance", old.kelvin != new.kelvin, number(new.kelvin)),
            ("tint", old.tint != new.tint, number(new.tint)),
        ];
        let node = |kind| Node { origin: Origin::Flag("edited".to_owned()), kind };
        for (key, _, kind) in changed.into_iter().filter(|(_, is_changed, _)| *is_changed) {
            if root.get("picture").is_none() {
                root.set("picture", node(Kind::Table(Vec::new())));
            }
            if let Some(picture) = root.get_mut("picture") {
                picture.set(key, node(kind));
            }
        }
    }
}
