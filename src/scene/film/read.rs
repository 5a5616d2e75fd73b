//! Reads a film's file.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use glam::DVec3;

use super::curve::{Curve, Fades};
use super::tracks::{CameraTrack, LightTrack, MaterialTrack, ModelTrack};
use super::{Film, builtin};
use crate::scene::builtin::{self as scenes, Files, utf8};
use crate::scene::file::Source;
use crate::scene::luminaire::Luminaire;
use crate::scene::save::PlacedModel;
use crate::scene::value::{COORDINATE, Kind, Node, POWER, Section, unknown};
use crate::scene::{Camera, Light, LightKind, LoadOptions, Material, Scene, camera, limits};
use crate::{Error, Result};

/// Seconds from the start of a film.
const TIME: std::ops::RangeInclusive<f64> = 0.0..=1e6;
/// Keys of one value that are closer in time than this are refused: the speed between them
/// is not computable.
const MIN_STEP_S: f64 = 1e-6;
/// Keys of a light that belong to the film, in addition to those of its kind.
const OWN: [&str; 3] = ["time", "on", "fade"];

/// A key of a timeline.
struct Key<'a> {
    time: f64,
    section: Section<'a>,
}

/// Angles that a key of a model may state, degrees: a hundred turns either way.
const TURNS: std::ops::RangeInclusive<f64> = -36_000.0..=36_000.0;

/// Loads the film, and its scene with the models of a frame, without the check between keys.
pub(super) fn load(spec: &str, options: &LoadOptions, frame: u32) -> Result<(Film, Scene)> {
    let (file, text) = open(spec, options)?;
    let root = Node::parse(&file, &text)?;
    let top = Section::new(&file, "", &root)?;
    top.only(&["scene", "fps", "duration", "size", "camera", "light", "material", "model"])?;
    let missing = |key, what: &str| top.fault_at(key, format!("the key is missing ({what})"));
    let name =
        top.text("scene")?.ok_or_else(|| missing("scene", "a built-in scene or the path of a file"))?;
    let fps = top.number("fps", 0.001..=1000.0)?.unwrap_or(24.0);
    let size = options.size.or(top.size("size", camera::SIZE)?);
    let files = Files::from_options(&file, options);
    let scene_spec = scene_spec(&top, &files, &file, name)?;
    let mut options = LoadOptions { size, ..options.clone() };
    let model_keys = keys(&file, &root, "model")?;
    let models = read_models(&model_keys, &scene_spec, &options)?;
    let time = f64::from(frame) / fps;
    options.set.extend(models.iter().flat_map(|track| track.changes_at(time)));
    let mut scene = Scene::load(&scene_spec, &options)?;

    let origin = scene.origin;
    let (cameras, mut last) = (keys(&file, &root, "camera")?, 0.0_f64);
    let camera = read_camera(&cameras, &scene.cameras[0])?;
    let light_keys = keys(&file, &root, "light")?;
    let lights = by_name(&light_keys)?.into_iter().map(|(name, keys)| read_light(name, &keys, &mut scene));
    let lights = lights.collect::<Result<Vec<_>>>()?;
    let changes = keys(&file, &root, "material")?;
    let mut named: HashMap<String, Vec<usize>> = HashMap::new();
    for (index, material) in scene.materials.iter().enumerate() {
        named.entry(material.name.clone()).or_default().push(index);
    }
    let materials = by_name(&changes)?.into_iter();
    let materials = materials.map(|(name, keys)| read_material(name, &keys, &named, &mut scene));
    let materials = materials.collect::<Result<Vec<_>>>()?;
    for Key { time, section } in cameras.iter().chain(&light_keys).chain(&changes).chain(&model_keys) {
        last = last.max(time + section.number("fade", TIME)?.unwrap_or(0.0));
    }
    let duration = top.number("duration", TIME)?.unwrap_or(last);
    // A frame that would start a rounding error before the end does not count.
    let frame_count = (duration * fps - 1e-6).ceil();
    const MAX_FRAMES: u32 = limits::FILM_FRAMES;
    if !(1.0..=f64::from(MAX_FRAMES)).contains(&frame_count) {
        let found = format!("{duration} s at {fps} frames a second are {} frames", frame_count.max(0.0));
        return Err(top.fault_at("duration", format!("{found}: 1 to {MAX_FRAMES} expected")));
    }
    let film = Film {
        name: file.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        fps,
        frame_count: frame_count as u32,
        file: file.clone(),
        origin,
        camera,
        lights,
        materials: materials.into_iter().flatten().collect(),
        models,
    };
    let seen = places(&film).map(|place| (place - origin).as_vec3());
    // Cameras at these positions make their surroundings take part in the precomputation.
    let seen: Vec<Camera> = seen.map(|position| Camera { position, ..scene.cameras[0].clone() }).collect();
    scene.cameras.extend(seen);
    if builtin::text(spec).is_none() {
        scene.inputs.extend(files.on_disk(&file));
    }
    Ok((film, scene))
}

