//! Moving the camera by hand.

use glam::{DMat3, DVec3, Vec2, Vec3};

use crate::scene::Camera;

/// Smallest angle between the view and straight up or down, radians.
const POLE: f64 = std::f64::consts::PI / 180.0;
/// Speed factor while the key for fast movement is held.
const FAST: f32 = 4.0;
/// Longest time step that moves the camera, seconds: a stall causes no leap.
const LONGEST_STEP: f32 = 0.1;
/// Fraction of the picture that a framed box fills.
const FILL: f32 = 0.94;

/// Turns the camera about `pivot`, in radians to the right and down. The pivot keeps its position
/// in the picture. Objects before the pivot follow a pointer that moves by `turn`.
pub(super) fn orbit(camera: &mut Camera, pivot: Vec3, turn: Vec2) {
    let Some([from, to]) = turned(camera, turn) else { return };
    let pivot = pivot.as_dvec3();
    let position = pivot + to * (from.transpose() * (camera.position.as_dvec3() - pivot));
    if position.is_finite() {
        place(camera, position, to.z_axis * distance(camera));
    }
}

/// Turns the view about the camera's position, in radians to the right and down.
pub(super) fn look(camera: &mut Camera, turn: Vec2) {
    let Some([_, to]) = turned(camera, turn) else { return };
    place(camera, camera.position.as_dvec3(), to.z_axis * distance(camera));
}

/// Moves the camera in the picture's plane. Objects at `depth`, metres, follow a pointer that
/// moves by `shift`, in pixels to the right and down. `viewport_height` is the picture's
/// height in pixels.
pub(super) fn pan(camera: &mut Camera, shift: Vec2, viewport_height: f32, depth: f32) {
    let half_height = (0.5 * camera.fov_y_degrees.to_radians()).tan();
    let metres = shift * (2.0 * half_height * depth / viewport_height.max(1.0));
    fly(camera, Vec3::new(-metres.x, metres.y, 0.0));
}

/// Multiplies the distance to a point by `factor`; the point keeps its position in the picture. The
/// distance stays between 1/1000 and 100 times `scene_size`, metres. The target stays 1/100 of it
/// ahead: nearer, f32 coordinates lose the direction.
pub(super) fn dolly(camera: &mut Camera, towards: Vec3, factor: f32, scene_size: f32) {
    let size = f64::from(scene_size.max(f32::MIN_POSITIVE));
    let (least, most) = (1e-3 * size, 100.0 * size);
    let (position, point, factor) = (camera.position.as_dvec3(), towards.as_dvec3(), f64::from(factor));
    let forward = frame(camera).z_axis;
    let before = position.distance(point);
    // A camera outside the bounds can approach, but does not leap.
    let after = if factor > 1.0 {
        (before.max(least) * factor).min(before.max(most))
    } else {
        (before * factor).max(before.min(least))
    };
    let away = (position - point).try_normalize().unwrap_or(-forward);
    let ratio = if before > 0.0 { after / before } else { 1.0 };
    let ahead = (distance(camera) * ratio).clamp(1e-2 * size, most);
    if factor.is_finite() && away.is_finite() {
        place(camera, point + away * after, forward * ahead);
    }
}

/// Moves the camera and its target, in metres along the picture's right, up and forward.
pub(super) fn fly(camera: &mut Camera, step: Vec3) {
    let way = frame(camera) * step.as_dvec3();
    if way.is_finite() {
        let ahead = camera.target.as_dvec3() - camera.position.as_dvec3();
        place(camera, camera.position.as_dvec3() + way, ahead);
    }
}

/// Frames a box without a change of the viewing direction.
pub(super) fn frame_box(camera: &mut Camera, low: Vec3, high: Vec3) {
    let (middle, half) = (0.5 * (low + high), 0.5 * (high - low).abs());
    if !middle.is_finite() || !half.is_finite() {
        return;
    }
    let half_height = f64::from(FILL * (0.5 * camera.fov_y_degrees.to_radians()).tan());
    let half_width = half_height * f64::from(camera.size[0]) / f64::from(camera.size[1]);
    let frame = frame(camera);
    let needed = (0..8).map(|corner| {
        let sign = |axis: u32| if corner >> axis & 1 == 0 { -1.0 } else { 1.0 };
        let corner = frame.transpose() * (half * Vec3::new(sign(0), sign(1), sign(2))).as_dvec3();
        (corner.x.abs() / half_width).max(corner.y.abs() / half_height) - corner.z
    });
    let mut ahead = needed.fold(0.0, f64::max);
    if half == Vec3::ZERO {
        ahead = distance(camera);
    }
    place(camera, middle.as_dvec3() - frame.z_axis * ahead, frame.z_axis * ahead);
}

