//! The drag of a light's gizmo.

use glam::{DQuat, DVec3, Vec2, Vec3};

use super::{AIM, Part, Projection, RIM, aim, rim_side, scale};
use crate::scene::LightKind;

/// Longest movement of a drag, in distances from the camera.
const REACH: f32 = 100.0;
/// Shortest edge that a drag makes, metres.
const SHORTEST: f32 = 1e-3;
/// Step of a snapped aim, degrees.
const AIM_STEP: f64 = 15.0;
/// Step of a snapped cone, degrees.
const CONE_STEP: f32 = 5.0;
/// Range of cone half-angles, degrees: that of a scene file, narrowed by the rounding to radians.
const CONE: [f32; 2] = [0.010_001, 89.999_99];

/// The dragged part and the state at the start of the drag.
#[derive(Clone, Copy, Debug)]
pub(in crate::app::demo) struct Drag {
    kind: LightKind,
    part: Part,
    /// Origin of the movement: the far end of an edge, else the origin of the light's gizmos.
    origin: Vec3,
    /// Pointer at the start, points.
    start: Vec2,
    /// From the gizmo to the pointer at the start, points.
    grab: Vec2,
    /// The value of [`Drag::movement`] at the start.
    before: Vec3,
    /// Longest movement, metres.
    reach: f32,
    /// Metres that one point on the screen covers at the gizmos.
    metres: f32,
    /// Direction to the gizmo on the cone's rim.
    side: Vec3,
    /// Whether the aim points away from the viewer.
    is_far: bool,
}

impl Drag {
    /// Starts the drag of a part of a light; `anchor` as for [`super::gizmos`].
    pub(in crate::app::demo) fn begin(
        projection: &Projection,
        kind: &LightKind,
        part: Part,
        anchor: Vec3,
        pointer: Vec2,
    ) -> Self {
        let place = kind.position().unwrap_or(anchor);
        let origin = match (*kind, part) {
            (LightKind::Area { corner, edge_u, .. }, Part::EdgeU) => corner + edge_u,
            (LightKind::Area { corner, edge_v, .. }, Part::EdgeV) => corner + edge_v,
            _ => place,
        };
        let metres = scale(projection, place).map_or(0.0, |(_, metres)| metres);
        let aim = aim(kind).unwrap_or(Vec3::ZERO);
        let mut drag = Self {
            kind: *kind,
            part,
            origin,
            start: pointer,
            grab: Vec2::ZERO,
            before: Vec3::ZERO,
            // A part behind the camera does not move.
            reach: projection.project(origin).map_or(0.0, |_| REACH * origin.distance(projection.eye())),
            metres,
            side: rim_side(projection, place, aim),
            is_far: false,
        };
        let gizmo = match (*kind, part) {
            (LightKind::Spot { angle, .. }, Part::Cone) => drag.rim(aim, angle),
            _ => origin + AIM * metres * aim,
        };
        drag.is_far = (gizmo - origin).dot(gizmo - projection.eye()) > 0.0;
        drag.grab = projection.project(gizmo).map_or(Vec2::ZERO, |(seen, _)| pointer - seen);
        drag.before = drag.movement(projection, pointer);
        drag
    }

    /// The dragged part.
    pub(in crate::app::demo) fn part(&self) -> Part {
        self.part
    }

    /// Offset of a light that is dragged to `kind`, metres. `None` if the part does not move it.
    pub(in crate::app::demo) fn offset(&self, kind: &LightKind) -> Option<Vec3> {
        let places = self.kind.position().zip(kind.position()).filter(|_| moves(self.part));
        places.map(|(from, to)| to - from)
    }