/// The file as errors name it, and its text.
fn open(spec: &str, options: &LoadOptions) -> Result<(PathBuf, String)> {
    let path = Path::new(spec);
    if path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml")) {
        let bytes = Files::from_options(path, options)
            .read_named(path, limits::TOML_BYTES)
            .map_err(|message| Error::input(path, message))?;
        return Ok((path.to_owned(), utf8(path, bytes)?));
    }
    let text = builtin::text(spec).ok_or_else(|| {
        let what = unknown("built-in film", &builtin::names(), spec);
        Error::Usage(format!("{what}; or give the path of a .toml file"))
    })?;
    Ok((PathBuf::from(format!("{spec}.toml")), text.to_owned()))
}

/// The scene as on the command line: a path is relative to the film's file.
fn scene_spec(top: &Section, files: &Files, file: &Path, name: &str) -> Result<String> {
    if scenes::NAMES.contains(&name) {
        return Ok(name.to_owned());
    }
    let extension = Path::new(name).extension().map(|extension| extension.to_ascii_lowercase());
    if !extension.is_some_and(|extension| extension == "toml" || extension == "obj") {
        let what = unknown("built-in scene", &scenes::NAMES, name);
        return Err(top.fault_at(
            "scene",
            format!("{what}; or give the path of a .toml, .glb, .gltf, .obj, .ply or .stl file"),
        ));
    }
    let path = file.with_file_name(name);
    let known = files.locate(&path).and_then(|found| match files {
        Files::Disk(_) if !found.is_file() => Err("does not exist: check the path".to_owned()),
        _ => Ok(()),
    });
    known.map_err(|message| top.fault_at("scene", format!("{:?} {message}", path.display())))?;
    let path = path.to_str().map(str::to_owned);
    path.ok_or_else(|| top.fault_at("scene", "the path is not UTF-8: rename the folder"))
}

/// The list of keys of that name, in the order of their time.
fn keys<'a>(file: &'a Path, root: &'a Node, name: &str) -> Result<Vec<Key<'a>>> {
    let sections = Section::list(file, root, name, limits::FILM_KEYS)?.into_iter();
    let key = |section: Section<'a>| {
        let time = section.need(section.number("time", TIME)?, "time", "seconds from the start")?;
        Ok(Key { time, section })
    };
    let mut keys = sections.map(key).collect::<Result<Vec<_>>>()?;
    keys.sort_by(|a, b| a.time.total_cmp(&b.time));
    Ok(keys)
}

/// Groups keys by name, in the order of first appearance.
fn by_name<'k, 'a>(keys: &'k [Key<'a>]) -> Result<Vec<(&'a str, Vec<&'k Key<'a>>)>> {
    let mut named: Vec<(&str, Vec<&Key>)> = Vec::new();
    let mut places = HashMap::new();
    for key in keys {
        let name = key.section.need(key.section.text("name")?, "name", "of what changes")?;
        let place = *places.entry(name).or_insert(named.len());
        match named.get_mut(place) {
            Some((_, keys)) => keys.push(key),
            None => named.push((name, vec![key])),
        }
    }
    Ok(named)
}

/// Time and value of the keys that state this value.
fn values<'k>(
    keys: impl IntoIterator<Item = &'k Key<'k>>,
    name: &str,
    read: impl Fn(&Section) -> Result<Option<DVec3>>,
) -> Result<Option<Vec<(f64, DVec3)>>> {
    let mut values: Vec<(f64, DVec3)> = Vec::new();
    for Key { time, section } in keys {
        let Some(value) = read(section)? else { continue };
        if values.last().is_some_and(|(last, _)| time - last < MIN_STEP_S) {
            return Err(section.fault_at(name, format!("there is another key of it at {time} s")));
        }
        values.push((*time, value));
    }
    Ok((!values.is_empty()).then_some(values))
}

fn read_camera(keys: &[Key], base: &Camera) -> Result<CameraTrack> {
    for Key { section, .. } in keys {
        section.only(&["time", "position", "target", "fov_y"])?;
    }
    let place = |name: &str| {
        Ok(values(keys, name, |key| key.vector(name, COORDINATE))?.map(|keys| Curve::path(&keys)))
    };
    let fov_y = values(keys, "fov_y", |key| Ok(key.number("fov_y", camera::FOV_Y)?.map(DVec3::splat)))?;
    Ok(CameraTrack {
        base: base.clone(),
        position: place("position")?,
        target: place("target")?,
        fov_y: fov_y.map(|keys| Curve::amounts(&keys)),
    })
}

