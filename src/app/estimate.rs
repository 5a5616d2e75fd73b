//! How far a piece of work is: the fraction done of the whole, and the time left.

use std::time::Instant;

use crate::renderer::Progress;

/// Stages of a precomputation: name, words for people, and the mean fraction of the precomputation
/// in the Box, the atrium and the room (docs/performance.md), in per cent.
const STAGES: [(&str, &str, f64); 10] = [
    ("acceleration structure", "Sorting triangles", 0.3),
    ("surfaces", "Finding surface that light can reach", 4.2),
    ("cells", "Dividing the scene into cells", 10.8),
    ("clearances", "Measuring distances between surfaces", 12.4),
    ("entry points", "Placing entry points", 5.0),
    ("light paths", "Tracing light paths", 12.0),
    ("cache points", "Placing cache points", 21.6),
    ("gather rays", "Tracing gather rays", 23.6),
    ("merged rays", "Packing gather rays", 5.3),
    ("tables for frames", "Preparing frames", 4.8),
];

/// Time that the work must have taken before the time left is estimated, seconds; and the fraction
/// that must be done.
const MIN_ELAPSED_S: f64 = 0.5;
const MIN_FRACTION: f64 = 0.04;

/// The state of the work.
#[derive(Clone, Debug)]
pub(super) struct Estimate {
    since: Instant,
    words: String,
    /// Fraction of the whole before this stage, and of this stage.
    before: f64,
    weight: f64,
    done: u64,
    total: u64,
}

impl Estimate {
    pub(super) fn begin() -> Self {
        Self { since: Instant::now(), words: String::new(), before: 0.0, weight: 0.0, done: 0, total: 1 }
    }

    /// The stage in plain words. Empty before the first one.
    pub(super) fn words(&self) -> &str {
        &self.words
    }

    /// Fraction of the whole that is done, 0..=1.
    pub(super) fn fraction(&self) -> f64 {
        let of_stage = self.done as f64 / self.total.max(1) as f64;
        (self.before + self.weight * of_stage).min(1.0)
    }

    /// Time since the start, seconds.
    pub(super) fn elapsed_s(&self) -> f64 {
        self.since.elapsed().as_secs_f64()
    }

    /// The time left as text, if the rest takes as long as the work so far. Empty if it is too
    /// early to say.
    pub(super) fn left(&self) -> String {
        let (fraction, elapsed) = (self.fraction(), self.elapsed_s());
        match elapsed >= MIN_ELAPSED_S && fraction >= MIN_FRACTION {
            true => format!("{} left", duration(elapsed * (1.0 - fraction) / fraction)),
            false => String::new(),
        }
    }
}

impl Progress for Estimate {
    fn stage(&mut self, name: &str, total: u64) {
        let place = STAGES.iter().position(|stage| stage.0 == name);
        let whole: f64 = STAGES.iter().map(|stage| stage.2).sum();
        let fraction_of = |stages: &[(&str, &str, f64)]| stages.iter().map(|stage| stage.2 / whole).sum();
        (self.words, self.before, self.weight) = match place {
            Some(place) => {
                let before = fraction_of(&STAGES[..place]);
                (STAGES[place].1.to_owned(), before, STAGES[place].2 / whole)
            }
            // Other work, such as the frames of a film, has a whole of its own.
            None => {
                self.since = Instant::now();
                let mut words = name.to_owned();
                words[..1].make_ascii_uppercase();
                (words, 0.0, 1.0)
            }
        };
        (self.done, self.total) = (0, total);
    }

    fn advance(&mut self, done: u64) {
        self.done = done.min(self.total);
    }

    fn finish(&mut self) {
        (self.before, self.weight) = (1.0, 0.0);
    }
}

/// Seconds in the unit that a person would use.
fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 99.5 => format!("{:.0} s", s.max(1.0)),
        s if s < 5970.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::{Context, ContextOptions};
    use crate::renderer::Renderer;
    use crate::scene::{LoadOptions, Scene};

    /// Records the stages, and checks that the fraction never falls.
    struct Checked {
        estimate: Estimate,
        stages: Vec<String>,
        fraction: f64,
    }

    impl Checked {
        fn check(&mut self) {
            let fraction = self.estimate.fraction();
            assert!((self.fraction..=1.0).contains(&fraction), "{} after {}", fraction, self.fraction);
            self.fraction = fraction;
        }
    }

    impl Progress for Checked {
        fn stage(&mut self, name: &str, total: u64) {
            self.stages.push(name.to_owned());
            self.estimate.stage(name, total);
            self.check();
        }

        fn advance(&mut self, done: u64) {
            self.estimate.advance(done);
            self.check();
        }

        fn finish(&mut self) {
            self.estimate.finish();
            self.check();
        }
    }

    #[test]
    fn a_precomputation_goes_through_all_stages_in_order() {
        let context = Context::new(&ContextOptions::default()).unwrap();
        let set = ["entry_points=2000", "cache_points=200", "gather_rays=16"];
        let set = set.map(|change| format!("quality.{change}")).to_vec();
        let scene = Scene::load("box", &LoadOptions { set, ..LoadOptions::default() }).unwrap();
        let mut progress = Checked { estimate: Estimate::begin(), stages: Vec::new(), fraction: 0.0 };
        Renderer::new(&context, scene, &mut progress).unwrap();
        assert_eq!(progress.stages, STAGES.map(|stage| stage.0));
        assert!(progress.estimate.fraction() == 1.0);
    }

    #[test]
    fn other_work_is_a_whole_of_its_own() {
        let mut estimate = Estimate::begin();
        assert_eq!((estimate.fraction(), estimate.left().as_str()), (0.0, ""));
        estimate.stage("cells", 1);
        estimate.finish();
        estimate.stage("frames", 48);
        assert_eq!((estimate.words(), estimate.fraction()), ("Frames", 0.0));
        estimate.advance(12);
        estimate.since -= std::time::Duration::from_secs(10);
        assert_eq!((estimate.fraction(), estimate.left().as_str()), (0.25, "30 s left"));
    }

    #[test]
    fn durations_have_the_unit_that_people_use() {
        let texts = [0.2, 59.7, 99.0, 100.0, 3000.0, 9000.0].map(duration);
        assert_eq!(texts, ["1 s", "60 s", "99 s", "2 min", "50 min", "2.5 h"]);
    }
}
