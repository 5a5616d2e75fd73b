//! The window as a user sees it: a screen of its own, input of mouse and keyboard,
//! and captured pixels.
//!
//! A test that fails leaves the window's last picture in `target/window-failures`.
#![cfg(all(target_os = "linux", feature = "window"))]
#![allow(unreachable_pub, clippy::unwrap_used, reason = "a test may panic")]

mod client;
mod crashes;
mod demo;
mod designer;
mod disk;
mod display;
mod editing;
mod faults;
mod frames;
mod harness;
mod judging;
mod keys;
#[path = "../common/layer.rs"]
mod layer;
mod lights;
mod manager;
mod memory;
mod models;
mod monkey;
mod opening;
mod painting;
mod photographs;
mod picture;
mod scenarios;
mod screen;
#[cfg(feature = "shaderc")]
mod shaders;
mod surfaces;
mod tour;
mod toy;

use std::thread::sleep;
use std::time::{Duration, Instant};

/// Time limit, generous for a busy machine: a run beyond it hangs.
pub const HANG: Duration = Duration::from_secs(900);

/// Interval of polling.
pub const POLL: Duration = Duration::from_millis(5);

/// Polls `look` until it returns a value; fails with `what` after `within`.
fn until<T>(what: &str, within: Duration, mut look: impl FnMut() -> Option<T>) -> T {
    let end = Instant::now() + within;
    loop {
        if let Some(found) = look() {
            return found;
        }
        assert!(Instant::now() < end, "no {what} within {within:?}");
        sleep(POLL);
    }
}
