//! The mixer: lights and groups of lights alone, dimmed, and coloured. Its changes are edits like
//! others, so that undo takes them back and a frame shows them exactly.

use std::collections::HashMap;

use super::document::{Document, LightEntry};
use crate::scene::photometry::lux;
use glam::Vec3;

/// Sine of the angle between emissions of one colour: rounding of a few products.
const SAME_COLOUR: f32 = 1e-5;

/// State of the mixer that is no part of the scene.
///
/// The emission of a light is `full` × the colour of its group × the percentage. The percentage and
/// the colour are derived from the emission, so that they follow undo.
#[derive(Default)]
pub(super) struct Mixer {
    /// What is alone, and which lights were on before.
    alone: Option<(Alone, HashMap<u64, bool>)>,
    /// Emission of each light at 100 % in a white group: as it was when the mixer first saw it.
    full: HashMap<u64, Vec3>,
    /// Colour of each group. Its brightest channel is 1, unless it follows from its lights.
    colours: HashMap<String, Vec3>,
    /// Last percentage of each light whose emission does not tell it, because it is black.
    percents: HashMap<u64, f64>,
    /// Percentage of each light beside that of its group, when the group was last dimmed to 0 %.
    weights: HashMap<u64, f64>,
}

/// What is on while all else is off.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Alone {
    Light(u64),
    Group(String),
}

impl Alone {
    fn holds(&self, entry: &LightEntry) -> bool {
        match self {
            Self::Light(id) => entry.id == *id,
            Self::Group(group) => entry.light.group.as_ref() == Some(group),
        }
    }
}

/// The lights of a group.
fn members<'a>(document: &'a mut Document, group: &'a str) -> impl Iterator<Item = &'a mut LightEntry> {
    document.lights.iter_mut().filter(move |entry| entry.light.group.as_deref() == Some(group))
}

impl Mixer {
    /// Whether only this is on.
    pub(super) fn is_alone(&self, what: &Alone) -> bool {
        self.alone.as_ref().is_some_and(|(alone, _)| alone == what)
    }

    /// Switches all other lights off, or all lights back to what they were.
    pub(super) fn toggle_alone(&mut self, document: &mut Document, what: &Alone) {
        let before = match self.alone.take() {
            Some((alone, before)) => {
                for entry in &mut document.lights {
                    entry.light.is_on = before.get(&entry.id).copied().unwrap_or(entry.light.is_on);
                }
                if alone == *what {
                    return;
                }
                before
            }
            None => document.lights.iter().map(|entry| (entry.id, entry.light.is_on)).collect(),
        };
        document.lights.iter_mut().for_each(|entry| entry.light.is_on = what.holds(entry));
        self.alone = Some((what.clone(), before));
    }

    fn full(&mut self, entry: &LightEntry) -> Vec3 {
        let emission = entry.light.kind.emission();
        *self.full.entry(entry.id).or_insert(if emission == Vec3::ZERO { Vec3::ONE } else { emission })
    }

    /// Emission of the light at 100 %.
    fn whole(&mut self, entry: &LightEntry) -> Vec3 {
        let group = entry.light.group.as_ref().and_then(|group| self.colours.get(group));
        let colour = group.copied().unwrap_or(Vec3::ONE);
        self.full(entry) * colour
    }

    /// Luminous power of the light in percent of its full one.
    pub(super) fn percent(&mut self, entry: &LightEntry) -> f64 {
        let whole = lux(self.whole(entry));
        if whole <= 0.0 {
            // A blue group makes a red light black.
            return self.percents.get(&entry.id).copied().unwrap_or(100.0);
        }
        let percent = 100.0 * lux(entry.light.kind.emission()) / whole;
        self.percents.insert(entry.id, percent);
        percent
    }

    /// Dims the light to this percentage; its colour stays, also through 0 %.
    pub(super) fn dim(&mut self, entry: &mut LightEntry, percent: f64) {
        let (before, emission) = (self.percent(entry), entry.light.kind.emission());
        let whole = self.whole(entry);
        if before > 0.0 && !is_same_colour(whole, emission) {
            // The user gave it another colour. Of groups, `group_colour` detects that.
            self.full.insert(entry.id, emission * (100.0 / before) as f32);
        }
        let whole = self.whole(entry);
        self.percents.insert(entry.id, percent);
        entry.light.kind = entry.light.kind.with_emission(whole * (0.01 * percent) as f32);
    }

