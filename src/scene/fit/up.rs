//! Which way is up in a model whose file does not state it.

use glam::Vec3;

use super::probe::Probe;
use super::room::Room;
use crate::scene::Camera;

/// The axis that points up.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Up {
    /// +Y, the convention of glTF and of this program.
    Y,
    /// +Z, the convention of CAD programs and of Blender's own files.
    Z,
}

/// By how much the cues must favour +Z: most models have +Y up.
const MARGIN: f32 = 0.3;
/// Surface within this fraction of a model's height from its end rests on the ground.
const CONTACT: f32 = 0.004;

impl Up {
    /// The unit vector.
    pub fn vector(self) -> Vec3 {
        match self {
            Self::Y => Vec3::Y,
            Self::Z => Vec3::Z,
        }
    }

    /// Number of the axis.
    pub(super) fn axis(self) -> usize {
        match self {
            Self::Y => 1,
            Self::Z => 2,
        }
    }

    /// Unit vectors to the right, up and to the front, as seen from the front. Programs with +Z up
    /// show a model's front from -Y.
    pub(super) fn frame(self) -> [Vec3; 3] {
        match self {
            Self::Y => [Vec3::X, Vec3::Y, Vec3::Z],
            Self::Z => [Vec3::X, Vec3::Z, Vec3::NEG_Y],
        }
    }

    /// The unit direction at an azimuth from the front and an elevation, degrees.
    pub(super) fn direction(self, azimuth: f32, elevation: f32) -> Vec3 {
        let [right, up, front] = self.frame();
        let [(sin_a, cos_a), (sin_e, cos_e)] = [azimuth, elevation].map(|angle| angle.to_radians().sin_cos());
        cos_e * (sin_a * right + cos_a * front) + sin_e * up
    }

    /// A camera of a square picture.
    pub(super) fn camera(self, position: Vec3, target: Vec3, fov_y_degrees: f32) -> Camera {
        let up = self.vector();
        Camera { name: "camera".to_owned(), position, target, up, fov_y_degrees, size: [1, 1] }
    }

    /// The axis that the shape suggests.
    pub(super) fn guess(probe: &Probe, room: &Room) -> Self {
        let score = |up| resting(probe, up) + 0.3 * round_walls(probe, up);
        let tilted = score(Self::Z) - score(Self::Y) + 1.5 * ground(probe) + flat_room(probe, room);
        if tilted > MARGIN { Self::Z } else { Self::Y }
    }
}

/// Gravity: how well a model would rest on its lower end, and by how much better than on its upper
/// end. A car has a wheelbase below and a roof above.
fn resting(probe: &Probe, up: Up) -> f32 {
    let (lower, upper) = (support(probe, up, false), support(probe, up, true));
    lower + 0.5 * (lower - upper)
}

/// Size of the bounds of what touches the ground, 0.3 to 1. Zero if the model would fall over.
fn support(probe: &Probe, up: Up, is_top: bool) -> f32 {
    /// A model that is thinner has no width to compare.
    const THIN: f32 = 0.1;
    /// Allowed distance of the middle from what supports it.
    const LEAN: f32 = 0.02;
    let axis = up.axis();
    let end = if is_top { probe.high } else { probe.low }[axis];
    let band = CONTACT * probe.size()[axis] + 1e-6;
    let points = probe.triangles.iter().flat_map(|triangle| triangle.positions);
    let (low, high) = points
        .filter(|p| (p[axis] - end).abs() <= band)
        .fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    let (moments, area) = probe.triangles.iter().fold((Vec3::ZERO, 0.0), |(moments, area), triangle| {
        let own = triangle.area_m2() as f32;
        (moments + own * triangle.positions.iter().sum::<Vec3>() / 3.0, area + own)
    });
    let middle = moments / area;
    let across = [0, 3 - axis];
    if !across.iter().all(|&a| (low[a] - LEAN..=high[a] + LEAN).contains(&middle[a])) {
        return 0.0;
    }
    let covered: f32 =
        across.iter().map(|&a| (high[a] - low[a]).max(THIN) / probe.size()[a].max(THIN)).product();
    0.3 + 0.7 * covered
}

/// The fraction of surface that is vertical and faces two ways: trunks, pillars, shafts.
fn round_walls(probe: &Probe, up: Up) -> f32 {
    let across = [0, 3 - up.axis()];
    let (mut walls, mut area) = ([0.0; 2], 0.0);
    for triangle in &probe.triangles {
        let (own, normal) = (triangle.area_m2() as f32, triangle.geometric_normal());
        area += own;
        if normal[up.axis()].abs() < 0.05 {
            across.iter().zip(&mut walls).for_each(|(&a, wall)| *wall += own * normal[a] * normal[a]);
        }
    }
    2.0 * walls[0].min(walls[1]) / area
}

/// Evidence for a ground, an open surface that faces one way: 1 for +Z, -1 for +Y. A curtain, a
/// sign or a shelf faces +Z, too. A ground is low, and has slopes or walls on all sides and no rim.
fn ground(probe: &Probe) -> f32 {
    let (mut facing, mut squares, mut area) = (Vec3::ZERO, Vec3::ZERO, 0.0);
    for triangle in &probe.triangles {
        let (own, normal) = (triangle.area_m2() as f32, triangle.geometric_normal());
        area += own;
        facing += own * normal;
        squares += own * normal * normal;
    }
    let (facing, squares, size) = (facing / area, squares / area, probe.size());
    if facing.y > 0.15 && facing.y > 2.0 * facing.z.abs() {
        return -1.0;
    }
    let is_low = size.z < 0.5 * size.x.min(size.y);
    let has_slopes = squares.x.min(squares.y) > 0.2 * squares.x.max(squares.y).max(0.005);
    let is_ground = facing.z > 0.15 && facing.z > 2.0 * facing.y.abs() && is_low && has_slopes;
    if is_ground && support(probe, Up::Z, true) < 0.8 { 1.0 } else { 0.0 }
}

/// Evidence for a room with +Z up: it is closed above and below, and its height is its least size.
/// A corridor may be narrower than high.
fn flat_room(probe: &Probe, room: &Room) -> f32 {
    let size = probe.size();
    let (short, long) = (size.x.min(size.y), size.x.max(size.y));
    let is_flat = size.z < 0.7 * short && long < 3.0 * short;
    let is_room =
        room.is_closed && [Vec3::Z, Vec3::NEG_Z].iter().all(|&way| room.is_closed_along(probe, way));
    if is_room && is_flat { 0.6 } else { 0.0 }
}
