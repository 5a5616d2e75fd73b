//! A screen that nobody looks at.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use x11rb::rust_connection::RustConnection;

use crate::{HANG, POLL};

/// How long a server may take to leave before it is killed, which fails no test.
const LEAVES: Duration = Duration::from_secs(5);

/// Pixels of the screen, which is at the origin; a window that reaches over its edge
/// cannot be captured.
pub const SCREEN: (u32, u32) = (1600, 1000);

/// An X server of its own for each test: input has one pointer and one focus, which tests
/// must not share.
pub struct Display {
    name: String,
    server: Child,
    keeper: Option<RustConnection>,
}

impl Display {
    /// Fails where there is no Xvfb and says what to install: a machine without it must not pass
    /// for one that was tested.
    pub fn start() -> Self {
        Self::of("Xvfb").unwrap_or_else(|fault| panic!("{fault}"))
    }

    /// Starts `program`, an Xvfb, on a display that it finds free itself.
    pub fn of(program: &str) -> Result<Self, String> {
        let mut log = tempfile::tempfile().map_err(|error| error.to_string())?;
        let said = log.try_clone().map_err(|error| error.to_string())?;
        let screen = format!("{}x{}x24", SCREEN.0, SCREEN.1);
        let mut server = Command::new(program)
            .args(["-displayfd", "1", "-screen", "0", &screen, "-nolisten", "tcp", "-terminate"])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(said)
            .spawn()
            .map_err(|error| format!("cannot start {program} ({error}): install the package xvfb"))?;
        let number = first_line(server.stdout.take().expect("piped"));
        // From here on a failure takes the server down.
        let mut display = Self { name: format!(":{number}"), server, keeper: None };
        if number.parse::<u32>().is_err() {
            return Err(format!("{program} names no display; it says: {}", contents(&mut log)));
        }
        let (keeper, _) = RustConnection::connect(Some(&display.name))
            .map_err(|error| format!("no connection to {}: {error}", display.name))?;
        display.keeper = Some(keeper);
        Ok(display)
    }

    /// What goes into `DISPLAY`.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Process of the server.
    pub fn process(&self) -> u32 {
        self.server.id()
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        // Told `-terminate`, the server leaves with its last client and takes its lock and socket
        // along. It does so, too, when this process is killed.
        self.keeper = None;
        let end = Instant::now() + LEAVES;
        while Instant::now() < end {
            if matches!(self.server.try_wait(), Ok(Some(_))) {
                return;
            }
            thread::sleep(POLL);
        }
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// The first line, or nothing if none comes.
fn first_line(stream: impl Read + Send + 'static) -> String {
    let (sender, receiver) = mpsc::channel();
    thread::spawn(move || {
        let mut line = String::new();
        let _ = BufReader::new(stream).read_line(&mut line);
        sender.send(line)
    });
    receiver.recv_timeout(HANG).unwrap_or_default().trim().to_owned()
}

fn contents(log: &mut File) -> String {
    let mut text = String::new();
    let _ = log.rewind().and_then(|()| log.read_to_string(&mut text));
    text.trim().replace('\n', "; ")
}
