//! An open window: what it shows, frame by frame.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use egui::ViewportId;
use winit::dpi::PhysicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, EventLoopProxy};
use winit::window::{Fullscreen, Window};

use super::actions;
use super::cells;
use super::desk::{Desk, Request, View};
use super::files;
use super::films::{Player, Recorder};
use super::layered::Layered;
use super::overlays::Overlays;
use super::panels::{self, WIDTH};
use super::reference::Reference;
use super::session::{Session, Source};
use super::shortcuts;
use super::stage::Wake;
use super::viewport::{Textures, Viewport};
use super::window::Woken;
use super::{Demo, no_display};
use crate::app::note;
use crate::error::Result;
use crate::gpu::Context;
use crate::gpu::window::{Painting, PictureId, Shown, WindowPainter};
use crate::metrics::{debiased_relmse, half_noise};
use crate::renderer::Layer;
use crate::scene::Scene;

/// When a frame that the system did not take is offered again, and how often the precomputation is asked whether it is done.
const RETRY: Duration = Duration::from_millis(100);

/// How often the scene's files are looked at, and how long nothing must happen before work is done ahead.
const GLANCE: Duration = Duration::from_millis(1000);
const REST: Duration = Duration::from_millis(1000);

/// A window with all that it shows. Fields go in this order: what draws to the window goes before it.
pub(super) struct Open {
    session: Session,
    painter: WindowPainter,
    picture: PictureId,
    /// The picture that the painter has.
    shown: u64,
    /// Colours of cells; of which picture and level.
    over: Layered<(u64, u32)>,
    /// Monte Carlo.
    beside: Layered<()>,
    reference: Option<Reference>,
    player: Option<Player>,
    /// A film begins when the light paths are traced.
    plays_when_ready: bool,
    recorder: Option<Recorder>,
    /// The film that was recorded last.
    recorded: Option<PathBuf>,
    wake: Wake,
    viewport: Viewport,
    overlays: Overlays,
    desk: Desk,
    panels: egui_winit::State,
    /// When the panels want to be drawn again although nothing happens.
    pub(super) again: Option<Instant>,
    last_event: Instant,
    last_glance: Instant,
    is_hidden: bool,
    /// A button of the pointer is pressed.
    is_held: bool,
    is_quiet: bool,
    was_ready: bool,
    pub(super) context: Arc<Context>,
    pub(super) window: Arc<Window>,
}

impl Open {
    pub(super) fn new(
        events: &ActiveEventLoop,
        args: &Demo,
        source: Source,
        scene: Scene,
        proxy: &EventLoopProxy<Woken>,
    ) -> Result<Self> {
        let [width, height] = args.scene_args.size().unwrap_or(scene.cameras[0].size);
        let with_panels = |scale: f64| PhysicalSize::new(width + (f64::from(WIDTH) * scale) as u32, height);
        let attributes = Window::default_attributes()
            .with_title(format!("{} – lightpaths", scene.name))
            .with_fullscreen(args.fullscreen.then_some(Fullscreen::Borderless(None)))
            .with_inner_size(with_panels(1.0));
        let window = events.create_window(attributes).map_err(|error| no_display(&error.to_string()))?;
        if window.scale_factor() != 1.0 && !args.fullscreen {
            // How large panels are is known only where the window is. What the system does not grant stays as it is.
            let _ = window.request_inner_size(with_panels(window.scale_factor()));
        }
        let window = Arc::new(window);
        let (context, surface) = Context::for_window(&args.device_args.context_options(), &window)?;
        let PhysicalSize { width, height } = window.inner_size();
        let mut painter = WindowPainter::new(surface, [width, height], !args.no_vsync)?;
        let picture = painter.add_picture([1, 1])?;
        let proxy = proxy.clone();
        let wake: Wake = Arc::new(move || {
            // Where the window is gone, nobody wants to know.
            let _ = proxy.send_event(Woken);
        });
        let mut desk = Desk::new(&scene.name);
        desk.vsync = !args.no_vsync;
        let session = Session::new(&context, source, scene, wake.clone())?;
        let egui = egui::Context::default();
        egui.set_theme(egui::Theme::Dark);
        let panels = egui_winit::State::new(egui, ViewportId::ROOT, &window, None, window.theme(), None);
        let now = Instant::now();
        Ok(Self {
            session,
            painter,
            picture,
            shown: 0,
            over: Layered::new(),
            beside: Layered::new(),
            reference: None,
            player: None,
            plays_when_ready: false,
            recorder: None,
            recorded: None,
            wake,
            viewport: Viewport::new(),
            overlays: Overlays::default(),
            desk,
            panels,
            again: None,
            last_event: now,
            last_glance: now,
            is_hidden: false,
            is_held: false,
            is_quiet: args.device_args.is_quiet(),
            was_ready: false,
            context,
            window,
        })
    }

