//! Films from recordings of the window.
//!
//! A recording is a sequence of samples. Its film reproduces each sample at its time. Positions are
//! within a millimetre (a thousandth of the distance from the camera to its target in small
//! scenes), all else within a thousandth. A value that was held for a while stays constant. The
//! camera's roll (`up`) and its image size are lost, because a film does not support them.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use glam::{DVec3, Vec3};

use super::channels::{Form, channels, place_tolerance_m, vector_line};
use super::curve::Curve;
use super::thin::{self, Look};
use crate::scene::luminaire::Luminaire;
use crate::scene::save::PlacedModel;
use crate::scene::{Camera, Light, LightKind, Material, Scene, builtin, numbers, save};
use crate::{Error, Result};

/// Tolerance of the angles of models, degrees.
const ANGLE_TOLERANCE_DEGREES: f64 = 0.05;

/// The animated properties of a scene at some time.
#[derive(Clone, Debug, PartialEq)]
pub struct Snapshot {
    /// The camera, recentred as the scene is.
    pub camera: Camera,
    /// All lights, identified by name, kind and number of samples.
    pub lights: Vec<Light>,
    /// The reflectance of each material, in the scene's order.
    pub materials: Vec<Reflectance>,
    /// The models of the scene file, in its order. Others are ignored.
    pub models: Vec<PlacedModel>,
}

/// The reflectance of a material at some time.
#[derive(Clone, Debug, PartialEq)]
pub struct Reflectance {
    /// The material's name.
    pub name: String,
    /// Diffuse albedo, which multiplies the material's image.
    pub diffuse: Vec3,
    /// Specular albedo of the lobe.
    pub specular: Vec3,
    /// Exponent of the Phong lobe.
    pub exponent: f32,
}

impl Snapshot {
    /// The state of a scene, seen by its first camera, without its models.
    pub fn from_scene(scene: &Scene) -> Self {
        let reflectance = |material: &Material| Reflectance {
            name: material.name.clone(),
            diffuse: material.diffuse,
            specular: material.specular,
            exponent: material.exponent,
        };
        Self {
            camera: scene.cameras[0].clone(),
            lights: scene.lights.clone(),
            materials: scene.materials.iter().map(reflectance).collect(),
            models: Vec::new(),
        }
    }
}

/// A recording, sample by sample.
#[derive(Clone, Debug)]
pub struct Recording {
    scene: String,
    origin: DVec3,
    fps: f64,
    first: Snapshot,
    /// Times of the samples, seconds; rising.
    times: Vec<f64>,
    camera: Series<(Vec3, Vec3, f32)>,
    lights: Vec<RecordedLight>,
    /// One series per material of the scene.
    materials: Vec<Series<Look>>,
    /// One series per model of the scene.
    models: Vec<Series<ModelPlace>>,
}

/// Offset, angles in degrees, and whether a model is hidden.
type ModelPlace = (DVec3, DVec3, bool);

/// A light of one kind. A light that changes its kind becomes two lights in the film.
#[derive(Clone, Debug)]
struct RecordedLight {
    /// Name of the light in the window.
    name: String,
    /// Name of the light in the film.
    film_name: String,
    /// The light in the scene. `None` if it was added.
    base: Option<Light>,
    /// The first state, which gives its kind and number of samples.
    kind: LightKind,
    /// Its measured intensities, if any.
    luminaire: Option<Luminaire>,
    /// Its state and whether it is on. `None` while it is absent.
    series: Series<Option<(LightKind, bool)>>,
}

/// A value that changes at some samples.
#[derive(Clone, Debug)]
struct Series<V> {
    /// First sample of each new value, and the value.
    changes: Vec<(usize, V)>,
}

impl<V: Copy + PartialEq> Series<V> {
    fn new() -> Self {
        Self { changes: Vec::new() }
    }

    fn record(&mut self, sample: usize, value: V) {
        if self.changes.last().is_none_or(|(_, last)| *last != value) {
            self.changes.push((sample, value));
        }
    }

    /// All samples with their values, up to `count` samples.
    fn all(&self, count: usize) -> impl Iterator<Item = (usize, V)> + '_ {
        let ends = self.changes.iter().skip(1).map(|(sample, _)| *sample).chain([count]);
        self.changes.iter().zip(ends).flat_map(|(&(start, value), end)| (start..end).map(move |i| (i, value)))
    }
}

