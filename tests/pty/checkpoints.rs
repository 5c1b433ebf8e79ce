//! Checkpoints of the dashboard, which are written on request and continued after a kill.

use super::*;
use crate::harness::*;

fn film(path: PathBuf) -> Film {
    FilmReader::open(&path).and_then(FilmReader::read).unwrap_or_else(|e| panic!("{e}")).film
}

/// Waits until the file `name` exists. A checkpoint gets its name only when it is complete.
fn wait_for_file(fixture: &Fixture, name: &str) {
    let end = Instant::now() + Duration::from_secs(60);
    while !fixture.path(name).exists() {
        assert!(Instant::now() < end, "no {name}");
        std::thread::sleep(Duration::from_millis(20));
    }
}

fn kill(terminal: Terminal) {
    let kill = Command::new("kill").args(["-9", &terminal.process_id().to_string()]).status();
    assert!(kill.unwrap().success());
    // `Terminal::end` would fail, because a killed program does not restore its terminal.
    drop(terminal);
}

/// Returns the paths of the checkpoints in the folder, each with its number of samples. Panics if a
/// checkpoint is incomplete.
fn checkpoints(fixture: &Fixture) -> Vec<(PathBuf, u64)> {
    let files = fs::read_dir(fixture.0.path()).unwrap().map(|entry| entry.unwrap().path());
    let files = files.filter(|path| {
        let name = path.file_name().unwrap().to_string_lossy();
        name.ends_with(".zk") && (name.starts_with("room") || name == "latest.zk")
    });
    files.map(|path| (path.clone(), film(path).samples())).collect()
}

/// Starts and kills a dashboard `moments` times while it renders and writes checkpoints. Each run
/// continues from the checkpoint with the most samples. At the end, compares the film with that of
/// an uninterrupted render.
fn kill_at_random_moments(moments: u32, text: &str, seed: u64) {
    let fixture = Fixture::new();
    fs::write(fixture.path("room.toml"), text).unwrap();
    let start = Instant::now();
    fixture.rendered(&["room.toml", "--noise", "0.5", "--checkpoint", "whole.zk"], "whole.png");
    // All runs together last about as long as the uninterrupted render.
    let life = start.elapsed().as_secs_f64() / f64::from(moments);
    let whole = film(fixture.path("whole.zk"));
    let mut random = seed;
    let mut part = move || {
        random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (random >> 11) as f64 / (1u64 << 53) as f64
    };
    let (mut latest, mut samples, mut kept) = ("room.toml", 0, 0);
    for moment in 0..moments {
        let mut terminal = fixture.open(&[latest], [80, 24]);
        // Every fourth run may be killed before its first picture or checkpoint.
        if moment % 4 != 3 {
            wait_for_picture(&terminal);
            terminal.send("K");
            wait_for_file(&fixture, "room-1.zk");
        }
        let end = Instant::now() + Duration::from_secs_f64(life * part());
        while Instant::now() < end {
            terminal.send("K");
            std::thread::sleep(Duration::from_secs_f64(0.06 * part()));
        }
        kill(terminal);
        let written = checkpoints(&fixture);
        let Some((best, most)) = written.iter().max_by_key(|(_, samples)| *samples) else {
            continue;
        };
        assert!(*most >= samples, "moment {moment}: {most} samples after {samples}, seed {seed}");
        kept += u32::from(*most > samples);
        eprintln!("life {moment}: {most} of {} samples", whole.samples());
        (samples, latest) = (*most, "latest.zk");
        fs::rename(best, fixture.path("best")).unwrap();
        written.iter().for_each(|(path, _)| drop(fs::remove_file(path)));
        fs::rename(fixture.path("best"), fixture.path(latest)).unwrap();
    }
    eprintln!("{kept} of {moments} lives added samples");
    assert!(kept > 0, "no life has added samples");
    let mut terminal = fixture.open(&[latest], [80, 24]);
    wait_for_picture(&terminal);
    await_film(&fixture, &mut terminal, &whole, 1);
    terminal.send("q");
    assert_eq!(terminal.end().0, 0);
}

/// Requests checkpoints, named `room-FIRST.zk` and so on, until one has as many samples as `whole`.
/// Checks that the film of this checkpoint equals `whole`.
fn await_film(fixture: &Fixture, terminal: &mut Terminal, whole: &Film, first: usize) {
    for number in first.. {
        terminal.send("K");
        let name = format!("room-{number}.zk");
        wait_for_file(fixture, &name);
        let now = film(fixture.path(&name));
        if now.samples() == whole.samples() {
            assert!(now.bytes() == whole.bytes(), "the film differs");
            break;
        }
        assert!(number < 300, "{} samples, {} expected", now.samples(), whole.samples());
        std::thread::sleep(Duration::from_millis(200));
    }
}

#[test]
fn dashboard_killed_at_random_moments_ends_with_the_same_film() {
    let text = MIRROR_ROOM.replace("size = [640, 480]", "size = [320, 240]");
    kill_at_random_moments(4, &text, 1);
}

#[test]
fn killed_dashboard_continues_from_its_checkpoint() {
    let fixture = Fixture::with_room();
    // The render must take a few seconds to reach its noise target.
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
    kill(terminal);
    let before = film(fixture.path("room-1.zk")).samples();
    assert!(before > 0 && before <= whole.samples());

    let mut terminal = fixture.open(&["room-1.zk"], [120, 36]);
    wait_for_picture(&terminal);
    // The title shows the scene file, and not the copy of the scene in the checkpoint.
    terminal.wait_for_text("room.toml");
    terminal.send("K");
    wait_for_file(&fixture, "room-2.zk");
    let after = film(fixture.path("room-2.zk")).samples();
    assert!(after >= before, "the samples of the checkpoint are lost");
    await_film(&fixture, &mut terminal, &whole, 3);
    // The program quits only when the checkpoint that was requested last is complete.
    terminal.send("Kq");
    let (status, bytes) = terminal.end();
    assert_eq!(status, 0, "{bytes}");
    let files = fs::read_dir(fixture.0.path()).unwrap().map(|e| e.unwrap().file_name());
    let checkpoints = files.filter(|name| name.to_string_lossy().ends_with(".zk"));
    checkpoints.for_each(|name| assert_eq!(film(fixture.0.path().join(name)).header.width, 320));
}

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
