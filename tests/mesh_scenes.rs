//! Meshes in scenes: shipped files, pictures against analytic shapes, watertightness, normals,
//! colours, and files that are invalid or change.

use crate::harness::*;
use zerkalo_scene::SceneFile;
use zerkalo_scene::edit::{add_object, set};

/// Returns a tube around a trefoil knot, made of quadrilaterals, as binary PLY.
fn knot() -> Vec<u8> {
    const ALONG: usize = 240;
    const AROUND: usize = 24;
    let curve = |t: f64| {
        let (x, y) = (t.sin() + 2.0 * (2.0 * t).sin(), t.cos() - 2.0 * (2.0 * t).cos());
        DVec3::new(x, y, -(3.0 * t).sin())
    };
    let mut out = format!(
        "ply\nformat binary_little_endian 1.0\ncomment A tube round a trefoil knot.\n\
         element vertex {0}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {0}\nproperty list uchar int vertex_indices\nend_header\n",
        ALONG * AROUND
    )
    .into_bytes();
    for i in 0..ALONG {
        let t = TAU * i as f64 / ALONG as f64;
        let (before, here, after) = (curve(t - 1e-3), curve(t), curve(t + 1e-3));
        let tangent = (after - before).normalize();
        let inward = (before + after - 2.0 * here).normalize();
        let inward = (inward - tangent * inward.dot(tangent)).normalize();
        let side = tangent.cross(inward);
        for k in 0..AROUND {
            let (sin, cos) = (TAU * k as f64 / AROUND as f64).sin_cos();
            for x in (here + (inward * cos + side * sin) * 0.45).to_array() {
                // Rounding to five decimals hides the differences between machines.
                out.extend((((x * 1e5).round() / 1e5) as f32).to_le_bytes());
            }
        }
    }
    for i in 0..ALONG {
        for k in 0..AROUND {
            let at = |i: usize, k: usize| (i % ALONG * AROUND + k % AROUND) as i32;
            out.push(4);
            for corner in [at(i, k), at(i, k + 1), at(i + 1, k + 1), at(i + 1, k)] {
                out.extend(corner.to_le_bytes());
            }
        }
    }
    out
}

/// Returns a cut stone as OBJ: table and crown have one colour, the pavilion another.
fn stone() -> String {
    let mut out = String::from("# A cut stone.\nmtllib stone.mtl\n");
    let ring = |out: &mut String, radius: f64, y: f64, turn: f64| {
        for i in 0..12 {
            let (sin, cos) = (TAU * (f64::from(i) + turn) / 12.0).sin_cos();
            writeln!(out, "v {:.6} {y:.6} {:.6}", radius * cos, -radius * sin).unwrap();
        }
    };
    ring(&mut out, 0.6, 0.35, 0.5);
    ring(&mut out, 1.0, 0.0, 0.0);
    writeln!(out, "v 0 -1 0").unwrap();
    let (table, girdle, tip) = (|i: usize| i % 12 + 1, |i: usize| i % 12 + 13, 25);
    out += "usemtl crown\nf";
    (0..12).for_each(|i| write!(out, " {}", table(i)).unwrap());
    out += "\n";
    for i in 0..12 {
        writeln!(out, "f {} {} {}", table(i), girdle(i), girdle(i + 1)).unwrap();
        writeln!(out, "f {} {} {}", table(i), girdle(i + 1), table(i + 1)).unwrap();
    }
    out += "usemtl pavilion\n";
    for i in 0..12 {
        writeln!(out, "f {} {tip} {}", girdle(i), girdle(i + 1)).unwrap();
    }
    out
}

const STONE_COLORS: &str = "newmtl crown\nKd 0.55 0.75 0.85\nnewmtl pavilion\nKd 0.10 0.30 0.60\n";

