//! A virtual screen: Xvfb.

use std::fs::File;
use std::io::{BufRead, BufReader, Read, Seek};
use std::process::{Child, Command, Stdio};
use std::sync::mpsc;
use std::thread;
use std::time::{Duration, Instant};

use x11rb::rust_connection::RustConnection;

use crate::{HANG, POLL};

/// Time limit for a server's exit. It is killed afterwards, which fails no test.
const LEAVES: Duration = Duration::from_secs(5);

/// Pixels of the screen, which is at the origin; a window that reaches over its edge
/// cannot be captured.
pub const SCREEN: (u32, u32) = (1600, 1000);

/// A separate X server for each test: input has one pointer and one focus, which tests
/// must not share.
pub struct Display {
    name: String,
    server: Child,
    keeper: Option<RustConnection>,
}

impl Display {
    /// Fails if there is no Xvfb, with the package to install: the tests must not pass unrun.
    pub fn start() -> Self {
        Self::with_server("Xvfb").unwrap_or_else(|fault| panic!("{fault}"))
    }

    /// Starts `program`, an Xvfb, which finds a free display itself.
    pub fn with_server(program: &str) -> Result<Self, String> {
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
        // From here on, a failure ends the server.
        let mut display = Self { name: format!(":{number}"), server, keeper: None };
        if number.parse::<u32>().is_err() {
            return Err(format!("{program} names no display; it says: {}", contents(&mut log)));
        }
        let (keeper, _) = RustConnection::connect(Some(&display.name))
            .map_err(|error| format!("no connection to {}: {error}", display.name))?;
        display.keeper = Some(keeper);
        Ok(display)
    }

    /// Value of `DISPLAY`.
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
        // With `-terminate`, the server exits with its last client and removes its lock and socket.
        // It also does so if this process is killed.
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

/// The first line; empty if there is none.
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
