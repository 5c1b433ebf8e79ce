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

/// Small files that declare, or decode to, more than the address space of the test: name, contents, and
/// words of the message about them.
fn bombs() -> Vec<(&'static str, Vec<u8>, &'static str)> {
    let png_header = |width: u32, height: u32, depth: u8, kind: u8| {
        let size = [width.to_be_bytes(), height.to_be_bytes()].concat();
        let chunk = [&b"IHDR"[..], &size, &[depth, kind, 0, 0, 0]].concat();
        let sum = crc32fast::hash(&chunk).to_be_bytes();
        [&b"\x89PNG\r\n\x1a\n\0\0\0\x0d"[..], &chunk, &sum, b"\0\0\x23\x28IDAT", &[0; 9000]]
            .concat()
    };
    let sof = |side: u16| {
        [&[0xff, 0xc0, 0, 11, 8][..], &side.to_be_bytes(), &side.to_be_bytes()].concat()
    };
    let jpeg = |side| {
        [
            &[0xff, 0xd8][..],
            &sof(side),
            &[1, 1, 0x11, 0, 0xff, 0xda, 0, 8, 1, 1, 0, 0, 63, 0],
            &[0; 200_000],
        ]
        .concat()
    };
    let attribute = |name: &str, kind: &str, value: &[u8]| {
        let length = (value.len() as u32).to_le_bytes();
        [name.as_bytes(), &[0], kind.as_bytes(), &[0], &length, value].concat()
    };
    let exr = |width: i32, height: i32| {
        let channel = |name: u8| [&[name, 0, 1][..], &[0; 7], &[1, 0, 0, 0, 1, 0, 0, 0]].concat();
        let channels = [&channel(b'B')[..], &channel(b'G'), &channel(b'R'), &[0]].concat();
        let window = [0, 0, width - 1, height - 1].map(i32::to_le_bytes).concat();
        let one = 1f32.to_le_bytes();
        let header = [
            attribute("channels", "chlist", &channels),
            attribute("compression", "compression", &[3]),
            attribute("dataWindow", "box2i", &window),
            attribute("displayWindow", "box2i", &window),
            attribute("lineOrder", "lineOrder", &[0]),
            attribute("pixelAspectRatio", "float", &one),
            attribute("screenWindowCenter", "v2f", &[0; 8]),
            attribute("screenWindowWidth", "float", &one),
        ];
        [&[0x76, 0x2f, 0x31, 1, 2, 0, 0, 0][..], &header.concat(), &[0; 9000]].concat()
    };
    let hdr = |width: u32, height: u32| {
        let row = [[9; 4], [1, 1, 1, 255], [1, 1, 1, 63]].concat();
        [format!("#?RADIANCE\n\n-Y {height} +X {width}\n").as_bytes(), &row.repeat(500)].concat()
    };
    let ply = |format: &str, count: u32| {
        format!(
            "ply\nformat {format} 1.0\nelement vertex {count}\nproperty float x\nproperty float y\n\
             property float z\nelement face {count}\nproperty list uint int vertex_indices\nend_header\n"
        )
    };
    // Each corner becomes a vertex of its own, since its texture coordinates are new.
    let face = |i: u32| {
        let [x, y, z, _] = i.to_le_bytes();
        [3, 3 * z, 3 * z + 1, 3 * z + 2, 6, x, y, x, y, x, y]
    };
    let copies = [
        &b"ply\nformat binary_little_endian 1.0\nelement vertex 60\nproperty uchar x\n\
           property uchar y\nproperty uchar z\nelement face 1300000\n\
           property list uchar uchar vertex_indices\nproperty list uchar uchar texcoord\n\
           end_header\n"[..],
        &[0; 180],
        &(0..1_300_000).flat_map(face).collect::<Vec<_>>(),
    ]
    .concat();
    let list = [ply("binary_little_endian", 1).into_bytes(), vec![0; 12], vec![0xff; 4]].concat();
    let gltf = |count: u32, bytes: u32, copies: usize| {
        let repeated = |item: &str| vec![item; copies].join(",");
        let zeros = "A".repeat(4 * bytes.min(120_000).div_ceil(3) as usize);
        format!(
            r#"{{"asset":{{"version":"2.0"}},
            "buffers":[{{"byteLength":{bytes},"uri":"data:application/octet-stream;base64,{zeros}"}}],
            "bufferViews":[{{"buffer":0,"byteLength":{bytes}}}],
            "accessors":[{{"bufferView":0,"componentType":5126,"count":{count},"type":"VEC3"}}],
            "meshes":[{{"primitives":[{}]}}],"nodes":[{}],"scenes":[{{"nodes":[{}]}}],"scene":0}}"#,
            repeated(r#"{"attributes":{"POSITION":0}}"#),
            repeated(r#"{"mesh":0}"#),
            (0..copies).map(|i| i.to_string()).collect::<Vec<_>>().join(","),
        )
    };
    let glb_json =
        gltf(3, 36, 1).replace(r#","uri":"data:application/octet-stream;base64,"#, r#","x":""#);
    let length = (glb_json.len() as u32).to_le_bytes();
    let glb = [
        &b"glTF\x02\0\0\0\xff\xff\xff\xff"[..],
        &length,
        b"JSON",
        glb_json.as_bytes(),
        &[0xf0, 0xff, 0xff, 0xff],
        b"BIN\0",
    ]
    .concat();
    let (memory, size) = (" MB are available (the limit on address space", "the image has ");
    vec![
        ("deep.png", png_header(8000, 8000, 16, 6), memory),
        ("sky-deep.png", png_header(8000, 8000, 16, 6), size),
        ("huge.png", png_header(1 << 30, 1 << 30, 8, 2), "too large"),
        ("big.jpg", jpeg(8000), memory),
        ("huge.jpg", jpeg(65_535), size),
        ("sky.hdr", hdr(16_384, 2000), memory),
        ("sky-huge.hdr", hdr(2_147_483_647, 2_147_483_647), size),
        ("sky.exr", exr(8192, 4096), memory),
        ("sky-huge.exr", exr(1 << 30, 1 << 30), "window size"),
        ("many.ply", ply("ascii", 4_000_000_000).into(), "more than the file holds"),
        (
            "many-bytes.ply",
            ply("binary_big_endian", 4_000_000_000).into(),
            "more than the file holds",
        ),
        ("list.ply", list, "a list has 4294967295 values"),
        ("copies.ply", copies, memory),
        ("many.stl", [vec![0; 80], vec![0xff; 4]].concat(), "4294967295 triangles"),
        ("lists.stl", format!("solid\n{}", "facet normal 0 0 1\n".repeat(9)).into(), "lists.stl"),
        ("copies.gltf", gltf(9000, 108_000, 100).into(), memory),
        ("claim.gltf", gltf(357_913_941, u32::MAX - 3, 1).into(), "do not lie in their buffer"),
        ("claim.glb", glb, "claim.glb"),
        (
            "corner.obj",
            format!("v 0 0 0\n{}f 1 2 4000000000\n", "v 1 0 0\n".repeat(9)).into(),
            "4000000000",
        ),
        ("nested.toml", format!("x = {}", "[".repeat(900_000)).into(), "recurs"),
        ("keys.toml", format!("{}a = 1", "a.".repeat(400_000)).into(), "recursion limit"),
    ]
}

/// Checks under a limit on address space that small files which declare gigabytes are refused with a
/// located message by every command that reads them. No allocation may fail.
#[test]
#[cfg(target_os = "linux")]
fn small_files_that_declare_gigabytes_are_refused() {
    let desk = Desk::new();
    let limited = |command: &str| {
        let script = format!("ulimit -v 600000; exec timeout 60 \"$0\" {command}");
        let mut shell = Command::new("sh");
        shell.args(["-c", &script, env!("CARGO_BIN_EXE_zerkalo")]).current_dir(desk.0.path());
        let run = Run::from(shell.output().unwrap());
        assert_eq!(run.status, 1, "{command}: {} {}", run.out, run.err);
        assert!(!run.err.contains("panicked"), "{command}: {}", run.err);
        run.err
    };
    let mut wrong = Vec::new();
    for (name, bytes, words) in bombs() {
        fs::write(desk.path(name), bytes).unwrap();
        let scene = match name.rsplit_once('.').unwrap() {
            (_, "toml") => name.to_string(),
            (stem, "png" | "jpg") if !stem.starts_with("sky") => {
                format!("{SCENE}[materials.m]\ntexture.image.file = \"{name}\"\n")
            }
            (_, "png" | "hdr" | "exr") => {
                format!("{SCENE}[[light]]\nenvironment.file = \"{name}\"\n")
            }
            (..) => with_mesh(name),
        };
        let scene_file = if scene == name { name } else { "bomb.toml" };
        if scene != name {
            fs::write(desk.path(scene_file), scene).unwrap();
        }
        for command in ["check SCENE", "render SCENE -o a.png --spp 2 --size 16x12 --threads 1"] {
            let message = limited(&command.replace("SCENE", scene_file));
            if !(message.contains(name) && message.contains(words)) {
                wrong.push(format!("{name}: {message}"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    for (command, words) in [
        ("measure scene.toml --seconds 1 --reference sky.exr", "sky.exr: it needs "),
        ("compare deep.png deep.png", "deep.png: it needs "),
    ] {
        let message = limited(command);
        assert!(message.contains(words) && message.contains("expected"), "{message}");
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
        for megabytes in [600, 4000] {
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
