//! Gizmos of lights, drawn over the picture and dragged by the pointer. Their size on the screen
//! is constant. The gizmos at the ends of an area light's edges lie at their true positions.

mod drag;
mod projection;

use glam::{Vec2, Vec3};

use crate::scene::{Light, LightKind};
pub(super) use drag::{Drag, turn_area};
pub(super) use projection::Projection;

/// Distances from the light at which axis arrows start and end, points.
const ARROW: [f32; 2] = [14.0, 70.0];
/// Length and half the width of an arrow's head, points.
const HEAD: [f32; 2] = [12.0, 5.0];
/// Near and far side of the plane squares, distances from the light in points.
const SQUARE: [f32; 2] = [24.0, 40.0];
/// Distance of the aim gizmo ahead of the light, points.
const AIM: f32 = 110.0;
/// Distance of the drawn cone rim from the light, points.
const RIM: f32 = 84.0;
/// Radius of the rings that turn a model, points.
const RING: f32 = 92.0;
/// Radius of the middle disc, points.
const MIDDLE_RADIUS: f32 = 9.0;
/// Radius of the other discs, points.
const KNOB_RADIUS: f32 = 6.0;
/// Largest distance between the pointer and a gizmo that it takes, points.
pub(super) const TOLERANCE: f32 = 6.0;
/// Sine of the angle to the line of sight below which an axis or a plane has no gizmo.
const EDGE_ON: f32 = 0.15;
/// Edges shorter than this have no gizmos, points: they would overlap the middle disc.
const SHORTEST_EDGE: f32 = 36.0;

/// An axis of the scene.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Axis {
    X,
    Y,
    Z,
}

impl Axis {
    const ALL: [Self; 3] = [Self::X, Self::Y, Self::Z];

    pub(super) fn unit(self) -> Vec3 {
        Vec3::AXES[self as usize]
    }

    /// The other two axes.
    fn others(self) -> [Self; 2] {
        [Self::ALL[(self as usize + 1) % 3], Self::ALL[(self as usize + 2) % 3]]
    }
}

/// The draggable parts of a light.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Part {
    /// Moves the light in the plane that faces the camera.
    Middle,
    /// Moves the light along an axis.
    Axis(Axis),
    /// Moves the light in the plane across an axis.
    Plane(Axis),
    /// Turns the light's direction.
    Aim,
    /// Opens and closes a spot's cone.
    Cone,
    /// Lengthens and shortens an area's first edge.
    EdgeU,
    /// Lengthens and shortens an area's second edge.
    EdgeV,
    /// Turns a model about an axis.
    Turn(Axis),
}

/// A drawn shape; points of the screen.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Shape {
    /// A filled disc that can be dragged.
    Disc { centre: Vec2, radius: f32 },
    /// An open polyline that can be dragged.
    Line(Vec<Vec2>),
    /// A filled convex polygon that can be dragged.
    Fill(Vec<Vec2>),
    /// An open polyline that is only drawn.
    Guide(Vec<Vec2>),
}

/// A draggable part and its shapes.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Gizmo {
    pub(super) part: Part,
    /// Axis that gives the colour: the part moves along or across it.
    pub(super) axis: Option<Axis>,
    /// Shapes in drawing order.
    pub(super) shapes: Vec<Shape>,
}

/// As [`gizmos`]. A light whose intensities were measured has no cone to open.
pub(super) fn of_light(projection: &Projection, light: &Light, anchor: Vec3) -> Vec<Gizmo> {
    let mut gizmos = gizmos(projection, &light.kind, anchor);
    gizmos.retain(|gizmo| light.luminaire.is_none() || gizmo.part != Part::Cone);
    gizmos
}

/// The gizmos of a light, in drawing order. A light at infinity has its gizmos at `anchor`. Empty
/// if the origin of the gizmos is behind the camera.
fn gizmos(projection: &Projection, kind: &LightKind, anchor: Vec3) -> Vec<Gizmo> {
    let origin = kind.position().unwrap_or(anchor);
    let Some((centre, metres)) = scale(projection, origin) else { return Vec::new() };
    let mut gizmos = Vec::new();
    if kind.position().is_some() {
        gizmos.extend(Axis::ALL.iter().filter_map(|axis| square(projection, origin, metres, *axis)));
        gizmos.extend(Axis::ALL.iter().filter_map(|axis| arrow(projection, origin, metres, *axis)));
        let shapes = vec![Shape::Disc { centre, radius: MIDDLE_RADIUS }];
        gizmos.push(Gizmo { part: Part::Middle, axis: None, shapes });
    }
    if let LightKind::Area { corner, edge_u, edge_v, .. } = *kind {
        for (part, edge) in [(Part::EdgeU, edge_u), (Part::EdgeV, edge_v)] {
            gizmos.extend(edge_end(projection, part, [corner, edge, edge_u + edge_v - edge]));
        }
    }
    if let LightKind::Spot { direction, angle, .. } = *kind {
        gizmos.extend(cone(projection, origin, metres * RIM, direction, angle));
    }
    if let Some(aim) = aim(kind)
        && let Some((tip, _)) = projection.project(origin + AIM * metres * aim)
    {
        let shapes = vec![Shape::Guide(vec![centre, tip]), Shape::Disc { centre: tip, radius: KNOB_RADIUS }];
        gizmos.push(Gizmo { part: Part::Aim, axis: None, shapes });
    }
    gizmos
}

