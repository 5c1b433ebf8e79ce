//! Tests of the command line, which run the program as users and scripts do.

mod checkpoints;
mod config;
mod hostile;
mod memory;
#[cfg(unix)]
mod outputs;
mod refusals;
mod scale;
mod shards;
#[cfg(unix)]
pub mod signals;
#[cfg(unix)]
mod stories;
mod watch;

use crate::harness::*;
use std::process::{Command, Output, Stdio};
use tempfile::TempDir;

const SCENE: &str = r#"
camera = { eye = [0.0, 1.0, 4.0], target = [0.0, 0.5, 0.0] }
[[light]]
name = "lamp"
point = { position = [2.0, 4.0, 3.0] }
[materials.red]
color = [0.8, 0.2, 0.1]
[materials.mirror]
diffuse = 0.0
reflection = 0.9
roughness = 0.3
[[object]]
name = "ball"
material = "red"
shape.sphere = { center = [0.0, 0.5, 0.0], radius = 0.5 }
[[object]]
name = "mirror"
material = "mirror"
shape.rectangle = { center = [0.0, 1.0, -1.0], size = [4.0, 2.0], normal = [0.0, 0.0, 1.0] }
"#;

/// Temporary folder with the scene file `scene.toml`, in which commands run.
struct Desk(TempDir);

impl Desk {
    fn new() -> Self {
        let desk = Self(TempDir::new().unwrap());
        fs::write(desk.path("scene.toml"), SCENE).unwrap();
        desk
    }
    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }
    fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_zerkalo"));
        command.args(args).current_dir(self.0.path()).stdin(Stdio::null());
        command
    }
    fn run(&self, args: &[&str]) -> Run {
        Run::from(self.command(args).output().unwrap())
    }
    /// Renders `scene.toml` to the file `name` in 64x48 pixels. `more` are further arguments.
    fn render(&self, name: &str, more: &[&str]) -> Run {
        let args = ["render", "scene.toml", "-o", name, "--size", "64x48"];
        self.run(&[&args, more].concat())
    }
    fn stats(&self, more: &[&str]) -> serde_json::Value {
        let run = self.render("stats.png", &[more, &["--stats", "stats.json"]].concat());
        assert_eq!(run.status, 0, "{}", run.err);
        serde_json::from_slice(&fs::read(self.path("stats.json")).unwrap()).unwrap()
    }
    /// Returns the names of the files in the folder, sorted.
    fn files(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.path()).unwrap();
        let mut names: Vec<_> =
            entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }
}

struct Run {
    status: i32,
    out: String,
    err: String,
}

impl From<Output> for Run {
    fn from(output: Output) -> Self {
        Self {
            status: output.status.code().expect("an exit status"),
            out: String::from_utf8(output.stdout).unwrap(),
            err: String::from_utf8(output.stderr).unwrap(),
        }
    }
}

fn is_png(path: &Path) -> bool {
    fs::read(path).unwrap().starts_with(b"\x89PNG\r\n\x1a\n")
}

#[test]
fn render_writes_a_picture() {
    let desk = Desk::new();
    let run = desk.render("a.png", &["--spp", "8"]);
    assert_eq!(run.status, 0, "{}", run.err);
    assert!(is_png(&desk.path("a.png")));
    for part in ["a.png", "64x48", "8 spp", "noise ", " s\n"] {
        assert!(run.out.contains(part), "no {part:?} in {:?}", run.out);
    }
    let lines: Vec<_> = run.out.lines().collect();
    assert!(lines.len() == 2 && lines[1].starts_with("error "), "{:?}", run.out);
    assert_eq!(desk.files(), ["a.png", "scene.toml"]);
    let run = desk.render("b.EXR", &["--spp", "2"]);
    assert_eq!(run.status, 0, "{}", run.err);
    assert!(fs::read(desk.path("b.EXR")).unwrap().starts_with(&[0x76, 0x2f, 0x31, 0x01]));
}

#[test]
fn pictures_depend_on_the_seed_and_not_on_threads() {
    let desk = Desk::new();
    let picture = |name: &str, more: &[&str]| {
        let run = desk.render(name, &[&["--noise", "1.5"], more].concat());
        assert_eq!(run.status, 0, "{}", run.err);
        fs::read(desk.path(name)).unwrap()
    };
    let one = picture("1.png", &["--threads", "1"]);
    assert!(one == picture("2.png", &["--threads", "2"]), "2 threads change the file");
    assert!(one == picture("7.png", &["--threads", "7"]), "7 threads change the file");
    assert!(one != picture("s.png", &["--seed", "1"]), "the seed changes nothing");
}

