//! `zerkalo watch` on film files that are replaced while it runs.

use super::*;

/// Plans a render of `room.toml` in 160x120 pixels by four shards, as `job.plan`, and traces the
/// last one.
fn planned(fixture: &Fixture) {
    fixture.run(
        &"plan room.toml --size 160x120 --noise 0.5 --shards 4 -o job.plan"
            .split(' ')
            .collect::<Vec<_>>(),
    );
    trace(fixture, 4);
}

fn trace(fixture: &Fixture, shard: usize) {
    let (shard, part) = (shard.to_string(), format!("job-{shard}.zk"));
    fixture.run(&["render", "room.toml", "--plan", "job.plan", "--shard", &shard, "-o", &part]);
}

#[test]
fn picture_follows_the_files_of_other_processes() {
    let fixture = Fixture::with_room();
    planned(&fixture);
    let mut terminal = fixture.open(&["watch", "job.plan"], [80, 24]);
    wait_for_picture(&terminal);
    terminal.wait_for_text("1 of 4 shards complete");
    terminal.wait_for_text("3 missing");
    trace(&fixture, 2);
    terminal.wait_for_text("2 of 4 shards complete");
    // The file of shard 1 is replaced by its first half, like a copy in progress.
    trace(&fixture, 1);
    terminal.wait_for_text("3 of 4 shards complete");
    let part = fs::read(fixture.path("job-1.zk")).unwrap();
    fs::write(fixture.path("cut"), &part[..part.len() / 2]).unwrap();
    fs::rename(fixture.path("cut"), fixture.path("job-1.zk")).unwrap();
    terminal.wait_for_text("1 not used");
    terminal.wait_for_text("it ends");
    terminal.send("x");
    terminal.wait_for_text("Read-only: `zerkalo watch` edits and renders nothing");
    fs::write(fixture.path("cut"), &part).unwrap();
    fs::rename(fixture.path("cut"), fixture.path("job-1.zk")).unwrap();
    trace(&fixture, 3);
    terminal.wait_for_text("✓ complete");
    terminal.send("p");
    terminal.wait_for_text("room-1.png");
    // The program quits only when the picture that was requested last is written.
    terminal.send("Pq");
    let (status, bytes) = terminal.end();
    assert_eq!(status, 0, "{bytes}");
    for picture in ["png", "exr"] {
        let expected = format!("expected.{picture}");
        let parts = ["job-1.zk", "job-2.zk", "job-3.zk", "job-4.zk"];
        fixture.run(&[&["merge", "-o", &expected], &parts[..]].concat());
        let expected = fs::read(fixture.path(&expected)).unwrap();
        let written = fs::read(fixture.path(&format!("room-1.{picture}"))).unwrap();
        assert!(written == expected, "the exported {picture} is not the merged one");
    }
}

#[test]
fn checkpoint_is_watched_while_its_render_runs() {
    let fixture = Fixture::with_room();
    // The file does not exist yet.
    let mut terminal = fixture.open(&["watch", "a.zk"], [120, 36]);
    let mut render = Command::new(PROGRAM)
        .args(["render", "room.toml", "-o", "a.png", "--size", "160x120", "--noise", "1e-6"])
        .args(["--checkpoint", "a.zk", "--checkpoint-interval", "0.3", "--threads", "1"])
        // Ends the render of a test that fails.
        .args(["--time", "60"])
        .current_dir(fixture.0.path())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    wait_for_picture(&terminal);
    let samples = |screen: &vt100::Screen| {
        let text = screen.contents();
        let end = text.find(" spp")?;
        let start = text[..end].rfind(' ')?;
        text[start + 1..end].parse::<u64>().ok()
    };
    let first = terminal.wait_for("samples", samples);
    terminal.wait_for("more samples", |screen| (samples(screen)? > first).then_some(()));
    render.kill().unwrap();
    render.wait().unwrap();
    terminal.send("q");
    let (status, bytes) = terminal.end();
    assert_eq!(status, 0, "{bytes}");
}

#[test]
fn foreign_files_are_refused_before_the_screen_changes() {
    let fixture = Fixture::with_room();
    planned(&fixture);
    fs::copy(fixture.path("job-4.zk"), fixture.path("copy.zk")).unwrap();
    let (status, bytes) = fixture.open(&["watch", "job-4.zk", "copy.zk"], [80, 24]).end();
    assert_eq!(status, 1);
    assert!(bytes.contains("both hold shard 4; name one of them"), "{bytes:?}");
}
