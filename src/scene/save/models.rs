//! The models of a scene file as the window edits them.

use std::path::Path;

use glam::DVec3;

use crate::scene::value::{Kind, Node};

/// Where a model is, and whether it takes part.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedModel {
    /// Its file as the scene file names it, or the name of a built-in model.
    pub name: String,
    /// Its surface is left out.
    pub is_hidden: bool,
    /// Offset in world space, metres.
    pub translation: DVec3,
    /// The rows of its transform, if the scene file states a matrix.
    pub matrix: Option<[[f64; 4]; 4]>,
}

impl PlacedModel {
    /// A model where its file puts it.
    pub fn of_file(name: &str) -> Self {
        Self { name: name.to_owned(), is_hidden: false, translation: DVec3::ZERO, matrix: None }
    }

    /// Reads a `[[model]]` of a scene that was loaded.
    pub(super) fn read(table: &Node) -> Self {
        let name = ["file", "built_in"].into_iter().find_map(|key| table.get(key)?.as_text());
        let matrix: Option<[[f64; 4]; 4]> =
            table.get("matrix").and_then(|rows| rows.as_list(Node::as_numbers));
        let translation = match matrix {
            Some([x, y, z, _]) => DVec3::new(x[3], y[3], z[3]),
            None => table.get("translate").and_then(Node::as_numbers).map_or(DVec3::ZERO, DVec3::from_array),
        };
        let is_hidden = matches!(table.get("hidden"), Some(Node { kind: Kind::Bool(true), .. }));
        Self { name: name.unwrap_or_default().to_owned(), is_hidden, translation, matrix }
    }

    /// The name without folders.
    pub fn short_name(&self) -> String {
        Path::new(&self.name).file_name().unwrap_or_default().to_string_lossy().into_owned()
    }

    /// `KEY=VALUE` changes ([`LoadOptions::set`](crate::scene::LoadOptions::set)) that turn model
    /// `number` of a scene from `before` into this one. `None`: the scene lacks it.
    pub fn changes(&self, number: usize, before: Option<&Self>) -> Vec<String> {
        let mut changes = Vec::new();
        let mut change = |key: &str, value: String| changes.push(format!("model.{number}.{key}={value}"));
        let own = Self::of_file(&self.name);
        let before = before.unwrap_or_else(|| {
            change("file", toml_edit::Value::from(self.name.as_str()).to_string());
            &own
        });
        if self.is_hidden != before.is_hidden {
            change("hidden", self.is_hidden.to_string());
        }
        if self.translation != before.translation {
            let DVec3 { x, y, z } = self.translation;
            match self.matrix {
                Some([a, b, c, last]) => {
                    let rows = [[a[0], a[1], a[2], x], [b[0], b[1], b[2], y], [c[0], c[1], c[2], z], last];
                    change("matrix", format!("{rows:?}"));
                }
                None => change("translate", format!("{:?}", [x, y, z])),
            }
        }
        changes
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::save::SceneText;
    use crate::scene::{LoadOptions, Scene};

    #[test]
    fn changes_make_of_a_model_what_was_wanted() {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("m.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
        let matrix = "matrix = [[2, 0, 0, 1], [0, 2, 0, 2], [0, 0, 2, 3], [0, 0, 0, 1]]";
        let light = "[[light]]\nkind = \"point\"\nposition = [0, 0, 1]\nintensity = [1, 1, 1]\n";
        let text = format!("{light}[[model]]\nfile = \"m.obj\"\n[[model]]\nfile = \"m.obj\"\n{matrix}\n");
        let file = folder.path().join("s.toml");
        std::fs::write(&file, text).unwrap();
        let load = |set: Vec<String>| {
            let options = LoadOptions { set, ..LoadOptions::default() };
            let scene = Scene::load(file.to_str().unwrap(), &options).unwrap();
            let models = SceneText::new(file.to_str().unwrap(), &options, &scene).unwrap().models();
            (scene.area_m2(), models)
        };
        let (area, before) = load(Vec::new());
        assert_eq!(before[1].translation, DVec3::new(1.0, 2.0, 3.0));
        assert!((area - 2.5).abs() < 1e-6);
        let mut after = before.clone();
        after[0].is_hidden = true;
        after[1].translation = DVec3::new(-1e-7, 0.1, 1e3);
        after.push(PlacedModel { translation: DVec3::X, ..PlacedModel::of_file("m.obj") });
        let changes = |from: &[PlacedModel], to: &[PlacedModel]| {
            let models = to.iter().enumerate();
            models.flat_map(|(number, model)| model.changes(number, from.get(number))).collect::<Vec<_>>()
        };
        let (area, found) = load(changes(&before, &after));
        let moved = PlacedModel { matrix: found[1].matrix, ..after[1].clone() };
        assert_eq!(found, [after[0].clone(), moved, after[2].clone()]);
        assert!((area - 2.5).abs() < 1e-6, "one hidden, one added: {area}");
        assert!(changes(&before, &before).is_empty());
    }
}
