//! Stories of typing, forms, drags and refusals.

use super::*;
use zerkalo::dashboard::layout::Focus;

const BALL: Target = Target::Object(1);

fn desk(target: Target, keys: &str) -> Desk {
    let mut desk = Desk::new(ROOM);
    desk.select(target);
    desk.keys(keys);
    desk
}

fn radius(desk: &Desk) -> f64 {
    match &desk.scene().objects[1].shape {
        Shape::Sphere(sphere) => sphere.radius,
        other => panic!("{other:?}"),
    }
}

/// Opens the inspector of a ball, with the cursor on the radius of the ball.
fn at_radius() -> Desk {
    let desk = desk(BALL, "Enter / `rad` Enter");
    let lines = desk.model.field_lines();
    assert_eq!(lines[desk.model.inspector.cursor].entry().unwrap().label, "radius");
    desk
}

#[test]
fn typed_numbers_are_saved() {
    let mut desk = at_radius();
    desk.keys("`0.75` Enter");
    assert_eq!(radius(&desk), 0.75);
    assert_eq!(desk.text(), ROOM.replace("radius = 0.5", "radius = 0.75"));
    desk.keys("u");
    assert_eq!(desk.text(), ROOM);
}

#[test]
fn invalid_value_is_refused_in_its_field() {
    for (typed, words) in [
        ("-1", "radius is -1"),
        ("1e12", "radius is 1e12"),
        ("5 5", "needs 1 number"),
        ("one", "cannot be"),
        ("nan", "cannot be"),
        ("#ff0000", "cannot be"),
    ] {
        let mut desk = at_radius();
        desk.keys(&format!("Enter Ctrl-u `{typed}` Enter"));
        let problem = desk.problem().unwrap_or_default().to_string();
        assert!(problem.contains(words), "{typed}: {problem}");
        assert_eq!(desk.text(), ROOM, "{typed}: the scene stays");
        // Typing removes the error message, and Esc restores the old value.
        desk.keys("Backspace");
        assert_eq!(desk.problem(), None);
        desk.keys("Esc");
        assert!(desk.editor().is_none());
        assert_eq!((desk.text().as_str(), desk.model.focus), (ROOM, Focus::Inspector));
    }
    let mut desk = at_radius();
    desk.keys("Backspace");
    assert!(desk.notice().contains("must not be left out"), "{}", desk.notice());
}

#[test]
fn typed_value_is_applied_before_another_command() {
    let mut desk = at_radius();
    desk.keys("`0.25` Up");
    assert_eq!(radius(&desk), 0.25);
    let mut desk = at_radius();
    desk.keys("`0.25` Tab");
    assert_eq!((radius(&desk), desk.model.focus), (0.25, Focus::Inspector));
    let mut desk = at_radius();
    desk.keys("`-3` Ctrl-s");
    assert!(desk.problem().is_some() && !desk.asked(|e| matches!(e, Effect::Save { .. })));
}

#[test]
fn vector_or_colour_can_be_typed_into_any_component() {
    let mut desk = desk(BALL, "Enter `1, 2 -3` Enter");
    let Shape::Sphere(sphere) = &desk.scene().objects[1].shape else { panic!() };
    assert_eq!(sphere.center, [1.0, 2.0, -3.0]);
    desk.select(Target::Material("red".into()));
    desk.keys("Home Down Down Down `#ffffff` Enter");
    assert_eq!(desk.scene().materials["red"].color.0, [1.0; 3]);
}

#[test]
fn choices_are_selected_from_list_or_stepped() {
    let mut desk = desk(BALL, "Enter Up Up Enter");
    assert!(
        matches!(&desk.model.overlay, Some(Overlay::Pick(pick)) if pick.entries[0].name == "mirror")
    );
    desk.keys("m Enter");
    assert_eq!(desk.scene().objects[1].material, "mirror");
    desk.keys(": `undo` Enter Right");
    assert_ne!(desk.scene().objects[1].material, "red");
    desk.select(Target::Light(0));
    desk.keys("End Enter");
    assert!(!desk.scene().lights[0].on, "Enter switches a switch");
}

