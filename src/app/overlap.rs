//! Refuses outputs that would replace an input or each other, even through links.

use std::fs;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};

/// Identity of a file. Two paths are one file if either field agrees.
struct Identity {
    /// The path with links followed. For a missing file, its folder with links followed,
    /// and its name.
    path: PathBuf,
    /// Device and inode, which hard links share.
    node: Option<(u64, u64)>,
}

impl Identity {
    fn from_path(path: &Path) -> Self {
        let folder = match path.parent() {
            Some(folder) if folder != Path::new("") => folder,
            _ => Path::new("."),
        };
        let new = || Some(fs::canonicalize(folder).ok()?.join(path.file_name()?));
        let real = fs::canonicalize(path).ok().or_else(new);
        Self { path: real.unwrap_or_else(|| path.to_owned()), node: node(path) }
    }

    fn is(&self, other: &Self) -> bool {
        self.path == other.path || (self.node.is_some() && self.node == other.node)
    }
}

#[cfg(unix)]
fn node(path: &Path) -> Option<(u64, u64)> {
    use std::os::unix::fs::MetadataExt;
    fs::metadata(path).ok().map(|found| (found.dev(), found.ino()))
}

/// Without inodes, only the canonical path identifies a link.
#[cfg(not(unix))]
fn node(_: &Path) -> Option<(u64, u64)> {
    None
}

/// Refuses an output that is one of the inputs, by name or through a link.
///
/// # Errors
/// [`Error::Output`] with both names.
pub(super) fn refuse_inputs<'a>(
    outputs: impl IntoIterator<Item = &'a Path>,
    inputs: &[impl AsRef<Path>],
) -> Result<()> {
    let inputs: Vec<_> =
        inputs.iter().map(|input| (input.as_ref(), Identity::from_path(input.as_ref()))).collect();
    for output in outputs {
        let own = Identity::from_path(output);
        if let Some((input, _)) = inputs.iter().find(|(_, input)| input.is(&own)) {
            let what = match *input == output {
                true => "is read as an input".to_owned(),
                false => format!("is the input {}", input.display()),
            };
            return Err(Error::output(
                output,
                format!("{what}, which it would replace: name another output"),
            ));
        }
    }
    Ok(())
}

/// Refuses two outputs that are one file, by name or through a link.
///
/// # Errors
/// [`Error::Usage`] with the name or names.
pub(super) fn refuse_repeated<'a>(outputs: impl IntoIterator<Item = &'a Path>) -> Result<()> {
    let mut known: Vec<(&Path, Identity)> = Vec::new();
    for output in outputs {
        let own = Identity::from_path(output);
        if let Some((first, _)) = known.iter().find(|(_, first)| first.is(&own)) {
            let message = match *first == output {
                true => format!("{} is named for two outputs", output.display()),
                false => {
                    format!("two outputs are one file: {} is {}", output.display(), first.display())
                }
            };
            return Err(Error::Usage(message + ": name another"));
        }
        known.push((output, own));
    }
    Ok(())
}

/// Refuses a folder of outputs in which an existing file is an input, or has two of the names.
///
/// # Errors
/// As [`refuse_inputs`] and [`refuse_repeated`].
pub(super) fn refuse_in_folder(
    folder: &Path,
    is_written: impl Fn(&str) -> bool,
    inputs: &[impl AsRef<Path>],
) -> Result<()> {
    // A missing file is no input.
    let Ok(entries) = fs::read_dir(folder) else { return Ok(()) };
    let names = entries.flatten().map(|entry| entry.file_name());
    let mut names: Vec<_> = names.filter(|name| name.to_str().is_some_and(&is_written)).collect();
    names.sort();
    let outputs: Vec<PathBuf> = names.iter().map(|name| folder.join(name)).collect();
    refuse_inputs(outputs.iter().map(PathBuf::as_path), inputs)?;
    refuse_links(&outputs)
}

/// A variant of [`refuse_repeated`] for the many frames of a film.
#[cfg(unix)]
fn refuse_links(outputs: &[PathBuf]) -> Result<()> {
    let mut known = std::collections::HashMap::new();
    for output in outputs {
        if let Some(first) = node(output).and_then(|node| known.insert(node, output)) {
            let (output, first) = (output.display(), first.display());
            return Err(Error::Usage(format!("two outputs are one file: {output} is {first}: name another")));
        }
    }
    Ok(())
}

#[cfg(not(unix))]
fn refuse_links(_: &[PathBuf]) -> Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_lead_to_one_file_are_found() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::write(path("a.png"), "").unwrap();
        fs::create_dir(path("below")).unwrap();
        let refused = |output: &Path| refuse_inputs([output], &[path("a.png")]).is_err();
        assert!(refused(&path("a.png")) && refused(&path("below/../a.png")));
        assert!(!refused(&path("b.png")) && !refused(&path("missing/a.png")));
        let repeated = |a: &str, b: &str| refuse_repeated([&*path(a), &*path(b)]).is_err();
        assert!(repeated("new.png", "below/../new.png") && repeated("a.png", "a.png"));
        assert!(!repeated("a.png", "b.png") && !repeated("a.png", "below/a.png"));
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        fs::write(path("a.obj"), "").unwrap();
        fs::hard_link(path("a.obj"), path("hard.png")).unwrap();
        std::os::unix::fs::symlink(path("a.obj"), path("soft.png")).unwrap();
        for name in ["hard.png", "soft.png"] {
            let refusal = refuse_inputs([&*path(name)], &[path("a.obj")]).unwrap_err();
            let line = refusal.to_string();
            assert!(line.contains(name) && line.contains("is the input") && line.contains("a.obj"), "{line}");
            assert_eq!(refusal.exit_code(), 2);
            assert!(refuse_repeated([&*path(name), &*path("a.obj")]).is_err());
        }
        let is_png = |name: &str| name.ends_with(".png");
        assert!(refuse_in_folder(folder.path(), is_png, &[path("a.obj")]).is_err());
        assert!(refuse_in_folder(folder.path(), is_png, &[] as &[PathBuf]).is_err(), "two names of one file");
        assert!(refuse_in_folder(folder.path(), |name| name == "hard.png", &[] as &[PathBuf]).is_ok());
    }
}
