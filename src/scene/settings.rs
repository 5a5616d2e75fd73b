//! `--set KEY=VALUE`: keys are dotted paths into the scene file.

use super::keys;
use super::value::{Kind, Node, Origin, printable, unknown};
use crate::{Error, Result};

/// Tables of a scene file.
pub(super) const SECTIONS: [&str; 8] =
    ["model", "camera", "light", "environment", "material", "meter", "picture", "quality"];

/// Keys of a clear sky in `[environment]`.
const CLEAR_SKY: [&str; 4] = ["sun_elevation", "sun_azimuth", "turbidity", "ground"];

/// A change to the scene file.
pub(super) struct Setting {
    /// The flag as typed, for messages.
    flag: String,
    path: Vec<String>,
    value: Node,
}

impl Setting {
    /// Parses `KEY=VALUE`. Fails if the key is no dotted path into a known table, or the value
    /// is not TOML.
    pub(super) fn parse(text: &str) -> Result<Self> {
        let flag = format!("--set {}", printable(text));
        let usage = |message: String| Error::Usage(format!("{flag}: {message}"));
        let (key, value) = text
            .split_once('=')
            .ok_or_else(|| usage("KEY=VALUE was expected, such as quality.entry_points=100000".to_owned()))?;
        let path = toml_edit::Key::parse(key.trim()).map_err(|_| {
            usage(format!("{:?} is not a dotted key, such as light.lamp.position", key.trim()))
        })?;
        let path: Vec<String> = path.iter().map(|key| key.get().to_owned()).collect();
        let (section, keys) = path.split_first().expect("a parsed key has a part");
        if !SECTIONS.contains(&section.as_str()) {
            return Err(usage(unknown("key", &SECTIONS, section)));
        }
        let (lengths, form) = match section.as_str() {
            "quality" => (1..=1, "quality.KEY"),
            "environment" => (1..=1, "environment.KEY"),
            "picture" => (1..=1, "picture.KEY"),
            "camera" => (1..=2, "camera.KEY or camera.NAME.KEY"),
            "light" => (2..=2, "light.NAME.KEY or light.NUMBER.KEY"),
            "material" => (2..=2, "material.NAME.KEY"),
            "meter" => (2..=2, "meter.NAME.KEY or meter.NUMBER.KEY"),
            _ => (2..=2, "model.NAME.KEY or model.NUMBER.KEY"),
        };
        if !lengths.contains(&keys.len()) {
            return Err(usage(format!("{form} was expected")));
        }
        Ok(Self { value: Node::parse_flag(&flag, value.trim())?, flag, path })
    }

    /// Whether it applies before models are read. Changes of materials do: they may hide some.
    pub(super) fn precedes_models(&self) -> bool {
        ["model", "material"].contains(&self.path[0].as_str())
    }

    /// Applies the change. `chosen` is the camera that `camera.KEY` refers to; `None`:
    /// the first camera.
    pub(super) fn apply(&self, root: &mut Node, chosen: Option<&str>) -> Result<()> {
        let (key, path) = self.path.split_last().expect("a parsed key has a part");
        let empty = |kind| Node { origin: Origin::Flag(self.flag.clone()), kind };
        let section = path[0].as_str();
        if root.get(section).is_none() {
            let is_table = ["quality", "environment", "picture"].contains(&section);
            let kind = if is_table { Kind::Table(Vec::new()) } else { Kind::Array(Vec::new()) };
            root.set(section, empty(kind));
        }
        let node = root.get_mut(section).expect("it has just been added");
        // The number after the last model's adds one.
        if section == "model"
            && let Kind::Array(models) = &mut node.kind
            && path.get(1).is_some_and(|number| *number == models.len().to_string())
            && ["file", "built_in"].contains(&key.as_str())
        {
            models.push(empty(Kind::Table(Vec::new())));
        }
        if section == "material"
            && let Kind::Array(overrides) = &mut node.kind
            && !overrides.iter().any(|material| is_named(material, &path[1]))
        {
            let mut material = empty(Kind::Table(Vec::new()));
            material.set("name", empty(Kind::Text(path[1].clone())));
            overrides.push(material);
        }
        // A single `[camera]` is found by its name, and `[quality]` without one.
        if matches!(node.kind, Kind::Table(_)) && (path.len() == 1 || is_named(node, &path[1])) {
            if section == "environment" && key == "image" {
                // An image takes the place of a clear sky, whose keys would contradict it.
                let Kind::Table(entries) = &mut node.kind else { return Ok(()) };
                entries.retain(|(key, _)| !CLEAR_SKY.contains(&key.as_str()));
            }
            node.set(key, self.value.clone());
            return Ok(());
        }
        let table = match &mut node.kind {
            Kind::Array(elements) => {
                let wanted = path.get(1).map(String::as_str).or(chosen);
                let index = match wanted {
                    None => (!elements.is_empty()).then_some(0),
                    Some(name) => elements
                        .iter()
                        .position(|element| is_named(element, name))
                        .or_else(|| name.parse().ok().filter(|&index| index < elements.len())),
                };
                let names: Vec<String> = elements.iter().enumerate().map(name_of).collect();
                let names: Vec<&str> = names.iter().map(String::as_str).collect();
                let found = index.and_then(|index| elements.get_mut(index));
                let what = || unknown(section, &names, wanted.unwrap_or_default());
                found.ok_or_else(|| Error::Usage(format!("{}: {}", self.flag, what())))?
            }
            _ => {
                let possible = if section == "camera" { keys::names(section, None) } else { Vec::new() };
                let what = unknown("key", &possible, path.get(1).unwrap_or(key));
                return Err(Error::Usage(format!("{}: {what}", self.flag)));
            }
        };
        // A colour and an image take the place of each other.
        let replaced: &[&str] = match (section, key.as_str()) {
            ("material", "image") => &["diffuse"],
            ("material", "diffuse") => &["image", "image_width", "tint"],
            _ => &[],
        };
        if let Kind::Table(entries) = &mut table.kind {
            entries.retain(|(key, _)| !replaced.contains(&key.as_str()));
        }
        table.set(key, self.value.clone());
        Ok(())
    }
}

fn is_named(element: &Node, name: &str) -> bool {
    element.get("name").and_then(Node::as_text) == Some(name)
}

fn name_of((index, element): (usize, &Node)) -> String {
    element.get("name").and_then(Node::as_text).map_or(index.to_string(), printable)
}
