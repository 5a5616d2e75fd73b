//! MTL files. Every line is checked first, and `tobj` reads only what passed: it names no line when it fails.

use std::collections::{BTreeSet, HashMap};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DVec2, DVec3, Vec3};

use super::limits::MATERIALS;
use super::material::{Material, NEUTRAL};
use super::obj::{Checking, name, numbers, statement};
use super::reading::Reading;
use super::texture::{Image, Texture};
use super::value::excerpt;
use crate::{Error, Result};

/// A material, and where its texture lies.
pub(super) struct Definition {
    pub(super) material: Material,
    /// Image coordinates are `scale·vt + offset`.
    pub(super) scale: DVec2,
    /// See `scale`.
    pub(super) offset: DVec2,
}

impl Definition {
    pub(super) fn new(material: Material) -> Self {
        Self { material, scale: DVec2::ONE, offset: DVec2::ZERO }
    }
}

/// A `map_Kd` line.
struct Map<'a> {
    file: &'a str,
    scale: DVec2,
    offset: DVec2,
    is_clamped: bool,
}

/// An MTL file, as far as it is known to be good.
#[derive(Default)]
struct Checked<'a> {
    /// What `tobj` is to read. `map_Kd` names an image by its index in `maps`.
    text: String,
    /// How many there are.
    materials: usize,
    maps: Vec<(Map<'a>, Arc<Image>)>,
    /// Images that were read, by file.
    images: HashMap<PathBuf, Arc<Image>>,
    /// Statements and options that one would miss.
    ignored: BTreeSet<String>,
}

/// Options of `map_Kd` that are passed over, with the most values that each takes.
const IGNORED_OPTIONS: [(&str, usize); 9] = [
    ("-blendu", 1),
    ("-blendv", 1),
    ("-bm", 1),
    ("-boost", 1),
    ("-cc", 1),
    ("-imfchan", 1),
    ("-mm", 2),
    ("-t", 3),
    ("-texres", 1),
];

/// Reads `text`, the contents of `path`: `Kd`, `Ks`, `Ns` and `map_Kd`, whose images lie relative to it. Other statements change
/// nothing, and one warning names those that one would miss.
pub(super) fn load(reading: &mut Reading, path: &Path, text: &str) -> Result<Vec<Definition>> {
    let mut checked = Checked::default();
    for (index, content) in text.strip_prefix('\u{feff}').unwrap_or(text).lines().enumerate() {
        let (keyword, rest) = statement(content);
        let result = match keyword {
            "newmtl" => checked.begin(rest),
            "Kd" | "Ks" | "Ns" => checked.reflectance(keyword, rest),
            "map_Kd" => checked.map(reading, path, rest),
            "map_Ks" => {
                checked.ignored.insert(keyword.to_owned());
                Ok(())
            }
            "Ke" if numbers(rest) != Ok([0.0; 3]) => {
                checked.ignored.insert(keyword.to_owned());
                Ok(())
            }
            _ => Ok(()),
        };
        result.map_err(|message| Error::input_at(path, index + 1, format!("{keyword}: {message}")))?;
    }
    if !checked.ignored.is_empty() {
        let ignored: Vec<&str> = checked.ignored.iter().map(String::as_str).collect();
        reading.warnings.push(format!("{:?}: ignored {}", path.display(), ignored.join(", ")));
    }
    let (materials, _) = tobj::load_mtl_buf(&mut checked.text.as_bytes())
        .map_err(|fault| Error::input(path, format!("cannot be read: {fault}")))?;
    let definitions: Vec<_> = materials.into_iter().map(|material| checked.definition(material)).collect();
    let materials = definitions.iter().map(|definition| &definition.material);
    for material in materials.filter(|m| m.texture.is_some() && m.diffuse == Vec3::ZERO) {
        let (path, name) = (path.display(), &material.name);
        reading
            .warnings
            .push(format!("{path:?}: material {name:?} is black: its image is multiplied with a Kd of 0"));
    }
    Ok(definitions)
}

impl<'a> Checked<'a> {
    fn definition(&self, material: tobj::Material) -> Definition {
        let vec3 = |values: Option<[f64; 3]>, default| values.map_or(default, |v| DVec3::from(v).as_vec3());
        let map =
            material.diffuse_texture.as_ref().and_then(|index| self.maps.get(index.parse::<usize>().ok()?));
        let mut definition = Definition::new(Material {
            // An image is a colour of its own.
            diffuse: vec3(material.diffuse, if map.is_some() { Vec3::ONE } else { NEUTRAL }),
            specular: vec3(material.specular, Vec3::ZERO),
            // Exporters write 0 for "not shiny".
            exponent: material.shininess.map_or(1.0, |exponent| (exponent as f32).max(1.0)),
            ..Material::neutral(&material.name)
        });
        if let Some((map, image)) = map {
            (definition.scale, definition.offset) = (map.scale, map.offset);
            definition.material.texture = Some(Texture { image: image.clone(), is_clamped: map.is_clamped });
        }
        definition
    }