/// The keys of one object: lines of a table, by sample.
type Keys = BTreeMap<usize, Vec<String>>;
/// The keys of one object, by time in seconds.
type Timed = Vec<(f64, Vec<String>)>;

impl Recording {
    /// `scene` is the film's name for the scene: a built-in one, or a path from the current
    /// directory. `first` is the state in that file; a property that never differs from it gets no
    /// key. `origin` is the scene's.
    pub fn new(scene: &str, first: &Snapshot, origin: DVec3, fps: f64) -> Self {
        let mut recording = Self {
            scene: scene.to_owned(),
            origin,
            fps,
            first: first.clone(),
            times: Vec::new(),
            camera: Series::new(),
            lights: Vec::new(),
            materials: vec![Series::new(); first.materials.len()],
            models: vec![Series::new(); first.models.len()],
        };
        for light in &first.lights {
            recording.add_light(light, Some(light.clone()));
        }
        recording
    }

    /// Adds a sample at a time, seconds from the recording's start. It is ignored unless it is
    /// later than the last one.
    pub fn add(&mut self, time_s: f64, now: &Snapshot) {
        if !(time_s >= 0.0 && self.times.last().is_none_or(|last| time_s > *last)) {
            return;
        }
        let sample = self.times.len();
        self.times.push(time_s);
        let camera = &now.camera;
        self.camera.record(sample, (camera.position, camera.target, camera.fov_y_degrees));
        for (series, it) in self.materials.iter_mut().zip(&now.materials) {
            series.record(sample, look(it));
        }
        for (series, model) in self.models.iter_mut().zip(&now.models) {
            series.record(sample, (model.translation, model.rotation, model.is_hidden));
        }
        let mut is_there = vec![false; self.lights.len()];
        for light in &now.lights {
            let known = self.lights.iter().position(|it| it.is(light));
            let index = known.unwrap_or_else(|| self.add_light(light, None));
            is_there.resize(self.lights.len(), false);
            is_there[index] = true;
            self.lights[index].series.record(sample, Some((light.kind, light.is_on)));
        }
        let gone = self.lights.iter_mut().zip(is_there).filter(|(_, is_there)| !is_there);
        gone.for_each(|(light, _)| light.series.record(sample, None));
    }

    fn add_light(&mut self, light: &Light, base: Option<Light>) -> usize {
        let is_taken = |name: &str| {
            self.lights.iter().any(|it| it.film_name == name)
                || base.is_none() && self.first.lights.iter().any(|it| it.name == name)
        };
        let numbered = (2..).map(|number: u32| format!("{} {number}", light.name));
        let mut names = std::iter::once(light.name.clone()).chain(numbered);
        let film_name = names.find(|name| !is_taken(name)).expect("numbers do not end");
        let (name, kind, luminaire) = (light.name.clone(), light.kind, light.luminaire.clone());
        self.lights.push(RecordedLight { name, film_name, base, kind, luminaire, series: Series::new() });
        self.lights.len() - 1
    }

    /// The text of the film's file, to be saved at `to`. Its last frame is the last sample.
    ///
    /// A removed light is switched off. A light that changes its kind or number of samples is
    /// switched off, and another one is added. Of materials with the same name, the first one that
    /// changes applies to all.
    ///
    /// # Errors
    /// [`crate::Error::Output`] if the scene cannot be named in that file, [`crate::Error::Usage`]
    /// if a model that moves has the name of another one.
    pub fn finish(&self, to: &Path) -> Result<String> {
        let is_built_in = builtin::NAMES.contains(&self.scene.as_str());
        let scene = match is_built_in {
            true => self.scene.clone(),
            false => save::relative_to(Path::new(&self.scene), to)?,
        };
        let end = self.times.last().copied().unwrap_or(0.0) + 1.0 / self.fps;
        let [fps, duration] = [self.fps, end].map(numbers::text);
        let mut film = format!("scene = {}\nfps = {fps}\nduration = {duration}\n", quoted(&scene));
        if !self.times.is_empty() {
            write_keys(&mut film, "camera", None, self.timed(self.camera_keys()));
            for light in &self.lights {
                let keys = self.timed(self.light_keys(light, to)?);
                write_keys(&mut film, "light", Some(&light.film_name), keys);
            }
            for (model, series) in self.first.models.iter().zip(&self.models) {
                let keys = self.timed(self.model_keys(model, series)?);
                write_keys(&mut film, "model", Some(&model.key_name()), keys);
            }
            let mut said: Vec<&str> = Vec::new();
            for (material, series) in self.first.materials.iter().zip(&self.materials) {
                let keys = self.material_keys(series, look(material));
                if !keys.is_empty() && !said.contains(&material.name.as_str()) {
                    said.push(&material.name);
                    write_keys(&mut film, "material", Some(&material.name), keys);
                }
            }
        }
        Ok(film)
    }

