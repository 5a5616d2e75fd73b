//! What the renderer knows about a place: for eyes.
