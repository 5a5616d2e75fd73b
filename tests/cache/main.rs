//! Stored light paths: the format of the files, their contents, and pictures from them.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

#[path = "../common/mod.rs"]
mod common;
mod corpus;
mod folder;
mod format;
mod hostile;
mod pictures;
mod tables;
