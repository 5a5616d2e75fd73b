//! An open window and its frame loop.

mod disk;
mod host_pictures;
mod opening;
mod requests;
mod shaders;
mod snapshots;

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use egui::ViewportId;
use winit::dpi::PhysicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, EventLoopProxy};
use winit::window::{Fullscreen, Window};

use super::actions;
use super::autosave::Autosave;
use super::canvas::Textures;
use super::dialogs::Dialogs;
use super::films::{FilmRecorder, Player};
use super::host_picture::HostPicture;
use super::overlays::Overlays;
use super::panels::{self, WIDTH};
use super::pointer::release_lost_buttons;
use super::recent::Recent;
use super::reference::Reference;
use super::session::Session;
use super::shader_sources::ShaderSources;
use super::shortcuts;
use super::stage::Wake;
use super::start::{Demo, Start, WakeUp, no_display};
use super::ui_state::{Beside, UiState};
use super::viewport::Viewport;
use crate::app::false_colours::{Quantity, Scale};
use crate::app::note;
use crate::error::Result;
use crate::gpu::window::{FRAMES, Painting, PictureId, Shown, WindowPainter};
use crate::gpu::{Context, Recorder};
use crate::scene::DisplayTransform;

/// Delay before a frame is presented again that the system did not take. Also the polling period
/// of the precomputation.
const RETRY: Duration = Duration::from_millis(100);

/// Polling period of the scene's files, and the time without events after which idle work starts.
const GLANCE: Duration = Duration::from_millis(500);
const REST: Duration = Duration::from_millis(1000);

/// Polling period of frames that the device computes.
const DEVICE: Duration = Duration::from_millis(2);

/// Size of the picture before the first one exists.
const NO_PICTURE: [u32; 2] = [1, 1];

/// What the colours over the picture show.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Over {
    /// Cells of a level, in the picture of a version.
    Cells(u64, u32),
    /// Illuminance or luminance in that picture.
    Light(u64, Quantity, Scale),
}

/// A window with its session, painter and panels. Fields drop in order: the painter goes
/// before the window.
pub(super) struct WindowState {
    session: Session,
    shaders: Option<ShaderSources>,
    painter: WindowPainter,
    picture: PictureId,
    /// Version of the picture that the painter has.
    shown: u64,
    /// Colours of cells, with the picture version and the level that they show.
    over: HostPicture<Over>,
    /// Stripes on pixels without detail, in the picture of a version.
    zebra: HostPicture<u64>,
    /// The picture beside ours, and how its radiance is displayed.
    beside: HostPicture<(Beside, DisplayTransform)>,
    reference: Option<Reference>,
    /// A stopped tracer that finishes its last samples.
    leaving: Option<Reference>,
    player: Option<Player>,
    /// A film starts when the light paths are traced.
    plays_when_ready: bool,
    recorder: Option<FilmRecorder>,
    /// The film that was recorded last.
    recorded: Option<PathBuf>,
    wake: Wake,
    viewport: Viewport,
    overlays: Overlays,
    ui_state: UiState,
    dialogs: Dialogs,
    autosave: Autosave,
    panels: egui_winit::State,
    /// When the panels need to be drawn without an event.
    pub(super) again: Option<Instant>,
    last_event: Instant,
    last_glance: Instant,
    is_hidden: bool,
    /// A pointer button is pressed.
    is_held: bool,
    is_quiet: bool,
    /// The title marks unsaved edits.
    is_marked: bool,
    was_ready: bool,
    /// The session's generation that was announced last.
    announced: u64,
    /// A script waits until the window is up to date.
    is_asked_to_settle: bool,
    pub(super) context: Arc<Context>,
    pub(super) window: Arc<Window>,
}

