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

/// Plans a render of the scene in 64x48 pixels by `shards` processes. Writes the files `NAME.plan`
/// and `NAME-0.zk`. The latter has the samples of the pilot, a first render that the plan
/// continues.
pub fn plan(desk: &Desk, name: &str, shards: usize) {
    let (output, shards) = (format!("{name}.plan"), shards.to_string());
    let args = ["plan", "scene.toml", "-o", &output, "--size", "64x48"];
    done(desk, &[&args[..], &["--noise", "0.5", "--pilot", "2", "--shards", &shards]].concat());
}

/// Traces shard `number` of the plan `NAME.plan`. Returns the name of the shard's film file,
/// `NAME-number.zk`.
pub fn trace(desk: &Desk, name: &str, number: usize) -> String {
    let (plan, part, number) =
        (format!("{name}.plan"), format!("{name}-{number}.zk"), number.to_string());
    done(desk, &["render", "scene.toml", "--plan", &plan, "--shard", &number, "-o", &part]);
    part
}

/// Plans a render and traces all its shards. Returns the names of the film files of the pilot (the
/// first samples) and of the shards.
pub fn traced(desk: &Desk, name: &str, shards: usize) -> Vec<String> {
    plan(desk, name, shards);
    let parts = (1..=shards).map(|number| trace(desk, name, number));
    [format!("{name}-0.zk")].into_iter().chain(parts).collect()
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
        let mut parts = traced(&desk, &format!("of{shards}"), shards);
        let plan = format!("of{shards}.plan");
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
        let (first, rest) = parts.split_at(parts.len() / 2);
        let args = ["merge", "--partial", "-o", "half.zk"];
        done(&desk, &[&args[..], &first.iter().map(String::as_str).collect::<Vec<_>>()].concat());
        assert!(merge(&desk, &[plan], "plan.png") == one[0], "{shards} shards named by their plan");
        let steps = [&["half.zk".to_string()], rest].concat();
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
        assert!(info.contains("0-3 of 3, plan "), "{output}: {info}");
        assert!(info.contains("are those of"), "{output}: {info}");
    }
    let some = ["job-0.zk", "job-2.zk"];
    for output in ["b.png", "b.exr", "b.zk"] {
        done(&desk, &[&["merge", "--partial", "-o", output], &some[..]].concat());
        let info = done(&desk, &["info", output]);
        assert!(info.contains("0, 2 of 3, missing 1, 3, plan "), "{output}: {info}");
    }
    let info = done(&desk, &["info", "job-3.zk"]);
    let plan = done(&desk, &["info", "job.plan", "--scene", "scene.toml"]);
    assert!(plan.starts_with("job.plan: plan, 64 x 48 pixels\n"), "{plan}");
    assert!(plan.contains("pilot") && plan.contains("are those of job.plan"), "{plan}");
    for text in [&info, &plan] {
        assert!(text.contains("3 shards, ") && text.contains("target 0.5 8-bit levels"), "{text}");
    }
    let checksum = plan.lines().find_map(|line| line.trim().strip_prefix("Checksum")).unwrap();
    assert!(info.contains(&format!("3 of 3, missing 0-2, plan {}", checksum.trim())), "{info}");
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
fn lost_base_is_traced_as_shard_0() {
    let desk = Desk::new();
    let parts = traced(&desk, "job", 2);
    let expected = merge(&desk, &parts, "a.png");
    fs::remove_file(desk.path("job-0.zk")).unwrap();
    trace(&desk, "job", 0);
    assert!(merge(&desk, &parts, "b.png") == expected);
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
    assert!(error.contains("of 5 shards these are missing: 0, 2-3, 5"), "{error}");
    assert!(error.contains("render scene.toml --plan") && error.contains("--partial"), "{error}");
    assert!(!desk.path("a.png").exists());

    let without_2 = ["merge", "--partial", "-o", "a.png", "job-0.zk", "job-1.zk", "job-3.zk"];
    let text = done(&desk, &[&without_2[..], &["job-4.zk", "job-5.zk"]].concat());
    assert!(text.contains("missing of 5 shards: 2; noise 0."), "{text}");
    assert!(text.contains(" instead of about 0."), "{text}");
    let picture = String::from_utf8_lossy(&fs::read(desk.path("a.png")).unwrap()).into_owned();
    assert!(picture.contains("Shards\x000-1, 3-5 of 5, missing 2, plan "));

    plan(&desk, "other", 4);
    let error = refused(&desk, &[&["merge", "-o", "a.png", "other-0.zk"], &all[1..]].concat());
    assert!(error.contains("different plans (`shards 4` and `shards 5`)"), "{error}");
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
    let run = render(&["--shard", "2", "-o", "job-0.zk"]);
    assert!(run.status == 1 && run.err.contains("holds shard 0; remove it"), "{}", run.err);
    for conflict in [["--seed", "1"], ["--noise", "1"], ["--size", "8x8"]] {
        assert_eq!(render(&[&conflict[..], &["-o", "a.png"]].concat()).status, 2, "{conflict:?}");
    }
    fs::File::create(desk.path("large.plan")).unwrap().set_len(1 << 27).unwrap();
    let args = ["render", "scene.toml", "--plan", "large.plan", "-o", "a.png"];
    assert!(refused(&desk, &args).contains("a plan has at most 67108864"));
    let run = desk.run(&["render", "scene.toml", "--shard", "1", "-o", "a.zk"]);
    assert_eq!(run.status, 2, "a shard without a plan");
    let text = fs::read_to_string(desk.path("scene.toml")).unwrap();
    fs::write(desk.path("scene.toml"), text.replace("0.8, 0.2", "0.7, 0.2")).unwrap();
    let run = render(&["-o", "a.png"]);
    assert!(run.status == 1 && run.err.contains("is not the scene of job.plan"), "{}", run.err);
    let args = ["plan", "scene.toml", "-o", "a.plan", "--shards", "2", "--pilot", "0.1"];
    let run = desk.run(&args);
    assert!(run.status == 2 && run.err.contains("a pilot ends before the target"), "{}", run.err);
}

