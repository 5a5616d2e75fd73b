//! Other devices: none, several, a lost one, and devices with Vulkan's minimum limits.

use lightpaths::gpu::shaders::{SHADERS, Shader};
use lightpaths::gpu::spirv::reflect;
use lightpaths::image::read;

use crate::program::Stage;
use crate::shared_memory::shared_bytes;

const PROPERTIES: &str = "vkGetPhysicalDeviceProperties2";
const RENDER: &str = "render CUBE -q -o a.exr";

#[test]
fn no_device_is_said_by_every_command_that_needs_one() {
    let stage = Stage::new();
    for arguments in [
        RENDER,
        "precompute CUBE -q -o a.paths",
        "time CUBE -q --json a.json",
        "film FILM -q -o film",
        "sweep CUBE -q -o sweep --cache cache",
        "scale CUBE -q -o scale",
        "figures CUBE -q -o figures --cache cache",
        "info",
    ] {
        for none in ["NONE", "VK_ERROR_INITIALIZATION_FAILED"] {
            let outcome = stage.run(arguments, &format!("vkEnumeratePhysicalDevices:1+:{none}"));
            outcome.assert_failed(3, &["found none", "install"], arguments);
            assert_eq!(outcome.stdout, "", "{arguments}");
            assert_eq!(stage.listing(), [""; 0], "{arguments}");
        }
    }
}

#[test]
fn of_two_devices_the_better_or_the_one_asked_for_is_used() {
    let stage = Stage::new();
    // The loader queries properties in an undefined order: each call of the program is one device.
    let two =
        |second: &str| format!("vkEnumeratePhysicalDevices:1+:TWO,{PROPERTIES}:2:deviceName=Second;{second}");
    let render = |device: &str, second: &str| {
        let outcome =
            stage.run(&format!("render CUBE --method path --spp 1 -o a.png {device}"), &two(second));
        outcome.assert_done(device);
        outcome.stdout
    };
    // A discrete GPU is preferred to a CPU, which lavapipe is.
    assert!(render("", "deviceType=2").contains("Second"));
    assert!(!render("--device 0", "deviceType=2").contains("Second"));
    assert!(render("--device second", "deviceType=4").contains("Second"));
    assert!(!render("", "deviceType=4").contains("Second"));
    // The better device cannot be used, so the other one is.
    assert!(!render("", "deviceType=2;apiVersion=1").contains("Second"));
    let outcome = stage.run("render CUBE -o b.png --device 1", &two("deviceType=2;apiVersion=1"));
    outcome.assert_failed(3, &["`1`", "Second", "speaks Vulkan 1.1", "llvmpipe"], "refused");
    let outcome = stage.run("info", &two("maxComputeWorkGroupInvocations=128"));
    outcome.assert_done("info");
    assert!(outcome.stdout.contains("device 0") && outcome.stdout.contains("device 1"), "{}", outcome.stdout);
    assert!(outcome.stdout.contains("no: its maxComputeWorkGroupInvocations is 128"), "{}", outcome.stdout);
    assert_eq!(stage.listing(), ["a.png"]);
}

/// Workgroups are swizzled differently, and sums have another order.
#[test]
fn what_suits_a_gpu_makes_the_same_picture() {
    let stage = Stage::new();
    let render = |name: &str, faults: &str| {
        let quality =
            "--set quality.entry_points=20000 --set quality.cache_points=700 --set quality.cells=32";
        let outcome = stage.run(&format!("render box -q --size 64x64 -o {name} {quality}"), faults);
        assert!(outcome.status.success(), "{:?}", outcome.said);
        read(&stage.folder.path().join(name), None).unwrap().pixels
    };
    let processor = render("processor.exr", "");
    let gpu = render("gpu.exr", &format!("{PROPERTIES}:1+:deviceType=2"));
    let scale = processor.iter().flatten().sum::<f32>() / processor.len() as f32;
    for (pixel, (a, b)) in processor.iter().flatten().zip(gpu.iter().flatten()).enumerate() {
        assert!((a - b).abs() <= 1e-5 * (a + scale), "value {pixel}: {a} and {b}");
    }
    assert!(processor != gpu, "sums had the same order: was it taken for a GPU?");
}

#[test]
fn a_device_that_vanishes_is_said() {
    let stage = Stage::new();
    for (arguments, calls) in
        [(RENDER, 1), ("time CUBE -q --frames 1 --json t.json", 2), ("scale CUBE -q -o out --lights 1,2", 1)]
    {
        let gone = format!("vkCreateDevice:{calls}:VK_ERROR_INITIALIZATION_FAILED");
        let outcome = stage.run(arguments, &gone);
        assert_eq!(outcome.faults.len(), 1, "{arguments}: {:?}", outcome.said);
        outcome.assert_failed(4, &["vkCreateDevice", "VK_ERROR_INITIALIZATION_FAILED"], arguments);
        assert_eq!(stage.listing(), [""; 0], "{arguments}");
    }
}

