//! Reads models from OBJ files.

use std::collections::{HashMap, HashSet};
use std::path::{Path, PathBuf};

use glam::{DVec3, Vec3};

use super::cutouts::Coverage;
use super::geometry::{Mesh, WHITE};
use super::limits::{LIBRARIES, MATERIALS, MTL_BYTES};
use super::lines::decode;
use super::material::Material;
use super::material_names::{NO_MATERIAL, shown, too_many_materials};
use super::mtl;
use super::mtl_draft::Definition;
use super::obj_lines::{self, Contents, Corner, Group};
use super::polygons::Triangulator;
use super::reading::{OTHER_NAME, Reading};
use super::smoothing::Smoothing;
use super::value::{excerpt, printable};
use crate::{Error, Result};

/// The contents of an OBJ file and its MTL files.
pub(super) struct Model {
    /// Triangles; each mesh is a sequence of faces with one material.
    pub(super) meshes: Vec<Mesh>,
    /// Names of the objects that faces belong to. Empty if the file names none.
    pub(super) objects: Vec<String>,
    /// Every material that is defined or used.
    pub(super) materials: Vec<Material>,
    /// Where each material is surface.
    pub(super) coverages: Vec<Coverage>,
    /// Materials that are used but not defined: index, and line of their first use. They are
    /// neutral until overridden.
    pub(super) undefined: Vec<(usize, usize)>,
}

/// Reads the contents of `path`, and the MTL files that it names relative to itself. Notes
/// ignored and repaired statements.
///
/// Fails with file and line on positions that are not finite and on vertex indices out of range.
/// Also fails without any face, or above a limit.
pub(super) fn load(reading: &mut Reading, path: &Path, bytes: Vec<u8>) -> Result<Model> {
    let text = decoded(reading, path, bytes);
    let mut contents = obj_lines::read(path, &text)?;
    drop(text);
    let mut definitions = read_libraries(reading, path, &contents.libraries)?;
    let mut undefined = Vec::new();
    let named = |(index, definition): (usize, &Definition)| (definition.material.name.clone(), index);
    let known: HashMap<String, usize> = definitions.iter().enumerate().map(named).collect();
    let used = contents.used.iter().map(|(line, name)| {
        if let Some(&index) = known.get(name) {
            return index;
        }
        if name != NO_MATERIAL {
            undefined.push((definitions.len(), *line));
        }
        definitions.push(Definition::new(Material::neutral(name)));
        definitions.len() - 1
    });
    let used: Vec<usize> = used.collect();
    if contents.colours.iter().any(|colour| *colour != Vec3::ONE) {
        // Colours stand alone where the material states none.
        let uncoloured = definitions.iter_mut().filter(|definition| !definition.states_colour);
        uncoloured.for_each(|definition| definition.material.diffuse = Vec3::ONE);
    }
    for definition in &mut definitions {
        definition.is_given_image = reading.gives_image(&definition.material.name);
    }
    reading.notes.absorb(std::mem::take(&mut contents.notes));
    let objects = object_names(&mut contents, path);
    let meshes = meshes(reading, path, contents, &used, &definitions)?;
    let of_definition = |definition: Definition| (definition.material, definition.coverage);
    let (materials, coverages) = definitions.into_iter().map(of_definition).unzip();
    Ok(Model { meshes, objects, materials, coverages, undefined })
}

/// Names of the objects; faces without one belong to an object that is named like the file.
fn object_names(contents: &mut Contents, path: &Path) -> Vec<String> {
    let mut names = std::mem::take(&mut contents.objects);
    if let Some(nameless) = names.iter_mut().find(|name| name.is_empty()) {
        *nameless = printable(&path.file_stem().unwrap_or_default().to_string_lossy());
    }
    names
}

/// Decodes the text of a file; notes if it is not UTF-8.
fn decoded(reading: &mut Reading, path: &Path, bytes: Vec<u8>) -> String {
    let (text, is_utf8) = decode(bytes);
    if !is_utf8 {
        reading
            .notes
            .add("the text is not UTF-8, and is taken as Latin-1 (or UTF-16, where it is marked so)", || {
                shown(path)
            });
    }
    text
}

