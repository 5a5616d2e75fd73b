//! Sends mouse and keyboard input to one window, and captures it.

use std::thread::sleep;
use std::time::Duration;

use image::RgbImage;
use x11rb::CURRENT_TIME;
use x11rb::connection::Connection;
use x11rb::cookie::VoidCookie;
use x11rb::errors::ConnectionError;
use x11rb::protocol::xproto::{
    self, AtomEnum, ClientMessageEvent, ConfigureWindowAux, ConnectionExt, CreateGCAux, EventMask,
    ImageFormat, ImageOrder, InputFocus, MapState, Rectangle, Window, WindowClass,
};
use x11rb::protocol::xtest::ConnectionExt as _;
use x11rb::rust_connection::RustConnection;

use crate::display::Display;
use crate::keys::{self, Keyboard};
use crate::until;

/// Pixels from the window's upper left corner.
pub type Point = (i32, i32);

/// No picture has this colour; see [`Client::blot`].
pub const BLOT: [u8; 3] = [255, 0, 255];

/// Pause between consecutive events, so that no two fall into one frame of the window.
const STEP: Duration = Duration::from_millis(15);

/// Acts on one window. There is no window manager, so the server executes requests at once.
pub struct Client {
    connection: RustConnection,
    root: Window,
    window: Window,
    keyboard: Keyboard,
}

impl Client {
    /// Waits for a window of `process`, or one with "lightpaths" in its title, moves it to the
    /// screen's corner and focuses it.
    pub fn attach(display: &Display, process: u32, within: Duration) -> Self {
        let (connection, screen) = RustConnection::connect(Some(display.name())).unwrap();
        let root = connection.setup().roots[screen].root;
        let window = until("window", within, || find(&connection, root, process));
        let keyboard = keyboard(&connection);
        let client = Self { connection, root, window, keyboard };
        let corner = ConfigureWindowAux::new().x(0).y(0);
        settle(client.connection.configure_window(window, &corner));
        client.focus();
        client
    }

    pub fn window(&self) -> Window {
        self.window
    }

    /// Width and height.
    pub fn size(&self) -> (u32, u32) {
        let geometry = self.connection.get_geometry(self.window).unwrap().reply().unwrap();
        (geometry.width.into(), geometry.height.into())
    }

    /// Upper left corner of the window on the screen.
    pub fn place(&self) -> Point {
        let geometry = self.connection.get_geometry(self.window).unwrap().reply().unwrap();
        (geometry.x.into(), geometry.y.into())
    }

    /// Whether the window is shown.
    pub fn is_shown(&self) -> bool {
        is_shown(&self.connection, self.window).unwrap()
    }

    /// Gives the keyboard to the window.
    pub fn focus(&self) {
        settle(self.connection.set_input_focus(InputFocus::POINTER_ROOT, self.window, CURRENT_TIME));
    }

    pub fn move_to(&self, (x, y): Point) {
        let at = |place: i32| i16::try_from(place).unwrap();
        let request = self.connection.translate_coordinates(self.window, self.root, at(x), at(y));
        let place = request.unwrap().reply().unwrap();
        self.fake(xproto::MOTION_NOTIFY_EVENT, 0, (place.dst_x, place.dst_y));
    }

    /// Button 1 is the left one, 2 the wheel, 3 the right one.
    pub fn press(&self, button: u8) {
        self.fake(xproto::BUTTON_PRESS_EVENT, button, (0, 0));
    }

    pub fn release(&self, button: u8) {
        self.fake(xproto::BUTTON_RELEASE_EVENT, button, (0, 0));
    }

    pub fn click(&self, button: u8, at: Point) {
        self.move_to(at);
        self.press(button);
        self.release(button);
    }

    /// Moves from one point to the other in `steps` with the button down; pauses keep the server
    /// from merging moves.
    pub fn drag(&self, button: u8, from: Point, to: Point, steps: i32) {
        self.move_to(from);
        self.press(button);
        for step in 1..=steps {
            let between = |a: i32, b: i32| a + (b - a) * step / steps;
            self.move_to((between(from.0, to.0), between(from.1, to.1)));
        }
        self.release(button);
    }

    /// Turns the wheel by `clicks` clicks, away from the user if positive.
    pub fn scroll(&self, at: Point, clicks: i32) {
        self.move_to(at);
        let button = if clicks > 0 { 4 } else { 5 };
        for _ in 0..clicks.abs() {
            self.press(button);
            self.release(button);
        }
    }

    pub fn key_down(&self, keysym: u32) {
        self.fake(xproto::KEY_PRESS_EVENT, self.keyboard.find(keysym).0, (0, 0));
    }

    pub fn key_up(&self, keysym: u32) {
        self.fake(xproto::KEY_RELEASE_EVENT, self.keyboard.find(keysym).0, (0, 0));
    }

    /// Presses and releases a key while `held` are down.
    pub fn tap(&self, held: &[u32], keysym: u32) {
        held.iter().for_each(|key| self.key_down(*key));
        self.key_down(keysym);
        self.key_up(keysym);
        held.iter().rev().for_each(|key| self.key_up(*key));
    }

    pub fn type_text(&self, text: &str) {
        for keysym in text.chars().map(keys::of) {
            let held: &[u32] = if self.keyboard.find(keysym).1 { &[keys::SHIFT] } else { &[] };
            self.tap(held, keysym);
        }
    }

    pub fn resize(&self, (width, height): (u32, u32)) {
        let size = ConfigureWindowAux::new().width(width).height(height);
        settle(self.connection.configure_window(self.window, &size));
    }

