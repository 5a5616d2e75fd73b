//! Many renders at once, and long runs. `make soak` runs the full sizes; `LIGHTPATHS_SOAK_SECONDS`
//! sets the duration, by default an hour.
#![allow(clippy::unwrap_used, reason = "a test may panic")]

#[path = "../common/mod.rs"]
mod common;

use common::edits::{Dice, State, TINY, scene};
use glam::Vec3;
use lightpaths::gpu::{Context, ContextOptions};
use lightpaths::renderer::{Layer, Renderer, Silent};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

fn start(arguments: &[&str], output: &Path) -> Child {
    let mut command = Command::new(env!("CARGO_BIN_EXE_lightpaths"));
    command.args(["render", "box"]).args(arguments).arg("-o").arg(output);
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

/// Pictures of renders that run at the same time; each must succeed without output.
fn pictures(renders: Vec<(Child, PathBuf)>) -> Vec<Vec<u8>> {
    let finish = |(child, path): (Child, PathBuf)| {
        let output = child.wait_with_output().unwrap();
        let text = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.success(), "{path:?}: {:?}, {text}", output.status);
        fs::read(path).unwrap()
    };
    renders.into_iter().map(finish).collect()
}

/// Simultaneous renders give the same bytes as one alone: with their own files, then twice with one
/// cache, then with one output file, too. A short test skips the first two rounds.
fn many_at_once(at_once: usize, is_short: bool, arguments: &[&str]) {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: String| folder.path().join(name);
    let alone = file("alone.exr".to_owned());
    let expected = pictures(vec![(start(arguments, &alone), alone)]).remove(0);
    let cache = file("cache".to_owned()).to_str().unwrap().to_owned();
    let cached = [arguments, &["--cache", &cache]].concat();
    let rounds = [(arguments, true), (&cached, true), (&cached, true), (&cached, false)];
    for (arguments, has_own_file) in rounds.into_iter().skip(if is_short { 2 } else { 0 }) {
        let started = Instant::now();
        let all = (0..at_once).map(|i| {
            let output = file(if has_own_file { format!("{i}.exr") } else { "all.exr".to_owned() });
            (start(arguments, &output), output)
        });
        for (i, picture) in pictures(all.collect()).into_iter().enumerate() {
            assert!(picture == expected, "render {i} of {at_once}, {arguments:?}");
        }
        println!("{at_once} renders at once took {:.1} s", started.elapsed().as_secs_f64());
    }
    let left = |folder: &Path| -> Vec<String> {
        let entries = fs::read_dir(folder).unwrap();
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
    };
    assert_eq!(left(Path::new(&cache)).len(), 1, "one file of light paths: {:?}", left(Path::new(&cache)));
    assert_eq!(left(folder.path()).len(), at_once + 3, "pictures and the cache: {:?}", left(folder.path()));
}

#[test]
fn four_renders_at_once_make_the_same_bytes() {
    let small = "--size 40x30 --set quality.entry_points=4000 --set quality.gather_rays=64 --set quality.cache_points=500 --set quality.cells=8";
    many_at_once(4, true, &small.split(' ').collect::<Vec<_>>());
}

#[test]
#[ignore = "full size: make soak"]
fn eight_renders_at_once_at_the_papers_settings() {
    many_at_once(8, false, &["--preset", "paper"]);
}

/// Bytes of this process that are in memory.
fn resident_bytes() -> u64 {
    let pages = fs::read_to_string("/proc/self/statm").unwrap();
    4096 * pages.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap()
}

/// Undoes all edits.
fn go_home(renderer: &mut Renderer, home: &State) {
    while !renderer.scene().lights.is_empty() {
        renderer.remove_light(0).unwrap();
    }
    for (light, _) in &home.lights {
        renderer.add_light(light.clone()).unwrap();
    }
    for (index, material) in home.materials.iter().enumerate() {
        if material.editable {
            renderer.set_material(index, material.diffuse, material.specular, material.exponent).unwrap();
        } else {
            renderer.set_diffuse(index, material.diffuse).unwrap();
        }
    }
    renderer.move_camera(home.camera, Vec3::ZERO);
}

fn picture(renderer: &mut Renderer) -> Vec<u32> {
    renderer.frame().unwrap();
    let layers = [Layer::Direct, Layer::Indirect].map(|layer| renderer.layer(layer).unwrap());
    layers.iter().flat_map(|pixels| pixels.as_flattened()).map(|value| value.to_bits()).collect()
}

/// Edits and undoes, again and again: picture and memory stay the same. It runs without validation
/// layers, which allocate some hundred bytes for each edit. Round `n` makes the edits of round `n -
/// sequences`. `is_long_enough` gets the number of rounds so far and their time.
fn edit_for(sequences: u64, is_long_enough: impl Fn(usize, Duration) -> bool) {
    const EDITS: usize = 40;
    let context = Context::new(&ContextOptions::default()).unwrap();
    let mut built_in = scene(true);
    built_in.quality = TINY;
    let mut renderer = Renderer::new(&context, built_in, &mut Silent).unwrap();
    renderer.move_camera(renderer.scene().cameras[0].position, Vec3::ZERO);
    let home = State::from_renderer(&renderer);
    let expected = picture(&mut renderer);
    let started = Instant::now();
    let mut memory = Vec::new();
    for round in 0_u64.. {
        let mut state = State::from_renderer(&renderer);
        let mut dice = Dice::new(round % sequences);
        for _ in 0..EDITS {
            state.edit(&mut dice, &mut renderer);
            renderer.frame().unwrap();
        }
        go_home(&mut renderer, &home);
        assert!(picture(&mut renderer) == expected, "at home after {round} rounds of {EDITS} edits");
        memory.push([context.memory().current_bytes, resident_bytes()]);
        if is_long_enough(memory.len(), started.elapsed()) {
            break;
        }
    }
    // Lists grow to the longest of any view; that takes some rounds.
    let half = &memory[memory.len() / 2 - 1];
    let end = memory.last().unwrap();
    println!("{} edits; device and host bytes: {:?}, {half:?}, {end:?}", EDITS * memory.len(), memory[0]);
    assert!(memory.len() >= 4, "{} rounds", memory.len());
    for (half, end) in half.iter().zip(end) {
        assert!(
            *end as f64 <= 1.02 * *half as f64,
            "{half} bytes after half of the rounds, {end} at the end"
        );
    }
}

#[test]
fn edits_leave_memory_as_it_was() {
    // The second half repeats the first, so it needs no new pipeline and no longer list.
    edit_for(4, |rounds, _| rounds == 8);
}

#[test]
#[ignore = "an hour: make soak"]
fn an_hour_of_edits_leaves_memory_as_it_was() {
    let seconds = std::env::var("LIGHTPATHS_SOAK_SECONDS").map_or(3600, |text| text.parse().unwrap());
    edit_for(u64::MAX, |_, time| time > Duration::from_secs(seconds));
}
