//! Requests of panels and keys to the window.

use std::path::Path;
use std::time::Instant;

use winit::window::Fullscreen;

use super::WindowState;
use crate::app::demo::actions;
use crate::app::demo::dialogs::Purpose;
use crate::app::demo::files;
use crate::app::demo::films::{FilmRecorder, Player};
use crate::app::demo::ui_state::{Request, View};
use crate::app::note;
use crate::error::{Error, Result};

impl WindowState {
    /// Returns false if the window must close.
    pub(super) fn fulfil(&mut self, request: Request) -> Result<bool> {
        match request {
            Request::Quit => return Ok(!self.may_close()),
            Request::QuitAnyway => return Ok(false),
            Request::SaveAndQuit => match files::save_scene(&mut self.session, &self.ui_state.save_to) {
                Ok(said) => {
                    self.tell(said);
                    return Ok(false);
                }
                Err(error) => self.tell_alarm(&error),
            },
            Request::Ask(purpose) => {
                let file = match purpose {
                    Purpose::Save => self.ui_state.save_to.clone(),
                    Purpose::Open | Purpose::Add | Purpose::Sky | Purpose::Image => {
                        self.session.source.spec.clone()
                    }
                };
                self.dialogs.ask(purpose, Path::new(&file));
            }
            Request::AddLuminaire => {
                let path = std::mem::take(&mut self.ui_state.luminaire_to_add);
                actions::add_luminaire(&mut self.session, &mut self.ui_state, Path::new(path.trim()));
            }
            Request::Open => self.open_or_ask()?,
            Request::OpenAnyway => self.open()?,
            Request::SaveAndOpen => match files::save_scene(&mut self.session, &self.ui_state.save_to) {
                Ok(said) => {
                    self.tell(said);
                    self.open()?;
                }
                Err(error) => self.tell_alarm(&error),
            },
            Request::Vsync => {
                self.ui_state.vsync = !self.ui_state.vsync;
                self.painter.set_vsync(self.ui_state.vsync);
            }
            Request::Fullscreen => {
                let fills = self.window.fullscreen().is_some();
                self.window.set_fullscreen((!fills).then_some(Fullscreen::Borderless(None)));
            }
            Request::Memory => self.say_memory(),
            Request::Settled => self.is_asked_to_settle = true,
            Request::Save => {
                let saved = files::save_scene(&mut self.session, &self.ui_state.save_to);
                match saved {
                    Ok(said) => self.tell(said),
                    Err(error) => self.tell_alarm(&error),
                }
            }
            Request::Screenshot => {
                let saved = files::save_picture(&self.session, &self.ui_state.save_to);
                self.say(saved);
            }
            Request::Layers => {
                let saved = files::save_layers(&mut self.session, &self.ui_state.save_to);
                match saved {
                    Err(error) if error.is_out_of_memory() => self.tolerate(Err(error))?,
                    Err(error) => self.tell_alarm(&error),
                    Ok(said) => self.tell(said),
                }
            }
            Request::Record => self.record(),
            Request::Play => {
                let done = self.play_or_stop();
                self.tolerate(done)?;
            }
            Request::Preset(preset) => {
                let chosen = self.session.choose_preset(preset);
                self.was_ready &= chosen.is_err();
                match chosen {
                    Err(error @ (Error::Usage(_) | Error::Input { .. })) => self.tell_alarm(&error),
                    chosen => self.tolerate(chosen)?,
                }
            }
            Request::Restore => match self.autosave.restore(&mut self.session) {
                Ok(()) => {
                    self.ui_state.asks_to_restore = false;
                    self.tell("the edits of the last time are back; Ctrl+Z takes them out".to_owned());
                }
                Err(error) => self.tell_alarm(&error),
            },
            Request::Discard => {
                self.autosave.discard();
                self.ui_state.asks_to_restore = false;
                self.tell("the edits of the last time are deleted".to_owned());
            }
            Request::Snapshot | Request::RestoreSnapshot(_) | Request::ContactSheet => {
                let done = self.fulfil_snapshot(request);
                self.tolerate(done)?;
            }
            Request::Solve => {
                let done = self.find_powers();
                self.tolerate(done)?;
            }
            Request::Compare => self.compare(),
            Request::Answer(answer) => {
                let done = self.answer(answer);
                self.tolerate(done)?;
            }
        }
        self.window.request_redraw();
        Ok(true)
    }

    /// Changes powers of lights so that the meters have the wanted means.
    fn find_powers(&mut self) -> Result<()> {
        let (session, meters) = (&mut self.session, &self.ui_state.meters);
        let wanted = session.document.meters.iter().map(|meter| meters.wants(meter)).enumerate();
        let wanted: Vec<(usize, f64)> = wanted.filter(|(_, lux)| *lux > 0.0).collect();
        match session.find_powers(&wanted, &meters.kept) {
            Ok(lines) => lines.into_iter().for_each(|line| self.tell(line)),
            Err(error @ Error::Usage(_)) => self.tell_alarm(&error),
            Err(error) => return Err(error),
        }
        Ok(())
    }

