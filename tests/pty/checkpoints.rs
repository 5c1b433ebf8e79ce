//! Checkpoints of the dashboard: written on request, continued after a kill.

use super::*;
use std::time::{Duration, Instant};
use zerkalo::film::Film;
use zerkalo::film::file::FilmReader;

fn film(path: PathBuf) -> Film {
    FilmReader::open(&path).and_then(FilmReader::read).unwrap_or_else(|e| panic!("{e}")).1
}

/// Waits until there is a file. It is complete from then on.
fn wait_for_file(fixture: &Fixture, name: &str) {
    let end = Instant::now() + Duration::from_secs(60);
    while !fixture.path(name).exists() {
        assert!(Instant::now() < end, "no {name}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// A dashboard that is killed after a checkpoint, and one that continues it, end with the film of
/// `zerkalo render`.
#[test]
fn killed_dashboard_continues_from_its_checkpoint() {
    let fixture = Fixture::with_room();
    // Noise that takes a few seconds.
    let text = fs::read_to_string(fixture.path("room.toml")).unwrap();
    let text = text.replace("size = [640, 480]", "size = [320, 240]");
    fs::write(fixture.path("room.toml"), &text).unwrap();
    let args = ["room.toml", "--noise", "0.5", "--checkpoint", "whole.zk"];
    fixture.rendered(&args, "whole.png");
    let whole = film(fixture.path("whole.zk"));

    let mut terminal = fixture.open(&["room.toml"], [120, 36]);
    wait_for_picture(&terminal);
    terminal.send("K");
    wait_for_file(&fixture, "room-1.zk");
    let kill = Command::new("kill").args(["-9", &terminal.process_id().to_string()]).status();
    assert!(kill.unwrap().success());
    // A killed program does not restore its terminal, which `end` would demand.
    drop(terminal);
    let before = film(fixture.path("room-1.zk")).samples();
    assert!(before > 0 && before <= whole.samples());

    let mut terminal = fixture.open(&["room-1.zk"], [120, 36]);
    wait_for_picture(&terminal);
    // The scene file is open, not the copy in the checkpoint.
    terminal.wait_for_text("room.toml");
    for number in 2.. {
        terminal.send("K");
        let name = format!("room-{number}.zk");
        wait_for_file(&fixture, &name);
        let now = film(fixture.path(&name));
        assert!(now.samples() >= before, "the samples of the checkpoint are lost");
        if now.samples() == whole.samples() {
            assert!(now.bytes() == whole.bytes(), "the film differs");
            break;
        }
        assert!(number < 200, "{} samples, {} expected", now.samples(), whole.samples());
        std::thread::sleep(Duration::from_millis(200));
    }
    // A checkpoint that was requested last is complete when the program has ended.
    terminal.send("Kq");
    let (status, bytes) = terminal.end();
    assert_eq!(status, 0, "{bytes}");
    let files = fs::read_dir(fixture.0.path()).unwrap().map(|e| e.unwrap().file_name());
    let checkpoints = files.filter(|name| name.to_string_lossy().ends_with(".zk"));
    checkpoints.for_each(|name| assert_eq!(film(fixture.0.path().join(name)).width(), 320));
}

/// Without its scene file, a checkpoint opens the scene that it contains.
#[test]
fn checkpoint_contains_its_scene() {
    let fixture = Fixture::with_room();
    fixture
        .rendered(&["room.toml", "--size", "64x48", "--spp", "4", "--checkpoint", "a.zk"], "a.png");
    fs::remove_file(fixture.path("room.toml")).unwrap();
    let mut terminal = fixture.open(&["a.zk"], [120, 36]);
    wait_for_picture(&terminal);
    terminal.send("q");
    assert_eq!(terminal.end().0, 0);
    let bytes = fs::read(fixture.path("a.zk")).unwrap();
    fs::write(fixture.path("a.zk"), &bytes[..bytes.len() - 9]).unwrap();
    let (status, bytes) = fixture.open(&["a.zk"], [120, 36]).end();
    assert_eq!(status, 1);
    assert!(bytes.contains("it ends in the middle of"), "{bytes:?}");
}
