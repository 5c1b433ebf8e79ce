//! Driver of tests on random scenes: compares pictures of each scene, and reduces and writes scenes
//! that fail.

use crate::harness::*;
use crate::random_scenes::scene::{Random, scene};
use crate::random_scenes::shrink::shrunk;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Result of the comparison of a scene's pictures.
pub enum Verdict {
    /// The pictures agree.
    Same,
    /// The scene cannot be compared, for this reason.
    Skipped(&'static str),
    /// The pictures differ, as this text describes.
    Different(String),
}

/// Function that compares the pictures of a scene.
pub type Check = fn(&Scene) -> Verdict;

fn number(name: &str, default: u64) -> u64 {
    std::env::var(name).map_or(default, |text| {
        text.parse().unwrap_or_else(|_| panic!("{name} is {text}, not a whole number"))
    })
}

/// Returns the seeds that `ZERKALO_FIRST` and `ZERKALO_SCENES` select.
pub fn many() -> Range<u64> {
    let first = number("ZERKALO_FIRST", 0);
    first..first + number("ZERKALO_SCENES", 200)
}

/// Runs a check on the scene in `text`. Returns the difference or the panic, if there is one.
fn failure(text: &str, check: Check) -> Option<String> {
    match catch_unwind(AssertUnwindSafe(|| check(&parsed(text)))) {
        Ok(Verdict::Different(what)) => Some(what),
        Ok(_) => None,
        Err(panic) => Some(format!("panic: {}", panic_message(panic.as_ref()))),
    }
}

fn panic_message(panic: &(dyn std::any::Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().cloned();
    text.or_else(|| panic.downcast_ref::<&str>().map(|t| t.to_string())).unwrap_or_default()
}

/// Applies `check` to the random scene of each seed in `seeds`: `check` renders it in several ways
/// and compares the pictures. If `ZERKALO_SEED` is set, checks only the scene of that seed. `name`
/// is the name of the test.
pub fn compare(name: &str, seeds: impl IntoIterator<Item = u64>, check: Check) {
    let (mut wrong, mut skipped) = (Vec::new(), BTreeMap::<&str, u32>::new());
    let mut count = 0;
    let only = std::env::var_os("ZERKALO_SEED").map(|_| number("ZERKALO_SEED", 0));
    let seeds: Vec<u64> = only.map_or_else(|| seeds.into_iter().collect(), |seed| vec![seed]);
    for seed in seeds {
        count += 1;
        let Random { layout, text } = scene(seed);
        let outcome = catch_unwind(AssertUnwindSafe(|| check(&parsed(&text))));
        let what = match outcome {
            Ok(Verdict::Same) => continue,
            Ok(Verdict::Skipped(why)) => {
                *skipped.entry(why).or_default() += 1;
                continue;
            }
            Ok(Verdict::Different(what)) => what,
            Err(panic) => format!("panic: {}", panic_message(panic.as_ref())),
        };
        let seconds = number("ZERKALO_SHRINK", 10);
        let small = shrunk(&text, seconds, &|text| failure(text, check).is_some());
        let last = small
            .as_ref()
            .map_or_else(|| what.clone(), |small| failure(small, check).unwrap_or_default());
        let path = keep(name, seed, &what, &text, &last, small.as_ref().unwrap_or(&text));
        let line = format!(
            "seed {seed}, {layout:?}: {what}\n    {}\n    ZERKALO_SEED={seed} cargo test --release --test \
             engine random_scenes::{name}",
            path.display()
        );
        println!("{line}");
        wrong.push(line);
    }
    println!("{name}: {count} scenes, {} differ, skipped: {skipped:?}", wrong.len());
    assert!(wrong.is_empty(), "{} of {count} scenes differ:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
#[ignore = "writes the scenes of the requested seeds to target/tmp/random_scenes"]
fn write_scenes() {
    let folder = folder();
    for seed in many() {
        let Random { layout, text } = scene(seed);
        fs::write(folder.join(format!("{seed}.toml")), format!("# {layout:?}\n{text}")).unwrap();
    }
    println!("{}", folder.display());
}

/// Creates the folder for scenes, with copies of the files to which scenes refer. Returns the path
/// of the folder.
fn folder() -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("random_scenes");
    let root = Path::new(env!("ZERKALO_ROOT"));
    for files in ["scenes/meshes", "scenes/textures", "tests/random_scenes"] {
        fs::create_dir_all(folder.join(files)).unwrap();
        for file in fs::read_dir(root.join(files)).unwrap().map(|entry| entry.unwrap()) {
            if file.path().extension().is_some_and(|e| e != "rs") {
                fs::copy(file.path(), folder.join(files).join(file.file_name())).unwrap();
            }
        }
    }
    folder
}

/// Writes the failing scene `text` and its reduced form `small` to files. The descriptions of their
/// failures, `what` and `last`, are comments in the files. Returns the path of the reduced form.
fn keep(name: &str, seed: u64, what: &str, text: &str, last: &str, small: &str) -> PathBuf {
    let folder = folder();
    let comment = |what: &str| what.lines().map(|line| format!("# {line}\n")).collect::<String>();
    let path = folder.join(format!("{name}-{seed}-whole.toml"));
    fs::write(path, format!("{}{text}", comment(what))).unwrap();
    let path = folder.join(format!("{name}-{seed}.toml"));
    fs::write(&path, format!("{}{small}", comment(last))).unwrap();
    path
}
