//! Reads files from unknown authors: only regular files, up to a maximum length. Decoders of
//! other crates run with their panics caught.

use std::cell::Cell;
use std::fmt;
use std::fs::{self, File};
use std::io::{self, Read};
use std::panic::{self, AssertUnwindSafe};
use std::path::Path;
use std::sync::Once;

/// The reason why a file was not read. The text follows the file's name.
#[derive(Debug, PartialEq, Eq)]
pub(crate) enum Unread {
    /// The file does not exist.
    Missing,
    /// The file exists; the text is the reason.
    Because(String),
}

impl fmt::Display for Unread {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missing => write!(f, "does not exist: check the path"),
            Self::Because(why) => write!(f, "{why}"),
        }
    }
}

impl From<io::Error> for Unread {
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::NotFound => Self::Missing,
            kind => Self::Because(format!("cannot be read: {kind}")),
        }
    }
}

/// The reason why a file of `bytes` bytes is too long to read.
pub(crate) fn too_long(bytes: impl fmt::Display, max_bytes: u64) -> String {
    format!("has {bytes} bytes, {max_bytes} at most can be read: is it the right file?")
}

/// Files up to this length are read without a query of free memory.
const SMALL_BYTES: u64 = 1 << 30;

/// An empty list with capacity for `bytes` bytes. A sparse file can claim any length at no cost.
///
/// # Errors
/// There is not enough memory; the text follows the file's name.
pub(crate) fn room_for(bytes: u64) -> Result<Vec<u8>, String> {
    let refusal = || format!("has {bytes} bytes, more than there is memory for: is it the right file?");
    // Systems give out more memory than they have, and end the process that uses it.
    if bytes > SMALL_BYTES && free_bytes().is_some_and(|free| bytes > free) {
        return Err(refusal());
    }
    let mut capacity = Vec::new();
    let count = usize::try_from(bytes).map_err(|_| refusal())?;
    capacity.try_reserve_exact(count).map_err(|_| refusal())?;
    Ok(capacity)
}

/// Memory that is available without swapping, bytes. `None` if the system does not report it.
fn free_bytes() -> Option<u64> {
    let text = fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?.checked_mul(1024)
}

