//! Result files of commands: replaced in one step, errors reported, devices and pipes written
//! directly.

use super::*;
use std::os::unix::fs::{PermissionsExt, lchown, symlink};

const QUICK: [&str; 8] =
    ["--seconds", "0.1", "--repetitions", "1", "--size", "16x12", "--noise", "8"];

/// Checks that result files are replaced, not overwritten. A hard link to the old file keeps the
/// old content only if the file is replaced.
#[test]
fn results_are_replaced_in_one_step() {
    let desk = Desk::new();
    let names = ["s.json", "m.json", "m.csv", "m.svg"];
    for name in names {
        fs::write(desk.path(name), "old").unwrap();
        fs::hard_link(desk.path(name), desk.path(&format!("{name}.old"))).unwrap();
    }
    let run = desk.render("a.png", &["--spp", "2", "--stats", "s.json"]);
    assert_eq!(run.status, 0, "{}", run.err);
    let files = ["measure", "scene.toml", "--json", "m.json", "--csv", "m.csv", "--plot", "m.svg"];
    let run = desk.run(&[&files[..], &QUICK].concat());
    assert_eq!(run.status, 0, "{}", run.err);
    for name in names {
        assert_eq!(fs::read(desk.path(&format!("{name}.old"))).unwrap(), b"old", "{name}");
        assert!(fs::metadata(desk.path(name)).unwrap().len() > 100, "{name}");
    }
    assert!(desk.files().iter().all(|name| !name.ends_with(".tmp")));
}

#[test]
fn interrupted_new_leaves_no_incomplete_scene() {
    let desk = Desk::new();
    let program = env!("CARGO_BIN_EXE_zerkalo");
    let mut command = Command::new("sh");
    command.arg("-c").arg(format!("ulimit -f 0; exec '{program}' new new.toml"));
    let run = command.current_dir(desk.0.path()).output().unwrap();
    assert!(!run.status.success());
    assert!(!desk.path("new.toml").exists());
}

#[test]
#[cfg(target_os = "linux")]
fn full_stdout_is_a_failure_and_a_closed_pipe_is_none() {
    let desk = Desk::new();
    for args in [&["check", "scene.toml"][..], &["new", "b.toml"], &["doctor"], &["--help"]] {
        let full = fs::File::options().write(true).open("/dev/full").unwrap();
        let run = Run::from(desk.command(args).stdout(full).output().unwrap());
        assert_eq!(run.status, 1, "{args:?}");
        let is_named = run.err.contains("stdout") && run.err.contains("No space left");
        assert!(is_named || args == ["--help"], "{args:?}: {}", run.err);
    }
    let mut command = Command::new("sh");
    let program = env!("CARGO_BIN_EXE_zerkalo");
    command.arg("-c").arg(format!("{{ '{program}' check scene.toml; echo $? >&2; }} | true"));
    let run = Run::from(command.current_dir(desk.0.path()).output().unwrap());
    assert_eq!(run.err.trim(), "0");
}

/// Checks that a result file that cannot be created is refused before the work begins. If a device
/// is full, so that the result cannot be written, the error must be reported after the work.
#[test]
fn unwritable_results_are_failures() {
    let desk = Desk::new();
    for option in ["--json", "--csv", "--plot"] {
        let file = format!("no/such/a.{}", if option == "--plot" { "svg" } else { "x" });
        let run = desk.run(&["measure", "scene.toml", option, &file, "--seconds", "500"]);
        assert_eq!(run.status, 1, "{option}");
        assert!(run.err.contains("does not exist; create it first"), "{option}: {}", run.err);
    }
    if cfg!(target_os = "linux") {
        let run = desk.render("a.png", &["--spp", "2", "--stats", "/dev/full"]);
        assert_eq!(run.status, 1);
        assert!(run.err.contains("cannot write /dev/full: No space left"), "{}", run.err);
        assert!(is_png(&desk.path("a.png")));
    }
}

#[test]
fn stdout_is_a_target_of_results() {
    let desk = Desk::new();
    let json = |out: &str| {
        let start = out.find('{').expect("JSON");
        serde_json::from_str::<serde_json::Value>(&out[start..]).is_ok()
    };
    let args = ["--spp", "2", "--stats", "/dev/stdout"];
    let run = desk.render("a.png", &args);
    assert!(run.status == 0 && json(&run.out), "{} {}", run.out, run.err);
    // If stdout is a file, the statistics follow the line about the picture and do not replace it.
    let file = fs::File::create(desk.path("out.txt")).unwrap();
    let command = [&["render", "scene.toml", "-o", "a.png", "--size", "16x12"], &args[..]].concat();
    let run = Run::from(desk.command(&command).stdout(file).output().unwrap());
    assert_eq!(run.status, 0, "{}", run.err);
    let out = fs::read_to_string(desk.path("out.txt")).unwrap();
    assert!(out.starts_with("a.png") && json(&out), "{out}");
    // `--stats -` writes to a file of the name `-`, not to stdout.
    let run = desk.render("a.png", &["--spp", "2", "--stats", "-"]);
    assert!(run.status == 0 && desk.path("-").exists(), "{}", run.err);
}

/// Checks that results are not written through links of other users in shared folders. Runs only as
/// superuser, because only the superuser can give a link to another user. Unit tests of the module
/// `disk` check further owners of links and folders.
#[test]
fn results_do_not_follow_links_of_other_users_in_shared_folders() {
    let desk = Desk::new();
    let shared = desk.path("shared");
    fs::create_dir(&shared).unwrap();
    fs::set_permissions(&shared, fs::Permissions::from_mode(0o1777)).unwrap();
    let victim = desk.path("victim");
    fs::write(&victim, "precious").unwrap();
    let links = ["a.png", "s.json"].map(|name| shared.join(name));
    for link in &links {
        symlink(&victim, link).unwrap();
        if lchown(link, Some(4321), None).is_err() {
            return;
        }
    }
    let [picture, stats] = links.each_ref().map(|link| link.to_str().unwrap());
    let render = ["render", "scene.toml", "--size", "16x12", "--spp", "2", "-o"];
    for args in
        [[&render[..], &[picture]].concat(), [&render[..], &["a.png", "--stats", stats]].concat()]
    {
        let run = desk.run(&args);
        assert_eq!(run.status, 1, "{args:?}");
        assert!(run.err.contains("symbolic link of user 4321"), "{args:?}: {}", run.err);
        assert_eq!(fs::read(&victim).unwrap(), b"precious");
    }
}
