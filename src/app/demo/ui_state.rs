//! What the window is set to: what is chosen, which view is shown, which panels. None of it belongs
//! to the scene.

use glam::Vec3;

/// What panels and handles are about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Chosen {
    Nothing,
    /// By its number in the document.
    Light(u64),
    /// By its index in the scene.
    Material(usize),
}

/// What the picture shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum View {
    Beauty,
    Direct,
    Indirect,
    /// Cache points with their radii, over the picture.
    CachePoints,
    /// Clusters of that level of the hierarchy, in colours.
    Cells(u32),
    /// Gather rays of the cache point and the light path of the entry point that are nearest to
    /// what was clicked.
    Inspect,
}

/// What is to be done outside of the panels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Request {
    Save,
    Screenshot,
    Record,
    Play,
    Vsync,
    Fullscreen,
    /// Says how much device memory is in use.
    Memory,
    /// Says when the window shows all that was asked for.
    Settled,
    /// Traces the light paths anew with that preset.
    Preset(&'static str),
    /// What becomes of unsaved edits of a scene that has changed on disk.
    Answer(Answer),
    Quit,
}

/// What can be chosen where a scene has changed on disk while it was edited.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Answer {
    /// Loads the scene again; the edits are one step back.
    Reload,
    /// Goes on with the scene as it was edited.
    KeepMine,
    /// Saves the edited scene beside its file, and loads that again.
    KeepBoth,
}

/// The state of the window.
pub(super) struct UiState {
    pub(super) chosen: Chosen,
    pub(super) view: View,
    pub(super) shows_panels: bool,
    pub(super) shows_help: bool,
    /// Where ours ends and Monte Carlo begins, 0..=1 from the left; none: ours alone.
    pub(super) split: Option<f32>,
    pub(super) vsync: bool,
    /// Pixels of the picture for each of the window.
    pub(super) scale: f32,
    /// What was clicked last.
    pub(super) place: Option<Place>,
    pub(super) requests: Vec<Request>,
    /// Where the scene and pictures are saved.
    pub(super) save_to: String,
    /// Of all text, 1 is the system's.
    pub(super) text_scale: f32,
    pub(super) is_recording: bool,
    pub(super) is_playing: bool,
    /// What Monte Carlo says: samples, error of ours, its own noise; both relMSE.
    pub(super) verdict: Option<(u32, f64, f64)>,
}

/// A place on a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Place {
    pub(super) position: Vec3,
    pub(super) normal: Vec3,
    /// Index into the scene's materials.
    pub(super) material: usize,
}

impl UiState {
    pub(super) fn new(scene: &str) -> Self {
        Self {
            chosen: Chosen::Light(0),
            view: View::Beauty,
            shows_panels: true,
            shows_help: false,
            split: None,
            vsync: true,
            scale: 1.0,
            place: None,
            requests: Vec::new(),
            save_to: format!("{scene}-edited.toml"),
            text_scale: 1.0,
            is_recording: false,
            is_playing: false,
            verdict: None,
        }
    }
}

impl View {
    /// Shares of direct and indirect light in the picture.
    pub(super) fn shares(self) -> [f32; 2] {
        match self {
            Self::Direct => [1.0, 0.0],
            Self::Indirect => [0.0, 1.0],
            _ => [1.0, 1.0],
        }
    }
}
