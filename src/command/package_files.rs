//! `zerkalo completions` and `zerkalo man`: files of packages.

use crate::command::args::Cli;
use crate::command::{Failure, checked_stdout};
use clap::CommandFactory;
use clap_complete::Shell;
use std::io::{self, Write};
use std::path::Path;

pub fn print_completions(shell: Shell) -> Result<(), Failure> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "zerkalo", &mut script);
    checked_stdout(io::stdout().write_all(&script))
}

pub fn write_manual(folder: &Path) -> Result<(), Failure> {
    std::fs::create_dir_all(folder)
        .and_then(|()| clap_mangen::generate_to(Cli::command(), folder))
        .map_err(|error| Failure::Failed(format!("cannot write to {}: {error}", folder.display())))
}
