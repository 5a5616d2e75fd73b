//! The event loop of the window.

use std::sync::mpsc::sync_channel;
use std::time::{Duration, Instant};

use winit::application::ApplicationHandler;
use winit::event::{StartCause, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoopProxy};
use winit::window::WindowId;

use super::shader_sources::ShaderSources;
use super::start::{Demo, Start, WakeUp};
use super::window_state::WindowState;
use crate::app::interrupt;
use crate::error::{Error, Result};

/// Time limit for saving edits after a signal: long enough for a frame on a slow device of
/// a busy machine.
const TO_KEEP: Duration = Duration::from_secs(30);

/// Saves an edited scene before a signal ends the program.
pub(super) fn keep_edits(proxy: EventLoopProxy<WakeUp>) {
    interrupt::before_end(move || {
        let (kept, answer) = sync_channel(1);
        if proxy.send_event(WakeUp::Ends(kept)).is_ok() {
            // Without an answer the window hangs, and the program ends anyway.
            let _ = answer.recv_timeout(TO_KEEP);
        }
    });
}

/// The application, before and after its window opens.
pub(super) struct App {
    args: Demo,
    start: Option<Start>,
    shaders: Option<ShaderSources>,
    proxy: EventLoopProxy<WakeUp>,
    open: Option<WindowState>,
    failure: Option<Error>,
}

impl App {
    pub(super) fn new(
        args: Demo,
        start: Start,
        shaders: Option<ShaderSources>,
        proxy: EventLoopProxy<WakeUp>,
    ) -> Self {
        Self { args, start: Some(start), shaders, proxy, open: None, failure: None }
    }

    /// Returns the result of the event loop.
    pub(super) fn into_result(mut self) -> Result<()> {
        if let Some(mut open) = self.open.take() {
            if self.failure.is_none() {
                open.end();
            }
            let (context, device_args) = (open.context.clone(), &self.args.device_args);
            if !device_args.is_quiet() {
                open.say_memory();
            }
            drop(open);
            device_args.report_validation(&context);
        }
        self.failure.map_or(Ok(()), Err)
    }

    /// Applies a function to the open window; an error ends the program.
    fn with_open(
        &mut self,
        events: &ActiveEventLoop,
        work: impl FnOnce(&mut WindowState, &Demo) -> Result<bool>,
    ) {
        let Some(open) = &mut self.open else { return };
        let done = work(open, &self.args);
        self.args.device_args.report_validation(&open.context);
        match done {
            Ok(true) => (),
            Ok(false) => events.exit(),
            Err(error) => {
                open.rescue();
                self.failure = Some(error);
                events.exit();
            }
        }
    }
}

impl ApplicationHandler<WakeUp> for App {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        let Some(start) = self.start.take() else { return };
        match WindowState::new(events, &self.args, start, self.shaders.take(), &self.proxy) {
            Ok(open) => self.open = Some(open),
            Err(error) => {
                self.failure = Some(error);
                events.exit();
            }
        }
    }

    fn new_events(&mut self, _: &ActiveEventLoop, cause: StartCause) {
        if let (StartCause::ResumeTimeReached { .. }, Some(open)) = (cause, &self.open)
            && open.again.is_some_and(|again| again <= Instant::now())
        {
            open.window.request_redraw();
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, wake_up: WakeUp) {
        let Some(open) = &mut self.open else { return };
        match wake_up {
            WakeUp::Shows => open.window.request_redraw(),
            WakeUp::Ends(kept) => {
                open.rescue();
                let _ = kept.send(());
            }
        }
    }

    fn window_event(&mut self, events: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        self.with_open(events, |open, _| open.on_event(&event));
    }

    fn about_to_wait(&mut self, events: &ActiveEventLoop) {
        self.with_open(events, |open, _| {
            let wait = open.idle()?;
            events.set_control_flow(ControlFlow::WaitUntil(wait));
            Ok(true)
        });
    }
}
