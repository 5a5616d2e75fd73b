//! Free recordings: commands are collected with the buffers that they use, and ordered by their
//! data alone. A command goes to the first level after all commands that it depends on. Levels are
//! recorded one after another, with one barrier between two. Commands of one level are independent:
//! the device may run them at once. The results have the same bits as in the order of recording,
//! because each command still sees the same inputs.

use std::collections::HashMap;

use ash::vk;

use super::hazard::Use;
use super::program::Handles;

/// What a dispatch binds, in the order of the shader's bindings.
pub(super) enum Bound {
    Storage(vk::DescriptorBufferInfo),
    Texels(vk::BufferView),
}

/// Number of workgroups.
pub(super) enum Workgroups {
    Direct([u32; 3]),
    /// Three words at a byte offset of a buffer.
    Indirect(vk::Buffer, u64),
}

/// One command of a recording.
pub(super) enum Command {
    Dispatch {
        handles: Handles,
        push: Vec<u8>,
        bound: Vec<(u32, Bound)>,
        workgroups: Workgroups,
    },
    Fill {
        buffer: vk::Buffer,
        bytes: u64,
    },
    Copy {
        from: vk::Buffer,
        to: vk::Buffer,
        region: vk::BufferCopy,
    },
    /// The start of a buffer, of any length.
    Update {
        buffer: vk::Buffer,
        data: Vec<u8>,
    },
}

/// The commands of a free recording.
#[derive(Default)]
pub(super) struct Schedule {
    commands: Vec<Command>,
    levels: Levels,
}

/// The level of each command.
#[derive(Default)]
struct Levels {
    of_commands: Vec<u32>,
    /// For each buffer, one past the level of its last write, and one past that of its last read.
    ends: HashMap<u64, [u32; 2]>,
}

impl Levels {
    fn push(&mut self, uses: &[Use]) {
        let after = |used: &Use| {
            let [written, read] = self.ends.get(&used.buffer).copied().unwrap_or_default();
            if used.writes { written.max(read) } else { written }
        };
        let level = uses.iter().map(after).max().unwrap_or(0);
        for used in uses {
            let ends = self.ends.entry(used.buffer).or_default();
            let end = &mut ends[usize::from(!used.writes)];
            *end = (*end).max(level + 1);
        }
        self.of_commands.push(level);
    }
}

impl Schedule {
    /// Adds the next command in the order of recording.
    pub(super) fn push(&mut self, command: Command, uses: &[Use]) {
        self.levels.push(uses);
        self.commands.push(command);
    }

    /// The commands, level by level; each level in the order of recording.
    pub(super) fn levels(&self) -> impl Iterator<Item = impl Iterator<Item = &Command>> {
        let count = self.levels.of_commands.iter().max().map_or(0, |last| last + 1);
        (0..count).map(|level| {
            let commands = self.commands.iter().zip(&self.levels.of_commands);
            commands.filter(move |(_, own)| **own == level).map(|(command, _)| command)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::barrier::Places;
    use super::*;

    fn levels(commands: &[(&[u64], &[u64])]) -> Vec<u32> {
        let mut levels = Levels::default();
        for (reads, writes) in commands {
            let used = |buffer: u64, writes: bool| Use {
                buffer,
                name: String::new(),
                place: Places::COMPUTE,
                reads: !writes,
                writes,
            };
            let reads = reads.iter().map(|&buffer| used(buffer, false));
            let writes = writes.iter().map(|&buffer| used(buffer, true));
            levels.push(&reads.chain(writes).collect::<Vec<_>>());
        }
        levels.of_commands
    }

    #[test]
    fn independent_chains_share_levels() {
        // Two chains of three, recorded one after the other, and a command that joins them.
        let chains: [(&[u64], &[u64]); 7] = [
            (&[], &[1]),
            (&[1], &[2]),
            (&[2], &[3]),
            (&[], &[11]),
            (&[11], &[12]),
            (&[12], &[13]),
            (&[3, 13], &[20]),
        ];
        assert_eq!(levels(&chains), [0, 1, 2, 0, 1, 2, 3]);
    }

    #[test]
    fn a_write_waits_for_earlier_reads_and_writes() {
        // Buffer 1 is read twice, then reused.
        assert_eq!(levels(&[(&[], &[1]), (&[1], &[2]), (&[1], &[3]), (&[], &[1])]), [0, 1, 1, 2]);
        // A command that reads and writes the same buffer.
        assert_eq!(levels(&[(&[1], &[1]), (&[1], &[1]), (&[], &[2])]), [0, 1, 0]);
        assert_eq!(levels(&[(&[], &[1]), (&[], &[1])]), [0, 1]);
        assert_eq!(levels(&[(&[], &[])]), [0]);
    }
}
