//! Hostile input: control characters in names and texts, and scenes that refer to files outside of
//! their folder.

use super::*;
use crate::harness::*;

/// Text with control sequences that set the clipboard (OSC 52) and colours (C0 and C1), and reverse
/// the text direction.
const EVIL: &str =
    "\u{1b}]52;c;cm0gLXJm\u{7}\u{1b}[31m\u{9b}32m\u{9d}52;c;AA\u{9c}\u{202e}\r\u{8}\u{200b}";

fn has_control_characters(text: &str) -> bool {
    text.chars().any(|c| {
        (c.is_control() && c != '\n')
            || ('\u{200b}'..='\u{200f}').contains(&c)
            || ('\u{202a}'..='\u{202e}').contains(&c)
    })
}

fn check(what: &str, run: &Run) {
    assert!(!has_control_characters(&run.out), "{what}: {:?}", run.out);
    assert!(!has_control_characters(&run.err), "{what}: {:?}", run.err);
    assert!(!run.err.contains("panicked"), "{what}: {:?}", run.err);
}

fn toml(text: &str) -> String {
    let escaped: String = text.chars().map(|c| format!("\\U{:08x}", u32::from(c))).collect();
    format!("\"{escaped}\"")
}

fn with_mesh(file: &str) -> String {
    format!("{SCENE}\n[[object]]\nname = \"m\"\nmaterial = \"red\"\nshape.mesh.file = \"{file}\"\n")
}

#[test]
#[cfg(unix)]
fn file_names_are_printed_without_control_characters() {
    let desk = Desk::new();
    let scene = format!("{EVIL}.toml");
    let (picture, other) = (format!("{EVIL}.png"), format!("{EVIL}.exr"));
    fs::write(desk.path(&scene), SCENE).unwrap();
    fs::write(desk.path("bad.toml"), SCENE.replace("radius = 0.5", "radius = -1.0")).unwrap();
    let evil_bad = format!("bad{EVIL}.toml");
    fs::copy(desk.path("bad.toml"), desk.path(&evil_bad)).unwrap();
    let (json, csv) = (format!("{EVIL}.json"), format!("{EVIL}.csv"));
    let folder = format!("{EVIL}/a.png");
    let quick = ["--seconds", "0.1", "--repetitions", "1", "--size", "16x12", "--noise", "8"];
    for (args, status) in [
        (vec!["check", &scene], 0),
        (vec!["check", &evil_bad], 1),
        (vec!["check", EVIL], 1),
        (vec!["render", &scene, "-o", &picture, "--spp", "2", "--size", "16x12"], 0),
        (
            vec!["render", &scene, "-o", &other, "--spp", "2", "--size", "16x12", "--stats", &json],
            0,
        ),
        (vec!["render", &scene, "-o", EVIL], 2),
        (vec!["render", &scene, "-o", &folder], 1),
        (vec!["render", &scene, "-o", &picture, "--stats", &picture], 2),
        (vec!["render", &scene, "-o", &picture, "--stats", &folder], 1),
        (vec!["render", &scene, "-o", &picture, "--size", EVIL], 2),
        (vec!["render", &scene, "-o", &picture, EVIL], 2),
        ([&["measure", &scene, "--json", &json, "--csv", &csv], &quick[..]].concat(), 0),
        (vec!["measure", &scene, "--plot", EVIL], 2),
        (vec!["measure", &scene, "--only", EVIL], 2),
        (vec!["measure", &scene, "--reference", EVIL], 1),
        (vec!["new", &scene], 1),
        (vec!["new", &format!("new{EVIL}.toml")], 0),
        (vec![EVIL], 2),
        (vec![EVIL, EVIL], 2),
        (vec![&format!("--{EVIL}")], 2),
    ] {
        let run = desk.run(&args);
        check(&format!("{args:?}"), &run);
        assert_eq!(run.status, status, "{args:?}: {}", run.err);
    }
}