    pub(super) fn record(&mut self) {
        match self.recorder.take() {
            None => self.recorder = Some(FilmRecorder::begin(&self.session)),
            Some(recorder) => {
                let saved = recorder.end(&self.session, &self.ui_state.save_to);
                self.recorded = saved.as_ref().ok().cloned().or(self.recorded.take());
                self.say(saved.map(|path| format!("saved {}", path.display())));
            }
        }
        self.ui_state.is_recording = self.recorder.is_some();
    }

    fn play_or_stop(&mut self) -> Result<()> {
        match self.player.take() {
            Some(player) => player.end(&mut self.session),
            None => match Player::begin(&self.session, self.recorded.as_deref()) {
                Ok((player, None)) => self.player = Some(player),
                Ok((_, Some(scene))) => {
                    // The film starts when its light paths are traced.
                    self.session.prepare_open(scene)?;
                    (self.plays_when_ready, self.was_ready) = (true, false);
                }
                Err(error) => self.say(Err(error)),
            },
        }
        self.ui_state.is_playing = self.player.is_some();
        Ok(())
    }

    /// Applies the current frame of a playing film.
    pub(super) fn play(&mut self) -> Result<()> {
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

    /// Gizmos an out-of-memory error: raises an alarm and hides the additional pictures.
    /// Returns other errors.
    pub(super) fn tolerate(&mut self, done: Result<()>) -> Result<()> {
        match done {
            Err(error) if error.is_out_of_memory() => {
                (self.ui_state.view, self.ui_state.split) = (View::Beauty, None);
                self.session.alarm(error.to_string());
                self.window.request_redraw();
                Ok(())
            }
            done => done,
        }
    }

    /// Saves the edited scene before the program ends, beside its usual path. Prints the new path.
    pub(in crate::app::demo) fn rescue(&mut self) {
        if !self.session.has_unsaved_edits() {
            return;
        }
        note(&match files::rescue_scene(&self.session, &self.ui_state.save_to) {
            Ok(path) => {
                self.autosave.end();
                format!("lightpaths: the edited scene is in {}", path.display())
            }
            Err(error) => format!("lightpaths: the edited scene is lost: {error}"),
        });
    }

    /// Keeps unsaved edits in the autosave. A drag and a film that plays are no edits yet.
    pub(super) fn save_edits(&mut self) {
        if self.is_held || self.player.is_some() {
            return;
        }
        let done = self.autosave.follow(&self.session);
        self.ui_state.asks_to_restore &= self.autosave.found().is_some();
        if let Some(kept) = self.autosave.take_kept() {
            self.tell(format!("the edits of the last time are in {}", kept.display()));
        }
        if let Err(error) = done {
            self.tell(format!("this edit is not kept in case of a crash: {error}"));
        }
    }

    /// Ends the window as the user wishes: what is unsaved is not kept.
    pub(in crate::app::demo) fn end(&mut self) {
        self.autosave.end();
    }

    /// Prints that the window is up to date, if a script waits for it. `is_still`: the frame was
    /// shown and its picture did not change.
    pub(super) fn settle(&mut self, is_still: bool) {
        if !self.is_asked_to_settle {
            return;
        }
        let draws_again = self.again.is_some_and(|again| again <= Instant::now());
        let is_done = self.session.progress().is_none()
            && !self.session.is_computing()
            && self.viewport.fits(&self.session)
            && self.ui_state.requests.is_empty()
            && !self.plays_when_ready;
        if is_still && is_done && !draws_again {
            self.is_asked_to_settle = false;
            note("lightpaths: settled");
        } else {
            self.window.request_redraw();
        }
    }

    /// Whether the window closes at once. Else the next frame decides: it applies the keys that the
    /// user pressed before, which may be edits. A hidden window draws no frame, and the second
    /// request does not wait for one.
    pub(super) fn close_when_drawn(&mut self) -> bool {
        if self.is_hidden || self.ui_state.requests.contains(&Request::Quit) {
            return self.may_close();
        }
        self.ui_state.requests.push(Request::Quit);
        self.window.request_redraw();
        false
    }

    /// Whether the window may close: there are no unsaved edits. Else it asks.
    pub(super) fn may_close(&mut self) -> bool {
        // The changes that a film makes are no edits.
        if let Some(player) = self.player.take() {
            player.end(&mut self.session);
            self.ui_state.is_playing = false;
        }
        if !self.session.has_unsaved_edits() {
            return true;
        }
        if !std::mem::replace(&mut self.ui_state.asks_to_close, true) {
            self.print("unsaved edits: the window stays open for an answer");
        }
        self.window.request_redraw();
        false
    }

    /// Marks unsaved edits in the window's title.
    pub(super) fn entitle(&mut self) {
        let is_marked = self.session.has_unsaved_edits();
        if is_marked != self.is_marked {
            self.is_marked = is_marked;
            let mark = if is_marked { "• " } else { "" };
            self.window.set_title(&format!("{mark}{} – lightpaths", self.session.scene.name));
        }
    }

    /// Adds the message or the error to the panel's notes.
    fn say(&mut self, done: Result<String>) {
        self.session.said.push(done.unwrap_or_else(|error| error.to_string()));
    }
}
