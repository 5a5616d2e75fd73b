//! Reads the lines of an OBJ file.

use std::collections::HashMap;
use std::path::Path;

use glam::{DVec2, DVec3, Vec3};

use super::geometry::too_many;
use super::limits::{LIBRARIES, MATERIALS, NAME_BYTES, TRIANGLES};
use super::lines::Lines;
use super::material_names::{NO_MATERIAL, shown, too_many_materials};
use super::notes::Notes;
use super::value::{excerpt, printable};
use crate::{Error, Result};

/// The contents of an OBJ file.
#[derive(Default)]
pub(super) struct Contents {
    pub(super) positions: Vec<DVec3>,
    pub(super) normals: Vec<DVec3>,
    pub(super) coordinates: Vec<DVec2>,
    /// Colours of positions, as sRGB values; shorter than the positions if the last ones have none.
    pub(super) colours: Vec<Vec3>,
    /// All faces, in the order of the file.
    pub(super) groups: Vec<Group>,
    /// Names of MTL files, each with its line.
    pub(super) libraries: Vec<(usize, String)>,
    /// Materials, each with the line of its first use.
    pub(super) used: Vec<(usize, String)>,
    /// Names of the objects with faces; empty for faces before the first `o`.
    pub(super) objects: Vec<String>,
    pub(super) notes: Notes,
    /// Indices of the used materials by name.
    names: HashMap<String, usize>,
    /// Colours in comments.
    hidden: Vec<Vec3>,
    /// Indices of the last group's corners.
    known: HashMap<Corner, u32>,
    triangles: usize,
    /// Name of the object in effect, and its index once it has a face.
    object: (String, Option<usize>),
    /// Indices of objects by name.
    object_names: HashMap<String, usize>,
    /// Index of the material in effect.
    material: Option<usize>,
    /// Smoothing group in effect; 0 is none.
    smoothing: u32,
    /// Whether the last face had normals, and texture coordinates; its smoothing group.
    had: Option<([bool; 2], u32)>,
    /// Counts of normals and texture coordinates in the whole file. `None` in the first pass.
    totals: Option<[usize; 2]>,
    /// The highest index of each kind and its line: a face may precede its vertices.
    highest: [(usize, usize); 3],
}

/// Indices of position, normal and texture coordinates. They count from 1; 0 is none.
pub(super) type Corner = [usize; 3];

/// Faces of one material. All of them have normals, or none; so for texture coordinates.
pub(super) struct Group {
    /// Its index in [`Contents::used`].
    pub(super) material: usize,
    /// Smoothing group of its faces; 0: they are flat, or have normals.
    pub(super) smoothing: u32,
    /// Each corner once, in the order of their first use.
    pub(super) corners: Vec<Corner>,
    /// The faces' corners, one face after another.
    pub(super) indices: Vec<u32>,
    /// Number of corners of each face.
    pub(super) arities: Vec<usize>,
    /// Objects of the faces, each with its first face, in order.
    pub(super) objects: Vec<(usize, usize)>,
}

/// The result of a line's check, with the fault as text.
pub(super) type Checking<T> = std::result::Result<T, String>;

/// The kinds of data that a face corner refers to.
const KINDS: [&str; 3] = ["vertices", "normals", "texture coordinates"];

/// The index of a normal or of texture coordinates that the file lacks.
const LACKING: usize = usize::MAX;

/// Statements without an effect on the picture: names of parts, display.
const SILENT: [&str; 10] =
    ["", "g", "mg", "lod", "bevel", "c_interp", "d_interp", "shadow_obj", "trace_obj", "end"];