impl WindowState {
    pub(super) fn new(
        events: &ActiveEventLoop,
        args: &Demo,
        (source, scene, watch): Start,
        shaders: Option<ShaderSources>,
        proxy: &EventLoopProxy<WakeUp>,
    ) -> Result<Self> {
        let [width, height] = args.scene_args.size().unwrap_or(scene.cameras[0].size);
        let with_panels = |scale: f64| PhysicalSize::new(width + (f64::from(WIDTH) * scale) as u32, height);
        let attributes = Window::default_attributes()
            .with_title(format!("{} – lightpaths", scene.name))
            .with_fullscreen(args.fullscreen.then_some(Fullscreen::Borderless(None)))
            .with_inner_size(with_panels(1.0));
        let window = events.create_window(attributes).map_err(|error| no_display(&error.to_string()))?;
        if window.scale_factor() != 1.0 && !args.fullscreen {
            // The size of panels depends on the window's scale. If the system refuses the size, the
            // window keeps its own.
            let _ = window.request_inner_size(with_panels(window.scale_factor()));
        }
        let window = Arc::new(window);
        let (context, surface) = Context::for_window(&args.device_args.context_options(), &window)?;
        args.device_args.report_tuning(&context);
        let PhysicalSize { width, height } = window.inner_size();
        let mut painter = WindowPainter::new(surface, [width, height], !args.no_vsync)?;
        let picture = painter.add_picture(NO_PICTURE)?;
        let proxy = proxy.clone();
        let wake: Wake = Arc::new(move || {
            // The send fails after the window has closed, which needs no report.
            let _ = proxy.send_event(WakeUp::Shows);
        });
        let mut ui_state = UiState::new(&scene.name, Recent::new(&source.spec));
        ui_state.vsync = !args.no_vsync;
        let autosave = Autosave::new(&source.spec);
        ui_state.asks_to_restore = autosave.found().is_some();
        if ui_state.asks_to_restore && !args.device_args.is_quiet() {
            note(&format!(
                "lightpaths: {} has edits of the last time that were not saved; they wait for an answer",
                source.spec
            ));
        }
        let session = Session::new(&context, source, scene, watch, wake.clone())?;
        let egui = egui::Context::default();
        egui.set_theme(egui::Theme::Dark);
        // egui times a click at frame ends: at one frame a second, a short click takes a second.
        egui.options_mut(|options| options.input_options.max_click_duration = f64::INFINITY);
        let panels = egui_winit::State::new(egui, ViewportId::ROOT, &window, None, window.theme(), None);
        let now = Instant::now();
        Ok(Self {
            session,
            shaders,
            painter,
            picture,
            shown: 0,
            over: HostPicture::new(),
            zebra: HostPicture::new(),
            beside: HostPicture::new(),
            reference: None,
            leaving: None,
            player: None,
            plays_when_ready: false,
            recorder: None,
            recorded: None,
            wake,
            viewport: Viewport::new(),
            overlays: Overlays::default(),
            ui_state,
            dialogs: Dialogs::new(),
            autosave,
            panels,
            again: None,
            last_event: now,
            last_glance: now,
            is_hidden: false,
            is_held: false,
            is_quiet: args.device_args.is_quiet(),
            is_marked: false,
            was_ready: false,
            announced: 0,
            is_asked_to_settle: false,
            context,
            window,
        })
    }

    /// Returns false if the window must close.
    pub(super) fn on_event(&mut self, event: &WindowEvent) -> Result<bool> {
        let response = self.panels.on_window_event(&self.window, event);
        release_lost_buttons(&mut self.panels, event);
        // A redraw is not a user event.
        if response.repaint && !matches!(event, WindowEvent::RedrawRequested) {
            self.last_event = Instant::now();
            self.window.request_redraw();
        }
        match event {
            WindowEvent::CloseRequested => return Ok(!self.close_when_drawn()),
            WindowEvent::Destroyed => {
                self.rescue();
                return Ok(false);
            }
            WindowEvent::Resized(PhysicalSize { width, height }) => self.painter.resize([*width, *height]),
            WindowEvent::DroppedFile(path) => actions::drop_file(&mut self.session, &mut self.ui_state, path),
            WindowEvent::Occluded(is_hidden) => self.is_hidden = *is_hidden,
            WindowEvent::RedrawRequested if !self.is_hidden => return self.draw(),
            _ => (),
        }
        Ok(true)
    }

