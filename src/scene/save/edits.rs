//! Edits of a scene file's tables. A number that still has the correct value keeps its spelling.

use glam::{DVec3, Vec3};

use super::{node, paths, without};
use crate::Result;
use crate::scene::light::LightKind;
use crate::scene::luminaire::Luminaire;
use crate::scene::material::MAX_ALBEDO;
use crate::scene::value::{Kind, Node, Section, unit};
use crate::scene::{Camera, Light, Material, camera as cameras, numbers, photometry};
use std::path::Path;

/// Largest half-angle of a spot, degrees.
const MAX_ANGLE: f64 = 90.0;

/// Writes a camera's position, target, up direction and field of view.
pub(super) fn camera(table: &mut Node, camera: &Camera, origin: DVec3) {
    place(table, "position", camera.position, origin);
    place(table, "target", camera.target, origin);
    if table.get("up").is_some() || camera.up != Vec3::Y {
        direction(table, "up", camera.up);
    }
    number(table, "fov_y", camera.fov_y_degrees, Some(cameras::FOV_Y_DEFAULT), |n| n as f32, numbers::plain);
}

/// Replaces the list of lights. Returns the index of each in the old list. `files`: the scene's
/// file that was loaded, and the one to be saved.
pub(super) fn lights(
    root: &mut Node,
    lights: &[Light],
    origin: DVec3,
    files: [&Path; 2],
) -> Result<Vec<Option<usize>>> {
    let old = match root.get("light") {
        Some(Node { kind: Kind::Array(tables), .. }) => tables.clone(),
        _ => Vec::new(),
    };
    let name_of = |(number, table): (usize, &Node)| {
        table.get("name").and_then(Node::as_text).map_or_else(|| Light::unnamed(number), str::to_owned)
    };
    let names: Vec<String> = old.iter().enumerate().map(name_of).collect();
    // Emitting materials and the sky have no section of their own, visible area lights do.
    let has_section = |light: &&Light| !light.kind.is_fixed() || names.contains(&light.name);
    let lights: Vec<&Light> = lights.iter().filter(has_section).collect();
    let from = lights.iter().map(|light| names.iter().position(|name| *name == light.name));
    let from: Vec<Option<usize>> = from.collect();
    let tables = lights.iter().zip(&from).enumerate().map(|(number, (light, from))| {
        let mut table = from.map_or_else(|| node(Kind::Table(Vec::new())), |index| old[index].clone());
        edit_light(&mut table, light, number, origin);
        if let (Some(luminaire), LightKind::Spot { .. }) = (&light.luminaire, light.kind) {
            edit_luminaire(&mut table, luminaire, files)?;
        }
        emission(&mut table, light);
        let was_on = !matches!(table.get("on"), Some(Node { kind: Kind::Bool(false), .. }));
        if was_on != light.is_on {
            table.set("on", node(Kind::Bool(light.is_on)));
        }
        Ok(table)
    });
    root.set("light", node(Kind::Array(tables.collect::<Result<_>>()?)));
    Ok(from)
}

/// Writes the file of measured intensities and their turn.
fn edit_luminaire(table: &mut Node, luminaire: &Luminaire, [from, to]: [&Path; 2]) -> Result<()> {
    let stated = table.get("ies").and_then(Node::as_text).map(|name| from.with_file_name(name));
    let path = match stated {
        Some(path) if path == luminaire.file => paths::moved(&path, from, to)?,
        _ => Some(paths::relative_to(&luminaire.file, to)?),
    };
    if let Some(path) = path {
        set_text(table, "ies", &path);
    }
    let degrees = |radians| numbers::degrees(radians, 360.0);
    number(table, "turn", luminaire.turn, Some(0.0), |n| n.to_radians() as f32, degrees);
    Ok(())
}

/// Whether the scene file has a light of that name.
fn is_named(root: &Node, name: &str) -> bool {
    let Some(Node { kind: Kind::Array(lights), .. }) = root.get("light") else { return false };
    lights.iter().any(|light| light.get("name").and_then(Node::as_text) == Some(name))
}

