//! Files that keep what took long to find: sections of plain lists, and what they were made from.
//!
//! A file is written whole or not at all, and read through checks that no damage gets past: whoever
//! reads a section has what was written. What the numbers mean, and whether they fit together, is
//! the reader's to check; this module knows nothing of it.
//!
//! | part | what |
//! |---|---|
//! | header | magic, mark of the byte order, version, counts, length of the file, checksum of all up to the sections |
//! | dependencies | name and hash of each thing that the contents follow from |
//! | table | name, bytes of an element, elements and checksum of each section, in order |
//! | sections | one behind the other, without gaps |
//!
//! Numbers are in the byte order of the machine that wrote them; the mark tells another order, and
//! such a file is made anew.

mod folder;
mod format;
mod read;
mod temporary;

pub use folder::Folder;
pub use format::{Key, Writer, hash};
pub use read::{File, MAX_BYTES, misnamed};
pub use temporary::{Temporary, remove_temporaries};

use std::fmt;

/// Counts changes of the form of files.
pub const VERSION: u32 = 1;

/// Why a file cannot be used. It reads as what follows the file's name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CacheMiss {
    /// There is none.
    Missing,
    /// It is there and cannot be read: why, in words that follow its name.
    Unreadable(String),
    /// It is none of ours, or of another version or byte order: which.
    Foreign(String),
    /// It is not what was written: where.
    Damaged(String),
    /// It was made from something else: what has changed.
    Stale(Vec<String>),
}

impl CacheMiss {
    /// Makes a [`CacheMiss::Damaged`] with that reason.
    pub fn damaged(what: impl Into<String>) -> Self {
        Self::Damaged(what.into())
    }
}

impl fmt::Display for CacheMiss {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Missing => write!(f, "is not there"),
            Self::Unreadable(why) => write!(f, "{why}"),
            Self::Foreign(what) => write!(f, "{what}"),
            Self::Damaged(what) => write!(f, "is damaged: {what}"),
            Self::Stale(changed) => {
                let verb = if changed.len() == 1 { "has" } else { "have" };
                write!(f, "is out of date: {} {verb} changed", changed.join(", "))
            }
        }
    }
}
