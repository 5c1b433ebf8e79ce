//! Stories of mouse events.

use super::*;
use zerkalo::dashboard::layout::Focus;

/// Returns column and row of the cell at the centre of the picture, which shows the ball.
fn middle(desk: &Desk) -> [u16; 2] {
    let image = desk.model.layout().unwrap().image;
    [image.x + image.width / 2, image.y + image.height / 2]
}

fn center(desk: &Desk) -> [f64; 3] {
    match &desk.scene().objects[1].shape {
        Shape::Sphere(sphere) => sphere.center,
        other => panic!("{other:?}"),
    }
}

#[test]
fn click_selects_visible_object() {
    let mut desk = Desk::new(ROOM);
    let [x, y] = middle(&desk);
    desk.click(x, y);
    assert_eq!(desk.model.selection, Target::Object(1), "the ball");
    let image = desk.model.layout().unwrap().image;
    desk.click(x, image.y + image.height - 1);
    assert_eq!(desk.model.selection, Target::Object(0), "the floor");
    desk.click(x, image.y);
    assert_eq!(desk.model.selection, Target::Settings(SceneSettings::Background));
    assert_eq!(desk.text(), ROOM);
}

#[test]
fn right_or_modified_click_focuses_lens() {
    for modified in [false, true] {
        let mut desk = Desk::new(ROOM);
        let [x, y] = middle(&desk);
        let press = |desk: &mut Desk, column, row| {
            let button = if modified { Button::Left } else { Button::Right };
            for kind in [MouseKind::Press(button), MouseKind::Release(button)] {
                desk.send(Message::Mouse(Mouse { kind, column, row, modified }));
            }
        };
        press(&mut desk, x, y);
        // The lens is focused on the front of the ball.
        assert!((desk.scene().camera.focus_depth() - 4.5).abs() < 0.01);
        assert!(desk.notice().contains("pinhole"), "{:?}", desk.notice());
        assert_eq!(desk.model.selection, Target::Camera, "it selects nothing");
        desk.keys("Alt-o");
        assert!(desk.notice().contains("focus at 4.5"), "{:?}", desk.notice());
        let image = desk.model.layout().unwrap().image;
        press(&mut desk, x, image.y);
        assert!(desk.notice().contains("no object"), "{:?}", desk.notice());
        desk.keys("u u");
        assert_eq!(desk.text(), ROOM);
    }
}

#[test]
fn drag_orbits_and_pans_view() {
    let mut desk = Desk::new(ROOM);
    let cell = middle(&desk);
    desk.drag(Button::Left, cell, [12, -4]);
    let eye = desk.scene().camera.eye;
    assert!(eye[0] < -0.5, "what is seen follows the hand: {eye:?}");
    desk.drag(Button::Right, cell, [5, 5]);
    assert!(desk.scene().camera.target.unwrap()[1] > 1.0, "the picture goes down, the eye up");
    assert!(desk.text() == ROOM && desk.model.history.undo().is_none(), "no edit");
}

#[test]
fn drag_moves_selection_under_mouse() {
    let mut desk = Desk::new(ROOM);
    desk.select(Target::Object(1));
    desk.keys("m");
    let cell = middle(&desk);
    let columns = f64::from(desk.model.layout().unwrap().image.width);
    desk.drag(Button::Left, cell, [10, 0]);
    let [x, y, z] = center(&desk);
    // At the distance 5 from the eye the picture is 5 x 2 tan 20° high and 4/3 as wide.
    let expected = 10.0 / columns * 10.0 * 20f64.to_radians().tan() * 4.0 / 3.0;
    assert!((x - expected).abs() < 0.02 && y == 1.0 && z == 0.0, "{x} {expected}");
    desk.drag(Button::Left, cell, [0, 6]);
    assert!(center(&desk)[2] > 0.3, "nearer");
    desk.drag(Button::Right, cell, [0, -6]);
    assert!(center(&desk)[1] > 1.2, "higher");
    desk.keys("Right Esc u");
    assert_eq!(desk.text(), ROOM, "one step from entering the mode to leaving it");
}

#[test]
fn wheel_dollies_scrolls_and_steps() {
    let mut desk = Desk::new(ROOM);
    let [x, y] = middle(&desk);
    desk.mouse(MouseKind::Scroll(2), x, y);
    assert!(desk.scene().camera.eye[2] < 4.2);
    desk.keys("h");
    let (rows, _) = desk.model.inspector_rows().unwrap();
    desk.click(rows.x + 1, rows.y);
    assert_eq!((desk.model.focus, desk.model.inspector.cursor), (Focus::Inspector, 0));
    desk.mouse(MouseKind::Scroll(3), rows.x + 1, rows.y);
    let eye = desk.scene().camera.eye;
    assert!(eye[0] > 0.2, "three coarse steps of the eye's x: {eye:?}");
    desk.select(Target::Material("mirror".into()));
    desk.keys("End Enter Tab");
    let (rows, _) = desk.model.inspector_rows().unwrap();
    desk.mouse(MouseKind::Scroll(-2), rows.x + 1, rows.y + 2);
    assert!(desk.model.inspector.scroll > 0);
}

