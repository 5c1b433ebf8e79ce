//! Usage errors and failures: exit status, message, unchanged files.

use super::*;

#[test]
fn usage_errors_have_status_2_and_touch_nothing() {
    let desk = Desk::new();
    for (args, word) in [
        (&["render", "scene.toml", "-o", "a.jpg"] as &[&str], ".png"),
        (&["render", "scene.toml", "-o", "a"], ".png"),
        (&["render", "scene.toml"], "--output"),
        (&["render", "scene.toml", "-o", "a.png", "--size", "0x0"], "--size"),
        (&["render", "scene.toml", "-o", "a.png", "--size", "99999x99999"], "--size"),
        (&["render", "scene.toml", "-o", "a.png", "--noise", "-1"], "greater than 0"),
        (&["render", "scene.toml", "-o", "a.png", "--tone", "film"], "neutral"),
        (&["render", "scene.toml", "-o", "a.png", "--spp", "-3"], "-3 is not in 1"),
        (&["render", "scene.toml", "-o", "a.png", "--noise", "0"], "greater than 0"),
        (&["render", "scene.toml", "-o", "a.png", "--stats", "a.png"], "same file"),
        (&["polish"], "zerkalo render polish"),
        (&[], "zerkalo render"),
    ] {
        let run = desk.run(args);
        assert_eq!(run.status, 2, "{args:?}: {}", run.err);
        assert!(run.err.contains(word), "{args:?}: no {word:?} in {:?}", run.err);
    }
    assert_eq!(desk.files(), ["scene.toml"]);
}

#[test]
fn failures_have_status_1_a_located_message_and_leave_the_old_picture() {
    let desk = Desk::new();
    fs::write(desk.path("old.png"), "precious").unwrap();
    fs::write(desk.path("bad.toml"), SCENE.replace("radius = 0.5", "radius = -0.5")).unwrap();
    fs::write(desk.path("file"), "").unwrap();
    for (args, word) in [
        (&["render", "bad.toml", "-o", "old.png"] as &[&str], "bad.toml:15:"),
        (&["render", "none.toml", "-o", "old.png"], "none.toml"),
        (&["render", ".", "-o", "old.png"], "directory"),
        (&["render", "scene.toml", "-o", "none/a.png"], "none"),
        (&["render", "scene.toml", "-o", "file/a.png"], "file"),
        (&["render", "scene.toml", "-o", "old.png", "--stats", "none/s.json"], "none"),
        (&["check", "bad.toml"], "bad.toml:15:"),
        (&["new", "scene.toml"], "scene.toml: there is such a file already"),
        (&["new", "none/a.toml"], "none"),
    ] {
        let run = desk.run(args);
        assert_eq!(run.status, 1, "{args:?}: {}", run.err);
        assert!(run.err.contains(word), "{args:?}: no {word:?} in {:?}", run.err);
        assert!(!run.err.contains("panicked") && run.out.is_empty(), "{args:?}: {:?}", run.err);
    }
    assert_eq!(fs::read_to_string(desk.path("old.png")).unwrap(), "precious");
    assert_eq!(fs::read_to_string(desk.path("scene.toml")).unwrap(), SCENE);
    assert_eq!(desk.files(), ["bad.toml", "file", "old.png", "scene.toml"]);
}

#[test]
fn every_bad_scene_has_status_1_and_names_its_file() {
    let desk = Desk::new();
    fs::write(desk.path("old.png"), "precious").unwrap();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/bad-scenes");
    let mut refused = 0;
    for entry in fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|e| e != "toml") {
            continue;
        }
        let scene = path.to_str().unwrap();
        let run = desk.run(&["render", scene, "-o", "old.png", "--spp", "2"]);
        assert_eq!(run.status, 1, "{scene}: {}", run.err);
        assert!(run.err.contains(path.file_name().unwrap().to_str().unwrap()), "{}", run.err);
        assert!(!run.err.contains("panicked") && run.out.is_empty(), "{scene}: {}", run.err);
        refused += 1;
    }
    assert!(refused >= 40, "only {refused} bad scenes");
    assert_eq!(fs::read_to_string(desk.path("old.png")).unwrap(), "precious");
}

/// Checks the program's message on an emulated processor that lacks an instruction set for which
/// the program was built.
#[cfg(target_arch = "x86_64")]
#[test]
#[ignore = "needs qemu-x86_64 (Debian: qemu-user); promised only with RUSTFLAGS=\"-C target-cpu=x86-64-v3\""]
fn old_processor_gets_a_message() {
    for (model, lacking) in [("Westmere", "avx"), ("SandyBridge", "avx2")] {
        let mut command = Command::new("qemu-x86_64");
        command.args(["-cpu", model, env!("CARGO_BIN_EXE_zerkalo"), "--help"]);
        let run = Run::from(command.output().unwrap());
        assert_eq!(run.status, 1, "{model}: {}", run.err);
        let words = format!("built for a processor with {lacking}, which this one lacks;");
        assert!(run.err.contains(&words), "{model}: {}", run.err);
    }
}

/// Checks the refusal of a picture whose film needs 4.4 GB of memory under a limit of 1.5 GB of
/// address space. The message must state the needed and the available memory, and suggest a remedy.
#[test]
#[cfg(target_os = "linux")]
fn film_that_does_not_fit_is_refused_with_sums_and_remedy() {
    let desk = Desk::new();
    let scene = format!("film.size = [16384, 4096]\n{SCENE}");
    fs::write(desk.path("large.toml"), scene).unwrap();
    let limited = |command: &str| {
        let script = format!("ulimit -v 1500000; exec \"$0\" {command} --threads 2");
        let mut shell = Command::new("sh");
        shell.args(["-c", &script, env!("CARGO_BIN_EXE_zerkalo")]).current_dir(desk.0.path());
        Run::from(shell.output().unwrap())
    };
    for command in ["render large.toml -o a.png", "measure large.toml --seconds 1"] {
        let run = limited(command);
        assert_eq!(run.status, 1, "{command}: {}", run.err);
        for part in [
            "film: 16384 x 4096 pixels with 1 light group need 4.4 GB of memory, and ",
            "are available (the limit on address space, `ulimit -v`)",
            "Expected a smaller picture, such as size = [",
            "], or `zerkalo render --memory SIZE`, which renders it in regions",
        ] {
            assert!(run.err.contains(part), "no {part:?} in {:?}", run.err);
        }
        assert_eq!(desk.files(), ["large.toml", "scene.toml"]);
    }
    // The suggested size fits.
    let run = limited("render large.toml -o a.png --size 64x16 --spp 2");
    assert_eq!(run.status, 0, "{}", run.err);
}

#[test]
fn many_threads_are_reduced() {
    let desk = Desk::new();
    let stats = desk.stats(&["--spp", "2", "--threads", "4096"]);
    let processors = std::thread::available_parallelism().unwrap().get() as u64;
    assert_eq!(stats["threads"].as_u64().unwrap(), (4 * processors).clamp(16, 4096));
}
