//! Stories of stray keys: in no widget does text that is typed run a command.

use super::*;
use zerkalo::dashboard::model::Mode;
use zerkalo_scene::material::Preset;

/// Keys that a hand may hit anywhere, and that must change nothing.
const STRAY: [&str; 11] = ["b", ".", "4", ",", "<", ">", "(", ")", "+", "-", "#"];

/// Returns the keys of all commands, except those that confirm, move or leave.
fn commands() -> Vec<&'static str> {
    let names =
        COMMANDS.iter().flat_map(|command| command.keys).flat_map(|(_, keys)| keys.split(' '));
    let moves =
        ["Enter", "Esc", "Tab", "Ctrl-s", "Ctrl-c", "Ctrl-z", "Up", "Down", "PageUp", "PageDown"];
    names
        .filter(|name| !moves.iter().any(|key| name.trim_start_matches("Shift-") == *key))
        .collect()
}

fn unchanged(desk: &mut Desk, place: &str, keys: &[&str]) {
    let before = desk.text();
    for key in keys {
        desk.keys(key);
        assert_eq!(desk.text(), before, "{key} in {place}");
    }
    desk.keys("Esc Esc Esc");
    assert_eq!(desk.text(), before, "{place}");
}

#[test]
fn stray_keys_change_nothing_on_any_row() {
    let room = Desk::new(ROOM);
    let parts = zerkalo_scene::edit::outline(room.scene());
    let mut seen = HashSet::new();
    for (_, target) in parts {
        let mut desk = Desk::new(ROOM);
        desk.select(target.clone());
        desk.keys("Tab");
        unchanged(&mut desk, "the outline", &STRAY);
        for line in 0..usize::MAX {
            let mut desk = Desk::new(ROOM);
            desk.select(target.clone());
            desk.keys("Tab Enter");
            if line >= desk.model.field_lines().len() {
                break;
            }
            // One row of each kind.
            let lines = desk.model.field_lines();
            let field = lines[line].entry();
            if !seen.insert(field.map(|f| format!("{:?} {:?}", f.act, f.property.widget))) {
                continue;
            }
            desk.model.inspector.cursor = line;
            let place = format!("line {line} of {target:?}");
            unchanged(&mut desk, &place, &[&STRAY[..], &["x"]].concat());
            desk.keys("Tab Tab");
            desk.model.inspector.cursor = line;
            desk.keys("w");
            assert_eq!(desk.model.mode, Mode::Fly, "letters are commands on {place}");
        }
    }
}

#[test]
fn no_command_runs_while_text_is_typed() {
    let ball = Target::Object(1);
    for (place, keys) in [
        ("an editor", "Enter / `rad` Enter Enter"),
        ("the editor of a name", "Enter Home `pearl`"),
        ("the filter", "Enter / `rad`"),
        ("a form", "a Enter Down Down"),
        ("an editor in a form", "a Enter `rad` Enter `2`"),
        ("the kinds of objects", "a"),
        ("a picker", "Enter Up Enter"),
        ("the palette", ":"),
        ("a prompt", "e"),
        ("the noise targets", "N"),
        ("a filter in a form", "a Enter `/rad`"),
    ] {
        let mut desk = Desk::new(ROOM);
        desk.select(ball.clone());
        desk.keys(keys);
        unchanged(&mut desk, place, &commands());
    }
}

#[test]
fn groups_of_fields_fold() {
    let mut desk = Desk::new(ROOM);
    desk.select(Target::Object(1));
    let labels = |desk: &Desk| {
        let lines = desk.model.field_lines();
        lines.iter().filter_map(|line| Some(line.entry()?.label.clone())).collect::<Vec<_>>()
    };
    desk.keys("Enter / `rad` Enter Alt-f");
    assert_eq!(labels(&desk)[2..4], ["shape ▸", "transform"], "radius is in the shape");
    desk.keys("/ `rad` Enter");
    assert!(labels(&desk).contains(&"radius".to_string()), "what is found unfolds");
    desk.keys("/ `rough` Enter Alt-f");
    assert!(labels(&desk)[8].starts_with("▸ material red"), "{:?}", labels(&desk));
    desk.keys("Enter Up Up Up Alt-f Alt-f");
    assert!(labels(&desk).contains(&"radius".to_string()));
    let (rows, _) = desk.model.inspector_rows().unwrap();
    let lines = desk.model.field_lines();
    let heading = lines.iter().position(|line| line.entry().is_none()).unwrap();
    desk.click(rows.x + 3, rows.y + (heading - desk.model.inspector.scroll) as u16);
    assert!(!labels(&desk).contains(&"roughness".to_string()));
    assert_eq!(desk.text(), ROOM);
}

/// Returns the names that the list which `key` opens finds for `text`.
fn found_in(key: &str, text: &str) -> Vec<String> {
    let mut desk = Desk::new(ROOM);
    desk.keys(&format!("{key} `{text}`"));
    let Some(Overlay::Pick(pick)) = &desk.model.overlay else { panic!("no list") };
    pick.found.iter().map(|i| pick.entries[*i].name.clone()).collect()
}

