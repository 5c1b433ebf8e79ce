//! The dashboard as its users meet it: the program itself in a real terminal.
#![cfg(unix)]

mod editing;
mod hostile;
mod life;
mod picture;
mod stills;
mod stopping;
mod terminal;

use std::fs;
use std::path::PathBuf;
use std::process::Command;
use tempfile::TempDir;
use terminal::{Start, Terminal};

const PROGRAM: &str = env!("CARGO_BIN_EXE_zerkalo");

/// A folder to work in.
struct Desk(TempDir);

impl Desk {
    fn new() -> Self {
        Self(TempDir::new().unwrap())
    }

    /// With the mirror room in it, as `room.toml`.
    fn with_room() -> Self {
        let desk = Self::new();
        fs::write(desk.path("room.toml"), zerkalo::scene::BUILT_IN).unwrap();
        desk
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// The dashboard in a terminal of `size` columns and rows.
    fn open(&self, args: &[&str], size: [u16; 2]) -> Terminal {
        let command = [&[PROGRAM], args].concat();
        Terminal::start(&Start {
            command: &command,
            folder: self.0.path(),
            size,
            env: &[],
            answers: true,
        })
    }

    /// What `zerkalo render` writes.
    fn rendered(&self, args: &[&str], output: &str) -> Vec<u8> {
        let mut command = Command::new(PROGRAM);
        command.arg("render").args(args).args(["-o", output]).current_dir(self.0.path());
        let run = command.output().unwrap();
        assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
        fs::read(self.path(output)).unwrap()
    }
}

/// Waits until some cells show a picture: half blocks in colours of 24 bits.
fn wait_for_picture(terminal: &Terminal) {
    terminal.wait_for("a picture", |screen| (picture_cells(screen) > 100).then_some(()));
}

/// Cells whose halves have colours of 24 bits.
fn picture_cells(screen: &vt100::Screen) -> usize {
    let (rows, columns) = screen.size();
    let cells = (0..rows.get()).flat_map(|row| (0..columns.get()).map(move |column| (row, column)));
    let is_picture = |(row, column)| {
        let cell = screen.cell(row, column);
        cell.is_some_and(|cell| {
            matches!(cell.bgcolor(), vt100::Color::Rgb(..))
                && ["▀", "▄", " "].contains(&cell.contents())
        })
    };
    cells.filter(|at| is_picture(*at)).count()
}
