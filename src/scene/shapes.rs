//! Test scenes with known results.

use std::collections::HashMap;

use glam::{DVec3, Vec3};
use std::sync::Arc;

use super::{
    Camera, CellSizes, Light, LightKind, Material, OpacityMaps, PictureKeys, Quality, Scene, Triangle,
};

/// The inside of a sphere around the origin: an icosahedron whose faces were split into four
/// `subdivisions` times. It has 20·4ⁿ triangles with corners on the sphere, fronts and smooth
/// normals inward. It holds a point light of that flux in W, and a camera near the wall.
///
/// Indirect irradiance is Φ/(4πr²)·ρ/(1−ρ) everywhere, independent of the light's position.
pub fn integrating_sphere(radius: f32, subdivisions: u32, albedo: f32, light: Vec3, flux: f32) -> Scene {
    let material = Material { diffuse: Vec3::splat(albedo), ..Material::neutral("wall") };
    let triangles = icosphere(subdivisions)
        .into_iter()
        .map(|[a, b, c]| {
            // Reversed: the front is inside.
            let corners = [a, c, b];
            Triangle {
                positions: corners.map(|p| (f64::from(radius) * p).as_vec3()),
                normals: corners.map(|p| (-p).as_vec3()),
                material: 0,
                object: 0,
            }
        })
        .collect();
    let camera = camera(Vec3::Z * (0.9 * radius), Vec3::ZERO, 90.0);
    let light = point_light(light, flux / (4.0 * std::f32::consts::PI));
    scene("integrating_sphere", triangles, material, light, camera)
}

/// Two parallel squares of the given side, centred on the y axis, with their fronts towards
/// each other across `distance`. A point light of 1 W/sr is half-way. The lower pair of
/// triangles comes first.
pub fn facing_squares(side: f32, distance: f32, albedo: f32) -> Scene {
    let (s, d) = (0.5 * side, 0.5 * distance);
    let mut triangles = Vec::new();
    triangles.extend(quad(Vec3::new(-s, -d, s), Vec3::X * side, Vec3::NEG_Z * side));
    triangles.extend(quad(Vec3::new(-s, d, -s), Vec3::X * side, Vec3::Z * side));
    let material = Material { diffuse: Vec3::splat(albedo), ..Material::neutral("square") };
    let camera = camera(Vec3::new(0.0, 0.0, s + 2.0 * (s + d)), Vec3::ZERO, 60.0);
    scene("facing_squares", triangles, material, point_light(Vec3::ZERO, 1.0), camera)
}

/// A closed box around the origin with its fronts inside, a point light of 1 W/sr in the middle and
/// a camera inside.
pub fn closed_box(size: Vec3, albedo: f32) -> Scene {
    let material = Material { diffuse: Vec3::splat(albedo), ..Material::neutral("wall") };
    let camera = camera(Vec3::new(0.0, 0.0, 0.45 * size.z), Vec3::ZERO, 90.0);
    scene("closed_box", inward_box(size), material, point_light(Vec3::ZERO, 1.0), camera)
}

/// A closed box of 2×1×1 m, divided at x = 0 by a wall of 1 mm. The wall reaches past the box on
/// all sides, so that no crack is left. A light of 1 W/sr is in the left half. The camera is in the
/// right half, which must stay black.
pub fn thin_wall() -> Scene {
    let mut triangles = inward_box(Vec3::new(2.0, 1.0, 1.0));
    let (half, reach) = (0.000_5, 0.51);
    let [up, aside] = [Vec3::Y, Vec3::Z].map(|axis| axis * 2.0 * reach);
    triangles.extend(quad(Vec3::new(-half, -reach, -reach), aside, up));
    triangles.extend(quad(Vec3::new(half, -reach, -reach), up, aside));
    let camera = camera(Vec3::new(0.9, 0.0, 0.0), Vec3::ZERO, 60.0);
    scene(
        "thin_wall",
        triangles,
        Material::neutral("wall"),
        point_light(Vec3::new(-0.5, 0.1, 0.05), 1.0),
        camera,
    )
}

/// A cube of 2 m from inside. A screen (a square of that side, m) is parallel to the wall at x
/// = -1 and `gap` away from its middle. A point light of 1 W/sr is half-way between the two,
/// and a camera at the wall opposite. The screen hides the brightest surface from the room.
/// [Yue §5, Figure 3]
pub fn hidden_light(screen: f32, gap: f32, albedo: f32) -> Scene {
    let (s, x) = (0.5 * screen, gap - 1.0);
    let mut triangles = inward_box(Vec3::splat(2.0));
    triangles.extend(quad(Vec3::new(x, -s, -s), Vec3::Y * screen, Vec3::Z * screen));
    let material = Material { diffuse: Vec3::splat(albedo), ..Material::neutral("wall") };
    let light = point_light(Vec3::X * (0.5 * gap - 1.0), 1.0);
    scene("hidden_light", triangles, material, light, camera(Vec3::X * 0.9, Vec3::ZERO, 60.0))
}

