//! Reads models from glTF 2.0 files (`.gltf`, `.glb`): the meshes, cameras and lights of a scene's
//! nodes, and materials.

mod accessors;
mod buffers;
mod document;
mod materials;

use std::collections::HashMap;
use std::path::Path;
use std::rc::Rc;

use glam::{DAffine3, DMat4, DVec3};
use gltf::khr_lights_punctual::Kind;
use gltf::mesh::Mode;
use gltf::{Node, Primitive, Semantic};

use super::geometry::{Codes, Mesh, too_many};
use super::limits::{MATERIALS, TRIANGLES};
use super::material::Material;
use super::material_names::shown;
use super::reading::Reading;
use super::texture;
use super::value::printable;
use crate::scene::photometry::LUMENS_A_WATT;
use crate::{Error, Result};
use accessors::used;
use buffers::Buffers;
use materials::{Mapping, Materials};

/// Depth of nodes, and their number, where shared ones count for each parent.
const DEPTH: usize = 256;
const NODES: usize = 1 << 20;

/// The contents of a glTF file.
#[derive(Default)]
pub(super) struct Model {
    /// Triangles in world space; each mesh has one material.
    pub(super) meshes: Vec<Mesh>,
    /// Names of the nodes with meshes.
    pub(super) objects: Vec<String>,
    pub(super) materials: Vec<Material>,
    pub(super) coverages: Vec<super::cutouts::Coverage>,
    pub(super) cameras: Vec<FileCamera>,
    pub(super) lights: Vec<FileLight>,
}

/// A camera of the file, in world space.
pub(super) struct FileCamera {
    pub(super) name: String,
    pub(super) position: DVec3,
    pub(super) forward: DVec3,
    pub(super) up: DVec3,
    pub(super) fov_y_degrees: f64,
    /// Width over height. `None` if the file states none.
    pub(super) aspect: Option<f64>,
}

impl FileCamera {
    /// A camera of a scene that was recentred on `origin`.
    pub(super) fn of(camera: &super::Camera, origin: DVec3) -> Self {
        let [width, height] = camera.size.map(f64::from);
        Self {
            name: camera.name.clone(),
            position: camera.position.as_dvec3() + origin,
            forward: camera.frame()[2].as_dvec3(),
            up: camera.up.as_dvec3(),
            fov_y_degrees: f64::from(camera.fov_y_degrees),
            aspect: Some(width / height),
        }
    }
}

/// A light of the file, in world space.
pub(super) struct FileLight {
    pub(super) name: String,
    pub(super) position: DVec3,
    pub(super) direction: DVec3,
    /// W/sr, or W/m² of a directional light.
    pub(super) emission: DVec3,
    pub(super) kind: FileLightKind,
}

pub(super) enum FileLightKind {
    Point,
    /// Half-angle in degrees, and the fraction of it over which the intensity falls.
    Spot(f64, f64),
    Directional,
}

/// Reads the contents of `path`, and the buffers and images that it names relative to itself.
/// `world_from_file` places cameras and lights; meshes stay in the space of the file.
///
/// Fails with the file's name on damaged or compressed geometry, without any triangle, or above a
/// limit. Notes everything else that is not read.
pub(super) fn load(
    reading: &mut Reading,
    path: &Path,
    bytes: &[u8],
    world_from_file: &DAffine3,
) -> Result<Model> {
    let (document, binary) = document::parse(bytes).map_err(|message| Error::input(path, message))?;
    let required = document::required(&document);
    let fault = |message: String| {
        let hint = required.as_ref().map(|name| format!("; the file requires {name}, which is not read"));
        Error::input(path, message + &hint.unwrap_or_default())
    };
    document::note_unread(reading, path, &document);
    let buffers = Buffers::read(reading, path, &document, binary).map_err(&fault)?;
    let materials = Materials::read(reading, path, &document, &buffers).map_err(&fault)?;
    let scene = document.default_scene().or_else(|| document.scenes().next());
    let roots: Vec<Node> = match &scene {
        Some(scene) => scene.nodes().collect(),
        None => document.nodes().collect(),
    };
    if document.scenes().len() > 1 {
        reading.notes.add("of several scenes the default one is read", || shown(path));
    }
    let mut walk = Walk {
        reading,
        path,
        buffers: &buffers,
        mappings: &materials.mappings,
        world_from_file: *world_from_file,
        nodes: 0,
        triangles: 0,
        lists: HashMap::new(),
        model: Model::default(),
    };
    for root in roots {
        walk.node(&root, DAffine3::IDENTITY, 0).map_err(&fault)?;
    }
    let mut model = walk.model;
    if model.meshes.is_empty() {
        return Err(fault("holds no triangle: points and lines have no surface".to_owned()));
    }
    if materials.all.len() > MATERIALS {
        return Err(fault(super::material_names::too_many_materials()));
    }
    (model.materials, model.coverages) = (materials.all, materials.coverages);
    Ok(model)
}

