//! `time --trace`: a timeline of host and device as trace events for Perfetto and Chrome.

use std::io::Write;
use std::time::Instant;

use serde_json::{Value, json};

use super::Time;
use crate::app::args::device_label;
use crate::app::output::OutputFile;
use crate::error::Result;
use crate::gpu::{Context, SubmissionSpan, Trace};
use crate::renderer::{FrameReport, Renderer, Work};
use crate::scene::Scene;

/// Process identifiers of the trace, which group its tracks.
const HOST: u32 = 1;
const DEVICE: u32 = 2;

/// Tracks of the host.
const RENDERER: u32 = 1;
/// The first of as many submission tracks as needed.
const SUBMISSIONS: u32 = 2;
/// Track of the device.
const QUEUE: u32 = 1;

/// The work of the frames, with their names in the trace.
const WORK: [(Work, &str); 5] = [
    (Work::Everything, "everything"),
    (Work::Light(0), "light"),
    (Work::View, "view"),
    (Work::Material, "material"),
    (Work::Colour, "colour"),
];

/// An interval on a track, in whole nanoseconds, so that nesting is exact.
struct Event {
    name: String,
    process: u32,
    track: u32,
    begin_ns: u64,
    end_ns: u64,
    arguments: Value,
}

/// Precomputes, renders rounds of frames, and writes their trace.
pub(super) fn run(time: &Time, scene: Scene, output: &OutputFile) -> Result<()> {
    let context = time.device_args.open()?;
    let origin = Instant::now();
    let now_us = || origin.elapsed().as_secs_f64() * 1e6;
    context.begin_trace(origin);
    let begun_us = now_us();
    let mut renderer = time.device_args.renderer(&context, scene)?;
    let mut events = precomputation(&renderer, begun_us, now_us())?;
    renderer.set_skipping(!time.no_skip);
    let mut frame = |renderer: &mut Renderer, name: &str| -> Result<()> {
        let begun_us = now_us();
        let report = renderer.frame()?;
        events.push(frame_event(name, &report, begun_us, now_us()));
        Ok(())
    };
    frame(&mut renderer, "first")?;
    for _ in 0..time.frames {
        for (work, name) in WORK {
            renderer.force(work);
            frame(&mut renderer, name)?;
        }
    }
    let begun_us = now_us();
    renderer.display()?;
    events.push(event("read the picture", (HOST, RENDERER), [begun_us, now_us()], json!({})));
    let trace = context.end_trace();
    let deviation_us =
        trace.submissions.iter().filter_map(|submission| submission.deviation_us).reduce(f64::max);
    let frames = events.iter().filter(|event| event.name.starts_with(FRAME)).count();
    traced(&mut events, &trace);
    let (count, scene) = (events.len(), renderer.scene().name.clone());
    let document = document(&context, &scene, renderer.size(), deviation_us, events);
    output.write(|out| out.write_all(document.to_string().as_bytes()))?;
    time.device_args.report_validation(&context);
    let clock = deviation_us.map_or_else(
        || "passes aligned by their submissions".to_owned(),
        |us| format!("clocks deviate by {us:.1} us at most"),
    );
    let file = output.path().display();
    crate::app::print_line(&format!(
        "{file}: {scene}, {frames} frames, {count} events, {clock}; open it in ui.perfetto.dev"
    ))
}

/// Prefix of frame names.
const FRAME: &str = "frame: ";

fn event(
    name: impl Into<String>,
    (process, track): (u32, u32),
    span_us: [f64; 2],
    arguments: Value,
) -> Event {
    // Clock deviation may place a pass before the start of the trace.
    let [begin_ns, end_ns] = span_us.map(|us| (us.max(0.0) * 1e3).round() as u64);
    Event { name: name.into(), process, track, begin_ns, end_ns: end_ns.max(begin_ns), arguments }
}

/// The precomputation and its stages, in sequence.
fn precomputation(renderer: &Renderer, begun_us: f64, ended_us: f64) -> Result<Vec<Event>> {
    let statistics = renderer.statistics()?;
    let track = (HOST, RENDERER);
    let arguments = json!({"precompute_s": statistics.precompute_s});
    let mut events = vec![event("precomputation", track, [begun_us, ended_us], arguments)];
    let mut at_us = begun_us;
    for (stage, seconds) in statistics.precompute_stages {
        let end_us = (at_us + 1e6 * seconds).min(ended_us);
        events.push(event(stage, track, [at_us, end_us], json!({})));
        at_us = end_us;
    }
    Ok(events)
}