fn scene(name: &str, triangles: Vec<Triangle>, material: Material, light: Light, camera: Camera) -> Scene {
    Scene {
        name: name.to_owned(),
        triangles,
        texture_coordinates: Vec::new(),
        opacity: OpacityMaps::default(),
        panes: Vec::new(),
        cell_sizes: CellSizes::default(),
        objects: vec![name.to_owned()],
        model_objects: Vec::new(),
        model_boxes: Vec::new(),
        model_is_movable: Vec::new(),
        picture: PictureKeys::default(),
        materials: vec![material],
        lights: vec![light],
        emission: Arc::default(),
        meters: Vec::new(),
        cameras: vec![camera],
        interior_viewpoints: Vec::new(),
        quality: Quality::default(),
        draft: Quality::DRAFT,
        origin: DVec3::ZERO,
        inputs: Vec::new(),
        warnings: Vec::new(),
    }
}

fn point_light(position: Vec3, intensity: f32) -> Light {
    let kind = LightKind::Point { position, intensity: Vec3::splat(intensity) };
    Light::new("lamp", kind)
}

fn camera(position: Vec3, target: Vec3, fov_y_degrees: f32) -> Camera {
    Camera { name: "camera".to_owned(), position, target, up: Vec3::Y, fov_y_degrees, size: [64, 64] }
}

/// Two triangles of a parallelogram whose front faces `u × v`.
fn quad(corner: Vec3, u: Vec3, v: Vec3) -> [Triangle; 2] {
    let [p0, p1, p2, p3] = [corner, corner + u, corner + u + v, corner + v];
    let normals = [u.cross(v).normalize(); 3];
    [[p0, p1, p2], [p0, p2, p3]].map(|positions| Triangle { positions, normals, material: 0, object: 0 })
}

fn inward_box(size: Vec3) -> Vec<Triangle> {
    let [x, y, z] = [Vec3::X * size.x, Vec3::Y * size.y, Vec3::Z * size.z];
    let (low, high) = (-0.5 * size, 0.5 * size);
    let walls = [
        quad(low, x, y),
        quad(low, y, z),
        quad(low, z, x),
        quad(high, -y, -x),
        quad(high, -z, -y),
        quad(high, -x, -z),
    ];
    walls.into_iter().flatten().collect()
}

/// Triangles of the subdivided icosahedron on the unit sphere, counter-clockwise from outside.
fn icosphere(subdivisions: u32) -> Vec<[DVec3; 3]> {
    let g = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut points: Vec<DVec3> = [(-1.0, g), (1.0, g), (-1.0, -g), (1.0, -g)]
        .into_iter()
        .flat_map(|(a, b)| [DVec3::new(a, b, 0.0), DVec3::new(0.0, a, b), DVec3::new(b, 0.0, a)])
        .map(DVec3::normalize)
        .collect();
    // A face of the icosahedron is any three corners that are pairwise nearest neighbours:
    // cos of 63.4°.
    let near = |i: usize, j: usize| points[i].dot(points[j]) > 0.4;
    let mut faces = Vec::new();
    for i in 0..points.len() {
        for j in i + 1..points.len() {
            for k in j + 1..points.len() {
                if near(i, j) && near(j, k) && near(k, i) {
                    let outward = (points[j] - points[i]).cross(points[k] - points[i]).dot(points[i]) > 0.0;
                    faces.push(if outward { [i, j, k] } else { [i, k, j] });
                }
            }
        }
    }
    for _ in 0..subdivisions {
        let mut middles = HashMap::new();
        let mut middle = |i: usize, j: usize| {
            *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                points.push((points[i] + points[j]).normalize());
                points.len() - 1
            })
        };
        faces = faces
            .into_iter()
            .flat_map(|[i, j, k]| {
                let [ij, jk, ki] = [middle(i, j), middle(j, k), middle(k, i)];
                [[i, ij, ki], [ij, j, jk], [ki, jk, k], [ij, jk, ki]]
            })
            .collect();
    }
    faces.into_iter().map(|face| face.map(|index| points[index])).collect()
}
