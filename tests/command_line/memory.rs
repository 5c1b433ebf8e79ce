//! `zerkalo render --memory`, which renders big pictures in regions, one after the other. The
//! picture equals that of a render without regions. Further tests check refusals and signals.

use super::*;

/// Arguments of a uniform render, whose film has 7 MB for each light group.
const UNIFORM: [&str; 5] = ["--size", "400x375", "--spp", "4", "--uniform"];

fn within(desk: &Desk, scene: &str, name: &str, memory: &str, more: &[&str]) -> Run {
    desk.run(&[&["render", scene, "-o", name, "--memory", memory], &UNIFORM[..], more].concat())
}

/// Returns the smallest amount of memory in megabytes that a render of `scene` accepts, as the
/// program's refusal states it. `more` are further arguments.
fn least(desk: &Desk, scene: &str, more: &[&str]) -> u64 {
    let run = within(desk, scene, "refused.png", "1KB", more);
    assert_eq!(run.status, 1, "{}", run.err);
    assert!(run.err.starts_with("--memory allows 1 KB, but the scene and a region"), "{}", run.err);
    let advice = run.err.split("expected at least --memory ").nth(1).unwrap();
    assert!(!desk.path("refused.png").exists());
    advice.trim_end().strip_suffix("MB").unwrap().parse().unwrap()
}

/// Returns the number of regions in which the program has rendered, by its own report.
fn regions(run: &Run) -> u32 {
    assert_eq!(run.status, 0, "{}", run.err);
    let line = run.err.lines().find(|line| line.starts_with("memory: ")).unwrap();
    match line.split_once(" regions of ") {
        Some((start, _)) => start.rsplit(' ').next().unwrap().parse().unwrap(),
        None => 1,
    }
}

#[test]
fn regions_equal_the_picture_as_a_whole() {
    let desk = Desk::new();
    for (format, bits) in [("png", "8"), ("png", "16"), ("exr", "8")] {
        let [whole, part] = ["whole", "part"].map(|name| format!("{name}.{format}"));
        let picture = |name: &str| fs::read(desk.path(name)).unwrap();
        let args = ["render", "scene.toml", "-o", &whole, "--bits", bits];
        assert_eq!(desk.run(&[&args[..], &UNIFORM].concat()).status, 0);
        for threads in ["1", "5"] {
            let more = ["--bits", bits, "--threads", threads, "--stats", "stats.json"];
            let least = least(&desk, "scene.toml", &more);
            let mut counts = Vec::new();
            for more_memory in [0, 2, 4, 1000] {
                let memory = format!("{}MB", least + more_memory);
                let run = within(&desk, "scene.toml", &part, &memory, &more);
                counts.push(regions(&run));
                assert!(picture(&part) == picture(&whole), "{format} {bits} {threads} {memory}");
                let stats = fs::read(desk.path("stats.json")).unwrap();
                let stats: serde_json::Value = serde_json::from_slice(&stats).unwrap();
                let peak = stats["peak_rss_bytes"].as_u64();
                let cap = (least + more_memory) * 1_000_000;
                // The limit must also hold for larger executables, such as those of test builds,
                // because the program measures the memory that it and the scene take.
                assert!(peak.is_none_or(|peak| peak <= cap), "{memory}: {peak:?} bytes");
                assert_eq!(stats["stopped_by"], "spp");
            }
            // The program rounds the least memory up by at most 2 MB, which hold up to a third of
            // the film. With the least memory, there are therefore more than two regions.
            let falls = counts.is_sorted_by(|fewer, more| fewer >= more);
            assert!(counts[0] > 2 && falls && counts[3] == 1, "{counts:?}");
        }
    }
}

