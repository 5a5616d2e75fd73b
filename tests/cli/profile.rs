//! Profiling: traces, pass replay, the driver's statistics of kernels, captures.

use super::common::context;
use super::{SMALL, assert_refused, cube, json, lightpaths, listing, run, stderr, stdout};
use lightpaths::renderer::{Layer, Renderer, Silent, Work};
use lightpaths::scene::{LoadOptions, Scene};
use serde_json::{Value, json};

/// Passes of every frame with all results stale.
const PASSES: [&str; 10] = [
    "primary",
    "direct",
    "form_factors",
    "path_scan",
    "hvds",
    "splat",
    "gather",
    "blend",
    "compose",
    "tonemap",
];

/// A complete event: process, track, begin and end in microseconds.
#[derive(Clone, Copy, Debug)]
struct Span {
    track: (u64, u64),
    begin: f64,
    end: f64,
}

impl Span {
    fn from_event(event: &Value) -> Self {
        let number = |key: &str| event[key].as_f64().unwrap();
        let track = (event["pid"].as_u64().unwrap(), event["tid"].as_u64().unwrap());
        Self { track, begin: number("ts"), end: number("ts") + number("dur") }
    }

    fn holds(&self, other: &Self, slack: f64) -> bool {
        self.begin - slack <= other.begin && other.end <= self.end + slack
    }
}

/// Rounding to nanoseconds, in microseconds.
const NANOSECOND: f64 = 0.0015;

/// The first fault of a trace, if there is one.
fn fault(trace: &Value) -> Result<(), String> {
    let events: Vec<&Value> = trace["traceEvents"].as_array().unwrap().iter().collect();
    let complete: Vec<(&Value, Span)> = events
        .iter()
        .filter(|event| event["ph"] == "X")
        .map(|event| (*event, Span::from_event(event)))
        .collect();
    if !complete.is_sorted_by(|a, b| a.1.begin <= b.1.begin) {
        return Err("not sorted".into());
    }
    for (event, span) in &complete {
        let has_name = |kind: &str, track: u64| {
            events
                .iter()
                .any(|m| m["ph"] == "M" && m["name"] == kind && m["pid"] == event["pid"] && m["tid"] == track)
        };
        if span.end < span.begin || span.begin < 0.0 {
            return Err(format!("{event} lasts less than nothing"));
        }
        if !has_name("process_name", 0) || !has_name("thread_name", span.track.1) {
            return Err(format!("{event} is on a track without a name"));
        }
    }
    // Events of a track follow one another or are nested.
    for (_, first) in &complete {
        for (event, later) in complete.iter().filter(|(_, later)| later.track == first.track) {
            let is_apart = later.end <= first.begin + NANOSECOND || first.end <= later.begin + NANOSECOND;
            if !is_apart && !first.holds(later, NANOSECOND) && !later.holds(first, NANOSECOND) {
                return Err(format!("{event} crosses another"));
            }
        }
    }
    let named = |name: &'static str| complete.iter().filter(move |(event, _)| event["name"] == name);
    // Passes run between the submission's begin and the end of waiting for it.
    let slack = NANOSECOND + trace["metadata"]["deviation_us"].as_f64().unwrap_or(f64::INFINITY);
    for (event, pass) in complete.iter().filter(|(event, _)| event["pid"] == 2) {
        let own =
            |name| named(name).find(|(other, _)| other["args"]["submission"] == event["args"]["submission"]);
        let (Some((_, submit)), Some((_, wait))) = (own("submit"), own("wait")) else {
            return Err(format!("{event} without a submission"));
        };
        if !(Span { end: wait.end, ..*submit }).holds(pass, slack) {
            return Err(format!("{event} is outside its submission"));
        }
    }
    let frames: Vec<_> = named("frame: everything").collect();
    if frames.len() != 2 {
        return Err(format!("{} frames of two", frames.len()));
    }
    for (frame, span) in frames {
        let passes = || complete.iter().filter(|(event, pass)| event["pid"] == 2 && span.holds(pass, slack));
        if let Some(missing) = PASSES.iter().find(|name| !passes().any(|(event, _)| event["name"] == **name))
        {
            return Err(format!("no {missing} in a frame"));
        }
        let sum: f64 = passes().map(|(_, pass)| pass.end - pass.begin).sum();
        let device_us = 1e3 * frame["args"]["device_ms"].as_f64().unwrap();
        if (sum - device_us).abs() > NANOSECOND * passes().count() as f64 || device_us > span.end - span.begin
        {
            return Err(format!("passes take {sum} us, the frame says {device_us}"));
        }
    }
    Ok(())
}

