//! The window's events.

use std::time::Instant;

use winit::application::ApplicationHandler;
use winit::event::{StartCause, WindowEvent};
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoopProxy};
use winit::window::WindowId;

use super::Demo;
use super::open::Open;
use super::session::Source;
use crate::error::{Error, Result};
use crate::scene::Scene;

/// The worker has something to show.
#[derive(Debug)]
pub(super) struct Woken;

/// The application, before and after it has a window.
pub(super) struct App {
    args: Demo,
    start: Option<(Source, Scene)>,
    proxy: EventLoopProxy<Woken>,
    open: Option<Open>,
    failure: Option<Error>,
}

impl App {
    pub(super) fn new(args: Demo, source: Source, scene: Scene, proxy: EventLoopProxy<Woken>) -> Self {
        Self { args, start: Some((source, scene)), proxy, open: None, failure: None }
    }

    /// How it ended.
    pub(super) fn into_result(mut self) -> Result<()> {
        if let Some(open) = self.open.take() {
            let (context, device_args) = (open.context.clone(), &self.args.device_args);
            if !device_args.is_quiet() {
                open.say_memory();
            }
            drop(open);
            device_args.report_validation(&context);
        }
        self.failure.map_or(Ok(()), Err)
    }

    /// Does something with the open window; what fails ends the program.
    fn with_open(&mut self, events: &ActiveEventLoop, work: impl FnOnce(&mut Open, &Demo) -> Result<bool>) {
        let Some(open) = &mut self.open else { return };
        let done = work(open, &self.args);
        self.args.device_args.report_validation(&open.context);
        match done {
            Ok(true) => (),
            Ok(false) => events.exit(),
            Err(error) => {
                if matches!(error, Error::Vulkan { .. } | Error::OutOfMemory(_)) {
                    open.rescue();
                }
                self.failure = Some(error);
                events.exit();
            }
        }
    }
}

impl ApplicationHandler<Woken> for App {
    fn resumed(&mut self, events: &ActiveEventLoop) {
        let Some((source, scene)) = self.start.take() else { return };
        match Open::new(events, &self.args, source, scene, &self.proxy) {
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

    fn user_event(&mut self, _: &ActiveEventLoop, _: Woken) {
        if let Some(open) = &self.open {
            open.window.request_redraw();
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
