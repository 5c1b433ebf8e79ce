//! `zerkalo new`: writes a starter scene to a new file.

use crate::command::{Failure, print_line};
use std::io::Write;
use std::path::Path;
use zerkalo_scene::disk::{Existing, replace_file};

/// Text of a small scene with comments, from which users start a scene of their own.
const STARTER: &str = include_str!("starter.toml");

pub fn run(path: &Path) -> Result<(), Failure> {
    replace_file(path, Existing::Refuse, |file| file.write_all(STARTER.as_bytes())).map(drop)?;
    let shown = path.display();
    print_line(&format!(
        "{shown} written; `zerkalo {shown}` opens it in the dashboard, `zerkalo render {shown} -o \
         PICTURE.png` renders it"
    ))
}

#[cfg(test)]
mod tests {
    use super::STARTER;
    use zerkalo_scene::Scene;
    use zerkalo_scene::shape::KINDS;

    #[test]
    fn starter_scene_has_no_warnings_and_names_every_shape() {
        let scene = Scene::parse(STARTER, "starter").unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(scene.warnings(), []);
        for kind in KINDS {
            assert!(STARTER.contains(kind.name), "{}", kind.name);
        }
    }
}
