//! Lights that are dimmed without a frame.

use glam::Vec3;
use lightpaths::gpu::{CommandCounts, Context, ContextOptions, Recorder};
use lightpaths::renderer::{Renderer, Silent};
use lightpaths::scene::{Light, LightKind, LoadOptions, Scene};
use std::sync::Arc;

/// The Box with fifteen more lamps above its middle.
fn renderer(context: &Arc<Context>, size: &str) -> Renderer {
    let mut set = [format!("camera.size=[{size}]"), "quality.preset=\"draft\"".to_owned()].to_vec();
    set.extend(["entry_points=20000", "cache_points=4000"].map(|key| format!("quality.{key}")));
    let mut scene = Scene::load("box", &LoadOptions { set, ..LoadOptions::default() }).unwrap();
    let lamp = |index: u32| {
        let place = 0.2 * Vec3::new((index % 4) as f32 - 1.5, 0.0, (index / 4) as f32 - 1.5);
        let intensity = Vec3::new(0.3, 0.2, 0.1) * (1 + index) as f32;
        Light::new(
            format!("lamp{index}"),
            LightKind::Point { position: place + Vec3::new(0.0, 0.3, 0.0), intensity },
        )
    };
    scene.lights.extend((1..16).map(lamp));
    Renderer::new(context, scene, &mut Silent).unwrap()
}

fn run(recorder: Recorder) {
    recorder.submit().unwrap().wait().unwrap();
}

/// What a frame displays in which the light has this emission.
fn framed(renderer: &mut Renderer, light: usize, emission: Vec3) -> Vec<[u8; 4]> {
    let kind = renderer.scene().lights[light].kind.with_emission(emission);
    renderer.set_light(light, kind).unwrap();
    renderer.frame().unwrap();
    renderer.display().unwrap()
}

/// Processor time of this process so far, clock ticks of 10 ms.
fn ticks() -> u64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap();
    // The name in brackets may contain spaces; user and system time are the 12th and 13th
    // fields after it.
    let fields: Vec<&str> = stat.rsplit_once(')').unwrap().1.split_whitespace().collect();
    fields[11].parse::<u64>().unwrap() + fields[12].parse::<u64>().unwrap()
}

#[test]
fn mixed_pictures_are_those_of_frames() {
    let context = Context::new(&ContextOptions { validation: true, ..ContextOptions::default() }).unwrap();
    let mut renderer = renderer(&context, "96,96");
    let light = 7;
    let emission = renderer.scene().lights[light].kind.emission();
    let gains = Vec3::new(0.25, 2.0, 0.5);
    let expected = [gains, Vec3::ZERO, Vec3::ONE].map(|gain| framed(&mut renderer, light, gain * emission));

    assert!(expected.windows(2).all(|pair| pair[0] != pair[1]), "the light is seen");

    let mix = renderer.begin_mix().unwrap();
    renderer.set_light(light, renderer.scene().lights[light].kind.with_emission(Vec3::ZERO)).unwrap();
    let (recorder, frame) = renderer.begin_frame_without(&mix, gains).unwrap();
    let done = recorder.submit().unwrap().wait().unwrap();
    assert!(!frame.has_lists());
    renderer.frame_is_valid(&frame);
    renderer.end_frame(&frame, done).unwrap();
    let first = renderer.display().unwrap();
    for (gain, expected) in [Vec3::ZERO, Vec3::ONE].into_iter().zip(&expected[1..]) {
        run(renderer.mix(&mix, gain).unwrap());
        assert!(renderer.display().unwrap() == *expected, "gain {gain}: the bytes of a frame");
    }
    run(renderer.mix(&mix, gains).unwrap());
    let again = renderer.display().unwrap();
    assert!(first == again, "the first mix is as later ones");
    // A sum rounds otherwise, and clamped records are not linear in the lights: few codes differ.
    let differences =
        again.as_flattened().iter().zip(expected[0].as_flattened()).map(|(a, b)| a.abs_diff(*b));
    let (most, count) =
        differences.fold((0, 0), |(most, count), by| (most.max(by), count + usize::from(by > 0)));
    println!("{count} of {} codes differ, by {most} at most", 4 * again.len());
    assert!(most <= 1 && count * 100 < again.len(), "{count} codes differ, by up to {most}");

    // The next frame shows its own picture, even without a change.
    renderer.end_mix();
    renderer.frame().unwrap();
    assert!(renderer.display().unwrap() == expected[1]);
}

/// Whatever the scene has.
#[test]
fn a_light_is_dimmed_with_one_dispatch() {
    let context = Context::new(&ContextOptions::default()).unwrap();
    let commands = dimmed(&context, 3).0;
    assert_eq!([commands.submissions, commands.dispatches, commands.read_back_bytes], [3, 3, 0]);
}

#[test]
#[ignore = "measures processor time: needs a quiet machine"]
fn a_light_is_dimmed_in_30_ms_of_processor_time() {
    let context = Context::new(&ContextOptions::default()).unwrap();
    let ms = dimmed(&context, 100).1;
    println!("{ms:.1} ms");
    assert!(ms <= 30.0, "{ms} ms");
}

/// Dims one of sixteen lights `count` times. Returns the commands of all, and the processor time of
/// one, milliseconds.
fn dimmed(context: &Arc<Context>, count: u64) -> (CommandCounts, f64) {
    let mut renderer = renderer(context, "512,512");
    renderer.set_serialised(false);
    renderer.frame().unwrap();
    let mix = renderer.begin_mix().unwrap();
    renderer.set_light(3, renderer.scene().lights[3].kind.with_emission(Vec3::ZERO)).unwrap();
    run(renderer.begin_frame_without(&mix, Vec3::ONE).unwrap().0);
    let dim = |step: u64| run(renderer.mix(&mix, Vec3::splat(0.02 * step as f32)).unwrap());
    dim(0);
    let (commands, before) = (context.command_counts(), ticks());
    (0..count).for_each(dim);
    (context.command_counts() - commands, 10.0 * (ticks() - before) as f64 / count as f64)
}
