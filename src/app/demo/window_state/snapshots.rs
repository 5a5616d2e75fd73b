//! Snapshots of the window: requests, and the picture beside ours.

use super::WindowState;
use crate::app::demo::contact_sheet;
use crate::app::demo::ui_state::{Beside, Difference, Request};
use crate::error::{Error, Result};
use crate::metrics::{energy_ratio, relmse};
use crate::renderer::Layer;

impl WindowState {
    /// Keeps or restores a snapshot, or saves all of them.
    pub(super) fn fulfil_snapshot(&mut self, request: Request) -> Result<()> {
        let done = match request {
            Request::RestoreSnapshot(id) => {
                self.session.restore_snapshot(id);
                return Ok(());
            }
            Request::ContactSheet => {
                let context = self.panels.egui_ctx();
                contact_sheet::save(context, &self.session.snapshots.list, &self.ui_state.save_to)
            }
            _ => {
                self.ui_state.opens_snapshots = true;
                self.session.keep_snapshot().map(|name| format!("kept as {name}"))
            }
        };
        match done {
            Ok(said) => self.tell(said),
            Err(error @ (Error::Usage(_) | Error::Output { .. })) => self.tell_alarm(&error),
            Err(error) => return Err(error),
        }
        Ok(())
    }

    /// Shows the snapshot right of the split, and compares the picture with it.
    pub(super) fn follow_snapshot(&mut self) -> Result<()> {
        let beside = self.ui_state.snapshot_beside();
        let found = beside.and_then(|id| self.session.snapshots.get(id));
        let Some(snapshot) = found else {
            (self.beside.of, self.ui_state.difference) = (None, None);
            self.ui_state.split = None;
            return Ok(());
        };
        let of = (Beside::Snapshot(snapshot.id), snapshot.shown.display);
        if self.beside.of != Some(of) {
            self.beside.show(&self.context, &mut self.painter, of, snapshot.size, &snapshot.codes)?;
        }
        let of = (self.session.version, snapshot.id);
        if self.ui_state.difference.is_some_and(|difference| difference.of == of) {
            return Ok(());
        }
        self.ui_state.difference = match self.session.renderer() {
            Some(renderer) if renderer.size() == snapshot.size => {
                let live = renderer.layer(Layer::Beauty)?;
                Some(Difference {
                    of,
                    relmse: relmse(&live, &snapshot.radiance),
                    brighter: energy_ratio(&live, &snapshot.radiance) - 1.0,
                })
            }
            _ => None,
        };
        Ok(())
    }
}
