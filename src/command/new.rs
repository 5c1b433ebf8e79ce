//! `zerkalo new`: writes a starter scene to a new file.

use crate::command::args::NewArgs;
use crate::command::{Failure, print_line};
use crate::disk::{Existing, replace_file};
use crate::scene::starter;
use std::io::Write;

pub fn run(args: &NewArgs) -> Result<(), Failure> {
    let starter = starter().as_bytes();
    replace_file(&args.file, Existing::Refuse, |file| file.write_all(starter))?;
    let shown = args.file.display();
    print_line(&format!("{shown} written; `zerkalo render {shown} -o PICTURE.png` renders it"))
}
