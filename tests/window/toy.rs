//! A window without a renderer, for tests of the harness.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use x11rb::connection::Connection;
use x11rb::protocol::Event;
use x11rb::protocol::xproto::{
    AtomEnum, ChangeGCAux, ConnectionExt, CreateGCAux, CreateWindowAux, EventMask, KeyButMask, PropMode,
    Rectangle, WindowClass,
};
use x11rb::rust_connection::RustConnection;
use x11rb::wrapper::ConnectionExt as _;

use crate::client::{Point, atom, keyboard};
use crate::display::Display;

/// Initial size of the window.
pub const SIZE: (u16, u16) = (320, 240);

/// An event that has reached the window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Seen {
    Press(u8, Point),
    Release(u8, Point),
    Move(Point),
    /// A keysym and whether Control was down.
    Key(u32, bool),
    Resize(u16, u16),
    Hidden,
    Shown,
    Close,
}

/// A window in its own thread. Its colour encodes the number of button presses and its
/// size: see [`colour`].
pub struct Toy {
    seen: Arc<Mutex<Vec<Seen>>>,
    is_over: Arc<AtomicBool>,
    is_frozen: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// Colour of a toy of this size after `presses` presses.
pub fn colour(presses: u8, (width, height): (u16, u16)) -> [u8; 3] {
    [100 + 10 * presses, (width % 251) as u8, (height % 251) as u8]
}

impl Toy {
    /// Starts a toy; with `process`, the toy claims to be a window of that process.
    pub fn start(display: &Display, title: &str, process: Option<u32>) -> Self {
        let (connection, screen) = RustConnection::connect(Some(display.name())).unwrap();
        let (seen, is_over, is_frozen) = (Arc::default(), Arc::default(), Arc::default());
        let title = title.to_owned();
        let thread = thread::spawn({
            let (seen, flags) = (Arc::clone(&seen), [Arc::clone(&is_over), Arc::clone(&is_frozen)]);
            move || live(&connection, screen, &title, process, &seen, &flags)
        });
        Self { seen, is_over, is_frozen, thread: Some(thread) }
    }

    pub fn seen(&self) -> Vec<Seen> {
        self.seen.lock().unwrap().clone()
    }

    /// Freezes or thaws the toy: a frozen one gizmos no events.
    pub fn freeze(&self, is_frozen: bool) {
        self.is_frozen.store(is_frozen, Ordering::Relaxed);
    }

    /// Whether the toy has closed by itself.
    pub fn is_closed(&self) -> bool {
        self.thread.as_ref().is_some_and(JoinHandle::is_finished)
    }
}

impl Drop for Toy {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        let _ = self.thread.take().map(JoinHandle::join);
    }
}

fn live(
    connection: &RustConnection,
    screen: usize,
    title: &str,
    process: Option<u32>,
    seen: &Mutex<Vec<Seen>>,
    [is_over, is_frozen]: &[Arc<AtomicBool>; 2],
) {
    let root = connection.setup().roots[screen].root;
    let [window, pen] = [(); 2].map(|()| connection.generate_id().unwrap());
    let events = EventMask::EXPOSURE
        | EventMask::BUTTON_PRESS
        | EventMask::BUTTON_RELEASE
        | EventMask::POINTER_MOTION
        | EventMask::KEY_PRESS
        | EventMask::STRUCTURE_NOTIFY;
    let attributes = CreateWindowAux::new().event_mask(events);
    let (kind, depth) = (WindowClass::INPUT_OUTPUT, x11rb::COPY_DEPTH_FROM_PARENT);
    connection.create_window(depth, window, root, 30, 40, SIZE.0, SIZE.1, 0, kind, 0, &attributes).unwrap();
    connection.create_gc(pen, window, &CreateGCAux::new()).unwrap();
    let [protocols, delete, number] =
        ["WM_PROTOCOLS", "WM_DELETE_WINDOW", "_NET_WM_PID"].map(|name| atom(connection, name));
    let (name, text) = (AtomEnum::WM_NAME, AtomEnum::STRING);
    connection.change_property8(PropMode::REPLACE, window, name, text, title.as_bytes()).unwrap();
    connection.change_property32(PropMode::REPLACE, window, protocols, AtomEnum::ATOM, &[delete]).unwrap();
    if let Some(process) = process {
        let kind = AtomEnum::CARDINAL;
        connection.change_property32(PropMode::REPLACE, window, number, kind, &[process]).unwrap();
    }
    connection.map_window(window).unwrap();

    let keyboard = keyboard(connection);
    let (mut presses, mut size) = (0, SIZE);
    let draw = |presses, size: (u16, u16)| {
        let [red, green, blue] = colour(presses, size);
        let pen_colour = ChangeGCAux::new().foreground(u32::from_be_bytes([0, red, green, blue]));
        connection.change_gc(pen, &pen_colour).unwrap();
        let all = Rectangle { x: 0, y: 0, width: size.0, height: size.1 };
        connection.poly_fill_rectangle(window, pen, &[all]).unwrap();
    };
    while !is_over.load(Ordering::Relaxed) {
        connection.flush().unwrap();
        let event =
            if is_frozen.load(Ordering::Relaxed) { None } else { connection.poll_for_event().unwrap() };
        let Some(event) = event else {
            thread::sleep(Duration::from_millis(2));
            continue;
        };
        let point = |x: i16, y: i16| (x.into(), y.into());
        let news = match event {
            Event::Expose(_) => None,
            Event::ButtonPress(event) => {
                presses = (presses + 1) % 16;
                Some(Seen::Press(event.detail, point(event.event_x, event.event_y)))
            }
            Event::ButtonRelease(event) => {
                Some(Seen::Release(event.detail, point(event.event_x, event.event_y)))
            }
            Event::MotionNotify(event) => Some(Seen::Move(point(event.event_x, event.event_y))),
            Event::KeyPress(event) => {
                let keysym = keyboard.keysym(event.detail, event.state.contains(KeyButMask::SHIFT));
                Some(Seen::Key(keysym, event.state.contains(KeyButMask::CONTROL)))
            }
            Event::ConfigureNotify(event) if (event.width, event.height) != size => {
                size = (event.width, event.height);
                Some(Seen::Resize(size.0, size.1))
            }
            Event::UnmapNotify(_) => Some(Seen::Hidden),
            Event::MapNotify(_) => Some(Seen::Shown),
            Event::ClientMessage(event) if event.data.as_data32()[0] == delete => Some(Seen::Close),
            _ => continue,
        };
        seen.lock().unwrap().extend(news);
        if news == Some(Seen::Close) {
            return;
        }
        draw(presses, size);
    }
}
