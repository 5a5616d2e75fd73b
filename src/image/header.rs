//! The header of an EXR file.

/// Bytes before the first attribute: magic number and version.
const START: usize = 8;

/// Sorts the attributes of the header of a file with one part by name. The library keeps those
/// that it does not know in a hash map, whose order differs from run to run.
pub(super) fn sort_attributes(file: &mut [u8]) {
    let mut attributes = Vec::new();
    let mut at = START;
    while file[at] != 0 {
        let first = at;
        let text_end = |at: usize| at + file[at..].iter().take_while(|&&byte| byte != 0).count();
        let name_end = text_end(at);
        let size_at = text_end(name_end + 1) + 1;
        let size = [0, 1, 2, 3].map(|byte| file[size_at + byte]);
        at = size_at + 4 + u32::from_le_bytes(size) as usize;
        attributes.push((first..name_end, first..at));
    }
    attributes.sort_by_key(|(name, _)| &file[name.clone()]);
    let sorted: Vec<u8> = attributes.iter().flat_map(|(_, all)| &file[all.clone()]).copied().collect();
    file[START..at].copy_from_slice(&sorted);
}