/// The bytes of a regular file of at most `max_bytes`.
///
/// # Errors
/// Other kinds of files are refused: a pipe or a device may never end, and opening a pipe waits
/// for its writer.
pub(crate) fn read(path: &Path, max_bytes: u64) -> Result<Vec<u8>, Unread> {
    let about = fs::metadata(path)?;
    if about.is_dir() {
        return Err(Unread::Because("is a directory, a file was expected".to_owned()));
    }
    if !about.is_file() {
        return Err(Unread::Because("is not a regular file".to_owned()));
    }
    if about.len() > max_bytes {
        return Err(Unread::Because(too_long(about.len(), max_bytes)));
    }
    let mut bytes = room_for(about.len()).map_err(Unread::Because)?;
    // The file may have grown since, and some system files report a length of zero.
    File::open(path)?.take(max_bytes.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > max_bytes { Err(Unread::Because(too_long("more", max_bytes))) } else { Ok(bytes) }
}

thread_local! {
    /// Whether panics of this thread are caught, and therefore not printed.
    static IS_GUARDED: Cell<bool> = const { Cell::new(false) };
}

/// Maximum number of quoted characters of a panic's message.
const PANIC_CHARACTERS: usize = 100;

/// Runs `work` and catches its panics. `work` decodes bytes of unknown origin with a decoder of
/// another crate; messages call the decoder `name` ("PNG", "images").
///
/// # Errors
/// The errors of `work`. If the decoder panics, the error reports a damaged file; its text
/// follows the file's name. This thread's panic is not printed; panics of threads that the
/// decoder starts are.
pub(crate) fn guarded<T>(name: &str, work: impl FnOnce() -> Result<T, String>) -> Result<T, String> {
    static HOOK: Once = Once::new();
    HOOK.call_once(|| {
        let print = panic::take_hook();
        panic::set_hook(Box::new(move |info| {
            if !IS_GUARDED.get() {
                print(info);
            }
        }));
    });
    let was_guarded = IS_GUARDED.replace(true);
    // The unfinished state of `work` is dropped with it.
    let result = panic::catch_unwind(AssertUnwindSafe(work));
    IS_GUARDED.set(was_guarded);
    result.unwrap_or_else(|payload| {
        let text = payload.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| payload.downcast_ref::<&str>().copied()).unwrap_or("no message");
        let text: String =
            text.chars().take(PANIC_CHARACTERS).map(|c| if c.is_control() { ' ' } else { c }).collect();
        Err(format!("is damaged: the decoder of {name} failed ({text}): save it anew"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn panics_of_decoders_are_errors_in_one_line() {
        assert_eq!(guarded("PNG", || Ok(7)), Ok(7));
        assert_eq!(guarded("PNG", || Err::<(), _>("is none".to_owned())), Err("is none".to_owned()));
        let [zero, long] = [0_usize, 300];
        let divided = guarded("PNG", || Ok(1 / zero)).expect_err("it panics");
        assert!(divided.starts_with("is damaged: the decoder of PNG failed (attempt to divide"), "{divided}");
        let text = guarded("GIF", || -> Result<(), String> { panic!("{}\n\u{1b}", "x".repeat(long)) });
        let text = text.expect_err("it panics");
        assert!(text.len() < 200 && !text.contains(char::is_control), "{text:?}");
        // Nested calls; the outer one still does not print panics.
        let inner = guarded("GIF", || Ok(guarded("PNG", || Ok([1, 2][long])).is_err() && IS_GUARDED.get()));
        assert_eq!((inner, IS_GUARDED.get()), (Ok(true), false));
    }

    #[test]
    fn no_more_is_read_than_there_may_be() {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let file = folder.path().join("a");
        fs::write(&file, [7; 100]).expect("it can be written");
        assert_eq!(read(&file, 100), Ok(vec![7; 100]));
        let refusal = read(&file, 99).expect_err("it is too long").to_string();
        assert_eq!(refusal, "has 100 bytes, 99 at most can be read: is it the right file?");
        // A sparse file: it has a length, and no data on the disk.
        File::create(&file).and_then(|file| file.set_len(1 << 40)).expect("files may have holes");
        assert!(read(&file, 1 << 20).is_err());
        // The limit allows the length; memory does not.
        let refusal = read(&file, u64::MAX).expect_err("it has a terabyte").to_string();
        assert!(refusal.starts_with("has 1099511627776 bytes, more than there is memory for"), "{refusal}");
        assert_eq!(read(&folder.path().join("b"), 1), Err(Unread::Missing));
        assert!(read(folder.path(), 1).expect_err("no file").to_string().contains("directory"));
    }

    /// System files may report a length of zero.
    #[cfg(target_os = "linux")]
    #[test]
    fn what_has_no_length_has_an_end() {
        let file = Path::new("/proc/self/maps");
        assert_eq!(fs::metadata(file).expect("Linux has it").len(), 0);
        assert!(!read(file, 1 << 24).expect("it can be read").is_empty());
        assert!(
            read(file, 10).expect_err("it is longer").to_string().starts_with("has more bytes, 10 at most")
        );
    }

    #[cfg(unix)]
    #[test]
    fn nothing_is_read_that_does_not_end() {
        let zeros = read(Path::new("/dev/zero"), 10).expect_err("a device").to_string();
        assert_eq!(zeros, "is not a regular file");
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let pipe = folder.path().join("pipe");
        let made = std::process::Command::new("mkfifo").arg(&pipe).status().expect("every Unix has mkfifo");
        assert!(made.success());
        assert_eq!(read(&pipe, 10).expect_err("a pipe").to_string(), "is not a regular file");
    }
}
