//! `lightpaths help`: the help of a command, or the keys of a scene file.

use clap::Args;

use super::print;
use crate::error::{Error, Result};
use crate::scene::keys;

/// Print help for a command, or the keys of a scene file (help scene)
#[derive(Debug, Args)]
pub(super) struct Help {
    /// A command, or `scene`
    topic: Option<String>,
}

impl Help {
    pub(super) fn run(&self, mut program: clap::Command) -> Result<()> {
        program.build();
        match self.topic.as_deref() {
            None => print(&program.render_long_help().to_string()),
            Some("scene") => print(&keys::help()),
            Some(topic) => match program.find_subcommand_mut(topic) {
                Some(command) => print(&command.render_long_help().to_string()),
                None => {
                    Err(Error::Usage(format!("help: no command {topic:?}; `lightpaths help` lists them")))
                }
            },
        }
    }
}
