//! `zerkalo new`: writes a starter scene to a new file.

use crate::command::{Failure, print_line};
use std::io::Write;
use std::path::Path;
use zerkalo_scene::disk::{Existing, replace_file};
use zerkalo_scene::starter;

pub fn run(path: &Path) -> Result<(), Failure> {
    let starter = starter().as_bytes();
    replace_file(path, Existing::Refuse, |file| file.write_all(starter))?;
    let shown = path.display();
    print_line(&format!("{shown} written; `zerkalo render {shown} -o PICTURE.png` renders it"))
}
