//! `zerkalo new`: writes a starter scene.

use crate::command::args::NewArgs;
use crate::command::{Failure, print_line};
use crate::disk::{Existing, Replacement};
use crate::scene::starter;
use std::io::Write;

pub fn run(args: &NewArgs) -> Result<(), Failure> {
    let written = Replacement::begin(&args.file, Existing::Refuse).and_then(|mut new| {
        let written = new.temporary().write_all(starter().as_bytes());
        written.map_err(|error| new.explain(&error))?;
        new.commit()
    });
    written.map_err(|error| Failure::Failed(error.to_string()))?;
    let shown = args.file.display();
    print_line(&format!("{shown} written; `zerkalo render {shown} -o PICTURE.png` renders it"))
}
