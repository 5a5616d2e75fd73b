//! Random input that is reproducible.

use std::fmt::Write;
use std::thread::{panicking, sleep};
use std::time::{Duration, Instant};

use crate::client::{Client, Point};
use crate::demo::Demo;
use crate::keys::Chord;

/// Maximum size of a window: it stays on the screen.
const LARGEST: (u32, u32) = (1200, 800);

/// One thing that a user may do.
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    Move {
        to: Point,
    },
    Drag {
        button: u8,
        from: Point,
        to: Point,
        steps: i32,
    },
    Click {
        button: u8,
        at: Point,
    },
    Scroll {
        at: Point,
        clicks: i32,
    },
    Key {
        chord: Chord,
    },
    Resize {
        size: (u32, u32),
    },
    /// Minimises the window for a time.
    Hide {
        ms: u64,
    },
    Rest {
        ms: u64,
    },
}

impl Action {
    fn perform(&self, client: &Client) {
        match *self {
            Self::Move { to } => client.move_to(to),
            Self::Drag { button, from, to, steps } => client.drag(button, from, to, steps),
            Self::Click { button, at } => client.click(button, at),
            Self::Scroll { at, clicks } => client.scroll(at, clicks),
            Self::Key { chord: (held, key) } => client.tap(held, key),
            Self::Resize { size } => client.resize(size),
            Self::Hide { ms } => {
                client.hide();
                sleep(Duration::from_millis(ms));
                client.show();
            }
            Self::Rest { ms } => sleep(Duration::from_millis(ms)),
        }
    }
}

/// Actions that depend only on the seed, the window's first size and the list of keys.
pub struct Actions {
    state: u64,
    size: (u32, u32),
    chords: Vec<Chord>,
}

impl Actions {
    pub fn new(seed: u64, size: (u32, u32), chords: &[Chord]) -> Self {
        assert!(!chords.is_empty(), "there are keys to press");
        Self { state: seed, size, chords: chords.to_vec() }
    }

    /// A number in 0..count. SplitMix64, which works with any seed.
    fn below(&mut self, count: u32) -> u32 {
        self.state = self.state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut word = self.state;
        word = (word ^ (word >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        word = (word ^ (word >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((((word ^ (word >> 31)) >> 32) * u64::from(count)) >> 32) as u32
    }

    fn point(&mut self) -> Point {
        let (width, height) = self.size;
        (self.below(width) as i32, self.below(height) as i32)
    }

    fn button(&mut self) -> u8 {
        1 + self.below(3) as u8
    }

    /// A side of a window, often tiny, because tiny sizes reveal faults.
    fn side(&mut self, largest: u32) -> u32 {
        let limit = if self.below(4) == 0 { 16 } else { largest };
        1 + self.below(limit)
    }
}

impl Iterator for Actions {
    type Item = Action;

    fn next(&mut self) -> Option<Action> {
        Some(match self.below(100) {
            0..15 => Action::Move { to: self.point() },
            15..40 => Action::Drag {
                button: self.button(),
                from: self.point(),
                to: self.point(),
                steps: 1 + self.below(12) as i32,
            },
            40..55 => Action::Click { button: self.button(), at: self.point() },
            55..65 => Action::Scroll { at: self.point(), clicks: self.below(9) as i32 - 4 },
            65..88 => {
                let index = self.below(self.chords.len() as u32);
                Action::Key { chord: self.chords[index as usize] }
            }
            88..94 => {
                self.size = (self.side(LARGEST.0), self.side(LARGEST.1));
                Action::Resize { size: self.size }
            }
            94..96 => Action::Hide { ms: self.below(400).into() },
            _ => Action::Rest { ms: self.below(300).into() },
        })
    }
}

/// Performs [`Actions`]. A failed test prints the actions.
pub struct Monkey<'a> {
    demo: &'a Demo<'a>,
    seed: u64,
    actions: Actions,
    done: Vec<(Duration, Action)>,
    start: Instant,
}

impl<'a> Monkey<'a> {
    pub fn new(demo: &'a Demo<'a>, seed: u64, chords: &[Chord]) -> Self {
        let actions = Actions::new(seed, demo.client().size(), chords);
        Self { demo, seed, actions, done: Vec::new(), start: Instant::now() }
    }

    /// Performs actions for `seconds`; the process must still run afterwards. Then no button and no
    /// key is down, and the window is shown.
    pub fn run(&mut self, seconds: f64) {
        let end = Instant::now() + Duration::from_secs_f64(seconds);
        while Instant::now() < end {
            self.step();
        }
    }

    /// Performs the next `count` actions.
    pub fn act(&mut self, count: usize) {
        for _ in 0..count {
            self.step();
        }
    }

    fn step(&mut self) {
        let action = self.actions.next().expect("endless");
        self.done.push((self.start.elapsed(), action.clone()));
        action.perform(self.demo.client());
        assert!(self.demo.is_running(), "ended after {action:?}");
    }

    /// The performed actions, for the report of a failure.
    pub fn log(&self) -> String {
        let mut log = format!("seed {}\n", self.seed);
        for (at, action) in &self.done {
            let _ = writeln!(log, "{:9.3} s {action:?}", at.as_secs_f64());
        }
        log
    }
}

impl Drop for Monkey<'_> {
    fn drop(&mut self) {
        if panicking() {
            eprint!("{}", self.log());
        }
    }
}