    /// Mean percentage of a group's lights.
    pub(super) fn group_percent(&mut self, document: &mut Document, group: &str) -> f64 {
        let percents: Vec<f64> = members(document, group).map(|entry| self.percent(entry)).collect();
        percents.iter().sum::<f64>() / percents.len().max(1) as f64
    }

    /// Dims a group to this percentage. The percentages of its lights keep their ratios.
    pub(super) fn dim_group(&mut self, document: &mut Document, group: &str, percent: f64) {
        let before = self.group_percent(document, group);
        for entry in members(document, group) {
            let weight = match before > 0.0 {
                true => self.percent(entry) / before,
                false => self.weights.get(&entry.id).copied().unwrap_or(1.0),
            };
            self.weights.insert(entry.id, weight);
            self.dim(entry, percent * weight);
        }
    }

    /// Takes over what a copy of a light is at 100 %.
    pub(super) fn copy(&mut self, from: u64, to: u64) {
        if let Some(full) = self.full.get(&from) {
            self.full.insert(to, *full);
        }
    }

    /// Colour of a group, by which the colours that its lights had at first are multiplied. A light
    /// that is new in the group or has another colour keeps its look and its percentage.
    pub(super) fn group_colour(&mut self, document: &mut Document, group: &str) -> Vec3 {
        let lights =
            members(document, group).map(|entry| (entry.id, self.full(entry), entry.light.kind.emission()));
        let lit: Vec<(u64, Vec3, Vec3)> = lights.filter(|(.., emission)| *emission != Vec3::ZERO).collect();
        let stored = self.colours.get(group).copied();
        // Undo, redo and edits of all lights bring other colours, and none changes a percentage: a
        // colour temperature keeps the luminous power.
        let derived = lit.iter().find(|(_, full, _)| full.min_element() > 0.0).map(|(id, full, emission)| {
            let ratio = *emission / *full;
            let percent = self.percents.get(id).copied().filter(|percent| *percent > 0.0);
            percent.map_or(ratio / ratio.max_element(), |percent| ratio * (100.0 / percent) as f32)
        });
        let is_of = |colour: Vec3, full: Vec3, emission: Vec3| {
            full * colour != Vec3::ZERO && is_same_colour(full * colour, emission)
        };
        let fits = |colour: &Vec3| lit.iter().all(|(_, full, emission)| is_of(*colour, *full, *emission));
        let found = [stored, Some(Vec3::ONE), derived].into_iter().flatten().find(fits);
        let colour = found.unwrap_or_else(|| {
            // A channel that the colour lacks cannot be brought back.
            let colour = stored.filter(|colour| colour.min_element() > 0.0).unwrap_or(Vec3::ONE);
            for entry in members(document, group) {
                let (full, emission) = (self.full(entry), entry.light.kind.emission());
                if emission != Vec3::ZERO && !is_of(colour, full, emission) {
                    let percent = self.percents.get(&entry.id).copied().filter(|percent| *percent > 0.0);
                    let full = emission / colour * (100.0 / percent.unwrap_or(100.0)) as f32;
                    self.full.insert(entry.id, full);
                }
            }
            colour
        });
        self.colours.insert(group.to_owned(), colour);
        colour
    }

    /// Gives a group a colour. Percentages stay.
    pub(super) fn colour_group(&mut self, document: &mut Document, group: &str, colour: Vec3) {
        let most = colour.max_element();
        let colour = if most > 0.0 { colour / most } else { Vec3::ONE };
        self.group_colour(document, group);
        let percents: Vec<f64> = members(document, group).map(|entry| self.percent(entry)).collect();
        self.colours.insert(group.to_owned(), colour);
        for (entry, percent) in members(document, group).zip(percents) {
            self.percents.insert(entry.id, percent);
            let emission = self.whole(entry) * (0.01 * percent) as f32;
            entry.light.kind = entry.light.kind.with_emission(emission);
        }
    }
}