/// Reads the tracks of the scene's models.
fn read_models(keys: &[Key], scene: &str, options: &LoadOptions) -> Result<Vec<ModelTrack>> {
    let named = by_name(keys)?;
    if named.is_empty() {
        return Ok(Vec::new());
    }
    let (source, _) = Source::prepare(scene, options)?;
    let models: Vec<PlacedModel> = match source.root.get("model") {
        Some(Node { kind: Kind::Array(models), .. }) => models.iter().map(PlacedModel::read).collect(),
        _ => Vec::new(),
    };
    let names: Vec<String> = models.iter().map(PlacedModel::key_name).collect();
    named.into_iter().map(|(name, keys)| read_model(name, &keys, &models, &names)).collect()
}

fn read_model(name: &str, keys: &[&Key], models: &[PlacedModel], names: &[String]) -> Result<ModelTrack> {
    let first = &keys[0].section;
    let mut found = (0..models.len()).filter(|index| names[*index] == name);
    let Some(model) = found.next() else {
        let names: Vec<&str> = names.iter().map(String::as_str).collect();
        return Err(first.fault_at("name", unknown("model", &names, name)));
    };
    if found.next().is_some() {
        let message =
            format!("several models of the scene are called {name:?}: give this one a `name` there");
        return Err(first.fault_at("name", message));
    }
    let base = models[model].clone();
    let mut hidden = Fades::new(DVec3::splat(f64::from(u8::from(base.is_hidden))));
    for Key { time, section } in keys {
        section.only(&["time", "name", "translate", "rotate", "hidden"])?;
        if base.matrix.is_some() && section.get("rotate").is_some() {
            let message = "the scene file states a matrix of this model: state `rotate` and `scale` there";
            return Err(section.fault_at("rotate", message));
        }
        if let Some(is_hidden) = section.flag("hidden")? {
            hidden.change(*time, 0.0, DVec3::splat(f64::from(u8::from(is_hidden))));
        }
    }
    let read = |key: &'static str, range: std::ops::RangeInclusive<f64>| {
        values(keys.iter().copied(), key, |section| section.vector(key, range.clone()))
    };
    Ok(ModelTrack {
        model,
        base,
        translate: read("translate", COORDINATE)?.map(|keys| Curve::path(&keys)),
        rotate: read("rotate", TURNS)?.map(|keys| Curve::amounts(&keys)),
        hidden,
    })
}

/// Reads the track of a light, and adds the light to the scene if it is missing.
fn read_light(name: &str, keys: &[&Key], scene: &mut Scene) -> Result<LightTrack> {
    let (first, later) = keys.split_first().expect("names come from keys");
    let known = scene.lights.iter().position(|light| light.name == name);
    let added = first.section.get("kind").is_some();
    let index = match known {
        Some(_) if added => {
            let message = "the scene has a light of that name: leave out the kind, or choose another name";
            return Err(first.section.fault_at("kind", message));
        }
        Some(index) => index,
        None if added && scene.lights.len() >= limits::LIGHTS => {
            let message = format!("there are {} lights: no more can be added", limits::LIGHTS);
            return Err(first.section.fault_at("kind", message));
        }
        None if added => {
            let (file, node) = (first.section.file(), first.section.without(&OWN));
            let section = Section::new(file, format!("light.{name}"), &node)?;
            let luminaire = Luminaire::read(&section, &Files::beside(file))?;
            let kind = LightKind::read(&section, scene.origin, luminaire.as_ref())?;
            let group = Light::read_group(&section)?;
            scene.lights.push(Light { luminaire, group, ..Light::new(name, kind) });
            scene.lights.len() - 1
        }
        None => {
            let names: Vec<&str> = scene.lights.iter().map(|light| light.name.as_str()).collect();
            let message = unknown("light", &names, name);
            let message = format!("{message}; or state the kind of a light to be added at its first key");
            return Err(first.section.fault_at("name", message));
        }
    };
    let kind = scene.lights[index].kind;
    let mut own = [&OWN[..], &["name"], kind.keys()].concat();
    if scene.lights[index].luminaire.is_some() {
        own.retain(|key| !["angle", "penumbra"].contains(key));
    }
    for key in if added { later } else { keys } {
        if key.section.get("kind").is_some() {
            return Err(key.section.fault_at("kind", "belongs to the light's first key alone"));
        }
        key.section.only(&own)?;
    }
    let read = |name: &'static str, range: std::ops::RangeInclusive<f64>| {
        values(keys.iter().copied(), name, |key| key.vector(name, range.clone()))
    };
    let number = |name: &'static str, range: std::ops::RangeInclusive<f64>| {
        let read = |key: &Section| Ok(key.number(name, range.clone())?.map(DVec3::splat));
        Ok(values(keys.iter().copied(), name, read)?.map(|keys| Curve::amounts(&keys)))
    };
    let path = |name| Ok(read(name, COORDINATE)?.map(|keys| Curve::path(&keys)));
    let [place, emission] = match kind {
        LightKind::Area { .. } => ["corner", "radiance"],
        LightKind::Directional { .. } => ["", "irradiance"],
        LightKind::Surface { .. } | LightKind::Sky { .. } => ["", "radiance"],
        _ => ["position", "intensity"],
    };
    let direction = values(keys.iter().copied(), "direction", |key| key.direction("direction"))?;
    Ok(LightTrack {
        light: index,
        base: kind,
        place: path(place)?,
        direction: direction.map(|keys| Curve::path(&keys)),
        edge_u: path("edge_u")?,
        edge_v: path("edge_v")?,
        emission: read(emission, POWER)?.map(|keys| Curve::amounts(&keys)),
        angle: number("angle", 0.01..=90.0)?,
        penumbra: number("penumbra", 0.0..=1.0)?,
        presence: read_presence(keys, added, !added && scene.lights[index].is_on)?,
    })
}

