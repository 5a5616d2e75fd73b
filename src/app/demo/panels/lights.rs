//! The list of lights and groups, and below it the editor of the chosen one.

use egui::collapsing_header::CollapsingState;
use egui::{Align, Checkbox, DragValue, Layout, Modifiers, Ui};
use glam::Vec3;

use super::{derived, light, luminaire};
use crate::app::demo::choice::released;
use crate::app::demo::document::Document;
use crate::app::demo::light_edit::{self, LightEdit};
use crate::app::demo::mixer::Alone;
use crate::app::demo::placing;
use crate::app::demo::session::Session;
use crate::app::demo::ui_state::{Chosen, UiState};
use crate::scene::{Light, LightKind};

/// Range of percentages.
const PERCENT: std::ops::RangeInclusive<f64> = 0.0..=1e4;

/// What the user does in the list.
enum Act {
    Choose(u64, Modifiers),
    ChooseGroup(Vec<u64>),
    Edit(Vec<u64>, LightEdit),
    Dim(Vec<u64>, f64),
    DimGroup(String, f64),
    ColourGroup(String, Vec3),
    Alone(Alone),
    Duplicate(Vec<u64>),
    Remove(Vec<u64>),
}

/// A row of the list, or a group with its rows.
enum Item {
    Light(u64),
    Group(String, Vec<u64>),
}

/// Draws the list, and below it the chosen light.
pub(super) fn lights(ui: &mut Ui, session: &mut Session, ui_state: &mut UiState) {
    let is_there = |id: &u64| session.document.lights.iter().any(|entry| entry.id == *id);
    ui_state.other_lights.retain(is_there);
    let items = items(&session.document);
    let mut acts = Vec::new();
    for item in &items {
        match item {
            Item::Light(id) => row(ui, &session.document, ui_state, *id, &mut acts),
            Item::Group(name, members) => {
                group(ui, &mut session.document, ui_state, (name, members), &mut acts);
            }
        }
    }
    let listed = items.into_iter().flat_map(|item| match item {
        Item::Light(id) => vec![id],
        Item::Group(_, members) => members,
    });
    let listed: Vec<u64> = listed.collect();
    acts.into_iter().for_each(|act| perform(act, session, ui_state, &listed));
    ui.horizontal(|ui| {
        ui.label("Add");
        for kind in ["point", "spot", "area", "sun"] {
            if ui.small_button(kind).clicked() {
                let light = fresh(session, kind);
                let place = session.document.add(light);
                ui_state.choose(Chosen::Light(session.document.lights[place].id));
            }
        }
    });
    luminaire::adding(ui, ui_state);
    edit_chosen(ui, session, ui_state);
}

/// Draws the editor of the primary light, and applies its edits to all chosen ones.
fn edit_chosen(ui: &mut Ui, session: &mut Session, ui_state: &mut UiState) {
    let chosen = ui_state.chosen_lights();
    let primary = chosen.first().copied();
    if let Some((id, text)) = ui_state.group_typed.take_if(|(id, _)| Some(*id) != primary) {
        // Another light was chosen before the name was confirmed.
        light_edit::edit(&mut session.document, &[id], &LightEdit::group(&text));
    }
    let entry = session.document.lights.iter_mut().find(|entry| Some(entry.id) == primary);
    let Some(entry) = entry else { return };
    ui.separator();
    if chosen.len() > 1 {
        ui.small(format!("{} lights are chosen: all get what they have in common.", chosen.len()));
    }
    let edits = light::light(ui, entry, session.scene.origin.as_vec3(), &mut ui_state.group_typed);
    for edit in &edits {
        light_edit::edit(&mut session.document, &chosen, edit);
    }
}

