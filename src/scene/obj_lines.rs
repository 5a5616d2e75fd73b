//! Line-by-line check of an OBJ file.

use std::collections::HashSet;
use std::fmt::Write as _;
use std::path::Path;

use super::geometry::too_many;
use super::limits::{LIBRARIES, MATERIALS, NAME_BYTES, TRIANGLES};
use super::lines::Lines;
use super::material_names::{NO_MATERIAL, shown, too_many_materials};
use super::notes::Notes;
use super::value::{excerpt, printable};
use crate::{Error, Result};

/// The checked lines of an OBJ file.
#[derive(Default)]
pub(super) struct Checked {
    /// First input of `tobj`: `v`, `vn` and `vt`, which faces may precede in the file.
    pub(super) vertices: String,
    /// Second input of `tobj`: the faces.
    pub(super) faces: String,
    /// Names of MTL files, each with its line.
    pub(super) libraries: Vec<(usize, String)>,
    /// Materials, each with the line of its first use.
    pub(super) used: Vec<(usize, String)>,
    pub(super) notes: Notes,
    /// Names of the used materials.
    names: HashSet<String>,
    triangles: usize,
    /// Whether a `usemtl` is in effect.
    has_material: bool,
    /// Whether the last face had normals, and texture coordinates.
    had: Option<[bool; 2]>,
    /// Counts of positions, normals and texture coordinates so far.
    counts: [usize; 3],
    /// Counts of normals and texture coordinates in the whole file. `None` in the first pass.
    totals: Option<[usize; 2]>,
    /// The highest index of each kind and its line: a face may precede its vertices.
    highest: [(usize, usize); 3],
}

/// The result of a line's check, with the fault as text.
pub(super) type Checking<T> = std::result::Result<T, String>;

/// The kinds of data that a face corner refers to.
const KINDS: [&str; 3] = ["vertices", "normals", "texture coordinates"];

/// The index of a normal or of texture coordinates that the file lacks.
const LACKING: usize = usize::MAX;

/// Statements without an effect on the picture: names of parts, smoothing of surfaces that
/// have normals, display.
const SILENT: [&str; 12] =
    ["", "o", "g", "s", "mg", "lod", "bevel", "c_interp", "d_interp", "shadow_obj", "trace_obj", "end"];

/// Checks the lines of `text`, the contents of `path`.
pub(super) fn check(path: &Path, text: &str) -> Result<Checked> {
    let checked = check_with(path, text, None)?;
    let [vertices, normals, coordinates] = checked.highest;
    if vertices.0 > checked.counts[0] {
        let message =
            format!("f: index {} is out of range: the file has {} vertices", vertices.0, checked.counts[0]);
        return Err(Error::input_at(path, vertices.1, message));
    }
    let totals = [checked.counts[1], checked.counts[2]];
    if normals.0 > totals[0] || coordinates.0 > totals[1] {
        // Some faces refer to data that the whole file lacks. The second pass has the totals.
        return check_with(path, text, Some(totals));
    }
    Ok(checked)
}

