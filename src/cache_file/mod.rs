//! Files that store expensive results: sections of plain lists, and the dependencies that they
//! were made from.
//!
//! A file is written completely or not at all. The reader's checks detect any damage, so that a
//! section that is read is the section that was written. The meaning and consistency of the values
//! are the caller's to check.
//!
//! | part | what |
//! |---|---|
//! | header | magic, mark of the byte order, version, counts, length of the file, checksum of all up to the sections |
//! | dependencies | name and hash of each thing that the contents follow from |
//! | table | name, bytes of an element, elements and checksum of each section, in order |
//! | sections | one behind the other, without gaps |
//!
//! Numbers are in the byte order of the machine that wrote them. A file in another byte order is
//! refused by its mark and written anew.

mod folder;
mod format;
mod read;
mod temporary;

pub use folder::Folder;
pub use format::{Key, Writer, hash};
pub use read::{File, MAX_BYTES, misnamed};
pub use temporary::{Temporary, remove_temporaries};

use std::fmt;

/// Version of the file format.
pub const VERSION: u32 = 1;

/// Why a file is unusable. Its text follows the file's name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CacheMiss {
    /// The file does not exist.
    Missing,
    /// The file cannot be read, with the reason.
    Unreadable(String),
    /// The file has another format, version or byte order.
    Foreign(String),
    /// The file's contents have changed since it was written.
    Damaged(String),
    /// The file was made from other dependencies, which are listed.
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
