//! Golden test: the text of every screen is compared with the files in `tests/screens`.

use crate::dashboard::view::tests::states::{STATES, tracing};
use crate::dashboard::view::tests::{drawn, row_text};
use std::fmt::Write as _;
use std::path::Path;

/// Columns and rows of the terminals for which screens are compared.
const SIZES: [[u16; 2]; 5] = [[200, 60], [120, 36], [80, 24], [40, 12], [39, 11]];

#[test]
fn screens_match_golden_files() {
    let folder = Path::new(env!("ZERKALO_ROOT")).join("tests/screens");
    let bless = std::env::var_os("ZERKALO_BLESS").is_some();
    let mut different = Vec::new();
    for (name, make) in STATES {
        let mut text = String::new();
        for screen in SIZES {
            let mut model = tracing(screen);
            make(&mut model);
            let (buffer, cursor) = drawn(&model);
            let _ = write!(text, "{}x{}", screen[0], screen[1]);
            if let Some(at) = cursor {
                let _ = write!(text, ", cursor in column {} of row {}", at.x, at.y);
            }
            text.push('\n');
            for y in 0..screen[1] {
                let _ = writeln!(text, "{}", row_text(&buffer, y));
            }
        }
        let path = folder.join(format!("{name}.txt"));
        if bless {
            std::fs::write(&path, &text).unwrap();
        } else if std::fs::read_to_string(&path).unwrap_or_default() != text {
            let got = std::env::temp_dir().join(format!("zerkalo-screen-{name}.txt"));
            std::fs::write(&got, &text).unwrap();
            different.push(format!("{} is now {}", path.display(), got.display()));
        }
    }
    assert!(different.is_empty(), "{}\nZERKALO_BLESS=1 takes them over", different.join("\n"));
}

/// Checks that every file in `tests/screens` belongs to one of `STATES`, the states of the model
/// that the golden test draws.
#[test]
fn every_screen_has_its_state() {
    let folder = Path::new(env!("ZERKALO_ROOT")).join("tests/screens");
    for entry in std::fs::read_dir(folder).unwrap() {
        let name = entry.unwrap().file_name().into_string().unwrap();
        let state = name.strip_suffix(".txt").unwrap_or_default();
        assert!(STATES.iter().any(|(known, _)| *known == state), "{name}");
    }
}
