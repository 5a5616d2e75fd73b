//! Scenes back into files.