    /// Returns the dragged light for a pointer position. The part stays under the pointer as far as
    /// its freedom allows. The result depends on the start and `pointer` alone. At the start
    /// position it is the original light, bit for bit.
    ///
    /// `snap` rounds axis movements and edge lengths to multiples of that many metres. Aims then
    /// snap to 15° of longitude and latitude around y, and cones to 5°.
    pub(in crate::app::demo) fn to(
        &self,
        projection: &Projection,
        pointer: Vec2,
        snap: Option<f32>,
    ) -> LightKind {
        if pointer == self.start || !pointer.is_finite() {
            return self.kind;
        }
        let mut kind = self.kind;
        match (&mut kind, self.part) {
            (LightKind::Point { position, .. } | LightKind::Spot { position, .. }, part) if moves(part) => {
                *position += self.moved(projection, pointer, snap);
            }
            (LightKind::Area { corner, .. }, part) if moves(part) => {
                *corner += self.moved(projection, pointer, snap);
            }
            (LightKind::Spot { direction, .. } | LightKind::Directional { direction, .. }, Part::Aim) => {
                *direction = self.aimed(projection, pointer, snap).unwrap_or(direction.as_dvec3()).as_vec3();
            }
            (LightKind::Area { corner, edge_u, edge_v, .. }, Part::Aim) => {
                if let Some(aimed) = self.aimed(projection, pointer, snap) {
                    turn_area([corner, edge_u, edge_v], aimed);
                }
            }
            (LightKind::Spot { direction, angle, .. }, Part::Cone) => {
                *angle = self.opened(projection, pointer, *direction, *angle, snap);
            }
            (LightKind::Area { edge_u: edge, .. }, Part::EdgeU)
            | (LightKind::Area { edge_v: edge, .. }, Part::EdgeV) => {
                *edge = self.resized(projection, pointer, *edge, snap);
            }
            _ => {}
        }
        kind
    }

    /// The light's movement, metres.
    fn moved(&self, projection: &Projection, pointer: Vec2, snap: Option<f32>) -> Vec3 {
        let movement = (self.movement(projection, pointer) - self.before).clamp_length_max(self.reach);
        movement.map(|metres| snapped(metres, snap))
    }

    /// Vector from the origin to the pointer, within the part's freedom.
    fn movement(&self, projection: &Projection, pointer: Vec2) -> Vec3 {
        let mut movement = match (self.part, self.kind) {
            (Part::Middle, _) => self.in_plane(projection, pointer, projection.forward()),
            (Part::Plane(axis), _) => self.in_plane(projection, pointer, axis.unit()),
            (Part::Axis(axis), _) => self.along(projection, pointer, axis.unit()),
            (Part::EdgeU, LightKind::Area { edge_u: edge, .. })
            | (Part::EdgeV, LightKind::Area { edge_v: edge, .. }) => {
                self.along(projection, pointer, edge.normalize_or_zero())
            }
            _ => Vec3::ZERO,
        };
        if let Part::Plane(axis) = self.part {
            // Exactly zero, without rounding errors.
            movement[axis as usize] = 0.0;
        }
        if movement.is_finite() { movement } else { Vec3::ZERO }
    }

    /// Vector to the point where the pointer's ray meets the plane through the origin. Beyond the
    /// horizon, the farthest point in that direction.
    fn in_plane(&self, projection: &Projection, pointer: Vec2, normal: Vec3) -> Vec3 {
        let (eye, ray) = projection.ray(pointer);
        let (away, slope) = ((self.origin - eye).dot(normal), ray.dot(normal));
        let meets = eye + ray * (away / slope) - self.origin;
        if away * slope > 0.0 && meets.length_squared().is_finite() {
            return meets.clamp_length_max(self.reach);
        }
        self.reach * (ray - slope * normal).normalize_or_zero()
    }

    /// Vector to the pointer along a line through the origin. It is found in the plane of the line
    /// that faces the viewer most.
    fn along(&self, projection: &Projection, pointer: Vec2, way: Vec3) -> Vec3 {
        let sight = self.origin - projection.eye();
        match (sight - sight.dot(way) * way).try_normalize() {
            Some(normal) => way * self.in_plane(projection, pointer, normal).dot(way),
            None => Vec3::ZERO,
        }
    }

