//! A progress bar on stderr.

use std::io::IsTerminal;

use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};

use super::estimate::Estimate;
use crate::renderer::{Progress, Silent};

/// Steps of the bar.
const STEPS: f64 = 1000.0;

/// A bar if stderr is a terminal and `quiet` is off, else nothing.
pub(super) fn for_stderr(quiet: bool) -> Box<dyn Progress> {
    if quiet || !std::io::stderr().is_terminal() {
        return Box::new(Silent);
    }
    let style = ProgressStyle::with_template("{prefix:36} {wide_bar} {percent:>3} %  {msg:12}")
        .expect("the template is well formed");
    let bar = ProgressBar::with_draw_target(Some(STEPS as u64), ProgressDrawTarget::stderr());
    Box::new(Bar { bar: bar.with_style(style), estimate: Estimate::begin() })
}

struct Bar {
    bar: ProgressBar,
    estimate: Estimate,
}

impl Bar {
    fn draw(&self) {
        self.bar.set_message(self.estimate.left());
        self.bar.set_position((STEPS * self.estimate.fraction()) as u64);
    }
}

impl Progress for Bar {
    fn stage(&mut self, name: &str, total: u64) {
        if self.bar.is_finished() {
            self.bar.reset();
        }
        self.estimate.stage(name, total);
        self.bar.set_prefix(self.estimate.words().to_owned());
        self.draw();
    }

    fn advance(&mut self, done: u64) {
        self.estimate.advance(done);
        self.draw();
    }

    fn finish(&mut self) {
        self.estimate.finish();
        self.bar.finish_and_clear();
    }
}