fn frame_event(work: &str, report: &FrameReport, begun_us: f64, ended_us: f64) -> Event {
    let device_ms: f64 = report.passes.iter().map(|pass| pass.ms).sum();
    let arguments = json!({"frame_ms": report.frame_ms, "device_ms": device_ms, "bytes": report.bytes, "rays": report.rays});
    event(format!("{FRAME}{work}"), (HOST, RENDERER), [begun_us, ended_us], arguments)
}

/// Submissions on the host, their passes on the device, copies on the host.
fn traced(events: &mut Vec<Event>, trace: &Trace) {
    // In each group the enclosing event comes first.
    let mut groups: Vec<Vec<Event>> = Vec::new();
    let track = (HOST, SUBMISSIONS);
    let mut queue_end_us = 0.0;
    for (index, submission) in trace.submissions.iter().enumerate() {
        let SubmissionSpan {
            begun_us,
            recorded_us,
            submitted_us,
            done_us,
            read_us,
            ref passes,
            deviation_us,
        } = *submission;
        let what = match passes.len() {
            0 => "transfer".to_owned(),
            1 => passes[0].name.to_owned(),
            count => format!("{count} passes"),
        };
        let arguments = json!({"submission": index, "deviation_us": deviation_us});
        let mut group = vec![event(what, track, [begun_us, read_us], arguments)];
        let steps = [
            ("record", [begun_us, recorded_us]),
            ("submit", [recorded_us, submitted_us]),
            ("wait", [submitted_us, done_us]),
            ("read timestamps", [done_us, read_us]),
        ];
        group.extend(steps.map(|(name, span_us)| event(name, track, span_us, json!({"submission": index}))));
        groups.push(group);
        // The queue runs one submission after another, even where its clock is only estimated:
        // viewers drop passes that overlap.
        let begin_us = passes.first().map_or(0.0, |pass| pass.begin_us);
        let late_us = if deviation_us.is_some() { 0.0 } else { (queue_end_us - begin_us).max(0.0) };
        for pass in passes {
            let arguments = json!({"submission": index, "dispatches": pass.dispatches});
            let span_us = [pass.begin_us + late_us, pass.end_us + late_us];
            events.push(event(pass.name, (DEVICE, QUEUE), span_us, arguments));
            queue_end_us = span_us[1];
        }
    }
    for copy in &trace.host {
        let arguments = json!({"buffer": copy.buffer, "bytes": copy.bytes});
        groups.push(vec![event(copy.name, track, [copy.begin_us, copy.end_us], arguments)]);
    }
    events.extend(apart(groups));
}

/// Distributes groups over enough tracks that none overlap: threads of the
/// precomputation submit concurrently.
fn apart(mut groups: Vec<Vec<Event>>) -> impl Iterator<Item = Event> {
    groups.sort_by_key(|group| group[0].begin_ns);
    let mut ends: Vec<u64> = Vec::new();
    groups.into_iter().flat_map(move |mut group| {
        let (begin_ns, end_ns) = (group[0].begin_ns, group[0].end_ns);
        let free = ends.iter().position(|&end| end <= begin_ns).unwrap_or(ends.len());
        match ends.get_mut(free) {
            Some(end) => *end = end_ns,
            None => ends.push(end_ns),
        }
        group.iter_mut().for_each(|event| event.track += free as u32);
        group
    })
}

