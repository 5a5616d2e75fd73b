//! Being told to end: temporary files go, what was started goes, and the process ends as the signal
//! would have ended it.

use std::io::{self, Read};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The program that was started and is being waited for, if any.
static CHILD: Mutex<Option<Child>> = Mutex::new(None);

/// What there is to be kept before the process ends.
type Keep = Box<dyn FnOnce() + Send>;
static KEEP: Mutex<Option<Keep>> = Mutex::new(None);

/// Has that done once before a signal ends the process, which waits for it.
pub(super) fn before_end(keep: impl FnOnce() + Send + 'static) {
    *KEEP.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(keep));
}

/// From now on, an interrupted process leaves no half of a file behind, whatever it is doing; and a
/// file that grows longer than the shell allows (`ulimit -f`) is an error like any other.
#[cfg(unix)]
pub(super) fn watch() {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
    use signal_hook::low_level::emulate_default_handler;

    let ignored = ignored_signals();
    let wanted = [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|signal| ignored >> (signal - 1) & 1 == 0);
    // Where this fails the system's own way to end a process remains.
    let _ = signal_hook::flag::register(SIGXFSZ, std::sync::Arc::default());
    let Ok(mut signals) = signal_hook::iterator::Signals::new(wanted) else { return };
    let end = move || {
        let Some(signal) = signals.forever().next() else { return };
        let mut child = child();
        if let Some(child) = &mut *child {
            let _ = child.kill();
        }
        let keep = KEEP.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(keep) = keep {
            keep();
        }
        let _kept = crate::stored::remove_temporaries();
        let _ = emulate_default_handler(signal);
        std::process::exit(128 + signal);
    };
    let _ = std::thread::Builder::new().name("signals".into()).spawn(end);
}

/// Ends are as the system has them.
#[cfg(not(unix))]
pub(super) fn watch() {}

/// Signals that whoever started the process wants to be ignored (`nohup`), a bit each; none where
/// the system does not tell.
#[cfg(unix)]
fn ignored_signals() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}

/// Runs another program, which ends with this one. Returns how it ended, and what it
/// wrote to stderr.
///
/// # Errors
/// What the system said.
pub(super) fn run(command: &mut Command) -> io::Result<(ExitStatus, Vec<u8>)> {
    let mut said = Vec::new();
    let stderr = {
        let mut child = child();
        let started = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped()).spawn()?;
        child.insert(started).stderr.take()
    };
    if let Some(mut stderr) = stderr {
        stderr.read_to_end(&mut said)?;
    }
    let child = child().take();
    let status = child.expect("put there above").wait()?;
    Ok((status, said))
}

fn child() -> MutexGuard<'static, Option<Child>> {
    CHILD.lock().unwrap_or_else(PoisonError::into_inner)
}
