//! Cameras and lights of models as nodes of the scene file, and default ones for models without.

use glam::{DVec3, Vec3};

use super::gltf::{FileCamera, FileLight, FileLightKind};
use super::value::{Kind, Node, Origin};
use super::{Triangle, camera};

/// Vertical field of view of a chosen camera, degrees.
const FOV_Y: f64 = 40.0;
/// Height of the picture of a model's camera, pixels.
const HEIGHT: f64 = 512.0;
/// Mean direct irradiance of a chosen light, W/m².
const IRRADIANCE: f64 = 1.0;

/// Shape of a model, measured by rays along the axes from its middle; world metres.
pub(super) struct View {
    middle: DVec3,
    half: DVec3,
    area_m2: f64,
    /// Free distance along +x, -x, +y, -y, +z, -z; `None` if the ray hits nothing.
    free: [Option<f64>; 6],
    is_room: bool,
}

const AXES: [DVec3; 6] = [DVec3::X, DVec3::NEG_X, DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::NEG_Z];

impl View {
    /// `triangles` are recentred on `origin`.
    pub(super) fn new(triangles: &[Triangle], origin: DVec3) -> Self {
        let points = triangles.iter().flat_map(|triangle| triangle.positions);
        let (low, high) =
            points.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        let middle = 0.5 * (low + high).as_dvec3();
        let hits = AXES.map(|axis| nearest(triangles, middle, axis));
        // The fronts of a room's walls face its middle; an object's fronts face away. A room may
        // lack one wall.
        let fronts = hits.iter().flatten().filter(|(_, is_front)| *is_front).count();
        Self {
            middle: middle + origin,
            half: 0.5 * (high - low).as_dvec3(),
            area_m2: triangles.iter().map(Triangle::area_m2).sum(),
            free: hits.map(|hit| hit.map(|(distance, _)| distance)),
            is_room: fronts >= 5,
        }
    }

    /// Position and target of a camera. It looks into a room through its missing wall, else from
    /// the side with the largest distance. It looks at any other model from outside, slightly
    /// above and beside.
    pub(super) fn camera(&self) -> [DVec3; 2] {
        let tan = (0.5 * FOV_Y).to_radians().tan();
        let sideways = [4, 0, 1, 5];
        let offset = if !self.is_room {
            DVec3::new(0.4, 0.35, 1.0).normalize() * self.half.length() / (0.5 * FOV_Y).to_radians().sin()
        } else if let Some(open) = sideways.into_iter().find(|&side| self.free[side].is_none()) {
            let depth = (AXES[open] * self.half).length();
            let across = (AXES[open].abs() - DVec3::ONE).abs() * self.half;
            AXES[open] * (depth + 1.05 * across.max_element() / tan)
        } else {
            let distance = |side: usize| self.free[side].unwrap_or_default();
            let longest = sideways
                .into_iter()
                .fold(4, |best, side| if distance(side) > distance(best) { side } else { best });
            AXES[longest] * 0.9 * distance(longest)
        };
        [self.middle + offset, self.middle]
    }

    /// Position and intensity (W/sr) of a point light. It is under the ceiling of a room, else
    /// above and beside the object.
    pub(super) fn light(&self) -> (DVec3, f64) {
        if self.is_room {
            let up = self.free[2].unwrap_or(self.half.y);
            let intensity = IRRADIANCE * self.area_m2 / (4.0 * std::f64::consts::PI);
            return (self.middle + 0.75 * up * DVec3::Y, intensity);
        }
        let offset = DVec3::new(1.0, 2.0, 1.5).normalize() * 2.0 * self.half.length();
        (self.middle + offset, IRRADIANCE * std::f64::consts::PI * offset.length_squared())
    }
}

/// Distance to the nearest triangle along a unit direction, and whether its front was hit.
pub(super) fn nearest(triangles: &[Triangle], from: DVec3, direction: DVec3) -> Option<(f64, bool)> {
    let hits = triangles.iter().filter_map(|triangle| {
        let [p0, p1, p2] = triangle.positions.map(|p| p.as_dvec3() - from);
        let (e1, e2) = (p1 - p0, p2 - p0);
        let normal = direction.cross(e2);
        let determinant = e1.dot(normal);
        let u = -p0.dot(normal) / determinant;
        let across = (-p0).cross(e1);
        let v = direction.dot(across) / determinant;
        let distance = e2.dot(across) / determinant;
        // Comparisons with the NaN of a parallel triangle fail.
        (u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0).then_some((distance, determinant > 0.0))
    });
    hits.min_by(|a, b| a.0.total_cmp(&b.0))
}

/// A camera as a node of the scene file.
pub(super) fn camera_node([position, target]: [DVec3; 2]) -> Node {
    table([("position", vector(position)), ("target", vector(target)), ("fov_y", Kind::Float(FOV_Y))])
}

/// A list of one light as a node of the scene file.
pub(super) fn light_node((position, intensity): (DVec3, f64)) -> Node {
    let entries = [
        ("name", Kind::Text("light".to_owned())),
        ("kind", Kind::Text("point".to_owned())),
        ("position", vector(position)),
        ("intensity", vector(DVec3::splat(intensity))),
    ];
    node(Kind::Array(vec![table(entries)]))
}

/// A camera of a model's file.
pub(super) fn file_camera_node(camera: &FileCamera) -> Node {
    let FileCamera { name, position, forward, up, fov_y_degrees, aspect } = camera;
    let width = (HEIGHT * aspect.unwrap_or(1.0).clamp(0.05, 20.0)).round();
    let size = [width, HEIGHT].map(|pixels| node(Kind::Integer(pixels as i64)));
    table([
        ("name", Kind::Text(name.clone())),
        ("position", vector(*position)),
        ("target", vector(*position + *forward)),
        ("up", vector(*up)),
        ("fov_y", Kind::Float(fov_y_degrees.clamp(*camera::FOV_Y.start(), *camera::FOV_Y.end()))),
        ("size", Kind::Array(size.into())),
    ])
}

/// A light of a model's file.
pub(super) fn file_light_node(light: &FileLight) -> Node {
    let FileLight { name, position, direction, emission, kind } = light;
    let named = ("name", Kind::Text(name.clone()));
    let (position, direction) = (("position", vector(*position)), ("direction", vector(*direction)));
    let word = |word: &str| ("kind", Kind::Text(word.to_owned()));
    match kind {
        FileLightKind::Point => table([named, word("point"), position, ("intensity", vector(*emission))]),
        FileLightKind::Directional => {
            table([named, word("directional"), direction, ("irradiance", vector(*emission))])
        }
        FileLightKind::Spot(angle, penumbra) => table([
            named,
            word("spot"),
            position,
            direction,
            ("intensity", vector(*emission)),
            ("angle", Kind::Float(*angle)),
            ("penumbra", Kind::Float(penumbra.clamp(0.0, 1.0))),
        ]),
    }
}

/// A list of nodes.
pub(super) fn list(nodes: Vec<Node>) -> Node {
    node(Kind::Array(nodes))
}

fn node(kind: Kind) -> Node {
    Node { origin: Origin::Flag("chosen to fit".to_owned()), kind }
}

fn table<const N: usize>(entries: [(&str, Kind); N]) -> Node {
    node(Kind::Table(entries.into_iter().map(|(key, kind)| (key.to_owned(), node(kind))).collect()))
}

fn vector(v: DVec3) -> Kind {
    Kind::Array(v.to_array().into_iter().map(|number| node(Kind::Float(number))).collect())
}