/// Reads the definitions of the MTL files; notes unreadable files.
fn read_libraries(reading: &mut Reading, path: &Path, lines: &[(usize, String)]) -> Result<Vec<Definition>> {
    let mut definitions: Vec<Definition> = Vec::new();
    let mut seen = HashSet::new();
    for (line, names) in lines {
        let place = || format!("{}:{line}", shown(path));
        let (files, mut refused) = find_libraries(reading, path, names, place);
        for file in files.into_iter().filter(|file| seen.insert(file.clone())) {
            match reading.read(&file, MTL_BYTES) {
                Ok(bytes) => {
                    let text = decoded(reading, &file, bytes);
                    definitions.extend(mtl::load(reading, &file, &text)?);
                }
                Err(why) => refused.push(format!("{:?} {why}", shown(&file))),
            }
            keep_last(&mut definitions);
            if definitions.len() > MATERIALS {
                return Err(Error::input_at(path, *line, too_many_materials()));
            }
        }
        for what in refused {
            let kind = "mtllib: libraries that cannot be used are left out, and what they define is grey";
            reading.notes.add_named(kind, &what, place);
        }
    }
    Ok(definitions)
}

/// The MTL files that a line names: one whose name may contain spaces, or several. Also the faults
/// of the others.
fn find_libraries(
    reading: &mut Reading,
    path: &Path,
    line: &str,
    place: impl Fn() -> String,
) -> (Vec<PathBuf>, Vec<String>) {
    let (mut found, mut refused) = (Vec::new(), Vec::new());
    let whole = path.with_file_name("").join(line);
    let names = if reading.files.is_file(&whole) { vec![line] } else { libraries(line) };
    for name in names {
        let why = match reading.find(path, name, &place) {
            Ok(file) => {
                found.push(file);
                continue;
            }
            Err(why) => why,
        };
        let words: Vec<&str> = name.split_whitespace().take(LIBRARIES).collect();
        let files = words.iter().map(|word| (word, reading.find(path, word, &place))).collect::<Vec<_>>();
        if words.len() < 2 || files.iter().all(|(_, file)| file.is_err()) {
            match of_same_name(reading, path, name, &place) {
                Some(file) => found.push(file),
                None => refused.push(format!("{} {why}", excerpt(name))),
            }
            continue;
        }
        for (word, file) in files {
            match file {
                Ok(file) => found.push(file),
                Err(why) => refused.push(format!("{} {why}", excerpt(word))),
            }
        }
    }
    (found, refused)
}

/// The library that is named like the model and lies beside it: files are renamed together, and
/// the line keeps the former name. Notes it.
fn of_same_name(
    reading: &mut Reading,
    path: &Path,
    name: &str,
    place: impl Fn() -> String,
) -> Option<PathBuf> {
    let file = path.with_extension("mtl");
    reading.files.is_file(&file).then(|| {
        let renamed = format!("{} as {:?}", excerpt(name), file.display());
        reading.notes.add_named(OTHER_NAME, &renamed, place);
        file
    })
}

/// The names in a line. Each ends in `.mtl`, except possibly the last.
fn libraries(line: &str) -> Vec<&str> {
    let mut names = Vec::new();
    let mut rest = line;
    let lower = line.to_ascii_lowercase();
    for (at, ending) in lower.match_indices(".mtl") {
        let end = at + ending.len();
        if line[end..].starts_with(char::is_whitespace) && names.len() < LIBRARIES {
            names.push(rest[..rest.len() - (line.len() - end)].trim());
            rest = &line[end..];
        }
    }
    names.push(rest.trim());
    names
}