/// Writes the emission of materials and of the sky that has changed since they were `loaded`. A
/// light that is off is black.
pub(super) fn emissions(root: &mut Node, loaded: &[Material], lights: &[Light]) {
    let mut sky: Option<(Vec3, f32)> = None;
    for light in lights {
        let on = if light.is_on { 1.0 } else { 0.0 };
        match light.kind {
            LightKind::Surface { material, radiance } => {
                let Material { name, emission, .. } = &loaded[material as usize];
                if is_named(root, name) {
                    continue;
                }
                if *emission != on * radiance {
                    vector(material_table(root, name), "emission", on * radiance);
                }
            }
            LightKind::Sky { radiance, turn, .. } => {
                sky = Some((sky.map_or(Vec3::ZERO, |sky| sky.0) + on * radiance, turn));
            }
            _ => (),
        }
    }
    if let (Some((radiance, turn)), Some(table)) = (sky, root.get_mut("environment")) {
        if table.get("radiance").is_some() || radiance != Vec3::ONE {
            vector(table, "radiance", radiance);
        }
        number(table, "rotate", turn, Some(0.0), |n| n.to_radians() as f32, |n| numbers::degrees(n, 360.0));
    }
}

fn edit_light(table: &mut Node, light: &Light, number: usize, origin: DVec3) {
    let word = light.kind.word();
    if table.get("name").is_some() || light.name != Light::unnamed(number) {
        set_text(table, "name", &light.name);
    }
    if !light.kind.is_fixed() && table.get("kind").and_then(Node::as_text) != Some(word) {
        let own = ["name", "on", "group"];
        if let Kind::Table(entries) = &mut table.kind {
            entries.retain(|(key, _)| own.contains(&key.as_str()));
        }
        set_text(table, "kind", word);
    }
    match &light.group {
        Some(group) => set_text(table, "group", group),
        None => *table = without(table, "group"),
    }
    match light.kind {
        LightKind::Surface { .. } | LightKind::Sky { .. } => (),
        LightKind::Point { position, .. } => place(table, "position", position, origin),
        LightKind::Spot { position, direction: axis, angle, penumbra, .. } => {
            place(table, "position", position, origin);
            if light.luminaire.is_some() {
                // Downwards by default.
                if table.get("direction").is_some() || axis != Vec3::NEG_Y {
                    direction(table, "direction", axis);
                }
                return;
            }
            direction(table, "direction", axis);
            let degrees = |radians| numbers::degrees(radians, MAX_ANGLE);
            self::number(table, "angle", angle, None, |n| n.to_radians() as f32, degrees);
            self::number(table, "penumbra", penumbra, Some(0.0), |n| n as f32, numbers::plain);
        }
        LightKind::Area { corner, edge_u, edge_v, samples, .. } => {
            place(table, "corner", corner, origin);
            vector(table, "edge_u", edge_u);
            vector(table, "edge_v", edge_v);
            let is_stated = table.get("samples").map(|node| node.as_number());
            if is_stated.unwrap_or(Some(f64::from(LightKind::SAMPLES))) != Some(f64::from(samples)) {
                table.set("samples", node(Kind::Integer(samples.into())));
            }
        }
        LightKind::Directional { direction: way, .. } => direction(table, "direction", way),
    }
}

/// Writes the emission of a light whose other keys are written. A power in photometric units stays
/// as long as it is that of the light.
fn emission(table: &mut Node, light: &Light) {
    let key = match light.kind {
        LightKind::Point { .. } | LightKind::Spot { .. } => "intensity",
        LightKind::Area { .. } | LightKind::Surface { .. } => "radiance",
        LightKind::Directional { .. } => "irradiance",
        LightKind::Sky { .. } => return,
    };
    if photometry::is_stated(table) {
        let stated = Section::new(Path::new(""), "light", table)
            .and_then(|section| LightKind::read(&section, DVec3::ZERO, light.luminaire.as_ref()))
            .map(|kind| kind.emission());
        if stated.is_ok_and(|stated| stated == light.kind.emission()) {
            return;
        }
        for own in photometry::keys() {
            *table = without(table, own);
        }
    }
    vector(table, key, light.kind.emission());
}

