//! `VK_ERROR_*` from every call that can return one: the error names the call and its code, and
//! nothing is leaked.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::layer::assert_all_destroyed;
use crate::program::{Outcome, Stage, in_turns};

/// Calls whose failure is not reported: the picture is the same.
const SURVIVED: [&str; 4] =
    ["vkCreatePipelineCache", "vkDeviceWaitIdle", "vkGetPipelineCacheData", "vkSetDebugUtilsObjectNameEXT"];
/// This function returns no result.
const INFALLIBLE: &str = "vkGetPhysicalDeviceProperties2";
/// Calls of the allocator: see `memory.rs`.
const MEMORY: [&str; 2] = ["vkAllocateMemory", "vkMapMemory"];

/// Renders a picture with a fault. Asserts that the fault is reported, with exit code 4 and
/// without other effects.
fn fails(stage: &Stage, arguments: &str, name: &str, call: &str, code: &str) {
    let case = format!("{name}:{call}:{code}");
    let outcome = stage.run(arguments, &case);
    assert!(!outcome.faults.is_empty(), "{arguments}: {case} has not come about: {:?}", outcome.said);
    assert_told(stage, &outcome, &[plain(name), code], &format!("{arguments}: {case}"));
}

/// The same for a late call: number `count` · `part` / `parts`. If a run makes fewer calls than
/// `count`, the test repeats with the new number.
fn fails_late(stage: &Stage, arguments: &str, name: &str, [part, parts]: [u64; 2], mut count: u64) {
    const TRIES: usize = 20;
    let before: Vec<_> = stage.listing().into_iter().map(|name| (stage.read(&name), name)).collect();
    for _ in 0..TRIES {
        let call = (count * part / parts).max(1);
        let case = format!("{name}:{call}:{}", code_of(name));
        let outcome = stage.run(arguments, &case);
        if !outcome.is_beyond(name, call) {
            assert!(!outcome.faults.is_empty(), "{arguments}: {case} has not come about: {:?}", outcome.said);
            return assert_told(
                stage,
                &outcome,
                &[plain(name), code_of(name)],
                &format!("{arguments}: {case}"),
            );
        }
        count = count.min(outcome.calls[name]);
        stage.listing().iter().for_each(|name| fs::remove_file(stage.folder.path().join(name)).unwrap());
        before.iter().for_each(|(bytes, name)| fs::write(stage.folder.path().join(name), bytes).unwrap());
    }
    panic!("{arguments}: no call of {name} failed in {TRIES} runs");
}

fn assert_told(stage: &Stage, outcome: &Outcome, words: &[&str], case: &str) {
    outcome.assert_failed(4, &[words, &["failed: "]].concat(), case);
    assert_eq!(stage.listing(), ["old.png"], "{case}");
    assert_eq!(stage.read("old.png"), b"old", "{case}");
}

/// The name without the suffix of its extension.
fn plain(name: &str) -> &str {
    name.trim_end_matches("KHR").trim_end_matches("EXT")
}

/// Whether the test skips this function: its failure is not reported, it returns no result, or the
/// allocator calls it.
fn is_special(name: &str) -> bool {
    [&SURVIVED[..], &MEMORY, &[INFALLIBLE]].concat().contains(&name)
}

fn code_of(name: &str) -> &'static str {
    match name {
        "vkWaitForFences" | "vkGetQueryPoolResults" | "vkQueueSubmit2KHR" => "VK_ERROR_DEVICE_LOST",
        "vkCreateDevice" => "VK_ERROR_INITIALIZATION_FAILED",
        "vkCreateBuffer" | "vkBindBufferMemory" => "VK_ERROR_OUT_OF_DEVICE_MEMORY",
        _ => "VK_ERROR_OUT_OF_HOST_MEMORY",
    }
}

