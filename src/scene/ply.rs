//! Reads models from PLY files, as text or binary: vertices with normals and colours, and polygons.

use std::io::Read;
use std::path::Path;

use glam::{DVec3, Vec3};
use serde::Deserialize;
use serde_ply::{ElementDef, PlyFormat, PlyReader, PropertyType, ScalarType};

use super::geometry::{Codes, Mesh, WHITE, too_many};
use super::limits::TRIANGLES;
use super::material::Material;
use super::material_names::{NO_MATERIAL, shown};
use super::polygons::Triangulator;
use super::reading::Reading;
use super::value::{excerpt, printable};

/// A row of the element `vertex`.
#[derive(Deserialize)]
struct Vertex {
    x: f64,
    y: f64,
    z: f64,
    #[serde(default)]
    nx: Option<f64>,
    #[serde(default)]
    ny: Option<f64>,
    #[serde(default)]
    nz: Option<f64>,
    #[serde(default, alias = "diffuse_red")]
    red: Option<f64>,
    #[serde(default, alias = "diffuse_green")]
    green: Option<f64>,
    #[serde(default, alias = "diffuse_blue")]
    blue: Option<f64>,
}

/// A row of the element `face`.
#[derive(Deserialize)]
struct Face {
    #[serde(alias = "vertex_index")]
    vertex_indices: Vec<u32>,
}

/// A row of the element `tristrips`: strips of triangles, each ended by -1.
#[derive(Deserialize)]
struct Strips {
    #[serde(alias = "vertex_index")]
    vertex_indices: Vec<i64>,
}

/// A row that is skipped.
#[derive(Deserialize)]
struct Skipped {}

type Checking<T> = Result<T, String>;

/// Reads the contents of `path`. Fails with a reason that follows the file's name.
pub(super) fn load(reading: &mut Reading, path: &Path, bytes: &[u8]) -> Checking<(Mesh, Material)> {
    let fault = |error: serde_ply::DeserializeError| match error.0.to_string() {
        text if text.contains("failed to fill whole buffer") => {
            "is no readable PLY: it ends early".to_owned()
        }
        text => format!("is no readable PLY: {}", printable(&text.replace('\n', " "))),
    };
    let header = PlyReader::from_reader(bytes).map_err(fault)?.header().clone();
    // The last word of a text may lack the blank by which the crate finds its end.
    let end: &[u8] = if header.format == PlyFormat::Ascii { b"\n" } else { b"" };
    let mut reader = PlyReader::from_reader(bytes.chain(end)).map_err(fault)?;
    if header.comments.iter().any(|comment| comment.starts_with("TextureFile")) {
        reading.notes.add("images of PLY files are passed over", || shown(path));
    }
    let mut model = Model::default();
    while let Some(element) = reader.current_element().cloned() {
        check(&element, bytes.len())?;
        match element.name.as_str() {
            "vertex" if model.positions.is_empty() => {
                let largest = largest_colour(&element);
                for vertex in reader.next_element::<Vec<Vertex>>().map_err(fault)? {
                    model.vertex(&vertex, largest)?;
                }
            }
            "face" => model.faces(reader.next_element::<Vec<Face>>().map_err(fault)?)?,
            "tristrips" => {
                for strips in reader.next_element::<Vec<Strips>>().map_err(fault)? {
                    model.strips(&strips.vertex_indices)?;
                }
            }
            name => {
                let name = excerpt(name);
                reading.notes.add_named("elements of PLY files are passed over", &name, || shown(path));
                reader.next_element::<Vec<Skipped>>().map_err(fault)?;
            }
        }
    }
    model.finish(reading, path)
}

/// Refuses rows that take no byte of the file, and more rows than the file can hold.
fn check(element: &ElementDef, bytes: usize) -> Checking<()> {
    if element.count > bytes || element.count > 0 && element.properties.is_empty() {
        let (name, count) = (excerpt(&element.name), element.count);
        return Err(format!("is damaged: it cannot hold {count} elements {name}"));
    }
    Ok(())
}