#[test]
fn next_round_continues_the_merged_film() {
    let desk = Desk::new();
    let parts = traced(&desk, "job", 2);
    merge(&desk, &parts, "merged.zk");
    let args = ["plan", "--from", "merged.zk", "-o", "next.plan"];
    let text = done(&desk, &[&args[..], &["--noise", "0.2", "--shards", "3"]].concat());
    assert!(text.contains("next.plan  3 shards"), "{text}");
    let mut next: Vec<String> = (1..=3).map(|number| trace(&desk, "next", number)).collect();
    next.push("merged.zk".to_string());
    let picture = merge(&desk, &next, "next.png");
    done(&desk, &["render", "scene.toml", "--plan", "next.plan", "-o", "one.png"]);
    assert!(fs::read(desk.path("one.png")).unwrap() == picture);
    // Film files of the first plan cannot be merged with those of the second one, and an incomplete
    // film cannot be the start of a plan.
    let error = refused(&desk, &["merge", "-o", "a.png", "job-1.zk", "next-1.zk"]);
    assert!(error.contains("job-1.zk: it is the base of a plan and lacks shards"), "{error}");
    done(&desk, &["merge", "--partial", "-o", "part.zk", "job-0.zk", "job-1.zk"]);
    let error = refused(&desk, &["plan", "--from", "part.zk", "-o", "a.plan", "--shards", "2"]);
    assert!(error.contains("cannot plan from part.zk: it lacks shards"), "{error}");
    let run =
        desk.run(&["render", "scene.toml", "--plan", "next.plan", "--shard", "0", "-o", "0.zk"]);
    assert!(run.status == 2 && run.err.contains("which no shard traces"), "{}", run.err);
}
