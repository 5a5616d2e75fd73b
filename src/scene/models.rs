//! The models of a scene file, and the materials that the file changes.

use std::collections::{HashMap, HashSet};
use std::ops::Range;
use std::path::Path;

use glam::{DAffine3, DVec3, Vec3};

use super::builtin::{self, Files};
use super::cutouts::{self, Coverage};
use super::geometry::{Assembled, Mesh, assemble};
use super::material::{MAX_ALBEDO, Override};
use super::material_images::Given;
use super::panes::{self, Pane};
use super::reading::Reading;
use super::value::{Node, Section, unknown};
use super::{Material, OpacityMaps, fit, gltf, limits, obj};
use crate::files::guarded;
use crate::{Error, Result};

/// What is wrong with a material that is used and not defined.
pub(super) const NOWHERE: &str = "is defined nowhere: taken as grey";

/// The models of a scene, merged.
#[derive(Default)]
pub(super) struct Models {
    pub(super) meshes: Vec<Mesh>,
    /// Names of the objects that meshes belong to. Empty: all are one, named like the file.
    pub(super) objects: Vec<String>,
    pub(super) materials: Vec<Material>,
    /// Where each material is surface.
    pub(super) coverages: Vec<Coverage>,
    /// A warning for each material that is used but not defined, with its index.
    pub(super) undefined: Vec<(usize, String)>,
    /// Cameras and lights of the models' files, as nodes of the scene file.
    pub(super) cameras: Vec<Node>,
    pub(super) lights: Vec<Node>,
    /// Objects of each model; none if it is hidden.
    pub(super) of_models: Vec<Range<u32>>,
    /// Smallest and largest corner of each model, world space, metres. `None`: it is hidden.
    pub(super) boxes: Vec<Option<[DVec3; 2]>>,
    /// Whether each model can move.
    pub(super) are_movable: Vec<bool>,
}

/// Smallest and largest corner of meshes. `None` if they have no position.
pub(super) fn box_of(meshes: &[Mesh]) -> Option<[DVec3; 2]> {
    let mut positions = meshes.iter().flat_map(|mesh| &mesh.positions).copied();
    let first = positions.next()?;
    Some(positions.fold([first, first], |[low, high], place| [low.min(place), high.max(place)]))
}

pub(super) fn read_gltf(
    reading: &mut Reading,
    path: &Path,
    bytes: &[u8],
    world_from_file: &DAffine3,
) -> Result<Models> {
    let read = guarded("glTF", || Ok(gltf::load(reading, path, bytes, world_from_file)));
    let gltf::Model { meshes, objects, materials, coverages, cameras, lights } =
        read.map_err(|why| Error::input(path, why))??;
    Ok(Models {
        meshes,
        objects,
        materials,
        coverages,
        undefined: Vec::new(),
        cameras: cameras.iter().map(fit::file_camera_node).collect(),
        lights: lights.iter().map(fit::file_light_node).collect(),
        of_models: Vec::new(),
        boxes: Vec::new(),
        are_movable: Vec::new(),
    })
}

pub(super) fn of_one_mesh((mesh, material): (Mesh, Material)) -> Models {
    Models { meshes: vec![mesh], materials: vec![material], ..Models::default() }
}

pub(super) fn read_obj(reading: &mut Reading, path: &Path, bytes: Vec<u8>) -> Result<Models> {
    let obj::Model { meshes, objects, materials, coverages, undefined } = obj::load(reading, path, bytes)?;
    let undefined = undefined.into_iter().map(|(index, line)| {
        let name = &materials[index].name;
        (index, format!("{}:{line}: material {name:?} {NOWHERE}", path.display()))
    });
    Ok(Models { undefined: undefined.collect(), meshes, objects, materials, coverages, ..Models::default() })
}

/// An embedded or generated model.
pub(super) fn built_in(section: &Section, name: &str, reading: &mut Reading) -> Result<Models> {
    if section.get("file").is_some() {
        return Err(section.fault_at("built_in", "a model has either a file or a built-in name, not both"));
    }
    if let Some(bytes) = builtin::model(name) {
        refuse_triangles(section)?;
        reading.files = Files::Embedded;
        return read_obj(reading, &builtin::model_file(name), bytes);
    }
    let triangles = section.integer("triangles", lightpaths_models::TRIANGLES)?;
    let model = lightpaths_models::generate(name, triangles).ok_or_else(|| {
        let names = [&builtin::MODELS[..], &lightpaths_models::NAMES].concat();
        section.fault_at("built_in", unknown("built-in model", &names, name))
    })?;
    let mut models = Models::default();
    for (material, mesh) in (0..).zip(model.meshes) {
        let diffuse = Vec3::from(mesh.diffuse);
        models.materials.push(Material { diffuse, ..Material::neutral(mesh.material) });
        let lightpaths_models::Mesh { positions, normals, indices, .. } = mesh;
        models.meshes.push(Mesh { positions, normals, indices, material, ..Mesh::default() });
    }
    Ok(models)
}

