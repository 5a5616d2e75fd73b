//! The UI state: the chosen item, the view, the open panels. None of it belongs to the scene.

use super::dialogs::Purpose;
use super::differences::Differences;
use super::levels::Levels;
use super::meters::Meters;
use super::mixer::Mixer;
use super::recent::Recent;
use crate::app::false_colours::{Quantity, Scale};
use glam::Vec3;

/// The item that panels and gizmos edit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Chosen {
    Nothing,
    /// By its identifier in the document.
    Light(u64),
    /// By its index in the scene.
    Material(usize),
    /// By its index in the document.
    Model(usize),
}

/// The content of the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum View {
    Beauty,
    Direct,
    Indirect,
    /// Cache points with their radii over the picture.
    CachePoints,
    /// Clusters of one hierarchy level, as colours.
    Cells(u32),
    /// Gather rays of the cache point, and the light path of the entry point, that are nearest to
    /// the clicked position.
    Inspect,
    /// Illuminance or luminance as colours.
    FalseColours(Quantity),
}

/// The picture right of the split.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Beside {
    /// Monte Carlo of the same view.
    MonteCarlo,
    /// Our error, as Monte Carlo finds it.
    Error,
    /// A snapshot, by its identifier.
    Snapshot(u64),
}

/// A request that the window gizmos outside of the panels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Request {
    Save,
    Screenshot,
    /// Saves the light of each light as layers of one file.
    Layers,
    Record,
    Play,
    Vsync,
    Fullscreen,
    /// Asks for a file.
    Ask(Purpose),
    /// Adds the luminaire `luminaire_to_add`.
    AddLuminaire,
    /// Opens the scene `to_open`, or asks if there are unsaved edits.
    Open,
    /// Opens it without a question.
    OpenAnyway,
    /// Saves the scene, and opens that one if that succeeds.
    SaveAndOpen,
    /// Prints the device memory in use.
    Memory,
    /// Prints when the window is up to date.
    Settled,
    /// Retraces the light paths with that preset.
    Preset(&'static str),
    /// The answer about unsaved edits of a scene that has changed on disk.
    Answer(Answer),
    /// Shows what differs between that scene and the edited one.
    Compare,
    /// Closes the window, or asks if there are unsaved edits.
    Quit,
    /// Closes the window without a question.
    QuitAnyway,
    /// Saves the scene, and closes the window if that succeeds.
    SaveAndQuit,
    /// Brings unsaved edits of an earlier window back.
    Restore,
    /// Deletes these edits.
    Discard,
    /// Keeps the picture and its edits.
    Snapshot,
    /// Restores the edits of a snapshot.
    RestoreSnapshot(u64),
    /// Saves all snapshots as one picture.
    ContactSheet,
    /// Searches for powers of lights that give the wanted illuminances.
    Solve,
}

/// Answers for a scene that has changed on disk and has unsaved edits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Answer {
    /// Reloads the scene; the edits are one undo step back.
    Reload,
    /// Keeps the edited scene.
    KeepMine,
    /// Saves the edited scene beside its file, then reloads the file.
    KeepBoth,
}

/// The state of the window.
pub(super) struct UiState {
    pub(super) chosen: Chosen,
    /// Chosen lights beside the primary one in `chosen`.
    pub(super) other_lights: Vec<u64>,
    /// A light, and the name of its group that the user types.
    pub(super) group_typed: Option<(u64, String)>,
    /// The primary light moves to the surface under the pointer.
    pub(super) snaps_light: bool,
    pub(super) view: View,
    pub(super) shows_panels: bool,
    pub(super) shows_help: bool,
    /// Position of the split, 0..=1 from the left: our picture before it, another one after it.
    /// `None`: no split.
    pub(super) split: Option<f32>,
    pub(super) beside: Beside,
    pub(super) vsync: bool,
    /// The time of each pass is shown.
    pub(super) times_passes: bool,
    /// The picture has fewer pixels while the user moves something and frames are slow.
    pub(super) coarsens: bool,
    /// Picture pixels per window pixel.
    pub(super) scale: f32,
    /// The clicked position on a surface.
    pub(super) place: Option<Place>,
    pub(super) requests: Vec<Request>,
    /// The window asks what becomes of unsaved edits before it closes.
    pub(super) asks_to_close: bool,
    /// The window asks what becomes of unsaved edits before it opens `to_open`.
    pub(super) asks_to_open: bool,
    /// A scene that the user has chosen.
    pub(super) to_open: Option<String>,
    pub(super) recent: Recent,
    /// A file dialog takes the keys.
    pub(super) is_in_dialog: bool,
    /// What differs between the scene on disk and the edited one, if the user wants to see it.
    pub(super) differences: Option<Differences>,
    /// An earlier window has left unsaved edits.
    pub(super) asks_to_restore: bool,
    /// Path for the saved scene and pictures.
    pub(super) save_to: String,
    /// Path of the model that the user is about to add.
    pub(super) model_to_add: String,
    /// Path of the luminaire that the user is about to add.
    pub(super) luminaire_to_add: String,
    /// Scale of all text; 1 is the system's.
    pub(super) text_scale: f32,
    pub(super) is_recording: bool,
    pub(super) is_playing: bool,
    pub(super) verdict: Option<Verdict>,
    /// The picture against the snapshot beside it.
    pub(super) difference: Option<Difference>,
    pub(super) shows_histogram: bool,
    /// Stripes mark pixels without detail.
    pub(super) shows_zebra: bool,
    /// Whether the pointer over false colours shows the percentage of each light.
    pub(super) shows_contributions: bool,
    /// Levels of the picture, if the histogram is shown.
    pub(super) levels: Option<Levels>,
    /// The panel of snapshots opens.
    pub(super) opens_snapshots: bool,
    /// Range of false colours. `None`: follows the next picture.
    pub(super) light_range: Option<Scale>,
    pub(super) mixer: Mixer,
    pub(super) meters: Meters,
}

