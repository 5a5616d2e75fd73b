//! The `lightpaths` command.

use std::process::ExitCode;

fn main() -> ExitCode {
    lightpaths::app::run(std::env::args_os())
}