    fn begin(&mut self, rest: &str) -> Checking<()> {
        let name = name(rest)?;
        self.materials += 1;
        if self.materials > MATERIALS {
            return Err(format!("there are more than {MATERIALS} materials"));
        }
        self.write(format_args!("newmtl {name}\n"));
        Ok(())
    }

    /// `Kd` and `Ks` state three numbers, `Ns` one.
    fn reflectance(&mut self, keyword: &str, rest: &str) -> Checking<()> {
        self.expect_material()?;
        let count = if keyword == "Ns" { 1 } else { 3 };
        let words: Vec<&str> = rest.split_whitespace().take(count).collect();
        let in_range = |word: &&str| word.parse().is_ok_and(|value: f64| (0.0..=1e6).contains(&value));
        if words.len() < count || !words.iter().all(in_range) {
            let expected = if count == 1 { "one number" } else { "three numbers" };
            return Err(format!("{} is not {expected} from 0 to 1e6", excerpt(rest)));
        }
        self.write(format_args!("{keyword} {}\n", words.join(" ")));
        Ok(())
    }

    fn map(&mut self, reading: &mut Reading, path: &Path, rest: &'a str) -> Checking<()> {
        self.expect_material()?;
        let map = Map::parse(rest, &mut self.ignored)?;
        name(map.file)?;
        // Other systems part folders by backslashes.
        let file = path.with_file_name("").join(map.file.replace('\\', "/"));
        let image = match self.images.get(&file) {
            Some(image) => image.clone(),
            None => {
                let fault = |what| format!("{:?} {what}", file.display());
                let (image, is_transparent) = reading.image(&file).map_err(fault)?;
                if is_transparent {
                    self.ignored.insert("the transparency of images".to_owned());
                }
                self.images.entry(file).or_insert(Arc::new(image)).clone()
            }
        };
        self.write(format_args!("map_Kd {}\n", self.maps.len()));
        self.maps.push((map, image));
        Ok(())
    }

    fn expect_material(&self) -> Checking<()> {
        if self.text.is_empty() { Err("a `newmtl` line must come first".to_owned()) } else { Ok(()) }
    }

    fn write(&mut self, text: std::fmt::Arguments) {
        self.text.write_fmt(text).expect("writing to a String cannot fail");
    }
}

impl<'a> Map<'a> {
    /// Options, then a file name to the end of the line, which may hold spaces.
    fn parse(mut rest: &'a str, ignored: &mut BTreeSet<String>) -> Checking<Self> {
        let mut map = Self { file: "", scale: DVec2::ONE, offset: DVec2::ZERO, is_clamped: false };
        while rest.starts_with('-') {
            let (option, after) = statement(rest);
            rest = after;
            match option {
                "-o" => map.offset = vector(option, &mut rest, DVec2::ZERO)?,
                "-s" => map.scale = vector(option, &mut rest, DVec2::ONE)?,
                "-clamp" => {
                    let (value, after) = statement(rest);
                    map.is_clamped = match value {
                        "on" => true,
                        "off" => false,
                        _ => return Err(format!("-clamp {}: on or off was expected", excerpt(value))),
                    };
                    rest = after;
                }
                _ => match IGNORED_OPTIONS.iter().find(|(name, _)| *name == option) {
                    Some(&(_, most)) => {
                        ignored.insert(format!("map_Kd {option}"));
                        skip(&mut rest, most);
                    }
                    None => return Err(format!("{} is no option of map_Kd", excerpt(option))),
                },
            }
        }
        if rest.is_empty() {
            return Err("the name of an image is missing".to_owned());
        }
        map.file = rest;
        Ok(map)
    }
}

/// The numbers at the start of `rest`, up to three; the last word of a line is a file name, even where it is a number.
fn leading_numbers(rest: &mut &str) -> Vec<f64> {
    let mut found = Vec::new();
    while found.len() < 3 {
        let (word, after) = statement(rest);
        let Ok(number) = word.parse::<f64>() else { break };
        if after.is_empty() {
            break;
        }
        found.push(number);
        *rest = after;
    }
    found
}

/// The first two of one to three numbers; what is not there is taken from `default`.
fn vector(option: &str, rest: &mut &str, default: DVec2) -> Checking<DVec2> {
    let found = leading_numbers(rest);
    if found.is_empty() || !found.iter().all(|number| number.abs() <= 1e6) {
        return Err(format!("{option} needs one to three numbers up to 1e6, and an image after them"));
    }
    Ok(DVec2::new(found[0], found.get(1).copied().unwrap_or(default.y)))
}

/// Passes over the values of an option: one word, or up to so many numbers.
fn skip(rest: &mut &str, most: usize) {
    if most > 1 {
        leading_numbers(rest);
    } else {
        *rest = statement(rest).1;
    }
}
