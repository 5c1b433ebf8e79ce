//! Stories of compounds: their parts as a tree, and compounds made of objects.

use super::*;
use zerkalo_scene::shape::Shape;

/// Text of a goblet whose bowl is a part with parts.
pub const GOBLET: &str = r#"
# A goblet.
[[object]]
name = "goblet"
material = "mirror"
shape.union.of = [
    # The foot.
    { shape.cylinder = { base = [0.0, 0.0, 0.0], top = [0.0, 0.1, 0.0], radius = 0.3 } }, # flat
    { material = "red", shape.difference.of = [
        { shape.sphere = { center = [0.0, 0.5, 0.0], radius = 0.4 } },
        { shape.sphere = { center = [0.0, 0.7, 0.0], radius = 0.4 } }, # hollow
    ] },
]
transform = [{ translate = [0.6, 0.0, 1.0] }]

[[object]]
name = "die"
material = "red"
shape.box = { center = [-1.2, 0.5, 1.0], size = [1.0, 1.0, 1.0] }
"#;

const FOOT: &str = "top = [0.0, 0.1, 0.0], radius = 0.3";

fn desk() -> (Desk, String) {
    let text = ROOM.to_string() + GOBLET;
    let mut desk = Desk::new(&text);
    desk.keys("/ `goblet` Enter Tab Right");
    assert_eq!(desk.model.selection, Target::Object(3));
    (desk, text)
}

fn part(path: &[usize]) -> Target {
    Target::Part(3, path.to_vec())
}

/// Returns the names in the outline with two spaces for each level.
fn tree(desk: &Desk) -> Vec<String> {
    let lines = desk.model.outline_lines();
    let entries = lines.iter().filter_map(|line| line.entry());
    entries.map(|entry| "  ".repeat(entry.depth) + &entry.label).collect()
}

#[test]
fn parts_are_lines_below_their_compound() {
    let (mut desk, _) = desk();
    let has = |desk: &Desk, name: &str| tree(desk).iter().any(|line| line == name);
    assert!(has(&desk, "  cylinder 1") && has(&desk, "  difference 2"));
    assert!(!has(&desk, "    sphere 2"));
    desk.keys("Down Down Right Down Down");
    assert_eq!(desk.model.selection, part(&[1, 1]));
    assert!(has(&desk, "    sphere 2"));
    desk.keys("Left");
    assert_eq!(desk.model.selection, part(&[1]));
    desk.keys("Left Left Left");
    assert_eq!(
        (desk.model.selection.clone(), has(&desk, "  cylinder 1")),
        (Target::Object(3), false)
    );
    // A part that is found elsewhere is listed, too.
    desk.keys("/ `sphere 2 of diff` Down Enter");
    assert!(desk.model.selection == part(&[1, 1]) && has(&desk, "    sphere 2"));
}

#[test]
fn edits_of_parts_keep_comments() {
    let wider = |radius: &str| FOOT.replace("0.3", radius);
    for (keys, old, new) in [
        ("Down Enter / `rad` Enter `0.5` Enter", FOOT, wider("0.5").as_str()),
        (
            "Down Enter / `mat` Enter Enter `red` Enter",
            "radius = 0.3 } }, # flat",
            "radius = 0.3 } , material = \"red\" }, # flat",
        ),
        (
            "Down Down Right Down m `x.5` Enter",
            "[0.0, 0.5, 0.0], radius",
            "[0.5, 0.5, 0.0], radius",
        ),
        (
            "Down Down S `copper` Enter",
            "material = \"red\", shape.diff",
            "material = \"copper\", shape.diff",
        ),
    ] {
        let (mut desk, text) = desk();
        desk.keys(keys);
        let edited = desk.text();
        assert!(
            edited.contains(&text.replace(old, new)[text.find("# A goblet").unwrap()..]),
            "{keys}: {edited}"
        );
        desk.keys("Esc Esc u");
        assert_eq!(desk.text(), text, "{keys}");
    }
}

