//! Keysyms. The keysym of a letter or digit is its character code.

pub const BACKSPACE: u32 = 0xff08;
pub const TAB: u32 = 0xff09;
pub const RETURN: u32 = 0xff0d;
pub const ESCAPE: u32 = 0xff1b;
pub const HOME: u32 = 0xff50;
pub const LEFT: u32 = 0xff51;
pub const UP: u32 = 0xff52;
pub const RIGHT: u32 = 0xff53;
pub const DOWN: u32 = 0xff54;
pub const PAGE_UP: u32 = 0xff55;
pub const PAGE_DOWN: u32 = 0xff56;
pub const END: u32 = 0xff57;
pub const DELETE: u32 = 0xffff;
pub const SHIFT: u32 = 0xffe1;
pub const CONTROL: u32 = 0xffe3;
pub const ALT: u32 = 0xffe9;

/// A function key, 1 to 12.
pub const fn function(number: u32) -> u32 {
    0xffbd + number
}

/// The keysym of `character`.
pub fn of(character: char) -> u32 {
    match u32::from(character) {
        0x0a => RETURN,
        latin @ (0x20..=0x7e | 0xa0..=0xff) => latin,
        other => 0x0100_0000 | other,
    }
}

/// A key with its modifiers.
pub type Chord = (&'static [u32], u32);

/// The keyboard mapping: for each keysym its first keycode and the column.
pub struct Keyboard {
    pub first: u8,
    pub columns: usize,
    pub keysyms: Vec<u32>,
}

impl Keyboard {
    /// Keycode of `keysym`, and whether it needs Shift.
    pub fn find(&self, keysym: u32) -> (u8, bool) {
        for column in 0..self.columns.min(2) {
            let mut keys = self.keysyms.chunks_exact(self.columns);
            if let Some(index) = keys.position(|row| row[column] == keysym) {
                return (self.first + index as u8, column == 1);
            }
        }
        panic!("the keyboard has no key for keysym {keysym:#x}");
    }

    /// The keysym of a key with or without Shift.
    pub fn keysym(&self, keycode: u8, is_shifted: bool) -> u32 {
        self.keysyms[usize::from(keycode - self.first) * self.columns + usize::from(is_shifted)]
    }
}