#[test]
fn scene_texts_are_printed_without_control_characters() {
    let desk = Desk::new();
    let evil = toml(EVIL);
    for (what, text) in [
        ("names", SCENE.replace("\"ball\"", &evil).replace("\"lamp\"", &toml(&format!("l{EVIL}")))),
        ("a material", SCENE.replace("\"red\"", &evil)),
        ("materials", SCENE.replace("[materials.red]", &format!("[materials.{evil}]"))),
        ("a key", format!("{SCENE}\n[trace]\n{evil} = 1\n")),
        ("a word", format!("{SCENE}\n[trace]\nray_types = {evil}\n")),
        ("a mesh", with_mesh("").replace("\"\"", &evil)),
        (
            "a view",
            format!("{SCENE}\n[cameras.{evil}]\neye = [0.0, 1.0, 0.0]\ntarget = [0.0, 0.0, 0.0]\n"),
        ),
        (
            "a doubt",
            SCENE
                .replace("reflection = 0.9", "reflection = 1.9")
                .replace("materials.mirror", &format!("materials.{evil}"))
                .replace("\"mirror\"", &evil),
        ),
        ("raw bytes", format!("# {EVIL}\n{SCENE}")),
        ("half a string", format!("{SCENE}\nname = \"{EVIL}")),
    ] {
        fs::write(desk.path("evil.toml"), text).unwrap();
        check(what, &desk.run(&["check", "evil.toml"]));
        let args = ["render", "evil.toml", "-o", "a.png", "--spp", "2", "--size", "16x12"];
        check(what, &desk.run(&args));
    }
}

#[test]
fn mesh_texts_are_printed_without_control_characters() {
    let desk = Desk::new();
    for (name, text) in [
        ("m.obj", format!("mtllib {EVIL}\no {EVIL}\nv 0 0 0\nf 1 2 {EVIL}\n")),
        ("m.ply", format!("ply\nformat ascii 1.0\ncomment {EVIL}\nelement {EVIL} 3\nend_header\n")),
        ("m.stl", format!("solid {EVIL}\nfacet {EVIL}\nendsolid\n")),
        (
            "m.gltf",
            format!(
                "{{\"asset\":{{\"version\":{0}}},\"buffers\":[{{\"uri\":{0},\"byteLength\":9}}]}}",
                serde_json::json!(EVIL)
            ),
        ),
    ] {
        fs::write(desk.path(name), text).unwrap();
        fs::write(desk.path("mesh.toml"), with_mesh(name)).unwrap();
        let run = desk.run(&["check", "mesh.toml"]);
        assert_eq!(run.status, 1, "{name}");
        check(name, &run);
    }
}

#[test]
fn environment_is_printed_without_control_characters() {
    let desk = Desk::new();
    let mut command = desk.command(&["doctor"]);
    for name in ["TERM", "COLORTERM", "SSH_CONNECTION", "LC_ALL", "XDG_STATE_HOME", "TMUX"] {
        let value = if name == "XDG_STATE_HOME" { format!("/{EVIL}") } else { EVIL.to_string() };
        command.env(name, value);
    }
    let run = Run::from(command.output().unwrap());
    assert_eq!(run.status, 0, "{}", run.err);
    check("doctor", &run);
    assert!(run.out.contains("not queried"), "{}", run.out);
}

/// Checks that devices, pipes and folders are refused as mesh files, whatever their names are, and
/// that the program does not wait for their contents.
#[test]
#[cfg(unix)]
fn scenes_read_regular_files_only() {
    use std::os::unix::fs::symlink;
    let desk = Desk::new();
    symlink("/dev/zero", desk.path("zero.obj")).unwrap();
    fs::create_dir(desk.path("folder.obj")).unwrap();
    let made = Command::new("mkfifo").arg(desk.path("pipe.obj")).status();
    assert!(made.unwrap().success());
    for name in ["zero.obj", "folder.obj", "pipe.obj", "/dev/stdin", "/dev/zero"] {
        fs::write(desk.path("mesh.toml"), with_mesh(name)).unwrap();
        let run = desk.run(&["check", "mesh.toml"]);
        assert_eq!(run.status, 1, "{name}: {}", run.out);
        assert!(run.err.contains("mesh.toml:"), "{name}: {}", run.err);
    }
}

