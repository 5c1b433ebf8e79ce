//! `zerkalo [SCENE]`: the dashboard.

use crate::asset::Assets;
use crate::command::args::{ColorArg, EditArgs};
use crate::command::load_progress::LoadReporter;
use crate::command::{Failure, all_threads, print_line, warn};
use crate::dashboard::message::Exported;
use crate::dashboard::run::{Colors, DEFAULT_STOP, Setup, run as run_dashboard};
use crate::film::Display;
use crate::render::Options;
use crate::render::schedule::{Criterion, Settings};
use crate::sampling::{SampleSettings, SamplerKind};
use crate::scene::{BUILT_IN, Recovery, SceneErrors, SceneFile, state_folder};
use crate::terminal::Environment;
use crate::value::sanitized;
use crate::world;
use std::env;
use std::fs::File;
use std::io::{self, IsTerminal};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// What the built-in scene is called.
const BUILT_IN_NAME: &str = "mirror-room.toml";

pub fn run(args: &EditArgs) -> Result<(), Failure> {
    let surroundings = Environment::of(|name| env::var(name).ok());
    let terminals = io::stdin().is_terminal() && io::stdout().is_terminal();
    if !terminals || surroundings.term == "dumb" {
        let scene = args.scene.as_deref().map_or("SCENE".into(), |s| s.to_string_lossy());
        let why = match terminals {
            true => "TERM=dumb: a terminal that cannot place text shows no dashboard",
            false => "the dashboard needs a terminal",
        };
        return Err(Failure::Usage(format!(
            "{why}; `zerkalo render {scene} -o PICTURE.png` renders without \
             one"
        )));
    }
    let reading = LoadReporter::new();
    let state = state_folder(|name| env::var_os(name));
    let file = match &args.scene {
        Some(path) => opened(path, reading.assets.clone(), state.as_deref())?,
        None => SceneFile::untitled(BUILT_IN.to_string(), BUILT_IN_NAME)
            .map_err(|errors| (PathBuf::new(), errors)),
    };
    reading.mute();
    let setup = Setup {
        file,
        state,
        threads: args.threads.map_or_else(all_threads, usize::from),
        options: Options {
            world: world::Options { precision: args.precision.precision() },
            sampling: SampleSettings { seed: args.seed, kind: SamplerKind::Sobol },
            display: Display::default(),
        },
        settings: Settings {
            adaptive: true,
            criterion: Criterion::Codes,
            // The scene's; the session puts it in.
            rays_per_pixel: 0,
            stop: DEFAULT_STOP,
        },
        colors: colors(args.color),
        surroundings,
        bandwidth: args.bandwidth.map(|kilobytes| 1e3 * kilobytes),
        trace: args.trace.clone(),
    };
    let ended = run_dashboard(setup).map_err(|error| Failure::Failed(error.to_string()))?;
    for exported in &ended.exported {
        match exported {
            Ok(exported) => print_line(&told(exported)),
            Err(why) => warn(why),
        }
    }
    if let Some(path) = &ended.kept {
        let path = path.display();
        warn(&format!("unsaved edits are kept in {path}; the next start offers them"));
    }
    ended.latencies.iter().for_each(|line| warn(line));
    ended.signalled.map_or(Ok(()), |status| Err(Failure::Signalled(status)))
}

/// The scene's file. One that can be read but holds no scene is the dashboard's to show: its user may
/// mend it meanwhile.
fn opened(
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
        Err(errors) => {
            let readable = File::open(path).and_then(|file| file.metadata());
            match readable.is_ok_and(|metadata| metadata.is_file()) {
                true => Ok(Err((path.to_path_buf(), errors))),
                false => Err(Failure::Failed(errors.to_string() + &lost(path, state))),
            }
        }
    }
}

/// A hint at edits of a scene whose file is gone, if there are any.
fn lost(path: &Path, state: Option<&Path>) -> String {
    let found = Recovery::new(Some(path), "", state).find();
    let hint = |path: &Path| {
        let path = sanitized(&path.display().to_string());
        format!("\nUnsaved edits of it are kept in {path}, which is a scene file itself.")
    };
    found.orphans.first().map_or(String::new(), |lost| hint(lost.path()))
}

/// `mirror-room-1.png  640x480  212 spp  noise 0.50 codes`
fn told(exported: &Exported) -> String {
    let [width, height] = exported.size;
    let noise = match exported.noise_codes {
        Some(codes) => format!("{codes:.2} codes"),
        None => "unknown".to_string(),
    };
    let path = exported.path.display();
    format!("{path}  {width}x{height}  {:.0} spp  noise {noise}", exported.spp)
}

/// How many colours the user says that the terminal has, if so.
fn colors(asked: ColorArg) -> Option<Colors> {
    match asked {
        ColorArg::True => Some(Colors::True),
        ColorArg::Indexed => Some(Colors::Indexed),
        ColorArg::Sixteen => Some(Colors::Sixteen),
        ColorArg::None => Some(Colors::Mono),
        ColorArg::Auto => None,
    }
}