/// Returns the names that the palette finds for `text`.
fn found(text: &str) -> Vec<String> {
    found_in(":", text)
}

#[test]
fn parts_that_are_ready_are_found_first() {
    for (text, first) in [
        ("blue", "blue ball"),
        ("matte", "red ball"),
        ("dif", "red ball"),
        ("chrome", "chrome ball"),
        ("cube", "gold cube"),
        ("window", "cool window"),
        ("tap cyl", "tapered cylinder"),
        ("sphere", "sphere"),
    ] {
        assert_eq!(found_in("a", text).first().map(String::as_str), Some(first), "{text}");
    }
    let mut desk = Desk::new(ROOM);
    desk.keys("a `wood` Enter `blue` Enter");
    assert_eq!(desk.scene().objects[3].name, "blue ball", "typed anew after no match");
    desk.keys("a `tap cyl` Enter Enter");
    assert_eq!(desk.scene().objects[4].shape.key(), "tapered_cylinder", "{}", desk.notice());
}

#[test]
fn fields_of_the_inspector_keep_the_cursor_and_take_words() {
    let mut desk = Desk::new(ROOM);
    desk.select(Target::Object(1));
    desk.keys("Enter / `rad` Enter `.3` Enter x `.4` Enter");
    let Shape::Sphere(ball) = &desk.scene().objects[1].shape else { panic!("no ball") };
    assert_eq!((ball.radius, desk.scene().objects.len()), (0.4, 3));
    desk.select(Target::Material("red".into()));
    desk.keys("Home Enter `gold` Enter");
    assert_eq!(desk.scene().materials["red"].preset, Some(Preset::Gold), "{}", desk.notice());
    desk.keys("[ [ [ [ [ [ [ [");
    assert_eq!(desk.scene().materials["red"].roughness, 0.0);
    desk.keys("]");
    assert_eq!(desk.scene().materials["red"].roughness, 0.01);
}

#[test]
fn tab_completes_paths() {
    let mut desk = Desk::new(ROOM);
    let paths = |names: &[&str]| names.iter().map(|name| name.to_string()).collect::<Vec<_>>();
    desk.keys("a `mesh` Enter `d` Tab");
    let asked = Effect::CompletePath { text: "d".into(), beside_scene: true };
    assert!(desk.asked(|e| *e == asked));
    desk.send(Message::Paths("d".into(), paths(&["duck.obj", "dune.obj"])));
    assert_eq!(desk.editor().unwrap().text(), "du");
    desk.send(Message::Paths("d".into(), paths(&["dune.obj"])));
    assert_eq!(desk.editor().unwrap().text(), "du", "too late");
    desk.send(Message::Paths("du".into(), paths(&["duck.obj", "dune.obj"])));
    assert!(desk.notice().contains("duck.obj  dune.obj"));
    desk.keys("Esc Esc : `e d` Tab");
    desk.send(Message::Paths("d".into(), paths(&["den.toml"])));
    assert_eq!(desk.editor().unwrap().text(), "e den.toml");
}

#[test]
fn palette_finds_actions_fields_and_parts_by_other_words() {
    for (text, first) in [
        ("export", "write a PNG"),
        ("rough", "roughness of mirror"),
        ("resolution", "size of film"),
        ("depth", "max depth of trace"),
        ("rays", "rays per pixel of film"),
        ("reload", "read the file again"),
        ("image", "write a PNG"),
        ("compare", "pin this picture"),
        ("crisp", "mirror smoother"),
        ("gold", "metal of mirror"),
        ("ior", "ior of mirror"),
        ("fov", "vertical of camera"),
        ("floor", "select object \"floor\""),
        ("eye.x", "eye.x of camera"),
    ] {
        assert!(found(text).iter().take(3).any(|name| name == first), "{text}: {:?}", found(text));
    }
    assert_eq!(found("export")[0], "write a PNG");
    for text in ["zoom", "settings"] {
        assert!(!found(text).is_empty(), "{text}");
    }
    let mut desk = Desk::new(ROOM);
    desk.keys(": `light dark` Enter : `light`");
    let Some(Overlay::Pick(pick)) = &desk.model.overlay else { panic!("no palette") };
    assert_eq!(pick.entries[pick.found[0]].name, "light darker", "the latest comes first");
}