#[test]
fn form_previews_and_confirms_as_one_step() {
    let mut desk = desk(Target::Camera, "a Enter");
    assert_eq!(desk.scene().objects.len(), 4, "it is seen while the form is open");
    assert!(matches!(desk.effects.last(), Some(Effect::Show(s)) if s.objects.len() == 4));
    assert_eq!(desk.text(), ROOM, "but not there yet");
    desk.keys("Down `pearl` Enter `rad` Enter `0.2` Enter");
    let Some(Overlay::Form(form)) = &desk.model.overlay else { panic!("the form has closed") };
    assert_eq!(form.scene.objects[3].name, "pearl");
    desk.keys("Home Enter");
    assert!(desk.model.overlay.is_none());
    let Shape::Sphere(sphere) = &desk.scene().objects[3].shape else { panic!() };
    assert_eq!((sphere.radius, desk.scene().materials.len()), (0.2, 3));
    assert_eq!(desk.model.selection, Target::Object(3));
    desk.keys("u");
    assert_eq!(desk.text(), ROOM, "one step");
}

#[test]
fn form_cancels_as_a_whole() {
    for kind in 0..8 {
        for keys in ["Esc", "Down Right Right Esc", "`x` Esc Esc", "Down `-1` Enter Esc Esc"] {
            let downs = "Down ".repeat(kind);
            let mut desk = desk(BALL, &format!("a {downs} Enter {keys}"));
            assert!(desk.model.overlay.is_none(), "kind {kind}: {keys}");
            assert_eq!(desk.text(), ROOM);
            assert!(matches!(desk.effects.last(), Some(Effect::Show(s)) if s.objects.len() == 3));
            assert_eq!(desk.model.selection, BALL);
            desk.keys("u");
            assert!(desk.notice().contains("Nothing to undo"));
        }
    }
}

#[test]
fn form_removes_unused_materials() {
    let mut desk = desk(Target::Camera, "a Enter Down Down");
    for _ in 0..3 {
        desk.keys("Right");
        if desk.scene().objects[3].material == "red" {
            break;
        }
    }
    desk.keys("Home Enter");
    assert_eq!(desk.scene().objects[3].material, "red");
    assert_eq!(desk.scene().materials.len(), 2, "its own colour is not used");
}

#[test]
fn invalid_value_stays_in_form() {
    let mut desk = desk(Target::Camera, "a Enter Down `ball` Enter");
    assert!(desk.problem().is_some_and(|p| p.contains("same name")), "{:?}", desk.problem());
    desk.keys("Backspace `2` Enter Home Enter");
    assert_eq!(desk.scene().objects[3].name, "bal2");
}

#[test]
fn held_key_is_one_undo_step_until_a_pause() {
    let mut desk = desk(Target::Camera, "] ] ] ] ]");
    desk.keys("u");
    assert_eq!(desk.text(), ROOM);
    desk.keys("] ]");
    desk.now += Duration::from_secs(1);
    desk.keys("]").keys("u");
    assert_ne!(desk.text(), ROOM, "the first two");
    desk.keys("u");
    assert_eq!(desk.text(), ROOM);
}

#[test]
fn mode_is_one_undo_step() {
    let mut desk = desk(BALL, "m Right");
    desk.now += Duration::from_secs(100);
    desk.keys("Up PageUp Esc");
    assert_ne!(desk.text(), ROOM);
    desk.keys("u");
    assert_eq!(desk.text(), ROOM);
    let mut desk = self::desk(Target::Settings(SceneSettings::Film), "m");
    assert!(desk.notice().contains("cannot be moved"), "{}", desk.notice());
    desk.keys("Left");
    assert!(desk.scene().camera.eye[0] < 0.0, "the keys still move the camera");
}