#[test]
fn mesh_files_match_generators() {
    let folder = Path::new(env!("ZERKALO_ROOT")).join("scenes/meshes");
    for (name, made) in [
        ("knot.ply", knot()),
        ("stone.obj", stone().into_bytes()),
        ("stone.mtl", STONE_COLORS.as_bytes().to_vec()),
    ] {
        let path = folder.join(name);
        if std::env::var_os("ZERKALO_BLESS").is_some() {
            fs::write(&path, &made).unwrap();
        }
        assert!(fs::read(&path).unwrap() == made, "{name}");
    }
}

#[test]
fn shipped_meshes_face_outwards() {
    for (name, volume) in [("knot.ply", 18.0..18.2), ("stone.obj", 1.0..2.0)] {
        let path = Path::new(env!("ZERKALO_ROOT")).join("scenes/meshes").join(name);
        let mesh = Assets::default().mesh(&path).unwrap();
        let corner = |i: &u32| DVec3::from(mesh.mesh.positions[*i as usize].map(f64::from));
        let cone = |t: &[u32; 3]| corner(&t[0]).dot(corner(&t[1]).cross(corner(&t[2]))) / 6.0;
        let inside: f64 = mesh.mesh.triangles.iter().map(cone).sum();
        assert!(volume.contains(&inside), "{name}: {inside}");
    }
}

/// Returns a ball of radius 1 around the origin as OBJ, with corners on the sphere.
fn ball(rings: usize, sides: usize) -> String {
    let mut text = String::from("v 0 1 0\n");
    for ring in 1..rings {
        let (across, y) = (PI * ring as f64 / rings as f64).sin_cos();
        for side in 0..sides {
            let (sin, cos) = (TAU * side as f64 / sides as f64).sin_cos();
            writeln!(text, "v {} {y} {}", across * cos, across * sin).unwrap();
        }
    }
    text += "v 0 -1 0\n";
    let last = (rings - 1) * sides + 2;
    let at = |ring: usize, side: usize| (ring - 1) * sides + side % sides + 2;
    for side in 0..sides {
        writeln!(text, "f 1 {} {}", at(1, side + 1), at(1, side)).unwrap();
        for ring in 1..rings - 1 {
            let [a, b] = [at(ring, side), at(ring, side + 1)];
            let [c, d] = [at(ring + 1, side), at(ring + 1, side + 1)];
            writeln!(text, "f {a} {b} {d} {c}").unwrap();
        }
        writeln!(text, "f {last} {} {}", at(rings - 1, side), at(rings - 1, side + 1)).unwrap();
    }
    text
}

/// Temporary folder with mesh files and scenes that use them.
struct Desk(tempfile::TempDir);

impl Desk {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn put(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.path().join(name);
        fs::write(&path, text).unwrap();
        path
    }

    fn scene(&self, text: &str) -> Scene {
        Scene::read(&self.put("scene.toml", text)).unwrap_or_else(|e| panic!("{e}"))
    }
}

const VIEW: &str = "
    film.size = [96, 96]
    camera = { eye = [0.4, 1.1, 3.4], target = [0.0, 0.0, 0.0], view_angle.vertical = 40.0 }
    background.color = [0.0, 0.0, 1.0]
    materials.red = { color = [1.0, 0.0, 0.0], diffuse = 1.0 }
    [[light]]
    point = { position = [3.0, 4.0, 5.0] }
    [[object]]
    material = \"red\"
";

/// Checks that a light inside a closed mesh lights no surface outside of it, neither with smooth
/// nor with flat normals.
#[test]
fn closed_mesh_leaks_no_light() {
    let desk = Desk::new();
    desk.put("ball.obj", &ball(6, 9));
    for (lamp, normals) in [([0.1, -0.1, 0.2], "smooth"), ([0.1, -0.1, 0.2], "flat")] {
        let text = VIEW.replace("[3.0, 4.0, 5.0]", &format!("{lamp:?}"));
        let text = format!("{text}shape.mesh = {{ file = \"ball.obj\", normals = \"{normals}\" }}");
        let rendering = rendered(&desk.scene(&text), 3, Precision::Single, 64);
        let brightest =
            picture(&rendering, Replicates::Both).iter().fold(0.0f64, |m, p| m.max(p[0]));
        assert_eq!(brightest, 0.0, "{normals}");
    }
}

