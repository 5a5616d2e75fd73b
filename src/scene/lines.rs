//! Encoding and lines of OBJ and MTL files.

use std::borrow::Cow;

/// Windows-1252's characters 0x80 to 0x9f, which programs write and call Latin-1. Unused
/// codes become U+FFFD.
const HIGH_CONTROLS: [char; 32] = [
    '€', '\u{fffd}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{fffd}', 'Ž', '\u{fffd}',
    '\u{fffd}', '‘', '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{fffd}', 'ž', 'Ÿ',
];

/// The text of `bytes`, and whether it was UTF-8. A mark identifies UTF-16. Other bytes are
/// taken as Latin-1.
pub(super) fn decode(bytes: Vec<u8>) -> (String, bool) {
    let wide = |from: fn([u8; 2]) -> u16| {
        let units = bytes.as_chunks().0.iter().skip(1).map(|unit| from(*unit));
        char::decode_utf16(units).map(|unit| unit.unwrap_or(char::REPLACEMENT_CHARACTER)).collect()
    };
    match bytes[..] {
        [0xff, 0xfe, ..] => return (wide(u16::from_le_bytes), false),
        [0xfe, 0xff, ..] => return (wide(u16::from_be_bytes), false),
        _ => (),
    }
    let bytes = match String::from_utf8(bytes) {
        Ok(mut text) => {
            if text.starts_with('\u{feff}') {
                text.drain(..'\u{feff}'.len_utf8());
            }
            return (text, true);
        }
        Err(fault) => fault.into_bytes(),
    };
    (latin1(&bytes), false)
}

/// See [`decode`].
pub(super) fn latin1(bytes: &[u8]) -> String {
    let mut text = String::with_capacity(bytes.len() + bytes.len() / 8);
    for chunk in bytes.utf8_chunks() {
        text.push_str(chunk.valid());
        text.extend(chunk.invalid().iter().map(|&byte| match byte {
            0x80..0xa0 => HIGH_CONTROLS[usize::from(byte - 0x80)],
            _ => char::from(byte),
        }));
    }
    text
}

/// The lines of a text with their numbers (from 1). A line ends in LF, CR LF or CR, and continues
/// after a backslash at its end.
pub(super) struct Lines<'a> {
    rest: &'a str,
    number: usize,
}

impl<'a> Lines<'a> {
    pub(super) fn new(text: &'a str) -> Self {
        Self { rest: text, number: 0 }
    }

    fn physical(&mut self) -> Option<&'a str> {
        if self.rest.is_empty() {
            return None;
        }
        self.number += 1;
        let bytes = self.rest.as_bytes();
        let end = bytes.iter().position(|byte| matches!(byte, b'\n' | b'\r')).unwrap_or(bytes.len());
        let after = end + if bytes[end..].starts_with(b"\r\n") { 2 } else { 1 };
        let line = &self.rest[..end];
        self.rest = self.rest.get(after..).unwrap_or_default();
        Some(line)
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = (usize, Cow<'a, str>);

    fn next(&mut self) -> Option<Self::Item> {
        let line = self.physical()?;
        let number = self.number;
        let Some(start) = continued(line) else { return Some((number, line.into())) };
        let mut whole = start.to_owned();
        while let Some(line) = self.physical() {
            whole.push(' ');
            match continued(line) {
                Some(part) => whole.push_str(part),
                None => {
                    whole.push_str(line);
                    break;
                }
            }
        }
        Some((number, whole.into()))
    }
}

/// The line without its continuation backslash. `None` if the line ends. Comments end, and so do
/// names of images and folders, which may end in a backslash themselves.
fn continued(line: &str) -> Option<&str> {
    let start = line.trim_end().strip_suffix('\\')?;
    let keyword = start.split_whitespace().next().unwrap_or_default();
    let is_name = || {
        let holds_names =
            ["map_", "bump", "disp", "decal", "refl", "norm"].iter().any(|name| keyword.starts_with(name));
        holds_names && !start.ends_with(char::is_whitespace)
    };
    (!start.contains('#') && !is_name()).then_some(start)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_as_every_system_ends_them() {
        let lines =
            |text| Lines::new(text).map(|(number, line)| (number, line.into_owned())).collect::<Vec<_>>();
        let expected = [(1, "a".to_owned()), (2, String::new()), (3, "b c".to_owned())];
        for text in ["a\n\nb c", "a\r\n\r\nb c\r\n", "a\r\rb c\r", "a\n\rb c\n", "a\r\n\rb c"] {
            assert_eq!(lines(text), expected, "{text:?}");
        }
        assert_eq!(lines(""), []);
    }

    #[test]
    fn lines_go_on_after_a_backslash() {
        let lines =
            |text| Lines::new(text).map(|(number, line)| (number, line.into_owned())).collect::<Vec<_>>();
        let line = |number, line: &str| (number, line.to_owned());
        assert_eq!(lines("f 1 \\\n2 \\ \r\n3\nv"), [line(1, "f 1  2  3"), line(4, "v")]);
        assert_eq!(lines("f 1 2\\\r3\\"), [line(1, "f 1 2 3")]);
        assert_eq!(lines("# C:\\\nv"), [line(1, "# C:\\"), line(2, "v")]);
        assert_eq!(lines("map_Kd C:\\\nv"), [line(1, "map_Kd C:\\"), line(2, "v")]);
        assert_eq!(lines("map_Kd \\\na.png"), [line(1, "map_Kd  a.png")]);
    }

    #[test]
    fn what_is_not_utf8_is_latin1() {
        assert_eq!(decode("caf\u{e9} €".into()), ("café €".to_owned(), true));
        assert_eq!(decode(b"\xef\xbb\xbfv".to_vec()), ("v".to_owned(), true));
        assert_eq!(decode(b"caf\xe9 \x80\x81 \xc3\xa9".to_vec()), ("café €\u{fffd} é".to_owned(), false));
        assert_eq!(decode(b"\xff\xfev\0\n\0".to_vec()), ("v\n".to_owned(), false));
        assert_eq!(decode(b"\xfe\xff\0v\xd8".to_vec()), ("v".to_owned(), false));
    }
}