fn check_with(path: &Path, text: &str, totals: Option<[usize; 2]>) -> Result<Checked> {
    let mut checked = Checked { vertices: "mtllib all\n".to_owned(), totals, ..Default::default() };
    for (line, content) in Lines::new(text) {
        let (keyword, rest) = statement(&content);
        let place = || format!("{}:{line}", shown(path));
        let result = match keyword {
            "v" => checked.vertex(rest, place),
            "vn" => checked.normal(rest),
            "vt" => checked.coordinates(rest, place),
            "f" => checked.face(line, rest, place),
            "mtllib" => checked.library(line, rest),
            "usemtl" if rest.is_empty() => checked.material(line, NO_MATERIAL),
            "usemtl" => name(rest).and_then(|name| checked.material(line, name)),
            _ => {
                checked.pass_over(keyword, place);
                Ok(())
            }
        };
        result.map_err(|message| Error::input_at(path, line, format!("{keyword}: {message}")))?;
    }
    Ok(checked)
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

/// The keyword and the rest of a line.
pub(super) fn statement(line: &str) -> (&str, &str) {
    let line = line.trim();
    line.split_once(char::is_whitespace).map_or((line, ""), |(keyword, rest)| (keyword, rest.trim_start()))
}

impl Checked {
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
        // A fourth number is a weight.
        if words.take_while(|word| !word.starts_with('#')).count() >= 3 {
            self.notes.add("colours of vertices are passed over", place);
        }
        self.counts[0] += 1;
        write(&mut self.vertices, format_args!("v {x:e} {y:e} {z:e}\n"));
        Ok(())
    }

    /// An invalid normal is stored as NaN, and repaired and counted when a face uses it.
    fn normal(&mut self, rest: &str) -> Checking<()> {
        let mut words = rest.split_whitespace().map(|word| word.parse().unwrap_or(f64::NAN));
        let [x, y, z] = [(); 3].map(|()| words.next().unwrap_or(f64::NAN));
        self.counts[1] += 1;
        write(&mut self.vertices, format_args!("vn {x:e} {y:e} {z:e}\n"));
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
        self.counts[2] += 1;
        write(&mut self.vertices, format_args!("vt {:e} {:e}\n", u.unwrap_or(0.0), v.unwrap_or(0.0)));
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
        if !self.names.contains(name) {
            if self.used.len() >= MATERIALS {
                return Err(too_many_materials());
            }
            self.names.insert(name.to_owned());
            self.used.push((line, name.to_owned()));
        }
        self.has_material = true;
        write(&mut self.faces, format_args!("usemtl {name}\n"));
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
        if !self.has_material {
            self.material(line, NO_MATERIAL)?;
        }
        let has = [1, 2].map(|kind| corners.iter().all(|corner| corner[kind] > 0 && corner[kind] != LACKING));
        for kind in [1, 2] {
            if corners.iter().any(|corner| corner[kind] == LACKING) {
                let what = format!("faces name {} that are not in the file, and have none", KINDS[kind]);
                self.notes.add(&what, &place);
            }
        }
        if self.had.replace(has).is_some_and(|had| had != has) {
            // Starts another mesh: faces with and without normals, or texture coordinates,
            // must not mix.
            self.faces.push_str("o next\n");
        }
        self.faces.push('f');
        for corner in corners {
            for (highest, index) in self.highest.iter_mut().zip(corner) {
                if index != LACKING {
                    *highest = (*highest).max((index, line));
                }
            }
            let [position, normal, coordinates] = corner;
            match has {
                [true, true] => write(&mut self.faces, format_args!(" {position}/{coordinates}/{normal}")),
                [true, false] => write(&mut self.faces, format_args!(" {position}//{normal}")),
                [false, true] => write(&mut self.faces, format_args!(" {position}/{coordinates}")),
                [false, false] => write(&mut self.faces, format_args!(" {position}")),
            }
        }
        self.faces.push('\n');
        Ok(())
    }

    /// Indices of position, normal and texture coordinates of `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    /// They count from 1; 0 is none, and [`LACKING`] is an index that the file lacks.
    fn corner(&self, word: &str) -> Checking<[usize; 3]> {
        let mut parts = word.split('/');
        let (position, coordinates, normal) = (parts.next().unwrap_or_default(), parts.next(), parts.next());
        // Negative indices count back from the last item so far.
        let absolute = |index: i64, of: usize| match index {
            0.. => index as usize,
            _ => usize::try_from(index.saturating_add_unsigned(self.counts[of] as u64 + 1)).unwrap_or(0),
        };
        let Ok(index) = position.parse() else {
            return Err(format!("{} is not a corner: v, v/vt, v//vn or v/vt/vn was expected", excerpt(word)));
        };
        let vertex = absolute(index, 0);
        if vertex == 0 {
            let count = self.counts[0];
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

fn write(text: &mut String, line: std::fmt::Arguments) {
    text.write_fmt(line).expect("writing to a String cannot fail");
}