#[test]
fn the_first_and_the_last_call_of_every_function_may_fail() {
    // With the validation layer, which reports leaked objects on stderr: the test asserts a
    // single line there.
    const RENDER: &str = "render CUBE --method path --spp 2 --validation -o old.png";
    let stage = Stage::new();
    let calls = stage.calls(RENDER);
    let whole = stage.read("old.png");
    assert!(calls.len() > 20, "{calls:?}");
    for name in SURVIVED {
        let outcome = stage.run(RENDER, &format!("{name}:1+:VK_ERROR_OUT_OF_HOST_MEMORY"));
        outcome.assert_done(name);
        assert!(!outcome.faults.is_empty() && stage.read("old.png") == whole, "{name}");
    }
    stage.write("old.png", "old");
    for (name, count) in &calls {
        if is_special(name) {
            continue;
        }
        // The loader also calls these functions, and ignores failures.
        let asks = name.starts_with("vkEnumerate");
        fails(&stage, RENDER, name, if asks { "1+" } else { "1" }, code_of(name));
        if !asks && *count > 1 {
            fails_late(&stage, RENDER, name, [1, 1], *count);
        }
    }
}

#[test]
#[ignore = "thousands of runs: make stress"]
fn every_call_of_every_function_may_fail() {
    for render in ["render CUBE --method path --spp 2 -o old.png", "render CUBE -o old.png"] {
        let stage = Stage::new();
        let calls = stage.calls(render);
        let each = calls.iter().filter(|(name, _)| !is_special(name) && !name.starts_with("vkEnumerate"));
        println!("{render}: {} functions", each.clone().count());
        let cases: Vec<(&str, u64)> =
            each.flat_map(|(name, count)| (1..=*count).map(|call| (name.as_str(), call))).collect();
        let beyond = AtomicUsize::new(0);
        in_turns(&cases, |stage, &(name, call)| {
            let case = format!("{name}:{call}:{}", code_of(name));
            stage.write("old.png", "old");
            let outcome = stage.run(render, &case);
            if outcome.is_beyond(name, call) {
                beyond.fetch_add(1, Ordering::Relaxed);
            } else {
                assert_told(stage, &outcome, &[plain(name), code_of(name)], &format!("{render}: {case}"));
            }
        });
        let beyond = beyond.into_inner();
        println!("{render}: {} calls, {beyond} of them beyond the last", cases.len());
        assert!(20 * beyond <= cases.len(), "{beyond} of {} have not come about", cases.len());
    }
}

#[test]
fn every_call_that_the_device_layer_makes_is_among_them() {
    let stage = Stage::new();
    let mut seen: BTreeSet<String> = BTreeSet::new();
    for arguments in
        ["render CUBE --method path --spp 2 --validation -o a.png", "time CUBE --frames 1 --trace t.json"]
    {
        seen.extend(stage.calls(arguments).into_keys());
    }
    // Layers need an instance, so they miss these calls.
    let early = ["vkEnumerateInstanceExtensionProperties", "vkEnumerateInstanceLayerProperties"];
    // Calls of `time --statistics`, if the driver has statistics.
    let statistics = ["vkGetPipelineExecutablePropertiesKHR", "vkGetPipelineExecutableStatisticsKHR"];
    let gpu = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/gpu");
    let mut checked = 0;
    for entry in fs::read_dir(gpu).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            // The window's calls have their own tests.
            continue;
        }
        let text = fs::read_to_string(path).unwrap();
        for name in text.split(".vk(\"").skip(1).map(|rest| rest.split('"').next().unwrap()) {
            let is_seen = seen.iter().any(|seen| plain(seen) == plain(name));
            assert!(is_seen || early.contains(&name) || statistics.contains(&name), "no fault for {name}");
            checked += 1;
        }
    }
    assert!(checked > 20, "{checked}");
}

#[test]
fn clocks_that_cannot_be_read_are_said() {
    let stage = Stage::new();
    stage.write("old.png", "old");
    for name in ["vkGetCalibratedTimestampsEXT", "vkGetQueryPoolResults"] {
        fails(&stage, "time CUBE -q --frames 1 --trace t.json", name, "1", "VK_ERROR_OUT_OF_HOST_MEMORY");
    }
}

