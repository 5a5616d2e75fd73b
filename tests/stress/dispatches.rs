//! Duration of dispatches: a long one blocks other users of the device, and watchdogs end it.

use crate::common::{assert_silent, context};
use crate::{prepare, the_box};
use lightpaths::gpu::Trace;
use lightpaths::scene::Quality;
use std::collections::BTreeMap;
use std::time::Instant;

/// For each pass and each recording: mean milliseconds of a dispatch, and the number of dispatches.
fn times(trace: &Trace) -> BTreeMap<&'static str, Vec<(f64, u32)>> {
    let mut times: BTreeMap<_, Vec<_>> = BTreeMap::new();
    for pass in trace.submissions.iter().flat_map(|submission| &submission.passes) {
        let ms = 1e-3 * (pass.end_us - pass.begin_us) / f64::from(pass.dispatches.max(1));
        times.entry(pass.name).or_default().push((ms, pass.dispatches));
    }
    times
}

/// The maximum and the median.
fn extremes(times: &[(f64, u32)]) -> [f64; 2] {
    let mut times: Vec<f64> = times.iter().map(|time| time.0).collect();
    times.sort_by(f64::total_cmp);
    [times.last().copied().unwrap_or_default(), times.get(times.len() / 2).copied().unwrap_or_default()]
}

/// Precomputes and renders a frame. For each pass of either, the longest dispatch, milliseconds.
fn longest() -> [BTreeMap<&'static str, f64>; 2] {
    let context = context();
    context.begin_trace(Instant::now());
    let mut renderer = prepare(the_box(&["camera.size=[512,512]".to_owned()]), Quality::PAPER);
    let precomputation = times(&context.end_trace());
    context.begin_trace(Instant::now());
    renderer.frame().unwrap();
    let frame = times(&context.end_trace());
    [("precomputation", precomputation), ("frame", frame)].map(|(when, passes)| {
        let longest = |(name, times): (&'static str, Vec<(f64, u32)>)| {
            let dispatches: u32 = times.iter().map(|time| time.1).sum();
            let [longest, middle] = extremes(&times[1..]);
            println!(
                "{when}: {name} {longest:.1} ms, mostly {middle:.1} ms, first {:.1} ms, {dispatches} dispatches",
                times[0].0
            );
            (name, longest)
        };
        passes.into_iter().map(longest).collect()
    })
}

/// Dispatches aim at 10 ms, from the time of earlier ones. Items differ, so the limit is 50 ms.
/// Other load on the machine counts, too, so run this on an idle machine. A dispatch that is really
/// too long is so each time, so the best of three attempts counts for each pass. The first
/// recording of each kernel may include its compilation, and is left out.
#[test]
#[ignore = "full size: make stress"]
fn precomputation_takes_the_device_for_short_times() {
    let [mut found, _] = longest();
    for _ in 1..3 {
        if found.values().any(|ms| *ms >= 50.0) {
            let [again, _] = longest();
            found.iter_mut().for_each(|(name, ms)| *ms = ms.min(again[name]));
        }
    }
    for (name, ms) in &found {
        assert!(*ms < 50.0, "{name}: {ms} ms");
    }
    assert_silent(&context());
}