#[test]
#[cfg(unix)]
fn scenes_name_files_anywhere() {
    let desk = Desk::new();
    fs::create_dir(desk.path("scenes")).unwrap();
    let mesh = desk.path("m.obj");
    fs::write(&mesh, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    std::os::unix::fs::symlink(&mesh, desk.path("scenes/link.obj")).unwrap();
    for name in ["../m.obj", "link.obj", mesh.to_str().unwrap()] {
        fs::write(desk.path("scenes/mesh.toml"), with_mesh(name)).unwrap();
        let run = desk.run(&["check", "scenes/mesh.toml"]);
        assert_eq!(run.status, 0, "{name}: {}", run.err);
    }
}

#[test]
fn files_named_by_meshes_stay_in_their_folder() {
    let desk = Desk::new();
    fs::create_dir(desk.path("meshes")).unwrap();
    fs::write(desk.path("secret.bin"), [0; 36]).unwrap();
    let secret = desk.path("secret.bin");
    for uri in ["../secret.bin", "./../secret.bin", "x/../../secret.bin", secret.to_str().unwrap()]
    {
        let gltf = serde_json::json!({
            "asset": {"version": "2.0"},
            "buffers": [{"uri": uri, "byteLength": 36}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                           "min": [0, 0, 0], "max": [0, 0, 0]}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "nodes": [{"mesh": 0}],
            "scenes": [{"nodes": [0]}],
            "scene": 0
        });
        fs::write(desk.path("meshes/m.gltf"), gltf.to_string()).unwrap();
        fs::write(desk.path("mesh.toml"), with_mesh("meshes/m.gltf")).unwrap();
        let run = desk.run(&["check", "mesh.toml"]);
        assert_eq!(run.status, 1, "{uri}: {}", run.out);
        assert!(run.err.contains("folder"), "{uri}: {}", run.err);
    }
    // Without its colours, a mesh keeps its shape.
    fs::write(desk.path("secret.mtl"), "newmtl red\nKd 1 0 0\n").unwrap();
    let obj = "mtllib ../secret.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n";
    fs::write(desk.path("meshes/m.obj"), obj).unwrap();
    fs::write(desk.path("mesh.toml"), with_mesh("meshes/m.obj")).unwrap();
    let render = ["render", "mesh.toml", "-o", "a.png", "--spp", "2", "--size", "16x12"];
    for args in [&["check", "mesh.toml"][..], &render] {
        let run = desk.run(args);
        assert_eq!(run.status, 0, "{}", run.err);
        assert!(run.err.contains("\"../secret.mtl\" is not in the mesh's folder"), "{}", run.err);
    }
}

#[test]
fn sizes_are_checked_before_allocation() {
    let desk = Desk::new();
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 4000000000\n\
                  property float x\nproperty float y\nproperty float z\nelement face 4000000000\n\
                  property list uchar int vertex_indices\nend_header\n";
    fs::write(desk.path("m.ply"), header).unwrap();
    let mut stl = vec![0; 80];
    stl.extend(u32::MAX.to_le_bytes());
    fs::write(desk.path("m.stl"), stl).unwrap();
    for name in ["m.ply", "m.stl"] {
        fs::write(desk.path("mesh.toml"), with_mesh(name)).unwrap();
        // The limit of 2 GB leaves memory for the message only if the mesh is refused early.
        let program = env!("CARGO_BIN_EXE_zerkalo");
        let mut command = Command::new("sh");
        command.arg("-c").arg(format!("ulimit -v 2000000; exec '{program}' check mesh.toml"));
        let run = Run::from(command.current_dir(desk.0.path()).output().unwrap());
        assert_eq!(run.status, 1, "{name}: {}", run.err);
        assert!(run.err.contains(name), "{name}: {}", run.err);
    }
}

/// Checks that a scene or mesh that does not fit into the address space is refused. The address
/// space is limited to several sizes: the allocator of glibc reserves 64 MB for each thread. The
/// message states how much memory is needed in total. No allocation may fail.
#[test]
#[cfg(target_os = "linux")]
fn scenes_and_meshes_that_do_not_fit_are_refused() {
    const COUNT: usize = 20_000;
    let desk = Desk::new();
    let corner = |i: usize| [i % 300, i / 300];
    let mut spheres = SCENE.to_string();
    let mut obj = String::new();
    let mut stl = vec![0; 80];
    stl.extend((COUNT as u32).to_le_bytes());
    for i in 0..COUNT {
        let [x, y] = corner(i);
        write!(
            spheres,
            "[[object]]\nmaterial = \"red\"\nshape.sphere = {{ center = [{x}, {y}, 0], radius = 0.4 }}\n"
        )
        .unwrap();
        let face = [3 * i + 1, 3 * i + 2, 3 * i + 3];
        let [a, b, c] = [[x, y], [x + 1, y], [x, y + 1]];
        for [x, y] in [a, b, c] {
            writeln!(obj, "v {x} {y} 0").unwrap();
        }
        writeln!(obj, "f {} {} {}", face[0], face[1], face[2]).unwrap();
        let numbers = [[0; 2], a, b, c].map(|[x, y]| [x as f32, y as f32, 0.0]);
        stl.extend(numbers.as_flattened().iter().flat_map(|x| x.to_le_bytes()));
        stl.extend([0; 2]);
    }
    let equal_faces = format!("v 0 0 0\nv 1 0 0\nv 0 1 0\n{}", "f 1 2 3\n".repeat(COUNT));
    fs::write(desk.path("spheres.toml"), spheres).unwrap();
    let files = [("m.obj", obj.into_bytes()), ("m.stl", stl), ("equal.obj", equal_faces.into())];
    let mut scenes = vec!["spheres.toml".to_string()];
    for (name, bytes) in files {
        fs::write(desk.path(name), bytes).unwrap();
        scenes.push(format!("{name}.toml"));
        fs::write(desk.path(&scenes[scenes.len() - 1]), with_mesh(name)).unwrap();
    }
    for scene in &scenes {
        let mut fits = false;
        for megabytes in [30, 110, 300, 540, 600, 900, 1600] {
            let limit = format!("ulimit -v {}", 1000 * megabytes);
            let command =
                format!("exec \"$0\" render {scene} -o a.png --spp 2 --size 64x48 --threads 2");
            let mut shell = Command::new("sh");
            shell.args(["-c", &format!("{limit}; {command}"), env!("CARGO_BIN_EXE_zerkalo")]);
            let output = shell.current_dir(desk.0.path()).output().unwrap();
            let errors = String::from_utf8_lossy(&output.stderr);
            let status = output.status;
            fits |= status.success();
            let refused =
                status.code() == Some(1) && errors.contains("available (the limit on address");
            assert!(status.success() || refused, "{command}, {limit}: {status} {errors}");
        }
        assert!(fits, "{scene} fits into 1.6 GB");
    }
}

/// Checks that images whose sum does not fit into the address space are refused before one of them is
/// decoded, and that they are rendered if they fit.
#[test]
#[cfg(target_os = "linux")]
fn images_that_do_not_fit_together_are_refused() {
    let desk = Desk::new();
    let pixels = vec![200; 3 * 3000 * 3000];
    let png = zerkalo_render::image_file::png_of_rgb([3000, 3000], &pixels, None).unwrap();
    let mut textures = SCENE.to_string();
    for i in 0..24 {
        fs::write(desk.path(&format!("{i}.png")), &png).unwrap();
        writeln!(textures, "[materials.m{i}]\ntexture.image.file = \"{i}.png\"").unwrap();
    }
    // An old run of 256 * 128 pixels takes 8 bytes of a row.
    let row = [[9; 4], [1, 1, 1, 255], [1, 1, 1, 63]].concat();
    let hdr = [&b"#?RADIANCE\n\n-Y 2000 +X 16384\n"[..], &row.repeat(2000)].concat();
    fs::write(desk.path("sky.hdr"), hdr).unwrap();
    let sky = format!("{SCENE}[[light]]\nenvironment.file = \"sky.hdr\"\n");
    for (name, scene, words) in [
        ("textures.toml", textures, "with the other 23 files of the scene, this file needs "),
        ("sky.toml", sky, "sky.hdr: the file needs "),
    ] {
        fs::write(desk.path(name), scene).unwrap();
        let mut fits = false;
        for megabytes in [600, 1000, 4000] {
            let limit = format!("ulimit -v {}", 1000 * megabytes);
            let command = format!("exec \"$0\" check {name}");
            let mut shell = Command::new("sh");
            shell.args(["-c", &format!("{limit}; {command}"), env!("CARGO_BIN_EXE_zerkalo")]);
            let run = Run::from(shell.current_dir(desk.0.path()).output().unwrap());
            fits |= run.status == 0;
            let refused = run.status == 1 && run.err.contains(words) && run.err.lines().count() < 6;
            assert!(run.status == 0 || refused, "{command}, {limit}: {} {}", run.status, run.err);
            assert!(megabytes > 600 || refused, "{command}, {limit}");
        }
        assert!(fits, "{name} fits into 4 GB");
    }
}

/// Checks that pipes are not waited for. A scene may come from a pipe that a program writes to.
#[test]
#[cfg(unix)]
fn pipes_without_a_writer_are_refused() {
    let desk = Desk::new();
    assert!(Command::new("mkfifo").arg(desk.path("pipe")).status().unwrap().success());
    for (args, words) in [
        (&["check", "pipe"][..], "the file holds no scene"),
        (&["measure", "scene.toml", "--reference", "pipe"], "it is a pipe, not a regular file"),
        (&["info", "pipe"], "it is a pipe, not a regular file"),
        (&["render", "scene.toml", "-o", "a.png", "--resume", "pipe"], "it is a pipe"),
    ] {
        let run = desk.run(args);
        assert_eq!(run.status, 1, "{args:?}");
        assert!(run.err.contains(words), "{args:?}: {}", run.err);
    }
    let script = "cat scene.toml | \"$0\" check /dev/stdin";
    let mut shell = Command::new("sh");
    shell.args(["-c", script, env!("CARGO_BIN_EXE_zerkalo")]).current_dir(desk.0.path());
    let run = Run::from(shell.output().unwrap());
    assert_eq!(run.status, 0, "{}", run.err);
}

#[test]
fn metadata_cannot_forge_lines() {
    let desk = Desk::new();
    let mut encoder = png::Encoder::new(fs::File::create(desk.path("a.png")).unwrap(), 1, 1);
    let forged = "a\n  Scene hash  0123".to_string();
    encoder.add_text_chunk("Source".to_string(), forged.clone()).unwrap();
    encoder.add_itxt_chunk("Software".to_string(), forged).unwrap();
    encoder.write_header().unwrap().write_image_data(&[0]).unwrap();
    let run = desk.run(&["info", "a.png"]);
    assert_eq!(run.status, 0, "{}", run.err);
    assert_eq!(run.out.lines().count(), 3, "{}", run.out);
    assert!(run.out.contains("  Source    a\\n  Scene hash  0123\n"), "{}", run.out);
}
