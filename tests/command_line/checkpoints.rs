//! Checkpoints of `zerkalo render`: interrupted and resumed renders, refusals, `zerkalo info`.

use super::*;
use crate::harness::*;

/// Number of times that each round of the test kills the render at a random moment.
const KILLS: u64 = 20;

/// Size, stop criterion and threads of the tested renders. Without interruption, a render takes
/// about a second.
const LONG: [&str; 6] = ["--size", "160x120", "--noise", "0.35", "--threads", "2"];

/// Returns the film in the checkpoint at `path` as bytes, which are equal for films with equal
/// samples.
fn test_film(path: &Path) -> Vec<u8> {
    let read = FilmReader::open(path).and_then(FilmReader::read);
    read.unwrap_or_else(|error| panic!("{error}")).film.bytes()
}

fn args<'a>(name: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    [&["render", "scene.toml", "-o", name][..], &LONG, more].concat()
}

#[test]
fn killed_and_resumed_render_equals_an_uninterrupted_one() {
    let desk = Desk::new();
    let whole = desk.run(&args("whole.png", &["--checkpoint", "whole.zk"]));
    assert_eq!(whole.status, 0, "{}", whole.err);
    let keep = ["--checkpoint", "part.zk", "--resume", "part.zk", "--checkpoint-interval", "0.02"];
    let mut resumed = 0;
    for kill in 0..4 * KILLS {
        // On a busy machine, the program may be killed before it writes its first checkpoint. If
        // this happens too often, further rounds with longer waits follow.
        let round = kill / KILLS;
        if round > 0 && resumed > 2 {
            break;
        }
        // Milliseconds from the start to the kill: 50 to 450 in the first round, by a linear
        // congruential generator, and four times as many in each further round.
        let random = (kill + 1).wrapping_mul(6_364_136_223_846_793_005) >> 33;
        let mut child = desk
            .command(&args("part.png", &keep))
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        std::thread::sleep(Duration::from_millis((50 + random % 400) << (2 * round)));
        // The render may have finished already.
        let _ = child.kill();
        child.wait().unwrap();
        if desk.path("part.zk").exists() {
            // The checkpoint must be complete, whenever the render is killed.
            assert!(!test_film(&desk.path("part.zk")).is_empty());
            resumed += 1;
        }
    }
    assert!(resumed > 2, "{resumed} runs had a checkpoint to continue");
    let end = desk.run(&args("part.png", &keep));
    assert_eq!(end.status, 0, "{}", end.err);
    assert!(test_film(&desk.path("part.zk")) == test_film(&desk.path("whole.zk")));
    assert!(fs::read(desk.path("part.png")).unwrap() == fs::read(desk.path("whole.png")).unwrap());
    let leftovers = |name: &String| !name.ends_with(".tmp");
    let files: Vec<_> = desk.files().into_iter().filter(leftovers).collect();
    assert_eq!(files, ["part.png", "part.zk", "scene.toml", "whole.png", "whole.zk"]);
}

