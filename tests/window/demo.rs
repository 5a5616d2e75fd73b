//! The program under test: its window, its output, its end.

use std::cell::{OnceCell, RefCell};
use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use image::RgbImage;

use crate::HANG;
use crate::client::{BLOT, Client, Point};
use crate::display::Display;
use crate::keys;
use crate::picture::{Area, changed_pixels};
use crate::until;

/// Number of consecutive equal frames that count as settled: the maximum number of frames on their
/// way to the screen.
const SAME: usize = 3;

#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stream {
    Out,
    Err,
}

/// A line of the process's output.
#[derive(Clone, Debug)]
pub struct Line {
    pub since_start: Duration,
    pub stream: Stream,
    pub text: String,
}

/// A running process and its window. The process is killed on drop, if it still runs.
pub struct Demo<'a> {
    display: Option<&'a Display>,
    child: RefCell<Child>,
    lines: Arc<Mutex<Vec<Line>>>,
    readers: RefCell<Vec<JoinHandle<()>>>,
    client: OnceCell<Client>,
    /// Name of the test.
    name: String,
}

impl<'a> Demo<'a> {
    /// Starts `lightpaths demo` with these arguments.
    pub fn start(display: &'a Display, arguments: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_lightpaths"));
        command.arg("demo").args(arguments);
        Self::run(Some(display), command)
    }

    /// Runs any command on `display`, or without a display. A point of the window is one pixel,
    /// whatever the machine's settings.
    pub fn run(display: Option<&'a Display>, command: Command) -> Self {
        Self::run_scaled(display, command, "1")
    }

    /// The same, with `scale` pixels for each point of the window.
    pub fn run_scaled(display: Option<&'a Display>, mut command: Command, scale: &str) -> Self {
        command.env_remove("DISPLAY").env_remove("WAYLAND_DISPLAY").env_remove("WAYLAND_SOCKET");
        command.envs(display.map(|display| ("DISPLAY", display.name()))).env("WINIT_X11_SCALE_FACTOR", scale);
        // The user's list of recent scenes stays as it is.
        if !command.get_envs().any(|(name, _)| name == "LIGHTPATHS_RECENT") {
            command.env("LIGHTPATHS_RECENT", "");
        }
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let start = Instant::now();
        let mut child = command.spawn().unwrap();
        let lines = Arc::default();
        let out = child.stdout.take().expect("piped");
        let err = child.stderr.take().expect("piped");
        let readers = vec![
            keep(out, Stream::Out, start, Arc::clone(&lines)),
            keep(err, Stream::Err, start, Arc::clone(&lines)),
        ];
        let name = thread::current().name().unwrap_or("test").replace("::", "-");
        Self {
            display,
            child: RefCell::new(child),
            lines,
            readers: RefCell::new(readers),
            client: OnceCell::new(),
            name,
        }
    }

    /// Process.
    pub fn process(&self) -> u32 {
        self.child.borrow().id()
    }

    /// The client for the window. The first call waits for the window.
    pub fn client(&self) -> &Client {
        self.client.get_or_init(|| {
            let display = self.display.expect("a display was given");
            Client::attach(display, self.process(), HANG)
        })
    }

    /// All lines so far of one stream.
    pub fn lines(&self, stream: Stream) -> Vec<String> {
        let lines = self.lines.lock().unwrap();
        lines.iter().filter(|line| line.stream == stream).map(|line| line.text.clone()).collect()
    }

    /// Number of lines so far, for [`Self::wait_for_line_since`].
    pub fn mark(&self) -> usize {
        self.lines.lock().unwrap().len()
    }

    /// The first line of either stream that begins with `prefix`.
    pub fn wait_for_line(&self, prefix: &str, within: Duration) -> String {
        self.wait_for_line_since(0, prefix, within)
    }

    /// The first such line after `mark`. Fails as soon as the process has ended without it.
    pub fn wait_for_line_since(&self, mark: usize, prefix: &str, within: Duration) -> String {
        until(&format!("line {prefix:?}"), within, || {
            // The order matters: lines from before the end have been read when they are searched.
            let end = self.try_end();
            let lines = self.lines.lock().unwrap();
            let line = lines.iter().skip(mark).find(|line| line.text.starts_with(prefix));
            assert!(line.is_some() || end.is_none(), "ended ({}) without line {prefix:?}", end.unwrap());
            line.map(|line| line.text.clone())
        })
    }

    /// Whether the process prints a line with that prefix after `mark`, instead of ending.
    pub fn asks(&self, mark: usize, prefix: &str) -> bool {
        until(&format!("the end, or line {prefix:?}"), HANG, || {
            let end = self.try_end();
            let lines = self.lines.lock().unwrap();
            let is_said = lines.iter().skip(mark).any(|line| line.text.starts_with(prefix));
            (is_said || end.is_some()).then_some(is_said)
        })
    }

    pub fn is_running(&self) -> bool {
        self.try_end().is_none()
    }

    /// Waits for the end. `None` if a signal ended the process.
    pub fn exit_code(&self, within: Duration) -> Option<i32> {
        until("end of the process", within, || self.try_end()).code()
    }

