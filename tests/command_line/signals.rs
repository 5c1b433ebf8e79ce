//! SIGINT and SIGTERM, sent by `kill`.

use super::*;
use std::time::{Duration, Instant};

fn signal(name: &str, id: u32) {
    let sent = Command::new("kill").args([format!("-{name}"), id.to_string()]).status();
    assert!(sent.unwrap().success());
}

#[test]
fn signal_saves_the_picture_so_far() {
    for (name, status) in [("INT", 130), ("TERM", 143)] {
        let desk = Desk::new();
        let args = ["render", "scene.toml", "-o", "a.png", "--noise", "1e-6", "--stats", "s.json"];
        let mut command = desk.command(&args);
        let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(400));
        signal(name, child.id());
        let run = Run::from(child.wait_with_output().unwrap());
        assert_eq!(run.status, status, "{name}: {}", run.err);
        assert!(is_png(&desk.path("a.png")));
        assert!(run.out.contains("a.png") && run.out.contains("so far"), "{:?}", run.out);
        let stats = fs::read_to_string(desk.path("s.json")).unwrap();
        assert!(stats.contains(r#""stopped_by": "signal""#), "{stats}");
    }
}

#[test]
fn second_signal_ends_a_long_wave_at_once() {
    let desk = Desk::new();
    let args = [
        "render",
        "scene.toml",
        "-o",
        "a.png",
        "--size",
        "4096x4096",
        "--uniform",
        "--spp",
        "9999",
    ];
    let child = desk.command(&args).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(Duration::from_secs(1));
    signal("INT", child.id());
    signal("INT", child.id());
    let sent = Instant::now();
    let run = Run::from(child.wait_with_output().unwrap());
    assert_eq!(run.status, 130, "{}", run.err);
    assert!(sent.elapsed() < Duration::from_secs(5), "{:?}", sent.elapsed());
}
