//! The argument `--exposure` of all commands.

use super::numbers::parse_finite;
use crate::image::automatic_stops;
use crate::scene::{self, PictureKeys};

/// How a picture is exposed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Exposure {
    /// The picture's mean becomes middle grey.
    Auto,
    /// Brighter by this many stops.
    Stops(f32),
}

impl Exposure {
    /// Parses `auto` or a number of stops.
    pub(super) fn parse(text: &str) -> Result<Self, String> {
        match text.trim() {
            "auto" => Ok(Self::Auto),
            text => match parse_finite(text) {
                Ok(stops) => Ok(Self::Stops(stops)),
                Err(expected) => Err(format!("{expected}, or auto")),
            },
        }
    }

    /// The default of a scene: what its file states. Lights of a model alone have any brightness.
    pub(super) fn of_scene(spec: &str, picture: &PictureKeys) -> Self {
        match picture.exposure {
            Some(stops) => Self::Stops(stops),
            None if scene::is_model(spec) => Self::Auto,
            None => Self::Stops(0.0),
        }
    }

    /// Stops for a picture, with a line if they were chosen.
    pub(super) fn stops(self, pixels: &[[f32; 3]]) -> (f32, Option<String>) {
        match self {
            Self::Stops(stops) => (stops, None),
            Self::Auto => {
                let stops = automatic_stops(pixels);
                (stops, Some(format!("exposed by {stops} stops, as with --exposure {stops}")))
            }
        }
    }
}

/// Parses the stops of a film.
pub(super) fn parse_fixed(text: &str) -> Result<f32, String> {
    match Exposure::parse(text)? {
        Exposure::Stops(stops) => Ok(stops),
        Exposure::Auto => Err("a film would flicker: expected a number, such as `render` reports for \
             one frame with --exposure auto"
            .to_owned()),
    }
}