/// The camera keys that are held.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Held {
    pub(super) forward: bool,
    pub(super) back: bool,
    pub(super) left: bool,
    pub(super) right: bool,
    pub(super) up: bool,
    pub(super) down: bool,
    /// Moves [`FAST`] times as fast.
    pub(super) fast: bool,
}

impl Held {
    /// The camera's movement in that time, as [`fly`] takes it. Diagonals are as fast as axes.
    pub(super) fn step(&self, seconds: f32, speed_m_s: f32) -> Vec3 {
        let along = |ahead: bool, behind: bool| f32::from(i8::from(ahead) - i8::from(behind));
        let way = Vec3::new(
            along(self.right, self.left),
            along(self.up, self.down),
            along(self.forward, self.back),
        );
        let speed = if self.fast { FAST * speed_m_s } else { speed_m_s };
        way.normalize_or_zero() * speed * seconds.clamp(0.0, LONGEST_STEP)
    }
}

/// Metres from the camera to its target.
fn distance(camera: &Camera) -> f64 {
    camera.position.as_dvec3().distance(camera.target.as_dvec3())
}

/// Unit up direction of the camera.
fn up(camera: &Camera) -> DVec3 {
    camera.up.as_dvec3().normalize_or(DVec3::Y)
}

/// Columns right, up and forward, as in [`Camera::frame`]. An arbitrary frame if that
/// one is degenerate.
fn frame(camera: &Camera) -> DMat3 {
    let up = up(camera);
    let ahead = camera.target.as_dvec3() - camera.position.as_dvec3();
    let forward = ahead.normalize_or(up.any_orthonormal_vector());
    let right = forward.cross(up);
    let right = if right.length() > 1e-9 { right.normalize() } else { forward.any_orthonormal_vector() };
    DMat3::from_cols(right, right.cross(forward), forward)
}

/// The frames before and after a turn of the view, in radians to the right and down. `None` if the
/// turn is zero or not finite.
fn turned(camera: &Camera, turn: Vec2) -> Option<[DMat3; 2]> {
    if !turn.is_finite() || turn == Vec2::ZERO {
        return None;
    }
    let (up, from) = (up(camera), frame(camera));
    let (right, heading) = (from.x_axis, up.cross(from.x_axis));
    let (sin, cos) = f64::from(turn.x).sin_cos();
    let heading = (cos * heading + sin * right).normalize();
    let polar = from.z_axis.cross(up).length().atan2(from.z_axis.dot(up)) + f64::from(turn.y);
    let (sin, cos) = polar.clamp(POLE, std::f64::consts::PI - POLE).sin_cos();
    let (right, forward) = (heading.cross(up), cos * up + sin * heading);
    Some([from, DMat3::from_cols(right, right.cross(forward), forward)])
}

/// A single rounding: small steps do not add up to a drift.
fn place(camera: &mut Camera, position: DVec3, ahead: DVec3) {
    camera.position = position.as_vec3();
    camera.target = (position + ahead).as_vec3();
}

#[cfg(test)]
pub(super) mod tests {
    use super::super::gizmos::Projection;
    use super::*;
    use crate::cpu::sampling::sample_3d;

    pub(in crate::app::demo) fn camera() -> Camera {
        Camera {
            name: "camera".into(),
            position: Vec3::new(3.0, 2.0, 5.0),
            target: Vec3::new(0.5, 1.0, -1.0),
            up: Vec3::Y,
            fov_y_degrees: 50.0,
            size: [800, 600],
        }
    }

    fn seen(camera: &Camera, point: Vec3) -> Vec2 {
        Projection::new(camera, Vec2::ZERO, Vec2::new(800.0, 600.0)).project(point).unwrap().0
    }

    /// Degrees between the view and the nearer pole.
    fn from_pole(camera: &Camera) -> f32 {
        let ahead = (camera.target - camera.position).as_dvec3();
        let angle = ahead.angle_between(camera.up.as_dvec3()).to_degrees() as f32;
        angle.min(180.0 - angle)
    }