/// Limits whose minimum in Vulkan is too low: name, minimum, need.
fn needs() -> [(&'static str, u32, u32); 4] {
    let modules: Vec<_> = SHADERS.iter().map(|shader| reflect(&shader.words())).collect();
    let bindings = modules.iter().map(|module| module.bindings.len() as u32).max().unwrap();
    let invocations = modules.iter().map(|module| module.local_size.iter().product()).max().unwrap();
    let along_x = modules.iter().map(|module| module.local_size[0]).max().unwrap();
    [
        ("maxPerStageDescriptorStorageBuffers", 4, bindings),
        ("maxPushDescriptors", 0, bindings),
        ("maxComputeWorkGroupInvocations", 128, invocations),
        ("maxComputeWorkGroupSize", 128, along_x),
    ]
}

#[test]
fn a_device_below_our_needs_is_refused_and_one_that_meets_them_gives_the_same_bytes() {
    let stage = Stage::new();
    stage.run(RENDER, "").assert_done("as it is");
    let whole = stage.read("a.exr");
    let mut met = String::from(
        "maxStorageBufferRange=134217728;maxTexelBufferElements=65536;maxPushConstantsSize=128;\
         maxComputeWorkGroupCount=65535;maxComputeSharedMemorySize=16384;maxPerStageResources=128",
    );
    for (name, promised, need) in needs() {
        assert!(promised < need, "{name}: Vulkan promises {promised}, we need {need}");
        for low in [promised, need - 1] {
            let outcome = stage.run(RENDER, &format!("{PROPERTIES}:1+:{name}={low}"));
            outcome.assert_failed(
                3,
                &[name, &format!("is {low} and must be {need}"), "another device"],
                name,
            );
            assert!(stage.read("a.exr") == whole, "{name}");
        }
        met += &format!(";{name}={need}");
    }
    let shared = SHADERS.iter().map(|shader| shared_bytes(&shader.words())).max();
    assert!((1..=16_384).contains(&shared.unwrap()), "{shared:?} bytes of shared memory");
    let texels = |shader: &Shader| reflect(&shader.words()).bindings.iter().filter(|at| at.is_texels).count();
    let texels = SHADERS.iter().map(texels).max();
    assert!((1..=16).contains(&texels.unwrap()), "{texels:?} buffers of texels");
    let push = SHADERS.iter().filter_map(|shader| reflect(&shader.words()).push).map(|push| push.size).max();
    assert!(push.unwrap() <= 128, "{push:?} bytes of push constants");
    stage.run(RENDER, &format!("{PROPERTIES}:1+:{met}")).assert_done("light paths");
    assert!(stage.read("a.exr") == whole, "light paths");
    // A photon pass does not fit in the smallest bindings, and the error reports this. It fits in
    // somewhat larger ones.
    let photons = "render CUBE -q -o a.exr --method photon --spp 1";
    stage.run(photons, "").assert_done(photons);
    let whole = stage.read("a.exr");
    let outcome = stage.run(photons, &format!("{PROPERTIES}:1+:{met}"));
    outcome.assert_failed(4, &["buffer `", " needs ", "the device binds at most 1.0 MiB"], photons);
    assert!(stage.read("a.exr") == whole, "what was there is as it was");
    stage.run(photons, &format!("{PROPERTIES}:1+:{met};maxTexelBufferElements=4194304")).assert_done(photons);
    assert!(stage.read("a.exr") == whole, "photons");
}

#[test]
fn bindings_shorter_than_lists_change_nothing_or_are_refused_with_the_need() {
    let stage = Stage::new();
    stage.run(RENDER, "").assert_done("as it is");
    let whole = stage.read("a.exr");
    let mut done = 0;
    for (limit, texel, range) in [
        ("maxStorageBufferRange", 1, 1 << 22),
        ("maxStorageBufferRange", 1, 1 << 20),
        ("maxTexelBufferElements", 16, 1 << 18),
        ("maxStorageBufferRange", 1, 1 << 18),
        ("maxTexelBufferElements", 16, 1 << 14),
        ("maxStorageBufferRange", 1, 1 << 10),
    ] {
        let outcome = stage.run(RENDER, &format!("{PROPERTIES}:1+:{limit}={}", range / texel));
        if outcome.status.success() {
            done += 1;
        } else {
            outcome.assert_failed(
                4,
                &["buffer `", " needs ", "the device binds at most"],
                &range.to_string(),
            );
        }
        assert!(stage.read("a.exr") == whole, "{range}");
    }
    assert!((1..6).contains(&done), "both have come about: {done}");
}