/// The whole document. Times are microseconds.
fn document(
    context: &Context,
    scene: &str,
    size: [u32; 2],
    deviation_us: Option<f64>,
    mut events: Vec<Event>,
) -> Value {
    // Enclosing events come before the events inside them.
    events.sort_by_key(|event| (event.begin_ns, std::cmp::Reverse(event.end_ns)));
    let clock = match deviation_us {
        Some(_) => {
            "calibrated: passes are placed on the host's clock by VK_KHR_calibrated_timestamps or its EXT form"
        }
        None => {
            "not calibrated: the device's clock cannot be read from the host; the first pass of each submission is placed \
                 where the host began to submit"
        }
    };
    let device = device_label(context);
    let about = |kind: &str, (process, track): (u32, u32), arguments: Value| json!({"ph": "M", "name": kind, "pid": process, "tid": track, "args": arguments});
    let name = |kind, track, name: &str| about(kind, track, json!({"name": name}));
    let order = |process| about("process_sort_index", (process, 0), json!({"sort_index": process}));
    let mut all = vec![
        order(HOST),
        order(DEVICE),
        name("process_name", (HOST, 0), "host"),
        name("thread_name", (HOST, RENDERER), "renderer"),
        name("process_name", (DEVICE, 0), &format!("device: {device}")),
        name(
            "thread_name",
            (DEVICE, QUEUE),
            if deviation_us.is_some() { "queue" } else { "queue (not calibrated)" },
        ),
    ];
    let last = events.iter().filter(|event| event.process == HOST).map(|event| event.track).max();
    for track in SUBMISSIONS..=last.unwrap_or(SUBMISSIONS) {
        let text = format!("submissions and copies, lane {}", track - SUBMISSIONS + 1);
        all.push(name("thread_name", (HOST, track), &text));
    }
    all.extend(events.into_iter().map(|event| {
        let Event { name, process, track, begin_ns, end_ns, arguments } = event;
        let us = |ns: u64| ns as f64 / 1e3;
        json!({"ph": "X", "name": name, "pid": process, "tid": track, "ts": us(begin_ns), "dur": us(end_ns - begin_ns),
               "args": arguments})
    }));
    json!({
        // With "ms" Chrome compares times in whole microseconds, and nests shorter events
        // below their neighbour.
        "displayTimeUnit": "ns",
        // Perfetto shows this from version 58 on, Chrome always.
        "metadata": {
            "program": concat!("lightpaths ", env!("CARGO_PKG_VERSION")),
            "debug_build": cfg!(debug_assertions),
            "device": device, "driver": context.driver(), "scene": scene, "size": size,
            "clock": clock, "deviation_us": deviation_us,
        },
        "traceEvents": all,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::PassSpan;

    /// With an estimated device clock, the second submission begins within the first and is moved.
    /// With a known clock it stays.
    #[test]
    fn passes_of_one_queue_follow_one_another() {
        let begins = |deviation_us| {
            let pass = |begin_us| PassSpan { name: "pass", begin_us, end_us: begin_us + 10.0, dispatches: 1 };
            let submission = |begin_us| SubmissionSpan {
                begun_us: 0.0,
                recorded_us: 0.0,
                submitted_us: 0.0,
                done_us: 90.0,
                read_us: 90.0,
                passes: vec![pass(begin_us), pass(begin_us + 20.0)],
                deviation_us,
            };
            let trace = Trace { submissions: [5.0, 15.0, 80.0].map(submission).into(), host: Vec::new() };
            let mut events = Vec::new();
            traced(&mut events, &trace);
            let passes = events.iter().filter(|event| event.process == DEVICE);
            passes.map(|event| event.begin_ns / 1000).collect::<Vec<_>>()
        };
        assert_eq!(begins(None), [5, 25, 35, 55, 80, 100]);
        assert_eq!(begins(Some(0.5)), [5, 25, 15, 35, 80, 100]);
    }

    #[test]
    fn groups_that_meet_are_on_tracks_of_their_own() {
        let group = |begin_ns, end_ns| {
            let event = |name: &str| Event {
                name: name.into(),
                process: HOST,
                track: SUBMISSIONS,
                begin_ns,
                end_ns,
                arguments: Value::Null,
            };
            vec![event("outer"), event("inner")]
        };
        let groups = vec![group(5, 20), group(0, 10), group(10, 12), group(11, 30), group(12, 13)];
        let tracks: Vec<_> = apart(groups).map(|event| (event.begin_ns, event.track - SUBMISSIONS)).collect();
        let expected = [(0, 0), (5, 1), (10, 0), (11, 2), (12, 0)].map(|place| [place, place]).concat();
        assert_eq!(tracks, expected);
    }
}
