//! OBJ files.
//!
//! `tobj` turns polygons into fans and indices into meshes, but names no line when it fails, panics on a `Kd` of two
//! numbers, takes polylines for faces, and lends a face without normals those of another. So every line is checked
//! first, and `tobj` reads only what passed: positions (f64), normals, texture coordinates, faces with absolute indices.

use std::collections::HashSet;
use std::fmt::Write as _;
use std::path::Path;

use glam::{DVec2, DVec3};

use super::builtin::utf8;
use super::geometry::{Mesh, too_many};
use super::limits::{LIBRARIES, MATERIALS, MTL_BYTES, NAME_BYTES, TRIANGLES};
use super::material::Material;
use super::mtl::{self, Definition};
use super::reading::Reading;
use super::value::excerpt;
use crate::{Error, Result};

/// What an OBJ file and its MTL files hold.
pub(super) struct Model {
    /// Triangles, one mesh a run of faces with one material.
    pub(super) meshes: Vec<Mesh>,
    /// Every material that is defined or used.
    pub(super) materials: Vec<Material>,
    /// Materials that are used but not defined, by their index, with the line of their first use; neutral until overridden.
    pub(super) undefined: Vec<(usize, usize)>,
}

/// Faces before the first `usemtl`.
const NO_MATERIAL: &str = "default";

/// Reads `text`, the contents of `path`, and the MTL files that it names, which lie relative to it.
///
/// Fails with file and line on coordinates that are not finite numbers, faces with fewer than three corners, indices
/// out of range, an MTL file that cannot be read; and where there is no face at all.
pub(super) fn load(reading: &mut Reading, path: &Path, text: &str) -> Result<Model> {
    let checked = check(path, text)?;
    let mut definitions: Vec<Definition> = Vec::new();
    for (line, library) in &checked.libraries {
        let file = path.with_file_name("").join(library);
        let fault = |what| Error::input_at(path, *line, format!("mtllib: {:?} {what}", file.display()));
        let text = utf8(&file, reading.read(&file, MTL_BYTES).map_err(fault)?)?;
        definitions.extend(mtl::load(reading, &file, &text)?);
        keep_last(&mut definitions);
        if definitions.len() > MATERIALS {
            return Err(Error::input_at(path, *line, too_many_materials()));
        }
    }
    let mut undefined = Vec::new();
    let known: HashSet<String> = definitions.iter().map(|d| d.material.name.clone()).collect();
    for (line, name) in checked.used.into_iter().filter(|(_, name)| !known.contains(name)) {
        if name != NO_MATERIAL {
            undefined.push((definitions.len(), line));
        }
        definitions.push(Definition::new(Material::neutral(&name)));
    }
    // The materials are known already: `tobj` gets their names.
    let library = |_: &Path| {
        let named = |(index, definition): (usize, &Definition)| (definition.material.name.clone(), index);
        let indices = definitions.iter().enumerate().map(named).collect();
        Ok((vec![tobj::Material::default(); definitions.len()], indices))
    };
    let options = tobj::LoadOptions { triangulate: true, single_index: true, ..Default::default() };
    let (models, _) = tobj::load_obj_buf(&mut checked.text.as_bytes(), &options, library)
        .map_err(|fault| Error::input(path, format!("cannot be read: {fault}")))?;
    let models = models.into_iter().filter(|model| !model.mesh.indices.is_empty());
    let meshes: Vec<Mesh> = models.map(|model| convert(model, &definitions)).collect();
    if meshes.is_empty() {
        return Err(Error::input(path, "holds no face: an OBJ file with `v` and `f` lines was expected"));
    }
    let is_bare = |mesh: &&Mesh| {
        mesh.coordinates.is_empty() && definitions[mesh.material as usize].material.texture.is_some()
    };
    let bare: usize = meshes.iter().filter(is_bare).map(|mesh| mesh.indices.len() / 3).sum();
    if bare > 0 {
        reading.warnings.push(format!(
            "{:?}: {bare} triangles of materials with an image have no texture coordinates: they show its lower left corner",
            path.display()
        ));
    }
    let materials = definitions.into_iter().map(|definition| definition.material).collect();
    Ok(Model { meshes, materials, undefined })
}

/// Of definitions of one name the last counts, and stands where it stands.
fn keep_last(definitions: &mut Vec<Definition>) {
    let mut seen = HashSet::new();
    definitions.reverse();
    definitions.retain(|definition| seen.insert(definition.material.name.clone()));
    definitions.reverse();
}

