//! Devices, discs and people that fail the program: what it says, how it ends, and what
//! it leaves behind.
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
