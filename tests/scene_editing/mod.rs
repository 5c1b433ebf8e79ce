//! Edits written to scene files: only changed values may be written, and the text must read back as
//! the scene.

mod large;
mod layouts;
mod navigation;
mod operations;
mod random;

use crate::harness::*;
use layouts::LAYOUTS;
use proptest::prelude::*;
use zerkalo_scene::edit::{rename, store_view};
use zerkalo_scene::shape::{Plane, Sphere};

fn document(text: &str) -> Document {
    Document::parse(text.to_string(), "scene.toml").unwrap_or_else(|e| panic!("{e}\n{text}"))
}

fn edited(text: &str, edit: impl FnOnce(&mut Scene)) -> String {
    let mut document = document(text);
    let mut scene = document.scene().clone();
    edit(&mut scene);
    document.apply(&scene);
    let again = self::document(document.text());
    assert_eq!(again.scene(), &scene, "{}", document.text());
    document.text().to_string()
}

/// Returns two lists: the lines of `b` that are missing in `a`, and the lines of `a` that are
/// missing in `b`.
fn difference<'a>(a: &'a str, b: &'a str) -> (Vec<&'a str>, Vec<&'a str>) {
    let missing = |from: &'a str, other: &str| {
        let mut others: Vec<&str> = other.lines().collect();
        let is_missing = |line: &&str| match others.iter().position(|o| o == line) {
            Some(at) => {
                others.remove(at);
                false
            }
            None => true,
        };
        from.lines().filter(is_missing).collect::<Vec<_>>()
    };
    (missing(b, a), missing(a, b))
}

#[test]
fn layouts_describe_the_same_scene() {
    let first = document(LAYOUTS[0]).scene().clone();
    for text in &LAYOUTS[1..] {
        assert_eq!(document(text).scene(), &first);
    }
}

#[test]
fn unedited_scene_keeps_its_text() {
    for text in LAYOUTS {
        assert_eq!(edited(text, |_| {}), *text);
        // An edit followed by its reversal restores the text, too.
        let mut document = document(text);
        let origin = document.scene().clone();
        document.apply(&Scene { objects: Vec::new(), ..origin.clone() });
        assert_ne!(document.text(), *text);
        document.apply(&origin);
        assert_eq!(document.text(), *text);
    }
}

#[test]
fn edited_number_changes_no_other_text() {
    let text = LAYOUTS[0];
    let after = edited(text, |s| s.camera.target = Some([0.0, 0.25, 0.0]));
    assert_eq!(
        after,
        text.replace("target = [0.0, 0.0, 0.0] # the", "target = [0.0, 0.25, 0.0] # the")
    );
    let after = edited(text, |s| match &mut s.objects[0].shape {
        Shape::Sphere(sphere) => sphere.radius = 0.75,
        other => panic!("{other:?}"),
    });
    assert_eq!(after, text.replace("radius = 0.5 } # half", "radius = 0.75 } # half"));
    let after = edited(text, |s| s.lights[0].intensity = 0.5);
    let expected = "point = { position = [2.0, 4.0, 3.0] }\nintensity = 0.5\n";
    assert_eq!(after, text.replace("point = { position = [2.0, 4.0, 3.0] }\n", expected));
    let headers = LAYOUTS[1];
    let after = edited(headers, |s| match &mut s.objects[0].shape {
        Shape::Sphere(sphere) => sphere.center[1] = 1e-7,
        other => panic!("{other:?}"),
    });
    assert_eq!(after, headers.replace("  0.5, # y", "  1e-7, # y"));
}

#[test]
fn edited_colours_keep_their_notation() {
    let red = |color| edited(LAYOUTS[0], |s| s.materials.get_mut("red").unwrap().color = color);
    let after = red(Color::from_hex("#80ff00").unwrap());
    assert_eq!(after, LAYOUTS[0].replace("\"#ff0000\" # pure", "\"#80ff00\" # pure"));
    let after = red(Color([0.5, 0.25, 0.0]));
    assert_eq!(after, LAYOUTS[0].replace("\"#ff0000\" # pure", "[0.5, 0.25, 0.0] # pure"));
}