    /// Unmaps the window, as minimising does.
    pub fn hide(&self) {
        settle(self.connection.unmap_window(self.window));
    }

    /// Undoes [`Self::hide`].
    pub fn show(&self) {
        settle(self.connection.map_window(self.window));
        self.focus();
    }

    /// Asks the window to close, as the button in a title bar does.
    pub fn close(&self) {
        let [protocols, delete] =
            ["WM_PROTOCOLS", "WM_DELETE_WINDOW"].map(|name| atom(&self.connection, name));
        let event = ClientMessageEvent::new(32, self.window, protocols, [delete, CURRENT_TIME, 0, 0, 0]);
        settle(self.connection.send_event(false, self.window, EventMask::NO_EVENT, event));
    }

    /// Paints the window with a colour that it does not have, and requests a redraw. Once the
    /// colour is gone, the process has presented a frame.
    pub fn blot(&self) {
        let (width, height) = self.size();
        let pixel = u32::from_be_bytes([0, BLOT[0], BLOT[1], BLOT[2]]);
        let pen = self.connection.generate_id().unwrap();
        settle(self.connection.create_gc(pen, self.window, &CreateGCAux::new().foreground(pixel)));
        let all = Rectangle { x: 0, y: 0, width: width as u16, height: height as u16 };
        settle(self.connection.poly_fill_rectangle(self.window, pen, &[all]));
        settle(self.connection.free_gc(pen));
        // A window with a background loses the blot here; the renderer's window has no background.
        settle(self.connection.clear_area(true, self.window, 0, 0, 0, 0));
    }

    /// An image of the window at one moment.
    pub fn capture(&self) -> RgbImage {
        self.try_capture().unwrap_or_else(|fault| panic!("no capture: {fault}"))
    }

    /// Captures without panicking, for the reports of failed tests.
    pub fn try_capture(&self) -> Result<RgbImage, String> {
        let words = |error: &dyn std::error::Error| error.to_string();
        let geometry = self.connection.get_geometry(self.window).map_err(|error| words(&error))?;
        let geometry = geometry.reply().map_err(|error| words(&error))?;
        let (width, height) = (geometry.width, geometry.height);
        let format = ImageFormat::Z_PIXMAP;
        let image = self.connection.get_image(format, self.window, 0, 0, width, height, !0);
        let codes = image.map_err(|error| words(&error))?.reply().map_err(|error| words(&error))?.data;
        let is_known = self.connection.setup().image_byte_order == ImageOrder::LSB_FIRST
            && codes.len() == usize::from(width) * usize::from(height) * 4;
        if !is_known {
            return Err(format!("{} bytes for {width}x{height} pixels, or in the other order", codes.len()));
        }
        let codes = codes.chunks_exact(4).flat_map(|pixel| [pixel[2], pixel[1], pixel[0]]).collect();
        RgbImage::from_raw(width.into(), height.into(), codes).ok_or_else(|| "too few codes".to_owned())
    }

    fn fake(&self, kind: u8, detail: u8, (x, y): (i16, i16)) {
        settle(self.connection.xtest_fake_input(kind, detail, CURRENT_TIME, self.root, x, y, 0));
        sleep(STEP);
    }
}

/// Waits until the server has executed a request.
fn settle(request: Result<VoidCookie<'_, RustConnection>, ConnectionError>) {
    request.unwrap().check().unwrap();
}

pub fn atom(connection: &RustConnection, name: &str) -> u32 {
    connection.intern_atom(false, name.as_bytes()).unwrap().reply().unwrap().atom
}

pub fn keyboard(connection: &RustConnection) -> Keyboard {
    let setup = connection.setup();
    let (first, count) = (setup.min_keycode, setup.max_keycode - setup.min_keycode + 1);
    let mapping = connection.get_keyboard_mapping(first, count).unwrap().reply().unwrap();
    Keyboard { first, columns: mapping.keysyms_per_keycode.into(), keysyms: mapping.keysyms }
}

/// Finds a window by its process id; if a library does not set it, by its title.
fn find(connection: &RustConnection, root: Window, process: u32) -> Option<Window> {
    let number = atom(connection, "_NET_WM_PID");
    let windows = connection.query_tree(root).unwrap().reply().unwrap().children;
    let shown = windows.into_iter().filter(|window| is_shown(connection, *window) == Some(true));
    let shown = shown.collect::<Vec<_>>();
    let is_named = |window: &Window| {
        let title = property(connection, *window, AtomEnum::WM_NAME.into()).unwrap_or_default();
        String::from_utf8_lossy(&title).contains("lightpaths")
    };
    let is_of_process = |window: &Window| {
        property(connection, *window, number).is_some_and(|value| value == process.to_ne_bytes())
    };
    shown.iter().copied().find(is_of_process).or_else(|| shown.iter().copied().find(is_named))
}

/// `None` if the window is gone.
fn is_shown(connection: &RustConnection, window: Window) -> Option<bool> {
    let attributes = connection.get_window_attributes(window).unwrap().reply().ok()?;
    Some(attributes.map_state == MapState::VIEWABLE && attributes.class == WindowClass::INPUT_OUTPUT)
}

fn property(connection: &RustConnection, window: Window, name: u32) -> Option<Vec<u8>> {
    let reply = connection.get_property(false, window, name, AtomEnum::ANY, 0, 256).unwrap().reply().ok()?;
    Some(reply.value)
}
