//! Limits of bumps and textures, textures without effect, rejected files.

use crate::harness::*;
use png::{BitDepth, ColorType};
use std::sync::atomic::AtomicUsize;
use zerkalo_scene::SceneFile;
use zerkalo_scene::asset::LoadProgress;
use zerkalo_scene::edit::{Widget, rows, set, step, toggle};

fn shown(scene: &Scene, precision: Precision) -> Vec<[f64; 3]> {
    picture(&rendered(scene, 1, precision, 4), Replicates::Both)
}

#[test]
fn bump_without_height_changes_no_bit() {
    let bumpy = sized(shipped("bump.toml"), [64, 48]);
    let with_height = |factor: f64| {
        let mut scene = bumpy.clone();
        for material in scene.materials.values_mut() {
            if let Some(zerkalo_scene::material::Bump::Image(image)) = &mut material.bump {
                image.height *= factor;
            }
        }
        scene
    };
    let mut flat = bumpy.clone();
    flat.materials.values_mut().for_each(|material| material.bump = None);
    for precision in [Precision::Single, Precision::Double] {
        assert!(shown(&with_height(0.0), precision) == shown(&flat, precision));
        assert!(shown(&with_height(1.0), precision) != shown(&flat, precision));
    }
}

#[test]
fn ramp_tilts_normals_by_its_slope() {
    let folder = tempfile::tempdir().unwrap();
    // Heights from 0 to 1 over 64 pixels, in 16 bits.
    let row = (0..64u32).flat_map(|x| (((x * 65535 + 31) / 63) as u16).to_be_bytes());
    let ramp = PngImage {
        width: 64,
        height: 2,
        color: ColorType::Grayscale,
        depth: BitDepth::Sixteen,
        levels: row.clone().chain(row).collect(),
    };
    ramp.save(&folder.path().join("ramp.png"));
    let (height, width) = (0.7, 2.0);
    // The ramp rises from the centre of the first pixel to that of the last.
    let slope: f64 = height / (width * 63.0 / 64.0);
    let leaning = DVec3::new(-slope, 0.0, 1.0).normalize();
    let towards = |light: DVec3| {
        let text = format!(
            "[film]\nsize = [16, 16]\nfilter = \"point\"\n[trace]\nray_types = \"primary\"\n\
             [camera]\neye = [0, 0, 3]\ntarget = [0, 0, 0]\nview_angle.vertical = 20\n\
             [[light]]\ndirectional = {{ direction = {:?} }}\nfalloff = \"none\"\nintensity = 1\n\
             [materials.m]\ncolor = [1, 1, 1]\n\
             bump.image = {{ file = \"ramp.png\", height = {height}, mapping = \"uv\", wrap = \"clamp\" }}\n\
             [[object]]\nmaterial = \"m\"\n\
             shape.rectangle = {{ center = [0, 0, 0], size = [{width}, 2], normal = [0, 0, 1] }}\n",
            (-light).to_array()
        );
        let name = folder.path().join("s.toml");
        let scene = Scene::parse(&text, name.to_str().unwrap()).unwrap();
        picture(&rendered(&scene, 1, Precision::Double, 1), Replicates::Both)
    };
    for light in [leaning, DVec3::Z, DVec3::new(0.3, 0.5, 0.8).normalize()] {
        let expected = light.dot(leaning);
        for pixel in towards(light) {
            // The tolerance allows for the rounding of the heights to 16 bits.
            assert!((pixel[0] - expected).abs() < 1e-3, "{pixel:?} {expected}");
        }
        assert!((expected - light.z).abs() > 0.02, "a flat one would show {}", light.z);
    }
    // Light from behind the surface, but in front of the tilted normal, does not reach it.
    let behind = DVec3::new(-0.9, 0.0, -0.1).normalize();
    assert!(behind.dot(leaning) > 0.1);
    assert!(towards(behind).iter().all(|pixel| pixel[0] == 0.0));
}

fn inventory(scene: &Scene) -> String {
    AnyWorld::compile(scene, &Options::default()).info().inventory.clone()
}

#[test]
fn textures_without_effect_are_not_compiled() {
    let scene = |material: &str| {
        let object =
            "[[object]]\nmaterial = \"m\"\nshape.sphere = { center = [0, 0, 0], radius = 1 }";
        Scene::parse(
            &format!("[materials.m]\n{material}\n{object}"),
            concat!(env!("ZERKALO_ROOT"), "scenes/none.toml"),
        )
        .unwrap()
    };
    let plain = inventory(&scene(""));
    for nothing in [
        "texture.image = {}",
        "bump.image = {}",
        "bump.image = { file = \"textures/wood.png\", height = 0 }",
    ] {
        assert_eq!(inventory(&scene(nothing)), plain, "{nothing}");
    }
    for (something, word) in [
        ("texture.image = { file = \"textures/wood.png\" }", "image texture"),
        ("texture.checker = {}", "checker"),
        ("bump.image = { file = \"textures/wood.png\" }", "bump"),
    ] {
        assert!(inventory(&scene(something)).contains(word), "{something}");
    }
}

