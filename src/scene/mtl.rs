//! MTL files: a tolerant reader that notes ignored statements.

use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::alpha::Alpha;
use super::cutouts::{self, CUT_AT_HALF, Cutout};
use super::image_map::Map;
use super::limits::MATERIALS;
use super::lines::Lines;
use super::material_names::NO_MATERIAL;
use super::missed::{Missed, missed};
use super::mtl_draft::{Definition, Draft, place};
use super::obj_lines::{Checking, name, statement};
use super::reading::Reading;
use super::texture::{BOUNDED, Image, Texture};
use super::transparency;
use super::value::{excerpt, printable};
use crate::{Error, Result};

/// Notes about images of emission: a light has one colour.
pub(super) const EMISSION_BY_MEAN: &str = "images of emission count by their mean colour";
pub(super) const EMISSION_LEFT_OUT: &str =
    "images of emission that are dark but for small parts are left out: the surface does not emit";

/// Upper bound of `Kd`, `Ks` and `Ns`.
const LARGEST: f64 = 1e6;

/// An MTL file while it is read.
struct Library<'a, 'b> {
    reading: &'a mut Reading<'b>,
    path: &'a Path,
    line: usize,
    drafts: Vec<Draft>,
    /// Images by file; `None` if an image is unusable.
    images: HashMap<PathBuf, Option<Picture>>,
}

/// An image with its alpha channel. `None`: all of it is opaque.
type Picture = (Arc<Image>, Option<Arc<Alpha>>);

