//! OBJ and MTL files.
//!
//! `tobj` turns polygons into fans and indices into meshes, but names no line when it fails, panics on a `Kd` of two
//! numbers, takes polylines for faces, and lends a face without normals those of another. So every line is checked
//! first, and `tobj` reads only what passed: positions (f64), normals, faces with absolute indices, materials.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::Path;

use glam::{DVec3, Vec3};

use super::builtin::{Files, utf8};
use super::geometry::Mesh;
use super::material::{Material, NEUTRAL};
use crate::{Error, Result};

/// What an OBJ file and its MTL files hold.
pub(super) struct Model {
    /// Triangles, one mesh a run of faces with one material.
    pub(super) meshes: Vec<Mesh>,
    /// Every material that is defined or used.
    pub(super) materials: Vec<Material>,
    /// Materials that are used but not defined, with the line of their first use; neutral until overridden.
    pub(super) undefined: Vec<(usize, String)>,
}

/// Faces before the first `usemtl`.
const NO_MATERIAL: &str = "default";

/// Reads `text`, the contents of `path`, and the MTL files that it names, which lie relative to it.
///
/// Fails with file and line on coordinates that are not finite numbers, faces with fewer than three corners, indices
/// out of range, an MTL file that cannot be read; and where there is no face at all.
pub(super) fn load(files: Files, path: &Path, text: &str, warnings: &mut Vec<String>) -> Result<Model> {
    let checked = check(path, text)?;
    let mut materials: Vec<Material> = Vec::new();
    for (line, library) in &checked.libraries {
        let file = path.with_file_name("").join(library);
        let fault = |what| Error::input_at(path, *line, format!("mtllib: {:?} {what}", file.display()));
        let text = utf8(&file, files.read(&file).map_err(fault)?)?;
        for material in load_materials(&file, &text, warnings)? {
            materials.retain(|earlier| earlier.name != material.name);
            materials.push(material);
        }
    }
    let mut undefined = Vec::new();
    for (line, name) in checked.used {
        if !materials.iter().any(|material| material.name == name) {
            materials.push(Material::neutral(&name));
            if name != NO_MATERIAL {
                undefined.push((line, name));
            }
        }
    }
    // The materials are known already: `tobj` gets their names.
    let library = |_: &Path| {
        let indices = materials.iter().enumerate().map(|(index, material)| (material.name.clone(), index));
        Ok((vec![tobj::Material::default(); materials.len()], indices.collect()))
    };
    let options = tobj::LoadOptions { triangulate: true, single_index: true, ..Default::default() };
    let (models, _) = tobj::load_obj_buf(&mut checked.text.as_bytes(), &options, library)
        .map_err(|fault| Error::input(path, format!("cannot be read: {fault}")))?;
    let meshes: Vec<Mesh> =
        models.into_iter().filter(|model| !model.mesh.indices.is_empty()).map(convert).collect();
    if meshes.is_empty() {
        return Err(Error::input(path, "holds no face: an OBJ file with `v` and `f` lines was expected"));
    }
    Ok(Model { meshes, materials, undefined })
}

