//! Stored light paths: the form of the files, what they hold, and pictures from them.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

#[path = "../common/mod.rs"]
mod common;
mod corpus;
mod folder;
mod format;
mod hostile;
mod pictures;
mod tables;
