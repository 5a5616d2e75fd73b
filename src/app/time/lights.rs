//! Frames against the number of lights: one of so many moves.

use std::collections::BTreeMap;

use glam::{DVec3, Vec3};

use super::measure::{self, Summary};
use crate::cpu::rays::intersect;
use crate::error::Result;
use crate::renderer::{FrameReport, Renderer, Work};
use crate::scene::{Light, LightKind, Scene};

/// Places that are tried for further lights.
const TRIES: usize = 2000;

/// What a frame takes in which one of some lights moves.
#[derive(Debug)]
pub(super) struct Relit {
    /// Device time, milliseconds.
    pub(super) device_ms: Summary,
    /// The same of a frame in which a light changes its colour.
    pub(super) colour_ms: Summary,
    /// Frames per second on the clock, the median.
    pub(super) fps: f64,
    /// Lights whose form factors and layers stood, as a share.
    pub(super) unchanged: f64,
}

/// Times frames for each number of lights, and leaves the scene's own lights behind.
pub(super) fn measure(
    renderer: &mut Renderer,
    counts: &[u32],
    frames: usize,
) -> Result<BTreeMap<u32, Relit>> {
    let own = renderer.scene().lights.clone();
    let mut timed = BTreeMap::new();
    for &count in counts {
        let lights = fitting(renderer.scene(), &own, count as usize);
        set(renderer, lights)?;
        renderer.frame()?;
        let (mut reports, mut recoloured) = (Vec::new(), Vec::new());
        for _ in 0..frames {
            reports.push(measure::frame(renderer, Work::Light(0))?);
            recoloured.push(measure::frame(renderer, Work::Colour)?);
        }
        let device = |report: &FrameReport| report.passes.iter().map(|pass| pass.ms).sum();
        let wall = Summary::of(reports.iter().map(|report| report.frame_ms)).median;
        let relit = Relit {
            device_ms: Summary::of(reports.iter().map(device)),
            colour_ms: Summary::of(recoloured.iter().map(device)),
            fps: 1000.0 / wall,
            unchanged: reports[0].lights_unchanged[0],
        };
        timed.insert(count, relit);
    }
    set(renderer, own)?;
    renderer.frame()?;
    Ok(timed)
}

/// So many lights: the scene's own, and then copies of them at other places that the camera sees, in open space. Their power
/// adds up to that of the scene's own.
fn fitting(scene: &Scene, own: &[Light], count: usize) -> Vec<Light> {
    let share = own.len() as f32 / count as f32;
    let mut places = open_places(scene);
    let light = |index: usize| {
        let Light { name, kind } = &own[index % own.len()];
        let kind: LightKind = kind.with_emission(share * kind.emission());
        match index < own.len() {
            true => Light { name: name.clone(), kind },
            false => Light {
                name: format!("{name} {index}"),
                kind: places.next().map_or(kind, |place| kind.moved_to(place)),
            },
        }
    };
    if own.is_empty() { Vec::new() } else { (0..count).map(light).collect() }
}

/// Places in the scene's bounds, evenly spread, that nothing hides from the camera.
fn open_places(scene: &Scene) -> impl Iterator<Item = Vec3> + '_ {
    let (low, high) = scene.bounds();
    let eye = scene.cameras[0].position;
    let candidates = (1..=TRIES).map(move |index| {
        // An additive recurrence on powers of the plastic number's generalisation to three dimensions.
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
