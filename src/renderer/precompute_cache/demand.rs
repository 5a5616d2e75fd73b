//! Elementary checks of lists from a file.

use crate::cache_file::CacheMiss;

/// Returns a damage report if `is_so` is false.
pub(super) fn demand(is_so: bool, what: &str) -> Result<(), CacheMiss> {
    if is_so { Ok(()) } else { Err(CacheMiss::damaged(what)) }
}

/// Whether `first` holds the offsets of `ranges` segments of `length` items, the end included.
pub(super) fn cuts(first: &[u32], ranges: usize, length: usize) -> bool {
    first.len() == ranges + 1 && first[0] == 0 && first.is_sorted() && first[ranges] as usize == length
}
