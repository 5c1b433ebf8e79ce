//! The scene files in `scenes`, and the invalid ones in `tests/bad-scenes`.

mod format_manual;

use crate::harness::*;

fn files(folder: &str) -> Vec<PathBuf> {
    let mut paths: Vec<PathBuf> = std::fs::read_dir(folder)
        .unwrap_or_else(|e| panic!("{folder}: {e}"))
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|e| e == "toml"))
        .collect();
    paths.sort();
    paths
}

/// Compares `text` with the file at `path`. If `ZERKALO_BLESS` is set, writes `text` to the file
/// instead.
fn golden(path: &Path, text: &str) {
    if std::env::var_os("ZERKALO_BLESS").is_some() {
        std::fs::write(path, text).unwrap();
        return;
    }
    let stored = std::fs::read_to_string(path).unwrap_or_default();
    assert!(
        stored == text,
        "{} is not what the program says now. It says:\n{text}\nIf that is right: \
         ZERKALO_BLESS=1 cargo test --release --test program scene_files::",
        path.display()
    );
}

#[test]
fn every_bad_scene_gives_its_expected_errors() {
    let paths = files("tests/bad-scenes");
    assert!(paths.len() >= 40, "only {} bad scenes", paths.len());
    for path in paths {
        let error = match Scene::read(&path) {
            Err(error) => error.to_string(),
            Ok(_) => panic!("{} was read without complaint", path.display()),
        };
        let steering =
            |c: &char| c.is_control() && *c != '\n' || ('\u{202a}'..='\u{202e}').contains(c);
        assert_eq!(error.chars().find(steering), None, "{error:?}");
        golden(&path.with_extension("txt"), &(error + "\n"));
    }
}

/// Scene files with an intended warning, each with a part of the warning's text.
const WARNED: &[(&str, &str)] = &[
    ("brighter-than-its-light.toml", "more than the light"),
    // The formula for the colours of this scene gives values up to 7.
    ("reflecting-tracks.toml", "more than the light"),
    ("reflecting-tracks-lit.toml", "more than the light"),
];

#[test]
fn every_scene_reads_and_has_a_title_comment() {
    let paths = [files("scenes"), files("scenes/features")].concat();
    assert!(paths.len() >= 30, "only {} scenes", paths.len());
    for path in paths {
        let document = Document::read(&path, Default::default()).unwrap_or_else(|e| panic!("{e}"));
        let text = document.text();
        assert!(text.starts_with("# "), "{} opens without a comment", path.display());
        let file = path.file_name().unwrap().to_str().unwrap();
        let expected = WARNED.iter().find(|(name, _)| *name == file).map(|(_, words)| *words);
        let warnings: Vec<_> = document.warnings.iter().map(|w| w.to_string()).collect();
        match expected {
            None => assert_eq!(warnings, [] as [&str; 0]),
            Some(words) => {
                assert!(warnings.len() == 1 && warnings[0].contains(words), "{warnings:?}")
            }
        }
        // The comments refer only to scenes that exist.
        for word in text.split('`').filter(|w| w.ends_with(".toml")) {
            assert!(path.with_file_name(word).exists(), "{} names {word}", path.display());
        }
    }
}

#[test]
fn scene_format_reference_is_up_to_date() {
    golden(Path::new("docs/scene-format.md"), &format_manual::format_manual());
}

fn corners(scene: &Scene, name: &str) -> Vec<[f64; 3]> {
    let object = scene.objects.iter().find(|o| o.name == name).unwrap();
    match object.shape.form() {
        Form::ConvexPolyhedron(ConvexPolyhedronForm { corners, .. }) => {
            corners.iter().map(|c| c.to_array()).collect()
        }
        other => panic!("{other:?}"),
    }
}

#[test]
fn mirror_room_has_published_coordinates() {
    let physical = Scene::read("scenes/features/mirror-room-physical.toml".as_ref()).unwrap();
    let beautiful = Scene::read("scenes/mirror-room.toml".as_ref()).unwrap();
    let shapes = |scene: &Scene| scene.objects.iter().map(|o| o.shape.clone()).collect::<Vec<_>>();
    assert_eq!(shapes(&physical), shapes(&beautiful));
    assert_eq!(physical.camera, beautiful.camera);

    let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
    let has = |name, points: &[[f64; 3]]| {
        let corners = corners(&physical, name);
        for point in points {
            assert!(corners.iter().any(|c| near(*c, *point)), "{name}: {point:?} {corners:?}");
        }
        corners
    };
    // Base vertices of the prism, to the nine digits in which they are published.
    let base = [(-0.2, 1.561880215), (0.2, 0.869059892), (-0.6, 0.869059892)];
    let prism: Vec<_> = base.iter().flat_map(|(x, z)| [[*x, 0.0, *z], [*x, 0.9, *z]]).collect();
    assert_eq!(has("prism", &prism).len(), 6);
    let pyramid = [[1.05, 0.0, 0.85], [1.95, 0.0, -0.05], [1.3, 0.7, 0.6], [1.7, 0.7, 0.2]];
    assert_eq!(has("pyramid", &pyramid).len(), 8);
    // The near right edge of the cube: (0.4, 0.4) rotated by 30 degrees about the vertical.
    let (sin, cos) = 30f64.to_radians().sin_cos();
    let (x, z) = (0.5 + 0.4 * (cos + sin), -0.3 + 0.4 * (cos - sin));
    assert_eq!(has("cube", &[[x, 0.0, z], [x, 0.8, z]]).len(), 8);
}