/// Reads `text`, the contents of `path`. All indices of the result are in range.
pub(super) fn read(path: &Path, text: &str) -> Result<Contents> {
    let contents = read_with(path, text, None)?;
    let [vertices, normals, coordinates] = contents.highest;
    let count = contents.positions.len();
    if vertices.0 > count {
        let message = format!("f: index {} is out of range: the file has {count} vertices", vertices.0);
        return Err(Error::input_at(path, vertices.1, message));
    }
    let totals = [contents.normals.len(), contents.coordinates.len()];
    if normals.0 > totals[0] || coordinates.0 > totals[1] {
        // Some faces refer to data that the whole file lacks. The second pass has the totals.
        drop(contents);
        return read_with(path, text, Some(totals));
    }
    Ok(contents)
}

fn read_with(path: &Path, text: &str, totals: Option<[usize; 2]>) -> Result<Contents> {
    let mut contents = Contents { totals, ..Default::default() };
    for (line, content) in Lines::new(text) {
        let (keyword, rest) = statement(&content);
        let place = || format!("{}:{line}", shown(path));
        let result = match keyword {
            "v" => contents.vertex(rest, place),
            "vn" => contents.normal(rest),
            "vt" => contents.coordinates(rest, place),
            // `fo` is the former name.
            "f" | "fo" => contents.face(line, rest, place),
            "#MRGB" => {
                contents.hidden_colours(rest);
                Ok(())
            }
            "mtllib" => contents.library(line, rest),
            "s" => {
                contents.smoothing = smoothing_group(rest);
                Ok(())
            }
            "o" => {
                contents.object = (printable(&rest.chars().take(NAME_BYTES).collect::<String>()), None);
                Ok(())
            }
            "usemtl" if rest.is_empty() => contents.material(line, NO_MATERIAL),
            "usemtl" => name(rest).and_then(|name| contents.material(line, name)),
            _ => {
                contents.pass_over(keyword, place);
                Ok(())
            }
        };
        result.map_err(|message| Error::input_at(path, line, format!("{keyword}: {message}")))?;
    }
    contents.finish_colours();
    Ok(contents)
}

/// A name at the end of a line; it must be printable.
pub(super) fn name(rest: &str) -> Checking<&str> {
    if rest.is_empty() {
        return Err("a name is missing".to_owned());
    }
    if rest.len() > NAME_BYTES || rest.contains(|c: char| c.is_control() && c != '\t') {
        return Err(format!("{} is no printable name of at most {NAME_BYTES} bytes", excerpt(rest)));
    }
    Ok(rest)
}

/// The number of a smoothing group; `off` is 0, and `on` is a group of its own.
fn smoothing_group(rest: &str) -> u32 {
    match rest.split_whitespace().next() {
        Some("on") => u32::MAX,
        word => word.and_then(|word| word.parse().ok()).unwrap_or(0),
    }
}

/// The keyword and the rest of a line.
pub(super) fn statement(line: &str) -> (&str, &str) {
    let line = line.trim();
    line.split_once(char::is_whitespace).map_or((line, ""), |(keyword, rest)| (keyword, rest.trim_start()))
}

impl Contents {
    fn vertex(&mut self, rest: &str, place: impl Fn() -> String) -> Checking<()> {
        let mut words = rest.split_whitespace();
        let mut next = || {
            let word = words.next().ok_or("three numbers were expected")?;
            word.parse::<f64>().map_err(|_| format!("{} is not a number", excerpt(word)))
        };
        let [x, y, z] = [next()?, next()?, next()?];
        // A position cannot be repaired.
        if ![x, y, z].into_iter().all(f64::is_finite) {
            return Err(format!("{} is not a finite position", excerpt(rest)));
        }
        // A single fourth number is a weight.
        let rest = words.take_while(|word| !word.starts_with('#')).take(3);
        let rest: Vec<f32> = rest.map(|word| word.parse().unwrap_or(f32::NAN)).collect();
        if let &[red, green, blue] = &rest[..] {
            if [red, green, blue].into_iter().all(|value| (0.0..=255.0).contains(&value)) {
                self.colours.resize(self.positions.len(), Vec3::ONE);
                self.colours.push(Vec3::new(red, green, blue));
            } else {
                self.notes.add("colours of vertices that are no numbers from 0 to 1 are white", place);
            }
        }
        self.positions.push(DVec3::new(x, y, z));
        Ok(())
    }

