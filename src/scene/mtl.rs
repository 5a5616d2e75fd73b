//! MTL files: a tolerant reader that notes ignored statements.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DVec2, DVec3, Vec3};

use super::image_map::Map;
use super::limits::MATERIALS;
use super::lines::Lines;
use super::material::{Material, NEUTRAL};
use super::material_names::{NO_MATERIAL, shown};
use super::missed::{Missed, missed};
use super::obj_lines::{Checking, name, statement};
use super::reading::Reading;
use super::texture::{BOUNDED, Image, Texture};
use super::value::{excerpt, printable};
use crate::{Error, Result};

/// A material with its texture transform.
pub(super) struct Definition {
    pub(super) material: Material,
    /// Image coordinates are `scale·vt + offset`.
    pub(super) scale: DVec2,
    /// Offset of image coordinates, see `scale`.
    pub(super) offset: DVec2,
    /// Whether the file states a diffuse albedo or an image.
    pub(super) states_colour: bool,
}

impl Definition {
    pub(super) fn new(material: Material) -> Self {
        Self { material, scale: DVec2::ONE, offset: DVec2::ZERO, states_colour: false }
    }
}

/// Upper bound of `Kd`, `Ks` and `Ns`.
const LARGEST: f64 = 1e6;

/// A material while its lines are read.
#[derive(Default)]
struct Draft {
    name: String,
    diffuse: Option<Vec3>,
    specular: Option<Vec3>,
    exponent: Option<f32>,
    texture: Option<(Texture, [DVec2; 2])>,
    /// Lines of `Ka` and `Ni`, which are noted only in combination with other statements.
    ambient: Option<usize>,
    refraction: Option<usize>,
    is_transparent: bool,
}

/// An MTL file while it is read.
struct Library<'a, 'b> {
    reading: &'a mut Reading<'b>,
    path: &'a Path,
    line: usize,
    drafts: Vec<Draft>,
    /// Images by file; `None` if an image is unusable.
    images: HashMap<PathBuf, Option<Arc<Image>>>,
}

/// Reads `text`, the contents of `path`: `Kd`, `Ks`, `Ns` and `map_Kd`. Image paths are
/// relative to `path`. Notes other statements that would change the picture.
///
/// Fails on too many materials and on names that cannot be printed.
pub(super) fn load(reading: &mut Reading, path: &Path, text: &str) -> Result<Vec<Definition>> {
    let mut library = Library { reading, path, line: 0, drafts: Vec::new(), images: HashMap::new() };
    for (line, content) in Lines::new(text) {
        let (keyword, rest) = statement(&content);
        library.line = line;
        let result = library.statement(keyword, rest);
        result
            .map_err(|message| Error::input_at(path, line, format!("{}: {message}", printable(keyword))))?;
    }
    Ok(library.finish())
}

impl Library<'_, '_> {
    fn statement(&mut self, keyword: &str, rest: &str) -> Checking<()> {
        match keyword.to_ascii_lowercase().as_str() {
            "newmtl" => return self.begin(rest),
            _ if keyword.is_empty() || keyword.starts_with('#') => (),
            _ if self.drafts.is_empty() => {
                self.note("statements before the first `newmtl` are passed over");
            }
            "kd" => self.draft().diffuse = self.colour("Kd", rest).or(self.draft().diffuse),
            "ks" => self.draft().specular = self.colour("Ks", rest).or(self.draft().specular),
            "ns" => self.draft().exponent = self.exponent(rest).or(self.draft().exponent),
            "map_kd" => self.map(rest),
            other => self.pass_over(keyword, missed(other, rest)),
        }
        Ok(())
    }

    fn begin(&mut self, rest: &str) -> Checking<()> {
        if self.drafts.len() >= MATERIALS {
            return Err(format!("there are more than {MATERIALS} materials"));
        }
        let name = if rest.is_empty() { NO_MATERIAL } else { name(rest)? };
        self.drafts.push(Draft { name: name.to_owned(), ..Draft::default() });
        if rest.is_empty() {
            self.note("a `newmtl` without a name defines what has no material");
        }
        Ok(())
    }

    fn draft(&mut self) -> &mut Draft {
        self.drafts.last_mut().expect("statements before the first material are passed over")
    }

    /// Position of the line, for notes.
    fn place(&self) -> String {
        place(self.path, self.line, self.drafts.last())
    }

    fn note(&mut self, what: &str) {
        let place = self.place();
        self.reading.notes.add(what, || place);
    }

    fn note_named(&mut self, what: &str, name: &str) {
        let place = self.place();
        self.reading.notes.add_named(what, name, || place);
    }

    fn pass_over(&mut self, keyword: &str, missed: Missed) {
        let line = self.line;
        match missed {
            Missed::Nothing => (),
            Missed::Effect(effect) => self.note(&format!("`{keyword}` is passed over ({effect})")),
            Missed::Transparency => {
                self.draft().is_transparent = true;
                self.note(&format!("`{keyword}` is passed over (transparency): surfaces are opaque"));
            }
            Missed::Ambient => self.draft().ambient = Some(line),
            Missed::Refraction => self.draft().refraction = Some(line),
            Missed::Unknown => {
                self.note_named("statements that are not known are passed over", &excerpt(keyword));
            }
        }
    }