#[test]
fn pasted_text_runs_no_commands() {
    let mut desk = desk(BALL, "");
    desk.send(Message::Paste("xxq\nDDD".into()));
    assert_eq!(desk.text(), ROOM);
    assert!(desk.notice().contains("fields"));
    let mut desk = at_radius();
    desk.keys("Enter Ctrl-u");
    desk.send(Message::Paste("0.125\nx q".into()));
    desk.keys("Enter");
    assert_eq!(radius(&desk), 0.125);
}

#[test]
fn invalid_prompt_answer_keeps_prompt_open() {
    for (keys, words) in [
        ("e Ctrl-u `floor` Enter", "same name"),
        ("T Ctrl-u `spp 0` Enter", "at least 1"),
        ("T Ctrl-u Enter", "Type one"),
        ("Ctrl-e Ctrl-u `10` Enter", "needs 2 numbers"),
        ("Ctrl-e Ctrl-u `99999x99999` Enter", "size"),
        ("Ctrl-e Ctrl-u `10x10 jpg` Enter", "neither png nor exr"),
        ("n Ctrl-u Enter", "needs a name"),
        ("W Ctrl-u Enter", "needs a name"),
    ] {
        let mut desk = desk(BALL, keys);
        assert!(desk.problem().is_some_and(|p| p.contains(words)), "{keys}: {:?}", desk.problem());
        desk.keys("Esc");
        assert!(desk.model.overlay.is_none());
        assert_eq!(desk.text(), ROOM);
    }
}

#[test]
fn light_intensity_is_reported_and_selection_stays() {
    let mut desk = desk(Target::Settings(SceneSettings::Ambient), "' '");
    assert!(desk.scene().ambient.color.0[0] > 0.1 && desk.scene().lights[0].intensity == 1.0);
    assert!(desk.notice().starts_with("ambient: "), "{}", desk.notice());
    assert_eq!(desk.model.selection, Target::Settings(SceneSettings::Ambient));
    desk.keys("L");
    assert!(desk.notice().contains("no switch"));
}

#[test]
fn lights_of_a_group_are_selected_mixed_and_renamed_together() {
    let lamp =
        |x: i32| format!("\n[[light]]\npoint.position = [{x}.0, 3.0, 0.0]\ngroup = \"left\"\n");
    let mut desk = Desk::new(&(ROOM.to_string() + &lamp(1) + &lamp(2)));
    desk.keys("l ' Alt-l");
    assert_eq!(desk.model.selection, Target::Group("left".to_string()));
    assert!(desk.notice().starts_with("Only left"), "{}", desk.notice());
    assert!(desk.scene().groups["left"].intensity > 1.05 && desk.scene().film.solo == "left");
    desk.keys("l");
    assert_eq!(desk.model.selection, Target::Light(0), "lights of a group are not single lights");
    desk.keys("l e Ctrl-u `stage` Enter");
    let groups: Vec<&String> = desk.scene().lights.iter().map(|light| &light.group).collect();
    assert_eq!(groups, ["", "stage", "stage"]);
    assert_eq!(desk.scene().film.solo, "stage");
    desk.keys("x");
    assert!(desk.scene().groups.is_empty() && desk.scene().lights[1].group.is_empty());
}

#[test]
fn editing_works_at_every_terminal_size() {
    for screen in [[200, 60], [120, 36], [80, 24], [40, 12], [39, 11], [1, 1], [0, 0]] {
        let mut desk = desk(BALL, "");
        desk.send(Message::Resize(screen));
        desk.keys("Tab Down End Home Tab Down Right Enter Esc Esc a Down Enter Down Right Enter");
        desk.keys("? PageDown End Esc : `undo` Enter q Esc v k c i Left Esc u u u");
        for x in 0..screen[0].min(50) {
            desk.click(x, x / 2);
        }
        assert!(desk.scene().faults().is_empty());
    }
}
