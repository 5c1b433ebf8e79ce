//! `zerkalo [SCENE]`: the dashboard.

use crate::command::args::EditArgs;
use crate::command::load_progress::LoadReporter;
use crate::command::{Failure, warn, write_line};
use crate::dashboard::message::Exported;
use crate::dashboard::run::{DEFAULT_STOP, Ended, Setup, run as run_dashboard};
use std::env;
use std::io::{self, IsTerminal, Write};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use zerkalo_kernel::sampling::{SampleSettings, SamplerKind};
use zerkalo_render::film::Display;
use zerkalo_render::film::file::is_film_file;
use zerkalo_render::schedule::Settings;
use zerkalo_render::{Checkpoint, Options};
use zerkalo_scene::asset::Assets;
use zerkalo_scene::disk::open_regular;
use zerkalo_scene::value::sanitized;
use zerkalo_scene::{OPENING, OPENING_NAME, Recovery, SceneErrors, SceneFile, state_folder};
use zerkalo_terminal::Environment;
use zerkalo_world::{self as world, Precision};

pub fn run(args: &EditArgs) -> Result<(), Failure> {
    let environment = terminal_environment().map_err(|reason| {
        let scene = args.scene.as_deref().map_or("SCENE".into(), |s| s.to_string_lossy());
        let remedy = format!("`zerkalo render {scene} -o PICTURE.png` renders without one");
        Failure::Usage(format!("{reason}; {remedy}"))
    })?;
    let reporter = LoadReporter::new();
    let state = state_folder(|name| env::var_os(name));
    let film = args.scene.as_deref().filter(|path| is_film_file(path));
    let checkpoint = film.map(Checkpoint::read).transpose()?;
    let file = match (&checkpoint, &args.scene) {
        (Some(checkpoint), _) => Ok(scene_of(checkpoint, reporter.assets.clone())?),
        (None, Some(path)) => open(path, reporter.assets.clone(), state.as_deref())?,
        (None, None) => SceneFile::untitled(OPENING.to_string(), OPENING_NAME)
            .map_err(|errors| (PathBuf::new(), errors)),
    };
    reporter.mute();
    // If a checkpoint is opened, the render continues its samples with the same seed and sampler.
    let sampling = match &checkpoint {
        Some(checkpoint) => checkpoint.sampling(),
        None => SampleSettings { seed: args.compute.seed, kind: SamplerKind::Sobol },
    };
    let precision = match &checkpoint {
        Some(checkpoint) if checkpoint.header.film.precision == "double" => Precision::Double,
        Some(_) => Precision::Single,
        None => args.precision.precision,
    };
    let setup = Setup {
        file,
        checkpoint,
        state,
        threads: args.compute.threads(),
        options: Options {
            world: world::Options { precision, ..world::Options::default() },
            sampling,
            display: Display::default(),
        },
        settings: Settings::new(true, DEFAULT_STOP),
        terminal: args.terminal.setup(environment),
        trace: args.trace.clone(),
    };
    conclude(&run_dashboard(setup)?, io::stdout().lock())
}

/// Prints the results of a dashboard that has ended: names of written files on `out`, everything
/// else on stderr. If a signal ended the dashboard, the error holds the exit status of that signal,
/// even if `out` cannot be written because the terminal is lost.
pub fn conclude(ended: &Ended, mut out: impl Write) -> Result<(), Failure> {
    let mut lines = Vec::new();
    for exported in &ended.exported {
        match exported {
            Ok(exported) => lines.push(summary(exported)),
            Err(reason) => warn(reason),
        }
    }
    for written in &ended.checkpoints {
        match written {
            Ok(path) => lines.push(format!("{}  checkpoint", path.display())),
            Err(reason) => warn(reason),
        }
    }
    let printed = lines.iter().try_for_each(|line| write_line(&mut out, line));
    match &ended.kept {
        Ok(Some(path)) => {
            let path = path.display();
            warn(&format!("unsaved edits are kept in {path}; the next start offers them"));
        }
        Ok(None) => {}
        Err(reason) => warn(reason),
    }
    ended.latencies.iter().for_each(|line| warn(line));
    match ended.signalled {
        Some(status) => Err(Failure::Signalled(status)),
        None => printed,
    }
}

/// Returns the environment variables that describe the terminal. The error is the reason why stdin
/// and stdout cannot show the dashboard.
pub fn terminal_environment() -> Result<Environment, &'static str> {
    let environment = Environment::of(|name| env::var(name).ok());
    if !(io::stdin().is_terminal() && io::stdout().is_terminal()) {
        return Err("the dashboard needs a terminal");
    }
    match environment.term.as_str() {
        "dumb" => Err("TERM=dumb: the dashboard needs a terminal that can position text"),
        _ => Ok(environment),
    }
}

