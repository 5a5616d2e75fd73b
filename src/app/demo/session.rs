//! The scene that is shown, with all that is known of it.

use std::collections::VecDeque;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Instant, SystemTime};

use super::document::{Document, History};
use super::stage::{Preparing, Progressed, Ready, Wake};
use crate::error::Result;
use crate::gpu::{Buffer, Context};
use crate::renderer::{Columns, FrameReport, Renderer, Store};
use crate::scene::{Camera, LoadOptions, Scene, save::SceneText};

/// Frames whose times are kept.
pub(super) const FRAMES: usize = 200;

/// Where the scene came from.
#[derive(Clone)]
pub(super) struct Source {
    pub(super) spec: String,
    pub(super) options: LoadOptions,
    /// Where light paths are kept, if anywhere.
    pub(super) store: Option<Store>,
}

/// What a frame cost.
#[derive(Clone, Copy)]
pub(super) struct Cost {
    pub(super) columns: Columns,
    /// Wall-clock, milliseconds.
    pub(super) frame_ms: f64,
}

/// What a picture depends on.
#[derive(Clone, PartialEq)]
pub(super) struct Wanted {
    pub(super) document: Document,
    pub(super) camera: Camera,
    pub(super) exposure_stops: f32,
    /// Of direct and indirect light.
    pub(super) shares: [f32; 2],
}

enum Stage {
    Preparing(Box<Preparing>),
    Ready(Box<Ready>),
}

/// A scene, what was done to it, and its picture.
pub(super) struct Session {
    context: Arc<Context>,
    wake: Wake,
    pub(super) source: Source,
    /// As it was loaded.
    pub(super) scene: Scene,
    /// Its file, to be saved with edits; or why there is none.
    pub(super) text: std::result::Result<SceneText, String>,
    pub(super) document: Document,
    pub(super) history: History,
    /// From where it is seen, and how large the picture is.
    pub(super) camera: Camera,
    pub(super) exposure_stops: f32,
    /// Of direct and indirect light.
    pub(super) shares: [f32; 2],
    /// Things worth a line, the newest last.
    pub(super) said: Vec<String>,
    /// One of them that nobody must miss, and since when.
    pub(super) alarm: Option<(String, Instant)>,
    /// Counts pictures.
    pub(super) version: u64,
    pub(super) costs: VecDeque<Cost>,
    pub(super) last: Option<FrameReport>,
    /// A size of the picture that did not fit the device.
    pub(super) refused_size: Option<[u32; 2]>,
    /// The last frame took an edit back.
    pub(super) has_gone_back: bool,
    stage: Stage,
    shown: Option<Wanted>,
    files: Vec<(PathBuf, Option<SystemTime>)>,
}

impl Session {
    /// Begins with a scene: what can be seen at once, and the precomputation.
    pub(super) fn new(context: &Arc<Context>, source: Source, scene: Scene, wake: Wake) -> Result<Self> {
        let document = Document::of(&scene);
        Ok(Self {
            history: History::new(&document),
            document,
            camera: scene.cameras[0].clone(),
            exposure_stops: 0.0,
            shares: [1.0, 1.0],
            said: scene.warnings.clone(),
            alarm: None,
            version: 0,
            costs: VecDeque::new(),
            last: None,
            refused_size: None,
            has_gone_back: false,
            stage: Stage::Preparing(Box::new(Preparing::new(context, &scene, source.store.clone(), &wake)?)),
            shown: None,
            files: watched(&source.spec),
            text: SceneText::new(&source.spec, &source.options, &scene).map_err(|error| error.to_string()),
            context: context.clone(),
            wake,
            source,
            scene,
        })
    }

    /// The renderer, when it is ready.
    pub(super) fn renderer(&self) -> Option<&Renderer> {
        match &self.stage {
            Stage::Ready(ready) => Some(&ready.renderer),
            Stage::Preparing(_) => None,
        }
    }

    /// How far the precomputation is, and seconds since it began; none when it is done.
    pub(super) fn progress(&self) -> Option<(Progressed, f64)> {
        match &self.stage {
            Stage::Preparing(preparing) => {
                Some((preparing.progress()?, preparing.since.elapsed().as_secs_f64()))
            }
            Stage::Ready(_) => None,
        }
    }

    /// The picture as it is: sRGB codes R, G, B, 255, row by row from the top; and its size.
    pub(super) fn picture(&self) -> (&Buffer, [u32; 2]) {
        let size = self.shown.as_ref().map_or(self.camera.size, |shown| shown.camera.size);
        match &self.stage {
            Stage::Preparing(preparing) => (preparing.preview.display(), size),
            Stage::Ready(ready) => (ready.renderer.display_buffer(), size),
        }
    }

    /// Brings the picture into line with document and camera. True where it is another one.
    pub(super) fn update(&mut self) -> Result<bool> {
        if let Stage::Preparing(preparing) = &mut self.stage {
            match preparing.finished(self.scene.lights.len()) {
                Ok(Some(ready)) => {
                    let known = self.scene.warnings.len();
                    self.said.append(&mut preparing.said());
                    self.said.extend(ready.renderer.scene().warnings.iter().skip(known).cloned());
                    self.stage = Stage::Ready(Box::new(ready));
                    self.shown = None;
                }
                Ok(None) => (),
                Err(error) if error.is_out_of_memory() => self.alarm(format!("direct light only: {error}")),
                Err(error) => return Err(error),
            }
        }
        let wanted = self.wanted();
        if self.shown.as_ref() == Some(&wanted) {
            return Ok(false);
        }
        match (self.frame(&wanted), self.shown.clone()) {
            (Err(error), Some(shown)) if error.is_out_of_memory() => {
                self.go_back(shown);
                self.alarm(format!("taken back: {error}"));
                self.frame(&self.wanted())?;
            }
            (done, _) => done?,
        }
        self.shown = Some(self.wanted());
        self.version += 1;
        Ok(true)
    }