pub(super) fn refuse_triangles(section: &Section) -> Result<()> {
    let [atrium, room] = lightpaths_models::NAMES;
    let message = format!("only the built-in models {atrium} and {room} can be had as fine as asked");
    if section.get("triangles").is_some() { Err(section.fault_at("triangles", message)) } else { Ok(()) }
}

/// What meshes show of their surface.
pub(super) struct Visible {
    pub(super) assembled: Assembled,
    pub(super) opacity: OpacityMaps,
    pub(super) panes: Vec<Pane>,
}

/// The triangles that are not hidden, their holes, and the panes. Fails with the reason if no
/// triangle is left.
pub(super) fn visible(
    models: &mut Models,
    warnings: &mut Vec<String>,
) -> std::result::Result<Visible, String> {
    let Models { meshes, coverages, .. } = models;
    let none = "no triangle is left: all models or materials are hidden, or hole everywhere";
    meshes.retain(|mesh| !matches!(coverages[mesh.material as usize], Coverage::Hidden));
    if meshes.is_empty() {
        return Err(none.to_owned());
    }
    let mut assembled = assemble(meshes, warnings)?;
    let panes = panes::taken_out(&mut assembled, coverages, warnings);
    let opacity = cutouts::cut(&mut assembled, coverages, warnings);
    if assembled.triangles.is_empty() {
        Err(none.to_owned())
    } else {
        Ok(Visible { assembled, opacity, panes })
    }
}

pub(super) fn override_materials(
    file: &Path,
    root: &Node,
    models: &mut Models,
    images: &HashMap<String, Given>,
    warnings: &mut Vec<String>,
) -> Result<()> {
    let Models { meshes, materials, coverages, undefined, .. } = models;
    let sections = Section::list(file, root, "material", limits::MATERIALS)?;
    let overrides = sections.iter().map(Override::read).collect::<Result<Vec<_>>>()?;
    refuse_repeated(&sections, overrides.iter().map(|change| change.name.as_str()))?;
    let mut named: HashMap<String, Vec<usize>> = HashMap::new();
    for (index, material) in materials.iter().enumerate() {
        named.entry(material.name.clone()).or_default().push(index);
    }
    for (section, change) in sections.iter().zip(&overrides) {
        let Some(found) = named.get(&change.name) else {
            let names: Vec<&str> = materials.iter().map(|material| material.name.as_str()).collect();
            return Err(section.fault_at("name", unknown("material", &names, &change.name)));
        };
        for &index in found {
            let own = meshes.iter_mut().filter(|mesh| mesh.material as usize == index);
            if let Some(given) = images.get(&change.name) {
                given.apply(&mut materials[index], own);
            } else if change.replaces_colour() {
                own.for_each(|mesh| mesh.colours.clear());
            }
            change.apply(&mut materials[index], &mut coverages[index]);
        }
    }
    let overridden: HashSet<&str> = overrides.iter().map(|change| change.name.as_str()).collect();
    let missing = undefined.drain(..).filter(|(index, _)| !overridden.contains(&*materials[*index].name));
    let missing: Vec<String> = missing.map(|(_, warning)| warning).collect();
    warnings.extend(counted(missing.first(), missing.len()));
    let mended: Vec<String> = materials
        .iter_mut()
        .zip(&*coverages)
        .filter(|(_, coverage)| !matches!(coverage, Coverage::Pane(_)))
        .filter_map(|(material, _)| material.conserve_energy().then(|| material.name.clone()))
        .collect();
    let first = mended.first().map(|name| {
        format!("material {name:?} reflected more than it receives: its highlights are dimmed, to an albedo of {MAX_ALBEDO}")
    });
    warnings.extend(counted(first.as_ref(), mended.len()));
    let bounded: Vec<String> = materials
        .iter_mut()
        .zip(&*coverages)
        .filter(|(_, coverage)| !matches!(coverage, Coverage::Pane(_)))
        .filter_map(|(material, _)| material.clamp_albedo().then(|| material.name.clone()))
        .collect();
    let first = bounded.first().map(|name| {
        format!("material {name:?} reflected all light or nearly all: scaled to an albedo of {MAX_ALBEDO}, because light between such surfaces hardly ends; state an albedo below that")
    });
    warnings.extend(counted(first.as_ref(), bounded.len()));
    Ok(())
}

/// The first warning, with the number of materials that it applies to.
pub(super) fn counted(first: Option<&String>, count: usize) -> Option<String> {
    first.map(
        |first| {
            if count == 1 { first.clone() } else { format!("{first} ({count} in all, this is the first)") }
        },
    )
}

pub(super) fn refuse_repeated<'a>(sections: &[Section], names: impl Iterator<Item = &'a str>) -> Result<()> {
    let mut seen = HashSet::new();
    for (section, name) in sections.iter().zip(names) {
        if !seen.insert(name) {
            return Err(section.fault_at("name", format!("{name:?} is there twice: names must differ")));
        }
    }
    Ok(())
}
