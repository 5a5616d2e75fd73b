//! The display transform: from radiance to the values of a display.

use super::white_balance::WhiteBalance;
use crate::{Error, Result};
use glam::Mat3;

/// A tone curve: from exposed linear values to display values, 0..=1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u32)]
pub enum ToneCurve {
    /// The identity up to 0.8; above it a shoulder that reaches white only at infinity.
    #[default]
    Standard = 0,
    /// The identity, clipped at 1.
    None = 1,
    /// The curve of [Hable 2010].
    Filmic = 2,
    /// The fit of [Hill, BakingLab] to the reference transforms of ACES.
    Aces = 3,
    /// The fit of [Wrensch 2023] to AgX [Sobotka 2022].
    Agx = 4,
}

impl ToneCurve {
    /// All curves, in the order of their codes.
    pub const ALL: [Self; 5] = [Self::Standard, Self::None, Self::Filmic, Self::Aces, Self::Agx];

    /// Name as an argument.
    pub fn name(self) -> &'static str {
        match self {
            Self::Standard => "standard",
            Self::None => "none",
            Self::Filmic => "filmic",
            Self::Aces => "aces",
            Self::Agx => "agx",
        }
    }

    /// Parses a name.
    ///
    /// # Errors
    /// Lists the names.
    pub fn parse(text: &str) -> std::result::Result<Self, String> {
        let found = Self::ALL.into_iter().find(|curve| curve.name() == text.trim());
        found.ok_or_else(|| "expected standard, none, filmic, aces or agx".to_owned())
    }

    /// Number of the curve in the kernel `tonemap`.
    pub fn code(self) -> u32 {
        self as u32
    }
}

/// How radiance is displayed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DisplayTransform {
    /// The picture is brightened by this many stops.
    pub exposure_stops: f32,
    /// The white of the scene.
    pub white_balance: WhiteBalance,
    /// The curve from exposed values to display values.
    pub tone: ToneCurve,
}

/// The numbers of a [`DisplayTransform`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DisplayConstants {
    /// Factor of the exposure, 2^stops.
    pub scale: f32,
    /// Linear Rec.709 to linear Rec.709. `None` if the white balance is neutral.
    pub white_balance: Option<Mat3>,
    /// The curve from exposed values to display values.
    pub tone: ToneCurve,
}

impl DisplayTransform {
    /// The standard curve and a neutral white at that exposure.
    pub fn exposed(exposure_stops: f32) -> Self {
        Self { exposure_stops, ..Self::default() }
    }

    /// Checks values that come from a user.
    ///
    /// # Errors
    /// [`Error::Usage`]: a value is out of range.
    pub fn check(&self) -> Result<()> {
        let Self { exposure_stops, white_balance: WhiteBalance { kelvin, tint }, .. } = *self;
        if !exposure_stops.is_finite() {
            return Err(Error::Usage(format!("exposure must be a finite number, found {exposure_stops}")));
        }
        for (name, value, range) in
            [("white_balance", kelvin, WhiteBalance::KELVIN), ("tint", tint, WhiteBalance::TINT)]
        {
            if !range.contains(&value) {
                let (least, most) = range.into_inner();
                return Err(Error::Usage(format!("{name} must be {least} to {most}, found {value}")));
            }
        }
        Ok(())
    }

    /// The scale, matrix and curve that pixels need.
    pub fn constants(&self) -> DisplayConstants {
        DisplayConstants {
            scale: self.exposure_stops.exp2(),
            white_balance: self.white_balance.matrix(),
            tone: self.tone,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_and_codes_are_unique() {
        for (code, curve) in (0..).zip(ToneCurve::ALL) {
            assert_eq!((curve.code(), ToneCurve::parse(curve.name())), (code, Ok(curve)));
        }
        assert!(ToneCurve::parse("reinhard").is_err_and(|line| line.contains("agx")));
    }
}
