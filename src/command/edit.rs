//! `zerkalo [SCENE]`: the dashboard.

use crate::command::args::EditArgs;
use crate::command::{Failure, is_quiet, load_progress, print_error, scenes, warn, write_line};
use crate::dashboard::message::Exported;
use crate::dashboard::preferences::Preferences;
use crate::dashboard::run::{Ended, FaultyFile, Loading, Setup, run as run_dashboard};
use crate::dashboard::scene_source::SceneSource;
use crossbeam_channel::unbounded;
use std::env;
use std::io::{self, IsTerminal, Write};
use std::path::Path;
use std::sync::Arc;
use zerkalo_kernel::sampling::{SampleSettings, SamplerKind};
use zerkalo_render::film::Display;
use zerkalo_render::film::file::is_film_file;
use zerkalo_render::{Checkpoint, Options};
use zerkalo_scene::asset::Assets;
use zerkalo_scene::disk::open_regular;
use zerkalo_scene::value::sanitized;
use zerkalo_scene::{Recovery, SceneFile, Tone, state_folder};
use zerkalo_terminal::Environment;

pub fn run(args: &EditArgs, preferences: Preferences) -> Result<(), Failure> {
    let scene = args.scene.as_deref().map_or("SCENE".into(), |s| s.to_string_lossy());
    let environment = terminal_environment(&format!(
        "`zerkalo render {scene} -o PICTURE.png` renders without one"
    ))?;
    let (stage, stages) = unbounded();
    let assets = load_progress::reporting(move |text| drop(stage.send(text)));
    let terminal = args.terminal.setup(environment, preferences);
    let args = args.clone();
    let ended = run_dashboard(
        Loading { name: scene.into_owned(), stages },
        move || setup(&args, assets),
        terminal,
    )?;
    conclude(&ended, io::stdout().lock())
}

/// Reads the scene or the checkpoint of `args`.
fn setup(args: &EditArgs, assets: Arc<Assets>) -> Result<Setup, Failure> {
    if let Some(reason) = args.scene.as_deref().and_then(no_scene) {
        return Err(Failure::Failed(reason));
    }
    let state = state_folder(|name| env::var_os(name));
    let film = args.scene.as_deref().filter(|path| is_film_file(path));
    let checkpoint = film.map(Checkpoint::read).transpose()?;
    let file = match (&checkpoint, &args.scene) {
        (Some(checkpoint), _) => Ok(scene_of(checkpoint, assets)?),
        (None, Some(path)) => scenes::source(path)?
            .open(assets)
            .map_err(|errors| FaultyFile { path: path.clone(), errors }),
        (None, None) => Ok(SceneSource::BuiltIn(0).open(assets)?),
    };
    if let Err(FaultyFile { path, errors }) = &file
        && open_regular(path).is_err()
    {
        return Err(Failure::Failed(errors.to_string() + &orphaned_edits(path, state.as_deref())));
    }
    // A continued render keeps its seed, sampler and precision.
    let (sampling, precision) = match &checkpoint {
        Some(checkpoint) => (checkpoint.sampling(), checkpoint.header.film.precision),
        None => {
            let sampling = SampleSettings { seed: args.compute.seed, kind: SamplerKind::Sobol };
            (sampling, args.precision.precision)
        }
    };
    let tone =
        file.as_ref().map_or_else(|_| Tone::default(), |file| file.document.scene().film.tone);
    let display = Display { tone, ..Display::default() };
    Ok(Setup {
        file,
        checkpoint,
        state,
        threads: args.compute.threads(),
        options: Options::new(precision, sampling, display),
        trace: args.trace.clone(),
    })
}

