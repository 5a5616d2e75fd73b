//! Cameras and lights of models, and chosen ones, as nodes of the scene file.

use glam::{DVec3, Vec3};

use crate::scene::gltf::{FileCamera, FileLight, FileLightKind};
use crate::scene::value::{Kind, Node, Origin};
use crate::scene::{Camera, Light, LightKind, camera, numbers};

/// Height of the picture of a model's camera, pixels.
const HEIGHT: f64 = 512.0;
/// A chosen camera as a node of the scene file. Its size is left to the default.
pub(in crate::scene) fn camera_node(camera: &Camera, origin: DVec3) -> Node {
    let mut entries = vec![
        ("position", place(camera.position, origin)),
        ("target", place(camera.target, origin)),
        ("fov_y", Kind::Float(numbers::plain(camera.fov_y_degrees))),
    ];
    if camera.up != Vec3::Y {
        entries.insert(2, ("up", vector(camera.up.as_dvec3())));
    }
    table(entries)
}

/// A chosen light as a node of the scene file.
pub(in crate::scene) fn light_node(light: &Light, origin: DVec3) -> Node {
    let mut entries =
        vec![("name", Kind::Text(light.name.clone())), ("kind", Kind::Text(light.kind.word().to_owned()))];
    let plain = |v: Vec3| vector(v.to_array().map(numbers::plain).into());
    match light.kind {
        LightKind::Point { position, intensity } => {
            entries.extend([("position", place(position, origin)), ("intensity", plain(intensity))]);
        }
        LightKind::Directional { direction, irradiance } => {
            entries.extend([("direction", plain(direction)), ("irradiance", plain(irradiance))]);
        }
        // Only `--set` makes such a light of a chosen one, and saving writes its other keys.
        LightKind::Spot { .. } | LightKind::Area { .. } => {}
        // Materials and the sky state them.
        LightKind::Surface { .. } | LightKind::Sky { .. } => {}
    }
    table(entries)
}

/// A chosen sky as a node of the scene file.
pub(in crate::scene) fn sky_node(radiance: Vec3) -> Node {
    table(vec![("radiance", vector(radiance.to_array().map(numbers::plain).into()))])
}

/// A camera of a model's file.
pub(in crate::scene) fn file_camera_node(camera: &FileCamera) -> Node {
    let FileCamera { name, position, forward, up, fov_y_degrees, aspect } = camera;
    let width = (HEIGHT * aspect.unwrap_or(1.0).clamp(0.05, 20.0)).round();
    let size = [width, HEIGHT].map(|pixels| node(Kind::Integer(pixels as i64)));
    table(vec![
        ("name", Kind::Text(name.clone())),
        ("position", vector(*position)),
        ("target", vector(*position + *forward)),
        ("up", vector(*up)),
        ("fov_y", Kind::Float(fov_y_degrees.clamp(*camera::FOV_Y.start(), *camera::FOV_Y.end()))),
        ("size", Kind::Array(size.into())),
    ])
}

/// A light of a model's file.
pub(in crate::scene) fn file_light_node(light: &FileLight) -> Node {
    let FileLight { name, position, direction, emission, kind } = light;
    let named = ("name", Kind::Text(name.clone()));
    let (position, direction) = (("position", vector(*position)), ("direction", vector(*direction)));
    let word = |word: &str| ("kind", Kind::Text(word.to_owned()));
    match kind {
        FileLightKind::Point => table(vec![named, word("point"), position, ("intensity", vector(*emission))]),
        FileLightKind::Directional => {
            table(vec![named, word("directional"), direction, ("irradiance", vector(*emission))])
        }
        FileLightKind::Spot(angle, penumbra) => table(vec![
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
pub(in crate::scene) fn list(nodes: Vec<Node>) -> Node {
    node(Kind::Array(nodes))
}

fn node(kind: Kind) -> Node {
    Node { origin: Origin::Flag("chosen to fit".to_owned()), kind }
}

fn table(entries: Vec<(&str, Kind)>) -> Node {
    node(Kind::Table(entries.into_iter().map(|(key, kind)| (key.to_owned(), node(kind))).collect()))
}

fn vector(v: DVec3) -> Kind {
    Kind::Array(v.to_array().into_iter().map(|number| node(Kind::Float(number))).collect())
}

/// A recentred position in world coordinates.
fn place(position: Vec3, origin: DVec3) -> Kind {
    vector(DVec3::from_array([0, 1, 2].map(|axis| numbers::place(position[axis], origin[axis]))))
}
