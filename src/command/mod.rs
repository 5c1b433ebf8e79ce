//! Command line of the program.

mod args;
mod check;
mod checkpoints;
mod compare;
mod config;
mod cpu;
mod deadline;
mod doctor;
mod edit;
mod info;
mod load_progress;
mod measure;
mod merge;
mod new;
mod package_files;
mod part_file;
mod plan;
mod progress;
mod regions;
mod render;
mod save;
mod scenes;
mod shard;
mod stats;
mod status;
mod watch;
mod work;

pub use cpu::require as require_cpu;

use crate::dashboard::scene_source::{BUILT_IN, SceneSource};
use args::{Cli, Command};
use clap::error::ErrorKind;
use clap::{CommandFactory, FromArgMatches};
use config::Config;
use serde::Serialize;
use std::ffi::OsString;
use std::fmt::Display;
use std::fs::File;
use std::io::{self, IsTerminal, Write};
use std::os::fd::AsFd;
use std::path::Path;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use zerkalo_scene::value::{nearest, sanitized};
use zerkalo_scene::{Document, Scene, SceneErrors};
use zerkalo_terminal::{INTERRUPTED, SignalQueue, Signals, is_in_foreground, supervised};
use zerkalo_world::{self as world, Precision, requires_double};

/// Exit status for an invalid command line, also that of clap.
const WRONG_USAGE: u8 = 2;

/// Time after the first signal from which on Ctrl-C counts as pressed again: a program between the
/// terminal and this one may pass the signal of one key on a second time.
const SECOND_KEY: Duration = Duration::from_millis(300);

/// Reason why a command did not succeed.
enum Failure {
    /// Failure with this message (exit status 1).
    Failed(String),
    /// Invalid command line with this message (exit status 2).
    Usage(String),
    /// Signal, after the picture or the edits were saved; the value is the exit status: 128 plus the
    /// number of the signal.
    Signalled(u8),
}

impl<E: Display> From<E> for Failure {
    fn from(error: E) -> Self {
        Self::Failed(error.to_string())
    }
}

/// Runs the command line of the process.
#[inline(never)]
pub fn main() -> ExitCode {
    let started = Instant::now();
    let config = Config::read().unwrap_or_else(|error| {
        warn(&error);
        std::process::exit(1)
    });
    let cli = parse(config.command_line());
    if let (None, Some(scene)) = (&cli.command, &cli.edit.scene)
        && !scene.exists()
        && let (error, true) = unknown_command(&scene.to_string_lossy())
    {
        end(&error)
    }
    QUIET.store(cli.quiet, Ordering::Relaxed);
    let has_dashboard = matches!(cli.command, None | Some(Command::Watch(_)));
    if let Ok(Some(status)) = if has_dashboard { supervised() } else { Ok(None) } {
        return ExitCode::from(status);
    }
    let result = match &cli.command {
        Some(Command::Render(args)) => render::run(args, started),
        Some(Command::Plan(args)) => plan::run(args),
        Some(Command::Work(args)) => work::run(args),
        Some(Command::Status(args)) => status::run(args),
        Some(Command::Merge(args)) => merge::run(args),
        Some(Command::Watch(args)) => watch::run(args, config.preferences),
        Some(Command::Measure(args)) => measure::run(args),
        Some(Command::Check(args)) => check::run(args),
        Some(Command::Info(args)) => info::run(args),
        Some(Command::Compare(args)) => compare::run(args),
        Some(Command::Scenes(args)) => scenes::run(args),
        Some(Command::New { file }) => new::run(file),
        Some(Command::Doctor(args)) => doctor::run(*args),
        Some(Command::Config) => config.print(),
        Some(Command::Completions { shell }) => package_files::print_completions(*shell),
        Some(Command::Man { folder }) => package_files::write_manual(folder),
        None => edit::run(&cli.edit, config.preferences),
    };
    let (status, message) = match result {
        Ok(()) => return ExitCode::SUCCESS,
        Err(Failure::Failed(message)) => (1, message),
        Err(Failure::Usage(message)) => (WRONG_USAGE, message),
        Err(Failure::Signalled(status)) => return ExitCode::from(status),
    };
    print_error(&message);
    ExitCode::from(status)
}