/// Reads `text`, the contents of `path`. Image paths are
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
            "pr" => self.draft().roughness = self.fraction(keyword, rest).or(self.draft().roughness),
            "pm" => self.draft().metal = self.fraction(keyword, rest).or(self.draft().metal),
            "map_kd" => self.colour_map(rest),
            "map_d" => self.opacity_map(rest),
            "d" if is_zero(rest) => self.draft().hidden = Some(self.line),
            "d" | "tr" | "tf" | "illum" if self.transparency(keyword, rest) => (),
            "ke" => self.draft().emission = self.colour("Ke", rest).or(self.draft().emission),
            "map_ks" => self.specular_map(keyword, rest),
            "map_ke" | "map_emissive" => self.emission_map(keyword, rest),
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

    /// Reads a statement about light that passes. Returns whether it is one.
    fn transparency(&mut self, keyword: &str, rest: &str) -> bool {
        let line = self.line;
        let keyword = keyword.to_ascii_lowercase();
        if !keyword.starts_with('t') && missed(&keyword, rest) != Missed::Transparency {
            return false;
        }
        match (keyword.as_str(), transparency::number(rest)) {
            ("d", Some(opacity)) => self.draft().transparency.dissolve = Some((opacity, line)),
            // Some exporters mean the opacity, so 1 is ambiguous.
            ("tr", Some(passed)) if passed < 1.0 => {
                self.draft().transparency.transparency = Some((1.0 - passed, line));
            }
            ("tf", Some(_)) => {
                let Some(filter) = self.colour("Tf", rest) else { return true };
                self.draft().transparency.filter = Some((filter, line));
            }
            ("illum", Some(_)) => self.draft().transparency.illum = Some(line),
            _ => return false,
        }
        true
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

    /// A roughness or metalness. `None` if it is no number.
    fn fraction(&mut self, keyword: &str, rest: &str) -> Option<f32> {
        let found = rest.split_whitespace().next().and_then(|word| word.parse::<f32>().ok());
        let found = found.filter(|value| !value.is_nan());
        match found {
            Some(value) if (0.0..=1.0).contains(&value) => (),
            Some(_) => self.note(&format!("`{keyword}` below 0 or above 1 is clamped")),
            None => self.note(&format!("`{keyword}` without a number is passed over")),
        }
        found.map(|value| value.clamp(0.0, 1.0))
    }

    fn colour_map(&mut self, rest: &str) {
        let what = "images that cannot be used are left out, `Kd` is taken instead";
        if let Some(((image, alpha), map)) = self.map("map_Kd", rest, what) {
            let texture = Texture { image, is_clamped: map.is_clamped, is_atlas: false };
            let line = self.line;
            self.draft().texture = Some((texture, [map.scale, map.offset]));
            self.draft().alpha = alpha.map(|_| line);
        }
    }

    /// The alpha channel of an image is its opacity; without one, its luminance is.
    fn opacity_map(&mut self, rest: &str) {
        let what = "opacity maps that cannot be used are left out: surfaces are opaque";
        if let Some(((image, alpha), map)) = self.map("map_d", rest, what) {
            let alpha = alpha.unwrap_or_else(|| cutouts::luminance(&image));
            if alpha.is_grey() {
                self.note(CUT_AT_HALF);
            }
            let cutout = Cutout { alpha, is_clamped: map.is_clamped, cutoff: 0.5 };
            self.draft().opacity = Some((cutout, [map.scale, map.offset]));
        }
    }

    /// An image and its options. `None` if it cannot be used; `what` is the note about that.
    fn map<'t>(&mut self, keyword: &str, rest: &'t str, what: &str) -> Option<(Picture, Map<'t>)> {
        let mut passed_over = Vec::new();
        let (files, folder) = (&self.reading.files, self.path.with_file_name(""));
        let is_file = |name: &str| files.is_file(&folder.join(name.replace('\\', "/")));
        let Some(map) = Map::parse(rest, is_file, |option| passed_over.push(option)) else {
            self.note(&format!("`{keyword}` without the name of an image is passed over"));
            return None;
        };
        for option in passed_over {
            self.note_named(&format!("options of `{keyword}` are passed over"), &option);
        }
        match self.image(map.file) {
            Ok(picture) => picture.map(|picture| (picture, map)),
            Err(why) => {
                self.note_named(what, &format!("{} {why}", excerpt(map.file)));
                None
            }
        }
    }

    /// Reads an image of the emission. A light has one colour: the image counts by its mean.
    fn emission_map(&mut self, keyword: &str, rest: &str) {
        let unusable = "images of emission that cannot be used are left out";
        if let Some(image) = self.image_of_mean(keyword, rest, unusable) {
            let colour = image.emission();
            self.note(if colour.is_some() { EMISSION_BY_MEAN } else { EMISSION_LEFT_OUT });
            self.draft().emission_colour = Some(colour.unwrap_or(Vec3::ZERO));
        }
    }

    /// Reads an image of the specular albedo, which counts by its mean.
    fn specular_map(&mut self, keyword: &str, rest: &str) {
        let unusable = "images of highlights that cannot be used are left out, `Ks` is taken instead";
        if let Some(image) = self.image_of_mean(keyword, rest, unusable) {
            self.note("images of highlights count by their mean colour");
            self.draft().specular_colour = Some(image.mean());
        }
    }

    /// An image whose place does not matter. Notes `unusable` if the image is.
    fn image_of_mean(&mut self, keyword: &str, rest: &str, unusable: &str) -> Option<Arc<Image>> {
        let (files, folder) = (&self.reading.files, self.path.with_file_name(""));
        let is_file = |name: &str| files.is_file(&folder.join(name.replace('\\', "/")));
        let Some(map) = Map::parse(rest, is_file, |_| ()) else {
            self.note(&format!("`{keyword}` without the name of an image is passed over"));
            return None;
        };
        match self.image(map.file) {
            Ok(picture) => picture.map(|(image, _)| image),
            Err(why) => {
                self.note_named(unusable, &format!("{} {why}", excerpt(map.file)));
                None
            }
        }
    }

    /// `Ok(None)` if the image's fault was noted before.
    fn image(&mut self, file: &str) -> Checking<Option<Picture>> {
        name(file)?;
        let place = self.place();
        let file = self.reading.find(self.path, file, || place)?;
        if let Some(known) = self.images.get(&file) {
            return Ok(known.clone());
        }
        let decoded = self.reading.image(&file);
        let picture = decoded.as_ref().ok().map(|decoded| (decoded.image.clone(), decoded.alpha.clone()));
        self.images.insert(file.clone(), picture.clone());
        let decoded = decoded?;
        if decoded.is_bounded {
            self.note(BOUNDED);
        }
        if let Some(damage) = decoded.damage {
            let what = format!("{:?} {damage}", printable(&file.display().to_string()));
            self.note_named("images are damaged", &what);
        }
        Ok(picture)
    }

    fn finish(self) -> Vec<Definition> {
        let Self { reading, path, drafts, .. } = self;
        drafts.iter().for_each(|draft| draft.note(reading, path));
        drafts.into_iter().map(Draft::definition).collect()
    }
}

/// Whether a `d` makes its material invisible.
fn is_zero(rest: &str) -> bool {
    rest.split_whitespace().next().and_then(|word| word.parse::<f64>().ok()).is_some_and(|value| value <= 0.0)
}
