//! The command line: what users ask for, done by the other rooms.

mod args;
mod check;
mod cpu;
mod doctor;
mod edit;
mod load_progress;
mod measure;
mod new;
mod progress;
mod render;
mod signals;
mod stats;

pub use cpu::require as require_cpu;

use crate::value::sanitized;
use args::{Cli, Command};
use clap::error::ErrorKind;
use clap::{CommandFactory, Parser};
use std::ffi::OsString;
use std::io::Write;
use std::process::ExitCode;
use std::time::Instant;

/// Exit status of a command line that cannot be understood; clap uses the same.
const WRONG_USAGE: u8 = 2;

/// How a command ends if not well.
enum Failure {
    /// Exit status 1, and why.
    Failed(String),
    /// Exit status 2, and why.
    Usage(String),
    /// Ended by a signal after saving what there is: the exit status, 129, 130 or 143.
    Signalled(u8),
}

/// Runs the command line that the program was started with.
#[inline(never)]
pub fn main() -> ExitCode {
    let started = Instant::now();
    let cli = understood();
    let result = match &cli.command {
        Some(Command::Render(args)) => render::run(args, started),
        Some(Command::Measure(args)) => measure::run(args),
        Some(Command::Check(args)) => check::run(args),
        Some(Command::New(args)) => new::run(args),
        Some(Command::Doctor(args)) => doctor::run(args),
        None => edit::run(&cli.edit),
    };
    let (status, message) = match result {
        Ok(()) => return ExitCode::SUCCESS,
        Err(Failure::Failed(why)) => (1, why),
        Err(Failure::Usage(why)) => (WRONG_USAGE, why),
        Err(Failure::Signalled(status)) => return ExitCode::from(status),
    };
    warn(&message);
    ExitCode::from(status)
}

/// The command line, or its end with exit status 2.
fn understood() -> Cli {
    Cli::try_parse().unwrap_or_else(|error| {
        // Of `zerkalo rendr a.toml` clap takes the first word for a scene and refuses the second.
        let first = std::env::args_os().nth(1).unwrap_or_default();
        let first = first.to_string_lossy();
        let unknown = !first.starts_with('-') && Cli::command().find_subcommand(&*first).is_none();
        if error.kind() == ErrorKind::ArgumentConflict && unknown {
            let names: Vec<_> =
                Cli::command().get_subcommands().map(|c| c.get_name().to_string()).collect();
            let why = format!("`{first}` is no command; commands: {}", names.join(", "));
            end(&Cli::command().error(ErrorKind::InvalidSubcommand, why))
        }
        end(&error)
    })
}

/// Tells what is wrong with the command line, or what was asked about it, and ends the program.
fn end(error: &clap::Error) -> ! {
    // What was typed, or found by a shell's pattern, shall not steer the terminal.
    let steers = |argument: OsString| {
        let argument = argument.to_string_lossy();
        sanitized(&argument) != argument
    };
    if std::env::args_os().any(steers) {
        warn(error.render().to_string().trim_end());
        std::process::exit(error.exit_code());
    }
    error.exit()
}

/// One thread per processor.
fn all_threads() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// A line on stderr; if nobody can read it, that is no reason to fail.
fn warn(message: &str) {
    let _ = writeln!(std::io::stderr(), "{}", shown(message));
}

/// A line on stdout; as [`warn`].
fn print_line(message: &str) {
    let _ = writeln!(std::io::stdout(), "{}", shown(message));
}

/// Lines without anything in them that could steer a terminal: they may hold names of files.
fn shown(message: &str) -> String {
    message.split('\n').map(sanitized).collect::<Vec<_>>().join("\n")
}
