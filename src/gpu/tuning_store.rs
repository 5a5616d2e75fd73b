//! The values that `lightpaths tune` found to be the fastest, stored on disk: a file for each
//! device and driver in the user's cache folder. An unusable file is ignored with a warning.

use std::fs;
use std::path::Path;

use serde_json::{Map, Value, json};

use super::device::DeviceSummary;
use super::device_files::{self, TUNING};
use super::tuning::{Tuned, Tuning, TuningChange, TuningSource};
use crate::error::{Error, Result};
use crate::files::{self, Unread};

/// Version of the file format.
const VERSION: u32 = 1;
/// A file that is longer is not read.
const MAX_BYTES: u64 = 1 << 16;

impl DeviceSummary {
    /// The tuning of the device's class with the stored changes, if they are wanted, and the given
    /// changes, which win.
    ///
    /// # Errors
    /// [`Error::Usage`] if the device does not take a given value.
    pub fn tuning(&self, with_stored: bool, given: &[TuningChange]) -> Result<Tuned> {
        let class = Tuned::from_class(Tuning::from_device(self.kind, &self.limits, Tuning::cores()));
        let mut tuned = if with_stored { stored(self, class) } else { class };
        for change in given {
            tuned.apply(*change, TuningSource::Given, &self.limits).map_err(Error::Usage)?;
        }
        Ok(tuned)
    }
}

/// The tuning of the class with the stored changes. If the file is unusable, that of the class with
/// a warning added.
fn stored(summary: &DeviceSummary, class: Tuned) -> Tuned {
    let Some(path) = &summary.tuning_path else { return class };
    let mut tuned = class.clone();
    let mut apply = |change| tuned.apply(change, TuningSource::Stored, &summary.limits);
    match read(path, summary).and_then(|changes| changes.into_iter().try_for_each(&mut apply)) {
        Ok(()) => tuned,
        Err(why) => {
            let file = path.display();
            let warning =
                format!("{file}: {why}: stored tuning is ignored, `lightpaths tune` measures it again");
            class.with_warning(warning)
        }
    }
}

/// The stored changes. Empty if there is no file.
///
/// # Errors
/// Why the file is unusable.
fn read(path: &Path, summary: &DeviceSummary) -> std::result::Result<Vec<TuningChange>, String> {
    match files::read(path, MAX_BYTES) {
        Ok(bytes) => parse(&bytes, summary),
        Err(Unread::Missing) => Ok(Vec::new()),
        Err(unread) => Err(unread.to_string()),
    }
}

/// Writes the changes of the class's values; without any, deletes the file.
///
/// # Errors
/// [`Error::Output`]; [`Error::Usage`] if nothing can be stored.
pub(super) fn write<'a>(summary: &'a DeviceSummary, changes: &[TuningChange]) -> Result<&'a Path> {
    let path = path(summary)?;
    let done = match changes {
        [] => fs::remove_file(path).or_else(|error| match error.kind() {
            std::io::ErrorKind::NotFound => Ok(()),
            _ => Err(error),
        }),
        _ => device_files::write(path, &[contents(summary, changes).as_bytes()]),
    };
    done.map_err(|error| Error::output(path, format!("cannot be written: {}", error.kind())))?;
    Ok(path)
}

/// The file of a device.
///
/// # Errors
/// [`Error::Usage`] if nothing can be stored.
pub(super) fn path(summary: &DeviceSummary) -> Result<&Path> {
    summary.tuning_path.as_deref().ok_or_else(|| {
        let variable = TUNING.variable;
        Error::Usage(format!("no tuning can be stored: {variable} is empty, or there is no cache folder"))
    })
}

fn contents(summary: &DeviceSummary, changes: &[TuningChange]) -> String {
    let values: Map<_, _> =
        changes.iter().map(|change| (change.choice.name.to_owned(), change.value.into())).collect();
    let document =
        json!({"version": VERSION, "device": summary.name, "driver": summary.driver, "values": values});
    format!("{document:#}\n")
}