    /// False where the window is to close.
    pub(super) fn on_event(&mut self, event: &WindowEvent) -> Result<bool> {
        let response = self.panels.on_window_event(&self.window, event);
        // The panels want to be drawn when they are: that is no event.
        if response.repaint && !matches!(event, WindowEvent::RedrawRequested) {
            self.last_event = Instant::now();
            self.window.request_redraw();
        }
        match event {
            WindowEvent::CloseRequested | WindowEvent::Destroyed => return Ok(false),
            WindowEvent::Resized(PhysicalSize { width, height }) => self.painter.resize([*width, *height]),
            WindowEvent::Occluded(is_hidden) => self.is_hidden = *is_hidden,
            WindowEvent::RedrawRequested if !self.is_hidden => return self.draw(),
            _ => (),
        }
        Ok(true)
    }

    /// What is done between events; returns when to look again.
    pub(super) fn idle(&mut self) -> Result<Instant> {
        let now = Instant::now();
        if now >= self.last_glance + GLANCE {
            self.last_glance = now;
            if self.session.files_changed() {
                (self.player, self.recorder, self.was_ready) = (None, None, false);
                (self.desk.is_playing, self.desk.is_recording) = (false, false);
                self.session.reload()?;
                self.window.request_redraw();
            }
        }
        let mut next = self.last_glance + GLANCE;
        if self.session.is_behind() && !self.is_held {
            if now >= self.last_event + REST {
                self.session.rest()?;
            } else {
                next = next.min(self.last_event + REST);
            }
        }
        let again = self.again.filter(|_| !self.is_hidden);
        Ok(again.map_or(next, |again| next.min(again)))
    }

