//! Conversion of a document to another version of its scene, after the scene's file has changed.

use glam::Vec3;

use super::document::{Document, LightEntry, MaterialEdit, Parts};
use crate::scene::meter::Meter;
use crate::scene::{Camera, LightKind, Scene};

/// The map from lights, materials and positions of one scene to another. Names identify
/// lights and materials.
pub(super) struct Rebase {
    /// Second-scene identifier of each light of the first scene.
    lights: Vec<u64>,
    /// Offset of the identifiers of lights that neither scene has.
    beyond: u64,
    /// First-scene material of each material of the second scene.
    materials: Vec<Option<usize>>,
    /// Lights that are part of the second scene's surface or sky, and whether they are new there.
    fixed: Vec<(LightEntry, bool)>,
    /// The materials of the second scene.
    edits: Vec<MaterialEdit>,
    /// Offset from positions in the first scene to the second, which has another origin.
    shift: Vec3,
}

impl Rebase {
    pub(super) fn new(before: &Scene, after: &Scene) -> Self {
        let count = after.lights.len() as u64;
        let has_all = before.lights.iter().all(|old| after.lights.iter().any(|new| new.name == old.name));
        let place = |name: &str| after.lights.iter().position(|light| light.name == name);
        let number = |(index, name): (u64, &str)| place(name).map_or(count + index, |place| place as u64);
        let names = before.lights.iter().map(|light| light.name.as_str());
        let [from, to] = [before, after]
            .map(|scene| scene.materials.iter().map(|material| material.name.as_str()).collect::<Vec<_>>());
        Self {
            fixed: (0..)
                .zip(&after.lights)
                .filter(|(_, light)| light.kind.is_fixed())
                .map(|(id, light)| {
                    let is_new = before.lights.iter().all(|old| old.name != light.name);
                    (LightEntry { id, light: light.clone() }, is_new)
                })
                .collect(),
            lights: (0..).zip(names).map(number).collect(),
            // If no light is gone, added lights keep their identifiers as far as those are free.
            beyond: if has_all { count.saturating_sub(before.lights.len() as u64) } else { count },
            materials: same_names(&from, &to),
            edits: after.materials.iter().map(MaterialEdit::from_material).collect(),
            shift: (before.origin - after.origin).as_vec3(),
        }
    }

    /// The document with the same lights, models and meters, and the same edits of materials that
    /// the second scene has.
    pub(super) fn document(&self, document: &Document) -> Document {
        let lights = document.lights.iter().filter_map(|LightEntry { id, light }| {
            let (id, mut light) = (self.light(*id), light.clone());
            if let Some(position) = light.kind.position().filter(|_| self.shift != Vec3::ZERO) {
                light.kind = light.kind.moved_to(position + self.shift);
            }
            if light.kind.is_fixed() {
                // Its material may have another index, and it is gone with its surface.
                let (own, _) = self.fixed.iter().find(|(own, _)| own.id == id)?;
                if let LightKind::Surface { radiance, .. } = light.kind {
                    light.kind = own.light.kind.with_emission(radiance);
                }
            }
            Some(LightEntry { id, light })
        });
        let new = self.fixed.iter().filter(|(_, is_new)| *is_new).map(|(entry, _)| entry.clone());
        let lights = lights.chain(new);
        let edits = self.materials.iter().zip(&self.edits);
        let edits = edits.map(|(from, edit)| from.map_or(*edit, |from| document.materials[from]));
        let chosen = |from: &Option<usize>| document.parts.images[(*from)?].clone();
        let images = self.materials.iter().map(chosen).collect();
        let meters = document.meters.iter();
        let meters = meters.map(|Meter { name, shape }| Meter {
            name: name.clone(),
            shape: shape.clone().moved(self.shift),
        });
        Document {
            lights: lights.collect(),
            materials: edits.collect(),
            meters: meters.collect(),
            parts: Parts { images, ..document.parts.clone() },
        }
    }

    /// The identifier of a light.
    pub(super) fn light(&self, id: u64) -> u64 {
        let known = usize::try_from(id).ok().and_then(|id| self.lights.get(id)).copied();
        known.unwrap_or(self.beyond + id)
    }

    /// The index of a material. `None` if the second scene lacks its name.
    pub(super) fn material(&self, index: usize) -> Option<usize> {
        self.materials.iter().position(|from| *from == Some(index))
    }

    /// The same view.
    pub(super) fn camera(&self, camera: &Camera) -> Camera {
        let (position, target) = (camera.position + self.shift, camera.target + self.shift);
        Camera { position, target, ..camera.clone() }
    }
}

