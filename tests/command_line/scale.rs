//! Large scenes: limits on memory and processor time. Memory is measured as the peak of a child
//! process. Growth in time is the ratio of the times of two scene sizes within one run.

use super::*;
use crate::harness::*;

/// Returns the text of a scene of `count` spheres on a grid, 55 bytes for each.
fn spheres(count: usize) -> String {
    let side = (count as f64).cbrt().ceil() as usize;
    let mut text = format!(
        "[camera]\neye = [0, 0, {}]\ntarget = [0, 0, 0]\n[[light]]\ndirectional.direction = [0, -1, -1]\n",
        2 * side
    );
    let half = side as i64 / 2;
    for i in 0..count {
        let [x, y, z] = [i % side, i / side % side, i / side / side].map(|n| n as i64 - half);
        // Writing into a string cannot fail.
        let _ =
            writeln!(text, "[[object]]\nshape.sphere = {{ center = [{x},{y},{z}], radius = 0.3 }}");
    }
    text
}

/// Returns the text of a scene of `count` equal spheres at the same place.
fn coincident(count: usize) -> String {
    let sphere = "[[object]]\nshape.sphere = { center = [0, 0, 0], radius = 1 }\n";
    "ambient.color = [1, 1, 1]\n".to_string() + &sphere.repeat(count)
}

/// Returns name and contents of an OBJ file of `count` equal triangles.
fn obj(count: usize) -> (&'static str, Vec<u8>) {
    let text = "v 0 0 0\nv 1 0 0\nv 0 1 0\n".to_string() + &"f 1 2 3\n".repeat(count);
    ("copies.obj", text.into_bytes())
}

/// Returns name and contents of a binary STL file of `count` equal triangles.
fn stl(count: usize) -> (&'static str, Vec<u8>) {
    let numbers = [0.0_f32, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    let mut facet: Vec<u8> = numbers.iter().flat_map(|number| number.to_le_bytes()).collect();
    facet.extend([0; 2]);
    let mut bytes = vec![0; 80];
    bytes.extend(u32::try_from(count).unwrap().to_le_bytes());
    bytes.extend(facet.repeat(count));
    ("copies.stl", bytes)
}

/// Returns name and contents of a glTF file with `count` nodes that place one triangle at the same
/// point.
fn gltf(count: usize) -> (&'static str, Vec<u8>) {
    let nodes = vec![r#"{"mesh":0}"#; count].join(",");
    let roots: Vec<_> = (0..count).map(|i| i.to_string()).collect();
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[{}]}}],"nodes":[{nodes}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "buffers":[{{"byteLength":36,"uri":"data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3",
        "min":[0,0,0],"max":[1,1,0]}}]}}"#,
        roots.join(",")
    );
    ("copies.gltf", text.into_bytes())
}

fn mesh_scene(desk: &Desk, (name, mesh): (&str, Vec<u8>)) -> String {
    fs::write(desk.path(name), mesh).unwrap();
    format!("ambient.color = [1, 1, 1]\n[[object]]\nshape.mesh.file = \"{name}\"\n")
}

/// Returns the processor time in seconds of all child processes of this process that have ended.
fn child_seconds() -> f64 {
    let text = fs::read_to_string("/proc/self/stat").unwrap();
    // Fields 16 and 17 of proc(5) are the times of child processes in hundredths of a second. The
    // process name in field 2 may contain spaces.
    let fields = text.rsplit_once(") ").unwrap().1.split(' ').skip(13).take(2);
    fields.map(|field| field.parse::<f64>().unwrap() / 100.0).sum()
}

/// Reads, compiles and traces `scene` by two threads. Returns the seconds, the seconds of processor
/// time, and the peak memory in bytes.
fn cost(desk: &Desk, scene: &str) -> [f64; 3] {
    fs::write(desk.path("scene.toml"), scene).unwrap();
    let before = child_seconds();
    let stats = desk.stats(&["--spp", "1", "--uniform", "--threads", "2"]);
    let number = |key: &str| stats[key].as_f64().unwrap();
    [number("total_seconds"), child_seconds() - before, number("peak_rss_bytes")]
}

/// Checks that an object of a scene takes at most a kilobyte besides its text. It would take 7 kB
/// if the parsed form of the whole file were in memory at once. One scene has four times as many
/// objects as the other, so that growing arrays have the same share of unused capacity.
#[test]
#[cfg(target_os = "linux")]
fn object_takes_at_most_a_kilobyte_beyond_its_text() {
    let desk = Desk::new();
    let scenes = [25_000, 100_000].map(spheres);
    let [few, many] = scenes.each_ref().map(|scene| cost(&desk, scene)[2]);
    let text = (scenes[1].len() - scenes[0].len()) as f64;
    let each = (many - few - text) / 75_000.0;
    assert!(each < 1024.0, "{each} bytes for each object");
}

/// Family of scenes: name, function that returns the text of a scene with the given number of
/// objects or triangles, and largest allowed processor time in seconds for a million of them.
type Family = (&'static str, fn(&Desk, usize) -> String, f64);

/// Checks the processor time and memory for a million spheres, on a grid or at the same place, and
/// for a million copies of a triangle in OBJ, STL and glTF files. Four times the input must take
/// less than 2.3^2 times the processor time.
///
/// cargo test --release --test program command_line:: -- --ignored --nocapture million
#[test]
#[ignore = "takes minutes, and needs an optimised build and an idle machine"]
#[cfg(target_os = "linux")]
fn million_objects_and_triangles_take_linear_time_and_memory() {
    let desk = Desk::new();
    const COUNTS: [usize; 3] = [250_000, 500_000, 1_000_000];
    let mut faults = Vec::new();
    let costs = COUNTS.map(|count| cost(&desk, &spheres(count)));
    println!("spheres: seconds, processor seconds, bytes: {costs:.2?}");
    let is_linear = costs[2][1] / costs[0][1] < 2.3 * 2.3;
    if !is_linear || costs[2][0] > 6.0 || costs[2][2] > 2e9 {
        faults.push(format!("spheres: more than linear, 6 s or 2 GB: {costs:.2?}"));
    }
    // These scenes are checked by `zerkalo check`, which reads and compiles but does not trace.
    // Tracing would visit all copies.
    let families: [Family; 4] = [
        ("coincident spheres", |_, count| coincident(count), 8.0),
        ("OBJ", |desk, count| mesh_scene(desk, obj(count)), 2.0),
        ("STL", |desk, count| mesh_scene(desk, stl(count)), 2.0),
        ("glTF instances", |desk, count| mesh_scene(desk, gltf(count)), 4.0),
    ];
    for (name, family, limit) in families {
        let seconds = COUNTS.map(|count| {
            fs::write(desk.path("copies.toml"), family(&desk, count)).unwrap();
            let before = child_seconds();
            let run = desk.run(&["check", "copies.toml"]);
            assert_eq!(run.status, 0, "{}", run.err);
            child_seconds() - before
        });
        println!("{name}: {seconds:.2?} processor seconds");
        if seconds[2] / seconds[0] > 2.3 * 2.3 || seconds[2] > limit {
            faults.push(format!("{name}: more than linear or {limit} s: {seconds:.2?}"));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
