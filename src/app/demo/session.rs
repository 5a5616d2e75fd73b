//! The scene that is shown, with all that is known of it.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Instant;

use super::document::{Document, History};
use super::rebase::Rebase;
use super::stage::{Preparing, Progressed, Ready, Wake};
use super::watch::Watch;
use crate::error::{Error, Result};
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
    /// Time on the clock, milliseconds.
    pub(super) frame_ms: f64,
}

/// What a picture depends on.
#[derive(Clone, PartialEq)]
pub(super) struct ViewRequest {
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
    /// As it is in a file: the scene's, or where it was saved last.
    saved: Document,
    pub(super) watch: Watch,
    /// The scene has changed on disk, there are edits that no file holds, and the user has
    /// not chosen yet.
    pub(super) is_asked: bool,
    /// From where it is seen, and how large the picture is.
    pub(super) camera: Camera,
    pub(super) exposure_stops: f32,
    /// Of direct and indirect light.
    pub(super) shares: [f32; 2],
    /// Things worth a line, the newest last.
    pub(super) said: Vec<String>,
    /// One of them that nobody must miss, and since when.
    pub(super) alarm: Option<(String, Instant)>,
    /// Number of the picture that is shown.
    pub(super) version: u64,
    pub(super) costs: VecDeque<Cost>,
    pub(super) last: Option<FrameReport>,
    /// A size of the picture that did not fit the device.
    pub(super) refused_size: Option<[u32; 2]>,
    /// The last frame took an edit back.
    pub(super) has_gone_back: bool,
    stage: Stage,
    shown: Option<ViewRequest>,
}