    #[test]
    fn orbits_do_not_drift() {
        let (start, pivot) = (camera(), Vec3::new(1.0, 0.5, 0.2));
        let mut camera = start.clone();
        for i in 0..4000 {
            let turn = sample_3d(i, 7).truncate() - Vec2::new(0.47, 0.5);
            orbit(&mut camera, pivot, 0.02 * turn);
        }
        assert!(camera.position.distance(start.position) > 0.1);
        let distances = [&start, &camera].map(|camera| camera.position.distance(pivot));
        assert!((distances[0] - distances[1]).abs() < 2e-5 * distances[0], "{distances:?}");
        let lengths = [&start, &camera].map(|camera| camera.position.distance(camera.target));
        assert!((lengths[0] - lengths[1]).abs() < 2e-5 * lengths[0], "{lengths:?}");
        assert!(seen(&start, pivot).distance(seen(&camera, pivot)) < 0.02);
    }

    #[test]
    fn orbits_follow_the_pointer() {
        let pivot = Vec3::new(0.5, 1.0, -1.0);
        let [_, _, forward] = camera().frame();
        // In front of the pivot, which is in the picture's centre.
        let near = pivot - forward;
        for (turn, way) in [(Vec2::X, Vec2::X), (Vec2::Y, Vec2::Y), (Vec2::NEG_X, Vec2::NEG_X)] {
            let mut camera = camera();
            orbit(&mut camera, pivot, 0.05 * turn);
            let moved = seen(&camera, near) - Vec2::new(400.0, 300.0);
            assert!(moved.normalize().dot(way) > 0.999, "{turn}: {moved}");
            assert!(seen(&camera, pivot).distance(Vec2::new(400.0, 300.0)) < 0.01);
        }
    }

    #[test]
    fn a_turn_is_as_large_as_asked() {
        let mut camera = camera();
        let [_, _, before] = camera.frame();
        look(&mut camera, Vec2::new(0.0, 0.25));
        let [_, _, after] = camera.frame();
        assert!((before.angle_between(after) - 0.25).abs() < 1e-5);
        assert!(after.y < before.y && camera.position == Vec3::new(3.0, 2.0, 5.0));
        camera.target = camera.position - Vec3::Z;
        look(&mut camera, Vec2::new(0.25, 0.0));
        let turned = Vec3::new(0.25f32.sin(), 0.0, -0.25f32.cos());
        assert!((camera.target - camera.position).distance(turned) < 1e-6);
    }

    #[test]
    fn views_keep_off_the_poles() {
        for up in [Vec3::Y, Vec3::new(0.0, 0.0, -3.0), Vec3::new(1.0, 2.0, -0.5)] {
            for turn in [0.003f32, 0.4, 3.0, 1e9] {
                for turn in [Vec2::new(0.1, turn), Vec2::new(0.1, -turn)] {
                    let mut cameras = [Camera { up, ..camera() }, Camera { up, ..camera() }];
                    for _ in 0..1200 {
                        orbit(&mut cameras[0], Vec3::ONE, turn);
                        look(&mut cameras[1], turn);
                        assert!(cameras.iter().all(|camera| from_pole(camera) > 0.99));
                        assert!(cameras.iter().flat_map(Camera::frame).all(Vec3::is_finite));
                    }
                    assert!(cameras.iter().all(|camera| from_pole(camera) < 1.01));
                }
            }
        }
        // A camera that looks straight down is moved off the pole.
        let mut camera = Camera { position: Vec3::Y, target: Vec3::ZERO, ..camera() };
        look(&mut camera, Vec2::splat(1e-6));
        assert!((from_pole(&camera) - 1.0).abs() < 0.01);
        let before = camera.clone();
        orbit(&mut camera, Vec3::NAN, Vec2::ONE);
        look(&mut camera, Vec2::new(f32::NAN, 0.0));
        assert_eq!(camera, before);
    }

    #[test]
    fn what_is_panned_stays_under_the_pointer() {
        for i in 0..100 {
            let mut camera = camera();
            let [a, b] = [sample_3d(i, 1), sample_3d(i, 2)];
            let projection = Projection::new(&camera, Vec2::ZERO, Vec2::new(800.0, 600.0));
            let (origin, way) = projection.ray(a.truncate() * Vec2::new(800.0, 600.0));
            let point = origin + way * (0.5 + 20.0 * a.z);
            let (from, depth) = projection.project(point).unwrap();
            let shift = (b.truncate() - 0.5) * 400.0;
            pan(&mut camera, shift, 600.0, depth);
            assert!(seen(&camera, point).distance(from + shift) < 0.02);
            assert!((from_pole(&camera) - from_pole(&self::camera())).abs() < 1e-3);
        }
    }