/// Checks that a large triangle in grazing light does not shadow itself, near and far from the
/// origin.
#[test]
fn triangles_do_not_shadow_themselves() {
    let desk = Desk::new();
    for at in [0.0, 100.0] {
        let corners = [[-9.0, 0.0, 9.0], [9.0, 0.0, 9.0], [0.0, 0.0, -20.0]];
        let mut text = String::new();
        for [x, y, z] in corners {
            writeln!(text, "v {} {y} {z}", x + at).unwrap();
        }
        desk.put("floor.obj", &(text + "f 1 2 3\n"));
        let view = VIEW
            .replace("eye = [0.4, 1.1, 3.4]", &format!("eye = [{:?}, 2.0, 2.0]", 0.4 + at))
            .replace("target = [0.0, 0.0, 0.0]", &format!("target = [{at:?}, 0.0, 0.0]"))
            .replace("[3.0, 4.0, 5.0]", &format!("[{:?}, 0.002, 2.0]", 8.0 + at));
        let scene = desk.scene(&format!("{view}shape.mesh = {{ file = \"floor.obj\" }}"));
        let pixels = picture(&rendered(&scene, 3, Precision::Auto, 8), Replicates::Both);
        let dark = pixels.iter().filter(|p| p[2] == 0.0 && p[0] == 0.0).count();
        let seen = pixels.iter().filter(|p| p[2] == 0.0).count();
        assert!(seen > 4000 && dark == 0, "{dark} of {seen} at {at}");
    }
}

#[test]
fn flat_normals_show_the_triangles() {
    let desk = Desk::new();
    desk.put("ball.obj", &ball(6, 9));
    let sphere =
        desk.scene(&(VIEW.to_string() + "shape.sphere = { center = [0, 0, 0], radius = 1 }"));
    let mesh = |normals: &str| {
        let shape = format!("shape.mesh = {{ file = \"ball.obj\", normals = \"{normals}\" }}");
        desk.scene(&(VIEW.to_string() + &shape))
    };
    let pictures = [sphere, mesh("smooth"), mesh("flat")]
        .map(|scene| picture(&rendered(&scene, 7, Precision::Auto, 16), Replicates::Both));
    // The compared pixels are inside of both silhouettes, where all surfaces are lit.
    let apart = |which: usize| {
        let inner = (0..96 * 96).filter(|i| {
            let (x, y) = ((i % 96) as f64 - 47.5, (i / 96) as f64 - 47.5);
            x.hypot(y) < 20.0
        });
        inner.map(|i| (pictures[which][i][0] - pictures[0][i][0]).powi(2)).sum::<f64>()
    };
    let (smooth, flat) = (apart(1), apart(2));
    assert!(smooth * 4.0 < flat, "{smooth} {flat}");
}