#[test]
fn typed_commands_set_save_and_quit() {
    let mut desk = Desk::new(ROOM);
    desk.keys(": `set roughness .3` Enter");
    assert_eq!(desk.scene().materials["mirror"].roughness, 0.3);
    desk.keys(": `set roughness *2` Enter");
    assert_eq!(desk.scene().materials["mirror"].roughness, 0.6);
    desk.keys(": `set eye.x 2` Enter : `set size 128x96` Enter");
    assert_eq!((desk.scene().camera.eye[0], desk.scene().film.size), (2.0, [128, 96]));
    desk.keys(": `set roughness -1` Enter");
    assert!(desk.notice().contains("roughness is -1") && desk.model.overlay.is_some());
    desk.keys("Esc : `set colour red` Enter");
    assert!(desk.notice().contains("no field"), "{}", desk.notice());
    desk.keys("Esc : `w copy` Enter");
    assert!(desk.disk.contains_key(Path::new("copy.toml")) && !desk.model.is_unsaved());
    desk.keys("] : `wq` Enter");
    assert!(desk.asked(|e| *e == Effect::Quit) && !desk.model.is_unsaved());
}

#[test]
fn marked_parts_change_together() {
    let mut desk = Desk::new(ROOM);
    desk.select(Target::Object(1));
    desk.keys("V Tab Down V m x `1` Enter");
    let center = |desk: &Desk, i| {
        zerkalo_scene::edit::bounds(desk.scene(), &Target::Object(i)).unwrap().center
    };
    assert_eq!([center(&desk, 1).x, center(&desk, 2).x], [1.0, 1.0]);
    desk.keys("r `180` Enter");
    // They rotate about the point between them.
    assert_eq!([center(&desk, 1).z, center(&desk, 2).z], [-2.0, 0.0]);
    desk.keys("u u");
    assert_eq!(desk.text(), ROOM, "two steps");
    desk.select(Target::Object(1));
    desk.keys("V Tab Down V D Right Enter");
    assert_eq!((desk.scene().objects.len(), desk.model.marked.len()), (5, 2));
    desk.keys("x");
    assert_eq!(desk.scene().objects.len(), 3, "the copies are gone");
}

#[test]
fn deletion_takes_only_what_was_selected_and_undo_selects_it() {
    let mut desk = Desk::new(ROOM);
    desk.select(Target::Object(1));
    desk.keys("x");
    assert!(desk.notice().contains("ball deleted"), "{}", desk.notice());
    desk.keys("x");
    assert_eq!(desk.scene().objects.len(), 2, "{}", desk.notice());
    assert!(desk.notice().contains("glass is selected"), "{}", desk.notice());
    desk.select(Target::Camera);
    desk.keys("u");
    assert_eq!(desk.model.selection, Target::Object(1));
    assert_eq!(desk.text(), ROOM);
}

#[test]
fn colours_and_calculations_are_typed_into_fields() {
    let mut desk = Desk::new(ROOM);
    desk.select(Target::Material("red".into()));
    desk.keys("Enter / `col` Enter Enter `gold` Enter");
    let gold = zerkalo_scene::value::Color::from_hex("#ffd700").unwrap();
    assert_eq!(desk.scene().materials["red"].color, gold);
    desk.keys("/ `refl` Enter `.25` Enter *");
    desk.keys("`2` Enter");
    assert_eq!(desk.scene().materials["red"].reflection, 0.5);
}

#[test]
fn scene_is_saved_from_every_widget() {
    for keys in ["", "Tab", "Enter", "Enter Down Enter", "a", "a Enter", "a Enter `rad`", ":", "N"]
    {
        let mut desk = Desk::new(ROOM);
        desk.select(Target::Object(1));
        desk.keys(&format!("] {keys} Ctrl-s"));
        assert!(!desk.model.is_unsaved(), "{keys}");
        assert_eq!(desk.scene().objects.len(), if keys.starts_with("a E") { 4 } else { 3 });
    }
}

#[test]
fn marked_parts_are_scaled_about_their_foot_and_repeated() {
    let mut desk = Desk::new(ROOM);
    let center = |desk: &Desk, i: usize| {
        zerkalo_scene::edit::bounds(desk.scene(), &Target::Object(i)).unwrap().center
    };
    desk.keys("/ `object ball` Enter V / `object glass` Enter V Alt-s `2` Enter");
    assert!(center(&desk, 1).distance(DVec3::new(0.0, 2.0, 1.0)) < 1e-9, "{}", center(&desk, 1));
    assert!(center(&desk, 2).distance(DVec3::new(0.0, 2.0, -3.0)) < 1e-9, "{}", center(&desk, 2));
    desk.keys("u");
    assert_eq!(desk.text(), ROOM);
    desk.keys("/ `object ball` Enter Alt-d `2 x .75` Enter");
    assert_eq!(desk.scene().objects.len(), 5, "{}", desk.notice());
    for (copy, x) in [(3, 0.75), (4, 1.5)] {
        assert!(center(&desk, copy).distance(DVec3::new(x, 1.0, 0.0)) < 1e-9);
    }
    desk.keys("u Alt-s `-1` Enter");
    assert!(desk.problem().is_some_and(|problem| problem.contains("greater than 0")));
    desk.keys("Esc Alt-d `99 x 1` Enter");
    assert!(desk.problem().is_some_and(|problem| problem.contains("up to 50")));
    assert_eq!(desk.text(), ROOM);
}