    fn timed(&self, keys: Keys) -> Timed {
        keys.into_iter().map(|(sample, lines)| (self.times[sample], lines)).collect()
    }

    fn camera_keys(&self) -> Keys {
        let base = &self.first.camera;
        let mut keys = Keys::new();
        let all: Vec<_> = self.camera.all(self.times.len()).collect();
        type Part = fn((Vec3, Vec3, f32)) -> Vec3;
        let channels: [(Form, Vec3, Part); 3] = [
            (Form::Place("position"), base.position, |it| it.0),
            (Form::Place("target"), base.target, |it| it.1),
            (Form::FieldOfView, Vec3::splat(base.fov_y_degrees), |it| Vec3::splat(it.2)),
        ];
        for (form, base, part) in channels {
            let samples: Vec<_> = all.iter().map(|&(sample, it)| (sample, part(it))).collect();
            self.write_channel(&mut keys, form, Some(base), &samples);
        }
        keys
    }

    fn light_keys(&self, light: &RecordedLight, to: &Path) -> Result<Keys> {
        let mut keys = Keys::new();
        let all: Vec<_> = light.series.all(self.times.len()).collect();
        let there: Vec<_> = all.iter().filter_map(|&(sample, it)| Some((sample, it?.0))).collect();
        let mut is_on = light.base.as_ref().is_none_or(|base| base.is_on);
        if light.base.is_none()
            && let Some(&(first, kind)) = there.first()
        {
            let mut lines = vec![format!("kind = {}", quoted(kind.word()))];
            if let LightKind::Area { samples, .. } = kind {
                lines.push(format!("samples = {samples}"));
            }
            if let Some(Luminaire { file, turn, .. }) = &light.luminaire {
                lines.push(format!("ies = {}", quoted(&save::relative_to(file, to)?)));
                lines.push(format!("turn = {}", numbers::text(numbers::degrees(*turn, 360.0))));
            }
            keys.insert(first, lines);
        }
        for &(sample, it) in &all {
            let wanted = it.is_some_and(|(_, is_on)| is_on);
            if wanted != is_on {
                keys.entry(sample).or_default().push(format!("on = {wanted}"));
            }
            is_on = wanted;
        }
        let is_measured = light.luminaire.is_some();
        let bases = light.base.as_ref().map(|base| channels(base.kind, is_measured));
        for (index, (form, _)) in channels(light.kind, is_measured).into_iter().enumerate() {
            let base = bases.as_ref().map(|channels| channels[index].1);
            let samples: Vec<_> =
                there.iter().map(|&(sample, kind)| (sample, channels(kind, is_measured)[index].1)).collect();
            self.write_channel(&mut keys, form, base, &samples);
        }
        Ok(keys)
    }

    /// Writes the keys of one property, whose value in the scene is `base`. `None` is an added
    /// light, whose value must be stated.
    fn write_channel(&self, keys: &mut Keys, form: Form, base: Option<Vec3>, samples: &[(usize, Vec3)]) {
        if samples.is_empty() || base.is_some_and(|base| samples.iter().all(|(_, value)| *value == base)) {
            return;
        }
        let sample = |&(sample, value): &(usize, Vec3)| (self.times[sample], form.number(value, self.origin));
        let values: Vec<(f64, DVec3)> = samples.iter().map(sample).collect();
        let camera = &self.first.camera;
        let place_m = place_tolerance_m(camera.position.distance(camera.target));
        let excess = |wanted, found| form.excess(wanted, found, place_m);
        let mut found = thin::keys(&values, form.curve(), &excess);
        if base.is_none() && found[0] != 0 {
            found.insert(0, 0);
        }
        for index in found {
            keys.entry(samples[index].0).or_default().push(form.line(values[index].1));
        }
    }