fn too_many_materials() -> String {
    format!("there are more than {MATERIALS} materials")
}

fn convert(model: tobj::Model, definitions: &[Definition]) -> Mesh {
    let points = |numbers: &[f64]| numbers.chunks_exact(3).map(DVec3::from_slice).collect();
    let definition = model.mesh.material_id.and_then(|index| definitions.get(index));
    let place = |d: &Definition| {
        let place = |vt: &[f64]| d.scale * DVec2::from_slice(vt) + d.offset;
        model.mesh.texcoords.chunks_exact(2).map(place).collect()
    };
    Mesh {
        coordinates: definition.filter(|d| d.material.texture.is_some()).map_or_else(Vec::new, place),
        positions: points(&model.mesh.positions),
        normals: points(&model.mesh.normals),
        indices: model.mesh.indices,
        material: model.mesh.material_id.map_or(0, |index| index as u32),
    }
}

/// An OBJ file, as far as it is known to be good.
#[derive(Default)]
struct Checked {
    /// What `tobj` is to read.
    text: String,
    /// MTL files with the line that names them.
    libraries: Vec<(usize, String)>,
    /// Materials with the line that first uses them.
    used: Vec<(usize, String)>,
    /// The names of those.
    names: HashSet<String>,
    triangles: usize,
    /// Whether a material is in force.
    has_material: bool,
    /// Whether the last face had normals, and texture coordinates.
    had: Option<[bool; 2]>,
    /// How many positions, normals and texture coordinates there are.
    counts: [usize; 3],
    /// The highest index of each seen, and its line: a face may precede its vertices.
    highest: [(usize, usize); 3],
}

/// What is wrong with a line.
pub(super) type Checking<T> = std::result::Result<T, String>;

/// What the corners of faces refer to.
const KINDS: [&str; 3] = ["vertices", "normals", "texture coordinates"];

fn check(path: &Path, text: &str) -> Result<Checked> {
    let mut checked = Checked { text: "mtllib all\n".to_owned(), ..Default::default() };
    for (index, content) in text.strip_prefix('\u{feff}').unwrap_or(text).lines().enumerate() {
        let (keyword, rest) = statement(content);
        let line = index + 1;
        let result = match keyword {
            "v" | "vn" => checked.vertex(keyword, rest),
            "vt" => checked.coordinates(rest),
            "f" => checked.face(line, rest),
            "mtllib" => checked.library(line, rest),
            "usemtl" => name(rest).and_then(|name| checked.material(line, name)),
            _ => Ok(()),
        };
        result.map_err(|message| Error::input_at(path, line, format!("{keyword}: {message}")))?;
    }
    for (((index, line), count), kind) in checked.highest.into_iter().zip(checked.counts).zip(KINDS) {
        if index > count {
            let message = format!("f: index {index} is out of range: the file has {count} {kind}");
            return Err(Error::input_at(path, line, message));
        }
    }
    Ok(checked)
}

/// A name at the end of a line, which others may have to print.
pub(super) fn name(rest: &str) -> Checking<&str> {
    if rest.is_empty() {
        return Err("a name is missing".to_owned());
    }
    if rest.len() > NAME_BYTES || rest.contains(|c: char| c.is_control() && c != '\t') {
        return Err(format!("{} is no printable name of at most {NAME_BYTES} bytes", excerpt(rest)));
    }
    Ok(rest)
}

/// Keyword and the rest of a line.
pub(super) fn statement(line: &str) -> (&str, &str) {
    let line = line.trim();
    line.split_once(char::is_whitespace).map_or((line, ""), |(keyword, rest)| (keyword, rest.trim_start()))
}

impl Checked {
    fn vertex(&mut self, keyword: &str, rest: &str) -> Checking<()> {
        let [x, y, z] = numbers(rest)?;
        let is_normal = keyword == "vn";
        // A normal that is no number is repaired later; nothing can repair a position.
        if !is_normal && ![x, y, z].into_iter().all(f64::is_finite) {
            return Err(format!("{} is not a finite position", excerpt(rest)));
        }
        self.counts[usize::from(is_normal)] += 1;
        self.write(format_args!("{keyword} {x:e} {y:e} {z:e}\n"));
        Ok(())
    }