/// The rows of the list: a group stands where its first light is.
fn items(document: &Document) -> Vec<Item> {
    let mut items: Vec<Item> = Vec::new();
    for entry in &document.lights {
        let Some(group) = &entry.light.group else {
            items.push(Item::Light(entry.id));
            continue;
        };
        let known = items.iter_mut().find_map(|item| match item {
            Item::Group(name, members) if name == group => Some(members),
            _ => None,
        });
        match known {
            Some(members) => members.push(entry.id),
            None => items.push(Item::Group(group.clone(), vec![entry.id])),
        }
    }
    items
}

fn perform(act: Act, session: &mut Session, ui_state: &mut UiState, listed: &[u64]) {
    let (document, mixer) = (&mut session.document, &mut ui_state.mixer);
    match act {
        Act::Choose(id, Modifiers { command: true, .. }) => ui_state.toggle_chosen(id),
        Act::Choose(id, Modifiers { shift: true, .. }) => ui_state.choose_up_to(id, listed),
        Act::Choose(id, _) => ui_state.choose(Chosen::Light(id)),
        Act::ChooseGroup(members) => ui_state.choose_lights(&members),
        Act::Edit(lights, edit) => light_edit::edit(document, &lights, &edit),
        Act::Dim(lights, percent) => {
            for entry in document.lights.iter_mut().filter(|entry| lights.contains(&entry.id)) {
                mixer.dim(entry, percent);
            }
        }
        Act::DimGroup(group, percent) => mixer.dim_group(document, &group, percent),
        Act::ColourGroup(group, colour) => mixer.colour_group(document, &group, colour),
        Act::Alone(what) => mixer.toggle_alone(document, &what),
        Act::Duplicate(lights) => placing::duplicate(session, ui_state, &lights),
        Act::Remove(lights) => placing::remove(session, ui_state, &lights),
    }
}

/// Draws the heading of a group, which folds, and the rows of its lights.
fn group(
    ui: &mut Ui,
    document: &mut Document,
    ui_state: &mut UiState,
    (name, members): (&str, &[u64]),
    acts: &mut Vec<Act>,
) {
    let colour = ui_state.mixer.group_colour(document, name);
    let percent = ui_state.mixer.group_percent(document, name);
    let lights = document.lights.iter().filter(|entry| members.contains(&entry.id));
    let on = lights.filter(|entry| entry.light.is_on).count();
    let id = ui.make_persistent_id(("group of lights", name));
    let header = CollapsingState::load_with_default_open(ui.ctx(), id, true).show_header(ui, |ui| {
        let mut is_on = on == members.len();
        let checkbox = Checkbox::new(&mut is_on, "").indeterminate(on > 0 && on < members.len());
        if ui.add(checkbox).on_hover_text("All lights of the group on or off").changed() {
            acts.push(Act::Edit(members.to_vec(), LightEdit::On(is_on)));
        }
        let is_chosen = members.iter().all(|id| ui_state.has_chosen(*id));
        let label = ui.selectable_label(is_chosen, egui::RichText::new(name).strong());
        if label.on_hover_text("Choose all lights of the group").clicked() {
            acts.push(Act::ChooseGroup(members.to_vec()));
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            let mut picked = (colour / colour.max_element()).to_array();
            let button = ui.color_edit_button_rgb(&mut picked);
            if button.on_hover_text("Multiplies the colours that the lights had at first").changed() {
                acts.push(Act::ColourGroup(name.to_owned(), picked.into()));
            }
            let hint = "Dim the group: mean percentage of its lights";
            if let Some(percent) = derived(ui, percent, percent_field, hint) {
                acts.push(Act::DimGroup(name.to_owned(), percent));
            }
            solo(ui, ui_state, Alone::Group(name.to_owned()), "This group alone (solo)", acts);
        });
    });
    header.body(|ui| members.iter().for_each(|id| row(ui, document, ui_state, *id, acts)));
}