#[test]
fn warnings_have_line_and_column() {
    let text = "# Dubious.\n[[object]]\nname = \"ball\"\nshape.sphere = { center = [0, 0, 0], radius = 1 }\n\n\
                [[light]]\nname = \"lamp\"\npoint.position = [0, 5, 0]\nintensity = 0\n\n\
                [[light]]\npoint.position = [0, 5, 0]\nintensity = 0\n\n\
                [materials.rough]\nalpha = 0.3\n";
    let document = Document::parse(text.to_string(), "dubious.toml").unwrap();
    let warnings: Vec<_> = document.warnings.iter().map(|w| w.to_string()).collect();
    assert_eq!(warnings.len(), 2, "{warnings:?}");
    assert!(warnings[0].starts_with(
        "dubious.toml:9:13  light \"lamp\": intensity is 0, so that it gives no light (and one more like it)."
    ));
    assert!(warnings[1].starts_with("dubious.toml:16:9  material \"rough\": alpha has no effect"));
}

#[test]
fn unreadable_scene_files_are_reported() {
    let missing = Scene::read("scenes/no-such.toml".as_ref()).unwrap_err().to_string();
    assert!(missing.starts_with("scenes/no-such.toml  there is no such file."), "{missing}");
    let scene = |text: &str| Scene::parse(text, "s.toml");
    let many: String = (0..50).map(|i| format!("key{i} = 0\n")).collect();
    let many = scene(&many).unwrap_err();
    assert_eq!(many.messages.len(), 50);
    assert!(many.to_string().ends_with("… and 30 more."), "{many}");
    // A byte order mark and Windows line ends are valid and do not count as columns.
    let marked = "\u{feff}[[object]]\r\nshape.sphere = { center = [0, 0, 0], radius = 1 }\r\n";
    assert!(scene(marked).is_ok());
    let error = scene(&marked.replace("[[object]]", "wrong = 1")).unwrap_err();
    assert_eq!(error.messages[0].line_column, Some((1, 1)));
    // Without a material, a camera and a light, the defaults apply.
    let bare = scene(marked).unwrap();
    assert_eq!(bare.objects[0].material, "");
    assert_eq!(bare.faults(), []);
}

#[cfg(unix)]
#[test]
fn endless_device_is_read_up_to_the_size_limit() {
    let error = Scene::read("/dev/zero".as_ref()).unwrap_err().to_string();
    assert!(error.contains("larger than 256 MiB"), "{error}");
}

#[test]
fn reflecting_tracks_follow_their_formula() {
    for file in
        ["scenes/features/reflecting-tracks.toml", "scenes/features/reflecting-tracks-lit.toml"]
    {
        let scene = Scene::read(file.as_ref()).unwrap();
        assert_eq!(scene.objects.len(), 401);
        let mirror = &scene.materials[&scene.objects[0].material];
        assert_eq!(scene.objects[0].shape.form(), ball([20.0, 0.0, -40.0], 15.0));
        assert_eq!((mirror.color.0, mirror.reflection), ([0.6, 0.6, 0.4], 1.0));
        assert_eq!((mirror.transmission, mirror.ior), (0.2, 1.4286));
        for (n, object) in scene.objects[1..].iter().enumerate() {
            let (i, j) = ((n / 10) as f64, (n % 10) as f64);
            let center = [i - 9.0, 7.0 - 5.0 * i.sqrt(), 6.0 - j * j];
            assert_eq!(object.shape.form(), ball(center, 0.8), "{i} {j}");
            let m = &scene.materials[&object.material];
            let color = [0.02 * i * j, 0.7, 0.01 * i * j];
            assert!(m.color.0.iter().zip(color).all(|(a, b)| (a - b).abs() < 1e-9), "{i} {j}");
            assert_eq!((m.diffuse, m.specular, m.exponent, m.reflection), (0.4, 0.4, 10.0, 0.0));
        }
        assert_eq!(scene.film.size, [640, 480]);
        assert_eq!((scene.camera.eye, scene.camera.target), ([5.0, 0.0, 40.0], Some([0.0; 3])));
        assert_eq!(scene.lights.iter().filter(|l| l.kind.key() == "point").count(), 2);
    }
}

fn ball(center: [f64; 3], radius: f64) -> Form {
    Form::Sphere(SphereForm { center: center.into(), radius })
}
