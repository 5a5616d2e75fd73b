//! Frame time against the number of lights, of which one moves.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};

use super::measure::Summary;
use crate::cpu::rays::intersect;
use crate::error::Result;
use crate::renderer::{FrameReport, Renderer, Work};
use crate::scene::{Light, Scene};

/// Candidate positions for further lights.
const TRIES: usize = 2000;

/// Frame times with several lights, of which one moves.
#[derive(Debug)]
pub(super) struct Relit {
    /// Device time, milliseconds.
    pub(super) device_ms: Summary,
    /// Device time of a frame in which a light changes its colour.
    pub(super) colour_ms: Summary,
    /// Cost relative to the first number of lights in the same round.
    pub(super) ratio: Summary,
    /// Cost of a colour change relative to a move in the same round.
    pub(super) colour_ratio: Summary,
    /// Frames per second by wall clock, median.
    pub(super) fps: f64,
    /// Fraction of lights whose form factors and irradiance buffers were reused.
    pub(super) unchanged: f64,
}

/// Frames of one number of lights, one per round.
#[derive(Default)]
struct Frames {
    moved: Vec<FrameReport>,
    recoloured: Vec<FrameReport>,
    /// Costs in an arbitrary unit: see [`costed`].
    costs: Vec<[f64; 2]>,
}

/// Times frames for each number of lights; the scene's own lights remain at the end. Each round
/// covers all numbers, so that clock drift affects all alike. Ratios are taken within a round.
pub(super) fn measure(
    renderer: &mut Renderer,
    counts: &[u32],
    frames: usize,
    is_cpu: bool,
) -> Result<BTreeMap<u32, Relit>> {
    let own = renderer.scene().lights.clone();
    let most = counts.iter().copied().max().unwrap_or(0);
    set(renderer, fitting(renderer.scene(), &own, most as usize))?;
    let mut found: Vec<Frames> = counts.iter().map(|_| Frames::default()).collect();
    // One round more than requested: the first round traces all lights.
    for round in 0..=frames {
        for (&count, found) in counts.iter().zip(&mut found) {
            for light in 0..renderer.scene().lights.len() {
                renderer.switch_light(light, light < count as usize)?;
            }
            renderer.frame()?;
            let [(moved, cost), (recoloured, colour_cost)] =
                [costed(renderer, Work::Light(0), is_cpu)?, costed(renderer, Work::Colour, is_cpu)?];
            if round > 0 {
                found.moved.push(moved);
                found.recoloured.push(recoloured);
                found.costs.push([cost, colour_cost]);
            }
        }
    }
    let mut timed = BTreeMap::new();
    for (&count, frames) in counts.iter().zip(&found) {
        let wall = Summary::from_times(frames.moved.iter().map(|report| report.frame_ms)).median;
        let first = found[0].costs.iter().map(|costs| costs[0]);
        let relit = Relit {
            device_ms: Summary::from_times(frames.moved.iter().map(device_ms)),
            colour_ms: Summary::from_times(frames.recoloured.iter().map(device_ms)),
            ratio: Summary::from_times(frames.costs.iter().zip(first).map(|(costs, first)| costs[0] / first)),
            colour_ratio: Summary::from_times(frames.costs.iter().map(|costs| costs[1] / costs[0])),
            fps: 1000.0 / wall,
            unchanged: frames.moved[0].lights_unchanged[0],
        };
        timed.insert(count, relit);
    }
    let lit: Vec<bool> = own.iter().map(|light| light.is_on).collect();
    set(renderer, own)?;
    for (light, is_on) in lit.into_iter().enumerate() {
        renderer.switch_light(light, is_on)?;
    }
    renderer.frame()?;
    Ok(timed)
}

fn device_ms(report: &FrameReport) -> f64 {
    report.passes.iter().map(|pass| pass.ms).sum()
}

/// Renders a frame with that work, and returns its cost. On a CPU device the cost is processor
/// time, which other processes do not affect; else device time.
fn costed(renderer: &mut Renderer, work: Work, is_cpu: bool) -> Result<(FrameReport, f64)> {
    renderer.force(work);
    let before = processor_ms();
    let report = renderer.frame()?;
    let taken = before.zip(processor_ms()).map(|(before, after)| after - before);
    let device = device_ms(&report);
    Ok((report, taken.filter(|&ms| is_cpu && ms > 0.0).unwrap_or(device)))
}

/// Running time of all threads of this process, milliseconds. `None` if the system does
/// not report it.
fn processor_ms() -> Option<f64> {
    let mut nanoseconds = 0;
    for task in std::fs::read_dir("/proc/self/task").ok()? {
        // A thread that has ended meanwhile is skipped.
        let Ok(text) = std::fs::read_to_string(task.ok()?.path().join("schedstat")) else { continue };
        nanoseconds += text.split(' ').next()?.parse::<u64>().ok()?;
    }
    Some(nanoseconds as f64 / 1e6)
}

/// `count` lights: the scene's own, then copies at other visible positions in free space. Their
/// total power equals that of the scene's own lights.
pub(in crate::app) fn fitting(scene: &Scene, own: &[Light], count: usize) -> Vec<Light> {
    let fraction = own.len() as f32 / count as f32;
    let mut places = open_enclosures(scene);
    let light = |index: usize| {
        let mut light = Light { is_on: true, ..own[index % own.len()].clone() };
        light.kind = light.kind.with_emission(fraction * light.kind.emission());
        if index >= own.len() {
            light.name = format!("{} {index}", light.name);
            light.kind = places.next().map_or(light.kind, |place| light.kind.moved_to(place));
        }
        light
    };
    if own.is_empty() { Vec::new() } else { (0..count).map(light).collect() }
}

/// Evenly spread positions in the scene's bounds that are visible from the camera.
fn open_enclosures(scene: &Scene) -> impl Iterator<Item = Vec3> + '_ {
    let (low, high) = scene.bounds();
    let eye = scene.cameras[0].position;
    let candidates = (1..=TRIES).map(move |index| {
        // An additive recurrence on powers of the plastic number, generalised to three dimensions.
        let place =
            [1.0, 2.0, 3.0].map(|power| (index as f64 * 1.220_744_084_605_759_5_f64.powf(-power)).fract());
        low + (high - low) * (0.05 + 0.9 * DVec3::from(place)).as_vec3()
    });
    candidates.filter(move |&place| {
        let ray = (place - eye).as_dvec3();
        let corners = scene.triangles.iter().map(|triangle| triangle.positions);
        !corners.filter_map(|corners| intersect(corners, eye.as_dvec3(), ray)).any(|(t, _)| t < 1.0)
    })
}

/// Replaces the renderer's lights.
fn set(renderer: &mut Renderer, lights: Vec<Light>) -> Result<()> {
    while renderer.scene().lights.len() > lights.len() {
        renderer.remove_light(renderer.scene().lights.len() - 1)?;
    }
    for (index, light) in lights.into_iter().enumerate() {
        if index < renderer.scene().lights.len() {
            renderer.set_light(index, light.kind)?;
        } else {
            renderer.add_light(light)?;
        }
    }
    Ok(())
}