    /// One frame: panels first, for what they change is to be seen in it.
    fn draw(&mut self) -> Result<bool> {
        let input = self.panels.take_egui_input(&self.window);
        let egui = self.panels.egui_ctx().clone();
        self.play()?;
        self.follow_reference()?;
        let textures = Textures {
            picture: self.painter.texture(self.picture),
            over: self.over.texture(&self.painter),
            beside: self.beside.texture(&self.painter),
        };
        let mut shown = Ok(());
        let output = egui.run_ui(input, |ui| {
            let types = ui.ctx().egui_wants_keyboard_input();
            for action in ui.input_mut(|input| shortcuts::pressed(input, types)) {
                actions::act(action, &mut self.session, &mut self.desk, &mut self.viewport);
            }
            if self.desk.shows_panels {
                egui::Panel::right("panels")
                    .default_size(WIDTH)
                    .show(ui, |ui| panels::panels(ui, &mut self.session, &mut self.desk));
            }
            let (session, desk, overlays) = (&mut self.session, &mut self.desk, &mut self.overlays);
            shown = self.viewport.show(ui, session, desk, overlays, textures);
            panels::help(ui.ctx(), &mut self.desk.shows_help);
        });
        shown?;
        self.is_held = egui.input(|input| input.pointer.any_down());
        // A film is no edit.
        let is_settled = !self.is_held && !egui.egui_wants_keyboard_input() && self.player.is_none();
        if is_settled && self.session.history.settle(&self.session.document) {
            self.window.request_redraw();
        }
        if egui.zoom_factor() != self.desk.text_scale {
            egui.set_zoom_factor(self.desk.text_scale);
        }
        self.session.shares = self.desk.view.shares();
        if self.session.update()? {
            // What it cost can be said in the next frame.
            self.window.request_redraw();
        }
        if self.shown != self.session.version {
            self.shown = self.session.version;
            let (pixels, size) = self.session.picture();
            self.painter.resize_picture(self.picture, size)?;
            self.painter.show(self.picture, pixels);
        }
        if let Some(recorder) = &mut self.recorder {
            recorder.note(&self.session);
        }
        self.colour_cells()?;
        let delay = output.viewport_output.get(&ViewportId::ROOT).map(|viewport| viewport.repaint_delay);
        self.again = delay.and_then(|delay| Instant::now().checked_add(delay));
        let painting = Painting {
            primitives: egui.tessellate(output.shapes, output.pixels_per_point),
            textures: output.textures_delta,
            pixels_per_point: output.pixels_per_point,
            background: [0.01; 3],
        };
        self.panels.handle_platform_output(&self.window, output.platform_output);
        self.window.pre_present_notify();
        let shown = self.painter.paint(painting, &self.window)?;
        if shown == Shown::NotNow || self.session.progress().is_some() {
            // The worker's last word may come before it is done.
            let soon = Instant::now() + RETRY;
            self.again = Some(self.again.map_or(soon, |again| again.min(soon)));
        }
        if shown == Shown::Yes && !self.was_ready && self.session.renderer().is_some() {
            self.was_ready = true;
            if !self.is_quiet {
                note("lightpaths: ready\n");
            }
            self.window.request_redraw();
        }
        let requests = std::mem::take(&mut self.desk.requests);
        for request in requests {
            if !self.fulfil(request)? {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// False where the window is to close.
    fn fulfil(&mut self, request: Request) -> Result<bool> {
        match request {
            Request::Quit => return Ok(false),
            Request::Vsync => {
                self.desk.vsync = !self.desk.vsync;
                self.painter.set_vsync(self.desk.vsync);
            }
            Request::Fullscreen => {
                let fills = self.window.fullscreen().is_some();
                self.window.set_fullscreen((!fills).then_some(Fullscreen::Borderless(None)));
            }
            Request::Memory => self.say_memory(),
            Request::Save => {
                let saved = files::save_scene(&self.session, &self.desk.save_to);
                self.say(saved);
            }
            Request::Screenshot => {
                let saved = files::save_picture(&self.session, &self.desk.save_to);
                self.say(saved);
            }
            Request::Record => self.record(),
            Request::Play => self.play_or_stop()?,
            Request::Preset(preset) => {
                self.session.choose_preset(preset)?;
                self.was_ready = false;
            }
        }
        self.window.request_redraw();
        Ok(true)
    }

    /// What became of something that may fail without harm.
    fn say(&mut self, done: Result<String>) {
        self.session.said.push(done.unwrap_or_else(|error| error.to_string()));
    }

    fn record(&mut self) {
        match self.recorder.take() {
            None => self.recorder = Some(Recorder::begin(&self.session)),
            Some(recorder) => {
                let saved = recorder.end(&self.session, &self.desk.save_to);
                self.recorded = saved.as_ref().ok().cloned().or(self.recorded.take());
                self.say(saved.map(|path| format!("saved {}", path.display())));
            }
        }
        self.desk.is_recording = self.recorder.is_some();
    }

    fn play_or_stop(&mut self) -> Result<()> {
        match self.player.take() {
            Some(player) => player.end(&mut self.session),
            None => match Player::begin(&self.session, self.recorded.as_deref()) {
                Ok((player, None)) => self.player = Some(player),
                Ok((_, Some(scene))) => {
                    // It plays when its light paths are traced.
                    self.session.prepare_again(scene)?;
                    (self.plays_when_ready, self.was_ready) = (true, false);
                }
                Err(error) => self.say(Err(error)),
            },
        }
        self.desk.is_playing = self.player.is_some();
        Ok(())
    }

    /// Brings a film that plays to where it is now.
    fn play(&mut self) -> Result<()> {
        if self.plays_when_ready && self.was_ready {
            self.plays_when_ready = false;
            self.play_or_stop()?;
        }
        let Some(player) = &self.player else { return Ok(()) };
        if player.advance(&mut self.session) {
            self.window.request_redraw();
            Ok(())
        } else {
            self.play_or_stop()
        }
    }

    /// Monte Carlo, where it is to be seen: for what is shown, and the newest picture of it.
    fn follow_reference(&mut self) -> Result<()> {
        if self.desk.split.is_none() {
            (self.reference, self.beside.of, self.desk.verdict) = (None, None, None);
            return Ok(());
        }
        if self.session.renderer().is_none() {
            return Ok(());
        }
        if self.reference.is_none() {
            self.reference = Some(Reference::new(&self.context, &self.wake)?);
        }
        let Some(reference) = &mut self.reference else { return Ok(()) };
        if reference.follow(&self.session) {
            (self.beside.of, self.desk.verdict) = (None, None);
        }
        let Some(found) = reference.found()? else { return Ok(()) };
        let pixels = found.display(self.session.exposure_stops);
        self.beside.show(&self.context, &mut self.painter, (), found.size, &pixels)?;
        let ours = match self.session.renderer() {
            Some(renderer) if renderer.size() == found.size => renderer.layer(Layer::Beauty)?,
            _ => return Ok(()),
        };
        let halves = [&found.halves[0][..], &found.halves[1][..]];
        self.desk.verdict = Some((found.samples, debiased_relmse(&ours, halves), half_noise(halves)));
        Ok(())
    }

    /// Colours of the cells that the picture's surfaces lie in, where they are to be seen.
    fn colour_cells(&mut self) -> Result<()> {
        let (View::Cells(level), Some(renderer)) = (self.desk.view, self.session.renderer()) else {
            self.over.of = None;
            return Ok(());
        };
        let of = (self.session.version, level);
        if self.over.of != Some(of) {
            let pixels = cells::colours(renderer, level, self.session.exposure_stops)?;
            self.over.show(&self.context, &mut self.painter, of, renderer.size(), &pixels)?;
            self.window.request_redraw();
        }
        Ok(())
    }

    pub(super) fn say_memory(&self) {
        note(&format!("lightpaths: device memory {} bytes\n", self.context.memory().current_bytes));
    }
}