    /// Colours of ZBrush: mask, red, green and blue of each vertex as two hexadecimal digits.
    fn hidden_colours(&mut self, rest: &str) {
        for vertex in rest.as_bytes().chunks_exact(8) {
            let code =
                |at: usize| u8::from_str_radix(std::str::from_utf8(&vertex[at..at + 2]).ok()?, 16).ok();
            let codes = [2, 4, 6].map(|at| f32::from(code(at).unwrap_or(u8::MAX)));
            self.hidden.push(Vec3::from(codes) / 255.0);
        }
    }

    /// Colours of ZBrush count if the vertices have no others. Some programs write codes up to 255.
    fn finish_colours(&mut self) {
        let hidden = std::mem::take(&mut self.hidden);
        if self.colours.is_empty() {
            self.colours = hidden;
        } else if self.colours.iter().any(|colour| colour.max_element() > 1.0) {
            self.colours.iter_mut().for_each(|colour| *colour /= 255.0);
        }
        self.colours.truncate(self.positions.len());
    }

    /// An invalid normal is stored as NaN, and repaired and counted when a face uses it.
    fn normal(&mut self, rest: &str) -> Checking<()> {
        let mut words = rest.split_whitespace().map(|word| word.parse().unwrap_or(f64::NAN));
        let [x, y, z] = [(); 3].map(|()| words.next().unwrap_or(f64::NAN));
        self.normals.push(DVec3::new(x, y, z));
        Ok(())
    }

    fn coordinates(&mut self, rest: &str, place: impl Fn() -> String) -> Checking<()> {
        let mut words = rest.split_whitespace().take_while(|word| !word.starts_with('#'));
        let number = |word: &str| word.parse::<f64>().ok().filter(|number| number.abs() <= 1e6);
        let u = words.next().and_then(number);
        let v = number(words.next().unwrap_or("0"));
        if u.is_none() || v.is_none() {
            let what = "texture coordinates that are no numbers, or beyond 1e6, are taken as 0";
            self.notes.add_named(what, &excerpt(rest), place);
        }
        self.coordinates.push(DVec2::new(u.unwrap_or(0.0), v.unwrap_or(0.0)));
        Ok(())
    }

    fn pass_over(&mut self, keyword: &str, place: impl Fn() -> String) {
        if matches!(keyword, "l" | "p") {
            self.notes.add("lines and points have no surface, and are passed over", place);
        } else if !keyword.starts_with('#') && !SILENT.contains(&keyword) {
            self.notes.add_named(
                "statements that are not known are passed over",
                &excerpt(&printable(keyword)),
                place,
            );
        }
    }

    fn library(&mut self, line: usize, rest: &str) -> Checking<()> {
        if rest.is_empty() {
            return Ok(());
        }
        let name = name(rest)?;
        if self.libraries.len() >= LIBRARIES {
            return Err(format!("there are more than {LIBRARIES} of them"));
        }
        self.libraries.push((line, name.to_owned()));
        Ok(())
    }

    fn material(&mut self, line: usize, name: &str) -> Checking<()> {
        let index = match self.names.get(name) {
            Some(&index) => index,
            None if self.used.len() >= MATERIALS => return Err(too_many_materials()),
            None => {
                self.names.insert(name.to_owned(), self.used.len());
                self.used.push((line, name.to_owned()));
                self.used.len() - 1
            }
        };
        if self.material.replace(index) != Some(index) {
            self.start_group(index);
        }
        Ok(())
    }