fn parse(bytes: &[u8], summary: &DeviceSummary) -> std::result::Result<Vec<TuningChange>, String> {
    let document: Value = serde_json::from_slice(bytes).map_err(|error| format!("is damaged: {error}"))?;
    if document["version"] != VERSION {
        return Err(format!("has version {}, {VERSION} is read", document["version"]));
    }
    for (key, own) in [("device", &summary.name), ("driver", &summary.driver)] {
        if document[key] != **own {
            return Err(format!("is of another {key}: {}", document[key]));
        }
    }
    let values = document["values"].as_object().ok_or("has no values")?;
    values.iter().map(|(name, value)| format!("{name}={value}").parse()).collect()
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::super::device::{CPU, Limits};
    use super::super::tuning::CHOICES;
    use super::*;

    fn summary(folder: &Path) -> DeviceSummary {
        let limits = Limits {
            workgroup_invocations: 64,
            workgroup_size: [64; 3],
            workgroup_count: [65_535; 3],
            subgroup_size: 8,
            ..Limits::default()
        };
        DeviceSummary {
            index: 0,
            name: "card".to_owned(),
            kind: CPU,
            driver: "driver 1".to_owned(),
            limits,
            unmet: None,
            tuning_path: Some(folder.join("new").join("a.json")),
        }
    }

    fn values(tuned: &Tuned) -> Vec<(&'static str, u32, TuningSource)> {
        tuned.values().map(|(choice, value, source)| (choice.name, value, source)).collect()
    }

    #[test]
    fn changes_come_back_and_none_deletes_the_file() {
        let folder = tempfile::tempdir().unwrap();
        let summary = summary(folder.path());
        let class = values(&summary.tuning(false, &[]).unwrap());
        assert_eq!(values(&summary.tuning(true, &[]).unwrap()), class);
        let changes: Vec<_> = CHOICES.iter().map(|choice| choice.change(choice.values[1])).collect();
        let path = write(&summary, &changes).unwrap();
        let tuned = summary.tuning(true, &[]).unwrap();
        let expected = CHOICES.iter().map(|choice| (choice.name, choice.values[1], TuningSource::Stored));
        assert_eq!(values(&tuned), expected.collect::<Vec<_>>());
        assert_eq!(tuned.warning, None);
        assert_eq!(values(&summary.tuning(false, &[]).unwrap()), class);
        for _ in 0..2 {
            assert_eq!(write(&summary, &[]).unwrap(), path);
            assert!(!path.exists());
        }
    }

    #[test]
    fn given_values_replace_stored_ones_and_must_fit() {
        let folder = tempfile::tempdir().unwrap();
        let summary = summary(folder.path());
        write(&summary, &["strip=64".parse().unwrap()]).unwrap();
        let tuned = summary.tuning(true, &["strip=256".parse().unwrap()]).unwrap();
        assert!(values(&tuned).contains(&("strip", 256, TuningSource::Given)));
        let refused = summary.tuning(true, &["waiting_group=128".parse().unwrap()]).unwrap_err();
        assert_eq!(refused.exit_code(), 2);
        assert!(refused.to_string().contains("waiting_group takes 8, 16, 32, 64"), "{refused}");
    }

    #[test]
    fn unusable_files_are_ignored_with_a_warning() {
        let folder = tempfile::tempdir().unwrap();
        let summary = summary(folder.path());
        let class = values(&summary.tuning(false, &[]).unwrap());
        let change = CHOICES[0].change(1);
        let good = contents(&summary, &[change]);
        let path = write(&summary, &[change]).unwrap();
        let ignored = |text: &str| {
            fs::write(path, text).unwrap();
            let tuned = summary.tuning(true, &[]).unwrap();
            assert_eq!(values(&tuned), class, "{text}");
            tuned.warning.unwrap()
        };
        for (from, to, word) in [
            ("{", "", "is damaged"),
            ("\"version\": 1", "\"version\": 2", "has version 2"),
            ("card", "another", "is of another device"),
            ("driver 1", "driver 2", "is of another driver"),
            ("values", "value", "has no values"),
            ("finds_alike", "finds", "one of finds_alike"),
            ("\"finds_alike\": 1", "\"finds_alike\": true", "takes 0, 1"),
            ("\"finds_alike\": 1", "\"scan_group\": 256", "takes 8, 32, 64"),
        ] {
            let why = ignored(&good.replacen(from, to, 1));
            assert!(why.contains(word) && why.contains("a.json"), "{why}");
        }
        for length in 0..good.len() - 2 {
            let why = ignored(&good[..length]);
            assert!(why.contains("is damaged"), "{length} bytes: {why}");
        }
        fs::write(path, vec![b' '; MAX_BYTES as usize + 1]).unwrap();
        assert!(summary.tuning(true, &[]).unwrap().warning.unwrap().contains("at most can be read"));
    }

    #[test]
    fn without_a_folder_nothing_is_read_or_written() {
        let summary = DeviceSummary { tuning_path: None, ..summary(Path::new("")) };
        assert_eq!(summary.tuning(true, &[]).unwrap().warning, None);
        assert_eq!(write(&summary, &[]).unwrap_err().exit_code(), 2);
    }
}