/// Opens the scene of a checkpoint. This is the scene file from which the checkpoint was rendered,
/// if the checkpoint's samples are still valid for the present content of this file. Otherwise it
/// is the scene that is stored in the checkpoint, as a scene without a file.
///
/// # Errors
/// Fails if the scene in the checkpoint is not valid.
fn scene_of(checkpoint: &Checkpoint, assets: Arc<Assets>) -> Result<SceneFile, Failure> {
    let source = checkpoint.header.source().unwrap_or_default();
    if let Ok(file) = SceneFile::open_with(Path::new(source), assets)
        && checkpoint.inputs.fit(file.document().scene())
    {
        return Ok(file);
    }
    Ok(SceneFile::untitled(checkpoint.inputs.scene.clone(), source)?)
}

/// Opens the scene file at `path`. If the file can be read but is not a valid scene, returns an
/// inner error: the path of the file and the errors of the scene. The dashboard shows these errors
/// until the user has corrected the file.
///
/// # Errors
/// Fails if the file cannot be read.
fn open(
    path: &Path,
    assets: Arc<Assets>,
    state: Option<&Path>,
) -> Result<Result<SceneFile, (PathBuf, SceneErrors)>, Failure> {
    match SceneFile::open_with(path, assets) {
        Ok(file) => {
            if let Some(warning) = file.document().migration_warning() {
                warn(&format!("warning: {warning}"));
            }
            Ok(Ok(file))
        }
        Err(errors) => match open_regular(path).is_ok() {
            true => Ok(Err((path.to_path_buf(), errors))),
            false => Err(Failure::Failed(errors.to_string() + &orphaned_edits(path, state))),
        },
    }
}

/// Returns a note about unsaved edits of the scene file `path`, which cannot be read. The note has
/// the path of the recovery file with these edits: a file of this user if there is one, otherwise a
/// file of another user. Returns an empty string if there are no unsaved edits.
fn orphaned_edits(path: &Path, state: Option<&Path>) -> String {
    let found = Recovery::new(Some(path), "", state).find();
    let hint = |path: &Path, of: String| {
        let path = sanitized(&path.display().to_string());
        format!("\nUnsaved edits{of} are kept in {path}, which is a scene file itself.")
    };
    match (found.orphans.first(), found.foreign.first()) {
        (Some(lost), _) => hint(lost.path(), " of it".to_string()),
        (None, Some((path, user))) => hint(path, format!(" of user {}", sanitized(user))),
        (None, None) => String::new(),
    }
}

/// Formats the line that is printed about an exported picture, such as `mirror-room-1.png 640x480
/// 212 spp noise 0.50 8-bit levels`.
fn summary(exported: &Exported) -> String {
    let [width, height] = exported.size;
    let noise = match exported.noise_levels {
        Some(levels) => format!("{levels:.2} 8-bit levels"),
        None => "unknown".to_string(),
    };
    let path = exported.path.display();
    format!("{path}  {width}x{height}  {:.0} spp  noise {noise}", exported.spp)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Writer on which every write fails, as on a terminal that was closed.
    struct Gone;

    impl Write for Gone {
        fn write(&mut self, _: &[u8]) -> io::Result<usize> {
            Err(io::Error::from_raw_os_error(5))
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn ended(signalled: Option<u8>) -> Ended {
        let exported = Exported {
            path: PathBuf::from("room.png"),
            size: [60, 40],
            spp: 4.0,
            noise_levels: None,
            scp: String::new(),
        };
        Ended {
            signalled,
            exported: vec![Ok(exported)],
            kept: Ok(None),
            checkpoints: vec![Ok(PathBuf::from("room.film"))],
            latencies: Vec::new(),
        }
    }

    /// Checks that the program returns the exit status of a signal even if writing to standard
    /// output fails, as it does after the connection was lost.
    #[test]
    fn status_of_a_signal_does_not_depend_on_stdout() {
        let status = |signalled, out: &mut dyn Write| match conclude(&ended(signalled), out) {
            Ok(()) => 0,
            Err(Failure::Signalled(status)) => status,
            Err(Failure::Failed(_) | Failure::Usage(_)) => 1,
        };
        assert_eq!(status(Some(129), &mut Gone), 129);
        assert_eq!(status(None, &mut Gone), 1, "a result that is not shown is a failure");
        let mut text = Vec::new();
        assert_eq!(status(None, &mut text), 0);
        let expected = "room.png  60x40  4 spp  noise unknown\nroom.film  checkpoint\n";
        assert_eq!(String::from_utf8(text).unwrap(), expected);
    }
}
