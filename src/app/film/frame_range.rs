//! The range of a film's frames to render.

use std::ops::Range;

use crate::error::{Error, Result};

/// Frames as typed: the first, and the one after the last.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct FrameRange {
    start: Option<u32>,
    end: Option<u32>,
}

/// Parses `A..B`, `A..`, `..B` or `A`.
pub(super) fn parse(text: &str) -> std::result::Result<FrameRange, String> {
    let number = |text: &str| match text {
        "" => Ok(None),
        text => text.parse::<u32>().map(Some).map_err(|_| expected()),
    };
    let range = match text.split_once("..") {
        Some((start, end)) => FrameRange { start: number(start)?, end: number(end)? },
        None => {
            let frame = number(text)?.ok_or_else(expected)?;
            FrameRange { start: Some(frame), end: Some(frame.saturating_add(1)) }
        }
    };
    match range {
        FrameRange { start: Some(start), end: Some(end) } if start >= end => Err(format!(
            "frames go up to the one before the second number, and there is none from {start} to {end}"
        )),
        FrameRange { end: Some(0), .. } => Err("there is no frame before frame 0".to_owned()),
        range => Ok(range),
    }
}

fn expected() -> String {
    "expected two frame numbers as in 0..48, the second not included".to_owned()
}

impl FrameRange {
    /// The range for a film of `frame_count` frames. An end beyond the film is cut to it, so that
    /// the last of equal ranges may be shorter.
    pub(super) fn of(self, frame_count: u32) -> Result<Range<u32>> {
        let range = self.start.unwrap_or(0)..self.end.unwrap_or(frame_count).min(frame_count);
        if range.is_empty() {
            let message =
                format!("--frames: the film has {frame_count} frames, from 0 to {}", frame_count - 1);
            return Err(Error::Usage(message));
        }
        Ok(range)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_half_open_and_end_with_the_film() {
        let of = |text: &str| parse(text).unwrap().of(10).unwrap();
        assert_eq!(of("2..5"), 2..5);
        assert_eq!(of("8..20"), 8..10);
        assert_eq!((of("4.."), of("..4"), of("7"), of("..")), (4..10, 0..4, 7..8, 0..10));
        assert_eq!(FrameRange::default().of(3).unwrap(), 0..3);
        assert!(parse("10..12").unwrap().of(10).is_err());
        for bad in ["", "5..5", "5..4", "-1..4", "a..b", "1...3", "1,3", "..0", "4294967296"] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }
}
