//! Conversion of indexed meshes in world space to checked, recentred triangles.

use std::collections::HashSet;

use glam::{DAffine3, DMat3, DVec2, DVec3, Vec2, Vec3};

use super::Triangle;
use super::limits::TRIANGLES;

/// An sRGB code for each channel.
pub(super) type Codes = [u8; 3];

pub(super) const WHITE: Codes = [u8::MAX; 3];

/// A triangle is dropped if twice its area is below this fraction of its longest edge squared: in
/// f32 coordinates, such a sliver is a line.
const SLIVER: f64 = 1e-8;
/// Longest axis of a scene, metres. Outside this range, squares and cubes of lengths leave the
/// range of f32.
const EXTENT_M: std::ops::RangeInclusive<f64> = 1e-9..=1e9;

/// Indexed triangles of one material, in f64.
#[derive(Clone, Debug, Default)]
pub(super) struct Mesh {
    pub(super) positions: Vec<DVec3>,
    /// One per position, not necessarily unit; or empty.
    pub(super) normals: Vec<DVec3>,
    /// Image coordinates, one per position; empty if the material has no image.
    pub(super) coordinates: Vec<DVec2>,
    /// Size of an image that is laid on faces without image coordinates, metres. `None`: they show
    /// one corner of the image.
    pub(super) laid_size: Option<DVec2>,
    /// Colours as sRGB codes, one per position; empty if the model has none.
    pub(super) colours: Vec<Codes>,
    /// Three per triangle.
    pub(super) indices: Vec<u32>,
    pub(super) material: u32,
    /// Objects of the model, each with the first triangle of its part, in order. Empty: all
    /// triangles belong to the model's first object.
    pub(super) objects: Vec<(u32, u32)>,
}

impl Mesh {
    /// Counts the objects from another first one on.
    pub(super) fn offset_objects(&mut self, first: u32) {
        if self.objects.is_empty() {
            self.objects.push((0, 0));
        }
        self.objects.iter_mut().for_each(|(_, object)| *object += first);
    }

    /// Image coordinates of a triangle's corners.
    fn image_coordinates(&self, corners: [usize; 3]) -> [DVec2; 3] {
        match self.laid_size {
            Some(size) if self.coordinates.is_empty() => {
                let places = laid(corners.map(|index| self.positions[index])).map(|place| place / size);
                // Images repeat: small numbers are exact in f32.
                let whole = places[0].floor();
                places.map(|place| place - whole)
            }
            _ => corners.map(|index| self.coordinates.get(index).copied().unwrap_or_default()),
        }
    }

    /// The object of a triangle.
    fn object(&self, triangle: usize) -> u32 {
        let after = self.objects.partition_point(|(first, _)| *first as usize <= triangle);
        after.checked_sub(1).map_or(0, |part| self.objects[part].1)
    }

    /// Applies an invertible transform. Normals stay on their side, and a mirror image
    /// keeps its front.
    pub(super) fn transform(&mut self, world_from_local: &DAffine3) {
        let normal_matrix: DMat3 = world_from_local.matrix3.inverse().transpose();
        self.positions.iter_mut().for_each(|p| *p = world_from_local.transform_point3(*p));
        self.normals.iter_mut().for_each(|n| *n = normal_matrix * *n);
        if world_from_local.matrix3.determinant() < 0.0 {
            self.indices.chunks_exact_mut(3).for_each(|corners| corners.swap(1, 2));
        }
    }
}

/// Numbers of repaired triangles.
#[derive(Default)]
struct Repairs {
    degenerate: usize,
    duplicate: usize,
    bad_normals: usize,
    flipped_normals: usize,
}

/// Triangles of all meshes, recentred.
pub(super) struct Assembled {
    pub(super) triangles: Vec<Triangle>,
    /// Image coordinates of each triangle's corners; empty if no mesh has any.
    pub(super) coordinates: Vec<[Vec2; 3]>,
    /// Colours of each triangle's corners, white where a mesh has none; empty if no mesh has any.
    pub(super) colours: Vec<[Codes; 3]>,
    /// Offset subtracted from all positions.
    pub(super) origin: DVec3,
}

/// The message for more triangles than the 32-bit offsets of the acceleration structure allow,
/// with a margin.
pub(super) fn too_many(count: usize) -> String {
    format!("{count} triangles are too many: at most {TRIANGLES} can be traced")
}

