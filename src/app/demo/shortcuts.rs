//! The table of keys that input, the help and `docs/window.md` share.

use egui::{Key, KeyboardShortcut, Modifiers};

/// The effect of a key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Action {
    Help,
    Panels,
    Undo,
    Redo,
    Open,
    SaveAs,
    Save,
    Screenshot,
    Layers,
    Record,
    Play,
    Beauty,
    Direct,
    Indirect,
    CachePoints,
    Cells,
    Inspect,
    Split,
    ShowError,
    FalseColours,
    Histogram,
    Zebra,
    Snapshot,
    SplitSnapshot,
    ContactSheet,
    FrameAll,
    ResetCamera,
    AddLight,
    RemoveLight,
    DuplicateLight,
    SnapLight,
    SwitchLight,
    Brighter,
    Darker,
    FollowExposure,
    NextTone,
    Larger,
    Smaller,
    Vsync,
    Fullscreen,
    Memory,
    Settled,
    Quit,
    QuitAnyway,
}

/// A key, its action and its description.
pub(super) struct Binding {
    pub(super) keys: KeyboardShortcut,
    pub(super) action: Action,
    pub(super) text: &'static str,
}

const fn key(logical_key: Key, action: Action, text: &'static str) -> Binding {
    Binding { keys: KeyboardShortcut::new(Modifiers::NONE, logical_key), action, text }
}

const fn command(logical_key: Key, action: Action, text: &'static str) -> Binding {
    Binding { keys: KeyboardShortcut::new(Modifiers::COMMAND, logical_key), action, text }
}

/// All bindings. A combination stands before the shorter ones that it contains.
pub(super) const BINDINGS: [Binding; 46] = [
    key(Key::F1, Action::Help, "Show or hide this list"),
    key(Key::H, Action::Help, "Show or hide this list"),
    key(Key::P, Action::Panels, "Show or hide the panels"),
    Binding {
        keys: KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::Z),
        action: Action::Redo,
        text: "Do again what was taken back",
    },
    command(Key::Z, Action::Undo, "Take the last edit back"),
    command(Key::Y, Action::Redo, "Do again what was taken back"),
    command(Key::O, Action::Open, "Open a scene or a model"),
    Binding {
        keys: KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::S),
        action: Action::SaveAs,
        text: "Save the scene to a file that you choose",
    },
    command(Key::S, Action::Save, "Save the scene"),
    command(Key::P, Action::Screenshot, "Save the picture"),
    command(Key::L, Action::Layers, "Save the light of each light as layers of one file"),
    command(Key::R, Action::Record, "Begin or end to record a film"),
    key(Key::Space, Action::Play, "Play or stop the film"),
    key(Key::Num1, Action::Beauty, "The picture"),
    key(Key::Num2, Action::Direct, "Direct light only"),
    key(Key::Num3, Action::Indirect, "Indirect light only"),
    key(Key::Num4, Action::CachePoints, "Cache points and their radii"),
    key(Key::Num5, Action::Cells, "Cells of the hierarchy; again: the next level"),
    key(Key::Num6, Action::Inspect, "Gather rays and light path of what is clicked"),
    key(Key::Num7, Action::ShowError, "Ours beside its error, as Monte Carlo finds it"),
    key(Key::Num8, Action::FalseColours, "Illuminance as colours; again: luminance"),
    key(Key::M, Action::Split, "Ours beside Monte Carlo"),
    key(Key::N, Action::Snapshot, "Keep the picture and its edits as a snapshot"),
    key(Key::B, Action::SplitSnapshot, "Ours beside the newest snapshot"),
    key(Key::J, Action::ContactSheet, "Save all snapshots as one picture"),
    key(Key::G, Action::Histogram, "Show or hide the histogram"),
    key(Key::Z, Action::Zebra, "Stripes on pixels without detail, white or black"),
    key(Key::F, Action::FrameAll, "Look at all of the scene"),
    key(Key::Home, Action::ResetCamera, "Back to the scene's camera"),
    key(Key::R, Action::ResetCamera, "Back to the scene's camera"),
    key(Key::L, Action::AddLight, "Add a light in the middle of the view"),
    key(Key::Delete, Action::RemoveLight, "Remove the chosen lights"),
    key(Key::X, Action::RemoveLight, "Remove the chosen lights"),
    key(Key::O, Action::SwitchLight, "Switch the chosen lights off or on"),
    command(Key::D, Action::DuplicateLight, "Copy the chosen lights"),
    key(Key::U, Action::SnapLight, "Put the chosen light on the surface under the pointer"),
    key(Key::Period, Action::Brighter, "Expose half a stop more"),
    key(Key::Comma, Action::Darker, "Expose half a stop less"),
    key(Key::K, Action::FollowExposure, "Let the exposure follow the picture, or lock it"),
    key(Key::T, Action::NextTone, "The next tone curve"),
    command(Key::Plus, Action::Larger, "Larger text"),
    command(Key::Minus, Action::Smaller, "Smaller text"),
    key(Key::V, Action::Vsync, "Wait for the screen, or do not"),
    key(Key::F11, Action::Fullscreen, "Fill the screen, or do not"),
    Binding {
        keys: KeyboardShortcut::new(Modifiers::COMMAND.plus(Modifiers::SHIFT), Key::Q),
        action: Action::QuitAnyway,
        text: "Close the window without saving",
    },
    command(Key::Q, Action::Quit, "Close the window"),
];

