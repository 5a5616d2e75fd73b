//! Checks of image files before they are decoded.

use std::borrow::Cow;

/// Chunks of a PNG that its pixels depend on.
const PIXEL_CHUNKS: [&[u8]; 5] = [b"IHDR", b"PLTE", b"tRNS", b"IDAT", b"IEND"];
const SIGNATURE_BYTES: usize = 8;

/// A PNG reduced to the chunks that its pixels depend on. Colour profiles and texts can be
/// compressed a thousandfold, and each kind of chunk is more code that reads untrusted input.
pub(super) fn png_pixels(bytes: &[u8]) -> Cow<'_, [u8]> {
    let mut chunks = Vec::new();
    let mut rest = bytes.get(SIGNATURE_BYTES..).unwrap_or_default();
    while let Some(&length) = rest.first_chunk::<4>() {
        // Length, name, data, checksum. The decoder reports a truncated last chunk.
        let end = (u32::from_be_bytes(length) as usize).saturating_add(12).min(rest.len());
        let (chunk, after) = rest.split_at(end);
        chunks.push(chunk);
        rest = after;
    }
    let is_essential = |chunk: &&[u8]| chunk.get(4..8).is_none_or(|name| PIXEL_CHUNKS.contains(&name));
    if chunks.iter().all(&is_essential) {
        return bytes.into();
    }
    let kept = chunks.into_iter().filter(is_essential);
    let mut essential = bytes[..SIGNATURE_BYTES].to_vec();
    kept.for_each(|chunk| essential.extend_from_slice(chunk));
    essential.into()
}

/// Properties of a JPEG's first image.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Jpeg {
    /// Scans over the image; one unless it is progressive.
    pub(super) scans: usize,
    /// Whether the file has an end marker; else it was cut.
    pub(super) has_end: bool,
}

/// Reads the markers of a JPEG up to the end of its first image.
pub(super) fn jpeg(bytes: &[u8]) -> Jpeg {
    const END: u8 = 0xd9;
    const SCAN: u8 = 0xda;
    let mut found = Jpeg { scans: 0, has_end: false };
    let mut rest = bytes.get(2..).unwrap_or_default();
    // Pixel data contains no marker: a 0 follows 0xff there.
    while let Some(at) = rest.iter().position(|&byte| byte == 0xff) {
        rest = &rest[at + 1..];
        let Some((&marker, after)) = rest.split_first() else { break };
        match marker {
            // The first of several 0xff; the second may start a marker.
            0xff => continue,
            0 | 1 | 0xd0..=0xd7 => (),
            END => return Jpeg { has_end: true, ..found },
            _ => {
                found.scans += usize::from(marker == SCAN);
                let length = after.first_chunk().map_or(0, |length| usize::from(u16::from_be_bytes(*length)));
                rest = after.get(length..).unwrap_or_default();
                continue;
            }
        }
        rest = after;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chunk(name: &[u8; 4], data: &[u8]) -> Vec<u8> {
        [&(data.len() as u32).to_be_bytes()[..], name, data, &[0; 4]].concat()
    }

    #[test]
    fn a_png_keeps_the_chunks_of_its_pixels() {
        let start = b"\x89PNG\r\n\x1a\n";
        let head = chunk(b"IHDR", &[0; 13]);
        let pixels = chunk(b"IDAT", &[7; 40]);
        let plain = [&start[..], &head, &pixels, &chunk(b"IEND", &[])].concat();
        assert!(matches!(png_pixels(&plain), Cow::Borrowed(same) if same == plain));
        let more = [
            &start[..],
            &head,
            &chunk(b"iCCP", &[1; 99]),
            &chunk(b"zTXt", b"x"),
            &pixels,
            &chunk(b"IEND", &[]),
        ]
        .concat();
        assert_eq!(png_pixels(&more), plain);
        // A cut file yields no invented bytes, wherever the cut is.
        for end in 0..more.len() {
            let cut = &more[..end];
            let kept = png_pixels(cut);
            assert!(kept.len() <= end && kept.starts_with(&start[..end.min(8)]), "{end}");
        }
        let huge = [&start[..], &[0xff; 4], b"iCCP"].concat();
        assert_eq!(&*png_pixels(&huge), start);
    }

    #[test]
    fn scans_of_a_jpeg_are_counted_and_its_end_is_found() {
        let scan = [0xff, 0xda, 0, 3, 9, 1, 2, 0xff, 0, 0xff, 0xd0, 0xff, 0xff, 0xd1, 3];
        // A picture in a comment is not counted.
        let comment = [0xff, 0xfe, 0, 8, 0xff, 0xda, 0, 3, 0xff, 0xd9];
        let mut bytes = [&[0xff, 0xd8][..], &comment].concat();
        for scans in 1..=100 {
            bytes.extend(scan);
            assert_eq!(jpeg(&bytes), Jpeg { scans, has_end: false });
            let ended = [&bytes[..], &[0xff, 0xff, 0xd9], &scan].concat();
            assert_eq!(jpeg(&ended), Jpeg { scans, has_end: true });
        }
        for end in 0..bytes.len() {
            assert!(!jpeg(&bytes[..end]).has_end);
        }
    }
}
