//! The models of a scene file as the window edits them.

use std::path::Path;

use glam::{DQuat, DVec3, EulerRot};

use crate::scene::model_keys::euler;
use crate::scene::value::{Kind, Node};

/// Where a model is, and whether it takes part.
#[derive(Clone, Debug, PartialEq)]
pub struct PlacedModel {
    /// Its file as the scene file names it, or the name of a built-in model.
    pub file: String,
    /// The name that the scene file gives it.
    pub name: Option<String>,
    /// Its surface is left out.
    pub is_hidden: bool,
    /// Offset in world space, metres.
    pub translation: DVec3,
    /// Angles about the axes x, y and z, in this order, degrees. Zero if there is a matrix.
    pub rotation: DVec3,
    /// The rows of its transform, if the scene file states a matrix.
    pub matrix: Option<[[f64; 4]; 4]>,
}

impl PlacedModel {
    /// A model where its file puts it.
    pub fn of_file(file: &str) -> Self {
        Self {
            file: file.to_owned(),
            name: None,
            is_hidden: false,
            translation: DVec3::ZERO,
            rotation: DVec3::ZERO,
            matrix: None,
        }
    }

    /// Reads a `[[model]]` of a scene that was loaded.
    pub(in crate::scene) fn read(table: &Node) -> Self {
        let text = |key: &str| table.get(key)?.as_text().map(str::to_owned);
        let vector =
            |key: &str| table.get(key).and_then(Node::as_numbers).map_or(DVec3::ZERO, DVec3::from_array);
        let matrix: Option<[[f64; 4]; 4]> =
            table.get("matrix").and_then(|rows| rows.as_list(Node::as_numbers));
        let translation = match matrix {
            Some([x, y, z, _]) => DVec3::new(x[3], y[3], z[3]),
            None => vector("translate"),
        };
        let is_hidden = matches!(table.get("hidden"), Some(Node { kind: Kind::Bool(true), .. }));
        let file = text("file").or(text("built_in")).unwrap_or_default();
        Self { file, name: text("name"), is_hidden, translation, rotation: vector("rotate"), matrix }
    }

    /// Its name, or that of its file without folders.
    pub fn shown_name(&self) -> String {
        let file = || Path::new(&self.file).file_name().unwrap_or_default().to_string_lossy().into_owned();
        self.name.clone().unwrap_or_else(file)
    }

    /// Its name, or that of its file without folders and ending.
    pub(in crate::scene) fn key_name(&self) -> String {
        let stem = || Path::new(&self.file).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        self.name.clone().unwrap_or_else(stem)
    }

    /// Turns the model to these angles, degrees, about a point of the world that stays. A model
    /// with a matrix does not turn.
    pub fn turn_about(&mut self, point: DVec3, rotation: DVec3) {
        if self.matrix.is_none() {
            let turn = euler(rotation) * euler(self.rotation).inverse();
            self.translation = point + turn * (self.translation - point);
            self.rotation = rotation;
        }
    }

    /// Angles after a further turn about an axis of the world, to a thousandth of a degree. Several
    /// angles are the same turn: it returns those nearest to the present ones.
    pub fn angles_after(&self, axis: DVec3, degrees: f64) -> DVec3 {
        let turn = DQuat::from_axis_angle(axis, degrees.to_radians()) * euler(self.rotation);
        let (z, y, x) = turn.to_euler(EulerRot::ZYX);
        let first = DVec3::new(x, y, z).map(f64::to_degrees);
        let same = [first, DVec3::new(first.x + 180.0, 180.0 - first.y, first.z + 180.0)];
        let [a, b] = same.map(|angles| angles - 360.0 * ((angles - self.rotation) / 360.0).round());
        let distance = |angles: DVec3| (angles - self.rotation).abs().element_sum();
        let nearest = if distance(a) <= distance(b) { a } else { b };
        // Without the sign of a zero.
        nearest.map(|angle| (1e3 * angle).round() / 1e3 + 0.0)
    }