/// Unlisted key: prints the device memory in use to stderr.
const MEMORY: KeyboardShortcut = KeyboardShortcut::new(Modifiers::NONE, Key::F10);

/// Unlisted key: prints to stderr when the window is up to date. Scripts wait for this line, not
/// for a time.
const SETTLED: KeyboardShortcut = KeyboardShortcut::new(Modifiers::NONE, Key::F9);

/// The pointer's actions and their descriptions.
pub(super) const POINTER: [(&str, &str); 10] = [
    ("Drag", "Turn about the point under the pointer"),
    ("Shift and drag, or middle button", "Move sideways"),
    ("Ctrl and drag, or right button", "Look around"),
    ("Wheel, or two fingers", "Move closer or away"),
    ("W A S D, Q E", "Fly; faster with Shift"),
    ("Drag a handle", "Move, turn or resize the chosen light; in steps with Ctrl"),
    ("Click a light", "Choose it"),
    ("Ctrl and click a light", "Choose it as well, or no longer"),
    ("Ctrl+Shift and click a surface", "Aim the chosen lights at that point"),
    ("Click a surface", "Choose its material"),
];

/// Takes the actions of pressed keys out of the input. Keys that the user types into a
/// text field stay.
pub(super) fn pressed(input: &mut egui::InputState, types: bool) -> Vec<Action> {
    let mut actions: Vec<Action> = Vec::new();
    for Binding { keys, action, .. } in BINDINGS.iter().filter(|_| !types) {
        for _ in 0..input.count_and_consume_key(keys.modifiers, keys.logical_key) {
            actions.push(*action);
        }
    }
    if input.consume_shortcut(&MEMORY) {
        actions.push(Action::Memory);
    }
    if input.consume_shortcut(&SETTLED) {
        actions.push(Action::Settled);
    }
    actions
}

/// The keys as text.
pub(super) fn name(keys: &KeyboardShortcut) -> String {
    keys.format(&egui::ModifierNames::NAMES, false)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_key_does_two_things() {
        for (index, a) in BINDINGS.iter().enumerate() {
            for b in &BINDINGS[index + 1..] {
                assert_ne!(a.keys, b.keys, "{} and {}", a.text, b.text);
            }
        }
    }

    #[test]
    fn the_documents_list_every_key() {
        let page = include_str!("../../../docs/window.md");
        let keys = BINDINGS.iter().map(|binding| (name(&binding.keys), binding.text));
        let pointer = POINTER.iter().map(|(what, text)| ((*what).to_owned(), *text));
        let rows = pointer.chain(keys).map(|(what, text)| format!("| {what} | {text} |\n"));
        let missing: String = rows.filter(|row| !page.contains(row)).collect();
        assert!(missing.is_empty(), "docs/window.md lacks:\n{missing}");
    }
}