/// Reads when a light is switched; `is_on` is its state at first. An added light is switched
/// on at its first key.
fn read_presence(keys: &[&Key], added: bool, is_on: bool) -> Result<Fades> {
    let mut presence = Fades::new(if is_on { DVec3::ONE } else { DVec3::ZERO });
    let mut last = f64::NEG_INFINITY;
    for (number, Key { time, section }) in keys.iter().enumerate() {
        let comes = added && number == 0;
        let fade = section.number("fade", TIME)?;
        let Some(on) = section.flag("on")?.or(comes.then_some(true)) else {
            match fade {
                Some(_) => {
                    return Err(section.fault_at("fade", "belongs to `on`: it is how long switching takes"));
                }
                None => continue,
            }
        };
        if *time == last {
            return Err(section.fault_at("on", format!("there is another key of it at {time} s")));
        }
        last = *time;
        presence.change(*time, fade.unwrap_or(0.0), DVec3::splat(f64::from(u8::from(on))));
    }
    Ok(presence)
}

/// Reads the track of the materials of that name, and makes them editable.
fn read_material(
    name: &str,
    keys: &[&Key],
    named: &HashMap<String, Vec<usize>>,
    scene: &mut Scene,
) -> Result<Vec<MaterialTrack>> {
    let Some(found) = named.get(name) else {
        let names: Vec<&str> = scene.materials.iter().map(|material| material.name.as_str()).collect();
        return Err(keys[0].section.fault_at("name", unknown("material", &names, name)));
    };
    found.iter().map(|&index| read_changes(index, &mut scene.materials[index], keys)).collect()
}

fn read_changes(index: usize, material: &mut Material, keys: &[&Key]) -> Result<MaterialTrack> {
    material.editable = true;
    let mut track = MaterialTrack {
        material: index,
        diffuse: Fades::new(material.diffuse.as_dvec3()),
        specular: Fades::new(material.specular.as_dvec3()),
        ln_exponent: Fades::new(DVec3::splat(f64::from(material.exponent).ln())),
    };
    let mut last = f64::NEG_INFINITY;
    for Key { time, section } in keys.iter().copied() {
        section.only(&["time", "fade", "name", "diffuse", "specular", "exponent"])?;
        if *time == last {
            return Err(section.fault_at("time", format!("there is another change of it at {time} s")));
        }
        last = *time;
        let fade = section.number("fade", TIME)?.unwrap_or(0.0);
        let is_diffuse = track.specular.at(*time) == DVec3::ZERO;
        if let Some(exponent) = section.number("exponent", 1.0..=1e6)? {
            // A lobe that appears has its final sharpness from the start.
            track.ln_exponent.change(*time, if is_diffuse { 0.0 } else { fade }, DVec3::splat(exponent.ln()));
        }
        if let Some(diffuse) = section.vector("diffuse", 0.0..=1.0)? {
            track.diffuse.change(*time, fade, diffuse);
        }
        if let Some(specular) = section.vector("specular", 0.0..=1.0)? {
            track.specular.change(*time, fade, specular);
        }
        let after = time + fade;
        let albedo = (track.diffuse.at(after) + track.specular.at(after)).max_element();
        if albedo > 1.0 + 1e-6 {
            let message =
                format!("diffuse and specular are {albedo:.3} together: 1 at most, in each channel");
            return Err(section.fault(message));
        }
    }
    Ok(track)
}

/// Positions of the camera and lights at their keys; world space.
fn places(film: &Film) -> impl Iterator<Item = DVec3> + '_ {
    let lights = film.lights.iter().filter_map(|track| track.place.as_ref());
    film.camera.position.iter().chain(lights).flat_map(Curve::values)
}