    fn model_keys(&self, base: &PlacedModel, series: &Series<ModelPlace>) -> Result<Keys> {
        let mut keys = Keys::new();
        let all: Vec<_> = series.all(self.times.len()).collect();
        let camera = &self.first.camera;
        let place_m = place_tolerance_m(camera.position.distance(camera.target));
        let tolerances = [place_m, ANGLE_TOLERANCE_DEGREES];
        let lists = [("translate", base.translation), ("rotate", base.rotation)];
        for (which, (key, own)) in lists.into_iter().enumerate() {
            let value = |place: ModelPlace| if which == 0 { place.0 } else { place.1 };
            let values: Vec<_> =
                all.iter().map(|&(sample, place)| (self.times[sample], value(place))).collect();
            if values.iter().all(|(_, value)| *value == own) {
                continue;
            }
            let excess =
                |wanted: DVec3, found: DVec3| (wanted - found).abs().max_element() / tolerances[which];
            let curve = if which == 0 { Curve::path } else { Curve::amounts };
            for index in thin::keys(&values, curve, &excess) {
                keys.entry(all[index].0).or_default().push(vector_line(key, values[index].1));
            }
        }
        let mut is_hidden = base.is_hidden;
        for (sample, place) in all {
            if std::mem::replace(&mut is_hidden, place.2) != place.2 {
                keys.entry(sample).or_default().push(format!("hidden = {}", place.2));
            }
        }
        let name = base.key_name();
        if !keys.is_empty() && self.first.models.iter().filter(|model| model.key_name() == name).count() > 1 {
            let message = format!(
                "several models are called {name:?}: a film needs a `name` in the scene file to move one"
            );
            return Err(Error::Usage(message));
        }
        Ok(keys)
    }

    fn material_keys(&self, series: &Series<Look>, base: Look) -> Timed {
        let mut keys = Timed::new();
        let samples: Vec<_> =
            series.all(self.times.len()).map(|(sample, look)| (self.times[sample], look)).collect();
        if samples.is_empty() {
            return keys;
        }
        let changes = thin::fades(&samples, base);
        for (index, &[start, end]) in changes.iter().enumerate() {
            let (from, to) = match start == end {
                true => (start.checked_sub(1).map_or(base, |before| samples[before].1), samples[end].1),
                false => (samples[start].1, samples[end].1),
            };
            let mut lines = Vec::new();
            if start < end {
                lines.push(format!("fade = {}", numbers::text(samples[end].0 - samples[start].0)));
            }
            let nothing = lines.len();
            let vectors = [("diffuse", from.diffuse, to.diffuse), ("specular", from.specular, to.specular)];
            lines.extend(vectors.iter().filter(|it| it.1 != it.2).map(|it| vector_line(it.0, it.2)));
            if from.exponent != to.exponent {
                lines.push(format!("exponent = {}", numbers::text(to.exponent)));
            }
            if lines.len() > nothing {
                // Only one change can begin at a time. An instant change that another one follows
                // is placed between two samples.
                let is_followed = start == end && changes.get(index + 1).is_some_and(|next| next[0] == end);
                let before = start.checked_sub(1).filter(|_| is_followed);
                let time = samples[start].0;
                keys.push((before.map_or(time, |before| 0.5 * (samples[before].0 + time)), lines));
            }
        }
        keys
    }
}

impl RecordedLight {
    fn is(&self, light: &Light) -> bool {
        let samples = |kind: LightKind| match kind {
            LightKind::Area { samples, .. } => samples,
            _ => 0,
        };
        let is_alike = |a: LightKind, b: LightKind| a.word() == b.word() && samples(a) == samples(b);
        self.name == light.name && self.luminaire == light.luminaire && is_alike(self.kind, light.kind)
    }
}

fn look(it: &Reflectance) -> Look {
    let albedo = |albedo: Vec3| DVec3::from(albedo.to_array().map(numbers::plain));
    let exponent = numbers::plain(it.exponent);
    Look { diffuse: albedo(it.diffuse), specular: albedo(it.specular), exponent }
}

fn write_keys(film: &mut String, list: &str, name: Option<&str>, keys: Timed) {
    let name = name.map_or_else(String::new, |name| format!("name = {}\n", quoted(name)));
    for (time, lines) in keys {
        let (time, lines) = (numbers::text(time), lines.join("\n"));
        let written = writeln!(film, "\n[[{list}]]\n{name}time = {time}\n{lines}");
        written.expect("writing to a string succeeds");
    }
}

fn quoted(text: &str) -> String {
    toml_edit::Value::from(text).to_string()
}