fn percent_field(value: DragValue<'_>) -> DragValue<'_> {
    value.range(PERCENT).suffix(" %").max_decimals(0)
}

fn solo(ui: &mut Ui, ui_state: &UiState, what: Alone, hint: &str, acts: &mut Vec<Act>) {
    if ui.selectable_label(ui_state.mixer.is_alone(&what), "S").on_hover_text(hint).clicked() {
        acts.push(Act::Alone(what));
    }
}

/// Draws the row of a light.
fn row(ui: &mut Ui, document: &Document, ui_state: &mut UiState, id: u64, acts: &mut Vec<Act>) {
    let Some(entry) = document.lights.iter().find(|entry| entry.id == id) else { return };
    let edited = ui_state.edited_with(id);
    ui.horizontal(|ui| {
        let mut is_on = entry.light.is_on;
        if ui.checkbox(&mut is_on, "").on_hover_text("On or off (O)").changed() {
            acts.push(Act::Edit(edited.clone(), LightEdit::On(is_on)));
        }
        ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
            if ui.small_button("✖").on_hover_text("Remove (Del)").clicked() {
                acts.push(Act::Remove(edited.clone()));
            }
            if ui.small_button("🗐").on_hover_text("Copy (Ctrl+D)").clicked() {
                acts.push(Act::Duplicate(edited.clone()));
            }
            let (percent, hint) = (ui_state.mixer.percent(entry), "Dim: percent of its power at first");
            if let Some(percent) = derived(ui, percent, percent_field, hint) {
                acts.push(Act::Dim(edited.clone(), percent));
            }
            solo(ui, ui_state, Alone::Light(id), "This light alone (solo)", acts);
            ui.with_layout(Layout::left_to_right(Align::Center), |ui| {
                let name = format!("{} ({})", entry.light.name, word(&entry.light));
                let label = egui::Button::selectable(ui_state.has_chosen(id), name).truncate();
                if ui.add(label).clicked() {
                    // A key that is released in the same frame was held during the click.
                    let held = ui.input(|input| input.events.iter().find_map(released));
                    acts.push(Act::Choose(id, held.map_or(Modifiers::NONE, |(_, modifiers)| modifiers)));
                }
            });
        });
    });
}

/// What the list calls a light.
fn word(light: &Light) -> &'static str {
    if light.luminaire.is_some() { "luminaire" } else { light.kind.word() }
}

/// A place in the middle of the view, inside the scene.
pub(in crate::app::demo) fn middle_of_view(session: &Session) -> Vec3 {
    let (camera, (low, high)) = (&session.camera, session.scene.bounds());
    let raised = 0.02 * (high - low).length() * Vec3::Y;
    (camera.position + 0.5 * (camera.target - camera.position)).clamp(low, high) + raised
}

/// A new light in the middle of the view, as bright as the scene's first.
pub(in crate::app::demo) fn fresh(session: &Session, kind: &str) -> Light {
    let [_, _, forward] = session.camera.frame();
    let (low, high) = session.scene.bounds();
    let size = (high - low).length();
    let position = middle_of_view(session);
    let luminous = session.document.lights.first().map(|entry| entry.light.kind);
    let intensity = match luminous {
        Some(LightKind::Point { intensity, .. } | LightKind::Spot { intensity, .. }) => intensity,
        // A typical intensity for a room of that size.
        _ => Vec3::splat(0.1 * size * size),
    };
    let side = 0.1 * size;
    let kind = match kind {
        "spot" => LightKind::Spot {
            position,
            direction: forward,
            intensity,
            angle: 30_f32.to_radians(),
            penumbra: 0.3,
        },
        "area" => LightKind::Area {
            corner: position - Vec3::new(0.5 * side, 0.0, 0.5 * side),
            edge_u: Vec3::X * side,
            edge_v: Vec3::Z * side,
            // As bright as the point light, seen face on; `edge_u × edge_v` points down.
            radiance: intensity / (side * side),
            samples: 10,
        },
        "sun" => LightKind::Directional {
            direction: Vec3::new(-0.4, -0.8, -0.45).normalize(),
            irradiance: intensity / (0.25 * size * size),
        },
        _ => LightKind::Point { position, intensity },
    };
    Light::new(kind.word(), kind)
}