#[test]
fn click_selects_lines_of_outline_and_inspector() {
    let mut desk = Desk::new(ROOM);
    desk.keys("Tab");
    let rows = desk.model.outline_rows().unwrap();
    for (i, line) in
        desk.model.outline_lines().into_iter().enumerate().take(usize::from(rows.height))
    {
        if desk.model.outline_scroll > 0 {
            break;
        }
        desk.click(rows.x + 2, rows.y + i as u16);
        if let Some(entry) = line.entry() {
            assert_eq!(desk.model.selection, entry.target);
        }
    }
    desk.select(Target::Object(1));
    desk.keys("Enter");
    let (rows, _) = desk.model.inspector_rows().unwrap();
    // The rows are name, material, shape and center x. The last of these is clicked.
    desk.click(rows.x + 3, rows.y + 3).click(rows.x + 3, rows.y + 3);
    desk.keys("Ctrl-u `0.25`");
    // A click elsewhere applies the typed value.
    desk.click(rows.x + 3, rows.y + 5);
    assert_eq!(center(&desk)[0], 0.25);
    // An invalid value blocks the click.
    desk.keys("Enter Ctrl-u `far`").click(rows.x + 3, rows.y + 3);
    assert!(desk.problem().is_some_and(|p| p.contains("far")), "{:?}", desk.problem());
    assert_eq!(desk.model.inspector.cursor, 5);
}

#[test]
fn click_chooses_in_lists_and_questions() {
    let mut desk = Desk::new(ROOM);
    desk.keys("a");
    let place = desk.model.overlay_layout().unwrap();
    desk.click(place.list.x + 1, place.list.y + 1).click(place.list.x + 1, place.list.y + 1);
    assert!(matches!(&desk.model.overlay, Some(Overlay::Form(form)) if form.title == "new cube"));
    desk.keys("Esc ] q");
    let place = desk.model.overlay_layout().unwrap();
    desk.click(place.list.x + 1, place.list.y + 1).click(place.list.x + 1, place.list.y + 1);
    assert!(desk.asked(|e| *e == Effect::Quit), "discard and quit");
}

#[test]
fn click_places_probe() {
    let mut desk = Desk::new(ROOM);
    desk.keys("i");
    let image = desk.model.layout().unwrap().image;
    desk.click(image.x, image.y);
    let probe = desk.model.probe.unwrap();
    assert!(probe[0] <= 1 && probe[1] <= 1, "{probe:?}");
    assert_eq!(desk.model.selection, Target::Camera, "a probe selects nothing");
    desk.keys("Esc");
    assert_eq!(desk.model.probe, None);
    assert!(desk.asked(|e| matches!(e, Effect::View(view) if view.probe.is_none())));
}

#[test]
fn drag_from_selected_object_moves_it_as_one_undo_step() {
    let mut desk = Desk::new(ROOM);
    let cell = middle(&desk);
    desk.drag(Button::Left, cell, [6, 0]);
    assert!(desk.text() == ROOM && desk.model.free_view.is_some(), "not selected: it orbits");
    desk.keys("h").click(cell[0], cell[1]).drag(Button::Left, cell, [6, 2]);
    let [x, y, z] = center(&desk);
    assert!(x > 0.3 && y == 1.0 && z > 0.1 && desk.model.free_view.is_none(), "{x} {y} {z}");
    desk.keys("u");
    assert_eq!(desk.text(), ROOM);
    // The floor fills the view.
    desk.select(Target::Object(0));
    let image = desk.model.layout().unwrap().image;
    desk.drag(Button::Left, [cell[0], image.y + image.height - 1], [6, 0]);
    assert!(desk.text() == ROOM && desk.model.free_view.is_some());
}

#[test]
fn mark_picks_and_moves_its_light() {
    let mut desk = Desk::new(ROOM);
    (0..10).for_each(|_| {
        desk.keys("PageDown");
    });
    assert!(!desk.model.shows_marks(), "nothing is selected");
    desk.select(Target::Object(1));
    desk.keys("Esc");
    let layout = desk.model.layout().unwrap();
    let [mark] = desk.model.light_marks(&layout)[..] else { panic!("one light") };
    desk.click(mark.cell[0], mark.cell[1]);
    assert_eq!(desk.model.selection, Target::Light(0));
    desk.drag(Button::Left, mark.cell, [-5, 0]);
    let moved = desk.scene().lights[0].position().unwrap();
    assert!(moved[0] < 1.5 && moved[1] == 4.0, "{moved:?}");
    let now = desk.model.light_marks(&layout)[0].cell;
    assert!(now[0].abs_diff(mark.cell[0] - 5) <= 1, "it stays under the mouse: {now:?}");
    desk.keys("u");
    assert_eq!(desk.text(), ROOM);
    desk.now += Duration::from_secs(5);
    desk.send(Message::Tick);
    assert!(desk.model.light_marks(&layout).is_empty(), "marks fade");
}

#[test]
fn drag_of_a_border_moves_it() {
    let mut desk = Desk::new(ROOM);
    let old = desk.model.layout().unwrap();
    desk.drag(Button::Left, [old.picture.width, 5], [-7, 0]);
    let new = desk.model.layout().unwrap();
    assert_eq!(new.picture.width, old.picture.width - 7);
    assert!(desk.asked(|e| matches!(e, Effect::View(_))) && desk.model.free_view.is_none());
    let inspector = new.inspector.unwrap();
    desk.drag(Button::Left, [inspector.x + 4, inspector.y], [0, 3]);
    assert_eq!(desk.model.layout().unwrap().inspector.unwrap().y, inspector.y + 3);
}

#[test]
fn drag_over_a_number_steps_it() {
    let mut desk = Desk::new(ROOM);
    desk.select(Target::Material("mirror".into()));
    let (rows, _) = desk.model.inspector_rows().unwrap();
    let number = [rows.x + 1, rows.y + 1];
    desk.drag(Button::Left, number, [1, 0]);
    assert_eq!(desk.text(), ROOM, "a click that slips");
    desk.drag(Button::Left, number, [3, 0]);
    assert_eq!(desk.scene().materials["mirror"].roughness, 0.06);
    desk.keys("u");
    assert_eq!(desk.text(), ROOM, "one step");
}