#[test]
fn files_hold_provenance_metadata() {
    let desk = Desk::new();
    desk.render("a.png", &["--spp", "8", "--seed", "42", "--exposure", "-0.5"]);
    let bytes = fs::read(desk.path("a.png")).unwrap();
    let text = String::from_utf8_lossy(&bytes);
    let hash = {
        let offset = 0xcbf2_9ce4_8422_2325_u64;
        let step = |h: u64, b: u8| (h ^ u64::from(b)).wrapping_mul(0x0000_0100_0000_01b3);
        format!("fnv1a64:{:016x}", SCENE.bytes().fold(offset, step))
    };
    for (key, value) in [
        ("Software", concat!("zerkalo ", env!("CARGO_PKG_VERSION"))),
        ("Source", "scene.toml"),
        ("Scene hash", &hash),
        ("Camera", "{ eye = ["),
        ("Seed", "42"),
        ("Samples per pixel", "8.00 (8-8)"),
        ("Noise", ""),
        ("Bad samples", "0"),
        ("Saturated samples", "0"),
        ("Saturated pixels", "0"),
        ("Biased", ""),
        ("Settings", "sampler sobol"),
    ] {
        assert!(text.contains(&format!("{key}\0{value}")), "{key}: {value}");
    }
    assert!(text.contains("exposure -0.5 EV") && !text.contains("Error\0"));
    desk.render("b.png", &["--spp", "8", "--error", "0.001"]);
    let bytes = fs::read(desk.path("b.png")).unwrap();
    assert!(String::from_utf8_lossy(&bytes).contains("Error\0error "));
}

/// Checks that samples beyond the film's range are reported. Mirrors that amplify light at every
/// bounce produce them.
#[test]
fn saturated_samples_are_reported_everywhere() {
    let desk = Desk::new();
    let wall = |z: f64| {
        format!(
            "[[object]]\nmaterial = \"mirror\"\nshape.rectangle = {{ center = [0.0, 0.0, {z}], \
             size = [9.0, 9.0], normal = [0.0, 0.0, 1.0] }}\n"
        )
    };
    let scene = "trace = { max_depth = 60 }\ncamera = { eye = [0.0, 0.0, 0.0], direction = [0.0, 0.0, -1.0] }\n\
                 background = { color = [1.0, 1.0, 1.0] }\n\
                 [materials.mirror]\ndiffuse = 0.0\nreflection = 3.0\n";
    fs::write(desk.path("scene.toml"), format!("{scene}{}{}", wall(-1.0), wall(1.0))).unwrap();
    let run = desk.render("a.png", &["--spp", "8", "--uniform", "--stats", "stats.json"]);
    assert_eq!(run.status, 0, "{}", run.err);
    let stats = fs::read_to_string(desk.path("stats.json")).unwrap();
    let stats: serde_json::Value = serde_json::from_str(&stats).unwrap();
    let count = stats["saturated_samples"].as_u64().unwrap();
    assert!(count > 0 && stats["bad_samples"] == 0, "{stats}");
    let warning = format!("{count} saturated samples");
    assert!(
        [&run.out, &run.err].iter().any(|text| text.contains(&warning)),
        "{} {}",
        run.out,
        run.err
    );
    desk.render("a.exr", &["--spp", "8", "--uniform"]);
    for name in ["a.png", "a.exr"] {
        let bytes = fs::read(desk.path(name)).unwrap();
        let text = String::from_utf8_lossy(&bytes);
        let (_, after) = text.split_once("Saturated samples").expect(name);
        let digits = after.trim_start_matches(|c: char| !c.is_ascii_digit());
        assert!(digits.contains(&count.to_string()), "{name}: {}", &digits[..40]);
    }
}

#[test]
fn stats_file_has_every_key() {
    let desk = Desk::new();
    let stats = desk.stats(&["--spp", "31", "--threads", "2", "--seed", "5", "--uniform"]);
    for key in "scene size seed precision lanes threads samples spp_min spp_mean spp_max seconds \
         samples_per_second first_picture_seconds noise_levels error_levels rounding_levels cut_paths_levels rmse_linear bad_samples \
         saturated_samples saturated_pixels peak_rss_bytes stopped_by"
        .split(' ')
    {
        assert!(stats.get(key).is_some(), "no {key} in {stats:#}");
    }
    assert_eq!(stats["scene"], "scene.toml");
    assert_eq!(stats["size"], serde_json::json!([64, 48]));
    assert_eq!((&stats["seed"], &stats["threads"]), (&5.into(), &2.into()));
    assert_eq!(stats["samples"], 32 * 64 * 48);
    assert_eq!([&stats["spp_min"], &stats["spp_max"]], [32, 32]);
    assert_eq!(stats["stopped_by"], "spp");
    assert_eq!(stats["bad_samples"], 0);
    assert_eq!(stats["biased"], serde_json::json!([]));
    assert!(stats["noise_levels"].as_f64().unwrap() > 0.0);
    assert!(stats["rmse_linear"].as_f64().unwrap() > 0.0);
    let number = |key: &str| stats[key].as_f64().unwrap();
    let rate = number("samples") / number("seconds");
    assert!((rate / number("samples_per_second") - 1.0).abs() < 1e-6);
    assert!(number("first_picture_seconds") < number("total_seconds"));
    if cfg!(target_os = "linux") {
        assert!(number("peak_rss_bytes") > 1e6);
    }
}

