//! Stories of views that are not the camera of the scene.

use super::*;

fn eye(desk: &Desk) -> [f64; 3] {
    desk.scene().camera.eye
}

#[test]
fn view_is_no_edit_until_it_becomes_the_camera() {
    let mut desk = Desk::new(ROOM);
    desk.keys("Left Up PageUp w a Esc Alt-Up f");
    assert!(desk.model.free_view.is_some() && desk.text() == ROOM && !desk.model.is_unsaved());
    assert!(!desk.asked(|e| matches!(e, Effect::Autosave(Some(_)))));
    let seen = desk.scene().camera.clone();
    desk.keys("Ctrl-s");
    assert!(desk.notice().contains("the view is not saved: H"), "{}", desk.notice());
    assert_eq!(desk.disk[Path::new(FILE)], ROOM);
    desk.keys("] K");
    let shown = |e: &Effect| matches!(e, Effect::Checkpoint(scene) if scene.camera == seen);
    assert!(desk.asked(shown), "what is seen");
    assert_eq!(desk.scene().camera, seen, "an edit of the mirror");
    desk.keys("u H");
    assert!(desk.model.free_view.is_none() && desk.model.is_unsaved());
    assert_eq!(desk.model.scene().camera, seen);
    desk.keys("u");
    assert_eq!(desk.text(), ROOM);
    assert_eq!(eye(&desk), [0.0, 1.0, 5.0], "the view follows");
    desk.keys("H");
    assert!(desk.notice().contains("already"), "{}", desk.notice());
}

#[test]
fn view_follows_edits_of_the_camera() {
    let mut desk = Desk::new(ROOM);
    desk.keys("Left Enter Right");
    assert!(desk.model.free_view.is_none() && eye(&desk) == [0.1, 1.0, 5.0], "{:?}", eye(&desk));
    // The lens is that of the camera, and undo closes both.
    desk.keys("Esc Left Alt-o");
    let [seen, own] = [desk.model.seen(), desk.model.scene()].map(|s| s.camera.lens_radius());
    assert!(desk.model.free_view.is_some() && seen > 0.0 && seen == own, "{seen} {own}");
    desk.keys("u");
    assert!(desk.model.free_view.is_some() && desk.scene().camera.lens_radius() == 0.0);
}

#[test]
fn new_objects_fit_the_view_and_leave_the_camera() {
    let mut desk = Desk::new(ROOM);
    desk.keys("Shift-Right Shift-Right a Enter");
    let seen = eye(&desk);
    assert!(seen[0] > 0.1, "the preview shows the view: {seen:?}");
    desk.keys("Enter");
    assert_eq!((eye(&desk), desk.model.scene().camera.eye), (seen, [0.0, 1.0, 5.0]));
}

#[test]
fn orbit_stops_above_the_floor() {
    let mut desk = Desk::new(ROOM);
    for _ in 0..60 {
        desk.keys("Down");
    }
    let lowest = eye(&desk)[1];
    assert!((0.05..0.15).contains(&lowest), "{lowest}");
    desk.keys("Left");
    assert!((eye(&desk)[1] - lowest).abs() < 1e-3, "sideways at the same height");
    desk.keys("Shift-Down Shift-Down");
    let below = eye(&desk)[1];
    assert!(below < 0.0, "panning is not stopped: {below}");
    desk.keys("Down Up");
    assert!(eye(&desk)[1] > below, "{below}");
}

#[test]
fn tone_curve_is_that_of_the_scene_from_the_first_frame() {
    let desk = Desk::new(&ROOM.replace("[film]", "[film]\ntone = \"neutral\""));
    assert_eq!(desk.model.display.tone.name(), "neutral");
}

#[test]
fn end_of_the_probe_returns_to_the_view_before_it() {
    let mut desk = Desk::new(ROOM);
    desk.keys("i v v Esc");
    assert_eq!(desk.model.channel, DisplayChannel::Beauty);
}

#[test]
fn export_that_is_written_now_says_so_at_once() {
    let mut desk = Desk::new(ROOM);
    desk.keys("Ctrl-e Enter Ctrl-e `n`");
    desk.send(Message::ExportProgress(Some((0.0, None))));
    assert!(desk.asked(|effect| *effect == Effect::FinishExport));
    assert!(desk.model.export.is_some_and(|export| export.progress == 1.0));
}