#[test]
fn parts_are_added_duplicated_and_deleted() {
    for (keys, parts, comment) in [
        ("Alt-a `cone` Enter Enter", 3, true),
        ("Down Alt-a `cone` Enter Enter", 3, true),
        ("Down D Right Esc", 3, true),
        ("Down Down Right Down D Esc", 2, true),
        ("Down x", 0, false),
        ("B", 0, false),
        ("Down Down B", 3, true),
    ] {
        let (mut desk, text) = desk();
        desk.keys(keys);
        let shape = &desk.scene().objects[3].shape;
        let count = match shape {
            Shape::Union(union) => union.of.len(),
            _ => 0,
        };
        assert_eq!(count, parts, "{keys}: {}", desk.notice());
        assert_eq!(desk.text().contains("# flat"), comment, "{keys}: {}", desk.text());
        assert_eq!(
            Scene::parse(&desk.text(), FILE).unwrap(),
            **desk.model.history.scene(),
            "{keys}"
        );
        desk.undo_all();
        assert_eq!(desk.text(), text, "{keys}");
    }
    let (mut desk, _) = desk();
    desk.keys("Down e `base` Enter");
    assert!(desk.text().contains("name = \"base\""), "{}", desk.text());
    desk.keys("x");
    let goblet = &desk.scene().objects[3];
    assert_eq!(
        (goblet.shape.key(), goblet.material.as_str(), goblet.name.as_str()),
        ("difference", "red", "goblet")
    );
    for (keys, reason) in [
        ("Down Enter Up Enter `rectangle` Enter", "flat"),
        ("Home e", "no name"),
        ("Home Alt-a", "no compound"),
        ("Home B", "no compound"),
    ] {
        let (mut desk, text) = self::desk();
        desk.keys(keys);
        assert!(desk.notice().contains(reason), "{keys}: {}", desk.notice());
        assert_eq!(desk.text(), text, "{keys}");
    }
}

#[test]
fn marked_objects_become_a_compound() {
    for (key, kind) in [("|", "union"), ("&", "intersection"), ("_", "difference")] {
        let (mut desk, text) = desk();
        desk.keys("/ `die` Enter V / `ball` Enter V").keys(key);
        let scene = desk.scene();
        assert_eq!(
            (scene.objects.len(), scene.objects[3].name.as_str()),
            (4, "die"),
            "{}",
            desk.notice()
        );
        let whole = &scene.objects[3];
        assert_eq!((whole.shape.key(), whole.material.as_str()), (kind, "red"));
        let kinds: Vec<_> =
            whole.shape.parts().unwrap().iter().map(|part| part.shape.key()).collect();
        assert_eq!(
            (kinds, desk.model.selection.clone()),
            (vec!["box", "sphere"], Target::Object(3))
        );
        desk.keys("B");
        assert_eq!(desk.scene().objects.len(), 5);
        desk.undo_all();
        assert_eq!(desk.text(), text);
    }
    let (mut desk, text) = desk();
    desk.keys("V / `object glass` Enter V |");
    assert!(desk.notice().contains("glass: a rectangle is flat"), "{}", desk.notice());
    desk.keys("Esc / `die` Enter |");
    assert!(desk.notice().contains("V marks several"), "{}", desk.notice());
    assert_eq!(desk.text(), text);
}

#[test]
fn second_click_selects_the_part() {
    let (mut desk, text) = desk();
    desk.keys("Esc");
    let layout = desk.model.layout().unwrap();
    let at = |point: [f64; 3]| {
        let scene = desk.scene();
        let camera = zerkalo_scene::camera::CompiledCamera::new(
            &scene.camera,
            scene.film.size,
            glam::DVec3::ZERO,
        );
        layout.cell_of(camera.project(glam::DVec3::from(point))).unwrap()
    };
    let [x, y] = at([0.6, 0.06, 1.29]);
    desk.keys("Esc l").click(x, y);
    assert_eq!(desk.model.selection, Target::Object(3));
    desk.click(x, y);
    assert_eq!(desk.model.selection, part(&[0]), "the foot");
    desk.drag(Button::Left, [x, y], [3, 0]);
    let Shape::Union(union) = &desk.scene().objects[3].shape else { panic!() };
    let Shape::Cylinder(foot) = &union.of[0].shape else { panic!() };
    assert!(foot.base[0] > 0.05 && foot.top[0] == foot.base[0], "{foot:?}");
    desk.keys("u");
    assert_eq!(desk.text(), text);
    desk.click(x, y);
    assert_eq!(desk.model.selection, Target::Object(3), "the same part again: the whole");
}

#[test]
fn goblet_story_takes_at_most_45_keys() {
    let text = include_str!("../../scenes/features/goblet.toml");
    let mut desk = Desk::new(text);
    let objects = desk.scene().objects.len();
    let keys =
        "/ `foot` Enter Alt-s `1.3` Enter Esc S `cop` Enter m Right Right D Right / `bell` Enter x";
    desk.keys(keys);
    assert_eq!(desk.scene().objects.len(), objects, "one more, one less");
    let goblet = desk.scene().objects.iter().find(|o| o.name == "goblet").unwrap();
    // The scene has a copper of its own.
    assert_eq!(goblet.material, "copper 2");
    assert_eq!(goblet.shape.parts().unwrap()[0].transform.len(), 1);
    assert!(!desk.text().contains("\"bell\"") && desk.text().contains("\"goblet 2\""));
    let undo = "u u u u u u";
    desk.keys(undo);
    assert_eq!(desk.text(), text);
    assert!(super::beginning::count(keys) + super::beginning::count(undo) <= 45);
}
