//! Submissions that the device may still execute.

use std::cell::RefCell;
use std::rc::Rc;
use std::time::Duration;

use ash::vk;

use super::recorder::Recorder;
use super::timing::PassTiming;
use crate::error::Result;

/// A submission that the device may still execute. Its objects are freed once a wait has found it
/// done, or with the last clone.
#[derive(Clone)]
pub struct InFlight(Rc<RefCell<State>>);

enum State {
    Submitted(Box<Recorder>),
    Done(Vec<PassTiming>),
}

impl Recorder {
    /// Submits the recording.
    ///
    /// # Errors
    /// A Vulkan call failed; after the loss of the device the error names the last pass recorded.
    pub fn submit(self) -> Result<InFlight> {
        self.submit_with([&[], &[]])
    }

    /// Submits the recording. The device waits for the first list of semaphores, and signals those
    /// of the second.
    pub(super) fn submit_with(mut self, semaphores: [&[vk::SemaphoreSubmitInfo<'_>]; 2]) -> Result<InFlight> {
        self.submit_commands(semaphores)?;
        Ok(InFlight(Rc::new(RefCell::new(State::Submitted(Box::new(self))))))
    }
}

impl InFlight {
    /// Waits until the device is done, at most `patience`. Returns whether it is.
    ///
    /// # Errors
    /// A Vulkan call failed; after the loss of the device the error names the last pass recorded.
    pub fn wait_at_most(&self, patience: Duration) -> Result<bool> {
        let mut state = self.0.borrow_mut();
        let State::Submitted(recorder) = &mut *state else { return Ok(true) };
        if !recorder.wait(u64::try_from(patience.as_nanos()).unwrap_or(u64::MAX))? {
            return Ok(false);
        }
        let timings = recorder.timings()?;
        *state = State::Done(timings);
        Ok(true)
    }

    /// Waits until the device is done. Returns the time of each pass in order.
    ///
    /// # Errors
    /// A Vulkan call failed, as in [`Self::wait_at_most`].
    pub fn wait(&self) -> Result<Vec<PassTiming>> {
        while !self.wait_at_most(Duration::MAX)? {}
        match &*self.0.borrow() {
            State::Done(timings) => Ok(timings.clone()),
            State::Submitted(_) => unreachable!("the wait has ended"),
        }
    }
}