/// The value of full intensity: 1 for floats, 255 and 65 535 for integers.
fn largest_colour(element: &ElementDef) -> f64 {
    let names = ["red", "diffuse_red"];
    let found = names.iter().find_map(|name| element.get_property(name));
    match found.map(|property| &property.property_type) {
        Some(PropertyType::Scalar(ScalarType::F32 | ScalarType::F64)) => 1.0,
        Some(PropertyType::Scalar(ScalarType::U16 | ScalarType::I16)) => 65_535.0,
        _ => 255.0,
    }
}

#[derive(Default)]
struct Model {
    positions: Vec<DVec3>,
    normals: Vec<DVec3>,
    colours: Vec<Codes>,
    faces: Vec<Face>,
}

impl Model {
    fn vertex(&mut self, vertex: &Vertex, largest: f64) -> Checking<()> {
        let position = DVec3::new(vertex.x, vertex.y, vertex.z);
        if !position.is_finite() {
            return Err(format!("has a vertex that is not finite: number {}", self.positions.len()));
        }
        self.positions.push(position);
        if let (Some(x), Some(y), Some(z)) = (vertex.nx, vertex.ny, vertex.nz) {
            self.normals.push(DVec3::new(x, y, z));
        }
        if let (Some(red), Some(green), Some(blue)) = (vertex.red, vertex.green, vertex.blue) {
            self.colours.push([red, green, blue].map(|value| (255.0 * value / largest).round() as u8));
        }
        Ok(())
    }

    fn faces(&mut self, faces: Vec<Face>) -> Checking<()> {
        self.faces.extend(faces);
        let triangles = self.faces.iter().map(|face| face.vertex_indices.len().saturating_sub(2)).sum();
        if triangles > TRIANGLES { Err(too_many(triangles)) } else { Ok(()) }
    }

    fn strips(&mut self, indices: &[i64]) -> Checking<()> {
        let mut faces = Vec::new();
        for strip in indices.split(|&index| index == -1) {
            let strip: Vec<u32> =
                strip.iter().map(|&index| u32::try_from(index).unwrap_or(u32::MAX)).collect();
            let turned = |(index, c): (usize, &[u32])| [c[0], c[1 + index % 2], c[2 - index % 2]];
            // Strips turn by repeating a corner.
            let triangles =
                strip.windows(3).enumerate().map(turned).filter(|[a, b, c]| a != b && b != c && c != a);
            faces.extend(triangles.map(|corners| Face { vertex_indices: corners.to_vec() }));
        }
        self.faces(faces)
    }

    fn finish(self, reading: &mut Reading, path: &Path) -> Checking<(Mesh, Material)> {
        let (mut triangulator, mut indices) = (Triangulator::default(), Vec::new());
        let count = self.positions.len();
        for face in &self.faces {
            let corners = &face.vertex_indices;
            if let Some(index) = corners.iter().find(|&&index| index as usize >= count) {
                return Err(format!("is damaged: a face names vertex {index}, there are {count}"));
            }
            if corners.len() < 3 {
                reading.notes.add("faces with fewer than 3 corners are passed over", || shown(path));
            } else {
                triangulator.divide(&self.positions, corners, &mut indices);
            }
        }
        if indices.is_empty() {
            return Err("holds no face: clouds of points have no surface".to_owned());
        }
        let what = "polygons cross themselves, are bent or have too many corners, and no triangles cover them exactly";
        reading.notes.add_total(triangulator.inexact, what, || shown(path));
        let mut material = Material::neutral(NO_MATERIAL);
        if self.colours.iter().any(|codes| *codes != WHITE) {
            material.diffuse = Vec3::ONE;
        }
        let Self { positions, normals, colours, .. } = self;
        Ok((Mesh { positions, normals, colours, indices, ..Mesh::default() }, material))
    }
}
