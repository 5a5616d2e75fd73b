//! `lightpaths completions` and `lightpaths man`: files for shells and for `man`.

use std::path::PathBuf;

use clap::{Args, Command};
use clap_complete::Shell;

use super::output::{OutputFile, create_folder};
use super::print;
use crate::error::{Error, Result};

/// Print completions for a shell
///
/// For bash: lightpaths completions bash > ~/.local/share/bash-completion/completions/lightpaths
#[derive(Debug, Args)]
pub(super) struct Completions {
    /// The shell that reads them
    #[arg(value_enum)]
    shell: Shell,
}

/// Write the manual pages
#[derive(Debug, Args)]
pub(super) struct Man {
    /// The folder for the pages, such as ~/.local/share/man/man1
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
}

impl Completions {
    pub(super) fn run(&self, mut program: Command) -> Result<()> {
        let mut text = Vec::new();
        clap_complete::generate(self.shell, &mut program, "lightpaths", &mut text);
        let text = String::from_utf8(text)
            .map_err(|error| Error::output("standard output", format!("completions are no text: {error}")))?;
        print(&text)
    }
}

impl Man {
    pub(super) fn run(&self, mut program: Command) -> Result<()> {
        create_folder(&self.output)?;
        program.build();
        let mut names = Vec::new();
        write_page(self, &program, "lightpaths", &mut names)?;
        for command in program.get_subcommands() {
            write_page(self, command, &format!("lightpaths-{}", command.get_name()), &mut names)?;
        }
        super::print_line(&format!("{}: {} pages", self.output.display(), names.len()))
    }
}

/// Writes the page of a command.
fn write_page(man: &Man, command: &Command, name: &str, names: &mut Vec<String>) -> Result<()> {
    let output = OutputFile::check(&man.output.join(format!("{name}.1")))?;
    let page = clap_mangen::Man::new(command.clone()).title(name);
    output.write(|out| page.render(out))?;
    names.push(name.to_owned());
    Ok(())
}
