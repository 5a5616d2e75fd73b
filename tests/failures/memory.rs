//! Out of memory: the program uses less if it can, else the error states the need and a setting.

use crate::program::{Stage, in_turns};

const RENDERS: [&str; 3] = [
    "render CUBE --method path --spp 1 --validation -o a.exr",
    "render CUBE -o a.exr",
    "render CUBE --method photon --spp 1 -o a.exr",
];

#[test]
fn every_allocation_may_fail() {
    let stage = Stage::new();
    for render in RENDERS {
        let count = stage.calls(render)["vkAllocateMemory"];
        let whole = stage.read("a.exr");
        std::fs::remove_file(stage.folder.path().join("a.exr")).unwrap();
        for call in 1..=count {
            let faults = format!("vkAllocateMemory:{call}+:VK_ERROR_OUT_OF_DEVICE_MEMORY");
            let case = format!("{render}: {faults}");
            let outcome = stage.run(render, &faults);
            if outcome.is_beyond("vkAllocateMemory", call) {
                std::fs::remove_file(stage.folder.path().join("a.exr")).unwrap();
                continue;
            }
            let words = ["vkAllocateMemory", "VK_ERROR_OUT_OF_DEVICE_MEMORY", " needs ", "the device has"];
            outcome.assert_failed(4, &words, &case);
            assert!(stage.listing().is_empty(), "{case}");
        }
        // Only the block does not fit; the requested buffer may.
        let faults = format!("vkAllocateMemory:{count}:VK_ERROR_OUT_OF_DEVICE_MEMORY");
        let outcome = stage.run(render, &faults);
        outcome.assert_done(&faults);
        let has_come = outcome.faults.len() == 1 || outcome.is_beyond("vkAllocateMemory", count);
        assert!(has_come && stage.read("a.exr") == whole, "{render}");
        std::fs::remove_file(stage.folder.path().join("a.exr")).unwrap();
    }
}

#[test]
fn allocations_fail_in_other_ways() {
    let stage = Stage::new();
    for (faults, words) in [
        ("vkAllocateMemory:1+:VK_ERROR_OUT_OF_HOST_MEMORY", ["vkAllocateMemory", "ERROR_OUT_OF_HOST_MEMORY"]),
        ("vkAllocateMemory:1+:VK_ERROR_TOO_MANY_OBJECTS", ["vkAllocateMemory", "ERROR_TOO_MANY_OBJECTS"]),
        ("vkMapMemory:1+:VK_ERROR_MEMORY_MAP_FAILED", ["vkMapMemory", "memory object has failed"]),
    ] {
        let outcome = stage.run(RENDERS[0], faults);
        assert!(!outcome.faults.is_empty(), "{faults}");
        outcome.assert_failed(4, &words, faults);
        assert!(stage.listing().is_empty(), "{faults}");
    }
}

/// Less than one block of memory: each buffer then has its own allocation.
const LITTLE: &str = "vkAllocateMemory:1+:MAX=12000000";

/// With little memory, any allocation may be the first to fail.
fn fails_from(stage: &Stage, call: usize, whole: &[u8]) {
    let faults = format!("vkAllocateMemory:{call}+:VK_ERROR_OUT_OF_DEVICE_MEMORY,{LITTLE}");
    let outcome = stage.run(RENDERS[1], &faults);
    if outcome.is_beyond("vkAllocateMemory", call as u64) {
        std::fs::write(stage.folder.path().join("a.exr"), whole).unwrap();
        return;
    }
    outcome.assert_failed(4, &["vkAllocateMemory", " needs "], &faults);
    assert!(stage.read("a.exr") == whole, "{faults}");
}

#[test]
#[ignore = "hundreds of runs: make stress"]
fn every_single_allocation_may_fail() {
    let outcome = Stage::new().run(RENDERS[1], LITTLE);
    outcome.assert_done(LITTLE);
    let calls: Vec<usize> = (1..=outcome.faults.len()).collect();
    in_turns(&calls, |stage, &call| {
        stage.write("a.exr", "old");
        fails_from(stage, call, b"old");
    });
    println!("{} allocations", calls.len());
}

#[test]
fn a_device_of_little_memory_gives_the_same_picture_or_says_what_to_lower() {
    let stage = Stage::new();
    let render = RENDERS[1];
    stage.run(render, "").assert_done("enough");
    let whole = stage.read("a.exr");
    let outcome = stage.run(render, LITTLE);
    outcome.assert_done(LITTLE);
    assert!(outcome.faults.len() > 10 && stage.read("a.exr") == whole, "{:?}", outcome.faults.len());
    let count = outcome.faults.len();
    for call in (1..=count).step_by(count / 10) {
        fails_from(&stage, call, &whole);
    }
    for (most, settings) in
        [(1_000_000, "--set quality.entry_points=20000"), (100_000, "--size 1000x1000"), (10, "")]
    {
        let case = format!("{most} bytes");
        let outcome = stage.run(&format!("{render} {settings}"), &format!("vkAllocateMemory:1+:MAX={most}"));
        outcome.assert_failed(4, &["buffer `", "needs", "vkAllocateMemory", "; "], &case);
        let advice = outcome.said[0].rsplit("; ").next().unwrap();
        let names = ["lower quality.", "--size", "fewer triangles", "smaller preset"];
        assert!(names.iter().any(|name| advice.contains(name)), "{case}: {advice}");
        assert!(stage.read("a.exr") == whole, "{case}: what was there is as it was");
    }
}

/// Both tries of an allocation fail once. All light paths are then traced anew.
#[test]
fn a_film_goes_on_where_its_kept_results_leave_too_little_memory() {
    let stage = Stage::new();
    let film = "film MOVES -o f --format exr";
    let outcome = stage.run(film, LITTLE);
    outcome.assert_done(LITTLE);
    let count = outcome.calls["vkAllocateMemory"];
    let frames = || [0, 1].map(|frame| stage.read(&format!("f/frame-0000{frame}.exr")));
    let whole = frames();
    assert!(whole[0] != whole[1], "the model moves");
    let calls: Vec<u64> = (1..=10).map(|part| part * count / 11).collect();
    let mut done = 0;
    for call in calls {
        let fault = |call: u64| format!("vkAllocateMemory:{call}:VK_ERROR_OUT_OF_DEVICE_MEMORY");
        let faults = format!("{},{},{LITTLE}", fault(call), fault(call + 1));
        let outcome = stage.run(film, &faults);
        if outcome.status.success() {
            assert!(frames() == whole, "{faults}");
            done += 1;
        } else {
            outcome.assert_failed(4, &["vkAllocateMemory", " needs "], &faults);
        }
    }
    // Allocations outside of precomputations have nothing to make room for them.
    assert!(done >= 7, "{done} of 10");
}