#[test]
#[cfg(unix)]
fn signal_keeps_the_samples_and_another_target_continues_them() {
    let desk = Desk::new();
    let args = |noise, more: &[&'static str]| -> Vec<&'static str> {
        [&["render", "scene.toml", "-o", "a.png", "--size", "64x48", "--noise", noise], more]
            .concat()
    };
    let endless = args("1e-6", &["--checkpoint", "a.zk", "--checkpoint-interval", "0.05"]);
    let child = signals::spawn(&desk, &endless);
    signals::wait_for_file(&desk.path("a.zk"));
    signals::signal("TERM", child.id());
    let run = Run::from(child.wait_with_output().unwrap());
    assert_eq!(run.status, 143, "{}", run.err);
    let before = FilmReader::open(&desk.path("a.zk")).unwrap().read().unwrap().film.samples();
    assert!(before > 0);
    // The checkpoint already meets the noise target of the resumed render, which must keep the
    // samples of the checkpoint.
    let done = desk.run(&args("200", &["--resume", "a.zk", "--checkpoint", "b.zk"]));
    assert_eq!(done.status, 0, "{}", done.err);
    let after = FilmReader::open(&desk.path("b.zk")).unwrap().read().unwrap().film.samples();
    assert!(after >= before, "{before} samples before, {after} after");
}

#[test]
fn checkpoints_of_other_renders_are_refused_with_a_remedy() {
    let desk = Desk::new();
    let first = desk.render("a.png", &["--spp", "4", "--checkpoint", "a.zk"]);
    assert_eq!(first.status, 0, "{}", first.err);
    fs::write(desk.path("moved.toml"), SCENE.replace("2.0, 4.0, 3.0", "2.0, 4.0, 2.0")).unwrap();
    fs::write(desk.path("lit.toml"), SCENE.replace("name = \"lamp\"", "intensity = 0.5")).unwrap();
    let bytes = fs::read(desk.path("a.zk")).unwrap();
    fs::write(desk.path("cut.zk"), &bytes[..bytes.len() / 2]).unwrap();
    let mut altered = bytes.clone();
    altered[bytes.len() / 2] ^= 4;
    fs::write(desk.path("altered.zk"), altered).unwrap();
    let render = |scene: &str, more: &[&str]| {
        desk.run(&[&["render", scene, "-o", "b.png", "--spp", "8"], more].concat())
    };
    let small = ["--size", "64x48"];
    for (scene, more, expected) in [
        (
            "scene.toml",
            &["--resume", "a.zk"][..],
            "its size is 64x48, not 640x480; add --size 64x48",
        ),
        ("scene.toml", &["--resume", "a.zk", "--seed", "7"], "its seed is 0, not 7; add --seed 0"),
        (
            "scene.toml",
            &["--resume", "a.zk", "--sampler", "random"],
            "its sampler is sobol, not random; add --sampler sobol",
        ),
        (
            "scene.toml",
            &["--resume", "a.zk", "--precision", "double"],
            "its precision is single, not double; add --precision single",
        ),
        (
            "moved.toml",
            &["--resume", "a.zk"],
            "another scene, which differs in more than its lights",
        ),
        ("scene.toml", &["--resume", "cut.zk"], "it ends in the middle of"),
        ("scene.toml", &["--resume", "altered.zk"], "it is damaged or was altered: the checksum"),
        ("scene.toml", &["--resume", "scene.toml"], "it is not a film file"),
        ("scene.toml", &["--resume", "none.zk"], "there is no such file"),
        ("scene.toml", &["--checkpoint", "a.zk"], "add --resume a.zk to continue it, or remove it"),
        ("scene.toml", &["--checkpoint", "lit.toml"], "there is another file of this name"),
        ("scene.toml", &["--checkpoint", "b.png"], "--checkpoint and --output name the same file"),
        ("scene.toml", &["--checkpoint", "no/a.zk"], "does not exist; create it first"),
    ] {
        let size: &[&str] = if expected.starts_with("its size") { &[] } else { &small };
        let run = render(scene, &[more, size].concat());
        assert_ne!(run.status, 0, "{more:?}");
        assert!(run.err.contains(expected), "{more:?}: {:?}", run.err);
        assert!(!desk.path("b.png").exists(), "{more:?}");
    }
    assert!(fs::read(desk.path("a.zk")).unwrap() == bytes);
    // A checkpoint can be resumed with other light weights. The picture then equals that of a new
    // render with these weights.
    let relit = render("lit.toml", &["--size", "64x48", "--uniform", "--resume", "a.zk"]);
    assert_eq!(relit.status, 0, "{}", relit.err);
    assert!(relit.err.contains("the lights of the scene differ"), "{}", relit.err);
    let relit = fs::read(desk.path("b.png")).unwrap();
    let anew = render("lit.toml", &["--size", "64x48", "--uniform"]);
    assert!(relit == fs::read(desk.path("b.png")).unwrap(), "{}", anew.out);
}

/// Checks that the contents of mesh files are part of a scene's identity, although the text of the
/// scene contains only the names of the files.
#[test]
fn changed_mesh_is_another_scene() {
    let desk = Desk::new();
    let mesh = "\n[[object]]\nmaterial = \"red\"\nshape.mesh = { file = \"a.obj\" }\n";
    let text = format!("{SCENE}{mesh}");
    fs::write(desk.path("scene.toml"), &text).unwrap();
    fs::write(desk.path("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let first = desk.render("a.png", &["--spp", "2", "--checkpoint", "a.zk"]);
    assert_eq!(first.status, 0, "{}", first.err);
    assert_eq!(desk.run(&["info", "a.png", "--scene", "scene.toml"]).status, 0);
    fs::write(desk.path("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 2 0\nf 1 2 3\n").unwrap();
    let again = desk.render("b.png", &["--spp", "4", "--resume", "a.zk"]);
    assert_eq!(again.status, 1);
    assert!(
        again.err.contains("meshes or images of the scene have other contents"),
        "{}",
        again.err
    );
    for file in ["a.png", "a.zk"] {
        let info = desk.run(&["info", file, "--scene", "scene.toml"]);
        assert_eq!(info.status, 1);
        assert!(info.err.contains("shows another scene than scene.toml describes"), "{}", info.err);
    }
}

#[test]
fn info_prints_the_origin_of_pictures_and_checkpoints() {
    let desk = Desk::new();
    for picture in ["a.png", "a.exr"] {
        let more = ["--spp", "8", "--seed", "42", "--checkpoint", "a.zk"];
        let run = desk.render(picture, &more[..if picture == "a.png" { 6 } else { 4 }]);
        assert_eq!(run.status, 0, "{}", run.err);
    }
    for (file, format) in [("a.png", "PNG"), ("a.exr", "OpenEXR"), ("a.zk", "film")] {
        let info = desk.run(&["info", file, "--scene", "scene.toml"]);
        assert_eq!(info.status, 0, "{}", info.err);
        let first = format!("{file}: {format}, 64 x 48 pixels\n");
        assert!(info.out.starts_with(&first), "{}", info.out);
        for part in [
            concat!("zerkalo ", env!("CARGO_PKG_VERSION")),
            "fnv1a64:",
            "42\n",
            "8.00 (8-8)",
            "8-bit levels",
            "single precision",
            "scene: scene.toml and the files that it names are those of",
        ] {
            assert!(info.out.contains(part), "{file}: no {part:?} in {}", info.out);
        }
    }
    let info = desk.run(&["info", "scene.toml"]);
    assert_eq!(info.status, 1);
    assert!(info.err.contains("it is no PNG, OpenEXR or film file"), "{}", info.err);
}