    /// Does the work between events; returns the time of the next check.
    pub(super) fn idle(&mut self) -> Result<Instant> {
        let now = Instant::now();
        if now >= self.last_glance + GLANCE {
            self.last_glance = now;
            let glanced = self.glance();
            self.tolerate(glanced)?;
        }
        let reloaded = self.follow_shaders(now);
        self.tolerate(reloaded)?;
        let mut next = self.last_glance + GLANCE;
        if let Some(shaders) = &self.shaders {
            next = next.min(shaders.next);
        }
        if self.session.end_frames(usize::MAX)? {
            // The panel shows the frame's cost.
            self.window.request_redraw();
        }
        if self.was_ready
            && let Some(line) = self.session.metered.take()
        {
            if !self.is_quiet {
                note(&format!("lightpaths: {line}"));
            }
            self.session.said.push(line);
        }
        if self.session.is_computing() {
            next = next.min(now + DEVICE);
        }
        if self.session.is_behind() && !self.is_held && !self.is_hidden {
            if now >= self.last_event + REST {
                self.window.request_redraw();
            } else {
                next = next.min(self.last_event + REST);
            }
        }
        let again = self.again.filter(|_| !self.is_hidden);
        Ok(again.map_or(next, |again| next.min(again)))
    }

    /// Draws one frame. Panels run first, so that it shows their changes.
    fn draw(&mut self) -> Result<bool> {
        self.session.end_frames(FRAMES - 1)?;
        let begun = Instant::now();
        self.play()?;
        let followed = self.follow_reference();
        self.tolerate(followed)?;
        let output = self.run_panels()?;
        self.follow_differences();
        self.entitle();
        self.save_edits();
        let commands = self.record_frame()?;
        let is_new = self.shown != self.session.version;
        if is_new {
            self.shown = self.session.version;
            self.hang_picture()?;
        }
        if let Some(recorder) = &mut self.recorder {
            recorder.note(&self.session);
        }
        let commands = self.submit_before_colours(commands)?;
        let coloured = self.colour_over();
        self.tolerate(coloured)?;
        let measured = self.follow_levels();
        self.tolerate(measured)?;
        let measured = self.follow_readings();
        self.tolerate(measured)?;
        let found = self.follow_contributions();
        self.tolerate(found)?;
        let shown = self.paint(output, commands)?;
        self.settle(shown == Shown::Yes && !is_new);
        if is_new {
            self.session.wait_for_device(begun.elapsed())?;
        }
        let requests = std::mem::take(&mut self.ui_state.requests);
        for request in requests {
            if !self.fulfil(request)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Runs the panels and the viewport, which edit the document.
    fn run_panels(&mut self) -> Result<egui::FullOutput> {
        let input = self.panels.take_egui_input(&self.window);
        let egui = self.panels.egui_ctx().clone();
        let textures = Textures {
            picture: self.painter.texture(self.picture),
            over: self.over.texture(&self.painter),
            zebra: self.zebra.texture(&self.painter),
            beside: self.beside.texture(&self.painter),
        };
        let mut shown = Ok(());
        let output = egui.run_ui(input, |ui| {
            self.ui_state.is_in_dialog = self.dialogs.is_open();
            let types = ui.ctx().egui_wants_keyboard_input() || self.ui_state.is_in_dialog;
            for action in ui.input_mut(|input| shortcuts::pressed(input, types)) {
                actions::act(action, &mut self.session, &mut self.ui_state, &mut self.viewport);
            }
            if self.ui_state.shows_panels {
                egui::Panel::right("panels")
                    .default_size(WIDTH)
                    .show(ui, |ui| panels::panels(ui, &mut self.session, &mut self.ui_state));
            }
            let (session, ui_state, overlays) = (&mut self.session, &mut self.ui_state, &mut self.overlays);
            shown = self.viewport.show(ui, session, ui_state, overlays, textures);
            panels::help(ui.ctx(), &mut self.ui_state.shows_help);
            panels::alarm(ui.ctx(), &mut self.session);
            panels::questions(ui.ctx(), &self.session, &mut self.ui_state);
            if let Some((purpose, path)) = self.dialogs.show(ui.ctx()) {
                actions::take_file(&mut self.session, &mut self.ui_state, purpose, &path);
            }
        });
        self.tolerate(shown)?;
        self.is_held = egui.input(|input| input.pointer.any_down());
        self.session.is_held = self.is_held;
        self.session.paints = self.ui_state.meters.paints;
        // The changes that a film makes are no edits.
        let is_settled = !self.is_held && !egui.egui_wants_keyboard_input() && self.player.is_none();
        if is_settled && self.session.history.settle(&self.session.document) {
            self.window.request_redraw();
        }
        if egui.zoom_factor() != self.ui_state.text_scale {
            egui.set_zoom_factor(self.ui_state.text_scale);
        }
        self.session.weights = self.ui_state.view.weights();
        self.session.times_passes = self.ui_state.times_passes;
        self.session.may_mix = self.ui_state.shows_picture_alone();
        Ok(output)
    }

    /// Paints panels and picture with the commands that compute it, and presents them. Plans when
    /// to draw next.
    fn paint(&mut self, output: egui::FullOutput, commands: Option<Recorder>) -> Result<Shown> {
        let delay = output.viewport_output.get(&ViewportId::ROOT).map(|viewport| viewport.repaint_delay);
        self.again = delay.and_then(|delay| Instant::now().checked_add(delay));
        let painting = Painting {
            primitives: self.panels.egui_ctx().tessellate(output.shapes, output.pixels_per_point),
            textures: output.textures_delta,
            pixels_per_point: output.pixels_per_point,
            background: [0.01; 3],
        };
        self.panels.handle_platform_output(&self.window, output.platform_output);
        self.window.pre_present_notify();
        let session = &mut self.session;
        let shown = self
            .painter
            .paint(painting, &self.window, commands, &mut |in_flight| session.check(in_flight))?;
        if std::mem::take(&mut self.session.has_gone_back) {
            // Otherwise the drag would request the refused state again.
            self.viewport.let_go();
            self.window.request_redraw();
        }
        if shown == Shown::NotNow || self.session.progress().is_some() || self.leaving.is_some() {
            // A worker sends its last event before its thread ends.
            let soon = Instant::now() + RETRY;
            self.again = Some(self.again.map_or(soon, |again| again.min(soon)));
        }
        if shown == Shown::Yes && self.session.generation > self.announced {
            self.announced = self.session.generation;
            if self.session.progress().is_some() && !self.is_quiet {
                note("lightpaths: draft");
            }
        }
        self.was_ready &= self.session.progress().is_none();
        let is_ready = self.session.progress().is_none() && self.session.renderer().is_some();
        if shown == Shown::Yes && !self.was_ready && is_ready {
            self.was_ready = true;
            if !self.is_quiet {
                note("lightpaths: ready");
            }
            self.window.request_redraw();
        }
        Ok(shown)
    }

    /// Records a new picture, or else idle work that is due.
    fn record_frame(&mut self) -> Result<Option<Recorder>> {
        if let Some(commands) = self.session.update()? {
            return Ok(Some(commands));
        }
        if self.is_held || Instant::now() < self.last_event + REST {
            return Ok(None);
        }
        match self.session.idle_work() {
            Err(error) => self.tolerate(Err(error)).map(|()| None),
            commands => commands,
        }
    }

    /// Submits the commands of a picture by themselves if the window shows colours, stripes or a
    /// histogram: the host reads values before it draws.
    fn submit_before_colours(&mut self, commands: Option<Recorder>) -> Result<Option<Recorder>> {
        match commands {
            Some(commands) if self.ui_state.reads_picture() => {
                let session = &mut self.session;
                self.painter.run(commands, &mut |in_flight| session.check(in_flight))?;
                Ok(None)
            }
            commands => Ok(commands),
        }
    }

    /// Gives the picture to the painter. If the device lacks memory for it, the picture returns to
    /// its previous size.
    fn hang_picture(&mut self) -> Result<()> {
        let (pixels, size) = self.session.picture();
        match self.painter.resize_picture(self.picture, size) {
            Ok(()) => self.painter.show(self.picture, pixels),
            Err(error)
                if error.is_out_of_memory() && self.painter.picture_size(self.picture) != NO_PICTURE =>
            {
                self.session.refuse_size(self.painter.picture_size(self.picture));
                self.session.alarm(format!("taken back: {error}"));
                self.window.request_redraw();
            }
            Err(error) => return Err(error),
        }
        Ok(())
    }

    pub(super) fn say_memory(&self) {
        note(&format!("lightpaths: device memory {} bytes", self.context.memory().current_bytes));
        let (frames, submissions) = (self.painter.presented(), self.context.submission_count());
        note(&format!("lightpaths: frames {frames} submissions {submissions}"));
    }
}
