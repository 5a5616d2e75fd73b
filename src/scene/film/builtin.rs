//! The built-in films of the binary.

use crate::scene::builtin;

/// Name and text of each film. A film has the name of its scene.
const FILMS: [(&str, &str); 2] = [
    ("box", include_str!("../../../assets/films/box.toml")),
    ("atrium", include_str!("../../../assets/films/atrium.toml")),
];

/// Names of the built-in films whose scene is built in as well.
pub fn names() -> Vec<&'static str> {
    FILMS.map(|(name, _)| name).into_iter().filter(|name| builtin::NAMES.contains(name)).collect()
}

/// The text of a built-in film. `None` if there is none of that name.
pub(super) fn text(name: &str) -> Option<&'static str> {
    FILMS.into_iter().find(|(film, _)| *film == name && names().contains(film)).map(|(_, text)| text)
}