/// For each name of `to`, its index in `from`. Repeated names are matched in order.
fn same_names(from: &[&str], to: &[&str]) -> Vec<Option<usize>> {
    let mut is_taken = vec![false; from.len()];
    let take = |name: &&str| {
        let place = (0..from.len()).find(|&place| from[place] == *name && !is_taken[place])?;
        is_taken[place] = true;
        Some(place)
    };
    to.iter().map(take).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::demo::document::History;
    use crate::scene::{Light, LoadOptions};

    fn of(scene: &Scene) -> Document {
        Document::from_scene(scene, Vec::new())
    }

    /// A scene of one wall at `x`; `extra` holds its lights and materials.
    fn scene(x: f32, extra: &str) -> Scene {
        let folder = tempfile::tempdir().unwrap();
        let [near, far] = [x, x + 1.0];
        let wall = format!(
            "mtllib w.mtl\nv {near} 0 0\nv {far} 0 0\nv {near} 1 0\nusemtl wall\nf 1 2 3\n\
             v {near} 0 1\nv {far} 0 1\nv {near} 1 1\nusemtl door\nf 4 5 6\n"
        );
        std::fs::write(folder.path().join("w.obj"), wall).unwrap();
        let materials = "newmtl wall\nKd 0.5 0.5 0.5\nnewmtl door\nKd 0.2 0.2 0.2\n";
        std::fs::write(folder.path().join("w.mtl"), materials).unwrap();
        let text = format!("[[model]]\nfile = \"w.obj\"\n{extra}");
        let file = folder.path().join("s.toml");
        std::fs::write(&file, text).unwrap();
        Scene::load(file.to_str().unwrap(), &LoadOptions::default()).unwrap()
    }

    fn lamp(name: &str, height: f32) -> String {
        format!(
            "[[light]]\nname = \"{name}\"\nkind = \"point\"\nposition = [0.3, {height}, 2]\n\
             intensity = [1, 1, 1]\n"
        )
    }

    fn raise(entry: &mut LightEntry) {
        let position = entry.light.kind.position().unwrap();
        entry.light.kind = entry.light.kind.moved_to(position + Vec3::Y);
    }

    #[test]
    fn edits_are_found_by_name_where_lights_and_materials_change_places() {
        let before = scene(0.0, &[lamp("a", 1.0), lamp("b", 2.0), lamp("c", 3.0)].concat());
        let mut after = scene(0.0, &[lamp("new", 1.5), lamp("c", 3.0), lamp("a", 1.0)].concat());
        after.materials.reverse();
        let rebase = Rebase::new(&before, &after);
        let mut document = of(&before);
        document.add(Light { name: "mine".into(), ..before.lights[0].clone() });
        raise(&mut document.lights[0]);
        document.materials[0].diffuse = Vec3::splat(0.125);
        let moved = rebase.document(&document);
        let names = |document: &Document| {
            document.lights.iter().map(|entry| entry.light.name.clone()).collect::<Vec<_>>()
        };
        assert_eq!(names(&moved), names(&document));
        assert_eq!(moved.lights.iter().map(|entry| entry.id).collect::<Vec<_>>(), [2, 4, 1, 6]);
        assert_eq!(moved.lights[0].light, document.lights[0].light);
        let wall = after.materials.iter().position(|material| material.name == before.materials[0].name);
        assert_eq!(moved.materials[wall.unwrap()], document.materials[0]);
        assert_eq!(rebase.material(0), wall);
    }

    #[test]
    fn materials_that_come_or_go_leave_the_others_alone() {
        let before = scene(0.0, &lamp("a", 1.0));
        for gone in 0..before.materials.len() {
            let mut after = before.clone();
            after.materials.remove(gone);
            let rebase = Rebase::new(&before, &after);
            assert_eq!(rebase.material(gone), None);
            assert_eq!(rebase.document(&of(&before)), of(&after));
            let back = Rebase::new(&after, &before);
            assert_eq!(back.document(&of(&after)), of(&before));
        }
        assert_eq!(same_names(&["x", "y", "x"], &["x", "x", "x", "z"]), [Some(0), Some(2), None, None]);
    }

    #[test]
    fn places_stay_in_the_world_where_the_origin_moves() {
        let (before, after) = (scene(0.0, &lamp("a", 1.0)), scene(8.0, &lamp("a", 1.0)));
        assert_ne!(before.origin, after.origin);
        let rebase = Rebase::new(&before, &after);
        let moved = rebase.document(&of(&before));
        assert_eq!(moved, of(&after), "the light is where it was in the world");
        let camera = rebase.camera(&before.cameras[0]);
        let world = |scene: &Scene, place: Vec3| place.as_dvec3() + scene.origin;
        let was = world(&before, before.cameras[0].position);
        assert!(world(&after, camera.position).distance(was) < 1e-5);
    }

    /// A finished step, an undone step, and a step under way.
    #[test]
    fn a_reload_can_be_taken_back_and_loses_no_step() {
        let before = scene(0.0, &lamp("a", 1.0));
        let after = scene(0.0, &[lamp("b", 1.0), lamp("a", 2.0)].concat());
        let rebase = Rebase::new(&before, &after);
        let mut document = of(&before);
        let mut history = History::new(&document);
        let mut steps = vec![document.clone()];
        for albedo in [0.25, 0.125, 0.0625] {
            document.materials[1].diffuse = Vec3::splat(albedo);
            history.settle(&document);
            steps.push(document.clone());
        }
        history.undo(&mut document);
        let mut reloaded = of(&after);
        history.reload(&document, |document| rebase.document(document), &reloaded);
        assert_eq!(history.depths(), [3, 1]);
        assert!(!history.settle(&reloaded), "a reload is a whole step");
        for step in steps[..3].iter().rev() {
            assert!(history.undo(&mut reloaded));
            assert_eq!(reloaded, rebase.document(step));
        }
        assert!(!history.undo(&mut reloaded));
        (0..3).for_each(|_| assert!(history.redo(&mut reloaded)));
        assert_eq!(reloaded, of(&after));
        assert!(history.redo(&mut reloaded), "what was taken back before can still be done again");
        assert_eq!(reloaded, rebase.document(&steps[3]));

        // An edit under way is a step of its own.
        let mut document = of(&before);
        let mut history = History::new(&document);
        raise(&mut document.lights[0]);
        let mut reloaded = of(&after);
        history.reload(&document, |document| rebase.document(document), &reloaded);
        assert!(history.undo(&mut reloaded));
        assert_eq!(reloaded, rebase.document(&document));
        assert!(matches!(reloaded.lights[0].light.kind, LightKind::Point { .. }));

        // Equal lights and materials make no step.
        let mut history = History::new(&of(&after));
        let same = Rebase::new(&after, &after);
        history.reload(&of(&after), |document| same.document(document), &of(&after));
        assert_eq!(history.depths(), [0, 0]);
    }
}