/// Rings about the axes, which turn a model.
pub(super) fn rings(projection: &Projection, origin: Vec3) -> Vec<Gizmo> {
    const CORNERS: u16 = 64;
    let Some((_, metres)) = scale(projection, origin) else { return Vec::new() };
    let sight = (origin - projection.eye()).normalize_or_zero();
    let seen = Axis::ALL.into_iter().filter(|axis| sight.dot(axis.unit()).abs() >= EDGE_ON);
    let ring = |axis: Axis| {
        let [u, v] = axis.others().map(|axis| RING * metres * axis.unit());
        let turns = (0..=CORNERS).map(|i| f32::from(i) * std::f32::consts::TAU / f32::from(CORNERS));
        let at = |turn: f32| Some(projection.project(origin + turn.cos() * u + turn.sin() * v)?.0);
        let shapes = vec![Shape::Line(turns.map(at).collect::<Option<_>>()?)];
        Some(Gizmo { part: Part::Turn(axis), axis: Some(axis), shapes })
    };
    seen.filter_map(ring).collect()
}

/// Angle about an axis through `origin` from one pointer position to another, radians. Zero if a
/// pointer does not meet the plane across the axis.
pub(super) fn turn(projection: &Projection, origin: Vec3, axis: Axis, [from, to]: [Vec2; 2]) -> f64 {
    let [u, v] = axis.others().map(|axis| axis.unit().as_dvec3());
    let angle = |pointer: Vec2| {
        let (eye, ray) = projection.ray(pointer);
        let [eye, ray, origin] = [eye, ray, origin].map(Vec3::as_dvec3);
        let normal = axis.unit().as_dvec3();
        let depth = (origin - eye).dot(normal) / ray.dot(normal);
        let away = eye + depth * ray - origin;
        (depth > 0.0 && away.is_finite()).then(|| away.dot(v).atan2(away.dot(u)))
    };
    angle(from).zip(angle(to)).map_or(0.0, |(from, to)| to - from)
}

/// The part under the pointer, the smallest of several. Otherwise the nearest part
/// within `tolerance` points.
pub(super) fn hit(gizmos: &[Gizmo], pointer: Vec2, tolerance: f32) -> Option<Part> {
    let places = gizmos.iter().flat_map(|gizmo| gizmo.shapes.iter().map(|shape| (gizmo.part, shape)));
    let near = places.filter_map(|(part, shape)| {
        let (away, size) = match shape {
            Shape::Disc { centre, radius } => (pointer.distance(*centre) - radius, *radius),
            Shape::Line(points) => (away_from(points, pointer) - 2.0, ARROW[1]),
            Shape::Fill(points) if contains(points, pointer) => (0.0, 2.0 * ARROW[1]),
            Shape::Fill(points) => (away_from(points, pointer), 2.0 * ARROW[1]),
            Shape::Guide(_) => return None,
        };
        (away <= tolerance).then_some((part, away.max(0.0), size))
    });
    near.min_by(|a, b| a.1.total_cmp(&b.1).then(a.2.total_cmp(&b.2))).map(|(part, ..)| part)
}

/// Screen position of the gizmos' origin, and metres that one point covers there. The scale is
/// smaller near the camera, so that no gizmo reaches behind it.
fn scale(projection: &Projection, origin: Vec3) -> Option<(Vec2, f32)> {
    let (centre, depth) = projection.project(origin)?;
    Some((centre, projection.metres_per_point(depth).min(0.5 * depth / AIM)))
}

/// Unit direction of emission. `None` if the light emits in all directions.
fn aim(kind: &LightKind) -> Option<Vec3> {
    match *kind {
        LightKind::Point { .. } | LightKind::Surface { .. } | LightKind::Sky { .. } => None,
        LightKind::Spot { direction, .. } | LightKind::Directional { direction, .. } => Some(direction),
        LightKind::Area { edge_u, edge_v, .. } => {
            edge_u.as_dvec3().cross(edge_v.as_dvec3()).try_normalize().map(|normal| normal.as_vec3())
        }
    }
}

/// Direction to the rim gizmo of a spot's cone: perpendicular to the axis and the line of sight,
/// where the gizmo is seen best.
fn rim_side(projection: &Projection, origin: Vec3, direction: Vec3) -> Vec3 {
    let side = direction.cross((origin - projection.eye()).normalize_or_zero());
    if side.length() > 1e-3 { side.normalize() } else { direction.any_orthonormal_vector() }
}

