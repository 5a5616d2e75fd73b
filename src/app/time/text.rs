//! Lines and numbers of the tables of one scene.

use std::fmt::Write;

/// Converts bytes to 10⁶ bytes.
pub(super) fn megabytes(bytes: u64) -> f64 {
    bytes as f64 / 1e6
}

/// About three significant digits.
pub(super) fn milliseconds(ms: f64) -> String {
    let decimals = if ms.abs() < 10.0 { 3 } else { 1 };
    format!("{ms:.decimals$}")
}

/// Appends a line.
pub(super) fn line(text: &mut String, arguments: std::fmt::Arguments) {
    writeln!(text, "{arguments}").expect("writing to a string cannot fail");
}