#[test]
fn stats_and_check_name_the_same_biases() {
    let desk = Desk::new();
    let mirrors = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/features/facing-mirrors.toml");
    fs::copy(mirrors, desk.path("scene.toml")).unwrap();
    let check = desk.run(&["check", "scene.toml"]);
    let named: Vec<_> =
        check.out.lines().filter_map(|line| line.strip_prefix("  biased    ")).collect();
    assert!(!named.is_empty(), "{}", check.out);
    assert_eq!(desk.stats(&["--spp", "2"])["biased"], serde_json::json!(named));
}

#[test]
fn each_stop_criterion_ends_the_render() {
    let desk = Desk::new();
    let noise = desk.stats(&["--noise", "2"]);
    assert_eq!(noise["stopped_by"], "noise");
    assert!(noise["noise_levels"].as_f64().unwrap() <= 2.0);
    let rmse = desk.stats(&["--rmse", "0.01"]);
    assert_eq!(rmse["stopped_by"], "rmse");
    assert!(rmse["rmse_linear"].as_f64().unwrap() <= 0.01);
    let time = desk.stats(&["--time", "0.2"]);
    assert_eq!(time["stopped_by"], "time");
    assert!(time["total_seconds"].as_f64().unwrap() <= 0.4);
    let default = desk.stats(&[]);
    assert_eq!(default["stopped_by"], "noise");
    assert!(default["noise_levels"].as_f64().unwrap() <= 0.5);
    let capped = SCENE.to_string() + "\n[film]\nrays_per_pixel = 40\n";
    fs::write(desk.path("scene.toml"), capped).unwrap();
    let capped = desk.stats(&["--noise", "0.01"]);
    assert_eq!(capped["stopped_by"], "rays_per_pixel");
}

#[test]
fn precision_option_is_used() {
    let desk = Desk::new();
    for precision in ["single", "double"] {
        let stats = desk.stats(&["--spp", "2", "--precision", precision]);
        assert_eq!(stats["precision"], precision);
    }
}

#[test]
fn single_precision_warns_in_a_scene_that_requires_double() {
    let desk = Desk::new();
    let scene = fs::read_to_string(desk.path("scene.toml")).unwrap();
    let warning = |run: &Run| run.err.contains("warning: --precision single");
    let render = ["render", "scene.toml", "-o", "a.png", "--spp", "2", "--precision", "single"];
    assert!(!warning(&desk.run(&render)));
    let earth = "[materials.earth]\ncolor = [0.5, 0.5, 0.5]\n\
                 [[object]]\nmaterial = \"earth\"\n\
                 shape.sphere = { center = [0.0, -6.371e6, 0.0], radius = 6.37e6 }\n";
    fs::write(desk.path("scene.toml"), format!("{scene}\n{earth}")).unwrap();
    let run = desk.run(&render);
    assert!(run.status == 0 && warning(&run), "{}", run.err);
}

#[test]
fn starter_scene_is_valid() {
    let desk = Desk::new();
    let run = desk.run(&["new", "mine.toml"]);
    assert_eq!((run.status, run.err.as_str()), (0, ""));
    let run = desk.run(&["check", "mine.toml"]);
    assert_eq!((run.status, run.err.as_str()), (0, ""));
    for part in ["valid", "contains", "pixels", "lights", "memory"] {
        assert!(run.out.contains(part), "no {part:?} in {:?}", run.out);
    }
}

#[test]
fn warnings_are_printed_on_stderr_and_are_no_failure() {
    let desk = Desk::new();
    let bright = SCENE.replace("reflection = 0.9", "reflection = 1.9");
    fs::write(desk.path("scene.toml"), bright).unwrap();
    let run = desk.run(&["check", "scene.toml"]);
    assert_eq!(run.status, 0);
    assert!(run.err.contains("scene.toml:"), "{:?}", run.err);
    let run = desk.render("a.png", &["--spp", "2"]);
    assert_eq!(run.status, 0);
    assert!(run.err.contains("scene.toml:"), "{:?}", run.err);
}

#[test]
fn progress_in_a_log_is_lines() {
    let desk = Desk::new();
    let run = desk.render("a.png", &["--time", "1.3", "--threads", "1"]);
    assert_eq!(run.status, 0);
    for part in [" %", "spp", "Msamples/s", "noise", "left\n"] {
        assert!(run.err.contains(part), "no {part:?} in {:?}", run.err);
    }
    assert!(!run.err.contains('\r') && !run.err.contains('\x1b'), "{:?}", run.err);
}