/// The nodes of a scene while they are visited.
struct Walk<'a, 'b> {
    reading: &'a mut Reading<'b>,
    path: &'a Path,
    buffers: &'a Buffers,
    mappings: &'a HashMap<usize, Mapping>,
    world_from_file: DAffine3,
    nodes: usize,
    triangles: usize,
    /// Lists by accessor: meshes and primitives share them.
    lists: HashMap<usize, Rc<Vec<DVec3>>>,
    model: Model,
}

type Checking<T> = std::result::Result<T, String>;

impl Walk<'_, '_> {
    fn note(&mut self, what: &str) {
        let path = self.path;
        self.reading.notes.add(what, || shown(path));
    }

    fn node(&mut self, node: &Node, parent: DAffine3, depth: usize) -> Checking<()> {
        self.nodes += 1;
        if depth > DEPTH || self.nodes > NODES {
            return Err(format!("has nodes more than {DEPTH} deep, or more than {NODES}"));
        }
        let columns = node.transform().matrix().map(|column| column.map(f64::from));
        let local = DMat4::from_cols_array_2d(&columns);
        let to_file = parent * DAffine3::from_mat4(local);
        if let Some(mesh) = node.mesh() {
            // A mirror of scale zero has no inverse for normals, and its triangles no area.
            if to_file.matrix3.determinant() == 0.0 {
                self.note("nodes scaled to zero are left out");
            } else {
                if node.skin().is_some() {
                    self.note("skins are passed over: meshes are in their first pose");
                }
                let name = node.name().or(mesh.name()).filter(|name| !name.is_empty());
                self.model.objects.push(name.map_or_else(|| "mesh".to_owned(), printable));
                for primitive in mesh.primitives() {
                    self.primitive(&primitive, &to_file)?;
                }
            }
        }
        let place = self.world_from_file * to_file;
        let forward = place.transform_vector3(DVec3::NEG_Z).normalize_or(DVec3::NEG_Z);
        if let Some(camera) = node.camera() {
            self.camera(&camera, node.name(), &place, forward);
        }
        if let Some(light) = node.light() {
            self.light(&light, node.name(), place.translation, forward);
        }
        for child in node.children() {
            self.node(&child, to_file, depth + 1)?;
        }
        Ok(())
    }

    fn camera(&mut self, camera: &gltf::Camera, node: Option<&str>, place: &DAffine3, forward: DVec3) {
        let gltf::camera::Projection::Perspective(lens) = camera.projection() else {
            return self.note("orthographic cameras are passed over");
        };
        self.model.cameras.push(FileCamera {
            name: unique(camera.name().or(node), "camera", |name| {
                self.model.cameras.iter().any(|camera| camera.name == name)
            }),
            position: place.translation,
            forward,
            up: place.transform_vector3(DVec3::Y).normalize_or(DVec3::Y),
            fov_y_degrees: f64::from(lens.yfov()).to_degrees(),
            aspect: lens.aspect_ratio().map(f64::from),
        });
    }

    fn light(
        &mut self,
        light: &gltf::khr_lights_punctual::Light,
        node: Option<&str>,
        position: DVec3,
        direction: DVec3,
    ) {
        let kind = match light.kind() {
            Kind::Point => FileLightKind::Point,
            Kind::Directional => FileLightKind::Directional,
            Kind::Spot { inner_cone_angle, outer_cone_angle } => {
                let outer = f64::from(outer_cone_angle);
                FileLightKind::Spot(outer.to_degrees(), 1.0 - f64::from(inner_cone_angle) / outer.max(1e-6))
            }
        };
        if light.range().is_some() {
            self.note("ranges of lights are passed over: light falls with the square of the distance");
        }
        let intensity = f64::from(light.intensity()) / LUMENS_A_WATT;
        self.model.lights.push(FileLight {
            name: unique(light.name().or(node), "light", |name| {
                self.model.lights.iter().any(|light| light.name == name)
            }),
            position,
            direction,
            emission: intensity * DVec3::from(light.color().map(f64::from)),
            kind,
        });
    }