    fn face(&mut self, line: usize, rest: &str, place: impl Fn() -> String) -> Checking<()> {
        let words = rest.split_whitespace().take_while(|word| !word.starts_with('#'));
        let corners = words.map(|word| self.corner(word)).collect::<Checking<Vec<_>>>()?;
        if corners.len() < 3 {
            self.notes.add("faces with fewer than 3 corners are passed over", place);
            return Ok(());
        }
        self.triangles += corners.len() - 2;
        if self.triangles > TRIANGLES {
            return Err(too_many(self.triangles));
        }
        if self.material.is_none() {
            self.material(line, NO_MATERIAL)?;
        }
        let has = [1, 2].map(|kind| corners.iter().all(|corner| corner[kind] > 0 && corner[kind] != LACKING));
        for kind in [1, 2] {
            if corners.iter().any(|corner| corner[kind] == LACKING) {
                let what = format!("faces name {} that are not in the file, and have none", KINDS[kind]);
                self.notes.add(&what, &place);
            }
        }
        let kind = (has, if has[0] { 0 } else { self.smoothing });
        if self.had.replace(kind) != Some(kind)
            && let Some(material) = self.material
        {
            self.start_group(material);
        }
        for corner in &corners {
            for (highest, index) in self.highest.iter_mut().zip(*corner) {
                if index != LACKING {
                    *highest = (*highest).max((index, line));
                }
            }
        }
        let object = self.object_index();
        let group = self.groups.last_mut().expect("a material starts a group");
        if group.objects.last().is_none_or(|(_, last)| *last != object) {
            group.objects.push((group.arities.len(), object));
        }
        group.arities.push(corners.len());
        for [position, normal, coordinates] in corners {
            let corner = [position, normal * usize::from(has[0]), coordinates * usize::from(has[1])];
            let index = *self.known.entry(corner).or_insert_with(|| {
                group.corners.push(corner);
                group.corners.len() as u32 - 1
            });
            group.indices.push(index);
        }
        Ok(())
    }

    /// Index of the object in effect, which has a face.
    fn object_index(&mut self) -> usize {
        let (name, known) = &mut self.object;
        *known.get_or_insert_with(|| match self.object_names.get(name) {
            Some(&index) => index,
            None => {
                self.objects.push(name.clone());
                self.object_names.insert(name.clone(), self.objects.len() - 1);
                self.objects.len() - 1
            }
        })
    }

    /// Starts a group, instead of the last one if that has no face.
    fn start_group(&mut self, material: usize) {
        self.groups.pop_if(|last| last.arities.is_empty());
        let smoothing = self.had.map_or(0, |(_, smoothing)| smoothing);
        let (corners, indices, arities, objects) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        self.groups.push(Group { material, smoothing, corners, indices, arities, objects });
        // Not cleared: that takes as long as the largest group, for each of many small ones.
        self.known = HashMap::new();
    }

    /// Counts of positions, normals and texture coordinates so far.
    fn count(&self, kind: usize) -> usize {
        [self.positions.len(), self.normals.len(), self.coordinates.len()][kind]
    }

    /// Indices of position, normal and texture coordinates of `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    /// [`LACKING`] is an index that the file lacks.
    fn corner(&self, word: &str) -> Checking<Corner> {
        let mut parts = word.split('/');
        let (position, coordinates, normal) = (parts.next().unwrap_or_default(), parts.next(), parts.next());
        // Negative indices count back from the last item so far.
        let absolute = |index: i64, of: usize| match index {
            0.. => index as usize,
            _ => usize::try_from(index.saturating_add_unsigned(self.count(of) as u64 + 1)).unwrap_or(0),
        };
        let Ok(index) = position.parse() else {
            return Err(format!("{} is not a corner: v, v/vt, v//vn or v/vt/vn was expected", excerpt(word)));
        };
        let vertex = absolute(index, 0);
        if vertex == 0 {
            let count = self.positions.len();
            return Err(format!("index {index} is out of range: {count} vertices precede it"));
        }
        let optional = |part: Option<&str>, of: usize| match part {
            None | Some("") => 0,
            Some(part) => match part.parse().map_or(0, |index| absolute(index, of)) {
                0 => LACKING,
                index if self.totals.is_some_and(|totals| index > totals[of - 1]) => LACKING,
                index => index,
            },
        };
        Ok([vertex, optional(normal, 1), optional(coordinates, 2)])
    }
}
