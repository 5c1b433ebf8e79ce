//! Division of a render among processes. A plan assigns samples to shards, each process traces a
//! shard into a film file (a part), and `zerkalo merge` adds the parts.

use crate::command_line::Desk;
use crate::harness::*;

/// Runs the program with `args`, which must succeed. Returns the program's output on stdout.
pub fn done(desk: &Desk, args: &[&str]) -> String {
    let run = desk.run(args);
    assert_eq!(run.status, 0, "{args:?}: {}", run.err);
    run.out
}

/// Runs the program with `args`, which must fail with exit status 1. Returns the program's message.
fn refused(desk: &Desk, args: &[&str]) -> String {
    let run = desk.run(args);
    assert_eq!(run.status, 1, "{args:?}: {}{}", run.out, run.err);
    run.err
}

/// Plans a render of the scene in 64x48 pixels by `shards` shards, as `NAME.plan`.
pub fn plan(desk: &Desk, name: &str, shards: usize) {
    let (output, shards) = (format!("{name}.plan"), shards.to_string());
    let args = ["plan", "scene.toml", "-o", &output, "--size", "64x48", "--noise", "0.5"];
    done(desk, &[&args[..], &["--shards", &shards]].concat());
}

/// Replaces the samples per pixel and replicate of each tile of `job.plan`, a first round.
pub fn set_samples(desk: &Desk, samples: u32) {
    let text = fs::read_to_string(desk.path("job.plan")).unwrap();
    let body =
        text[..text.rfind("checksum").unwrap()].replace("\n0 4 1", &format!("\n0 {samples} 1"));
    let checksum = zerkalo_scene::value::fnv1a64(body.as_bytes());
    fs::write(desk.path("job.plan"), format!("{body}checksum {checksum:016x}\n")).unwrap();
}

/// Traces shard `number` of the plan `NAME.plan`. Returns the name of the shard's film file,
/// `NAME-number.zk`.
pub fn trace(desk: &Desk, name: &str, number: usize) -> String {
    let (plan, part, number) =
        (format!("{name}.plan"), format!("{name}-{number}.zk"), number.to_string());
    done(desk, &["render", "scene.toml", "--plan", &plan, "--shard", &number, "-o", &part]);
    part
}

/// Plans a render and traces all shards of its first round. Returns the names of their film files.
pub fn traced(desk: &Desk, name: &str, shards: usize) -> Vec<String> {
    plan(desk, name, shards);
    (1..=shards).map(|number| trace(desk, name, number)).collect()
}

/// Plans a render and traces all its rounds. Returns the name of the last plan, without `.plan`.
fn finished(desk: &Desk, name: &str, shards: usize) -> String {
    plan(desk, name, shards);
    done(desk, &["work", "scene.toml", &format!("{name}.plan")]);
    let rounds = (2..).map(|round| format!("{name}.{round}"));
    let last = rounds.take_while(|name| desk.path(&format!("{name}.plan")).exists()).last();
    last.expect("more than one round")
}

pub fn merge(desk: &Desk, parts: &[String], output: &str) -> Vec<u8> {
    let mut args = vec!["merge", "-o", output];
    args.extend(parts.iter().map(String::as_str));
    done(desk, &args);
    fs::read(desk.path(output)).unwrap()
}

#[test]
fn shards_merged_in_any_order_equal_one_run_of_the_plan() {
    let desk = Desk::new();
    let mut random = 1u64;
    let mut films = Vec::new();
    for shards in [1, 3, 16] {
        let name = finished(&desk, &format!("of{shards}"), shards);
        let mut parts: Vec<_> = (1..=shards).map(|n| format!("{name}-{n}.zk")).collect();
        let plan = format!("{name}.plan");
        let one = ["one.png", "one.exr"].map(|output| {
            done(&desk, &["render", "scene.toml", "--plan", &plan, "-o", output]);
            fs::read(desk.path(output)).unwrap()
        });
        for order in 0..3 {
            for i in (1..parts.len()).rev() {
                random = random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
                parts.swap(i, (random >> 33) as usize % (i + 1));
            }
            let png = merge(&desk, &parts, "merged.png");
            assert!(png == one[0], "{shards} shards in order {order}: another PNG");
        }
        assert!(merge(&desk, &parts, "merged.exr") == one[1], "{shards} shards: another EXR");
        // Film files of shards can also be merged in several steps.
        let (first, rest) = parts.split_at(parts.len().div_ceil(2));
        let args = ["merge", "--partial", "-o", "half.zk"];
        done(&desk, &[&args[..], &first.iter().map(String::as_str).collect::<Vec<_>>()].concat());
        assert!(merge(&desk, &[plan], "plan.png") == one[0], "{shards} shards named by their plan");
        let steps = [&["half.zk".to_string()], rest].concat();
        let first_plan = [format!("of{shards}.plan")];
        assert!(
            merge(&desk, &first_plan, "job.png") == one[0],
            "{shards} shards named by their job"
        );
        assert!(merge(&desk, &steps, "steps.png") == one[0], "{shards} shards in two steps");
        merge(&desk, &parts, "merged.zk");
        let film = FilmReader::open(&desk.path("merged.zk")).and_then(FilmReader::read);
        films.push(film.unwrap().film.bytes());
    }
    // The number of shards has no influence on the film.
    assert!(films.iter().all(|film| *film == films[0]));
}

