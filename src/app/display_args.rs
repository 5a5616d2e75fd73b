//! The arguments of displayed pictures that several commands share.

use clap::Args;

use super::numbers::parse_finite;
use crate::scene::{DisplayTransform, PictureKeys, ToneCurve, WhiteBalance};

/// How a picture is displayed, apart from its exposure.
#[derive(Clone, Copy, Debug, Default, Args)]
pub(super) struct DisplayArgs {
    /// Tone curve: standard (sRGB, highlights roll off above 0.8), none (sRGB, clipped at 1),
    /// filmic (Hable 2010), aces (fit by Hill) or agx (fit by Wrensch) [default: standard]
    #[arg(long, value_name = "CURVE", value_parser = ToneCurve::parse, help_heading = "Output")]
    tone: Option<ToneCurve>,
    /// Colour temperature that is displayed as white [default: 6504, the white of sRGB]
    #[arg(long, value_name = "KELVIN", value_parser = parse_kelvin, help_heading = "Output")]
    white_balance: Option<f32>,
    /// Moves that white to green (positive: the picture becomes more magenta) or magenta, in
    /// thousandths of CIE 1960 uv [default: 0]
    #[arg(long, value_name = "TINT", allow_negative_numbers = true, value_parser = parse_tint, help_heading = "Output")]
    tint: Option<f32>,
}

impl DisplayArgs {
    /// The first of these arguments that was given.
    pub(super) fn given(&self) -> Option<&'static str> {
        let all = [
            (self.tone.is_some(), "--tone"),
            (self.white_balance.is_some(), "--white-balance"),
            (self.tint.is_some(), "--tint"),
        ];
        all.into_iter().find_map(|(is_given, flag)| is_given.then_some(flag))
    }

    /// The display transform with that exposure. `picture` states what the arguments do not.
    pub(super) fn transform(&self, exposure_stops: f32, picture: &PictureKeys) -> DisplayTransform {
        let given = PictureKeys {
            exposure: Some(exposure_stops),
            tone: self.tone,
            white_balance: self.white_balance,
            tint: self.tint,
        };
        given.over(picture.over(DisplayTransform::default()))
    }
}

fn parse_kelvin(text: &str) -> Result<f32, String> {
    let (least, most) = WhiteBalance::KELVIN.into_inner();
    let kelvin = parse_finite(text).ok().filter(|kelvin| WhiteBalance::KELVIN.contains(kelvin));
    kelvin.ok_or_else(|| format!("expected a temperature from {least} to {most} K, as in 2700"))
}

fn parse_tint(text: &str) -> Result<f32, String> {
    let (least, most) = WhiteBalance::TINT.into_inner();
    let tint = parse_finite(text).ok().filter(|tint| WhiteBalance::TINT.contains(tint));
    tint.ok_or_else(|| format!("expected a number from {least} to {most}, as in -5"))
}
