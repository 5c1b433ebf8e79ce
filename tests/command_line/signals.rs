//! Reactions of commands to SIGINT and SIGTERM, which tests send by `kill`.

use super::*;
use std::process::Child;
use std::time::{Duration, Instant};

pub fn signal(name: &str, id: u32) {
    let sent = Command::new("kill").args([format!("-{name}"), id.to_string()]).status();
    assert!(sent.unwrap().success());
}

/// Longest time that a test waits. Only a failing test reaches it.
const PATIENCE: Duration = Duration::from_secs(120);

/// Waits until `condition` is `true` for a set of signals of the process `id`, such as the pending
/// ones. `set` is the name of the line of Linux's `/proc/PID/status` that shows the set. On other
/// systems, waits for a second.
fn wait_for_signals(id: u32, set: &str, condition: impl Fn(u64) -> bool) {
    if cfg!(not(target_os = "linux")) {
        return std::thread::sleep(Duration::from_secs(1));
    }
    let holds = || {
        let status = fs::read_to_string(format!("/proc/{id}/status")).ok()?;
        let signals = status.lines().find_map(|line| line.strip_prefix(set))?;
        Some(condition(u64::from_str_radix(signals.trim(), 16).ok()?))
    };
    let end = Instant::now() + PATIENCE;
    while holds() == Some(false) {
        assert!(Instant::now() < end, "{set} stays");
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Waits until there is a file at `path`.
pub fn wait_for_file(path: &Path) {
    let end = Instant::now() + PATIENCE;
    while !path.exists() {
        assert!(Instant::now() < end, "there is no {}", path.display());
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// Starts the program and waits until it handles SIGTERM and SIGINT.
pub fn spawn(desk: &Desk, args: &[&str]) -> Child {
    let mut command = desk.command(args);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    wait_for_signals(child.id(), "SigCgt:", |caught| caught >> 14 & 1 == 1);
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

/// Checks that a second signal ends the program at once. After the first signal alone, the program
/// would write the picture when the wave (the set of concurrent tracing jobs) ends, minutes later.
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
    // The first signal must be delivered before the second is sent, because two pending SIGINTs
    // count as one.
    wait_for_signals(child.id(), "ShdPnd:", |pending| pending >> 1 & 1 == 0);
    signal("INT", child.id());
    let run = Run::from(child.wait_with_output().unwrap());
    assert_eq!(run.status, 130, "{}", run.err);
    assert_eq!((run.out.as_str(), desk.path("a.png").exists()), ("", false));
}

#[test]
fn signal_keeps_the_samples_of_a_shard_which_continues() {
    let desk = Desk::new();
    let plan = ["plan", "scene.toml", "-o", "job.plan", "--size", "64x48", "--shards", "1"];
    let run = desk.run(&[&plan[..], &["--noise", "0.02", "--pilot", "1"]].concat());
    assert_eq!(run.status, 0, "{}", run.err);
    let shard = ["render", "scene.toml", "--plan", "job.plan", "--shard", "1", "-o"];
    let child = spawn(&desk, &[&shard[..], &["job-1.zk"]].concat());
    signal("TERM", child.id());
    let run = Run::from(child.wait_with_output().unwrap());
    assert_eq!(run.status, 143, "{}", run.err);
    assert!(run.out.contains("% of the samples (stopped by a signal)"), "{}", run.out);
    let merge = |more: &[&str]| desk.run(&[&["merge", "job-0.zk", "job-1.zk"], more].concat());
    let run = merge(&["-o", "a.png"]);
    assert!(run.status == 1, "{}", run.out);
    assert!(run.err.contains("job-1.zk is an unfinished checkpoint of shard 1"), "{}", run.err);
    let run = merge(&["-o", "a.png", "--partial"]);
    assert!(run.out.contains("missing of 1 shards: 1; noise 0."), "{} {}", run.out, run.err);
    for output in ["job-1.zk", "uninterrupted.zk"] {
        let run = desk.run(&[&shard[..], &[output]].concat());
        assert_eq!(run.status, 0, "{}", run.err);
    }
    let [resumed, whole] =
        ["job-1.zk", "uninterrupted.zk"].map(|name| fs::read(desk.path(name)).unwrap());
    assert!(resumed == whole, "the interrupted shard has another film");
}
