//! Out-of-memory hint: the setting to lower if the device lacks memory for a buffer.

use crate::error::Error;

/// Settings, each with fragments of the names of buffers that grow with it. The first match counts.
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
    ("lower quality.cells or quality.directions", &["cluster", "cell", "gloss", "gloss_bin"]),
    ("take a model of fewer triangles", &["triangle", "node", "surface", "texture coordinates"]),
];

/// Adds the hint to an out-of-memory error, if the buffer's name has one.
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
        // An error with its own advice stays.
        assert_eq!(
            with_hint(Error::OutOfMemory("no `entry points`".to_owned())).to_string(),
            "out of device resources: no `entry points`"
        );
    }
}