/// Parses the command line. Ends the program if it is not valid.
fn parse(mut command: clap::Command) -> Cli {
    let parsed = command.try_get_matches_from_mut(std::env::args_os());
    parsed.and_then(|matches| Cli::from_arg_matches(&matches)).unwrap_or_else(|error| {
        // In `zerkalo rendr a.toml`, clap takes `rendr` for a scene file and reports an error about
        // `a.toml`.
        let first = std::env::args_os().nth(1).unwrap_or_default();
        let first = first.to_string_lossy();
        let unknown = !first.starts_with('-') && Cli::command().find_subcommand(&*first).is_none();
        let last = std::env::args_os().next_back().unwrap_or_default();
        let last = last.to_string_lossy();
        if error.kind() == ErrorKind::MissingRequiredArgument
            && [".png", ".exr"].iter().any(|extension| last.ends_with(extension))
        {
            let what = format!("`-o {last}`, short for --output, writes the picture to this file");
            end(&Cli::command().error(error.kind(), what))
        }
        let kinds = [ErrorKind::ArgumentConflict, ErrorKind::UnknownArgument];
        if kinds.contains(&error.kind()) && unknown && !Path::new(&*first).exists() {
            end(&unknown_command(&first).0)
        }
        end(&error)
    })
}

/// Returns the error about `given`, which is no command, and `true` if it is a mistyped one.
fn unknown_command(given: &str) -> (clap::Error, bool) {
    let mut command = Cli::command();
    let names: Vec<_> = command.get_subcommands().map(|c| c.get_name().to_string()).collect();
    let near = nearest(given, names.iter().map(String::as_str));
    let hint = near.map_or(String::new(), |name| format!("; did you mean `{name}`?"));
    let message = format!("`{given}` is no command{hint}\nCommands: {}", names.join(", "));
    (command.error(ErrorKind::InvalidSubcommand, message), near.is_some())
}

/// Prints a usage error, the help or the version, and ends the program.
fn end(error: &clap::Error) -> ! {
    // Control characters in arguments must not reach the terminal.
    let has_control_characters = |argument: OsString| {
        let argument = argument.to_string_lossy();
        sanitized(&argument) != argument
    };
    if std::env::args_os().any(has_control_characters) {
        print_error(error.render().to_string().trim_end());
        std::process::exit(error.exit_code());
    }
    let printed = error.print();
    let failed = printed.is_err_and(|error| error.kind() != io::ErrorKind::BrokenPipe);
    std::process::exit(if failed { 1 } else { error.exit_code() })
}

/// Handles the signals that end a render: the first lets the command save its results. Repetitions
/// have no effect, because batch systems send a signal twice or every few seconds. Only a second
/// Ctrl-C in a terminal ends the program at once.
fn handle_signals() -> Result<Signals, Failure> {
    cancel_on_signals(Arc::default())
}

/// Handles signals as [`handle_signals`] does, and sets `cancel` on the first.
fn cancel_on_signals(cancel: Arc<AtomicBool>) -> Result<Signals, Failure> {
    let mut first = None;
    on_signal(move |status| {
        cancel.store(true, Ordering::Release);
        if IS_INTERRUPTIBLE.load(Ordering::Acquire) {
            std::process::exit(status.into());
        }
        let is_key = status == INTERRUPTED && is_in_foreground();
        let first = first.get_or_insert_with(Instant::now);
        if is_key && first.elapsed() >= SECOND_KEY {
            print_error("ended at once; what was not written is lost");
            std::process::exit(status.into());
        } else if is_key {
            warn("saving the results; Ctrl-C again ends at once");
        }
    })
}

/// Calls `on_end` with the exit status for each signal that asks the program to end.
fn on_signal(on_end: impl FnMut(u8) + Send + 'static) -> Result<Signals, Failure> {
    let signals = SignalQueue::of_batch_job().and_then(|queue| queue.handle(on_end));
    signals.map_err(|error| Failure::Failed(format!("no signals: {error}")))
}

/// `true` with `--quiet`.
static QUIET: AtomicBool = AtomicBool::new(false);

fn is_quiet() -> bool {
    QUIET.load(Ordering::Relaxed)
}

/// Prints a warning or note on stderr, unless `--quiet` is given. Errors of writing are ignored.
fn warn(message: &str) {
    if !is_quiet() {
        print_error(message);
    }
}