/// Whether the direction `way` at `origin` points at the viewer.
fn points_at_viewer(projection: &Projection, origin: Vec3, way: Vec3) -> bool {
    (origin - projection.eye()).normalize_or_zero().cross(way).length() < EDGE_ON
}

fn arrow(projection: &Projection, origin: Vec3, metres: f32, axis: Axis) -> Option<Gizmo> {
    if points_at_viewer(projection, origin, axis.unit()) {
        return None;
    }
    let at = |points: f32| Some(projection.project(origin + axis.unit() * metres * points)?.0);
    let (from, tip) = (at(ARROW[0])?, at(ARROW[1])?);
    let along = (tip - from).normalize_or_zero();
    // At most half as long as an arrow that is seen from ahead.
    let neck = tip - along * HEAD[0].min(0.5 * from.distance(tip));
    let head = Shape::Fill(vec![tip, neck + HEAD[1] * along.perp(), neck - HEAD[1] * along.perp()]);
    let shapes = vec![Shape::Line(vec![from, neck]), head];
    Some(Gizmo { part: Part::Axis(axis), axis: Some(axis), shapes })
}

fn square(projection: &Projection, origin: Vec3, metres: f32, axis: Axis) -> Option<Gizmo> {
    let sight = (origin - projection.eye()).normalize_or_zero();
    if sight.dot(axis.unit()).abs() < EDGE_ON {
        return None;
    }
    let [a, b] = axis.others().map(|axis| axis.unit() * metres);
    let [near, far] = SQUARE;
    let corners = [[near, near], [far, near], [far, far], [near, far]];
    let points = corners.iter().map(|[u, v]| Some(projection.project(origin + a * *u + b * *v)?.0));
    let shapes = vec![Shape::Fill(points.collect::<Option<_>>()?)];
    Some(Gizmo { part: Part::Plane(axis), axis: Some(axis), shapes })
}

/// Gizmo at the far end of an area's edge; shows the edge and the opposite one.
fn edge_end(projection: &Projection, part: Part, [corner, edge, other]: [Vec3; 3]) -> Option<Gizmo> {
    let (end, _) = projection.project(corner + edge)?;
    let sides = [corner, corner + other].map(|from| projection.segment(from, from + edge));
    let length = sides[0].map_or(0.0, |[from, to]| from.distance(to));
    if length < SHORTEST_EDGE || points_at_viewer(projection, corner + edge, edge.normalize_or_zero()) {
        return None;
    }
    let mut shapes: Vec<_> = sides.into_iter().flatten().map(|side| Shape::Guide(side.to_vec())).collect();
    shapes.push(Shape::Disc { centre: end, radius: KNOB_RADIUS });
    Some(Gizmo { part, axis: None, shapes })
}

/// Gizmo on the rim of a spot's cone; shows the cone.
fn cone(projection: &Projection, origin: Vec3, reach: f32, direction: Vec3, angle: f32) -> Option<Gizmo> {
    const CORNERS: u16 = 48;
    let (sin, cos) = angle.sin_cos();
    let side = rim_side(projection, origin, direction);
    let across = direction.cross(side);
    let at = |turn: f32| {
        let way = cos * direction + sin * (turn.cos() * side + turn.sin() * across);
        Some(projection.project(origin + reach * way)?.0)
    };
    let turns = (0..=CORNERS).map(|i| f32::from(i) * std::f32::consts::TAU / f32::from(CORNERS));
    let (centre, _) = projection.project(origin)?;
    let shapes = vec![
        Shape::Guide(turns.map(at).collect::<Option<_>>()?),
        Shape::Guide(vec![at(0.0)?, centre, at(std::f32::consts::PI)?]),
        Shape::Disc { centre: at(0.0)?, radius: KNOB_RADIUS },
    ];
    Some(Gizmo { part: Part::Cone, axis: None, shapes })
}

/// Distance from the nearest point of a polyline.
fn away_from(points: &[Vec2], pointer: Vec2) -> f32 {
    let pieces = points.windows(2).map(|piece| {
        let (from, way) = (piece[0], piece[1] - piece[0]);
        let along = (pointer - from).dot(way) / way.length_squared().max(f32::MIN_POSITIVE);
        pointer.distance(from + way * along.clamp(0.0, 1.0))
    });
    pieces.fold(f32::INFINITY, f32::min)
}

/// Whether a convex polygon contains the pointer.
fn contains(points: &[Vec2], pointer: Vec2) -> bool {
    let turn = |i: usize| (points[(i + 1) % points.len()] - points[i]).perp_dot(pointer - points[i]);
    // Strict comparison: a polygon without area contains nothing.
    (0..points.len()).all(|i| turn(i) > 0.0) || (0..points.len()).all(|i| turn(i) < 0.0)
}

#[cfg(test)]
mod tests;