impl Session {
    /// Begins with a scene: what can be seen at once, and the precomputation. `watch`: its files
    /// before they were read.
    pub(super) fn new(
        context: &Arc<Context>,
        source: Source,
        scene: Scene,
        watch: Watch,
        wake: Wake,
    ) -> Result<Self> {
        let document = Document::of(&scene);
        Ok(Self {
            history: History::new(&document),
            saved: document.clone(),
            watch,
            is_asked: false,
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
        let requested = self.requested();
        if self.shown.as_ref() == Some(&requested) {
            return Ok(false);
        }
        match (self.frame(&requested), self.shown.clone()) {
            (Err(error), Some(shown)) if error.is_out_of_memory() => {
                self.go_back(shown);
                self.alarm(format!("taken back: {error}"));
                self.frame(&self.requested())?;
            }
            (done, _) => done?,
        }
        self.shown = Some(self.requested());
        self.version += 1;
        Ok(true)
    }

    /// Makes a picture of what is requested.
    fn frame(&mut self, requested: &ViewRequest) -> Result<()> {
        match &mut self.stage {
            Stage::Preparing(preparing) => preparing.frame(requested, &self.scene.materials),
            Stage::Ready(ready) => {
                let (report, refused) = ready.frame(requested, &mut self.document)?;
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

    /// What is requested does not fit the device: what was shown last did.
    fn go_back(&mut self, shown: ViewRequest) {
        self.refuse_size(shown.camera.size);
        (self.document, self.camera) = (shown.document, shown.camera);
        self.history.refuse(&self.document);
        self.has_gone_back = true;
    }

    /// The picture keeps that size, and does not ask again for the one that it has, if
    /// that is another.
    pub(super) fn refuse_size(&mut self, fitting: [u32; 2]) {
        if self.camera.size != fitting {
            self.refused_size = Some(self.camera.size);
            self.camera.size = fitting;
        }
    }

    /// Works ahead, when there is nothing else to do.
    pub(super) fn run_idle_work(&mut self) -> Result<()> {
        match &mut self.stage {
            Stage::Ready(ready) => ready.run_idle_work(),
            Stage::Preparing(_) => Ok(()),
        }
    }

    /// Whether [`Self::run_idle_work`] has something to do.
    pub(super) fn is_behind(&self) -> bool {
        matches!(&self.stage, Stage::Ready(ready) if ready.is_behind())
    }

    /// Loads the scene again; what was before is one step back. Returns how what was edited is
    /// found in it. `None` if it cannot be read: everything then stays, and a note says why.
    pub(super) fn reload(&mut self) -> Result<Option<Rebase>> {
        let Source { spec, options, .. } = self.source.clone();
        let watch = Watch::new(&spec);
        let scene = match Scene::load(&spec, &options) {
            Ok(scene) => scene,
            Err(error) => {
                self.said.push(not_loaded(&error));
                return Ok(None);
            }
        };
        let rebase = Rebase::new(&self.scene, &scene);
        let (document, mut history) = (self.document.clone(), self.history.clone());
        self.replace(scene, watch, &rebase)?;
        history.reload(&document, |document| rebase.document(document), &self.document);
        self.history = history;
        Ok(Some(rebase))
    }

    /// Why the scene's files, as they are now, cannot be loaded. `None` if they can.
    pub(super) fn why_unloadable(&self) -> Option<String> {
        Scene::load(&self.source.spec, &self.source.options).err().map(|error| not_loaded(&error))
    }

    /// Traces the light paths of the scene anew, with another preset; what was edited stays.
    ///
    /// # Errors
    /// Files that have changed since they were read are a question of their own;
    /// and as [`Scene::load`].
    pub(super) fn choose_preset(&mut self, preset: &str) -> Result<()> {
        if self.is_asked || !self.watch.is_as_read() {
            return Err(Error::Usage(format!("{} {CHANGED}", self.source.spec)));
        }
        let before = self.source.options.preset.replace(preset.to_owned());
        let watch = Watch::new(&self.source.spec);
        let scene = Scene::load(&self.source.spec, &self.source.options);
        let done = scene.and_then(|scene| self.prepare_again(scene, watch));
        if done.is_err() {
            self.source.options.preset = before;
        }
        done
    }

    /// The scene of the same file, to be prepared in another way; what was edited stays. `watch`:
    /// its files before they were read.
    fn prepare_again(&mut self, scene: Scene, watch: Watch) -> Result<()> {
        let rebase = Rebase::new(&self.scene, &scene);
        let (document, saved) = (rebase.document(&self.document), rebase.document(&self.saved));
        let (mut history, is_asked) = (self.history.clone(), self.is_asked);
        history.rebase(|document| rebase.document(document));
        self.replace(scene, watch, &rebase)?;
        (self.document, self.saved, self.history) = (document, saved, history);
        self.is_asked = is_asked;
        Ok(())
    }

    /// The open scene, in which a film makes more materials glossy.
    pub(super) fn prepare_for_film(&mut self, scene: Scene) -> Result<()> {
        let (watch, text) = (self.watch.clone(), self.text.clone());
        self.prepare_again(scene, watch)?;
        self.text = text;
        Ok(())
    }

    /// Another scene; the camera stays, and so does what was said.
    fn replace(&mut self, scene: Scene, watch: Watch, rebase: &Rebase) -> Result<()> {
        let next = Self::new(&self.context, self.source.clone(), scene, watch, self.wake.clone())?;
        let before = std::mem::replace(self, next);
        self.camera = rebase.camera(&before.camera);
        (self.exposure_stops, self.version, self.alarm) =
            (before.exposure_stops, before.version, before.alarm.clone());
        let new = std::mem::replace(&mut self.said, before.said.clone());
        self.said.extend(new.into_iter().filter(|line| !before.said.contains(line)));
        Ok(())
    }

    /// Whether lights or materials are others than in any file that was loaded or saved last.
    pub(super) fn has_unsaved_edits(&self) -> bool {
        self.document != self.saved
    }

    /// A file holds the scene as it is now.
    pub(super) fn take_as_saved(&mut self) {
        self.saved = self.document.clone();
    }

    /// What the picture shows.
    pub(super) fn shown(&self) -> Option<&ViewRequest> {
        self.shown.as_ref()
    }

    fn requested(&self) -> ViewRequest {
        ViewRequest {
            document: self.document.clone(),
            camera: self.camera.clone(),
            exposure_stops: self.exposure_stops,
            shares: self.shares,
        }
    }
}

/// What is said of a scene whose files are not as they were read, where that stands in the way.
pub(super) const CHANGED: &str = "has changed on disk: load it again or keep yours first";

fn not_loaded(error: &Error) -> String {
    format!("not loaded again: {error}")
}
