//! Reactions of commands to signals, which tests send by `kill`.

use super::*;
use crate::command_line::shards::set_samples;
use crate::harness::*;
use signal_hook::consts::{SIGINT, SIGQUIT};
use signal_hook::flag::register_conditional_default;
use std::io::{BufRead, BufReader};
use std::process::Child;
use std::sync::Once;
use std::sync::atomic::AtomicBool;

pub fn signal(name: &str, id: u32) {
    let sent = Command::new("kill").args([format!("-{name}"), id.to_string()]).status();
    assert!(sent.unwrap().success());
}

/// Signals by which users and batch systems end a render, with their numbers.
const SIGNALS: [(&str, i32); 6] =
    [("TERM", 15), ("HUP", 1), ("INT", 2), ("QUIT", 3), ("USR1", 10), ("XCPU", 24)];

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
///
/// SIGINT and SIGQUIT have their default in the program, even if the tests run in the background of a
/// script, which ignores them: handled signals are not inherited.
pub(super) fn spawn(desk: &Desk, args: &[&str]) -> Child {
    static HANDLERS: Once = Once::new();
    HANDLERS.call_once(|| {
        for signal in [SIGINT, SIGQUIT] {
            register_conditional_default(signal, Arc::new(AtomicBool::new(true))).unwrap();
        }
    });
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

/// Checks that repeated signals, which GNU `timeout` and GNU parallel send, do not end the write of
/// picture and checkpoint.
#[test]
fn repeated_signals_lose_nothing() {
    for (i, (name, number)) in SIGNALS.into_iter().enumerate() {
        let desk = Desk::new();
        let args = ["render", "scene.toml", "-o", "a.png", "--noise", "1e-6", "--time", "60"];
        let keep = ["--size", "1600x1200", "--checkpoint", "a.zk", "--threads", "1"];
        let mut child = spawn(&desk, &[&args[..], &keep].concat());
        // The write takes some tenths of a second.
        for pause in [0, 1 << i, 100, 200] {
            std::thread::sleep(Duration::from_millis(pause));
            if child.try_wait().unwrap().is_none() {
                signal(name, child.id());
            }
        }
        let run = Run::from(child.wait_with_output().unwrap());
        assert_eq!(run.status, 128 + number, "{name}: {}", run.err);
        if !run.err.contains("before the first picture") {
            assert!(is_png(&desk.path("a.png")), "{name}");
            FilmReader::open(&desk.path("a.zk")).and_then(FilmReader::verify).unwrap();
            assert_eq!(desk.files(), ["a.png", "a.zk", "scene.toml"], "{name}");
        }
    }
}

/// Checks that a signal that the parent ignores, as `nohup` ignores SIGHUP, has no effect.
#[test]
fn ignored_signals_stay_ignored() {
    let desk = Desk::new();
    let mut shell = Command::new("sh");
    let script = r#"trap "" HUP; exec "$0" render scene.toml -o a.png --size 64x48 --time 0.5"#;
    shell.args(["-c", script, env!("CARGO_BIN_EXE_zerkalo")]).current_dir(desk.0.path());
    let child = shell.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    wait_for_status(child.id(), "Threads:", 10, |threads| threads > 1);
    signal("HUP", child.id());
    let run = Run::from(child.wait_with_output().unwrap());
    assert_eq!(run.status, 0, "{}", run.err);
    assert!(!run.out.contains("signal"), "{}", run.out);
}

/// Checks that a write beyond the limit of file sizes is an error, not the end by SIGXFSZ.
#[test]
fn limit_of_file_sizes_is_an_error() {
    let desk = Desk::new();
    let script = r#"ulimit -f 1; exec "$0" render scene.toml -o a.png --size 320x240 --spp 2"#;
    let mut shell = Command::new("sh");
    shell.args(["-c", script, env!("CARGO_BIN_EXE_zerkalo")]).current_dir(desk.0.path());
    let run = Run::from(shell.output().unwrap());
    assert_eq!(run.status, 1, "{}", run.err);
    assert!(run.err.contains("cannot write a.png: File too large"), "{}", run.err);
    assert_eq!(desk.files(), ["scene.toml"]);
}

/// Checks that a write that fails is repeated: the folder of the outputs is away for a second.
#[test]
fn failed_last_writes_are_repeated() {
    let desk = Desk::new();
    let plan = ["plan", "scene.toml", "-o", "job.plan", "--size", "64x48", "--shards", "1"];
    assert_eq!(desk.run(&plan).status, 0);
    set_samples(&desk, 100_000_000);
    let render = "render scene.toml -o out/a.png --noise 1e-6 --time 60 --checkpoint out/a.zk";
    let shard = "render scene.toml --plan job.plan --shard 1 -o out/a.zk";
    for (args, files) in [(render, &["a.png", "a.zk"][..]), (shard, &["a.zk"])] {
        fs::create_dir(desk.path("out")).unwrap();
        let mut child = spawn(&desk, &args.split(' ').collect::<Vec<_>>());
        // The first picture exists.
        std::thread::sleep(Duration::from_millis(500));
        fs::rename(desk.path("out"), desk.path("away")).unwrap();
        signal("TERM", child.id());
        let mut err = BufReader::new(child.stderr.take().unwrap());
        let mut line = String::new();
        while !line.contains("trying again in 1 s") {
            line.clear();
            assert!(err.read_line(&mut line).unwrap() > 0, "{args}: no second attempt");
        }
        assert!(line.contains("the directory out does not exist"), "{line}");
        fs::rename(desk.path("away"), desk.path("out")).unwrap();
        assert_eq!(child.wait().unwrap().code(), Some(143), "{args}");
        let mut names: Vec<_> = fs::read_dir(desk.path("out")).unwrap().flatten().collect();
        names.sort_by_key(fs::DirEntry::file_name);
        let names: Vec<_> = names.iter().map(|e| e.file_name().into_string().unwrap()).collect();
        assert_eq!(names, files, "{args}");
        fs::remove_dir_all(desk.path("out")).unwrap();
    }
}

/// Checks that one process at a time continues a checkpoint.
#[test]
fn second_render_on_a_checkpoint_waits_for_the_first() {
    let desk = Desk::new();
    let args = ["render", "scene.toml", "-o", "a.png", "--size", "64x48", "--time", "60"];
    let keep = ["--checkpoint", "a.zk", "--resume", "a.zk", "--checkpoint-interval", "0.05"];
    let args = [&args[..], &keep].concat();
    let first = spawn(&desk, &args);
    wait_for_file(&desk.path("a.zk"));
    let piped = || Stdio::piped();
    let mut second = desk.command(&args).stdout(piped()).stderr(piped()).spawn().unwrap();
    let mut err = BufReader::new(second.stderr.take().unwrap());
    let mut line = String::new();
    err.read_line(&mut line).unwrap();
    let note = "note: cannot write a.zk: another process is writing it";
    assert!(line.starts_with(note) && line.contains("waiting for up to 60 s"), "{line}");
    signal("TERM", first.id());
    let first = Run::from(first.wait_with_output().unwrap());
    assert_eq!(first.status, 143, "{}", first.err);
    wait_for_status(second.id(), "Threads:", 10, |threads| threads > 1);
    std::thread::sleep(Duration::from_millis(200));
    signal("TERM", second.id());
    assert_eq!(second.wait().unwrap().code(), Some(143));
    assert!(is_png(&desk.path("a.png")));
}

#[test]
fn signal_keeps_the_samples_of_a_shard_which_continues() {
    let desk = Desk::new();
    let plan = ["plan", "scene.toml", "-o", "job.plan", "--size", "64x48", "--shards", "1"];
    assert_eq!(desk.run(&plan).status, 0);
    set_samples(&desk, 3000);
    let shard = ["render", "scene.toml", "--plan", "job.plan", "--shard", "1", "-o"];
    let child = spawn(&desk, &[&shard[..], &["job-1.zk"]].concat());
    signal("TERM", child.id());
    let run = Run::from(child.wait_with_output().unwrap());
    assert_eq!(run.status, 143, "{}", run.err);
    assert!(run.out.contains("% of the samples (stopped by a signal)"), "{}", run.out);
    let merge = |more: &[&str]| desk.run(&[&["merge", "job-1.zk"], more].concat());
    let run = merge(&["-o", "a.png"]);
    assert!(run.status == 1, "{}", run.out);
    assert!(run.err.contains("job-1.zk is an unfinished checkpoint of shard 1"), "{}", run.err);
    let run = merge(&["-o", "a.png", "--partial"]);
    assert!(run.out.contains("missing of 1 shards: 1; "), "{} {}", run.out, run.err);
    for output in ["job-1.zk", "uninterrupted.zk"] {
        let run = desk.run(&[&shard[..], &[output]].concat());
        assert_eq!(run.status, 0, "{}", run.err);
    }
    let [resumed, whole] =
        ["job-1.zk", "uninterrupted.zk"].map(|name| fs::read(desk.path(name)).unwrap());
    assert!(resumed == whole, "the interrupted shard has another film");
}