/// Writes the properties of materials that have changed since they were `loaded`.
pub(super) fn materials(root: &mut Node, loaded: &[Material], edited: &[Material]) {
    let mut said: Vec<&str> = Vec::new();
    for (old, new) in loaded.iter().zip(edited) {
        let is_same = |a: Vec3, b: Vec3| a.to_array().map(f32::to_bits) == b.to_array().map(f32::to_bits);
        let diffuse = !is_same(old.diffuse, new.diffuse);
        let specular = !is_same(old.specular, new.specular);
        let exponent = old.exponent.to_bits() != new.exponent.to_bits();
        let editable = old.editable != new.editable;
        if !(diffuse || specular || exponent || editable) || said.contains(&new.name.as_str()) {
            continue;
        }
        said.push(&new.name);
        // A material at the albedo limit may have been scaled to it at load, which depends
        // on both albedos.
        let is_full = (old.diffuse + old.specular).max_element() > MAX_ALBEDO - 1e-5;
        let table = material_table(root, &new.name);
        if diffuse || is_full {
            let [key, other] = if new.texture.is_some() { ["tint", "diffuse"] } else { ["diffuse", "tint"] };
            *table = without(table, other);
            vector(table, key, new.diffuse);
        }
        if specular || is_full {
            vector(table, "specular", new.specular);
        }
        if exponent {
            number(table, "exponent", new.exponent, None, |n| n as f32, numbers::plain);
        }
        if editable {
            table.set("editable", node(Kind::Bool(new.editable)));
        }
    }
}

/// The `[[material]]` of that name, added if it is missing.
fn material_table<'a>(root: &'a mut Node, name: &str) -> &'a mut Node {
    if root.get("material").is_none() {
        root.set("material", node(Kind::Array(Vec::new())));
    }
    let list = root.get_mut("material").expect("it has just been added");
    let Kind::Array(tables) = &mut list.kind else { unreachable!("the scene was loaded from it") };
    let named = |table: &Node| table.get("name").and_then(Node::as_text) == Some(name);
    let index = tables.iter().position(named).unwrap_or_else(|| {
        let mut table = node(Kind::Table(Vec::new()));
        set_text(&mut table, "name", name);
        tables.push(table);
        tables.len() - 1
    });
    &mut tables[index]
}

pub(super) fn set_text(table: &mut Node, key: &str, text: &str) {
    table.set(key, node(Kind::Text(text.to_owned())));
}

/// The three numbers of a vector. `None` if it is absent.
fn numbers_of(table: &Node, key: &str) -> Option<[(f64, Node); 3]> {
    let Kind::Array(elements) = &table.get(key)?.kind else { return None };
    let found: Option<Vec<_>> = elements.iter().map(|e| Some((e.as_number()?, e.clone()))).collect();
    found?.try_into().ok()
}

/// Sets the components of a vector that differ from the wanted value.
fn components(
    table: &mut Node,
    key: &str,
    wanted: Vec3,
    read: impl Fn(usize, f64) -> f32,
    write: impl Fn(usize, f32) -> f64,
) {
    let old = numbers_of(table, key);
    let component = |axis: usize| match old.as_ref().map(|numbers| &numbers[axis]) {
        Some((number, node)) if read(axis, *number).to_bits() == wanted[axis].to_bits() => node.clone(),
        _ => node(Kind::Float(write(axis, wanted[axis]))),
    };
    table.set(key, node(Kind::Array([0, 1, 2].map(component).into())));
}

pub(super) fn vector(table: &mut Node, key: &str, wanted: Vec3) {
    components(table, key, wanted, |_, number| number as f32, |_, value| numbers::plain(value));
}

pub(super) fn place(table: &mut Node, key: &str, wanted: Vec3, origin: DVec3) {
    let read = |axis, number: f64| (number - origin[axis]) as f32;
    components(table, key, wanted, read, |axis, value| numbers::place(value, origin[axis]));
}

/// Sets a whole direction if it differs from the wanted value: its components depend on each other.
pub(super) fn direction(table: &mut Node, key: &str, wanted: Vec3) {
    let old = numbers_of(table, key).map(|numbers| DVec3::from(numbers.map(|(number, _)| number)));
    let read = old.and_then(unit).map(|unit| unit.as_vec3().to_array().map(f32::to_bits));
    if read != Some(wanted.to_array().map(f32::to_bits)) {
        let numbers = wanted.to_array().map(|value| node(Kind::Float(numbers::plain(value))));
        table.set(key, node(Kind::Array(numbers.into())));
    }
}

/// Sets a number if its value, or the default of an absent one, differs from the wanted value.
fn number(
    table: &mut Node,
    key: &str,
    wanted: f32,
    default: Option<f64>,
    read: impl Fn(f64) -> f32,
    write: impl Fn(f32) -> f64,
) {
    let old = table.get(key).map_or(default, Node::as_number);
    if old.is_none_or(|number| read(number).to_bits() != wanted.to_bits()) {
        table.set(key, node(Kind::Float(write(wanted))));
    }
}