/// Returns the reason why `path` names no scene, and what to do; `None` if it may name one.
fn no_scene(path: &Path) -> Option<String> {
    let shown = sanitized(&path.display().to_string());
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty());
    let extension = path.extension().map(|extension| extension.to_string_lossy().to_lowercase());
    match extension.as_deref() {
        Some("obj" | "ply" | "stl" | "gltf" | "glb") => Some(format!(
            "{shown} is a mesh, not a scene: `zerkalo new-scene.toml` begins one, where `a mesh` Enter adds it"
        )),
        Some("png" | "exr" | "hdr" | "jpg" | "jpeg") => Some(format!(
            "{shown} is a picture, not a scene: `zerkalo info {shown}` tells its origin"
        )),
        None if !path.exists() && matches!(SceneSource::of(&shown), SceneSource::File(_)) => {
            (!shown.starts_with(':')).then(|| {
                format!("there is no file {shown}; the name of a new scene ends in .toml: `zerkalo {shown}.toml`")
            })
        }
        _ if folder.is_some_and(|folder| !folder.is_dir()) => {
            let folder = folder.unwrap_or(path).display().to_string();
            Some(format!("{shown}: there is no folder {}", sanitized(&folder)))
        }
        _ => None,
    }
}

/// Prints the results of a dashboard: names of written files on `out`, everything else on stderr.
/// After a signal, returns the signal's exit status as an error, even if printing failed.
pub fn conclude(ended: &Ended, mut out: impl Write) -> Result<(), Failure> {
    let mut lines = Vec::new();
    for exported in &ended.exported {
        match exported {
            Ok(Exported { path, description, .. }) => {
                lines.push(format!("{}  {description}", path.display()));
            }
            Err(reason) => print_error(reason),
        }
    }
    lines.retain(|_| !is_quiet());
    let printed = lines.iter().try_for_each(|line| write_line(&mut out, line));
    match &ended.kept {
        Ok(Some(path)) => {
            let path = path.display();
            warn(&format!("unsaved edits are kept in {path}; the next start offers them"));
        }
        Ok(None) => {}
        Err(reason) => print_error(reason),
    }
    match ended.signalled {
        Some(status) => Err(Failure::Signalled(status)),
        None => printed,
    }
}

/// Returns the reason why the terminal cannot show the dashboard; `None` if it can.
pub fn obstacle(environment: &Environment) -> Option<&'static str> {
    if !(io::stdin().is_terminal() && io::stdout().is_terminal()) {
        return Some("the dashboard needs a terminal at stdin and stdout");
    }
    let is_dumb = environment.term == "dumb";
    is_dumb.then_some("the dashboard needs a terminal that can position text, and TERM is dumb")
}

/// Returns the environment of the terminal.
///
/// # Errors
/// Fails if the terminal cannot show the dashboard. `remedy` is a part of the message.
pub fn terminal_environment(remedy: &str) -> Result<Environment, Failure> {
    let environment = Environment::of(|name| env::var(name).ok());
    match obstacle(&environment) {
        Some(reason) => Err(Failure::Usage(format!("{reason}; {remedy}"))),
        None => Ok(environment),
    }
}

/// Opens the scene of a checkpoint: its scene file if the samples are still valid for the scene in
/// that file, otherwise the scene stored in the checkpoint.
///
/// # Errors
/// Fails if the stored scene is not valid.
fn scene_of(checkpoint: &Checkpoint, assets: Arc<Assets>) -> Result<SceneFile, Failure> {
    let source = checkpoint.header.source().unwrap_or_default();
    if let Ok(file) = SceneFile::open_with(Path::new(source), assets)
        && checkpoint.inputs.fit(file.document.scene())
    {
        return Ok(file);
    }
    Ok(SceneFile::untitled(checkpoint.inputs.scene.clone(), source)?)
}

/// Returns a note about unsaved edits of the unreadable scene file `path`; empty if there are none.
/// Edits of this user take precedence over those of another user.
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

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
            description: "60x40  4 spp  noise unknown".to_string(),
            advice: String::new(),
            is_image: true,
        };
        Ended { signalled, exported: vec![Ok(exported)], kept: Ok(None) }
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
        let expected = "room.png  60x40  4 spp  noise unknown\n";
        assert_eq!(String::from_utf8(text).unwrap(), expected);
    }
}