    /// `None` if the colour is ignored.
    fn colour(&mut self, keyword: &str, rest: &str) -> Option<Vec3> {
        let words: Vec<&str> =
            rest.split_whitespace().take_while(|word| !word.starts_with('#')).take(3).collect();
        if let Some(kind @ ("spectral" | "xyz")) = words.first().copied() {
            self.note_named(
                "colours that are not red, green and blue are passed over",
                &format!("`{keyword} {kind}`"),
            );
            return None;
        }
        let numbers: Option<Vec<f64>> = words.iter().map(|word| word.parse().ok()).collect();
        let colour = match numbers.as_deref() {
            Some(&[grey]) => DVec3::splat(grey),
            Some(&[red, green]) => DVec3::new(red, green, green),
            Some(&[red, green, blue]) => DVec3::new(red, green, blue),
            _ => DVec3::NAN,
        };
        if colour.is_nan() {
            self.note_named(
                "colours that are no numbers are passed over",
                &format!("{keyword} {}", excerpt(rest)),
            );
            return None;
        }
        if words.len() == 2 {
            self.note("colours of two numbers are taken to have a third like the second");
        }
        let clamped = colour.clamp(DVec3::ZERO, DVec3::splat(LARGEST));
        if clamped != colour {
            self.note(&format!("`{keyword}` below 0 or above 1e6 is clamped"));
        }
        Some(clamped.as_vec3())
    }

    /// `None` if the exponent is ignored.
    fn exponent(&mut self, rest: &str) -> Option<f32> {
        let found = rest.split_whitespace().next().and_then(|word| word.parse::<f64>().ok());
        let Some(exponent) = found.filter(|exponent| !exponent.is_nan()) else {
            self.note("`Ns` without a number is passed over");
            return None;
        };
        let clamped = exponent.clamp(0.0, LARGEST);
        if clamped != exponent {
            self.note("`Ns` below 0 or above 1e6 is clamped");
        }
        // Exporters write 0 for materials without highlights.
        Some((clamped as f32).max(1.0))
    }

    fn map(&mut self, rest: &str) {
        let mut passed_over = Vec::new();
        let (files, folder) = (&self.reading.files, self.path.with_file_name(""));
        let is_file = |name: &str| files.is_file(&folder.join(name.replace('\\', "/")));
        let Some(map) = Map::parse(rest, is_file, |option| passed_over.push(option)) else {
            return self.note("`map_Kd` without the name of an image is passed over");
        };
        for option in passed_over {
            self.note_named("options of `map_Kd` are passed over", &option);
        }
        let image = match self.image(map.file) {
            Ok(image) => image,
            Err(why) => {
                let what = format!("{} {why}", excerpt(map.file));
                self.note_named("images that cannot be used are left out, `Kd` is taken instead", &what);
                None
            }
        };
        if let Some(image) = image {
            let texture = Texture { image, is_clamped: map.is_clamped, is_atlas: false };
            self.draft().texture = Some((texture, [map.scale, map.offset]));
        }
    }

    /// `Ok(None)` if the image's fault was noted before.
    fn image(&mut self, file: &str) -> Checking<Option<Arc<Image>>> {
        name(file)?;
        let place = self.place();
        let file = self.reading.find(self.path, file, || place)?;
        if let Some(known) = self.images.get(&file) {
            return Ok(known.clone());
        }
        let decoded = self.reading.image(&file);
        self.images.insert(file.clone(), decoded.as_ref().ok().map(|decoded| decoded.image.clone()));
        let decoded = decoded?;
        if decoded.is_transparent {
            self.note("the transparency of images is passed over");
        }
        if decoded.is_bounded {
            self.note(BOUNDED);
        }
        if let Some(damage) = decoded.damage {
            let what = format!("{:?} {damage}", printable(&file.display().to_string()));
            self.note_named("images are damaged", &what);
        }
        Ok(Some(decoded.image))
    }

    fn finish(self) -> Vec<Definition> {
        let Self { reading, path, drafts, .. } = self;
        for draft in &drafts {
            let at = |line| place(path, line, Some(draft));
            let is_coloured = draft.diffuse.is_some() || draft.texture.is_some();
            if let Some(line) = draft.ambient.filter(|_| !is_coloured) {
                reading
                    .notes
                    .add("`Ka` is passed over, and there is no `Kd`: the material is grey", || at(line));
            }
            if let Some(line) = draft.refraction.filter(|_| draft.is_transparent) {
                reading.notes.add("`Ni` is passed over (refraction)", || at(line));
            }
            if draft.texture.is_some() && draft.diffuse == Some(Vec3::ZERO) {
                let place = || format!("{}: material {:?}", shown(path), draft.name);
                reading.notes.add("is black: its image is multiplied with a Kd of 0", place);
            }
        }
        drafts.into_iter().map(Draft::definition).collect()
    }
}

impl Draft {
    fn definition(self) -> Definition {
        // The image provides the colour.
        let colour = if self.texture.is_some() { Vec3::ONE } else { NEUTRAL };
        let mut definition = Definition::new(Material {
            diffuse: self.diffuse.unwrap_or(colour),
            specular: self.specular.unwrap_or(Vec3::ZERO),
            exponent: self.exponent.unwrap_or(1.0),
            ..Material::neutral(&self.name)
        });
        definition.states_colour = self.diffuse.is_some() || self.texture.is_some();
        if let Some((texture, [scale, offset])) = self.texture {
            (definition.scale, definition.offset) = (scale, offset);
            definition.material.texture = Some(texture);
        }
        definition
    }
}

fn place(path: &Path, line: usize, draft: Option<&Draft>) -> String {
    let material = draft.map(|draft| format!(": material {}", excerpt(&draft.name)));
    format!("{}:{line}{}", shown(path), material.unwrap_or_default())
}