    fn coordinates(&mut self, rest: &str) -> Checking<()> {
        let mut words = rest.split_whitespace().take_while(|word| !word.starts_with('#'));
        let u = words.next().ok_or("one to three numbers were expected")?;
        let v = words.next().unwrap_or("0");
        let number = |word: &str| word.parse::<f64>().ok().filter(|number| number.abs() <= 1e6);
        let (Some(u), Some(v)) = (number(u), number(v)) else {
            return Err(format!("{} is not one to three numbers up to 1e6", excerpt(rest)));
        };
        self.counts[2] += 1;
        self.write(format_args!("vt {u:e} {v:e}\n"));
        Ok(())
    }

    fn library(&mut self, line: usize, rest: &str) -> Checking<()> {
        let name = name(rest)?;
        if self.libraries.len() >= LIBRARIES {
            return Err(format!("there are more than {LIBRARIES} of them"));
        }
        self.libraries.push((line, name.to_owned()));
        Ok(())
    }

    fn material(&mut self, line: usize, name: &str) -> Checking<()> {
        if !self.names.contains(name) {
            if self.used.len() >= MATERIALS {
                return Err(too_many_materials());
            }
            self.names.insert(name.to_owned());
            self.used.push((line, name.to_owned()));
        }
        self.has_material = true;
        self.write(format_args!("usemtl {name}\n"));
        Ok(())
    }

    fn face(&mut self, line: usize, rest: &str) -> Checking<()> {
        let words = rest.split_whitespace().take_while(|word| !word.starts_with('#'));
        let corners = words.map(|word| corner(word, self.counts)).collect::<Checking<Vec<_>>>()?;
        if corners.len() < 3 {
            return Err(format!("a face needs at least 3 corners, found {}", corners.len()));
        }
        self.triangles += corners.len() - 2;
        if self.triangles > TRIANGLES {
            return Err(too_many(self.triangles));
        }
        if !self.has_material {
            self.material(line, NO_MATERIAL)?;
        }
        let has = [1, 2].map(|kind| corners.iter().all(|corner| corner[kind] > 0));
        if self.had.replace(has).is_some_and(|had| had != has) {
            // Starts another mesh: those with and without normals, or texture coordinates, must not mix.
            self.text.push_str("o next\n");
        }
        self.text.push('f');
        for corner in corners {
            for (highest, index) in self.highest.iter_mut().zip(corner) {
                *highest = (*highest).max((index, line));
            }
            let [position, normal, coordinates] = corner;
            match has {
                [true, true] => self.write(format_args!(" {position}/{coordinates}/{normal}")),
                [true, false] => self.write(format_args!(" {position}//{normal}")),
                [false, true] => self.write(format_args!(" {position}/{coordinates}")),
                [false, false] => self.write(format_args!(" {position}")),
            }
        }
        self.text.push('\n');
        Ok(())
    }

    fn write(&mut self, text: std::fmt::Arguments) {
        self.text.write_fmt(text).expect("writing to a String cannot fail");
    }
}

/// Three numbers; more may follow (weights, colours) and count for nothing.
pub(super) fn numbers(rest: &str) -> Checking<[f64; 3]> {
    let mut words = rest.split_whitespace();
    let mut next = || {
        let word = words.next().ok_or("three numbers were expected")?;
        word.parse::<f64>().map_err(|_| format!("{} is not a number", excerpt(word)))
    };
    Ok([next()?, next()?, next()?])
}

/// Index of position, normal and texture coordinates (from 1; 0 for none) of `v`, `v/vt`, `v//vn` or `v/vt/vn`.
fn corner(word: &str, counts: [usize; 3]) -> Checking<[usize; 3]> {
    let malformed = || format!("{} is not a corner: v, v/vt, v//vn or v/vt/vn was expected", excerpt(word));
    let index = |part: &str, of: usize| {
        let (count, kind) = (counts[of], KINDS[of]);
        let index: i64 = part.parse().map_err(|_| malformed())?;
        // Negative indices count back from the last one so far.
        let absolute = if index < 0 { index.saturating_add_unsigned(count as u64 + 1) } else { index };
        usize::try_from(absolute)
            .ok()
            .filter(|&absolute| absolute > 0)
            .ok_or_else(|| format!("index {index} is out of range: {count} {kind} precede it"))
    };
    let parts: Vec<&str> = word.splitn(4, '/').collect();
    let (coordinates, normal) = match parts[..] {
        [_] => ("", ""),
        [_, coordinates] => (coordinates, ""),
        [_, coordinates, normal] => (coordinates, normal),
        _ => return Err(malformed()),
    };
    let optional = |part: &str, of: usize| if part.is_empty() { Ok(0) } else { index(part, of) };
    Ok([index(parts[0], 0)?, optional(normal, 1)?, optional(coordinates, 2)?])
}
