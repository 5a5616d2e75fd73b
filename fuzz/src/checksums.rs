//! Makes checksums right, so that what is behind them is read.

use lightpaths::cache_file::hash;

/// CRC-32 of PNG chunks.
fn crc(bytes: &[u8]) -> u32 {
    let step = |crc: u32, &byte: &u8| {
        (0..8).fold(crc ^ u32::from(byte), |crc, _| (crc >> 1) ^ (0xedb8_8320 & (crc & 1).wrapping_neg()))
    };
    !bytes.iter().fold(u32::MAX, step)
}

/// The bytes; where they begin as a PNG does, with checksums that are right.
pub fn png(bytes: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let mut at = 8;
    while bytes.starts_with(b"\x89PNG\r\n\x1a\n") && at + 12 <= bytes.len() {
        let length = u32::from_be_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]) as usize;
        let Some(end) = (at + 8).checked_add(length).filter(|end| end + 4 <= bytes.len()) else { break };
        let crc = crc(&bytes[at + 4..end]);
        bytes[end..end + 4].copy_from_slice(&crc.to_be_bytes());
        at = end + 4;
    }
    bytes
}

const HEADER: usize = 48;
const DEPENDENCY: usize = 40;
const SECTION: usize = 56;

/// A file of light paths with its length and all checksums made right, as far as its sections
/// lie within it.
pub fn cache(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut file = bytes.to_vec();
    let word =
        |file: &[u8], at: usize| u32::from_le_bytes([file[at], file[at + 1], file[at + 2], file[at + 3]]);
    let long = |file: &[u8], at: usize| u64::from(word(file, at)) | u64::from(word(file, at + 4)) << 32;
    if file.len() < HEADER {
        return None;
    }
    let (dependencies, sections) = (word(&file, 16) as usize, word(&file, 20) as usize);
    if dependencies.max(sections) > 256 {
        return None;
    }
    let table = HEADER + dependencies * DEPENDENCY;
    let mut start = table + sections * SECTION;
    if file.len() < start {
        return None;
    }
    let end_of_tables = start;
    for section in 0..sections {
        let entry = table + section * SECTION;
        let size = long(&file, entry + 24).checked_mul(long(&file, entry + 32))?;
        let end = start.checked_add(usize::try_from(size).ok()?).filter(|end| *end <= file.len())?;
        for (half, value) in hash(&file[start..end]).into_iter().enumerate() {
            let at = entry + 40 + 8 * half;
            file[at..at + 8].copy_from_slice(&value.to_le_bytes());
        }
        start = end;
    }
    let length = file.len() as u64;
    file[24..32].copy_from_slice(&length.to_le_bytes());
    file[32..HEADER].fill(0);
    for (half, value) in hash(&file[..end_of_tables]).into_iter().enumerate() {
        file[32 + 8 * half..40 + 8 * half].copy_from_slice(&value.to_le_bytes());
    }
    Some(file)
}
