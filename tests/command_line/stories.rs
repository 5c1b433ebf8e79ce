//! Stories of the command line: lines of a shell, with the exit status and parts of stdout and stderr.

use super::*;

/// Story: lines of a shell, exit status, part of stdout, part of stderr. `$S` is a small size and few
/// samples, `$N` a render that does not end by itself. An empty part stands for no output, `*` for
/// any. Later stories use the files of earlier ones.
type Story = (&'static str, i32, &'static str, &'static str);

const STORIES: &[Story] = &[
    // Streams.
    ("zerkalo render - $S -o a.png < scene.toml", 0, "a.png  16x12  2 spp", ""),
    ("cat scene.toml | zerkalo check -", 0, "-: valid", ""),
    ("zerkalo render scene.toml $S -o - | od -An -tx1 -N4", 0, " 89 50 4e 47", "-  16x12  2 spp"),
    ("zerkalo render -q scene.toml $S -o - --format exr | od -An -tx1 -N4", 0, " 76 2f 31 01", ""),
    ("zerkalo scenes lamp | zerkalo render - $S -o - -q > b.png; cmp a.png b.png", 1, "differ", ""),
    (
        "zerkalo render -q scene.toml $S -o - > b.png; zerkalo compare a.png b.png",
        0,
        "RMSE 0.000",
        "",
    ),
    ("(zerkalo render -q scene.toml $S -o -; echo $? >&2) | true", 0, "", "0"),
    ("(zerkalo scenes; echo $? >&2) | true", 0, "", "0"),
    ("zerkalo check scene.toml >&-", 0, "", ""),
    ("zerkalo render scene.toml $S -o c.png 2>&-", 0, "c.png", ""),
    ("zerkalo check - < /dev/null", 1, "", "stdin:1:1  the file holds no scene."),
    (
        "zerkalo render scene.toml $S -o plain --format exr && zerkalo info plain",
        0,
        "plain: OpenEXR",
        "",
    ),
    ("zerkalo render scene.toml $S -o a.jpg", 2, "", ".png, .exr"),
    ("zerkalo render scene.toml $S -o a --format jpg", 2, "", "possible values: png, exr"),
    // Several scenes.
    ("zerkalo render scene.toml :lamp $S -o n-%03d.png && ls n-*", 0, "n-001.png\nn-002.png\n", ""),
    (
        "zerkalo render scene.toml bad.toml - $S -o m%d.png < scene.toml",
        1,
        "m3.png",
        "1 of 3 scenes failed",
    ),
    ("zerkalo render scene.toml :lamp $S -o a.png", 2, "", "several scenes and one file, a.png"),
    ("zerkalo render scene.toml :lamp $S -o %d.png --stats s.json", 2, "", "one file, s.json"),
    // Built-in scenes.
    ("zerkalo scenes", 0, "lamp-and-mirror  A lamp before a mirror", ""),
    ("zerkalo scenes lamp copy.toml && zerkalo check copy.toml", 0, "copy.toml: valid", "*"),
    ("zerkalo scenes lamp copy.toml", 1, "", "there is such a file already"),
    (
        "zerkalo render :gallery -o x.png",
        1,
        "",
        "several built-in scenes have gallery in their names",
    ),
    ("zerkalo render :none -o x.png", 1, "", "no built-in scene is called none; there are lamp"),
    // Quiet, no clobber.
    ("zerkalo render -q scene.toml $S --seed 1 -o q.png", 0, "", ""),
    ("zerkalo check -q bad.toml", 1, "", "bad.toml:15:"),
    ("zerkalo render scene.toml $S -n -o q.png", 1, "", "there is such a file already"),
    (
        "zerkalo render scene.toml $S -n -o x.png --stats q.png",
        1,
        "",
        "there is such a file already",
    ),
    // JSON.
    ("zerkalo check --json scene.toml", 0, "\"valid\": true", ""),
    ("zerkalo check --json bad.toml", 1, "\"line\": 15", "bad.toml:15:"),
    ("zerkalo info --json q.png", 0, "\"noise_levels\": ", ""),
    ("zerkalo doctor --json", 0, "\"hints\": [", ""),
    ("zerkalo plan scene.toml $P --json -o j.plan", 0, "\"total_rays\": ", ""),
    ("zerkalo plan scene.toml $P -n -o j.plan", 1, "", "there is such a file already"),
    ("zerkalo render -q scene.toml --plan j.plan --shard 1 -o j-1.zk", 0, "", ""),
    ("zerkalo merge j.plan -o j.png --json", 0, "\"missing\": null", ""),
    // Comparison.
    ("zerkalo compare a.png q.png -o d.png && zerkalo info d.png", 0, "the pictures agree", ""),
    ("zerkalo compare a.png q.png --threshold 0.1", 1, "RMSE", "8-bit levels, more than 0.1"),
    ("zerkalo compare plain plain --json", 0, "\"rmse_linear\": 0.0", ""),
    ("zerkalo compare --json a.png n-002.png", 0, "\"agree\": false", ""),
    ("zerkalo compare a.png j.png", 0, "16x12  RMSE", ""),
    ("zerkalo compare a.png scene.toml", 1, "", "it is no PNG, OpenEXR or film file"),
    ("zerkalo compare a.png j-1.zk", 1, "", "it is a film; expected a PNG or OpenEXR picture"),
    // Mistyped names, errors in scenes.
    ("zerkalo rendr scene.toml", 2, "", "did you mean `render`?\nCommands: render, plan, work"),
    ("zerkalo rendr", 2, "", "did you mean `render`?"),
    ("zerkalo check scen.toml", 1, "", "Did you mean scene.toml?"),
    (
        "zerkalo check bad.toml",
        1,
        "",
        "   15 | shape.sphere = { center = [0.0, 0.5, 0.0], radius = -0.5 }\n      |",
    ),
    (
        "(cat scene.toml; echo sphere = 3) | zerkalo check -",
        1,
        "",
        "Expected shape.sphere instead of sphere.",
    ),
    ("(cat scene.toml; echo ior = 3) | zerkalo check -", 1, "", "It is a key of [materials.NAME]."),
    (
        "echo '[camera]\nfov = 3' | zerkalo check -",
        1,
        "",
        "Here it is view_angle = { vertical = 40.0 }",
    ),
    ("echo 'materials.a.color = \"#fff\"' | zerkalo check -", 1, "", "Did you mean \"#ffffff\"?"),
    (
        "echo 'materials.a.emission = [1, 1, 1]' | zerkalo check -",
        1,
        "",
        "its colour is emission_color",
    ),
    // Files of packages.
    ("zerkalo completions zsh | head -n 1", 0, "#compdef zerkalo", ""),
    (
        "zerkalo man pages && ls pages",
        0,
        "zerkalo-status.1\nzerkalo-watch.1\nzerkalo-work.1\nzerkalo.1\n",
        "",
    ),
    // No terminal, help, signals, deadline.
    ("zerkalo scene.toml", 2, "", "the dashboard needs a terminal"),
    ("zerkalo new new.toml", 0, "`zerkalo new.toml` opens it in the dashboard", ""),
    ("zerkalo --help", 0, "128 + N  stopped by signal N", ""),
    ("zerkalo compare --help", 0, "Examples:\n  zerkalo compare before.png", ""),
    ("timeout 0.2 zerkalo render scene.toml $N -o t.png", 124, "so far", "*"),
    ("zerkalo render scene.toml $N -o k.png & sleep 0.2; kill $!; wait $!", 143, "so far", "*"),
    ("zerkalo render scene.toml $N --time 0.2 -o - | zerkalo scenes", 0, "*", "noise"),
];

#[test]
fn stories_of_the_shell() {
    let desk = Desk::new();
    fs::write(desk.path("bad.toml"), SCENE.replace("radius = 0.5", "radius = -0.5")).unwrap();
    let program = Path::new(env!("CARGO_BIN_EXE_zerkalo")).parent().unwrap();
    let path = format!("{}:{}", program.display(), std::env::var("PATH").unwrap());
    let fits = |part: &str, output: &str| match part {
        "*" => true,
        "" => output.is_empty(),
        part => output.contains(part),
    };
    let mut failures = String::new();
    for (script, status, out, err) in STORIES {
        let mut shell = Command::new("sh");
        shell.args(["-c", script]).current_dir(desk.0.path()).env("PATH", &path);
        shell.env("S", "--size 16x12 --spp 2").env("N", "--size 16x12 --noise 1e-9");
        shell.env("P", "--size 16x12 --noise 8 --shards 1").stdin(Stdio::null());
        let run = Run::from(shell.output().unwrap());
        if run.status != *status || !fits(out, &run.out) || !fits(err, &run.err) {
            failures += &format!("{script}: {}\n{}{}\n", run.status, run.out, run.err);
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

/// Checks that renders of the shipped scenes are written by the deadline, and that 85 % or more end
/// with a noise in the interval that was forecast.
#[test]
#[ignore = "five minutes, idle machine: cargo test --release --test program deadlines -- --ignored"]
fn deadlines_of_shipped_scenes_are_kept() {
    let desk = Desk::new();
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/features");
    let entries = fs::read_dir(folder).unwrap().flatten().map(|entry| entry.path());
    let mut scenes: Vec<_> =
        entries.filter(|path| path.extension() == Some("toml".as_ref())).collect();
    scenes.sort();
    let (mut late, mut forecasts, mut within) = (Vec::new(), 0, 0);
    for (i, scene) in scenes.iter().enumerate() {
        let seconds = 2 + i % 4;
        let name = scene.to_str().unwrap();
        let start = Instant::now();
        let args =
            ["render", name, "-o", "a.png", "--stats", "s.json", "--noise", "1e-9", "--time"];
        let run = desk.run(&[&args[..], &[&seconds.to_string()]].concat());
        let elapsed = start.elapsed().as_secs_f64();
        assert_eq!(run.status, 0, "{name}: {}", run.err);
        if elapsed > seconds as f64 {
            late.push(format!("{name}: {elapsed:.2} of {seconds} s"));
        }
        let stats: serde_json::Value =
            serde_json::from_slice(&fs::read(desk.path("s.json")).unwrap()).unwrap();
        let line =
            run.err.lines().find_map(|line| line.split_once(": noise ")?.1.split_once(" 8-bit"));
        let Some(((low, high), noise)) = line
            .and_then(|(range, _)| range.split_once(" to "))
            .zip(stats["noise_levels"].as_f64())
        else {
            continue;
        };
        let [low, high] = [low, high].map(|end| end.parse::<f64>().unwrap());
        forecasts += 1;
        within += usize::from((low - 0.005..=high + 0.005).contains(&noise));
        println!("{name}: {seconds} s, {elapsed:.2} s, {noise:.3} in {low} to {high}");
    }
    println!("{} of {} late, {within} of {forecasts} as forecast", late.len(), scenes.len());
    assert!(late.is_empty() && 100 * within >= 85 * forecasts, "{late:?}");
}
