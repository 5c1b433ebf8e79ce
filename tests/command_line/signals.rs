//! Reactions of commands to SIGINT and SIGTERM, which tests send by `kill`.

use super::*;
use crate::harness::*;
use std::process::Child;

pub fn signal(name: &str, id: u32) {
    let sent = Command::new("kill").args([format!("-{name}"), id.to_string()]).status();
    assert!(sent.unwrap().success());
}

/// Longest time that a test waits. Only a failing test reaches it.
const PATIENCE: Duration = Duration::from_secs(120);

/// Waits until `condition` is `true` for a number in Linux's `/proc/PID/status` of the process
/// `id`, such as the set of pending signals. `name` is the start of the number's line, and `radix`
/// the base in which it is written. On other systems, waits for a second.
fn wait_for_status(id: u32, name: &str, radix: u32, condition: impl Fn(u64) -> bool) {
    if cfg!(not(target_os = "linux")) {
        return std::thread::sleep(Duration::from_secs(1));
    }
    let holds = || {
        let status = fs::read_to_string(format!("/proc/{id}/status")).ok()?;
        let number = status.lines().find_map(|line| line.strip_prefix(name))?;
        Some(condition(u64::from_str_radix(number.trim(), radix).ok()?))
    };
    let end = Instant::now() + PATIENCE;
    while holds() == Some(false) {
        assert!(Instant::now() < end, "{name} stays");
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

/// Starts the program and waits until it handles SIGTERM and SIGINT: until it has threads that
/// trace, which it starts after its handlers are complete. The system already reports a signal as
/// caught (`SigCgt`) a moment before the handler knows what to do, and a signal is lost then.
pub(super) fn spawn(desk: &Desk, args: &[&str]) -> Child {
    let mut command = desk.command(args);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    wait_for_status(child.id(), "Threads:", 10, |threads| threads > 1);
    child
}

#[test]
fn signal_saves_the_picture_so_far() {
    for (name, status) in [("INT", 130), ("TERM", 143)] {
        let desk = Desk::new();
        let args = ["render", "scene.toml", "-o", "a.png", "--noise", "1e-6", "--stats", "s.json"];
        // Without the signal, the test fails after a minute instead of waiting for ever.
        let child = spawn(&desk, &[&args[..], &["--time", "60"]].concat());
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
/// would write the picture when the wave ends, minutes later.
#[test]
fn second_signal_ends_a_long_wave_at_once() {
    let desk = Desk::new();
    let args = "render scene.toml -o a.png --size 4096x4096 --uniform --spp 9999"
        .split(' ')
        .collect::<Vec<_>>();
    let child = spawn(&desk, &args);
    signal("INT", child.id());
    // The first signal must be delivered before the second is sent, because two pending SIGINTs
    // count as one.
    wait_for_status(child.id(), "ShdPnd:", 16, |pending| pending >> 1 & 1 == 0);
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
