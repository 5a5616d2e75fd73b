//! A camera outside of a model.

use glam::Vec3;
use rayon::prelude::*;

use super::probe::{Hit, Probe, sphere};
use super::up::Up;
use crate::scene::Camera;

/// Vertical field of view, degrees.
const FOV_Y: f32 = 40.0;
/// The picture's half height in half heights of the model.
const MARGIN: f32 = 1.08;
/// Depth of the nearest point before the camera at least, in radii of the model: a model may be a
/// line that points at the camera.
const NEAR: f32 = 1e-3;
/// Rays along a side of a candidate's picture.
const SIDE: usize = 32;
/// Elevations of the candidates, degrees, with the factor of each one's score. Models are shown
/// slightly from above; from below only if nothing else shows a front.
const ELEVATIONS: [(f32, f32); 7] =
    [(0.0, 0.98), (12.0, 0.985), (25.0, 1.0), (45.0, 0.9), (65.0, 0.72), (85.0, 0.55), (-25.0, 0.4)];
const AZIMUTH_STEP: usize = 15;

/// A candidate camera.
pub(super) struct Outside {
    pub(super) camera: Camera,
    /// Fraction of what the camera sees that is fronts.
    pub(super) front_fraction: f32,
}

impl Outside {
    /// The camera that sees the largest area of fronts, with the area of backs subtracted.
    pub(super) fn best(probe: &Probe, up: Up) -> Self {
        let hull = hull(probe);
        let azimuths = (0..360).step_by(AZIMUTH_STEP).map(|azimuth| azimuth as f32);
        let candidates: Vec<_> = azimuths
            .flat_map(|azimuth| ELEVATIONS.map(|(elevation, factor)| (azimuth, elevation, factor)))
            .collect();
        let scored = candidates.into_par_iter().map(|(azimuth, elevation, factor)| {
            let camera = framing(&hull, up.direction(azimuth, elevation), up);
            let (score, front_fraction) = seen(&probe.picture(&camera, SIDE));
            let factor = factor * aspect(azimuth, elevation);
            // A negative score must become worse, too.
            let score = if score > 0.0 { score * factor } else { score / factor };
            (score, Self { camera, front_fraction })
        });
        let scored: Vec<_> = scored.collect();
        let best = scored.into_iter().reduce(|best, other| if other.0 > best.0 { other } else { best });
        best.expect("there are candidates").1
    }
}

/// The factor of a direction's score: three quarters of a model from its front right decide between
/// equal views, and a plan is drawn from its front.
fn aspect(azimuth: f32, elevation: f32) -> f32 {
    let from = |middle: f32| (azimuth - middle).to_radians().cos();
    if elevation > 80.0 {
        return 1.0 + 0.05 * from(0.0);
    }
    let is_oblique = (25.0..=65.0).contains(&(azimuth % 90.0));
    (if is_oblique { 1.04 } else { 1.0 }) * (1.0 + 0.05 * from(30.0))
}

/// Area of fronts minus area of backs, and the fraction of fronts.
fn seen(picture: &[Option<Hit>]) -> (f32, f32) {
    let (mut fronts, mut backs) = (0.0, 0.0);
    for hit in picture.iter().flatten() {
        // The geometric mean of the surface's area and of its projection: a cube shows most
        // towards a corner, a plate towards its face, an open box towards its inside.
        let area = hit.distance * hit.distance / hit.cosine.max(0.1).sqrt();
        *if hit.is_front { &mut fronts } else { &mut backs } += area;
    }
    (fronts - backs, fronts / (fronts + backs).max(f32::MIN_POSITIVE))
}

/// The outermost corners in directions all around.
fn hull(probe: &Probe) -> Vec<Vec3> {
    const DIRECTIONS: usize = 128;
    let directions: Vec<Vec3> = sphere(DIRECTIONS).collect();
    let outermost = directions.par_iter().map(|direction| {
        let points = probe.triangles.iter().flat_map(|triangle| triangle.positions);
        points.fold((f32::NEG_INFINITY, Vec3::ZERO), |best, point| {
            let along = point.dot(*direction);
            if along > best.0 { (along, point) } else { best }
        })
    });
    outermost.map(|(_, point)| point).collect()
}

/// The camera in a direction from the model whose picture the points just fill.
fn framing(points: &[Vec3], direction: Vec3, up: Up) -> Camera {
    let tan = (0.5 * FOV_Y).to_radians().tan() / MARGIN;
    let mut camera = up.camera(direction, Vec3::ZERO, FOV_Y);
    let [right, above, _] = camera.frame();
    let (mut middle, mut distance) = (Vec3::ZERO, 0.0);
    // Moving the middle changes the perspective, which converges within a few steps.
    for _ in 0..4 {
        let moved: Vec<(Vec3, f32)> =
            points.iter().map(|&point| (point - middle, (point - middle).dot(direction))).collect();
        distance = moved.iter().fold(1e-3_f32, |distance, (p, depth)| {
            distance.max(depth + (p.dot(right).abs().max(p.dot(above).abs()) / tan).max(NEAR))
        });
        for axis in [right, above] {
            let angles = moved.iter().map(|(p, depth)| p.dot(axis) / (distance - depth));
            let (low, high) =
                angles.fold((f32::INFINITY, f32::NEG_INFINITY), |(low, high), a| (low.min(a), high.max(a)));
            middle += 0.5 * (low + high) * distance * axis;
        }
    }
    (camera.position, camera.target) = (middle + distance * direction, middle);
    camera
}
