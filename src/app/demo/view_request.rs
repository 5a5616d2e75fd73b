//! A request for a picture.

use super::document::Document;
use crate::scene::{Camera, DisplayTransform};

/// Everything that a picture depends on.
#[derive(Clone, PartialEq)]
pub(super) struct ViewRequest {
    pub(super) document: Document,
    pub(super) camera: Camera,
    pub(super) display: DisplayTransform,
    /// Weights of direct and indirect light.
    pub(super) weights: [f32; 2],
}
