//! End-to-end tests of the dashboard: the program itself in a pseudo-terminal.
#![cfg(unix)]

mod checkpoints;
mod editing;
mod hostile;
mod life;
mod limits;
mod panel;
mod picture;
mod stills;
mod stopping;
pub mod terminal;
mod watch;

use crate::harness::*;
use std::process::Command;
use tempfile::TempDir;
use terminal::{Start, Terminal};

const PROGRAM: &str = env!("CARGO_BIN_EXE_zerkalo");

/// Temporary folder in which the program runs. It contains the scene, and gets the exported files.
struct Fixture(TempDir);

impl Fixture {
    fn new() -> Self {
        Self(TempDir::new().unwrap())
    }

    /// Creates a folder with the built-in scene as `room.toml`.
    fn with_room() -> Self {
        let fixture = Self::new();
        fs::write(fixture.path("room.toml"), MIRROR_ROOM).unwrap();
        fixture
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Starts the dashboard in a terminal of `size` columns and rows.
    fn open(&self, args: &[&str], size: [u16; 2]) -> Terminal {
        let command = [&[PROGRAM], args].concat();
        Terminal::start(&Start {
            command: &command,
            folder: self.0.path(),
            size,
            env: &[],
            replies: true,
        })
    }

    fn run(&self, args: &[&str]) {
        let run = Command::new(PROGRAM).args(args).current_dir(self.0.path()).output().unwrap();
        assert!(run.status.success(), "{args:?}: {}", String::from_utf8_lossy(&run.stderr));
    }

    /// Runs `zerkalo render` with `args`. Returns the contents of the file `output` that it writes.
    fn rendered(&self, args: &[&str], output: &str) -> Vec<u8> {
        self.run(&[&["render"], args, &["-o", output]].concat());
        fs::read(self.path(output)).unwrap()
    }
}

/// Waits until more than 100 cells of the screen show a picture, as half blocks in 24-bit colours.
fn wait_for_picture(terminal: &Terminal) {
    terminal.wait_for("a picture", |screen| (picture_cells(screen) > 100).then_some(()));
}

/// Returns the number of cells with a 24-bit background colour.
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