fn convert(model: tobj::Model) -> Mesh {
    let points = |numbers: &[f64]| numbers.chunks_exact(3).map(DVec3::from_slice).collect();
    Mesh {
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
    /// Whether a material is in force.
    has_material: bool,
    /// Whether the last face had normals.
    had_normals: Option<bool>,
    /// How many positions and normals there are.
    counts: [usize; 2],
    /// The highest position and normal index seen, and its line: a face may precede its vertices.
    highest: [(usize, usize); 2],
}

/// What is wrong with a line.
type Checking<T> = std::result::Result<T, String>;

fn check(path: &Path, text: &str) -> Result<Checked> {
    let mut checked = Checked { text: "mtllib all\n".to_owned(), ..Default::default() };
    for (index, content) in text.strip_prefix('\u{feff}').unwrap_or(text).lines().enumerate() {
        let (keyword, rest) = statement(content);
        let line = index + 1;
        let result = match keyword {
            "v" | "vn" => checked.vertex(keyword, rest),
            "f" => checked.face(line, rest),
            "mtllib" | "usemtl" if rest.is_empty() => Err("a name is missing".to_owned()),
            "mtllib" => {
                checked.libraries.push((line, rest.to_owned()));
                Ok(())
            }
            "usemtl" => {
                checked.material(line, rest);
                Ok(())
            }
            _ => Ok(()),
        };
        result.map_err(|message| Error::input_at(path, line, format!("{keyword}: {message}")))?;
    }
    for (((index, line), count), kind) in
        checked.highest.into_iter().zip(checked.counts).zip(["vertices", "normals"])
    {
        if index > count {
            let message = format!("f: index {index} is out of range: the file has {count} {kind}");
            return Err(Error::input_at(path, line, message));
        }
    }
    Ok(checked)
}

/// Keyword and the rest of a line.
fn statement(line: &str) -> (&str, &str) {
    let line = line.trim();
    line.split_once(char::is_whitespace).map_or((line, ""), |(keyword, rest)| (keyword, rest.trim_start()))
}

impl Checked {
    fn vertex(&mut self, keyword: &str, rest: &str) -> Checking<()> {
        let [x, y, z] = numbers(rest)?;
        let is_normal = keyword == "vn";
        // A normal that is no number is repaired later; nothing can repair a position.
        if !is_normal && ![x, y, z].into_iter().all(f64::is_finite) {
            return Err(format!("{rest:?} is not a finite position"));
        }
        self.counts[usize::from(is_normal)] += 1;
        self.write(format_args!("{keyword} {x:e} {y:e} {z:e}\n"));
        Ok(())
    }

    fn material(&mut self, line: usize, name: &str) {
        if !self.used.iter().any(|(_, used)| used == name) {
            self.used.push((line, name.to_owned()));
        }
        self.has_material = true;
        self.write(format_args!("usemtl {name}\n"));
    }

    fn face(&mut self, line: usize, rest: &str) -> Checking<()> {
        let words = rest.split_whitespace().take_while(|word| !word.starts_with('#'));
        let corners = words.map(|word| corner(word, self.counts)).collect::<Checking<Vec<_>>>()?;
        if corners.len() < 3 {
            return Err(format!("a face needs at least 3 corners, found {}", corners.len()));
        }
        if !self.has_material {
            self.material(line, NO_MATERIAL);
        }
        let has_normals = corners.iter().all(|&[_, normal]| normal > 0);
        if self.had_normals.replace(has_normals).is_some_and(|had| had != has_normals) {
            // Starts another mesh: those with and without normals must not mix.
            self.text.push_str("o next\n");
        }
        self.text.push('f');
        for [position, normal] in corners {
            self.highest[0] = self.highest[0].max((position, line));
            self.highest[1] = self.highest[1].max((normal, line));
            match has_normals {
                true => self.write(format_args!(" {position}//{normal}")),
                false => self.write(format_args!(" {position}")),
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
fn numbers(rest: &str) -> Checking<[f64; 3]> {
    let mut words = rest.split_whitespace();
    let mut next = || {
        let word = words.next().ok_or("three numbers were expected")?;
        word.parse::<f64>().map_err(|_| format!("{word:?} is not a number"))
    };
    Ok([next()?, next()?, next()?])
}

/// Position and normal index (from 1; 0 for no normal) of `v`, `v/vt`, `v//vn` or `v/vt/vn`.
fn corner(word: &str, counts: [usize; 2]) -> Checking<[usize; 2]> {
    let malformed = || format!("{word:?} is not a corner: v, v/vt, v//vn or v/vt/vn was expected");
    let index = |part: &str, count: usize, kind: &str| {
        let index: i64 = part.parse().map_err(|_| malformed())?;
        // Negative indices count back from the last one so far.
        let absolute = if index < 0 { index.saturating_add_unsigned(count as u64 + 1) } else { index };
        usize::try_from(absolute)
            .ok()
            .filter(|&absolute| absolute > 0)
            .ok_or_else(|| format!("index {index} is out of range: {count} {kind} precede it"))
    };
    let parts: Vec<&str> = word.splitn(4, '/').collect();
    let normal = match parts[..] {
        [_] | [_, _] | [_, _, ""] => 0,
        [_, _, normal] => index(normal, counts[1], "normals")?,
        _ => return Err(malformed()),
    };
    Ok([index(parts[0], counts[0], "vertices")?, normal])
}

/// Reads `Kd`, `Ks` and `Ns`; other statements change nothing, and one warning names those that one would miss.
fn load_materials(path: &Path, text: &str, warnings: &mut Vec<String>) -> Result<Vec<Material>> {
    let mut checked = Checked::default();
    let mut ignored = BTreeSet::new();
    for (index, content) in text.strip_prefix('\u{feff}').unwrap_or(text).lines().enumerate() {
        let (keyword, rest) = statement(content);
        let result = match keyword {
            "newmtl" if rest.is_empty() => Err("a name is missing".to_owned()),
            "newmtl" => {
                checked.write(format_args!("newmtl {rest}\n"));
                Ok(())
            }
            "Kd" | "Ks" | "Ns" => checked.reflectance(keyword, rest),
            "map_Kd" | "map_Ks" => {
                ignored.insert(keyword);
                Ok(())
            }
            "Ke" if numbers(rest) != Ok([0.0; 3]) => {
                ignored.insert(keyword);
                Ok(())
            }
            _ => Ok(()),
        };
        result.map_err(|message| Error::input_at(path, index + 1, format!("{keyword}: {message}")))?;
    }
    if !ignored.is_empty() {
        let ignored: Vec<&str> = ignored.into_iter().collect();
        warnings.push(format!(
            "{:?}: ignored {}: no textures, no emission",
            path.display(),
            ignored.join(", ")
        ));
    }
    let (materials, _) = tobj::load_mtl_buf(&mut checked.text.as_bytes())
        .map_err(|fault| Error::input(path, format!("cannot be read: {fault}")))?;
    let vec3 = |values: Option<[f64; 3]>, default| values.map_or(default, |v| DVec3::from(v).as_vec3());
    let convert = |material: tobj::Material| Material {
        diffuse: vec3(material.diffuse, NEUTRAL),
        specular: vec3(material.specular, Vec3::ZERO),
        // Exporters write 0 for "not shiny".
        exponent: material.shininess.map_or(1.0, |exponent| (exponent as f32).max(1.0)),
        ..Material::neutral(&material.name)
    };
    Ok(materials.into_iter().map(convert).collect())
}

impl Checked {
    /// `Kd` and `Ks` state three numbers, `Ns` one.
    fn reflectance(&mut self, keyword: &str, rest: &str) -> Checking<()> {
        if self.text.is_empty() {
            return Err("a `newmtl` line must come first".to_owned());
        }
        let count = if keyword == "Ns" { 1 } else { 3 };
        let words: Vec<&str> = rest.split_whitespace().take(count).collect();
        let in_range = |word: &&str| word.parse().is_ok_and(|value: f64| (0.0..=1e6).contains(&value));
        if words.len() < count || !words.iter().all(in_range) {
            let expected = if count == 1 { "one number" } else { "three numbers" };
            return Err(format!("{rest:?} is not {expected} from 0 to 1e6"));
        }
        self.write(format_args!("{keyword} {}\n", words.join(" ")));
        Ok(())
    }
}
