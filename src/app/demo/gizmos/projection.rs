//! Projection between the scene and the picture on the screen.

use glam::{Vec2, Vec3};

use crate::scene::Camera;
use crate::types::View;

/// Nearest depth with a position in the picture, metres.
const NEAREST: f32 = 1e-6;
/// Lines are clipped at this fraction of the depth of their farther end.
const NEAR_SHARE: f32 = 1e-3;
/// Rays are distinguished up to this distance from the picture, in half pictures.
const FARTHEST: f32 = 1e4;

/// A camera and its picture's rectangle on the screen: y down, points.
#[derive(Clone, Copy, Debug)]
pub(in crate::app::demo) struct Projection {
    view: View,
    /// Upper left corner of the picture, points.
    min: Vec2,
    /// Size of the picture, points; at least 1.
    size: Vec2,
}

impl Projection {
    /// The projection of a picture with its upper left corner at `min`.
    pub(in crate::app::demo) fn new(camera: &Camera, min: Vec2, size: Vec2) -> Self {
        Self { view: View::from(camera), min, size: size.max(Vec2::ONE) }
    }

    /// Centre of projection.
    pub(in crate::app::demo) fn eye(&self) -> Vec3 {
        self.view.position
    }

    /// Unit viewing direction.
    pub(in crate::app::demo) fn forward(&self) -> Vec3 {
        self.view.forward
    }

    /// Screen position of a point, and its depth along the viewing direction, metres. `None` if the
    /// point is behind the camera.
    pub(in crate::app::demo) fn project(&self, point: Vec3) -> Option<(Vec2, f32)> {
        let View { position, right, up, forward, .. } = self.view;
        let away = point - position;
        let depth = away.dot(forward);
        let place = Vec2::new(away.dot(right) / right.length_squared(), -away.dot(up) / up.length_squared());
        let seen = self.min + 0.5 * self.size * (1.0 + place / depth);
        (depth > NEAREST && seen.is_finite()).then_some((seen, depth))
    }

    /// Origin and unit direction of the ray through a screen position.
    pub(in crate::app::demo) fn ray(&self, seen: Vec2) -> (Vec3, Vec3) {
        let View { position, right, up, forward, .. } = self.view;
        let place = 2.0 * (seen - self.min) / self.size - 1.0;
        let place = place.clamp(Vec2::splat(-FARTHEST), Vec2::splat(FARTHEST));
        (position, (forward + place.x * right - place.y * up).normalize())
    }

    /// The pixel at a screen position, for a picture of that size.
    pub(in crate::app::demo) fn pixel(&self, seen: Vec2, size: [u32; 2]) -> [u32; 2] {
        let place = (seen - self.min) / self.size * Vec2::new(size[0] as f32, size[1] as f32);
        // The conversion clamps to the integer range, and pixels outside the picture move
        // to its rim.
        [(place.x as u32).min(size[0] - 1), (place.y as u32).min(size[1] - 1)]
    }

    /// Metres that one point on the screen covers at a depth.
    pub(in crate::app::demo) fn metres_per_point(&self, depth: f32) -> f32 {
        2.0 * self.view.up.length() * depth / self.size.y
    }

    /// Screen positions of a line's ends, clipped behind the camera. `None` if the whole line
    /// is behind it.
    pub(in crate::app::demo) fn segment(&self, a: Vec3, b: Vec3) -> Option<[Vec2; 2]> {
        let depth = |point: Vec3| (point - self.view.position).dot(self.view.forward);
        let depths = [depth(a), depth(b)];
        // The clip depth is relative because scenes have any size.
        let near = (NEAR_SHARE * depths[0].max(depths[1])).max(2.0 * NEAREST);
        let clipped = |end: usize| {
            let ([from, to], [d, other]) =
                if end == 0 { ([a, b], depths) } else { ([b, a], [depths[1], depths[0]]) };
            if d >= near {
                return self.project(from);
            }
            (other > near).then(|| self.project(from.lerp(to, (near - d) / (other - d))))?
        };
        Some([clipped(0)?.0, clipped(1)?.0])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::demo::navigate;
    use crate::cpu::sampling::sample_3d;

    /// A camera that leans, for a picture twice as wide as high.
    fn camera() -> Camera {
        Camera { up: Vec3::new(0.1, 2.0, 0.3), size: [1200, 600], ..navigate::tests::camera() }
    }

    const MIN: Vec2 = Vec2::new(30.0, 50.0);
    const SIZE: Vec2 = Vec2::new(600.0, 300.0);

    #[test]
    fn rays_are_those_of_the_renderer() {
        let (projection, view) = (Projection::new(&camera(), MIN, SIZE), View::from(&camera()));
        for i in 0..500 {
            let sample = 2.0 * sample_3d(i, 1) - 1.0;
            let way = (view.forward + sample.x * view.right - sample.y * view.up).normalize();
            let seen = MIN + 0.5 * SIZE * (1.0 + sample.truncate());
            let (origin, direction) = projection.ray(seen);
            assert!(origin == view.position && direction.distance(way) < 1e-6);
            let (back, depth) = projection.project(origin + direction * (2.0 + sample.z)).unwrap();
            assert!(back.distance(seen) < 1e-3, "{back} {seen}");
            assert!((depth - (2.0 + sample.z) * way.dot(view.forward)).abs() < 1e-5);
            assert!(projection.project(origin - direction).is_none());
        }
        let corner = projection.ray(MIN).1;
        assert!(corner.dot(view.right) < 0.0 && corner.dot(view.up) > view.forward.dot(view.up));
        for wild in [Vec2::splat(1e30), Vec2::splat(f32::INFINITY)] {
            assert!(projection.ray(wild).1.is_finite());
        }
    }

    #[test]
    fn a_point_of_the_screen_covers_what_it_says() {
        let projection = Projection::new(&camera(), MIN, SIZE);
        let [right, up, forward] = camera().frame();
        let middle = camera().position + 4.0 * forward;
        for side in [right, up] {
            let [a, b] = [middle, middle + side * projection.metres_per_point(4.0)]
                .map(|p| projection.project(p).unwrap().0);
            assert!((a.distance(b) - 1.0).abs() < 1e-3);
        }
    }

    #[test]
    fn lines_end_before_the_camera() {
        let projection = Projection::new(&camera(), MIN, SIZE);
        let [right, up, forward] = camera().frame();
        let (eye, side) = (camera().position, 0.3 * right - 0.2 * up);
        let [ahead, behind] = [eye + 4.0 * forward + side, eye - 2.0 * forward + side];
        let [from, to] = projection.segment(ahead, behind).unwrap();
        assert_eq!(from, projection.project(ahead).unwrap().0);
        // Still on the line, far outside the picture.
        let (between, _) = projection.project(ahead.lerp(behind, 0.4)).unwrap();
        assert!((between - from).normalize().dot((to - from).normalize()) > 0.99999);
        assert!(to.distance(from) > 1e4);
        assert_eq!(projection.segment(behind, ahead), Some([to, from]));
        assert_eq!(projection.segment(behind, behind + side), None);
        let nearer = eye + forward;
        assert_eq!(
            projection.segment(ahead, nearer),
            Some([ahead, nearer].map(|p| projection.project(p).unwrap().0))
        );
    }
}