/// Our picture against Monte Carlo's.
#[derive(Clone, Copy, Debug)]
pub(super) struct Verdict {
    /// Monte Carlo's samples of each pixel.
    pub(super) samples: u32,
    /// Our error, and its standard deviation from Monte Carlo's noise.
    pub(super) relmse: f64,
    pub(super) uncertainty: f64,
    /// Monte Carlo's own noise, a relMSE.
    pub(super) noise: f64,
}

/// The picture against a snapshot of the same size.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Difference {
    /// Version of the picture, and identifier of the snapshot.
    pub(super) of: (u64, u64),
    pub(super) relmse: f64,
    /// Sum of all values over that of the snapshot, less 1.
    pub(super) brighter: f64,
}

/// A position on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub(super) position: Vec3,
    pub(super) normal: Vec3,
    /// Index into the scene's materials.
    pub(super) material: usize,
}

impl UiState {
    pub(super) fn new(scene: &str, recent: Recent) -> Self {
        Self {
            chosen: Chosen::Light(0),
            other_lights: Vec::new(),
            group_typed: None,
            snaps_light: false,
            view: View::Beauty,
            shows_panels: true,
            shows_help: false,
            split: None,
            beside: Beside::MonteCarlo,
            vsync: true,
            times_passes: false,
            coarsens: true,
            scale: 1.0,
            place: None,
            requests: Vec::new(),
            asks_to_close: false,
            asks_to_open: false,
            to_open: None,
            recent,
            is_in_dialog: false,
            differences: None,
            asks_to_restore: false,
            save_to: format!("{scene}-edited.toml"),
            model_to_add: String::new(),
            luminaire_to_add: String::new(),
            text_scale: 1.0,
            is_recording: false,
            is_playing: false,
            verdict: None,
            difference: None,
            shows_histogram: false,
            shows_zebra: false,
            shows_contributions: false,
            levels: None,
            opens_snapshots: false,
            light_range: None,
            mixer: Mixer::default(),
            meters: Meters::default(),
        }
    }

    /// The state for another scene: what does not depend on the scene stays.
    pub(super) fn of_scene(&mut self, scene: &str) -> Self {
        let recent = std::mem::replace(&mut self.recent, Recent::none());
        Self {
            shows_panels: self.shows_panels,
            vsync: self.vsync,
            times_passes: self.times_passes,
            coarsens: self.coarsens,
            scale: self.scale,
            text_scale: self.text_scale,
            shows_histogram: self.shows_histogram,
            shows_zebra: self.shows_zebra,
            shows_contributions: self.shows_contributions,
            ..Self::new(scene, recent)
        }
    }

    /// Whether the window shows values that the host reads from the picture.
    pub(super) fn reads_picture(&self) -> bool {
        let has_colours = matches!(self.view, View::Cells(_) | View::FalseColours(_));
        has_colours || self.shows_zebra || self.shows_histogram
    }

    /// Whether the window shows the picture, and nothing that is read from it.
    pub(super) fn shows_picture_alone(&self) -> bool {
        let is_read = self.reads_picture() || self.split.is_some() || !self.requests.is_empty();
        self.view == View::Beauty && !is_read && !self.is_playing
    }

    /// The snapshot right of the split.
    pub(super) fn snapshot_beside(&self) -> Option<u64> {
        match self.beside {
            Beside::Snapshot(id) => self.split.and(Some(id)),
            _ => None,
        }
    }

    /// Whether Monte Carlo, or the error that it finds, stands right of the split.
    pub(super) fn shows_monte_carlo(&self) -> bool {
        self.split.is_some() && self.snapshot_beside().is_none()
    }

    /// Shows the picture beside ours, or hides it if it is shown.
    pub(super) fn toggle_beside(&mut self, beside: Beside) {
        let is_shown = self.split.is_some() && self.beside == beside;
        self.split = if is_shown { None } else { self.split.or(Some(0.5)) };
        self.beside = beside;
    }
}

impl View {
    /// Weights of direct and indirect light in the picture.
    pub(super) fn weights(self) -> [f32; 2] {
        match self {
            Self::Direct => [1.0, 0.0],
            Self::Indirect => [0.0, 1.0],
            _ => [1.0, 1.0],
        }
    }
}
