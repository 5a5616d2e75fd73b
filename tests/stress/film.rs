//! Films neither flicker nor pop: the value of a pixel changes smoothly.

use crate::common::{assert_silent, context};
use crate::determinism::bits;
use crate::{FEW, SMALL, prepare};
use lightpaths::renderer::{Layer, Renderer};
use lightpaths::scene::film::Film;
use lightpaths::scene::{LoadOptions, Scene};

/// Frames per second. At this rate, motion between frames is below a pixel, and any jump
/// is an error.
const FPS: f64 = 384.0;

/// Frames in a row.
const FRAMES: u32 = 5;

/// The built-in film of the Box at this rate.
fn film() -> (Film, Scene) {
    let text = include_str!("../../assets/films/box.toml").replace("fps = 24", &format!("fps = {FPS}"));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("box.toml");
    std::fs::write(&path, text).unwrap();
    Film::load(path.to_str().unwrap(), &LoadOptions { size: Some([48, 48]), ..LoadOptions::default() })
        .unwrap()
}

/// Displayed brightness of radiance, 0..=1 and above.
fn shown(renderer: &Renderer) -> Vec<f32> {
    let pixels = renderer.layer(Layer::Beauty).unwrap();
    pixels.as_flattened().iter().map(|value| value.powf(1.0 / 2.2)).collect()
}

/// Second differences of pixel values from this time on: quantiles at 0.9 and 0.999,
/// and the maximum.
fn second_differences(renderer: &mut Renderer, film: &Film, seconds: f64) -> [f32; 3] {
    let first = (seconds * FPS) as u32;
    let frames: Vec<Vec<f32>> = (first..first + FRAMES)
        .map(|frame| {
            renderer.set_state(&film.state(frame)).unwrap();
            renderer.frame().unwrap();
            shown(renderer)
        })
        .collect();
    let mut jumps: Vec<f32> = frames
        .windows(3)
        .flat_map(|three| {
            let values = three[0].iter().zip(&three[1]).zip(&three[2]);
            values.map(|((a, b), c)| (a - 2.0 * b + c).abs())
        })
        .collect();
    jumps.sort_by(f32::total_cmp);
    assert!(frames.first() != frames.last(), "at {seconds} s, so that there is something to see");
    [0.9, 0.999, 1.0].map(|fraction| jumps[(fraction * (jumps.len() - 1) as f64) as usize])
}

#[test]
fn pixels_of_consecutive_frames_go_on_as_they_went() {
    let (film, scene) = film();
    let mut renderer = prepare(scene, SMALL);
    // While the camera moves, edges cross pixels in steps of their samples. While a light moves,
    // single pixels start or stop being averaged over their area.
    for (what, seconds, most) in [
        ("the camera walks", 4.2, [1e-3, 0.1, 0.5]),
        ("a wall changes its colour", 11.0, [1e-5, 1e-4, 1e-3]),
        ("the teapot becomes glossy", 13.7, [1e-5, 1e-4, 1e-3]),
        ("the camera walks around the gloss", 18.2, [1e-2, 0.25, 0.6]),
        ("the point light moves", 24.0, [1e-4, 2e-3, 0.02]),
        ("the panel comes", 29.6, [1e-5, 1e-4, 1e-3]),
        ("the point light goes", 32.3, [1e-5, 1e-4, 1e-3]),
        ("the panel turns", 34.8, [1e-4, 2e-3, 0.02]),
        ("the panel moves", 37.5, [1e-5, 1e-4, 0.02]),
    ] {
        let found = second_differences(&mut renderer, &film, seconds);
        println!("{what}: second differences {found:?}");
        assert!(found.iter().zip(most).all(|(found, most)| *found <= most), "{what}: {found:?}, {most:?}");
    }
    // Without edge samples, shadow edges do not hide a step of an area light, for surface near the
    // light or hidden from it.
    renderer.set_edge_samples(0).unwrap();
    let found = second_differences(&mut renderer, &film, 37.5);
    println!("a panel without edges: second differences {found:?}");
    assert!(found[2] <= 1e-4, "{found:?}");
    assert_silent(&context());
}

#[test]
fn a_frame_is_the_same_whatever_was_rendered_before() {
    let (film, scene) = film();
    let frames = [1500, 9300, 14_500];
    let mut forwards = prepare(scene.clone(), FEW);
    let render = |renderer: &mut Renderer, frame: u32| {
        renderer.set_state(&film.state(frame)).unwrap();
        renderer.frame().unwrap();
        bits(renderer)
    };
    let all = frames.map(|frame| render(&mut forwards, frame));
    for (frame, expected) in frames.into_iter().zip(&all).rev().step_by(2) {
        let mut cold = prepare(scene.clone(), FEW);
        assert!(render(&mut cold, frame) == *expected, "frame {frame}");
    }
    assert!(all.windows(2).all(|pair| pair[0] != pair[1]));
    assert_silent(&context());
}