#[test]
fn texture_edits_read_each_file_once() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["a.png", "b.png"] {
        RgbImage::from_fn(3, 2, |_, _| [9, 99, 199]).save(&folder.path().join(name));
    }
    let path = folder.path().join("scene.toml");
    let text = "# A ball.\n[materials.m]\ncolor = [1, 1, 1] # white\n\n\
                [[object]]\nmaterial = \"m\"\nshape.sphere = { center = [0, 0, 0], radius = 1 }\n";
    fs::write(&path, text).unwrap();
    let reads = Arc::new(AtomicUsize::new(0));
    let counter = reads.clone();
    let assets = Arc::new(Assets::new(move |stage| {
        if matches!(stage, LoadProgress::Reading { .. }) {
            counter.fetch_add(1, Ordering::SeqCst);
        }
    }));
    let mut file = SceneFile::open_with(&path, assets).unwrap();
    let mut scene = file.document.scene().clone();
    let m = Target::Material("m".into());
    let row =
        |scene: &Scene, key: &str| rows(scene, &m).unwrap().into_iter().find(|row| row.key == key);
    let texture = row(&scene, "texture").unwrap();
    assert_eq!(
        (texture.widget, texture.value.as_str(), texture.is_default),
        (Widget::Kind, "", true)
    );
    assert!(row(&scene, "texture.image.file").is_none());
    for (key, text) in [
        ("texture", "image"),
        ("texture.image.file", "a.png"),
        ("texture.image.scale", "4 2"),
        ("texture.image.mapping", "planar"),
        ("bump", "image"),
        ("bump.image.file", "b.png"),
        ("bump.image.height", "0.1"),
    ] {
        scene = set(&scene, &m, key, text).unwrap_or_else(|e| panic!("{key}: {e}")).scene;
    }
    assert_eq!(reads.load(Ordering::SeqCst), 2);
    let missing = set(&scene, &m, "texture.image.file", "c.png").unwrap_err().to_string();
    assert!(missing.contains("no such file"), "{missing}");
    let uv = set(&scene, &m, "bump.image.mapping", "uv").unwrap_err().to_string();
    assert!(uv.contains("texture coordinates") && uv.contains("auto"), "{uv}");
    scene = step(&scene, &m, "texture.image.offset", Some(0), 1.0).unwrap().scene;
    assert_eq!(row(&scene, "texture.image.offset").unwrap().value, "0.05, 0");
    scene = step(&scene, &m, "texture.image.scale", Some(1), -1.0).unwrap().scene;
    scene = step(&scene, &m, "bump.image.height", None, -1.0).unwrap().scene;
    assert_eq!(row(&scene, "bump.image.height").unwrap().value, "0.095");

    // If the kind of the texture changes, its placement stays the same. The cycle of kinds also
    // contains `none`.
    let checker = toggle(&scene, &m, "texture", true).unwrap().scene;
    assert_eq!(row(&checker, "texture.checker.mapping").unwrap().value, "planar");
    let none = toggle(&checker, &m, "texture", true).unwrap().scene;
    assert!(none.materials["m"].texture.is_none());
    assert!(toggle(&none, &m, "texture", true).unwrap().scene.materials["m"].texture.is_some());
    assert!(set(&scene, &m, "bump", "").unwrap().scene.materials["m"].bump.is_none());

    let mut document: Document = file.document.clone();
    document.apply(&scene);
    let written = document.text();
    assert!(written.starts_with("# A ball.\n") && written.contains("# white"), "{written}");
    assert!(
        written.contains(
            "texture.image = { file = \"a.png\", mapping = \"planar\", scale = [4.0, 1.6], offset = [0.05, 0.0] }"
        ),
        "{written}"
    );
    let again = Scene::parse(written, path.to_str().unwrap()).unwrap();
    assert_eq!(again, scene);
    let before = reads.load(Ordering::SeqCst);
    let moved = set(&scene, &m, "color", "0.5 0.5 0.5").unwrap().scene;
    assert!(shown(&sized(moved, [8, 8]), Precision::Auto).len() == 64);
    assert_eq!(reads.load(Ordering::SeqCst), before);

    // The other folder does not contain the image files.
    let elsewhere = tempfile::tempdir().unwrap();
    let refused = file.save_as(&elsewhere.path().join("s.toml"), &scene, false).unwrap_err();
    assert!(refused.to_string().contains("a.png"), "{refused}");
}

