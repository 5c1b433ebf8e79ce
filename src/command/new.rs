//! `zerkalo new`: writes a starter scene.

use crate::command::args::NewArgs;
use crate::command::{Failure, print_line};
use crate::scene::starter;
use std::fs::OpenOptions;
use std::io::{ErrorKind, Write};

pub fn run(args: &NewArgs) -> Result<(), Failure> {
    let shown = args.file.display();
    // `create_new` checks for an existing file and creates the file in one atomic step.
    let created = OpenOptions::new().write(true).create_new(true).open(&args.file);
    created.and_then(|mut file| file.write_all(starter().as_bytes())).map_err(|error| {
        Failure::Failed(match error.kind() {
            ErrorKind::AlreadyExists => {
                format!("{shown} exists and was not changed; name another file or remove it first")
            }
            ErrorKind::NotFound => {
                format!("cannot write {shown}: its directory does not exist; create it first")
            }
            _ => format!("cannot write {shown}: {error}"),
        })
    })?;
    print_line(&format!("{shown} written; `zerkalo render {shown} -o PICTURE.png` renders it"));
    Ok(())
}