#[test]
fn info_names_the_shards_of_pictures_films_and_plans() {
    let desk = Desk::new();
    let parts = traced(&desk, "job", 3);
    for output in ["a.png", "a.exr", "a.zk"] {
        merge(&desk, &parts, output);
        let info = done(&desk, &["info", output, "--scene", "scene.toml"]);
        assert!(info.contains("1-3 of 3, plan "), "{output}: {info}");
        assert!(info.contains("are those of"), "{output}: {info}");
    }
    let some = ["job-2.zk"];
    for output in ["b.png", "b.exr", "b.zk"] {
        done(&desk, &[&["merge", "--partial", "-o", output], &some[..]].concat());
        let info = done(&desk, &["info", output]);
        assert!(info.contains("2 of 3, missing 1, 3, plan "), "{output}: {info}");
    }
    let info = done(&desk, &["info", "job-3.zk"]);
    let plan = done(&desk, &["info", "job.plan", "--scene", "scene.toml"]);
    assert!(plan.starts_with("job.plan: plan, 64 x 48 pixels\n"), "{plan}");
    assert!(plan.contains("round 1") && plan.contains("are those of job.plan"), "{plan}");
    for text in [&info, &plan] {
        assert!(text.contains("3 shards, ") && text.contains("target 0.5 8-bit levels"), "{text}");
    }
    let checksum = plan.lines().find_map(|line| line.trim().strip_prefix("Checksum")).unwrap();
    assert!(info.contains(&format!("3 of 3, missing 1-2, plan {}", checksum.trim())), "{info}");
    let text = fs::read_to_string(desk.path("scene.toml")).unwrap();
    fs::write(desk.path("other.toml"), text.replace("0.8, 0.2", "0.7, 0.2")).unwrap();
    for file in ["a.png", "a.zk", "job-3.zk", "job.plan"] {
        let error = refused(&desk, &["info", file, "--scene", "other.toml"]);
        assert!(error.contains(&format!("{file} shows another scene than other.toml")), "{error}");
    }
    let plan = fs::read(desk.path("job.plan")).unwrap();
    fs::write(desk.path("cut.plan"), &plan[..plan.len() / 2]).unwrap();
    assert!(refused(&desk, &["info", "cut.plan"]).contains("it is damaged, altered or incomplete"));
}

#[test]
fn repeated_shard_keeps_its_complete_part() {
    let desk = Desk::new();
    plan(&desk, "job", 2);
    let part = trace(&desk, "job", 1);
    let before = fs::read(desk.path(&part)).unwrap();
    let args = ["render", "scene.toml", "--plan", "job.plan", "--shard", "1", "-o", &part];
    assert!(done(&desk, &args).contains("complete already"));
    assert!(fs::read(desk.path(&part)).unwrap() == before);
    // A shard is traced again if its film file is damaged.
    fs::write(desk.path(&part), &before[..before.len() / 2]).unwrap();
    assert!(desk.run(&args).err.contains("the shard starts again"));
    assert!(fs::read(desk.path(&part)).unwrap() == before);
}

#[test]
fn gaps_and_overlaps_are_refused_by_name() {
    let desk = Desk::new();
    let parts = traced(&desk, "job", 5);
    fs::copy(desk.path("job-3.zk"), desk.path("copy.zk")).unwrap();
    let all: Vec<&str> = parts.iter().map(String::as_str).collect();
    let error = refused(&desk, &[&["merge", "-o", "a.png", "copy.zk"], &all[..]].concat());
    assert!(error.contains("copy.zk and job-3.zk both hold shard 3"), "{error}");

    let some = ["merge", "-o", "a.png", "job-1.zk", "job-4.zk"];
    let error = refused(&desk, &some);
    assert!(error.contains("of 5 shards these are missing: 2-3, 5"), "{error}");
    assert!(
        error.contains("zerkalo work scene.toml PLAN") && error.contains("--partial"),
        "{error}"
    );
    assert!(!desk.path("a.png").exists());

    let without_2 = ["merge", "--partial", "-o", "a.png", "job-1.zk", "job-3.zk"];
    let text = done(&desk, &[&without_2[..], &["job-4.zk", "job-5.zk"]].concat());
    assert!(text.contains("missing of 5 shards: 2; noise "), "{text}");
    assert!(text.contains(" of 12 tiles, which are black"), "{text}");
    let picture = String::from_utf8_lossy(&fs::read(desk.path("a.png")).unwrap()).into_owned();
    assert!(picture.contains("Shards\x001, 3-5 of 5, missing 2, plan "));

    traced(&desk, "other", 4);
    let error = refused(&desk, &[&["merge", "-o", "a.png", "other-1.zk"], &all[1..]].concat());
    assert!(error.contains("different plans (`shards 4` and `shards 5`)"), "{error}");
    let error = refused(&desk, &["merge", "job.plan", "-o", "a.png"]);
    assert!(error.contains("the noise after round 1 is above the target"), "{error}");
}