/// Checks a flat face that lies exactly in the boundary between two checker fields or two pixels of
/// the texture. It must have one colour, which is the same in both precisions.
#[test]
fn faces_in_edges_of_a_texture_have_one_color() {
    let checker =
        |keys: &str| format!("texture.checker = {{ even = [1, 0, 0], odd = [0, 1, 0], {keys} }}");
    let lid = "box = { center = [0, -0.25, 0], size = [8, 0.5, 8] }";
    let middle: &[DVec3] = &[DVec3::ZERO];
    let aside = &[DVec3::X, DVec3::NEG_X, DVec3::Z, DVec3::NEG_Z].map(|axis| 0.6 * axis);
    let cases = [
        // The lid of a box is exactly one checker square above the bottom, in the boundary of two
        // squares.
        (lid, checker("mapping = \"planar\", scale = [0.01, 1.0]"), middle),
        (
            "cylinder = { base = [0, -0.3, 0], top = [0, 0, 0], radius = 4 }",
            checker("mapping = \"planar\", scale = [0.01, 5.0]"),
            middle,
        ),
        // The plane contains the equator of the spherical mapping, or the seam of its angle.
        (
            "plane = { point = [0.2, 0, 0.1], normal = [0, 1, 0] }",
            checker(
                "mapping = \"spherical\", axis = \"z\", scale = [0.1, 1.0], offset = [0.2, 0.0]",
            ),
            middle,
        ),
        (
            "rectangle = { center = [0, 0, 0], size = [3, 3], normal = [0, 1, 0], up = [0, 0, -1] }",
            checker(
                "mapping = \"spherical\", axis = \"x\", scale = [0.5, 0.1], offset = [0.0, 0.2]",
            ),
            aside,
        ),
        (
            lid,
            "texture.image = { file = \"rows.png\", mapping = \"planar\", scale = [1.0, 2.0], \
             filter = \"nearest\" }"
                .to_string(),
            middle,
        ),
    ];
    let folder = tempfile::tempdir().unwrap();
    let rows = RgbImage::from_fn(1, 2, |_, y| [255 * y as u8, 255 - 255 * y as u8, 0]);
    rows.save(&folder.path().join("rows.png"));
    let views = cases.iter().flat_map(|(shape, texture, views)| {
        views.iter().map(move |target| (*shape, texture, *target))
    });
    for (shape, texture, target) in views {
        for (turn, shift) in [(0.0, 0.0), (37.0, 0.0), (0.0, 100.1), (52.0, -3000.7)] {
            let transform = format!(
                "[{{ rotate = {{ axis = [1, 0.3, -0.4], degrees = {turn:?} }} }}, \
                 {{ translate = [{shift:?}, 0.3, {shift:?}] }}]"
            );
            let rotation = glam::DQuat::from_axis_angle(
                DVec3::new(1.0, 0.3, -0.4).normalize(),
                f64::to_radians(turn),
            );
            let placed = |p: DVec3| (rotation * p + DVec3::new(shift, 0.3, shift)).to_array();
            let text = format!(
                "film.size = [16, 16]\nambient.color = [1, 1, 1]\n[camera]\neye = {:?}\ntarget = {:?}\n\
                 up = [0.3, 0.2, 0.9]\nview_angle.vertical = 12\n[materials.m]\n{texture}\n\
                 [[object]]\nmaterial = \"m\"\nshape.{shape}\ntransform = {transform}\n",
                placed(target + DVec3::new(0.0, 4.0, 0.3)),
                placed(target),
            );
            let path = folder.path().join("scene.toml");
            fs::write(&path, &text).unwrap();
            let scene = Scene::read(&path).unwrap_or_else(|e| panic!("{e}\n{text}"));
            let [single, double] = [Precision::Single, Precision::Double].map(|p| shown(&scene, p));
            for (precision, picture) in [("single", &single), ("double", &double)] {
                let differ = picture.iter().filter(|color| color != &&picture[0]).count();
                assert_eq!(differ, 0, "{precision}: pixels of another colour in\n{text}");
            }
            let difference = (DVec3::from(single[0]) - DVec3::from(double[0])).abs().max_element();
            assert!(difference < 1e-6, "single {:?}, double {:?} in\n{text}", single[0], double[0]);
        }
    }
}