#[test]
fn removed_objects_take_their_comments_and_leave_file_comments() {
    let text = LAYOUTS[0];
    let after = edited(text, |s| drop(s.objects.remove(0)));
    let (new, gone) = difference(text, &after);
    assert_eq!(new, [] as [&str; 0], "{after}");
    for line in ["# A ball.", "name = \"ball\" # round"] {
        assert!(gone.contains(&line), "{gone:?}");
    }
    assert!(after.contains("# --- objects ---\n\n# A cube,\n# turned.\n[[object]]"), "{after}");
    let ball = "# Shows a ball.\n\n# The ball.\n[[object]]\n\
                shape.sphere = { center = [0, 0, 0], radius = 1 }\n";
    // The comment at the start of the file stays even if the table below it is removed.
    let after = edited(&format!("{ball}\n[film]\nsize = [20, 20]\n"), |s| {
        s.objects.clear();
    });
    assert_eq!(after, "# Shows a ball.\n\n[film]\nsize = [20, 20]\n");
    let after = edited(ball, |s| {
        s.objects.clear();
    });
    assert!(after.contains("# Shows a ball.") && !after.contains("# The ball."), "{after}");
}

#[test]
fn added_objects_come_last_in_reference_style() {
    let ball = Object {
        name: "new".into(),
        material: "red".into(),
        shape: Shape::Sphere(Sphere { center: [1.0, 2.0, 3.0], radius: 0.25 }),
        transform: vec![TransformOp::RotateY(10.0), TransformOp::Scale(Scale([1.0, 2.0, 1.0]))],
    };
    let written = "\n[[object]]\nname = \"new\"\nmaterial = \"red\"\n\
        shape.sphere = { center = [1.0, 2.0, 3.0], radius = 0.25 }\n\
        transform = [{ rotate_y = 10.0 }, { scale = [1.0, 2.0, 1.0] }]\n";
    let after = edited(LAYOUTS[0], |s| s.objects.push(ball.clone()));
    let end = "\n# The end.\n";
    assert_eq!(after, LAYOUTS[0].strip_suffix(end).unwrap().to_string() + written + end);
    let after = edited(LAYOUTS[1], |s| s.objects.push(ball.clone()));
    assert_eq!(after, LAYOUTS[1].to_string() + "\n" + written.trim_end());
    let after = edited(LAYOUTS[2], |s| s.objects.push(ball.clone()));
    let (new, gone) = difference(LAYOUTS[2], &after);
    assert_eq!((new.len(), gone.len()), (1, 0), "{after}");
}

#[test]
fn replaced_kinds_and_keys_keep_comments() {
    let after = edited(LAYOUTS[0], |s| {
        s.objects[0].shape = Shape::Plane(Plane { point: [0.0; 3], normal: [0.0, 1.0, 0.0] });
        s.camera.target = None;
        s.camera.direction = Some([0.0, 0.0, -1.0]);
        s.camera.view_angle = ViewAngle::Horizontal(50.0);
    });
    for line in [
        "shape.plane = { point = [0.0, 0.0, 0.0], normal = [0.0, 1.0, 0.0] } # half",
        "# looks here\ndirection = [0.0, 0.0, -1.0] # the middle",
        "view_angle.horizontal = 50.0",
    ] {
        assert!(after.contains(line), "{line}\n{after}");
    }
}

#[test]
fn renamed_materials_and_cameras_keep_comments_and_order() {
    let text = LAYOUTS[0].replace("color = \"#ff0000\" # pure", "# Of fire.\ncolor = \"#ff0000\"");
    let text = text.replace("[materials.red]", "# Red.\n[materials.red] # bright");
    let after = edited(&text, |s| {
        *s = rename(s, &Target::Material("red".into()), "fire red").unwrap().scene
    });
    let expected = text
        .replace("[materials.red]", "[materials.\"fire red\"]")
        .replace("material = \"red\"", "material = \"fire red\"");
    assert_eq!(after, expected);
    for layout in &LAYOUTS[1..] {
        let red = Target::Material("red".into());
        let after = edited(layout, |s| *s = rename(s, &red, "fire").unwrap().scene);
        for comment in layout.lines().filter_map(|line| line.split_once('#')).map(|(_, c)| c) {
            assert!(after.contains(comment), "{comment}\n{after}");
        }
    }
}

