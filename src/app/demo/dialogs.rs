//! File dialogs: which scene to open, where to save it, which model or luminaire to add, which
//! image is the sky.

use std::path::{Path, PathBuf};

use egui_file_dialog::{DialogState, FileDialog};

/// What a file is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Purpose {
    /// A scene or a model takes the place of the open scene.
    Open,
    /// The edited scene is saved.
    Save,
    /// A model or a luminaire is added to the scene.
    Add,
    /// An image becomes the sky of the scene.
    Sky,
    /// An image becomes that of the chosen material.
    Image,
}

const MODELS: [&str; 5] = ["glb", "gltf", "obj", "ply", "stl"];
pub(super) const LUMINAIRES: [&str; 2] = ["ies", "ldt"];
/// Images that are the sky's if they are dropped on the window.
pub(super) const PANORAMAS: [&str; 2] = ["hdr", "exr"];
/// Other images that the sky may have. They are the chosen material's if they are dropped.
pub(super) const IMAGES: [&str; 6] = ["jpeg", "jpg", "png", "tif", "tiff", "webp"];
/// Images that only a material may have.
pub(super) const OTHER_IMAGES: [&str; 3] = ["bmp", "gif", "tga"];
const SCENES: [&str; 1] = ["toml"];

/// The dialog, which is open while it waits for an answer.
pub(super) struct Dialogs {
    dialog: FileDialog,
    purpose: Purpose,
}

impl Dialogs {
    pub(super) fn new() -> Self {
        Self { dialog: FileDialog::new(), purpose: Purpose::Open }
    }

    /// Whether the dialog takes the keys.
    pub(super) fn is_open(&self) -> bool {
        *self.dialog.state() == DialogState::Open
    }

    /// Opens the dialog in the folder of `file`.
    pub(super) fn ask(&mut self, purpose: Purpose, file: &Path) {
        let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new(".")).canonicalize().unwrap_or_default();
        let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let title = match purpose {
            Purpose::Open => "Open a scene or a model",
            Purpose::Save => "Save the scene",
            Purpose::Add => "Add a model or a luminaire",
            Purpose::Sky => "Choose the image of the sky",
            Purpose::Image => "Choose the image of the material",
        };
        let all = |lists: &[&[&'static str]]| lists.concat();
        let dialog = FileDialog::new().title(title).initial_directory(folder).as_modal(true);
        self.dialog = match purpose {
            Purpose::Open => dialog
                .add_file_filter_extensions("Scenes and models", all(&[&SCENES, &MODELS]))
                .default_file_filter("Scenes and models"),
            Purpose::Add => dialog
                .add_file_filter_extensions("Models and luminaires", all(&[&MODELS, &LUMINAIRES]))
                .default_file_filter("Models and luminaires"),
            Purpose::Sky => dialog
                .add_file_filter_extensions("Panoramas", all(&[&PANORAMAS, &IMAGES]))
                .default_file_filter("Panoramas"),
            Purpose::Image => dialog
                .add_file_filter_extensions("Images", all(&[&IMAGES, &OTHER_IMAGES, &PANORAMAS]))
                .default_file_filter("Images"),
            Purpose::Save => dialog.default_file_name(&name).add_save_extension("Scene", "toml"),
        };
        match purpose {
            Purpose::Save => self.dialog.save_file(),
            Purpose::Open | Purpose::Add | Purpose::Sky | Purpose::Image => self.dialog.pick_file(),
        }
        self.purpose = purpose;
    }

    /// Draws the dialog if it is open. Returns the file that the user has chosen.
    pub(super) fn show(&mut self, context: &egui::Context) -> Option<(Purpose, PathBuf)> {
        self.dialog.update(context);
        Some((self.purpose, self.dialog.take_picked()?))
    }
}