    /// Makes a picture of what is wanted.
    fn frame(&mut self, wanted: &Wanted) -> Result<()> {
        match &mut self.stage {
            Stage::Preparing(preparing) => preparing.frame(wanted, &self.scene.materials),
            Stage::Ready(ready) => {
                let (report, refused) = ready.frame(wanted, &mut self.document)?;
                self.said.extend(refused);
                if self.costs.len() == FRAMES {
                    self.costs.pop_front();
                }
                self.costs.push_back(Cost { columns: report.columns, frame_ms: report.frame_ms });
                self.last = Some(report);
                Ok(())
            }
        }
    }

    /// Says what nobody must miss.
    pub(super) fn alarm(&mut self, line: String) {
        self.said.push(line.clone());
        self.alarm = Some((line, Instant::now()));
    }

    /// What is wanted does not fit the device: what was shown last did.
    fn go_back(&mut self, shown: Wanted) {
        self.refuse_size(shown.camera.size);
        (self.document, self.camera) = (shown.document, shown.camera);
        self.history.refuse(&self.document);
        self.has_gone_back = true;
    }

    /// The picture keeps that size, and does not ask again for the one that it has, if that is another.
    pub(super) fn refuse_size(&mut self, fitting: [u32; 2]) {
        if self.camera.size != fitting {
            self.refused_size = Some(self.camera.size);
            self.camera.size = fitting;
        }
    }

    /// Works ahead, when there is nothing else to do.
    pub(super) fn rest(&mut self) -> Result<()> {
        match &mut self.stage {
            Stage::Ready(ready) => ready.rest(),
            Stage::Preparing(_) => Ok(()),
        }
    }

    /// Whether [`Self::rest`] has something to do.
    pub(super) fn is_behind(&self) -> bool {
        matches!(&self.stage, Stage::Ready(ready) if ready.is_behind())
    }

    /// Whether the files of the scene have changed since it was loaded, and stand still now.
    pub(super) fn files_changed(&mut self) -> bool {
        self.files.iter().any(|(file, time)| modified(file) != *time)
    }

    /// Loads the scene again. A scene that cannot be read is left alone, with a line that says why.
    pub(super) fn reload(&mut self) -> Result<()> {
        let Source { spec, options, .. } = self.source.clone();
        let loaded = Scene::load(&spec, &options);
        self.files = watched(&spec);
        match loaded {
            Ok(scene) => {
                self.replace(scene)?;
                self.said.push(format!("{spec} has changed and was loaded again"));
            }
            Err(error) => self.said.push(format!("not loaded again: {error}")),
        }
        Ok(())
    }

    /// Traces the light paths of the scene anew, with another preset; what was edited stays.
    pub(super) fn choose_preset(&mut self, preset: &str) -> Result<()> {
        let before = self.source.options.preset.replace(preset.to_owned());
        let scene = Scene::load(&self.source.spec, &self.source.options);
        let done = scene.and_then(|scene| self.prepare_again(scene));
        if done.is_err() {
            self.source.options.preset = before;
        }
        done
    }

    /// The same scene, to be prepared in another way; what was edited stays.
    pub(super) fn prepare_again(&mut self, scene: Scene) -> Result<()> {
        let (document, history) = (self.document.clone(), self.history.clone());
        self.replace(scene)?;
        (self.document, self.history) = (document, history);
        Ok(())
    }

    /// Another scene; the camera stays.
    fn replace(&mut self, scene: Scene) -> Result<()> {
        let next = Self::new(&self.context, self.source.clone(), scene, self.wake.clone())?;
        let before = std::mem::replace(self, next);
        (self.camera, self.exposure_stops, self.version) =
            (before.camera.clone(), before.exposure_stops, before.version);
        Ok(())
    }

    /// Whether something of the scene is another than in its file.
    pub(super) fn is_edited(&self) -> bool {
        self.document != Document::of(&self.scene)
    }

    /// What the picture shows.
    pub(super) fn shown(&self) -> Option<&Wanted> {
        self.shown.as_ref()
    }

    fn wanted(&self) -> Wanted {
        Wanted {
            document: self.document.clone(),
            camera: self.camera.clone(),
            exposure_stops: self.exposure_stops,
            shares: self.shares,
        }
    }
}

/// The files that a scene is made of, as far as they can be told, with the time of their last change.
fn watched(spec: &str) -> Vec<(PathBuf, Option<SystemTime>)> {
    let file = Path::new(spec);
    if !file.is_file() {
        return Vec::new();
    }
    let mut files = vec![file.to_owned()];
    let text = std::fs::read_to_string(file).unwrap_or_default();
    let models = text.parse::<toml_edit::DocumentMut>().ok();
    let models = models.as_ref().and_then(|toml| toml.get("model")?.as_array_of_tables());
    let named = models.into_iter().flatten().filter_map(|model| model.get("file")?.as_str());
    files.extend(named.map(|name| file.with_file_name(name)));
    // Materials stand beside their model, under its name more often than not.
    let materials: Vec<PathBuf> = files.iter().map(|file| file.with_extension("mtl")).collect();
    files.extend(materials);
    files.into_iter().map(|file| (file.clone(), modified(&file))).collect()
}

fn modified(file: &Path) -> Option<SystemTime> {
    std::fs::metadata(file).and_then(|about| about.modified()).ok()
}
