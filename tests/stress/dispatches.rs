//! How long the device is busy at a time: nobody else gets a turn, and watchdogs count.

use crate::common::{assert_silent, context};
use crate::{prepare, the_box};
use lightpaths::gpu::Trace;
use lightpaths::scene::Quality;
use std::collections::BTreeMap;
use std::time::Instant;

/// Of each pass: milliseconds that a dispatch takes in the mean of a recording, and their number, for each recording.
fn times(trace: &Trace) -> BTreeMap<&'static str, Vec<(f64, u32)>> {
    let mut times: BTreeMap<_, Vec<_>> = BTreeMap::new();
    for pass in trace.submissions.iter().flat_map(|submission| &submission.passes) {
        let ms = 1e-3 * (pass.end_us - pass.begin_us) / f64::from(pass.dispatches.max(1));
        times.entry(pass.name).or_default().push((ms, pass.dispatches));
    }
    times
}

/// The longest.
fn most(times: &[(f64, u32)]) -> f64 {
    times.iter().map(|time| time.0).fold(0.0, f64::max)
}

/// Dispatches aim at 50 ms, by the time of the one before. Of each kernel the first recording may hold its compilation.
#[test]
#[ignore = "full size: make stress"]
fn precomputation_takes_the_device_for_short_times() {
    let context = context();
    context.begin_trace(Instant::now());
    let mut renderer = prepare(the_box(&["camera.size=[512,512]".to_owned()]), Quality::PAPER);
    let precomputation = times(&context.end_trace());
    context.begin_trace(Instant::now());
    renderer.frame().unwrap();
    let frame = times(&context.end_trace());
    for (when, passes) in [("precomputation", &precomputation), ("frame", &frame)] {
        for (name, times) in passes {
            let dispatches: u32 = times.iter().map(|time| time.1).sum();
            let [first, later] = [&times[..1], &times[1..]].map(most);
            println!(
                "{when}: {name} {first:.1} ms at first, then {later:.1} ms at most, {dispatches} dispatches"
            );
        }
    }
    // Five times the aim: what shares the machine takes its time, too.
    let longest = precomputation.values().map(|times| most(&times[1..])).fold(0.0, f64::max);
    assert!(longest < 250.0, "{longest} ms");
    assert_silent(&context);
}
