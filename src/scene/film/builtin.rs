//! The films that are part of the binary.

/// Names of the built-in films.
pub const NAMES: [&str; 1] = ["box"];

/// The text of a built-in film.
pub(super) fn text(name: &str) -> Option<&'static str> {
    match name {
        "box" => Some(include_str!("../../../assets/films/box.toml")),
        _ => None,
    }
}
