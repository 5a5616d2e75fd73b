//! Handling of signals that end the process: removes temporary files, ends the started program,
//! then ends the process by the same signal.

use std::io::{self, Read};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// The started program that the process waits for.
static CHILD: Mutex<Option<Child>> = Mutex::new(None);

/// Work to do before the process ends.
type Keep = Box<dyn FnOnce() + Send>;
static KEEP: Mutex<Option<Keep>> = Mutex::new(None);

/// Registers work that runs once before a signal ends the process.
#[cfg(feature = "window")]
pub(super) fn before_end(keep: impl FnOnce() + Send + 'static) {
    *KEEP.lock().unwrap_or_else(PoisonError::into_inner) = Some(Box::new(keep));
}

/// Installs the signal handlers. An interrupted process then leaves no partial file. A file longer
/// than the shell allows (`ulimit -f`) becomes an ordinary error.
#[cfg(unix)]
pub(super) fn watch() {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGXFSZ};
    use signal_hook::low_level::emulate_default_handler;

    let ignored = ignored_signals();
    let wanted = [SIGINT, SIGTERM, SIGHUP].into_iter().filter(|signal| ignored >> (signal - 1) & 1 == 0);
    // On failure the system's default action remains.
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
        let _kept = crate::cache_file::remove_temporaries();
        let _ = emulate_default_handler(signal);
        std::process::exit(128 + signal);
    };
    let _ = std::thread::Builder::new().name("signals".into()).spawn(end);
}

/// Keeps the system's default behaviour.
#[cfg(not(unix))]
pub(super) fn watch() {}

/// Signals that the parent process set to be ignored (`nohup`), one bit each. Zero if the system
/// does not report them.
#[cfg(unix)]
fn ignored_signals() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    mask.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0)
}

/// Runs another program, which ends with this process. Returns its exit status and stderr.
///
/// # Errors
/// The system's error.
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