    /// Where a point that is fixed to the model is after the model was placed as `to`.
    pub fn carried(&self, point: DVec3, to: &Self) -> DVec3 {
        euler(to.rotation) * (euler(self.rotation).inverse() * (point - self.translation)) + to.translation
    }

    /// `KEY=VALUE` changes ([`LoadOptions::set`](crate::scene::LoadOptions::set)) that turn model
    /// `number` of a scene from `before` into this one. `None`: the scene lacks it.
    pub fn changes(&self, number: usize, before: Option<&Self>) -> Vec<String> {
        let mut changes = Vec::new();
        let mut change = |key: &str, value: String| changes.push(format!("model.{number}.{key}={value}"));
        let own = Self::of_file(&self.file);
        let before = before.unwrap_or_else(|| {
            change("file", toml_edit::Value::from(self.file.as_str()).to_string());
            &own
        });
        if self.is_hidden != before.is_hidden {
            change("hidden", self.is_hidden.to_string());
        }
        if self.rotation != before.rotation {
            change("rotate", format!("{:?}", self.rotation.to_array().map(|angle| angle % 360.0)));
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
        after[0].rotation = DVec3::new(10.0, -200.5, 0.1);
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

    #[test]
    fn models_turn_about_a_point_that_stays() {
        let placed =
            |translation, rotation| PlacedModel { translation, rotation, ..PlacedModel::of_file("m.obj") };
        let before = placed(DVec3::new(1.0, -2.0, 0.5), DVec3::new(10.0, 20.0, 30.0));
        let (point, beside) = (DVec3::new(4.0, 5.0, -6.0), DVec3::new(4.0, 5.0, -5.0));
        let mut after = before.clone();
        after.turn_about(point, DVec3::new(10.0, 110.0, 30.0));
        assert!(before.carried(point, &after).distance(point) < 1e-12);
        let carried = before.carried(beside, &after);
        assert!((carried.distance(point) - 1.0).abs() < 1e-12 && carried.distance(beside) > 1.0);
        // A quarter turn about y, since it is the second angle of three.
        let upright = placed(DVec3::ZERO, DVec3::ZERO);
        let mut turned = upright.clone();
        turned.turn_about(DVec3::X, DVec3::new(0.0, 90.0, 0.0));
        assert!(
            upright.carried(DVec3::new(1.0, 3.0, 2.0), &turned).distance(DVec3::new(3.0, 3.0, 0.0)) < 1e-12
        );
        // A whole turn about one axis in steps of 30 degrees, by one angle as far as that suffices.
        for axis in DVec3::AXES {
            let mut model = placed(DVec3::ZERO, DVec3::ZERO);
            for step in 1..=12 {
                model.rotation = model.angles_after(axis, 30.0);
                let wanted = DQuat::from_axis_angle(axis, (30.0 * f64::from(step)).to_radians());
                let off = wanted.angle_between(euler(model.rotation));
                assert!(off.min(std::f64::consts::TAU - off) < 1e-4, "{axis}, {step}: {}", model.rotation);
            }
            assert!(model.rotation.distance(360.0 * axis) < 0.1, "{}", model.rotation);
        }
        let leaning = placed(DVec3::ZERO, DVec3::new(20.0, 130.0, -70.0));
        let turned = PlacedModel { rotation: leaning.angles_after(DVec3::Y, 25.0), ..leaning.clone() };
        let found = leaning.carried(DVec3::X, &turned);
        let wanted = DQuat::from_rotation_y(25.0_f64.to_radians()) * DVec3::X;
        assert!(found.distance(wanted) < 1e-4, "{found}");
        let mut fixed = PlacedModel { matrix: Some([[0.0; 4]; 4]), ..before.clone() };
        fixed.turn_about(point, DVec3::X);
        assert_eq!(fixed.rotation, before.rotation);
    }
}