/// Recentres the meshes on the middle of their bounding box. Drops degenerate and repeated
/// triangles. Fails with the reason if nothing usable is left.
pub(super) fn assemble(meshes: &[Mesh], warnings: &mut Vec<String>) -> Result<Assembled, String> {
    let count: usize = meshes.iter().map(|mesh| mesh.indices.len() / 3).sum();
    if count > TRIANGLES {
        return Err(too_many(count));
    }
    // A transform may produce infinities, and minima and maxima ignore NaN.
    if !meshes.iter().flat_map(|mesh| &mesh.positions).all(|p| p.is_finite()) {
        return Err("the model is infinitely large with its transform: scale it".to_owned());
    }
    let points = meshes.iter().flat_map(|mesh| &mesh.positions);
    let (low, high) =
        points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(*p), high.max(*p)));
    let extent = (high - low).max_element();
    if count > 0 && !EXTENT_M.contains(&extent) {
        let (least, most) = (EXTENT_M.start(), EXTENT_M.end());
        return Err(format!("the model is {extent:e} m large, {least:e} to {most:e} m expected: scale it"));
    }
    // An origin that is exact in f32 reaches shaders and files without loss.
    let origin = (0.5 * (low + high)).as_vec3().as_dvec3();
    let mut repairs = Repairs::default();
    let mut seen = HashSet::with_capacity(count);
    let mut triangles = Vec::with_capacity(count);
    let has_coordinates = meshes.iter().any(|mesh| !mesh.coordinates.is_empty() || mesh.laid_size.is_some());
    let has_colours = meshes.iter().any(|mesh| !mesh.colours.is_empty());
    let (mut coordinates, mut colours) = (Vec::new(), Vec::new());
    for mesh in meshes {
        for (number, corners) in mesh.indices.chunks_exact(3).enumerate() {
            let corners = [corners[0], corners[1], corners[2]].map(|index| index as usize);
            let positions = corners.map(|index| (mesh.positions[index] - origin).as_vec3());
            if is_degenerate(positions) {
                repairs.degenerate += 1;
            } else if !seen.insert(identity(positions)) {
                repairs.duplicate += 1;
            } else {
                let (material, object) = (mesh.material, mesh.object(number));
                let mut triangle = Triangle { positions, normals: [Vec3::ZERO; 3], material, object };
                let stated = corners.map(|index| mesh.normals.get(index).copied());
                triangle.normals = shading_normals(&triangle, stated, &mut repairs);
                triangles.push(triangle);
                if has_coordinates {
                    coordinates.push(mesh.image_coordinates(corners).map(|place| place.as_vec2()));
                }
                if has_colours {
                    colours.push(corners.map(|index| mesh.colours.get(index).copied().unwrap_or(WHITE)));
                }
            }
        }
    }
    warnings.extend(repairs.warning());
    if triangles.is_empty() {
        return Err(format!("no triangle with an area is left of {count}"));
    }
    Ok(Assembled { triangles, coordinates, colours, origin })
}

/// A triangle's corners on the coordinate plane that it faces most, metres: images stand upright on
/// walls, and neighbours in one plane continue each other.
fn laid(positions: [DVec3; 3]) -> [DVec2; 3] {
    let [p0, p1, p2] = positions;
    let facing = (p1 - p0).cross(p2 - p0).abs();
    positions.map(|DVec3 { x, y, z }| match facing {
        DVec3 { y: up, .. } if up >= facing.max_element() => DVec2::new(x, -z),
        DVec3 { x: along, .. } if along >= facing.z => DVec2::new(z, y),
        _ => DVec2::new(x, y),
    })
}

fn is_degenerate(positions: [Vec3; 3]) -> bool {
    let [p0, p1, p2] = positions.map(Vec3::as_dvec3);
    let longest_squared =
        (p1 - p0).length_squared().max((p2 - p0).length_squared()).max((p2 - p1).length_squared());
    let double_area = (p1 - p0).cross(p2 - p0).length();
    double_area <= (SLIVER * longest_squared).max(f64::from(f32::MIN_POSITIVE))
}

/// A key that is equal for triangles with the same corners, in either winding: surfaces
/// have two sides.
fn identity(positions: [Vec3; 3]) -> [[u32; 3]; 3] {
    // Adding zero makes -0 equal to 0.
    let mut corners = positions.map(|p| (p + 0.0).to_array().map(f32::to_bits));
    corners.sort_unstable();
    corners
}

/// The model's normals if usable: unit, and on the front side.
fn shading_normals(triangle: &Triangle, stated: [Option<DVec3>; 3], repairs: &mut Repairs) -> [Vec3; 3] {
    let front = triangle.cross().normalize();
    let unit = stated.map(|normal| normal.filter(|n| n.is_finite()).and_then(DVec3::try_normalize));
    let is_bad = |index: usize| stated[index].is_some() && unit[index].is_none();
    repairs.bad_normals += usize::from((0..3).any(is_bad));
    // If the sum of the normals opposes the winding, the normals belong to the other side. A single
    // normal that opposes the rest is replaced by the face's own normal.
    let together: f64 = unit.iter().flatten().map(|n| n.dot(front)).sum();
    let side = if together < 0.0 { -1.0 } else { 1.0 };
    let leans_over = |n: DVec3| side * n.dot(front) <= 0.0;
    repairs.flipped_normals += usize::from(side < 0.0 || unit.iter().flatten().any(|n| leans_over(*n)));
    unit.map(|n| n.filter(|n| !leans_over(*n)).map_or(front, |n| side * n).as_vec3().normalize())
}

impl Repairs {
    /// The warning about repaired triangles. `None` if there are none.
    fn warning(&self) -> Option<String> {
        let parts: Vec<String> = [
            (self.degenerate, "without area dropped"),
            (self.duplicate, "that repeat another dropped"),
            (self.bad_normals, "with zero or non-finite normals given their face's normal"),
            (self.flipped_normals, "with normals against their front side turned"),
        ]
        .into_iter()
        .filter(|(count, _)| *count > 0)
        .map(|(count, what)| format!("{count} {what}"))
        .collect();
        (!parts.is_empty()).then(|| format!("triangles repaired: {}", parts.join(", ")))
    }
}