/// Prints a line on stderr. Errors of writing are ignored.
fn print_error(message: &str) {
    let _ = writeln!(io::stderr(), "{}", sanitized_lines(message));
}

/// Prints a line of results on stdout, unless `--quiet` is given.
fn print_line(message: &str) -> Result<(), Failure> {
    if is_quiet() { Ok(()) } else { write_line(io::stdout().lock(), message) }
}

/// Prints `results` as JSON. Characters that control a terminal are escaped.
fn print_json(results: &impl Serialize) -> Result<(), Failure> {
    let text = serde_json::to_string_pretty(results)?;
    let escaped = |c: char| match c {
        '\n' => c.to_string(),
        c if sanitized(c.encode_utf8(&mut [0; 4])).starts_with(c) => c.to_string(),
        c => c.encode_utf16(&mut [0; 2]).iter().map(|unit| format!("\\u{unit:04x}")).collect(),
    };
    write_line(io::stdout().lock(), &text.chars().map(escaped).collect::<String>())
}

/// Writes a line to `out`.
fn write_line(mut out: impl Write, message: &str) -> Result<(), Failure> {
    checked_stdout(writeln!(out, "{}", sanitized_lines(message)).and_then(|()| out.flush()))
}

/// Converts the result of writing to stdout. A closed pipe, as after `| head`, is not an error.
fn checked_stdout(written: io::Result<()>) -> Result<(), Failure> {
    match written {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
            Err(Failure::Failed(format!("cannot write to stdout: {error}")))
        }
        _ => Ok(()),
    }
}

/// `true` while there is nothing to save: signals end the program at once.
static IS_INTERRUPTIBLE: AtomicBool = AtomicBool::new(false);

/// Runs `load`, during which signals end the program at once.
fn interruptible<T>(load: impl FnOnce() -> T) -> T {
    IS_INTERRUPTIBLE.store(true, Ordering::Release);
    let loaded = load();
    IS_INTERRUPTIBLE.store(false, Ordering::Release);
    loaded
}

/// Path that stands for stdin or stdout.
const STREAM: &str = "-";

/// Reads a scene like [`scene_or_errors`].
fn read_scene(path: &Path) -> Result<Document, Failure> {
    scene_or_errors(path)?.map_err(|errors| Failure::Failed(errors.with_excerpts()))
}

/// Reads a scene from a file, from stdin or from the built-in scenes. Messages on stderr report the
/// loading of large files.
fn scene_or_errors(path: &Path) -> Result<Result<Document, SceneErrors>, Failure> {
    if let SceneSource::BuiltIn(index) = scenes::source(path)? {
        let (name, text) = BUILT_IN[index];
        return Ok(Document::parse(text.to_string(), &format!("{name}.toml")));
    }
    let assets = load_progress::reporting_on_stderr();
    if path != Path::new(STREAM) {
        return Ok(interruptible(|| Document::read(path, assets)));
    }
    if io::stdin().is_terminal() {
        let message = "the scene - comes from a pipe or a file, and stdin is a terminal";
        return Err(Failure::Usage(message.to_string()));
    }
    let stdin = io::stdin().as_fd().try_clone_to_owned().map(File::from);
    Ok(Document::read_opened(Path::new("stdin"), stdin, assets))
}

/// Reads a scene file and prints its warnings.
fn read_scene_and_warn(path: &Path) -> Result<Document, Failure> {
    let document = read_scene(path)?;
    warn_of_doubts(&document);
    Ok(document)
}

/// Prints the warnings about a scene file.
fn warn_of_doubts(document: &Document) {
    document.warnings.iter().for_each(|warning| warn(&format!("warning: {warning}")));
}

/// Warns if `options` demand single precision and `scene` requires double.
fn warn_of_precision(scene: &Scene, options: &world::Options) {
    if options.precision == Precision::Single && requires_double(scene) {
        warn(
            "warning: --precision single: the sizes or distances of this scene require double precision; \
             parts of the picture may be wrong. Remedy: --precision auto",
        );
    }
}

/// Escapes control characters in each line. File names may contain them.
fn sanitized_lines(message: &str) -> String {
    message.split('\n').map(sanitized).collect::<Vec<_>>().join("\n")
}