/// Whether two emissions differ in brightness alone.
fn is_same_colour(a: Vec3, b: Vec3) -> bool {
    a.cross(b).length() <= SAME_COLOUR * a.length() * b.length()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::app::demo::document::History;
    use crate::scene::{Light, LightKind};

    fn document() -> Document {
        let intensity = Vec3::new(4.0, 2.0, 1.0);
        let kind = LightKind::Point { position: Vec3::ZERO, intensity };
        let light =
            |id: u64, is_on| LightEntry { id, light: Light { is_on, ..Light::new(format!("{id}"), kind) } };
        Document { lights: vec![light(3, true), light(5, false), light(8, true)], ..Document::default() }
    }

    /// The same with two lights in a group: one of all colours, and a red one.
    fn grouped() -> Document {
        let mut document = document();
        for entry in &mut document.lights[..2] {
            entry.light.group = Some("g".to_owned());
        }
        let red = Vec3::new(2.0, 0.0, 0.0);
        document.lights[1].light.kind = document.lights[1].light.kind.with_emission(red);
        document
    }

    fn on(document: &Document) -> Vec<bool> {
        document.lights.iter().map(|entry| entry.light.is_on).collect()
    }

    fn assert_emits(document: &Document, expected: [Vec3; 3], what: &str) {
        for (entry, expected) in document.lights.iter().zip(expected) {
            let emission = entry.light.kind.emission();
            assert!((emission - expected).length() < 1e-5, "{what}, light {}: {emission}", entry.id);
        }
    }

    #[test]
    fn a_light_is_alone_until_it_is_asked_for_again() {
        let (mut mixer, mut document) = (Mixer::default(), document());
        let [three, five] = [3, 5].map(Alone::Light);
        mixer.toggle_alone(&mut document, &five);
        assert_eq!(on(&document), [false, true, false]);
        mixer.toggle_alone(&mut document, &three);
        assert!(mixer.is_alone(&three) && !mixer.is_alone(&five));
        assert_eq!(on(&document), [true, false, false]);
        mixer.toggle_alone(&mut document, &three);
        assert_eq!(on(&document), [true, false, true]);
        assert!(!mixer.is_alone(&three));
    }

    #[test]
    fn a_group_is_alone_and_a_light_of_it_after_it() {
        let (mut mixer, mut document) = (Mixer::default(), grouped());
        let group = Alone::Group("g".to_owned());
        mixer.toggle_alone(&mut document, &group);
        assert!(mixer.is_alone(&group));
        assert_eq!(on(&document), [true, true, false]);
        mixer.toggle_alone(&mut document, &Alone::Light(5));
        assert_eq!(on(&document), [false, true, false]);
        mixer.toggle_alone(&mut document, &Alone::Light(5));
        assert_eq!(on(&document), [true, false, true]);
    }

    #[test]
    fn dimmed_lights_keep_their_colour() {
        let (mut mixer, mut document) = (Mixer::default(), document());
        let entry = &mut document.lights[0];
        let full = entry.light.kind.emission();
        for percent in [50.0, 0.0, 200.0, 100.0] {
            mixer.dim(entry, percent);
            let emission = entry.light.kind.emission();
            assert!((emission - full * (0.01 * percent) as f32).length() < 1e-5, "{percent}: {emission}");
            assert!((mixer.percent(entry) - percent).abs() < 1e-4);
        }
        // A new colour is kept through black.
        let blue = Vec3::new(0.0, 0.5, 4.0);
        entry.light.kind = entry.light.kind.with_emission(blue);
        let percent = mixer.percent(entry);
        mixer.dim(entry, 0.0);
        mixer.dim(entry, percent);
        assert!((entry.light.kind.emission() - blue).length() < 1e-5);
    }

    #[test]
    fn a_group_is_dimmed_in_the_ratios_of_its_lights() {
        let (mut mixer, mut document) = (Mixer::default(), grouped());
        let [a, b, c] = [0, 1, 2].map(|index| document.lights[index].light.kind.emission());
        assert!((mixer.group_percent(&mut document, "g") - 100.0).abs() < 1e-4);
        mixer.dim(&mut document.lights[1], 50.0);
        assert!((mixer.group_percent(&mut document, "g") - 75.0).abs() < 1e-4);
        mixer.dim_group(&mut document, "g", 150.0);
        assert_emits(&document, [2.0 * a, b, c], "doubled");
        // The ratios are kept through black.
        mixer.dim_group(&mut document, "g", 0.0);
        assert_emits(&document, [0.0 * a, 0.0 * b, c], "black");
        mixer.dim_group(&mut document, "g", 37.5);
        assert_emits(&document, [0.5 * a, 0.25 * b, c], "a half");
    }

    #[test]
    fn a_group_has_a_colour_beside_its_percentage() {
        let (mut mixer, mut document) = (Mixer::default(), grouped());
        let [a, b, c] = [0, 1, 2].map(|index| document.lights[index].light.kind.emission());
        let (blue, orange) = (Vec3::new(0.0, 0.5, 1.0), Vec3::new(1.0, 0.5, 0.25));
        mixer.colour_group(&mut document, "g", 0.5 * orange);
        assert_emits(&document, [a * orange, b * orange, c], "the brightest channel counts as 1");
        assert!((mixer.group_percent(&mut document, "g") - 100.0).abs() < 1e-4);
        mixer.dim_group(&mut document, "g", 50.0);
        // Blue leaves nothing of a red light, which comes back.
        mixer.colour_group(&mut document, "g", blue);
        assert_emits(&document, [0.5 * a * blue, Vec3::ZERO, c], "blue");
        assert!((mixer.group_percent(&mut document, "g") - 50.0).abs() < 1e-4);
        mixer.dim_group(&mut document, "g", 0.0);
        assert_eq!(mixer.group_colour(&mut document, "g"), blue, "black does not tell the colour");
        mixer.dim_group(&mut document, "g", 100.0);
        mixer.colour_group(&mut document, "g", Vec3::ONE);
        assert_emits(&document, [a, b, c], "white");
    }

    #[test]
    fn colours_of_groups_follow_undo_and_edits_of_their_lights() {
        let (mut mixer, mut document) = (Mixer::default(), grouped());
        let mut history = History::new(&document);
        let colours = [Vec3::new(1.0, 0.5, 0.25), Vec3::new(0.5, 1.0, 0.5)];
        for colour in colours {
            mixer.colour_group(&mut document, "g", colour);
            assert!(history.settle(&document), "one step");
        }
        let near = |a: Vec3, b: Vec3| (a - b).length() < 1e-5;
        history.undo(&mut document);
        assert!(near(mixer.group_colour(&mut document, "g"), colours[0]));
        history.undo(&mut document);
        assert!(near(mixer.group_colour(&mut document, "g"), Vec3::ONE));
        history.redo(&mut document);
        assert!(near(mixer.group_colour(&mut document, "g"), colours[0]));
        // A light gets another colour, and another one joins the group.
        let green = Vec3::new(0.0, 3.0, 0.0);
        let [_, red, other] = [0, 1, 2].map(|index| document.lights[index].light.kind.emission());
        document.lights[0].light.kind = document.lights[0].light.kind.with_emission(green);
        document.lights[2].light.group = Some("g".to_owned());
        assert!(near(mixer.group_colour(&mut document, "g"), colours[0]));
        assert!((mixer.group_percent(&mut document, "g") - 100.0).abs() < 1e-3);
        mixer.colour_group(&mut document, "g", colours[1]);
        let expected = [green, red, other].map(|emission| emission / colours[0] * colours[1]);
        assert_emits(&document, expected, "what they have is of the group's colour");
        // Without some channels, the colour starts anew.
        mixer.colour_group(&mut document, "g", Vec3::X);
        document.lights[0].light.kind = document.lights[0].light.kind.with_emission(green);
        assert_eq!(mixer.group_colour(&mut document, "g"), Vec3::ONE);
    }

    #[test]
    fn a_colour_temperature_keeps_the_percentage_of_a_group() {
        let (mut mixer, mut document) = (Mixer::default(), grouped());
        document.lights[1].light.kind = document.lights[0].light.kind;
        mixer.group_colour(&mut document, "g");
        mixer.dim_group(&mut document, "g", 80.0);
        for kelvin in [3000.0, 9000.0] {
            for entry in &mut document.lights[..2] {
                entry.light.kind = entry.light.kind.with_kelvin(kelvin);
            }
            mixer.group_colour(&mut document, "g");
            let percent = mixer.group_percent(&mut document, "g");
            assert!((percent - 80.0).abs() < 1e-3, "{kelvin} K: {percent} %");
        }
        let power = lux(document.lights[0].light.kind.emission());
        mixer.dim_group(&mut document, "g", 40.0);
        assert!((lux(document.lights[0].light.kind.emission()) / power - 0.5).abs() < 1e-5);
    }

    #[test]
    fn a_copy_is_as_dimmed_as_its_light() {
        let (mut mixer, mut document) = (Mixer::default(), grouped());
        mixer.dim_group(&mut document, "g", 40.0);
        mixer.colour_group(&mut document, "g", Vec3::new(1.0, 0.5, 0.25));
        let place = document.add(document.lights[0].light.clone());
        mixer.copy(3, document.lights[place].id);
        assert!((mixer.percent(&document.lights[place]) - 40.0).abs() < 1e-3);
        assert!(mixer.group_colour(&mut document, "g").distance(Vec3::new(1.0, 0.5, 0.25)) < 1e-5);
    }
}