/// Checks that a lack of memory first puts all lights into one light group. Only if the film is
/// still too large is the picture divided into regions. Samples of a shared group are multiplied by
/// the lights' colours before they are added. The picture therefore differs by rounding from one
/// with separate groups.
#[test]
fn lights_are_merged_first() {
    let desk = Desk::new();
    let lights = "\n[[light]]\nname = \"fill\"\npoint = { position = [-3.0, 3.0, 3.0] }\n\
                  color = [0.3, 0.5, 1.0]\n\n[[light]]\npoint = { position = [0.0, 5.0, 0.0] }\n";
    fs::write(desk.path("three.toml"), format!("{SCENE}{lights}")).unwrap();
    let args = ["render", "three.toml", "-o", "whole.png"];
    assert_eq!(desk.run(&[&args[..], &UNIFORM].concat()).status, 0);
    let least = least(&desk, "three.toml", &["--threads", "2"]);
    let mut pictures = Vec::new();
    for (memory, merged) in [(least + 1, true), (least + 3, true), (least + 9, true), (999, false)]
    {
        let name = format!("{memory}.png");
        let more = ["--threads", "2"];
        let run = within(&desk, "three.toml", &name, &format!("{memory}MB"), &more);
        let words = "3 light groups merged into 1";
        assert_eq!(run.err.contains(words), merged, "{memory}: {}", run.err);
        assert!(!merged || regions(&run) > 1 || memory == least + 9, "{memory}: {}", run.err);
        pictures.push(fs::read(desk.path(&name)).unwrap());
    }
    assert!(pictures[0] == pictures[1] && pictures[1] == pictures[2], "regions differ");
    let read =
        |name: &str| zerkalo_render::image_file::read_png(&desk.path(name)).unwrap().into_raw();
    let pairs = || read("whole.png").into_iter().zip(read(&format!("{}.png", least + 1)));
    let farthest = pairs().map(|(a, b)| a.abs_diff(b)).max();
    assert!(farthest <= Some(1), "{farthest:?} levels");
    assert!(fs::read(desk.path("999.png")).unwrap() == fs::read(desk.path("whole.png")).unwrap());
}

#[test]
fn adaptive_regions_reach_the_noise_target() {
    let desk = Desk::new();
    let least = least(&desk, "scene.toml", &["--threads", "2"]);
    let args = ["render", "scene.toml", "-o", "a.png", "--size", "400x375", "--noise", "2"];
    let memory = format!("{}MB", least + 3);
    let more = ["--threads", "2", "--memory", &memory, "--stats", "stats.json"];
    let run = desk.run(&[&args[..], &more].concat());
    assert!(regions(&run) > 1, "{}", run.err);
    let stats: serde_json::Value =
        serde_json::from_slice(&fs::read(desk.path("stats.json")).unwrap()).unwrap();
    assert_eq!(stats["stopped_by"], "noise");
    assert!(stats["noise_levels"].as_f64().unwrap() <= 2.0, "{stats}");
    assert!(stats["spp_max"].as_u64() > stats["spp_min"].as_u64(), "{stats}");
    let info = desk.run(&["info", "a.png"]);
    assert!(info.out.contains("adaptive") && !info.out.contains("  \n"), "{}", info.out);
}

#[test]
fn checkpoint_of_a_film_that_does_not_fit_is_refused() {
    let desk = Desk::new();
    let memory = format!("{}MB", least(&desk, "scene.toml", &[]) + 2);
    let run = within(&desk, "scene.toml", "a.png", &memory, &["--checkpoint", "a.zk"]);
    assert_eq!(run.status, 1, "{}", run.err);
    for part in ["a checkpoint has the whole film, which needs ", "no --checkpoint"] {
        assert!(run.err.contains(part), "{}", run.err);
    }
    assert_eq!(desk.files(), ["scene.toml"]);
    let run = within(&desk, "scene.toml", "a.png", "1GB", &["--checkpoint", "a.zk"]);
    assert_eq!((regions(&run), desk.files().len()), (1, 3));
    let run = within(&desk, "scene.toml", "a.png", "1", &[]);
    assert!(run.status == 2 && run.err.contains("such as 4GB"), "{}", run.err);
}

/// Checks that a signal between two regions leaves the old picture file unchanged, and that no
/// further file remains.
#[test]
#[cfg(unix)]
fn signal_leaves_no_part_of_a_picture() {
    let desk = Desk::new();
    let memory = format!("{}MB", least(&desk, "scene.toml", &["--threads", "2"]) + 1);
    fs::write(desk.path("a.png"), "old").unwrap();
    let args = ["render", "scene.toml", "-o", "a.png", "--size", "400x375", "--threads", "2"];
    let more = ["--spp", "1000000", "--uniform", "--memory", &memory];
    for (name, status) in [("INT", 130), ("TERM", 143)] {
        let child = signals::spawn(&desk, &[&args[..], &more].concat());
        signals::signal(name, child.id());
        let run = Run::from(child.wait_with_output().unwrap());
        assert_eq!(run.status, status, "{}", run.err);
        // A signal during the compilation ends the program without a message.
        let compiling = run.err.lines().all(|l| l.is_empty() || l.starts_with("memory: "));
        let reported = run.err.contains("a.png is not written, because regions");
        assert!(compiling || reported, "{}", run.err);
        assert_eq!(fs::read(desk.path("a.png")).unwrap(), b"old");
        assert_eq!(desk.files(), ["a.png", "scene.toml"]);
    }
}
