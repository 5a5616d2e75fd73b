//! Which setting to lower where the device has no room for a buffer.

use crate::error::Error;

/// Settings, and words of which one stands in the names of the buffers that grow with them. The
/// first that fits is meant.
const HINTS: [(&str, &[&str]); 5] = [
    ("lower quality.entry_points", &["entr", "path", "contribution", "vert", "lobes"]),
    (
        "lower quality.cache_points or quality.gather_rays",
        &["gather", "merged ray", "record", "cache", "view", "near"],
    ),
    (
        "make the image smaller with --size, or lower quality.edge_samples",
        &["pixel", "edge", "splat", "tile", "direct", "shadow", "radiance", "weights", "pairs"],
    ),
    ("lower quality.cells or quality.directions", &["cluster", "cell", "gloss", "slot"]),
    ("take a model of fewer triangles", &["triangle", "node", "surface", "texture coordinates"]),
];

/// The error with what to do about it, where that is known.
pub(super) fn with_hint(error: Error) -> Error {
    let Error::OutOfMemory(message) = error else { return error };
    let name = message.split('`').nth(1).unwrap_or_default();
    let hint = HINTS.iter().find(|(_, words)| words.iter().any(|word| name.contains(word)));
    Error::OutOfMemory(match (hint, message.strip_suffix(Error::SMALLER)) {
        (Some((hint, _)), Some(need)) => format!("{need}{hint}"),
        _ => message,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_grows_with_a_setting_names_it() {
        let hinted = |name: &str| {
            with_hint(Error::OutOfMemory(format!("buffer `{name}` needs 9 MiB; {}", Error::SMALLER)))
                .to_string()
        };
        assert!(hinted("entry points").ends_with("needs 9 MiB; lower quality.entry_points"));
        assert!(hinted("gather rays").ends_with("lower quality.cache_points or quality.gather_rays"));
        assert!(hinted("splat weights").contains("--size"));
        assert!(hinted("nodes").ends_with("fewer triangles"));
        assert!(hinted("zero").ends_with(Error::SMALLER));
        // Whoever knows better has said so.
        assert_eq!(
            with_hint(Error::OutOfMemory("no `entry points`".to_owned())).to_string(),
            "out of device resources: no `entry points`"
        );
    }
}