    pub fn capture(&self) -> RgbImage {
        self.client().capture()
    }

    /// Waits until the program reports that its window shows the result of all earlier input.
    pub fn wait_for_answer(&self) {
        let mark = self.mark();
        self.client().tap(&[], keys::function(9));
        self.wait_for_line_since(mark, "lightpaths: settled", HANG);
    }

    /// Presses and releases the button at a point. The pointer moves there one frame earlier, and
    /// stays for one: a click counts for the item that is under the pointer when its frame begins.
    pub fn click(&self, button: u8, at: Point) {
        self.client().move_to(at);
        self.wait_for_answer();
        self.client().click(button, at);
        self.wait_for_answer();
    }

    /// Moves from one point to the other in `steps` with the button down. The press, the moves and
    /// the release each have their own frames, even if these are slow: in a single frame, nothing
    /// would be dragged.
    pub fn drag(&self, button: u8, from: Point, to: Point, steps: i32) {
        let client = self.client();
        client.move_to(from);
        client.press(button);
        self.wait_for_answer();
        for step in 1..=steps {
            let between = |a: i32, b: i32| a + (b - a) * step / steps;
            client.move_to((between(from.0, to.0), between(from.1, to.1)));
        }
        self.wait_for_answer();
        client.release(button);
    }

    /// The window, or `area` of it, when it shows the result of all earlier input. The program
    /// reports this in a number of frames; the last ones must be equal.
    pub fn settled(&self, area: Option<Area>) -> RgbImage {
        let mut last = None;
        let mut same = 0;
        until("settled picture", HANG, || {
            self.wait_for_answer();
            let next = self.capture();
            let area = area.unwrap_or_else(|| Area::from_image(&next));
            let is_same = last.as_ref().is_some_and(|last: &RgbImage| {
                last.dimensions() == next.dimensions() && changed_pixels(last, &next, area, 0) == 0
            });
            same = if is_same { same + 1 } else { 1 };
            last = Some(next);
            (same >= SAME).then(|| last.take().expect("set above"))
        })
    }

    /// Waits until a pixel of `area` differs from `before`.
    pub fn wait_for_change(&self, before: &RgbImage, area: Area, within: Duration) -> RgbImage {
        until("change", within, || {
            let now = self.capture();
            (changed_pixels(before, &now, area, 0) > 0).then_some(now)
        })
    }

    /// Asserts that the process draws its whole window on request.
    pub fn assert_presents(&self, within: Duration) {
        self.client().blot();
        self.wait_for_picture(within);
    }

    /// Waits until a blot is gone.
    pub fn wait_for_picture(&self, within: Duration) {
        until("presented picture", within, || {
            assert!(self.is_running(), "ended");
            self.capture().pixels().all(|pixel| pixel.0 != BLOT).then_some(())
        });
    }

    /// Exit status, if the process has ended; all of its output has then been read.
    fn try_end(&self) -> Option<ExitStatus> {
        let status = self.child.borrow_mut().try_wait().unwrap();
        if status.is_some() {
            self.readers.borrow_mut().drain(..).for_each(|reader| reader.join().unwrap());
        }
        status
    }

    /// Prints the state of a failed test. Must not panic.
    fn report(&self) {
        if let Some(client) = self.client.get() {
            match save_failure(client, &self.name) {
                Ok(path) => eprintln!("the window is in {}", path.display()),
                Err(fault) => eprintln!("no picture of the window: {fault}"),
            }
        }
        for line in self.lines.lock().iter().flat_map(|lines| lines.iter()) {
            eprintln!("{:9.3} s {:?}: {}", line.since_start.as_secs_f64(), line.stream, line.text);
        }
    }
}

impl Drop for Demo<'_> {
    fn drop(&mut self) {
        if thread::panicking() {
            self.report();
        }
        let child = self.child.get_mut();
        let _ = child.kill();
        let _ = child.wait();
    }
}

/// Folder of the pictures of failures.
pub fn failures() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).with_file_name("window-failures")
}

/// Saves a picture of the window. Must not panic.
pub fn save_failure(client: &Client, name: &str) -> Result<PathBuf, String> {
    let folder = failures();
    let path = folder.join(format!("{name}.png"));
    let image = client.try_capture()?;
    fs::create_dir_all(&folder).map_err(|error| error.to_string())?;
    image.save(&path).map_err(|error| error.to_string())?;
    Ok(path)
}

/// Keeps the lines of a stream until it ends.
fn keep(
    stream: impl Read + Send + 'static,
    which: Stream,
    start: Instant,
    lines: Arc<Mutex<Vec<Line>>>,
) -> JoinHandle<()> {
    thread::spawn(move || {
        let mut reader = BufReader::new(stream);
        let mut bytes = Vec::new();
        while reader.read_until(b'\n', &mut bytes).is_ok_and(|count| count > 0) {
            let text = String::from_utf8_lossy(&bytes).trim_end().to_owned();
            lines.lock().unwrap().push(Line { since_start: start.elapsed(), stream: which, text });
            bytes.clear();
        }
    })
}