#[test]
fn a_trace_holds_every_pass_within_its_submission() {
    let (folder, cube) = (tempfile::tempdir().unwrap(), cube());
    let scene = cube.path().join("cube.toml");
    let arguments = ["time", scene.to_str().unwrap(), "-q", "--frames", "2", "--trace", "t.json"];
    let output = run(&folder, &[&arguments[..], &SMALL[..]].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(stdout(&output).starts_with("t.json: cube, 11 frames, "), "{}", stdout(&output));
    assert_eq!(listing(&folder), ["t.json"]);
    let trace = json(&folder, "t.json");
    assert_eq!(fault(&trace), Ok(()));
    let has = |name: &str| trace["traceEvents"].as_array().unwrap().iter().any(|event| event["name"] == name);
    for name in
        ["precomputation", "light paths", "gather rays", "record", "submit", "wait", "read back", "stage"]
    {
        assert!(has(name), "{name}");
    }

    // Each of these changes is reported.
    let doctored = |change: &dyn Fn(&mut Vec<Value>)| {
        let mut trace = trace.clone();
        change(trace["traceEvents"].as_array_mut().unwrap());
        fault(&trace).unwrap_err()
    };
    let last = |events: &[Value], name: &str| events.iter().rposition(|event| event["name"] == name).unwrap();
    let said = doctored(&|events| events.retain(|event| event["name"] != "blend"));
    assert!(said.contains("no blend"), "{said}");
    let said = doctored(&|events| {
        let tonemap = last(events, "tonemap");
        events[tonemap]["dur"] = json!(events[tonemap]["dur"].as_f64().unwrap() + 1e6);
    });
    assert!(said.contains("outside its submission") || said.contains("crosses"), "{said}");
    let said = doctored(&|events| {
        let gather = last(events, "gather");
        events[gather]["dur"] = json!(-1.0);
    });
    assert!(said.contains("less than nothing"), "{said}");
    let said = doctored(&|events| {
        let frame = last(events, "frame: everything");
        events[frame]["args"]["device_ms"] =
            json!(0.5 * events[frame]["args"]["device_ms"].as_f64().unwrap());
    });
    assert!(said.contains("the frame says"), "{said}");
    let said = doctored(&|events| events.reverse());
    assert!(said.contains("not sorted"), "{said}");
    let said = doctored(&|events| events.retain(|event| event["ph"] == "X"));
    assert!(said.contains("without a name"), "{said}");
}

/// The Box at a small size; its teapot is glossy.
fn glossy_box() -> Scene {
    let set = [
        "camera.size=[40,30]",
        "quality.entry_points=3000",
        "quality.gather_rays=64",
        "quality.cache_points=500",
        "quality.cells=16",
    ];
    let set = set.map(str::to_owned).to_vec();
    let mut scene = Scene::load("box", &LoadOptions { set, ..LoadOptions::default() }).unwrap();
    let teapot = scene.materials.iter_mut().find(|material| material.name == "teapot").unwrap();
    (teapot.specular, teapot.exponent) = (glam::Vec3::splat(0.3), 20.0);
    scene
}

#[test]
fn a_pass_alone_does_what_it_does_in_frames_and_leaves_the_picture() {
    let context = context();
    let mut renderer = Renderer::new(&context, glossy_box(), &mut Silent).unwrap();
    renderer.frame().unwrap();
    renderer.force(Work::Everything);
    let frame = renderer.frame().unwrap();
    let (display, radiance) = (renderer.display().unwrap(), renderer.layer(Layer::Beauty).unwrap());
    let mut names: Vec<&str> = frame.passes.iter().map(|pass| pass.name).collect();
    names.sort_unstable();
    names.dedup();
    assert!(names.len() > 20, "glossy scenes have nearly all passes: {names:?}");
    for name in names {
        for _ in 0..2 {
            let alone = renderer.replay(name).unwrap();
            let own = |passes: &[lightpaths::gpu::PassTiming]| -> Vec<u32> {
                passes.iter().filter(|pass| pass.name == name).map(|pass| pass.dispatches).collect()
            };
            // A pass that changes its own input follows the pass that renews it.
            let others = alone.passes.iter().map(|pass| pass.name).filter(|other| *other != name);
            let expected: &[&str] = if name == "shadow_edges" { &["direct"] } else { &[] };
            assert!(others.eq(expected.iter().copied()), "{name} alone: {:?}", alone.passes);
            assert_eq!(own(&alone.passes), own(&frame.passes), "dispatches of {name}");
            assert_eq!(alone.bytes.get(name), frame.bytes.get(name), "bytes of {name}");
        }
        assert!(renderer.display().unwrap() == display, "{name} changed what is displayed");
        assert!(renderer.layer(Layer::Beauty).unwrap() == radiance, "{name} changed the picture");
        renderer.frame().unwrap();
        assert!(renderer.display().unwrap() == display, "after {name} the next frame is another");
        assert!(
            renderer.layer(Layer::Beauty).unwrap() == radiance,
            "after {name} the next picture is another"
        );
    }
    super::common::assert_silent(&context);
}

#[test]
fn a_pass_alone_is_timed_as_often_as_asked() {
    let (folder, cube) = (tempfile::tempdir().unwrap(), cube());
    let scene = cube.path().join("cube.toml");
    let repeat = |pass, times| {
        let arguments = ["time", scene.to_str().unwrap(), "-q", "--repeat", pass, times];
        run(&folder, &[&arguments[..], &SMALL[..]].concat())
    };
    let output = repeat("primary", "7");
    assert!(output.status.success(), "{}", stderr(&output));
    let text = stdout(&output);
    for words in [
        "cube 32x32",
        "`primary` alone, 7 times; 1 occurrence",
        "median",
        "p10",
        "p90",
        "GB/s",
        "rays            1024, ",
    ] {
        assert!(text.contains(words), "{words} in {text}");
    }
    // A pass of scenes with glossy materials.
    assert_refused(&repeat("gloss_rays", "7"), 2, &["gloss_rays", "cube", "primary", "tonemap"]);
    assert_eq!(listing(&folder), [""; 0]);
}

#[test]
fn the_drivers_statistics_are_printed_or_their_absence() {
    let (folder, cube) = (tempfile::tempdir().unwrap(), cube());
    let scene = cube.path().join("cube.toml");
    let output =
        run(&folder, &[&["time", scene.to_str().unwrap(), "-q", "--statistics"][..], &SMALL[..]].concat());
    assert!(output.status.success(), "{}", stderr(&output));
    let (text, head) = (stdout(&output), format!("{}, {}", context().name(), context().driver()));
    assert!(text.replace(" (a CPU)", "").starts_with(&head), "{text}");
    let lacks =
        text.ends_with("no statistics of kernels, the driver lacks VK_KHR_pipeline_executable_properties\n");
    assert!(lacks || text.contains("\ngather_radiance ("), "{text}");
}

#[test]
fn captures_need_renderdoc() {
    let (folder, cube) = (tempfile::tempdir().unwrap(), cube());
    let scene = cube.path().join("cube.toml");
    let scene = scene.to_str().unwrap();
    for arguments in [
        &["render", scene, "-o", "a.png", "--capture", "shot"][..],
        &["time", scene, "-q", "--capture", "shot"],
    ] {
        let output = lightpaths(&folder, &[arguments, &SMALL[..]].concat()).output().unwrap();
        assert_refused(&output, 2, &["--capture", "RenderDoc is not attached", "renderdoccmd"]);
        assert_eq!(listing(&folder), [""; 0]);
    }
}

#[test]
fn wrong_arguments_of_sessions_are_refused_and_named() {
    let folder = tempfile::tempdir().unwrap();
    for (arguments, words) in [
        ("time box --trace missing/t.json", &["missing/t.json"][..]),
        ("time box room --trace t.json", &["two scenes", "room"]),
        ("time box --trace t.json --json u.json", &["--trace", "--json"]),
        ("time box --trace t.json --lights 2", &["--trace", "--lights"]),
        ("time box --repeat gathr 5", &["gathr", "gather", "tonemap"]),
        ("time box --repeat gather", &["--repeat", "2 values"]),
        ("time box --repeat gather 0", &["`0`", "1 to 100000"]),
        ("time box --repeat gather 100001", &["`100001`", "1 to 100000"]),
        ("time box --repeat gather often", &["`often`", "1 to 100000"]),
        ("time box --repeat gather 5 --frames 2", &["--repeat", "--frames"]),
        ("time box --repeat gather 5 --statistics", &["--repeat", "--statistics"]),
        ("time box --capture missing/shot", &["missing/shot", "no folder missing"]),
        ("render box -o a.png --capture missing/shot", &["missing/shot"]),
        ("render box -o a.png --capture shot --method path", &["--capture", "path"]),
    ] {
        assert_refused(&run(&folder, &arguments.split(' ').collect::<Vec<_>>()), 2, words);
        assert_eq!(listing(&folder), [""; 0], "{arguments}");
    }
}