/// Checks that a smooth ball of few triangles has no black facets on the side that faces the light,
/// under every kind of light, and that no light reaches the other side. The view is from +z, without
/// perspective.
#[test]
fn smooth_ball_has_no_black_facets() {
    let desk = Desk::new();
    desk.put("ball.obj", &ball(6, 9));
    desk.put("fine.obj", &ball(12, 17));
    let lights = [
        "directional = { direction = [-1.0, -0.37, -0.21] }",
        "point = { position = [1000.0, 370.0, 210.0] }\nfalloff = \"none\"",
        "directional = { direction = [-1.0, -0.37, -0.21], angle = 0.01 }",
        "sphere = { center = [1000.0, 370.0, 210.0], radius = 0.5 }\nintensity = 4e6",
    ];
    let light = DVec3::new(1.0, 0.37, 0.21).normalize();
    for (text, file) in lights.iter().flat_map(|l| [(l, "ball.obj"), (l, "fine.obj")]) {
        let scene = desk.scene(&format!(
            "film = {{ size = [96, 96], filter = \"point\" }}
             camera = {{ eye = [0.0, 0.0, 1000.0], target = [0.0, 0.0, 0.0], view_angle.vertical = 0.1260507 }}
             [[light]]\n{text}
             [[object]]\nshape.mesh = {{ file = \"{file}\", normals = \"smooth\" }}"
        ));
        let pixels = picture(&rendered(&scene, 3, Precision::Auto, 2), Replicates::Both);
        let (mut facing, mut black, mut leaks) = (0, 0, 0);
        for (i, pixel) in pixels.iter().enumerate() {
            let at = |n: usize| (n as f64 + 0.5) * 2.2 / 96.0 - 1.1;
            let (x, y) = (at(i % 96), -at(i / 96));
            if x * x + y * y < 0.81 {
                let cos = DVec3::new(x, y, (1.0 - x * x - y * y).sqrt()).dot(light);
                facing += u32::from(cos > 0.03);
                black += u32::from(cos > 0.03 && pixel[0] < 1e-4);
                leaks += u32::from(cos < -0.03 && pixel[0] > 0.0);
            }
        }
        assert!(facing > 2000 && black == 0 && leaks == 0, "{text}, {file}: {black}, {leaks}");
    }
}

#[test]
fn invalid_file_name_is_rejected_and_valid_file_read_once() {
    let desk = Desk::new();
    let ball_file = desk.put("ball.obj", &ball(6, 9));
    desk.put("broken.obj", "v 0 0 0\nf 1 2 3\n");
    let scene =
        desk.scene(&(VIEW.to_string() + "shape.sphere = { center = [0, 0, 0], radius = 1 }"));
    let edit = add_object(&scene, "mesh", None).unwrap();
    let subject = edit.target.clone();
    let typed = |scene: &Scene, text: &str| set(scene, &subject, "shape.mesh.file", text);
    for (text, words) in [
        ("bell.obj", "there is no such file"),
        ("broken.obj", "broken.obj:2: "),
        ("scene.toml", "\"toml\" is not a kind of mesh file"),
        (".", "it is a directory, not a regular file"),
    ] {
        let refusal = typed(&edit.scene, text).unwrap_err().to_string();
        assert!(refusal.contains(words), "{text}: {refusal}");
    }
    let named = typed(&edit.scene, "ball.obj").unwrap().scene;
    let mesh = |scene: &Scene| match scene.objects[1].form() {
        Form::Mesh(MeshForm { mesh, .. }) => mesh,
        other => panic!("{other:?}"),
    };
    let triangles = mesh(&named).mesh.triangles.len();
    assert_eq!(triangles, 2 * 9 * 5);
    // The loaded mesh remains after the file is removed and the scene is edited.
    fs::remove_file(ball_file).unwrap();
    let flat = set(&named, &subject, "shape.mesh.normals", "flat").unwrap().scene;
    let rotated = set(&flat, &subject, "transform", "rotate_y").unwrap().scene;
    let ambient = Target::Settings(SceneSettings::Ambient);
    let lit = set(&rotated, &ambient, "color", "0.5 0.5 0.5").unwrap().scene;
    assert_eq!(mesh(&lit), mesh(&named));
    assert!(typed(&lit, "other.obj").is_err());
    assert!(lit.faults().is_empty());
}

#[test]
fn scene_is_not_saved_where_mesh_would_be_missing() {
    let desk = Desk::new();
    desk.put("ball.obj", &ball(6, 9));
    let text = VIEW.to_string() + "shape.mesh = { file = \"ball.obj\" }";
    let path = desk.put("scene.toml", &text);
    let elsewhere = tempfile::tempdir().unwrap();
    let mut file = SceneFile::open(&path).unwrap();
    let scene = file.document.scene().clone();
    let other = elsewhere.path().join("scene.toml");
    let refusal = file.save_as(&other, &scene, false).unwrap_err().to_string();
    assert!(refusal.contains("\"ball.obj\"") && !other.exists(), "{refusal}");
    let beside = desk.0.path().join("copy.toml");
    file.save_as(&beside, &scene, false).unwrap();
    assert!(Scene::read(&beside).is_ok());
    // The other folder contains a different mesh under this name, so that the scene would change.
    fs::write(elsewhere.path().join("ball.obj"), ball(5, 5)).unwrap();
    assert!(file.save_as(&other, &scene, false).is_err());
}

#[test]
fn the_inventory_counts_triangles() {
    let scene = shipped("shape-mesh.toml");
    let inventory = AnyWorld::compile(&scene, &Options::default()).info().inventory.clone();
    assert!(inventory.contains("4 meshes of 23,106 triangles (list)"), "{inventory}");
}

/// Returns a rod along y as OBJ, of 64 strips of two triangles.
fn rod(radius: f64, length: f64) -> String {
    let mut text = String::new();
    for side in 0..64 {
        let (sin, cos) = (TAU * f64::from(side) / 64.0).sin_cos();
        for y in [-0.5, 0.5] {
            writeln!(text, "v {} {} {}", radius * cos, y * length, -radius * sin).unwrap();
        }
    }
    for side in 0..64 {
        let [a, b] = [side, (side + 1) % 64].map(|side| 2 * side + 1);
        writeln!(text, "f {a} {b} {}\nf {a} {} {}", b + 1, b + 1, a + 1).unwrap();
    }
    text
}

/// Checks that rods and planks of long, thin triangles are white in a white furnace, to a ratio of
/// length to width of 1e4 in single and 1e6 in double precision: strips do not shade themselves.
#[test]
fn long_thin_triangles_are_white_in_a_furnace() {
    let desk = Desk::new();
    desk.put("plank.obj", "v -50 0 -.05\nv 50 0 -.05\nv 50 0 .05\nv -50 0 .05\nf 1 3 2\nf 1 4 3\n");
    let materials = [
        "diffuse = 1",
        "reflection = 1\ndiffuse = 0",
        "reflection = 1\nroughness = 0.3\ndiffuse = 0",
    ];
    let white = |file: &str, width: f64, distance: f64, material: &str, precision| {
        let scene = desk.scene(&format!(
            "film.size = [32, 24]
             camera = {{ eye = [0.1, 0.3, 1.0], target = [0, 0, 0], view_angle.vertical = {:?} }}
             [[light]]\nenvironment = {{}}
             [materials.white]\ncolor = [1, 1, 1]\nambient = 0\n{material}
             [[object]]\nmaterial = \"white\"\nshape.mesh = {{ file = \"{file}\", normals = \"flat\" }}
             transform = [{{ rotate_z = 80.0 }}, {{ rotate_x = 17.0 }}, {{ rotate_y = 23.0 }}]",
            (width / distance).to_degrees()
        ));
        let pixels = picture(&rendered(&scene, 3, precision, 32), Replicates::Both);
        let mean = pixels.iter().map(|pixel| pixel[0]).sum::<f64>() / pixels.len() as f64;
        assert!((mean - 1.0).abs() < 1e-3, "{file}, {material}, {precision:?}: {mean}");
    };
    for material in materials {
        for aspect in [2e2, 2e3, 1e4, 1e6] {
            let radius = 64.0 / (TAU * aspect);
            let rod_file = format!("rod{aspect}.obj");
            desk.put(&rod_file, &rod(radius, 1.0));
            if aspect <= 1e4 {
                white(&rod_file, radius, 1.0, material, Precision::Single);
            }
            white(&rod_file, radius, 1.0, material, Precision::Double);
        }
        white("plank.obj", 0.03, 1.0, material, Precision::Single);
        white("plank.obj", 0.03, 1.0, material, Precision::Double);
    }
}
