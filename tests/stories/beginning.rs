//! Stories of a scene that begins as a new file, with keys counted.

use super::*;
use zerkalo_scene::material::Preset;

/// Number of keys that [`Desk::keys`] presses for `keys`.
pub fn count(keys: &str) -> usize {
    let parts = keys.split('`').enumerate();
    parts
        .map(|(i, part)| if i % 2 == 1 { part.len() } else { part.split_whitespace().count() })
        .sum()
}

#[test]
fn new_file_becomes_a_lit_scene_and_a_picture_in_seventy_keys() {
    let mut desk = Desk::on_new_file();
    assert!(desk.model.is_empty() && !desk.model.is_unsaved());
    let keys = "a `gold` Enter a `glass` Enter a `red` Enter a `floor` Enter a `mirror` Enter \
                A `warm` Enter A `cool` Enter Ctrl-s Ctrl-e Ctrl-u `1920x1080` Enter";
    assert!(count(keys) <= 70, "{} keys", count(keys));
    desk.keys(keys);
    let scene = desk.scene();
    let names: Vec<_> = scene.objects.iter().map(|object| object.name.as_str()).collect();
    let expected = ["gold ball", "glass ball", "red ball", "floor", "mirror frame", "mirror"];
    assert_eq!(names, expected);
    let names: Vec<_> = scene.lights.iter().map(|light| light.name.as_str()).collect();
    assert_eq!(names, ["warm lamp", "cool window"]);
    assert_eq!(scene.materials["gold"].preset, Some(Preset::Gold));
    assert!(scene.materials["mirror"].roughness > 0.0 && scene.materials["floor"].reflection > 0.0);
    assert!(!desk.model.is_unsaved() && !desk.model.file.is_new);
    assert_eq!(Scene::parse(&desk.disk[Path::new(FILE)], FILE).unwrap(), *scene);
    let is_full_hd = |e: &Effect| match e {
        Effect::ExportSized { scene, .. } => scene.film.size == [1920, 1080],
        _ => false,
    };
    assert!(desk.asked(is_full_hd));
    desk.undo_all();
    assert!(desk.model.is_empty());
}

#[test]
fn another_scene_opens_after_unsaved_edits_are_saved_or_discarded() {
    let mut desk = Desk::new(ROOM);
    desk.keys("] Ctrl-n");
    assert!(matches!(desk.model.overlay, Some(Overlay::Question(_))));
    desk.keys("Esc");
    assert!(desk.model.is_unsaved() && desk.model.next_scene.is_none());
    desk.keys("Ctrl-n `s`");
    assert!(desk.scene().objects.is_empty() && desk.disk[Path::new(FILE)] != ROOM);
    desk.keys("a Enter Enter O `room` Enter `d`");
    assert_eq!((desk.scene().objects.len(), desk.model.is_unsaved()), (3, false));
    desk.disk.insert("bad.toml".into(), "[camera".into());
    desk.send(Message::Scenes(vec![("bad.toml".to_string(), "file")]));
    desk.keys("Enter");
    assert_eq!(desk.scene().objects.len(), 3, "{}", desk.notice());
    assert!(desk.notice().contains("not TOML"), "{}", desk.notice());
}

#[test]
fn banner_of_a_broken_file_goes_when_the_file_is_good_again() {
    let mut desk = Desk::new(ROOM);
    let errors = || Scene::parse("[camera", FILE).unwrap_err();
    desk.send(Message::BrokenOnDisk(errors()));
    assert!(desk.model.file.broken.is_some() && desk.notice().contains("not TOML"));
    desk.send(Message::MendedOnDisk);
    assert!(desk.model.file.broken.is_none());
    desk.keys("]");
    desk.send(Message::BrokenOnDisk(errors()));
    desk.send(Message::ChangedOnDisk(String::new()));
    desk.keys("`k`");
    assert!(desk.model.file.broken.is_none() && desk.model.is_unsaved());
}

#[test]
fn form_of_a_mesh_begins_with_the_name_of_its_file() {
    let mut desk = Desk::new(ROOM);
    desk.keys("a `mesh` Enter `missing.obj` Enter");
    assert!(desk.problem().is_some_and(|problem| problem.contains("no such file")));
    desk.keys("Esc Esc");
    assert_eq!(desk.text(), ROOM);
}

/// Returns the text of an OBJ file of a ball with 2,000 triangles between 170 and 180.
fn ball_of_2000_triangles() -> String {
    let (columns, rows) = (40, 26);
    let mut text = String::new();
    for (row, column) in (0..=rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let (up, around) =
            (f64::from(row) / f64::from(rows), f64::from(column) / f64::from(columns));
        let (sin, cos) = (std::f64::consts::PI * up).sin_cos();
        let (x, z) = (std::f64::consts::TAU * around).sin_cos();
        text += &format!(
            "v {} {} {}\n",
            175.0 + 5.0 * x * sin,
            175.0 + 5.0 * cos,
            175.0 + 5.0 * z * sin
        );
    }
    for (row, column) in (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column))) {
        let at = |row: i32, column: i32| row * columns + column % columns + 1;
        let [a, b] = [at(row, column), at(row, column + 1)];
        let [c, d] = [at(row + 1, column + 1), at(row + 1, column)];
        if row + 1 < rows {
            text += &format!("f {a} {c} {d}\n");
        }
        if row > 0 {
            text += &format!("f {a} {b} {c}\n");
        }
    }
    text
}

#[test]
fn mesh_before_a_rougher_mirror_is_compared_in_thirty_keys() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("duck.obj");
    std::fs::write(&path, ball_of_2000_triangles()).unwrap();
    let mut desk = Desk::new(&ROOM.replace("roughness = 0.05", "roughness = 0.0"));
    let keys = "a `mesh` Enter `duck.obj` Enter Home Enter / `ro mi` Enter k `.3` Enter C";
    assert!(count(keys) <= 30, "{} keys", count(keys));
    let (before, after) = keys.split_once("Home").unwrap();
    desk.keys(&before.replace("duck.obj", path.to_str().unwrap()));
    assert!(desk.notice().contains("2000 triangles, 10 x 10 x 10 units"), "{}", desk.notice());
    desk.keys("Home").keys(after);
    let ball = zerkalo_scene::edit::bounds(desk.scene(), &Target::Object(3)).unwrap();
    assert!(ball.radius < 1.0 && ball.center.z > -2.0 && ball.center.z < 5.0, "{ball:?}");
    assert_eq!(desk.scene().materials["mirror"].roughness, 0.3);
    assert!(desk.model.compared().is_some() && desk.model.channel == DisplayChannel::Difference);
}
