//! The picture in its panel as tiles. The terminal emulator ignores graphics protocols, so that the
//! test decodes the tiles from the program's output.

use super::picture::Picture;
use super::stills::{CELL, CELL_PX, KITTY};
use super::*;
use crate::command_line::signals::signal;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use zerkalo_terminal::{ATTRIBUTES, LEAVE};

/// Returns the picture that the tiles in the output show, or `None` if a tile is missing. The first
/// tile is at the upper left corner.
fn assembled(bytes: &str, size: [usize; 2]) -> Option<Vec<u8>> {
    let mut letters = String::new();
    let mut place = [0; 2];
    let mut tiles: BTreeMap<[usize; 2], Picture> = BTreeMap::new();
    let pieces: Vec<_> = bytes.split("\x1b_G").collect();
    for pair in pieces.windows(2) {
        let Some((keys, data)) = pair[1].split_once(';') else { continue };
        if keys.contains('\x1b') {
            continue;
        }
        if keys.starts_with("a=T") {
            // The cursor was moved just before.
            let (_, position) = pair[0].rsplit_once("\x1b[")?;
            let (row, column) = position.strip_suffix('H')?.split_once(';')?;
            place = [column.parse().ok()?, row.parse().ok()?];
            letters.clear();
        }
        // The last piece may still be on its way.
        letters += data.split_once('\x1b')?.0;
        if keys.ends_with("m=0") && !letters.is_empty() {
            let png = STANDARD.decode(&letters).ok()?;
            tiles.insert(place, Picture::of_png(&png));
            letters.clear();
        }
    }
    let mut rgb = vec![0; 3 * size[0] * size[1]];
    let [x0, y0] = [0, 1].map(|i| tiles.keys().map(|at| at[i]).min().unwrap_or(0));
    let mut covered = 0;
    for ([column, row], tile) in tiles {
        let (x, y) = ((column - x0) * CELL_PX[0], (row - y0) * CELL_PX[1]);
        covered += tile.size[0] * tile.size[1];
        for (i, line) in tile.rgb.chunks(3 * tile.size[0]).enumerate() {
            let start = 3 * ((y + i) * size[0] + x);
            rgb[start..start + line.len()].copy_from_slice(line);
        }
    }
    (covered == size[0] * size[1]).then_some(rgb)
}

#[test]
fn tiles_show_the_exported_picture() {
    let fixture = Fixture::with_room();
    let command = [PROGRAM, "room.toml"];
    let start = Start {
        command: &command,
        folder: fixture.0.path(),
        size: [120, 36],
        env: &[],
        replies: true,
    };
    let mut terminal = Terminal::start_with(&start, &[KITTY, CELL]);
    terminal.wait_for_text(" spp");
    terminal.wait_for_text("converged");
    terminal.send("p");
    terminal.wait_for_text("o shows it");
    let file = Picture::of_png(&fs::read(fixture.path("room-1.png")).unwrap());
    let is_shown = |terminal: &Terminal| {
        let bytes = String::from_utf8_lossy(&terminal.bytes()).into_owned();
        assembled(&bytes, file.size).is_some_and(|rgb| rgb == file.rgb)
    };
    let until = Instant::now() + Duration::from_secs(60);
    while !is_shown(&terminal) {
        let count = || String::from_utf8_lossy(&terminal.bytes()).matches("a=T,").count();
        assert!(Instant::now() < until, "{} tiles do not show the file", count());
        std::thread::sleep(Duration::from_millis(100));
    }
    // A move of the camera removes the tiles, and a signal those that have come back.
    let removal = "\x1b_Ga=d,d=A,q=2\x1b\\";
    let count =
        |terminal: &Terminal| String::from_utf8_lossy(&terminal.bytes()).matches(removal).count();
    assert_eq!(count(&terminal), 0);
    terminal.send("\x1b[D");
    terminal.wait_for_text("view, not the camera");
    while count(&terminal) == 0 {
        assert!(Instant::now() < until, "the tiles stay");
        std::thread::sleep(Duration::from_millis(20));
    }
    terminal.send(" ");
    let before = terminal.bytes().len();
    while !String::from_utf8_lossy(&terminal.bytes()[before..]).contains("a=T,") {
        assert!(Instant::now() < until, "the tiles never come back");
        std::thread::sleep(Duration::from_millis(20));
    }
    signal("TERM", terminal.process_id());
    let (_, bytes) = terminal.end();
    assert!(bytes.contains(&format!("\x1b_Gm=0,q=2;\x1b\\{removal}{ATTRIBUTES}{LEAVE}")));
}
