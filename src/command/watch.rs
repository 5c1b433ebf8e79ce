//! `zerkalo watch`: shows films that other processes or machines write.

use crate::command::Failure;
use crate::command::args::WatchArgs;
use crate::command::edit::{conclude, terminal_environment};
use crate::dashboard::preferences::Preferences;
use crate::dashboard::run::watch as watch_films;
use std::io;
use zerkalo_render::plan::FilmFiles;

pub fn run(args: &WatchArgs, preferences: Preferences) -> Result<(), Failure> {
    let remedy = "`zerkalo merge --partial FILE.zk.. -o PICTURE.png` writes a picture of parts";
    let environment = terminal_environment(remedy)?;
    let films = FilmFiles::open(&args.files)?;
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let terminal = args.terminal.setup(environment, preferences);
    let ended = watch_films(films, threads, terminal)?;
    conclude(&ended, io::stdout().lock())
}
