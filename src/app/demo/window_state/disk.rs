//! Changes of the scene's files while the scene is open. A reload preserves the user's edits.

use super::WindowState;
use crate::app::demo::differences::Differences;
use crate::app::demo::files;
use crate::app::demo::rebase::Rebase;
use crate::app::demo::ui_state::{Answer, Chosen};
use crate::app::demo::watch::Look;
use crate::app::note;
use crate::error::{Error, Result};

impl WindowState {
    /// Checks the scene's files for changes. Reloads the scene, or opens the question if it
    /// has unsaved edits.
    pub(super) fn glance(&mut self) -> Result<()> {
        // A drag ends first.
        if self.is_held {
            return Ok(());
        }
        let spec = self.session.source.spec.clone();
        match self.session.watch.look() {
            Look::Reported | Look::Unsettled => Ok(()),
            Look::AsRead => {
                if std::mem::take(&mut self.session.is_asked) {
                    self.tell(format!("{spec} is again as it was loaded"));
                }
                Ok(())
            }
            Look::Gone => {
                self.session.is_asked = false;
                self.tell(format!("{spec} is gone; the scene stays open: save it to keep it"));
                Ok(())
            }
            Look::Changed => self.on_change(),
        }
    }

    fn on_change(&mut self) -> Result<()> {
        // The changes that a film makes are no edits.
        self.plays_when_ready = false;
        if let Some(player) = self.player.take() {
            player.end(&mut self.session);
            self.ui_state.is_playing = false;
        }
        if !self.session.has_unsaved_edits() {
            return self.reload();
        }
        if let Some(why) = self.session.why_unloadable() {
            self.session.is_asked = false;
            self.tell(why);
        } else {
            self.session.is_asked = true;
            if self.ui_state.differences.is_some() {
                self.compare();
            }
            self.tell(format!(
                "{} has changed on disk; unsaved edits wait for an answer",
                self.session.source.spec
            ));
        }
        Ok(())
    }

    /// Applies the user's answer. The question stays if that fails.
    pub(super) fn answer(&mut self, answer: Answer) -> Result<()> {
        if !self.session.is_asked {
            return Ok(());
        }
        match answer {
            Answer::Reload => self.reload(),
            Answer::KeepMine => {
                self.session.is_asked = false;
                self.session.watch.keep();
                self.tell("your edits are kept, and not yet saved".to_owned());
                Ok(())
            }
            Answer::KeepBoth => match files::save_mine(&mut self.session) {
                Ok(said) => {
                    self.tell(said);
                    self.reload()
                }
                Err(error) => {
                    self.tell_alarm(&error);
                    Ok(())
                }
            },
        }
    }

    /// Lists what differs between the scene's files and the edited scene.
    pub(super) fn compare(&mut self) {
        self.ui_state.differences = match Differences::new(&self.session) {
            Ok(differences) => Some(differences),
            Err(error) => {
                self.tell_alarm(&error);
                None
            }
        };
    }

    /// Compares again after an edit.
    pub(super) fn follow_differences(&mut self) {
        let shown = self.ui_state.differences.as_ref();
        if shown.is_some_and(|shown| !shown.is_of(&self.session.document)) && !self.is_held {
            self.compare();
            self.window.request_redraw();
        }
    }

    /// Reloads the scene. A film recording ends and is saved.
    fn reload(&mut self) -> Result<()> {
        if self.recorder.is_some() {
            self.record();
        }
        let (spec, notes) = (self.session.source.spec.clone(), self.session.said.len());
        let loaded = self.session.reload()?;
        self.session.is_asked = false;
        let Some(rebase) = loaded else {
            let refused = self.session.said.split_off(notes);
            refused.into_iter().for_each(|line| self.tell(line));
            return Ok(());
        };
        self.was_ready = false;
        self.after_reload(&rebase);
        let back =
            if self.session.history.depths()[0] > 0 { "; Ctrl+Z goes back to how it was lit" } else { "" };
        self.tell(format!("{spec} has changed and was loaded again{back}"));
        Ok(())
    }

    /// Converts references to lights, materials and positions to the loaded scene.
    fn after_reload(&mut self, rebase: &Rebase) {
        self.viewport.let_go();
        self.ui_state.place = None;
        for id in &mut self.ui_state.other_lights {
            *id = rebase.light(*id);
        }
        self.ui_state.group_typed = None;
        self.ui_state.chosen = match self.ui_state.chosen {
            Chosen::Light(id) => Chosen::Light(rebase.light(id)),
            Chosen::Material(index) => rebase.material(index).map_or(Chosen::Nothing, Chosen::Material),
            Chosen::Model(index) => Chosen::Model(index),
            Chosen::Nothing => Chosen::Nothing,
        };
        self.restart_reference();
    }

    /// Restarts Monte Carlo with the next picture.
    pub(super) fn restart_reference(&mut self) {
        self.beside.of = None;
        if let Some(mut reference) = self.reference.take() {
            reference.stop();
            self.leaving = Some(reference);
        }
    }

    /// Adds a note to the panel, and prints it to stderr in case the window is hidden.
    pub(super) fn tell(&mut self, line: String) {
        self.print(&line);
        self.session.said.push(line);
        self.window.request_redraw();
    }

    /// Raises the error as an alarm, and prints it to stderr.
    pub(super) fn tell_alarm(&mut self, error: &Error) {
        self.print(&error.to_string());
        self.session.alarm(error.to_string());
        self.window.request_redraw();
    }

    pub(super) fn print(&self, line: &str) {
        if !self.is_quiet {
            note(&format!("lightpaths: {line}"));
        }
    }
}