    fn primitive(&mut self, primitive: &Primitive, to_file: &DAffine3) -> Checking<()> {
        let Some(positions) = primitive.get(&Semantic::Positions) else {
            self.note("primitives without positions are left out");
            return Ok(());
        };
        if !matches!(primitive.mode(), Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan) {
            self.note("points and lines are left out");
            return Ok(());
        }
        let positions = self.list(&positions)?;
        let corners = match primitive.indices() {
            Some(indices) => self.buffers.indices(&indices, positions.len())?,
            None => (0..positions.len() as u32).collect(),
        };
        let indices: Vec<u32> = match primitive.mode() {
            Mode::TriangleStrip => {
                let turned = |(index, c): (usize, &[u32])| [c[0], c[1 + index % 2], c[2 - index % 2]];
                corners.windows(3).enumerate().flat_map(turned).collect()
            }
            Mode::TriangleFan => {
                let around = |c: &[u32]| [corners[0], c[0], c[1]];
                corners.get(1..).unwrap_or(&[]).windows(2).flat_map(around).collect()
            }
            _ => corners[..corners.len() / 3 * 3].to_vec(),
        };
        self.triangles += indices.len() / 3;
        if self.triangles > TRIANGLES {
            return Err(too_many(self.triangles));
        }
        if indices.is_empty() {
            return Ok(());
        }
        self.note_attributes(primitive);
        let normals = self.list_of(primitive.get(&Semantic::Normals))?;
        let colours = self.list_of(primitive.get(&Semantic::Colors(0)))?;
        let index = primitive.material().index().unwrap_or(usize::MAX);
        let mapping = self.mappings.get(&index).ok_or("names a material that does not exist")?;
        let coordinates =
            self.list_of(mapping.set.and_then(|set| primitive.get(&Semantic::TexCoords(set))))?;
        if mapping.set.is_some() && !mapping.is_given && coordinates.is_empty() {
            self.note("meshes of materials with an image have no texture coordinates");
        }
        let is_good = |list: &[DVec3]| list.is_empty() || list.len() == positions.len();
        if !is_good(&normals) || !is_good(&coordinates) || !is_good(&colours) {
            return Err("has attributes of different lengths in one mesh".to_owned());
        }
        let (used, indices) = used(indices, positions.len());
        let of_used =
            |list: &[DVec3]| used.iter().filter_map(|&index| list.get(index as usize).copied()).collect();
        let place = |index: &u32| mapping.place(coordinates.get(*index as usize)?.truncate()).into();
        let mut mesh = Mesh {
            positions: of_used(&positions),
            normals: of_used(&normals),
            coordinates: used.iter().filter_map(place).collect(),
            laid_size: None,
            colours: of_used(&colours).into_iter().map(codes).collect(),
            indices,
            material: mapping.material,
            objects: vec![(0, self.model.objects.len() as u32 - 1)],
        };
        mesh.transform(to_file);
        self.model.meshes.push(mesh);
        Ok(())
    }

    /// Empty if there is no accessor.
    fn list_of(&mut self, accessor: Option<gltf::Accessor>) -> Checking<Rc<Vec<DVec3>>> {
        accessor.map_or(Ok(Rc::default()), |accessor| self.list(&accessor))
    }

    fn list(&mut self, accessor: &gltf::Accessor) -> Checking<Rc<Vec<DVec3>>> {
        if let Some(list) = self.lists.get(&accessor.index()) {
            return Ok(list.clone());
        }
        let list = Rc::new(self.buffers.vectors(accessor)?);
        self.lists.insert(accessor.index(), list.clone());
        Ok(list)
    }

    fn note_attributes(&mut self, primitive: &Primitive) {
        if primitive.morph_targets().len() > 0 {
            self.note("morph targets are passed over: meshes have their first shape");
        }
    }
}

/// sRGB codes of a linear colour.
fn codes(colour: DVec3) -> Codes {
    colour.as_vec3().to_array().map(texture::code)
}

/// A printable name that no other item has.
fn unique(stated: Option<&str>, kind: &str, is_taken: impl Fn(&str) -> bool) -> String {
    let base = stated.filter(|name| !name.is_empty()).map_or_else(|| kind.to_owned(), printable);
    let numbered = (2..).map(|number| format!("{base} {number}"));
    std::iter::once(base.clone()).chain(numbered).find(|name| !is_taken(name)).expect("numbers do not end")
}