#[test]
fn plans_are_for_their_scene_and_their_shards() {
    let desk = Desk::new();
    plan(&desk, "job", 2);
    let render =
        |more: &[&str]| desk.run(&[&["render", "scene.toml", "--plan", "job.plan"], more].concat());
    let run = render(&["--shard", "3", "-o", "a.zk"]);
    assert!(run.status == 2 && run.err.contains("has the shards 1 to 2"), "{}", run.err);
    let run = render(&["--shard", "1", "-o", "a.png"]);
    assert!(run.status == 2 && run.err.contains("name a .zk file"), "{}", run.err);
    trace(&desk, "job", 1);
    let run = render(&["--shard", "2", "-o", "job-1.zk"]);
    assert!(run.status == 1 && run.err.contains("holds shard 1; remove it"), "{}", run.err);
    for conflict in [["--seed", "1"], ["--noise", "1"], ["--size", "8x8"]] {
        assert_eq!(render(&[&conflict[..], &["-o", "a.png"]].concat()).status, 2, "{conflict:?}");
    }
    fs::File::create(desk.path("large.plan")).unwrap().set_len(1 << 28).unwrap();
    let args = ["render", "scene.toml", "--plan", "large.plan", "-o", "a.png"];
    assert!(refused(&desk, &args).contains("a plan has at most 134217728"));
    let run = desk.run(&["render", "scene.toml", "--shard", "1", "-o", "a.zk"]);
    assert_eq!(run.status, 2, "a shard without a plan");
    let text = fs::read_to_string(desk.path("scene.toml")).unwrap();
    fs::write(desk.path("scene.toml"), text.replace("0.8, 0.2", "0.7, 0.2")).unwrap();
    let run = render(&["-o", "a.png"]);
    assert!(run.status == 1 && run.err.contains("is not the scene of job.plan"), "{}", run.err);
}

#[test]
fn finished_job_is_refined_by_further_rounds() {
    let desk = Desk::new();
    let name = finished(&desk, "job", 5);
    let status = || {
        let text = done(&desk, &["status", "job.plan", "--json"]);
        serde_json::from_str::<serde_json::Value>(&text).unwrap()
    };
    assert_eq!((&status()["finished"], &status()["percent"]), (&true.into(), &100.0.into()));
    let next = ["plan", "--from", "job.plan", "--noise", "0.25", "--shards", "3"];
    let text = done(&desk, &next);
    let round = name.rsplit('.').next().unwrap().parse::<u32>().unwrap() + 1;
    assert!(text.starts_with(&format!("job.{round}.plan  3 shards  round {round}: ")), "{text}");
    assert_eq!((&status()["finished"], &status()["missing"]), (&false.into(), &3.into()));
    // A lost part of the round before is traced again. Two workers divide the shards.
    fs::remove_file(desk.path(&format!("{name}-2.zk"))).unwrap();
    let work = || desk.command(&["work", "scene.toml", "job.plan"]).spawn().unwrap();
    let workers = [work(), work()];
    workers.into_iter().for_each(|mut worker| assert!(worker.wait().unwrap().success()));
    let text = done(&desk, &["merge", "job.plan", "-o", "a.png"]);
    let noise = text.split("noise ").nth(1).unwrap().split(' ').next().unwrap();
    // In a picture of twelve tiles, a block of samples is a large step.
    assert!((0.2..=0.2575).contains(&noise.parse::<f64>().unwrap()), "{text}");
    let last = (round..).map(|round| format!("job.{round}.plan"));
    let last = last.take_while(|plan| desk.path(plan).exists()).last().unwrap();
    done(&desk, &["render", "scene.toml", "--plan", &last, "-o", "one.png"]);
    assert!(fs::read(desk.path("one.png")).unwrap() == fs::read(desk.path("a.png")).unwrap());
    let error = refused(&desk, &["plan", "--from", "job.plan", "--noise", "1"]);
    assert!(error.contains("meets the noise 1 already"), "{error}");
}
