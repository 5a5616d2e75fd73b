//! A minimal window manager for windows that fill the screen.

use std::collections::HashMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, JoinHandle, sleep};

use x11rb::connection::Connection;
use x11rb::protocol::Event;
use x11rb::protocol::xproto::{
    AtomEnum, ChangeWindowAttributesAux, ConfigureWindowAux, ConnectionExt, EventMask, PropMode, Window,
};
use x11rb::rust_connection::RustConnection;
use x11rb::wrapper::ConnectionExt as _;

use crate::POLL;
use crate::client::atom;
use crate::display::{Display, SCREEN};

/// Grants requests of windows, and makes a window fill the screen on request.
pub struct Manager {
    is_over: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Manager {
    /// Starts managing the windows of a display.
    pub fn start(display: &Display) -> Self {
        let (connection, screen) = RustConnection::connect(Some(display.name())).unwrap();
        let root = connection.setup().roots[screen].root;
        let events = EventMask::SUBSTRUCTURE_REDIRECT | EventMask::SUBSTRUCTURE_NOTIFY;
        let manages = ChangeWindowAttributesAux::new().event_mask(events);
        connection.change_window_attributes(root, &manages).unwrap().check().unwrap();
        let is_over = Arc::<AtomicBool>::default();
        let ends = is_over.clone();
        let thread = thread::spawn(move || manage(&connection, &ends));
        Self { is_over, thread: Some(thread) }
    }
}

impl Drop for Manager {
    fn drop(&mut self) {
        self.is_over.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn manage(connection: &RustConnection, is_over: &AtomicBool) {
    let [state, fills] = ["_NET_WM_STATE", "_NET_WM_STATE_FULLSCREEN"].map(|name| atom(connection, name));
    // Geometry of windows before they filled the screen.
    let mut before = HashMap::<Window, ConfigureWindowAux>::new();
    while !is_over.load(Ordering::Relaxed) {
        let Some(event) = connection.poll_for_event().unwrap() else {
            sleep(POLL);
            continue;
        };
        match event {
            Event::MapRequest(asked) => drop(connection.map_window(asked.window).unwrap()),
            Event::ConfigureRequest(asked) => {
                let wanted = ConfigureWindowAux::from_configure_request(&asked);
                drop(connection.configure_window(asked.window, &wanted).unwrap());
            }
            Event::ClientMessage(asked) if asked.type_ == state && asked.format == 32 => {
                // Action (remove, add or toggle) and up to two states.
                let [action, a, b, ..] = asked.data.as_data32();
                let is_filling = before.contains_key(&asked.window);
                if ![a, b].contains(&fills) || (action < 2 && is_filling == (action == 1)) {
                    continue;
                }
                let (wanted, states): (_, &[u32]) = match before.remove(&asked.window) {
                    Some(wanted) => (wanted, &[]),
                    None => {
                        let was = connection.get_geometry(asked.window).unwrap().reply().unwrap();
                        let was = ConfigureWindowAux::new()
                            .x(i32::from(was.x))
                            .y(i32::from(was.y))
                            .width(u32::from(was.width))
                            .height(u32::from(was.height));
                        before.insert(asked.window, was);
                        (ConfigureWindowAux::new().x(0).y(0).width(SCREEN.0).height(SCREEN.1), &[fills])
                    }
                };
                drop(connection.configure_window(asked.window, &wanted).unwrap());
                let kind = AtomEnum::ATOM;
                drop(
                    connection
                        .change_property32(PropMode::REPLACE, asked.window, state, kind, states)
                        .unwrap(),
                );
            }
            _ => (),
        }
        connection.flush().unwrap();
    }
}