    /// Direction of the dragged aim. The tip stays on a sphere around the light. A pointer beyond
    /// the sphere's rim moves it onto the other side.
    fn aimed(&self, projection: &Projection, pointer: Vec2, snap: Option<f32>) -> Option<DVec3> {
        let radius = f64::from(AIM * self.metres);
        if radius <= 0.0 {
            return None;
        }
        let (eye, ray) = projection.ray(pointer - self.grab);
        let ray = ray.as_dvec3().normalize();
        let sight = self.origin.as_dvec3() - eye.as_dvec3();
        let across = ray * sight.dot(ray) - sight;
        // The scale of the gizmos guarantees that a ray away from the sphere misses it by two
        // radii or more.
        let off = across.length() / radius;
        let (off, is_far) = if off > 1.0 { ((2.0 - off).max(0.0), !self.is_far) } else { (off, self.is_far) };
        let depth = if is_far { 1.0 } else { -1.0 } * (1.0 - off * off).max(0.0).sqrt();
        let aimed = (across.normalize_or_zero() * off + ray * depth).try_normalize()?;
        if snap.is_none() {
            return Some(aimed);
        }
        let step = |angle: f64| ((angle.to_degrees() / AIM_STEP).round() * AIM_STEP).to_radians().sin_cos();
        let (sin, cos) = step(aimed.y.clamp(-1.0, 1.0).asin());
        let (east, south) = step(aimed.x.atan2(aimed.z));
        // Multiples of a right angle give exact 0 and 1.
        let whole = |x: f64| if x.abs() < 1e-9 { 0.0 } else { x };
        Some(DVec3::new(cos * east, sin, cos * south).map(whole))
    }

    /// Half-angle of the cone, radians, whose rim gizmo is nearest to the pointer on the screen.
    fn opened(
        &self,
        projection: &Projection,
        pointer: Vec2,
        direction: Vec3,
        before: f32,
        snap: Option<f32>,
    ) -> f32 {
        let away = |degrees: f32| {
            let seen = projection.project(self.rim(direction, degrees.to_radians()));
            seen.map_or(f32::INFINITY, |(seen, _)| seen.distance(pointer - self.grab))
        };
        let nearest = (0..=90u8).map(f32::from).min_by(|a, b| away(*a).total_cmp(&away(*b)));
        let Some(nearest) = nearest.filter(|degrees| away(*degrees).is_finite()) else { return before };
        let (mut low, mut high) = ((nearest - 1.0).max(0.0), (nearest + 1.0).min(90.0));
        for _ in 0..40 {
            let [a, b] = [low + (high - low) / 3.0, high - (high - low) / 3.0];
            if away(a) < away(b) { high = b } else { low = a }
        }
        let degrees = snapped(0.5 * (low + high), snap.map(|_| CONE_STEP));
        degrees.clamp(CONE[0], CONE[1]).to_radians()
    }

    /// Position of the rim gizmo for a cone's half-angle, radians.
    fn rim(&self, direction: Vec3, angle: f32) -> Vec3 {
        let (sin, cos) = angle.sin_cos();
        self.origin + RIM * self.metres * (cos * direction + sin * self.side)
    }

    /// The edge with the length that the pointer sets.
    fn resized(&self, projection: &Projection, pointer: Vec2, edge: Vec3, snap: Option<f32>) -> Vec3 {
        let (length, way) = (edge.length(), edge.normalize_or_zero());
        let longer = (self.movement(projection, pointer) - self.before).dot(way);
        let least = SHORTEST.min(length);
        way * snapped(length + longer, snap).clamp(least, length + self.reach)
    }
}

/// Whether the part moves the whole light.
fn moves(part: Part) -> bool {
    matches!(part, Part::Middle | Part::Axis(_) | Part::Plane(_))
}

/// The nearest multiple of a step.
fn snapped(value: f32, step: Option<f32>) -> f32 {
    match step {
        Some(step) if step > 0.0 && (value / step).is_finite() => (value / step).round() * step,
        _ => value,
    }
}

/// Turns an area around its middle by the shortest way until it faces a direction.
pub(in crate::app::demo) fn turn_area([corner, edge_u, edge_v]: [&mut Vec3; 3], facing: DVec3) {
    let [u, v] = [edge_u.as_dvec3(), edge_v.as_dvec3()];
    let turn = DQuat::from_rotation_arc(u.cross(v).normalize(), facing);
    let middle = corner.as_dvec3() + 0.5 * (u + v);
    let [u, v] = [turn * u, turn * v];
    [*corner, *edge_u, *edge_v] = [middle - 0.5 * (u + v), u, v].map(|point| point.as_vec3());
}
