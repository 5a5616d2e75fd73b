//! The command line: one file per subcommand, with stable exit codes and one-line
//! errors for scripts.

use std::borrow::Cow;
use std::ffi::OsString;
use std::io::{self, Write};
use std::process::ExitCode;

use clap::error::ErrorKind;
use clap::{CommandFactory, Parser, Subcommand};

use crate::error::{Error, Result};

mod args;
mod capture;
mod compare;
#[cfg(feature = "window")]
mod demo;
mod display_args;
mod estimate;
mod exposure;
mod false_colours;
mod film;
mod heatmap;
mod help;
mod info;
mod init;
mod interrupt;
mod meters;
mod numbers;
mod output;
mod overlap;
mod picture;
mod plot;
mod precompute;
mod progress;
mod render;
mod scale;
mod shell;
mod sweep;
mod time;
mod tune;

/// Version, commit (in release builds of a checkout) and features.
const VERSION: &str = concat!(
    env!("CARGO_PKG_VERSION"),
    env!("LIGHTPATHS_COMMIT"),
    ", features: ",
    env!("LIGHTPATHS_FEATURES")
);

/// Interactive relighting with full global illumination from precomputed light paths.
#[derive(Debug, Parser)]
#[command(name = "lightpaths", version = VERSION, arg_required_else_help = true, disable_help_subcommand = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    Render(render::Render),
    Time(time::Time),
    Tune(tune::Tune),
    Sweep(sweep::Sweep),
    Judge(sweep::judge::Judge),
    Scale(scale::Scale),
    Figures(sweep::figures::Figures),
    Compare(compare::Compare),
    Film(film::Film),
    Precompute(precompute::Precompute),
    Measure(meters::measure::Measure),
    Solve(meters::solve::Solve),
    Info(info::Info),
    Init(init::Init),
    #[cfg(feature = "window")]
    Demo(demo::Demo),
    Completions(shell::Completions),
    Man(shell::Man),
    Help(help::Help),
}

/// Runs the command line `args` (the program's name first) and returns the exit code: 0 success, 1
/// a requested comparison failed, 2 bad arguments or input, 3 no usable Vulkan device, 4 the device
/// failed. An interrupted process ends by its signal, which shells show as 130 or 143, and leaves
/// no partial file.
///
/// Results go to stdout. Progress, warnings and the error line go to stderr.
pub fn run(args: impl IntoIterator<Item = OsString>) -> ExitCode {
    interrupt::watch();
    let result = match Cli::try_parse_from(args) {
        Ok(cli) => match cli.command {
            Command::Render(command) => command.run(),
            Command::Time(command) => command.run(),
            Command::Tune(command) => command.run(),
            Command::Sweep(command) => command.run(),
            Command::Judge(command) => command.run(),
            Command::Scale(command) => command.run(),
            Command::Figures(command) => command.run(),
            Command::Compare(command) => command.run(),
            Command::Film(command) => command.run(),
            Command::Precompute(command) => command.run(),
            Command::Measure(command) => command.run(),
            Command::Solve(command) => command.run(),
            Command::Info(command) => command.run(),
            Command::Init(command) => command.run(),
            #[cfg(feature = "window")]
            Command::Demo(command) => command.run(),
            Command::Completions(command) => command.run(Cli::command()),
            Command::Man(command) => command.run(Cli::command()),
            Command::Help(command) => command.run(Cli::command()),
        },
        Err(refusal) => match refusal.kind() {
            ErrorKind::DisplayHelp | ErrorKind::DisplayVersion => print(&refusal.render().to_string()),
            ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand => {
                // clap's own help text of several lines.
                let _ = io::stderr().lock().write_all(refusal.render().to_string().as_bytes());
                return ExitCode::from(2);
            }
            _ => Err(Error::Usage(one_line(&refusal.render().to_string()))),
        },
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            note(&format!("lightpaths: {}", error.to_string().replace('\n', " ")));
            ExitCode::from(error.exit_code())
        }
    }
}

/// clap's message and tips on one line, without the usage that `--help` prints.
fn one_line(message: &str) -> String {
    let said = message.split("\n\n").map(str::trim).filter(|part| !part.starts_with("Usage:"));
    let lines = said.map(|part| part.split_whitespace().collect::<Vec<_>>().join(" "));
    let line = lines.filter(|line| !line.is_empty()).collect::<Vec<_>>().join("; ");
    let line = line.trim_start_matches("error: ").replace("For more information, try", "for more, try");
    line.trim_end_matches('.').to_owned()
}

/// Writes results to stdout. A closed pipe (`lightpaths time | head`) is no error.
fn print(text: &str) -> Result<()> {
    let text: String = text.split('\n').map(escaped).collect::<Vec<_>>().join("\n");
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Error::output("standard output", error.to_string()))
        }
        _ => Ok(()),
    }
}

/// Writes one result to stdout as a single line, with control characters escaped.
fn print_line(line: &str) -> Result<()> {
    print(&(escaped(line).into_owned() + "\n"))
}

/// Writes a line to stderr; a failure cannot be reported and is ignored.
fn note(line: &str) {
    let line = escaped(line).into_owned() + "\n";
    let _ = io::stderr().lock().write_all(line.as_bytes());
}

/// Escapes a line for the terminal. Layers, files, materials and lights may have names from
/// untrusted files. A control character could move the cursor, rename the window or hide text.
fn escaped(line: &str) -> Cow<'_, str> {
    /// Bidirectional embeddings, overrides and isolates reorder the displayed text.
    fn is_unsafe(c: char) -> bool {
        c.is_control() || matches!(c, '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    }
    if !line.contains(is_unsafe) {
        return line.into();
    }
    let escape = |mut out: String, c: char| {
        if is_unsafe(c) {
            out.extend(c.escape_default());
        } else {
            out.push(c);
        }
        out
    };
    line.chars().fold(String::new(), escape).into()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_arguments_are_consistent() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }

    #[test]
    fn terminals_get_no_control_characters_and_all_other_text() {
        for text in ["plain", "Größe 10 µm²", "光の道", "שלום", "e\u{301}", "👩\u{200d}🚀", "a\\nb"]
        {
            assert_eq!(escaped(text), text);
        }
        assert_eq!(escaped("a\u{1b}[2Jb"), "a\\u{1b}[2Jb");
        assert_eq!(escaped("a\nb\rc\td"), "a\\nb\\rc\\td");
        for c in (0..=0x9f).filter_map(char::from_u32).chain(['\u{202e}', '\u{2028}', '\u{2067}']) {
            let escaped = escaped(&format!("x{c}y")).into_owned();
            assert_eq!(escaped.chars().count() == 3, (' '..='~').contains(&c), "{escaped}");
        }
    }

    #[test]
    fn refusals_fit_one_line_and_keep_their_tips() {
        let refusal = Cli::try_parse_from(["lightpaths", "render", "--presett", "draft"]).unwrap_err();
        let line = one_line(&refusal.render().to_string());
        assert!(line.starts_with("unexpected argument '--presett' found; tip:"), "{line}");
        assert!(line.contains("'--preset'") && line.ends_with("for more, try '--help'"), "{line}");
        assert!(!line.contains('\n') && !line.contains("Usage"), "{line}");
    }
}
