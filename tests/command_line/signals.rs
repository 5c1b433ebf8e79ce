//! SIGINT and SIGTERM, sent by `kill`.

use super::*;
use std::process::Child;
use std::time::{Duration, Instant};

fn signal(name: &str, id: u32) {
    let sent = Command::new("kill").args([format!("-{name}"), id.to_string()]).status();
    assert!(sent.unwrap().success());
}

/// Starts the program and waits until it handles SIGINT, as its bit in `SigCgt` of Linux's
/// `/proc/PID/status` says. Elsewhere it waits for a second.
fn spawn(desk: &Desk, args: &[&str]) -> Child {
    let mut command = desk.command(args);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    if cfg!(not(target_os = "linux")) {
        std::thread::sleep(Duration::from_secs(1));
        return child;
    }
    let handles_sigint = || {
        let status = fs::read_to_string(format!("/proc/{}/status", child.id())).ok()?;
        let caught = status.lines().find_map(|line| line.strip_prefix("SigCgt:"))?;
        Some(u64::from_str_radix(caught.trim(), 16).ok()? & 2 != 0)
    };
    let end = Instant::now() + Duration::from_secs(120);
    while handles_sigint() != Some(true) {
        assert!(Instant::now() < end, "no handler of SIGINT is installed");
        std::thread::sleep(Duration::from_millis(5));
    }
    child
}

#[test]
fn signal_saves_the_picture_so_far() {
    for (name, status) in [("INT", 130), ("TERM", 143)] {
        let desk = Desk::new();
        let args = ["render", "scene.toml", "-o", "a.png", "--noise", "1e-6", "--stats", "s.json"];
        let child = spawn(&desk, &args);
        signal(name, child.id());
        let run = Run::from(child.wait_with_output().unwrap());
        assert_eq!(run.status, status, "{name}: {}", run.err);
        assert!(is_png(&desk.path("a.png")));
        assert!(run.out.contains("a.png") && run.out.contains("so far"), "{:?}", run.out);
        let stats = fs::read_to_string(desk.path("s.json")).unwrap();
        assert!(stats.contains(r#""stopped_by": "signal""#), "{stats}");
    }
}

/// The first signal alone would write the picture when the wave ends, after minutes.
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
    let child = spawn(&desk, &args);
    signal("INT", child.id());
    signal("INT", child.id());
    let run = Run::from(child.wait_with_output().unwrap());
    assert_eq!(run.status, 130, "{}", run.err);
    assert_eq!((run.out.as_str(), desk.path("a.png").exists()), ("", false));
}