#[test]
fn stored_cameras_are_written_as_tables() {
    let after = edited(LAYOUTS[0], |s| *s = store_view(s, Some("from the left")).unwrap().scene);
    let written = "[cameras.\"from the left\"]\ntarget = [0.0, 0.0, 0.0]\n";
    let (new, gone) = difference(LAYOUTS[0], &after);
    assert!(after.contains(written), "{after}");
    assert_eq!(gone, [] as [&str; 0], "{new:?}");
    let named = after.replace("[cameras.", "# Where the window is.\n[cameras.");
    let back = edited(&named, |s| s.cameras.clear());
    assert!(!back.contains("cameras") && !back.contains("window"), "{back}");
    let moved = edited(&named, |s| s.cameras.get_mut("from the left").unwrap().eye[0] = 2.0);
    assert!(moved.contains("# Where the window is.\n[cameras"), "{moved}");
    assert!(moved.contains("eye = [2.0, 1.0, 5.0]"), "{moved}");
    for (broken, words) in [
        ("[cameras.x]\neye = [0, 1, 5]\n", "camera \"x\": neither target nor direction is given"),
        ("[cameras.x]\ntarget = [0, 0, 0]\nfov = 3\n", "camera \"x\": unknown key \"fov\""),
        ("cameras = 3\n", "tables that begin with [cameras.NAME]"),
    ] {
        let errors = Scene::parse(broken, "scene.toml").unwrap_err().to_string();
        assert!(errors.contains(words), "{errors}");
    }
}

#[test]
fn reordered_objects_keep_comments() {
    for text in LAYOUTS {
        let after = edited(text, |s| s.objects.rotate_left(1));
        let (new, gone) = difference(text.trim_end(), after.trim_end());
        let blank = |lines: &[&str]| lines.iter().all(|l| l.trim().is_empty());
        assert!(blank(&new) && blank(&gone) || *text == LAYOUTS[2], "{new:?} {gone:?}\n{after}");
    }
}

#[test]
fn line_ends_and_byte_order_mark_stay() {
    let dos = LAYOUTS[0].replace('\n', "\r\n");
    let after = edited(&dos, |s| s.film.size = [64, 48]);
    assert_eq!(after, dos.replace("[320, 240]", "[64, 48]"));
    let marked = format!("\u{feff}{}", LAYOUTS[1]);
    let after = edited(&marked, |s| s.objects[0].name = "bowl".into());
    assert_eq!(after, marked.replace("\"ball\"", "\"bowl\""));
}

#[test]
fn empty_scene_is_written() {
    let text = Scene::default().to_text();
    assert_eq!(text, "[film]\nsize = [640, 480]\n");
    assert_eq!(document(&text).scene(), &Scene::default());
    let after = edited("film.size = [640, 480]\n", |s| s.trace.max_depth = 3);
    assert_eq!(after, "film.size = [640, 480]\n\n[trace]\nmax_depth = 3\n");
}

proptest! {
    #[test]
    fn random_scenes_survive_writing_and_reading(scene in random::scene()) {
        prop_assert_eq!(scene.faults(), []);
        let text = scene.to_text();
        let again = Scene::parse(&text, "scene.toml");
        prop_assert!(again.is_ok(), "{}\n{text}", again.unwrap_err());
        prop_assert_eq!(again.unwrap(), scene, "{}", text);
    }

    #[test]
    fn any_edit_can_be_written_and_read(
        layout in 0..4usize,
        others in proptest::collection::vec(random::scene(), 2),
        edits in proptest::collection::vec((0..18u8, 0..7usize), 1..8),
    ) {
        let text = match LAYOUTS.get(layout) {
            Some(text) => text.to_string(),
            None => others[1].to_text(),
        };
        let mut document = document(&text);
        let mut scene = document.scene().clone();
        for step in edits {
            random::edit(&mut scene, &others[0], step);
            scene = random::tidy(scene);
            document.apply(&scene);
            let again = Scene::parse(document.text(), "scene.toml");
            prop_assert!(again.is_ok(), "{}\n{}", again.unwrap_err(), document.text());
            prop_assert_eq!(&again.unwrap(), &scene, "{}", document.text());
        }
    }

    #[test]
    fn no_text_makes_the_reader_panic(
        text in "\\PC{0,80}",
        cut in 0..2000usize,
        at in 0..2000usize,
    ) {
        let _ = Scene::parse(&text, "scene.toml");
        for layout in LAYOUTS {
            let start = |n| layout.chars().take(n);
            let inserted = start(at).chain(text.chars()).chain(layout.chars().skip(at));
            for broken in [start(cut).collect::<String>(), inserted.collect()] {
                let _ = Scene::parse(&broken, "scene.toml").map_err(|e| e.to_string());
            }
        }
    }
}
