//! Large scenes: memory by the peak of a child process, time by ratios within one run.

use super::*;
use std::fmt::Write;

/// Scene of `count` spheres on a grid, 55 bytes of text each.
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

/// Scene of `count` equal spheres.
fn coincident(count: usize) -> String {
    let sphere = "[[object]]\nshape.sphere = { center = [0, 0, 0], radius = 1 }\n";
    "ambient.color = [1, 1, 1]\n".to_string() + &sphere.repeat(count)
}

/// Mesh of `count` equal triangles, and the scene that names it.
fn copies(desk: &Desk, count: usize) -> String {
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\n".to_string() + &"f 1 2 3\n".repeat(count);
    fs::write(desk.path("copies.obj"), mesh).unwrap();
    "ambient.color = [1, 1, 1]\n[[object]]\nshape.mesh.file = \"copies.obj\"\n".to_string()
}

/// Seconds and peak memory in bytes of reading, compiling and tracing `scene` by two threads.
fn cost(desk: &Desk, scene: &str) -> (f64, f64) {
    fs::write(desk.path("scene.toml"), scene).unwrap();
    let stats = desk.stats(&["--spp", "1", "--uniform", "--threads", "2"]);
    (stats["total_seconds"].as_f64().unwrap(), stats["peak_rss_bytes"].as_f64().unwrap())
}

/// With the parsed form of the whole file in memory an object took 7 kB.
#[test]
#[cfg(target_os = "linux")]
fn object_takes_at_most_a_kilobyte_beyond_its_text() {
    let desk = Desk::new();
    let scenes = [5_000, 25_000].map(spheres);
    let [few, many] = scenes.each_ref().map(|scene| cost(&desk, scene).1);
    let text = (scenes[1].len() - scenes[0].len()) as f64;
    let each = (many - few - text) / 20_000.0;
    assert!(each < 1024.0, "{each} bytes for each object");
}

/// A million objects and a million copies of a triangle, by ratios: twice the input takes at most
/// 2.3 times the time.
///
///     cargo test --release --test program command_line:: -- --ignored --nocapture million
#[test]
#[ignore = "takes minutes, and needs an optimised build and an idle machine"]
#[cfg(target_os = "linux")]
fn million_objects_and_triangles_take_linear_time_and_memory() {
    let desk = Desk::new();
    let families = [
        ("spheres", spheres as fn(usize) -> String, 6.0),
        ("coincident spheres", coincident as fn(usize) -> String, 8.0),
    ];
    for (name, family, limit) in families {
        let costs = [250_000, 500_000, 1_000_000].map(|count| cost(&desk, &family(count)));
        println!("{name}: {costs:.2?}");
        assert!(costs[2].0 / costs[0].0 < 2.3 * 2.3, "{name}: {costs:?}");
        assert!(costs[2].0 < limit && costs[2].1 < 2e9, "{name}: {costs:?}");
    }
    // Tracing visits all copies; `check` reads and builds only.
    let seconds = [250_000, 500_000, 1_000_000].map(|count| {
        fs::write(desk.path("copies.toml"), copies(&desk, count)).unwrap();
        let start = std::time::Instant::now();
        assert_eq!(desk.run(&["check", "copies.toml"]).status, 0);
        start.elapsed().as_secs_f64()
    });
    println!("copies of a triangle: {seconds:.2?}");
    assert!(seconds[2] / seconds[0] < 2.3 * 2.3 && seconds[2] < 2.0, "{seconds:?}");
}
