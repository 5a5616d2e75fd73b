//! Failures of devices and discs, and interruptions: messages, exit codes, and files that remain.
#![cfg(target_os = "linux")]
#![allow(unreachable_pub, clippy::unwrap_used, reason = "a test may panic")]

mod calls;
mod devices;
mod disc;
mod interrupted;
#[path = "../common/layer.rs"]
mod layer;
mod memory;
mod program;
mod shared_memory;
