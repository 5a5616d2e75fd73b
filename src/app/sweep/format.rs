//! Numbers and pictures as the report shows them.

/// A picture with its caption.
#[derive(Debug)]
pub(super) struct Shown {
    pub(super) title: String,
    /// Time and error, a line each.
    pub(super) lines: Vec<String>,
    pub(super) png: Vec<u8>,
    /// The heat map of its error.
    pub(super) heatmap: Option<Vec<u8>>,
}

/// Two digits and a power of ten.
pub(super) fn figure(value: f64) -> String {
    if value == 0.0 { "0".to_owned() } else { format!("{value:.1e}") }
}

/// A time in a suitable unit, with a blank that does not break.
pub(super) fn seconds(seconds: f64) -> String {
    let (value, unit) = match seconds {
        s if s < 1.0 => (1e3 * s, "ms"),
        s if s < 120.0 => (s, "s"),
        s if s < 7200.0 => (s / 60.0, "min"),
        s => (s / 3600.0, "h"),
    };
    format!("{}\u{a0}{unit}", significant(value))
}

/// Three digits, without a power of ten.
pub(super) fn significant(value: f64) -> String {
    let decimals = match value.abs() {
        v if v < 10.0 => 2,
        v if v < 100.0 => 1,
        _ => 0,
    };
    format!("{value:.decimals$}")
}