#[test]
fn light_paths_fail_as_early_and_as_late_as_can_be() {
    let stage = Stage::new();
    let calls = stage.calls("render CUBE -o old.png");
    stage.write("old.png", "old");
    let render = "render CUBE --validation -o old.png --stats s.json";
    for name in ["vkCreateBuffer", "vkCreateComputePipelines", "vkQueueSubmit2KHR", "vkWaitForFences"] {
        for fraction in [[1, 3], [1, 1]] {
            fails_late(&stage, render, name, fraction, calls[name]);
        }
    }
    // The device stays lost: every later call fails.
    let half = calls["vkQueueSubmit2KHR"] / 3;
    let lost =
        ["vkWaitForFences", "vkDeviceWaitIdle"].map(|name| format!(",{name}:{half}+:VK_ERROR_DEVICE_LOST"));
    let faults = format!("vkQueueSubmit2KHR:{half}+:VK_ERROR_DEVICE_LOST{}", lost.concat());
    let outcome = stage.run(render, &faults);
    outcome.assert_failed(4, &["vkQueueSubmit2", "VK_ERROR_DEVICE_LOST", "last pass"], "lost");
    assert_eq!(stage.listing(), ["old.png"]);
}

#[test]
fn other_commands_leave_what_was_whole() {
    let stage = Stage::new();
    stage.write("old.png", "old");
    let calls = stage.calls("precompute CUBE -o p");
    fs::remove_file(stage.folder.path().join("p")).unwrap();
    let late = calls["vkQueueSubmit2KHR"];
    fails_late(&stage, "precompute CUBE -o p", "vkQueueSubmit2KHR", [1, 1], late);
    fails_late(&stage, "time CUBE -q --frames 1 --json t.json", "vkWaitForFences", [1, 1], late);
    fails_late(&stage, "render CUBE -o old.png --method photon --spp 4", "vkWaitForFences", [1, 1], 80);

    // Finished frames of a film stay; each is whole.
    let calls = stage.calls("film FILM --frames 0..2 -o film");
    let whole = [0, 1].map(|frame| stage.read(&format!("film/frame-0000{frame}.png")));
    fs::remove_dir_all(stage.folder.path().join("film")).unwrap();
    let mut late = calls["vkWaitForFences"] + 2;
    let outcome = loop {
        let fault = format!("vkWaitForFences:{late}+:VK_ERROR_DEVICE_LOST");
        let outcome = stage.run("film FILM -o film --video none", &fault);
        if !outcome.is_beyond("vkWaitForFences", late) {
            break outcome;
        }
        fs::remove_dir_all(stage.folder.path().join("film")).unwrap();
        late = late.min(outcome.calls["vkWaitForFences"]) - 1;
    };
    outcome.assert_failed(4, &["vkWaitForFences", "VK_ERROR_DEVICE_LOST"], "film");
    let names = stage.listing();
    assert!(names.len() < 5, "{names:?}");
    for (frame, whole) in whole.iter().enumerate() {
        let name = format!("film/frame-0000{frame}.png");
        // If the precomputation took more dispatches this time, the call came earlier.
        assert!(!names.contains(&name) || &stage.read(&name) == whole, "frame {frame}");
    }
}

/// The program destroys each object that it creates, once.
#[test]
fn what_is_made_is_destroyed() {
    let stage = Stage::new();
    for render in ["render CUBE -o a.png", "render CUBE --method photon --spp 1 -o a.png"] {
        let calls = stage.all_calls(render);
        assert_all_destroyed(&calls, render);
        assert!(calls["vkCreateBuffer"] > 20 && calls["vkCreateComputePipelines"] > 10, "{calls:?}");
    }
}

/// Every Vulkan object has a name, which validation messages and captures show.
#[test]
fn what_is_made_has_a_name() {
    // Each call creates one object.
    const NAMED: [&str; 10] = [
        "vkCreateBuffer",
        "vkCreateBufferView",
        "vkCreateCommandPool",
        "vkCreateComputePipelines",
        "vkCreateDescriptorSetLayout",
        "vkCreateFence",
        "vkCreatePipelineCache",
        "vkCreatePipelineLayout",
        "vkCreateQueryPool",
        "vkCreateShaderModule",
    ];
    let calls = Stage::new().calls("render CUBE -o a.png --validation");
    let made: u64 = NAMED.iter().filter_map(|name| calls.get(*name)).sum();
    // Plus device, queue, and the command buffer of each submission that is in use at once.
    let others = 2 + calls["vkAllocateCommandBuffers"];
    assert_eq!(calls["vkSetDebugUtilsObjectNameEXT"], made + others, "{calls:?}");
}
