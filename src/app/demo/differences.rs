//! What differs between a scene's files on disk and the edited scene.

use std::fs;
use std::path::Path;

use similar::{ChangeTag, TextDiff};

use super::document::Document;
use super::files;
use super::session::Session;
use crate::error::{Error, Result};

/// Number of equal lines before and after different ones.
const AROUND: usize = 1;

/// Where a line is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Side {
    OnDisk,
    Mine,
    Both,
    /// It names the part of the scene, or the file, whose lines follow.
    Heading,
}

/// The lines that differ, with the edits that were compared.
pub(super) struct Differences {
    pub(super) lines: Vec<(Side, String)>,
    of: Document,
}

impl Differences {
    /// Compares the edited scene with the scene's files.
    ///
    /// # Errors
    /// The scene file cannot be read, or the edits cannot be saved.
    pub(super) fn new(session: &Session) -> Result<Self> {
        let path = Path::new(&session.source.spec);
        let mine = files::edited_text(session, path)?;
        let mut lines = Vec::new();
        if path.extension().is_some_and(|extension| extension == "toml") {
            let text = fs::read_to_string(path).map_err(|error| Error::input(path, error.to_string()))?;
            lines = compare(&text, &mine);
        }
        let others = session.watch.changed().filter(|file| *file != path);
        lines.extend(others.map(|file| (Side::Heading, format!("{} has changed", file.display()))));
        Ok(Self { lines, of: session.document.clone() })
    }

    /// Whether these edits were compared.
    pub(super) fn is_of(&self, document: &Document) -> bool {
        self.of == *document
    }
}

/// The lines in which two texts of a scene differ, with the names of the parts they are in.
fn compare(on_disk: &str, mine: &str) -> Vec<(Side, String)> {
    let texts = TextDiff::from_lines(on_disk, mine);
    let rows: Vec<&str> = on_disk.lines().collect();
    let mut lines = Vec::new();
    for group in texts.grouped_ops(AROUND) {
        let start = group.first().map_or(0, |op| op.old_range().start);
        lines.extend(part_of(&rows, start).map(|name| (Side::Heading, name)));
        for change in group.iter().flat_map(|op| texts.iter_changes(op)) {
            let side = match change.tag() {
                ChangeTag::Equal => Side::Both,
                ChangeTag::Delete => Side::OnDisk,
                ChangeTag::Insert => Side::Mine,
            };
            lines.push((side, change.value().trim_end().to_owned()));
        }
    }
    lines
}

/// The header and the name of the table in which a row is. `None` at a header, and above the first.
fn part_of(rows: &[&str], row: usize) -> Option<String> {
    let is_header = |row: &usize| rows[*row].starts_with('[');
    let head = (0..rows.len().min(row + 1)).rev().find(is_header).filter(|head| *head < row)?;
    let body = head + 1..rows.len();
    let name = body.take_while(|row| !is_header(row)).find(|row| rows[*row].starts_with("name"));
    let name = name.map_or("", |row| rows[row]);
    Some(format!("{} {name}", rows[head]).trim_end().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAMPS: &str = "# A room.\n[[model]]\nfile = \"a.obj\"\n\n[[light]]\nname = \"lamp\"\nkind = \"point\"\n\
                         position = [0, 1, 0]\nintensity = [1, 1, 1]\n";

    #[test]
    fn lines_that_differ_stand_under_the_name_of_their_light() {
        let mine = LAMPS.replace("[1, 1, 1]", "[2, 2, 2]");
        let expected = [
            (Side::Heading, "[[light]] name = \"lamp\""),
            (Side::Both, "position = [0, 1, 0]"),
            (Side::OnDisk, "intensity = [1, 1, 1]"),
            (Side::Mine, "intensity = [2, 2, 2]"),
        ];
        assert_eq!(compare(LAMPS, &mine), expected.map(|(side, line)| (side, line.to_owned())));
        assert!(compare(LAMPS, LAMPS).is_empty());
    }

    #[test]
    fn a_new_light_names_itself() {
        let mine = format!("{LAMPS}[[light]]\nname = \"spot\"\n");
        let expected = [
            (Side::Heading, "[[light]] name = \"lamp\""),
            (Side::Both, "intensity = [1, 1, 1]"),
            (Side::Mine, "[[light]]"),
            (Side::Mine, "name = \"spot\""),
        ];
        assert_eq!(compare(LAMPS, &mine), expected.map(|(side, line)| (side, line.to_owned())));
        // At the top there is no part.
        assert_eq!(compare("", "light = []\n"), [(Side::Mine, "light = []".to_owned())]);
    }
}