    #[test]
    fn dollies_approach_but_never_arrive() {
        let (start, point) = (camera(), Vec3::new(1.0, 1.5, -0.5));
        let mut camera = start.clone();
        dolly(&mut camera, point, 0.5, 10.0);
        let distances = [&start, &camera].map(|camera| camera.position.distance(point));
        assert!((distances[0] - 2.0 * distances[1]).abs() < 1e-5);
        assert!(seen(&start, point).distance(seen(&camera, point)) < 0.01);
        for _ in 0..500 {
            dolly(&mut camera, point, 0.8, 10.0);
        }
        assert!((camera.position.distance(point) - 0.01).abs() < 1e-4);
        assert!(camera.frame()[2].distance(start.frame()[2]) < 1e-3);
        for factor in [-1.0, 0.0, f32::NAN, f32::INFINITY] {
            dolly(&mut camera, point, factor, 10.0);
            assert!(camera.position.distance(point) > 9e-3);
        }
        for _ in 0..500 {
            dolly(&mut camera, point, 1.25, 10.0);
        }
        assert!((camera.position.distance(point) - 1000.0).abs() < 0.1);
        let mut camera = Camera { position: point, ..start };
        dolly(&mut camera, point, 2.0, 10.0);
        assert!(camera.position.distance(point) > 0.01 && camera.frame()[0].is_finite());
    }

    #[test]
    fn keys_fly_along_the_picture() {
        let held = Held { forward: true, right: true, ..Held::default() };
        assert!((held.step(0.05, 3.0).length() - 0.15).abs() < 1e-6);
        assert_eq!(Held { back: true, ..held }.step(0.05, 3.0), Vec3::new(0.15, 0.0, 0.0));
        assert_eq!(
            Held { up: true, fast: true, ..Held::default() }.step(0.05, 1.0),
            Vec3::new(0.0, 0.2, 0.0)
        );
        assert_eq!(Held { down: true, ..Held::default() }.step(60.0, 1.0), Vec3::new(0.0, -0.1, 0.0));
        assert_eq!(Held { left: true, right: true, ..Held::default() }.step(0.05, 3.0), Vec3::ZERO);
        let mut camera = camera();
        let ([right, up, forward], from) = (camera.frame(), camera.clone());
        fly(&mut camera, Vec3::new(1.0, 2.0, 3.0));
        let way = right + 2.0 * up + 3.0 * forward;
        assert!((camera.position - from.position).distance(way) < 1e-5);
        assert!((camera.target - from.target).distance(way) < 1e-5);
    }

    #[test]
    fn a_framed_box_fills_the_picture() {
        for i in 0..200 {
            let mut camera = camera();
            look(&mut camera, 6.0 * (sample_3d(i, 3).truncate() - 0.5));
            camera.fov_y_degrees = 5.0 + 140.0 * sample_3d(i, 4).x;
            let [low, size] = [20.0 * sample_3d(i, 5) - 10.0, sample_3d(i, 6) + 0.1];
            let before = camera.frame()[2];
            frame_box(&mut camera, low, low + size);
            assert!(camera.frame()[2].distance(before) < 1e-3);
            let corners = (0..8).map(|corner| {
                let pick = Vec3::new((corner & 1) as f32, (corner >> 1 & 1) as f32, (corner >> 2) as f32);
                let place = (seen(&camera, low + size * pick) / Vec2::new(400.0, 300.0) - 1.0).abs();
                place.max_element()
            });
            let widest = corners.fold(0.0, f32::max);
            assert!((widest - FILL).abs() < 2e-3, "{widest}");
        }
        let mut camera = camera();
        frame_box(&mut camera, Vec3::ONE, Vec3::ONE);
        assert!(camera.target == Vec3::ONE && camera.frame()[0].is_finite());
        frame_box(&mut camera, Vec3::splat(f32::INFINITY), Vec3::NEG_INFINITY);
        assert_eq!(camera.target, Vec3::ONE);
    }
}
