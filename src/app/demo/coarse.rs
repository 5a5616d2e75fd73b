//! Fewer pixels while the user moves something and frames are slow: half or a quarter of the width
//! and the height. At rest the picture has all pixels.

use std::time::{Duration, Instant};

/// Longest frame of a drag, milliseconds. The picture gets coarser after a longer one.
const SLOW_MS: f64 = 50.0;
/// After a frame of this time, a quarter of the width is tried at once.
const VERY_SLOW_MS: f64 = 200.0;
/// Largest divisor of the width and the height.
const COARSEST: u32 = 4;
/// Time without keys and wheel after which they are at rest.
const REST: Duration = Duration::from_millis(150);

/// The divisor of the picture's width and height, and what it follows from.
pub(super) struct Coarse {
    divisor: u32,
    /// The drag under way: the number of frames after which the next one counts.
    counts_from: Option<u64>,
    /// When a key or the wheel moved the camera last.
    moved: Option<Instant>,
}

/// Input of the user, and the times of frames.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    /// A pointer button is pressed.
    pub(super) holds: bool,
    /// Keys or the wheel move the camera.
    pub(super) moves: bool,
    /// Frames that have ended, and the time of the last, milliseconds.
    pub(super) frames: (u64, f64),
}

impl Coarse {
    pub(super) fn new() -> Self {
        Self { divisor: 1, counts_from: None, moved: None }
    }

    /// The divisor of the next frame.
    pub(super) fn follow(&mut self, motion: Motion, now: Instant) -> u32 {
        if motion.moves {
            self.moved = Some(now);
        }
        let moves = self.moved.is_some_and(|moved| now < moved + REST);
        if !motion.holds && !moves {
            *self = Self { moved: self.moved, ..Self::new() };
            return 1;
        }
        let (count, ms) = motion.frames;
        let counts_from = *self.counts_from.get_or_insert(count);
        if count > counts_from && ms > SLOW_MS && self.divisor < COARSEST {
            self.divisor = if ms > VERY_SLOW_MS { COARSEST } else { 2 * self.divisor };
            // The first frame of a new size computes the whole view: it says nothing of the next.
            // The frames of the old size that are still computed say nothing either.
            self.counts_from = Some(count + 2);
        }
        self.divisor
    }

    /// How long the divisor stays if nothing moves any more. `None`: until a button is released.
    pub(super) fn rests_in(&self, now: Instant) -> Option<Duration> {
        self.moved.filter(|_| self.divisor > 1).map(|moved| (moved + REST).saturating_duration_since(now))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn slow_drags_are_coarse_and_rest_is_not() {
        let (mut coarse, now) = (Coarse::new(), Instant::now());
        let motion = |holds, frames| Motion { holds, moves: false, frames };
        // A slow frame before the drag does not count.
        assert_eq!(coarse.follow(motion(true, (7, 500.0)), now), 1);
        assert_eq!(coarse.follow(motion(true, (8, 49.0)), now), 1);
        assert_eq!(coarse.follow(motion(true, (9, 51.0)), now), 2);
        // The next two frames belong to the change of size.
        assert_eq!(coarse.follow(motion(true, (11, 400.0)), now), 2);
        assert_eq!(coarse.follow(motion(true, (12, 30.0)), now), 2);
        assert_eq!(coarse.follow(motion(true, (13, 60.0)), now), 4);
        assert_eq!(coarse.follow(motion(true, (20, 900.0)), now), 4);
        assert_eq!(coarse.follow(motion(false, (20, 900.0)), now), 1);
        // Another drag begins anew, and a very slow one is a quarter at once.
        assert_eq!(coarse.follow(motion(true, (20, 900.0)), now), 1);
        assert_eq!(coarse.follow(motion(true, (21, 201.0)), now), 4);
    }

    #[test]
    fn keys_and_wheel_rest_after_a_while() {
        let (mut coarse, mut now) = (Coarse::new(), Instant::now());
        let motion = |moves, count| Motion { holds: false, moves, frames: (count, 100.0) };
        assert_eq!(coarse.follow(motion(true, 1), now), 1);
        assert_eq!(coarse.rests_in(now), None);
        assert_eq!(coarse.follow(motion(true, 2), now), 2);
        assert_eq!(coarse.rests_in(now), Some(REST));
        now += REST / 2;
        assert_eq!(coarse.follow(motion(false, 2), now), 2, "between two turns of the wheel");
        now += REST / 2;
        assert_eq!(coarse.follow(motion(false, 2), now), 1);
    }
}
