//! The record-time hazard check. For each buffer it stores the uses since the barrier that would
//! have ordered them.
//!
//! Accesses come from `readonly` and `writeonly` in the SPIR-V, so no pass declares them. The check
//! is conservative: two passes that add atomically to one buffer count as a hazard.

use std::collections::HashMap;

use super::barrier::{Barrier, Places};

/// One use of a buffer by one command.
#[derive(Clone, Debug)]
pub(super) struct Use {
    /// Identity of the buffer.
    pub(super) buffer: u64,
    /// Name of the buffer in the pass.
    pub(super) name: String,
    pub(super) place: Places,
    pub(super) reads: bool,
    pub(super) writes: bool,
}

/// A use that later ones may conflict with.
struct Open {
    pass: &'static str,
    place: Places,
    writes: bool,
    /// Accesses that a barrier has ordered behind this use, each with the index of the
    /// first such barrier.
    ordered: Vec<(Places, usize)>,
}

struct Recorded {
    description: String,
    is_needed: bool,
}

/// The state of the check within one recording.
#[derive(Default)]
pub(super) struct Hazards {
    open: HashMap<u64, Vec<Open>>,
    barriers: Vec<Recorded>,
}

impl Hazards {
    /// Adds the uses of one command. Panics if one conflicts with an earlier use that no barrier
    /// ordered before it.
    pub(super) fn command(&mut self, pass: &'static str, uses: &[Use]) {
        for new in uses {
            for old in self.open.get(&new.buffer).into_iter().flatten() {
                if !new.writes && !old.writes {
                    continue;
                }
                let Some(&(_, index)) = old.ordered.iter().find(|(place, _)| place.meets(new.place)) else {
                    panic!(
                        "`{pass}` {} `{}` after `{}` {} it with no barrier between",
                        if new.reads && old.writes { "reads" } else { "writes" },
                        new.name,
                        old.pass,
                        if old.writes { "wrote" } else { "read" },
                    );
                };
                self.barriers[index].is_needed = true;
            }
        }
        // A write is ordered after all earlier uses, and later uses are ordered after the write. So
        // only the write stays open.
        for new in uses.iter().filter(|new| new.writes) {
            self.open.insert(new.buffer, vec![Open::new(pass, new, true)]);
        }
        for new in uses.iter().filter(|new| !new.writes) {
            let open = self.open.entry(new.buffer).or_default();
            let is_known =
                open.iter().any(|old| old.pass == pass && old.place == new.place && old.ordered.is_empty());
            if !is_known {
                open.push(Open::new(pass, new, false));
            }
        }
    }

    /// Adds a barrier that was recorded after `pass`.
    pub(super) fn barrier(&mut self, barrier: Barrier, pass: &str) {
        let index = self.barriers.len();
        let description = format!("barrier {index}, {} after `{pass}`, separates nothing", barrier.name);
        self.barriers.push(Recorded { description, is_needed: false });
        for open in self.open.values_mut().flatten() {
            let reached = open.ordered.iter().fold(open.place, |places, (place, _)| places.with(*place));
            if reached.meets(barrier.places_before()) {
                open.ordered.push((barrier.places_after(), index));
            }
        }
    }

    /// The barriers so far that ordered no two conflicting uses.
    pub(super) fn redundant(&self) -> Vec<String> {
        self.barriers
            .iter()
            .filter(|barrier| !barrier.is_needed)
            .map(|barrier| barrier.description.clone())
            .collect()
    }
}

impl Open {
    fn new(pass: &'static str, new: &Use, writes: bool) -> Self {
        Self { pass, place: new.place, writes, ordered: Vec::new() }
    }
}

#[cfg(test)]
mod tests {
    use super::super::barrier::{
        COMPUTE_TO_COMPUTE, COMPUTE_TO_INDIRECT, COMPUTE_TO_TRANSFER, TRANSFER_TO_COMPUTE,
    };
    use super::*;

    fn read(buffer: u64, place: Places) -> Use {
        Use { buffer, name: format!("Buffer{buffer}"), place, reads: true, writes: false }
    }

    fn write(buffer: u64, place: Places) -> Use {
        Use { buffer, name: format!("Buffer{buffer}"), place, reads: false, writes: true }
    }

    fn update(buffer: u64, place: Places) -> Use {
        Use { reads: true, ..write(buffer, place) }
    }

    const C: Places = Places::COMPUTE;

    #[test]
    #[should_panic(expected = "`gather` reads `Buffer1` after `pyramid` wrote it with no barrier between")]
    fn read_after_write() {
        let mut hazards = Hazards::default();
        hazards.command("pyramid", &[write(1, C)]);
        hazards.command("gather", &[read(1, C)]);
    }

    #[test]
    #[should_panic(expected = "`clear` writes `Buffer1` after `gather` read it with no barrier between")]
    fn write_after_read() {
        let mut hazards = Hazards::default();
        hazards.command("gather", &[read(1, C)]);
        hazards.command("clear", &[write(1, C)]);
    }

    #[test]
    #[should_panic(expected = "`b` writes `Buffer1` after `a` wrote it with no barrier between")]
    fn write_after_write() {
        let mut hazards = Hazards::default();
        hazards.command("a", &[write(1, C)]);
        hazards.command("b", &[write(1, C)]);
    }

    #[test]
    #[should_panic(expected = "`b` reads `Buffer1` after `a` wrote it")]
    fn a_barrier_to_the_wrong_place_orders_nothing() {
        let mut hazards = Hazards::default();
        hazards.command("a", &[write(1, C)]);
        hazards.barrier(COMPUTE_TO_COMPUTE, "a");
        hazards.command("b", &[read(1, Places::INDIRECT)]);
    }

    #[test]
    fn two_readers_and_two_buffers_need_no_barrier() {
        let mut hazards = Hazards::default();
        hazards.command("a", &[read(1, C), write(2, C)]);
        hazards.command("b", &[read(1, C), write(3, C)]);
    }

    #[test]
    fn barriers_reach_through_others() {
        let mut hazards = Hazards::default();
        hazards.command("a", &[write(1, C)]);
        hazards.barrier(COMPUTE_TO_TRANSFER, "a");
        hazards.command("copy", &[read(1, Places::TRANSFER)]);
        hazards.barrier(TRANSFER_TO_COMPUTE, "copy");
        hazards.command("b", &[update(1, C)]);
        assert_eq!(hazards.redundant(), [""; 0]);
    }

    #[test]
    fn a_write_to_a_fetched_indirect_buffer_is_ordered_by_a_compute_barrier() {
        let mut hazards = Hazards::default();
        hazards.command("a", &[write(1, C)]);
        hazards.barrier(COMPUTE_TO_INDIRECT, "a");
        hazards.command("b", &[read(1, Places::INDIRECT)]);
        hazards.barrier(COMPUTE_TO_COMPUTE, "b");
        hazards.command("c", &[write(1, C)]);
        assert_eq!(hazards.redundant(), [""; 0]);
    }

    #[test]
    fn redundant_barriers_are_named() {
        let mut hazards = Hazards::default();
        hazards.command("a", &[write(1, C)]);
        hazards.barrier(COMPUTE_TO_COMPUTE, "a");
        hazards.barrier(COMPUTE_TO_COMPUTE, "a");
        hazards.command("b", &[read(1, C)]);
        assert_eq!(hazards.redundant(), ["barrier 1, COMPUTE_TO_COMPUTE after `a`, separates nothing"]);
    }
}
