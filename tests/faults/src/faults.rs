//! Selects the calls that fail.

use std::collections::HashMap;
use std::io::Write;
use std::path::PathBuf;
use std::sync::{LazyLock, Mutex};
use std::time::SystemTime;

use ash::vk;

/// One failing call, or all calls from one on.
#[derive(Debug, PartialEq)]
struct Fault {
    function: String,
    /// Number of the call, from 1.
    call: u64,
    and_later: bool,
    what: String,
}

#[derive(Default)]
struct Faults {
    /// The file of the faults, if there is one, and the time of its last change.
    file: Option<(PathBuf, Option<SystemTime>)>,
    faults: Vec<Fault>,
    /// Calls since the last change of the file.
    calls: HashMap<&'static str, u64>,
    all_calls: HashMap<&'static str, u64>,
}

static FAULTS: LazyLock<Mutex<Faults>> = LazyLock::new(|| {
    let text = std::env::var("LIGHTPATHS_FAULTS").unwrap_or_default();
    Mutex::new(match text.strip_prefix('@') {
        Some(file) => Faults { file: Some((file.into(), None)), ..Faults::default() },
        None => Faults { faults: parsed(&text), ..Faults::default() },
    })
});

/// Error codes by name.
const RESULTS: [(&str, vk::Result); 9] = [
    ("VK_ERROR_OUT_OF_HOST_MEMORY", vk::Result::ERROR_OUT_OF_HOST_MEMORY),
    ("VK_ERROR_OUT_OF_DEVICE_MEMORY", vk::Result::ERROR_OUT_OF_DEVICE_MEMORY),
    ("VK_ERROR_INITIALIZATION_FAILED", vk::Result::ERROR_INITIALIZATION_FAILED),
    ("VK_ERROR_DEVICE_LOST", vk::Result::ERROR_DEVICE_LOST),
    ("VK_ERROR_TOO_MANY_OBJECTS", vk::Result::ERROR_TOO_MANY_OBJECTS),
    ("VK_ERROR_MEMORY_MAP_FAILED", vk::Result::ERROR_MEMORY_MAP_FAILED),
    ("VK_ERROR_SURFACE_LOST_KHR", vk::Result::ERROR_SURFACE_LOST_KHR),
    ("VK_ERROR_OUT_OF_DATE_KHR", vk::Result::ERROR_OUT_OF_DATE_KHR),
    ("VK_ERROR_UNKNOWN", vk::Result::ERROR_UNKNOWN),
];

/// Counts a call. Returns the error code if the call fails.
pub(crate) fn due(function: &'static str) -> Option<vk::Result> {
    asked(function).map(|what| code(&what))
}

/// The code with this name.
pub(crate) fn code(name: &str) -> vk::Result {
    let found = RESULTS.iter().find(|(known, _)| *known == name);
    found.unwrap_or_else(|| panic!("faults: no such code: {name}")).1
}

/// Counts a call. Returns the text of its fault, if it has one.
pub(crate) fn asked(function: &'static str) -> Option<String> {
    let mut faults = FAULTS.lock().expect("no holder panics");
    let Faults { file, faults, calls, all_calls } = &mut *faults;
    *all_calls.entry(function).or_default() += 1;
    if let Some((path, time)) = file {
        let now = std::fs::metadata(&path).and_then(|about| about.modified()).ok();
        if now != *time {
            *faults = parsed(&std::fs::read_to_string(&path).unwrap_or_default());
            (*time, *calls) = (now, HashMap::new());
        }
    }
    let count = calls.entry(function).or_default();
    *count += 1;
    let is_due = |fault: &&Fault| fault.call == *count || fault.and_later && fault.call < *count;
    let fault = faults.iter().filter(|fault| fault.function == function).find(is_due)?;
    // stderr may be closed.
    let _ = writeln!(std::io::stderr(), "faults: {function}, call {count}: {}", fault.what);
    Some(fault.what.clone())
}

/// Writes the number of calls of each function, if a file is named.
pub(crate) fn write_calls() {
    let Some(file) = std::env::var_os("LIGHTPATHS_CALLS") else { return };
    let faults = FAULTS.lock().expect("no holder panics");
    let mut lines: Vec<_> =
        faults.all_calls.iter().map(|(name, count)| format!("{name} {count}\n")).collect();
    lines.sort();
    if let Err(error) = std::fs::write(&file, lines.concat()) {
        eprintln!("faults: {}: {error}", file.display());
    }
}

fn parsed(text: &str) -> Vec<Fault> {
    let fault = |text: &str| {
        let wrong = || panic!("faults: not NAME:CALL:CODE: {text}");
        let mut parts = text.trim().splitn(3, ':');
        let (Some(function), Some(call), Some(what)) = (parts.next(), parts.next(), parts.next()) else {
            wrong()
        };
        let number = call.trim_end_matches('+').parse();
        Fault {
            function: function.to_owned(),
            call: number.unwrap_or_else(|_| wrong()),
            and_later: call.ends_with('+'),
            what: what.to_owned(),
        }
    };
    text.split(',').filter(|fault| !fault.trim().is_empty()).map(fault).collect()
}
