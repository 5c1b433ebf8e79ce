//! `zerkalo watch`: shows films that other processes or machines write.

use crate::command::Failure;
use crate::command::args::WatchArgs;
use crate::command::edit::{conclude, terminal_environment};
use crate::dashboard::preferences::Preferences;
use crate::dashboard::run::{Loading, watch as watch_films};
use crossbeam_channel::never;
use std::io;
use zerkalo_render::plan::FilmFiles;

pub fn run(args: &WatchArgs, preferences: Preferences) -> Result<(), Failure> {
    let remedy = "`zerkalo merge --partial FILE.zk.. -o PICTURE.png` writes a picture of parts";
    let environment = terminal_environment(remedy)?;
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let terminal = args.terminal.setup(environment, preferences);
    let files = args.files.clone();
    let load = move || FilmFiles::open(&files).map_err(Failure::from);
    let loading = Loading { name: "films".to_string(), stages: never() };
    let ended = watch_films(loading, load, threads, terminal)?;
    conclude(&ended, io::stdout().lock())
}