/// Divides the faces into triangles. `used` holds the definition of each used material.
fn meshes(
    reading: &mut Reading,
    path: &Path,
    mut contents: Contents,
    used: &[usize],
    definitions: &[Definition],
) -> Result<Vec<Mesh>> {
    let mut triangulator = Triangulator::default();
    let (mut smoothing, mut smooth) = (Smoothing::default(), Vec::new());
    let groups = std::mem::take(&mut contents.groups).into_iter().filter(|group| !group.arities.is_empty());
    let meshes = groups.enumerate().map(|(index, group)| {
        let material = used[group.material];
        let mesh = mesh(&contents, &group, (material as u32, &definitions[material]), &mut triangulator);
        if group.smoothing != 0 {
            let vertices: Vec<usize> = group.corners.iter().map(|corner| corner[0]).collect();
            smoothing.add(group.smoothing, &vertices, &mesh);
            smooth.push((index, group.smoothing, vertices));
        }
        mesh
    });
    let mut meshes: Vec<Mesh> = meshes.collect();
    for (index, group, vertices) in smooth {
        meshes[index].normals = smoothing.normals(group, &vertices);
    }
    if meshes.is_empty() {
        return Err(Error::input(path, "holds no face: an OBJ file with `v` and `f` lines was expected"));
    }
    let has_no_coordinates = |mesh: &&Mesh| {
        let definition = &definitions[mesh.material as usize];
        mesh.coordinates.is_empty() && definition.has_image() && !definition.is_given_image
    };
    let without_coordinates: usize =
        meshes.iter().filter(has_no_coordinates).map(|mesh| mesh.indices.len() / 3).sum();
    let what =
        "triangles of materials with an image have no texture coordinates: they show its lower left corner";
    reading.notes.add_total(without_coordinates, what, || shown(path));
    let what =
        "polygons cross themselves, are bent or have too many corners, and no triangles cover them exactly";
    reading.notes.add_total(triangulator.inexact, what, || shown(path));
    Ok(meshes)
}

/// Keeps the last definition of each name, at its position.
fn keep_last(definitions: &mut Vec<Definition>) {
    let mut seen = HashSet::new();
    definitions.reverse();
    definitions.retain(|definition| seen.insert(definition.material.name.clone()));
    definitions.reverse();
}

/// The mesh of a group, divided into triangles.
fn mesh(
    contents: &Contents,
    group: &Group,
    material: (u32, &Definition),
    triangulator: &mut Triangulator,
) -> Mesh {
    let (index, definition) = material;
    let corners = &group.corners;
    let positions: Vec<DVec3> = corners.iter().map(|corner| contents.positions[corner[0] - 1]).collect();
    let normal = |corner: &Corner| Some(contents.normals[corner[1].checked_sub(1)?]);
    let place = |corner: &Corner| {
        Some(definition.scale * contents.coordinates[corner[2].checked_sub(1)?] + definition.offset)
    };
    let has_image = definition.needs_coordinates();
    let colour = |corner: &Corner| match contents.colours.get(corner[0] - 1) {
        Some(colour) => colour.to_array().map(|value| (255.0 * value).round() as u8),
        None => WHITE,
    };
    let has_colours = !contents.colours.is_empty();
    let mut triangles = Vec::with_capacity(group.indices.len());
    let mut rest = &group.indices[..];
    let (mut objects, mut starts) = (Vec::new(), group.objects.iter().peekable());
    for (number, &arity) in group.arities.iter().enumerate() {
        if let Some((_, object)) = starts.next_if(|(first, _)| *first == number) {
            objects.push(((triangles.len() / 3) as u32, *object as u32));
        }
        let (face, after) = rest.split_at(arity);
        triangulator.divide(&positions, face, &mut triangles);
        rest = after;
    }
    Mesh {
        coordinates: corners.iter().filter(|_| has_image).filter_map(place).collect(),
        laid_size: None,
        normals: corners.iter().filter_map(normal).collect(),
        colours: corners.iter().filter(|_| has_colours).map(colour).collect(),
        positions,
        indices: triangles,
        material: index,
        objects,
    }
}
