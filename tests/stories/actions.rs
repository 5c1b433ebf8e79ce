//! One story at least for every action of the key table.

use crate::desk::{Desk, FILE, ROOM};
use std::collections::HashSet;
use std::path::Path;
use zerkalo::camera::Camera;
use zerkalo::dashboard::action::{Action, Action::*, Delta, Direction, StepSize};
use zerkalo::dashboard::keymap::{KEYMAP, Row};
use zerkalo::dashboard::layout::Focus;
use zerkalo::dashboard::message::{DisplayChannel, Effect, Format};
use zerkalo::dashboard::model::{Colors, CompareView, Mode};
use zerkalo::dashboard::overlay::Overlay;
use zerkalo::film::Tone;
use zerkalo::light::Light;
use zerkalo::material::{Lobe, Material};
use zerkalo::scene::Scene;
use zerkalo::scene::edit::Target;
use zerkalo::shape::Shape;

const BALL: Target = Target::Object(1);
const GLASS: Target = Target::Object(2);

/// The scene before, the desk afterwards.
type Expect = dyn Fn(&Scene, &Desk) -> bool;

/// What was pressed with what selected, and what must be so afterwards.
struct Story {
    action: Action,
    select: Target,
    /// Keys; `:` alone: the action is found in the palette.
    keys: String,
    expect: Box<Expect>,
}

fn story(
    action: Action,
    select: Target,
    keys: &str,
    expect: impl Fn(&Scene, &Desk) -> bool + 'static,
) -> Story {
    Story { action, select, keys: keys.to_string(), expect: Box::new(expect) }
}

/// Nine viewpoints, each a unit farther to the right.
fn room_with_views() -> String {
    let view =
        |n: i32| format!("\n[cameras.v{n}]\neye = [{n}.0, 1.0, 5.0]\ntarget = [0.0, 1.0, 0.0]\n");
    (1..=9).fold(ROOM.to_string(), |text, n| text + &view(n))
}

fn camera(scene: &Scene) -> &Camera {
    &scene.camera
}

fn eye(scene: &Scene) -> [f64; 3] {
    scene.camera.eye
}

fn target(scene: &Scene) -> [f64; 3] {
    scene.camera.target.unwrap()
}

fn mirror(scene: &Scene) -> &Material {
    &scene.materials["mirror"]
}

fn lamp(scene: &Scene) -> &Light {
    &scene.lights[0]
}

fn ball(scene: &Scene) -> [f64; 3] {
    match &scene.objects[1].shape {
        Shape::Sphere(sphere) => sphere.center,
        other => panic!("{other:?}"),
    }
}

fn normal(scene: &Scene) -> [f64; 3] {
    match &scene.objects[2].shape {
        Shape::Rectangle(rectangle) => rectangle.normal,
        other => panic!("{other:?}"),
    }
}

fn camera_stories() -> Vec<Story> {
    let c = || Target::Camera;
    let mut stories = vec![
        story(Orbit(Direction::Left), c(), "Left", |a, d| {
            eye(d.scene())[0] < 0.0 && target(a) == target(d.scene())
        }),
        story(Orbit(Direction::Right), c(), "Right", |_, d| eye(d.scene())[0] > 0.0),
        story(Orbit(Direction::Up), c(), "Up", |_, d| eye(d.scene())[1] > 1.0),
        story(Orbit(Direction::Down), c(), "Down", |_, d| eye(d.scene())[1] < 1.0),
        story(Pan(Direction::Left), c(), "Shift-Left", |_, d| {
            eye(d.scene())[0] < 0.0 && target(d.scene())[0] < 0.0
        }),
        story(Pan(Direction::Right), c(), "Shift-Right", |_, d| {
            eye(d.scene())[0] > 0.0 && target(d.scene())[0] > 0.0
        }),
        story(Pan(Direction::Up), c(), "Shift-Up", |_, d| {
            eye(d.scene())[1] > 1.0 && target(d.scene())[1] > 1.0
        }),
        story(Pan(Direction::Down), c(), "Shift-Down", |_, d| {
            eye(d.scene())[1] < 1.0 && target(d.scene())[1] < 1.0
        }),
        story(Dolly(Direction::In, StepSize::Coarse), c(), "PageUp", |_, d| {
            eye(d.scene())[2] < 4.9
        }),
        story(Dolly(Direction::Out, StepSize::Coarse), c(), "PageDown", |_, d| {
            eye(d.scene())[2] > 5.1
        }),
        story(Dolly(Direction::In, StepSize::Fine), c(), "Shift-PageUp", |_, d| {
            (4.9..5.0).contains(&eye(d.scene())[2])
        }),
        story(Dolly(Direction::Out, StepSize::Fine), c(), "Shift-PageDown", |_, d| {
            eye(d.scene())[2] > 5.0 && eye(d.scene())[2] < 5.1
        }),
        story(ViewImage(Direction::Left), c(), "Ctrl-Left", |a, d| {
            eye(a) == eye(d.scene()) && target(d.scene())[0] < 0.0
        }),
        story(ViewImage(Direction::Right), c(), "w Right", |a, d| {
            eye(a) == eye(d.scene()) && target(d.scene())[0] > 0.0
        }),
        story(ViewImage(Direction::Up), c(), "Ctrl-Up", |a, d| {
            eye(a) == eye(d.scene()) && target(d.scene())[1] > 1.0
        }),
        story(ViewImage(Direction::Down), c(), "w Down", |a, d| {
            eye(a) == eye(d.scene()) && target(d.scene())[1] < 1.0
        }),
        story(Roll(Direction::Left), c(), "Alt-Left", |_, d| camera(d.scene()).up[0] != 0.0),
        story(Roll(Direction::Right), c(), "Alt-Right Alt-Left", |a, d| {
            camera(a) == camera(d.scene())
        }),
        story(ViewAngle(Delta::Down), c(), "Alt-Up", |_, d| {
            camera(d.scene()).view_angle.key_degrees().1 < 40.0
        }),
        story(ViewAngle(Delta::Up), c(), "Alt-Down", |_, d| {
            camera(d.scene()).view_angle.key_degrees().1 > 40.0
        }),
        story(FlyMode, c(), "w", |_, d| d.model.mode == Mode::Fly),
        story(Fly(Direction::In), c(), "w w", |_, d| {
            eye(d.scene())[2] < 5.0 && target(d.scene())[2] < 0.0
        }),
        story(Fly(Direction::Out), c(), "w s", |_, d| eye(d.scene())[2] > 5.0),
        story(Fly(Direction::Left), c(), "w a", |_, d| eye(d.scene())[0] < 0.0),
        story(Fly(Direction::Right), c(), "w d", |_, d| eye(d.scene())[0] > 0.0),
        story(Fly(Direction::Up), c(), "w r", |_, d| eye(d.scene())[1] > 1.0),
        story(Fly(Direction::Down), c(), "w f", |_, d| eye(d.scene())[1] < 1.0),
        story(Frame, BALL, "f", |_, d| {
            target(d.scene()) == [0.0, 1.0, 0.0] && eye(d.scene())[2] < 3.0
        }),
        story(ResetCamera, c(), "Left Up Home", |a, d| camera(a) == camera(d.scene())),
        story(StoreView, c(), "n Ctrl-u `door` Enter", |a, d| {
            d.scene().cameras["door"] == a.camera
        }),
    ];
    for n in 1..=9 {
        stories.push(story(RecallView(n), c(), &n.to_string(), move |_, d| {
            eye(d.scene())[0] == f64::from(n)
        }));
    }
    stories
}

fn light_and_mirror_stories() -> Vec<Story> {
    let c = || Target::Camera;
    vec![
        story(NextLight, c(), "l", |_, d| d.model.selection == Target::Light(0)),
        story(Intensity(Delta::Up, StepSize::Coarse), c(), "'", |_, d| {
            lamp(d.scene()).intensity > 1.05
        }),
        story(Intensity(Delta::Down, StepSize::Coarse), c(), ";", |_, d| {
            lamp(d.scene()).intensity < 0.95
        }),
        story(Intensity(Delta::Up, StepSize::Fine), c(), "Alt-'", |_, d| {
            (1.001..1.05).contains(&lamp(d.scene()).intensity)
        }),
        story(Intensity(Delta::Down, StepSize::Fine), c(), "Alt-;", |_, d| {
            (0.95..0.999).contains(&lamp(d.scene()).intensity)
        }),
        story(SwitchLight, c(), "L", |_, d| !lamp(d.scene()).on),
        story(AddLight, c(), "A Enter Enter", |_, d| {
            d.scene().lights.len() == 2 && d.model.selection == Target::Light(1)
        }),
        story(Roughness(Delta::Up, StepSize::Coarse), c(), "]", |_, d| {
            mirror(d.scene()).roughness > 0.0525
        }),
        story(Roughness(Delta::Down, StepSize::Coarse), c(), ",", |_, d| {
            mirror(d.scene()).roughness < 0.0475
        }),
        story(Roughness(Delta::Up, StepSize::Fine), c(), "}", |_, d| {
            (0.0501..0.0525).contains(&mirror(d.scene()).roughness)
        }),
        story(Roughness(Delta::Down, StepSize::Fine), c(), "<", |_, d| {
            (0.0475..0.0499).contains(&mirror(d.scene()).roughness)
        }),
        story(Reflection(Delta::Up), c(), ")", |_, d| mirror(d.scene()).reflection > 0.5),
        story(Reflection(Delta::Down), c(), "(", |_, d| mirror(d.scene()).reflection < 0.5),
        story(NextLobe, c(), "b", |_, d| mirror(d.scene()).lobe == Lobe::Square),
    ]
}

fn object_stories() -> Vec<Story> {
    let c = || Target::Camera;
    vec![
        story(AddObject, c(), "a Enter Enter", |_, d| {
            d.scene().objects.len() == 4 && d.model.selection == Target::Object(3)
        }),
        story(Duplicate, BALL, "D", |_, d| {
            d.scene().objects.len() == 4 && d.model.selection != BALL
        }),
        story(Delete, BALL, "x", |_, d| d.scene().objects.iter().all(|o| o.name != "ball")),
        story(Rename, BALL, "e Ctrl-u `pearl` Enter", |_, d| d.scene().objects[1].name == "pearl"),
        story(MoveMode, BALL, "m", |_, d| d.model.mode == Mode::Move),
        story(Move(Direction::Left, StepSize::Coarse), BALL, "m Left", |_, d| {
            ball(d.scene())[0] < 0.0
        }),
        story(Move(Direction::Right, StepSize::Coarse), BALL, "m Right", |_, d| {
            ball(d.scene())[0] > 0.0
        }),
        story(Move(Direction::In, StepSize::Coarse), BALL, "m Up", |_, d| ball(d.scene())[2] < 0.0),
        story(Move(Direction::Out, StepSize::Coarse), BALL, "m Down", |_, d| {
            ball(d.scene())[2] > 0.0
        }),
        story(Move(Direction::Up, StepSize::Coarse), BALL, "m PageUp", |_, d| {
            ball(d.scene())[1] > 1.0
        }),
        story(Move(Direction::Down, StepSize::Coarse), BALL, "m PageDown", |_, d| {
            ball(d.scene())[1] < 1.0
        }),
        story(Move(Direction::Left, StepSize::Fine), BALL, "m Right Shift-Left", |_, d| {
            ball(d.scene())[0] > 0.0
        }),
        story(Move(Direction::Right, StepSize::Fine), BALL, "m Left Shift-Right", |_, d| {
            ball(d.scene())[0] < 0.0
        }),
        story(Move(Direction::In, StepSize::Fine), BALL, "m Down Shift-Up", |_, d| {
            ball(d.scene())[2] > 0.0
        }),
        story(Move(Direction::Out, StepSize::Fine), BALL, "m Up Shift-Down", |_, d| {
            ball(d.scene())[2] < 0.0
        }),
        story(Move(Direction::Up, StepSize::Fine), BALL, "m PageDown Shift-PageUp", |_, d| {
            ball(d.scene())[1] < 1.0
        }),
        story(Move(Direction::Down, StepSize::Fine), BALL, "m PageUp Shift-PageDown", |_, d| {
            ball(d.scene())[1] > 1.0
        }),
        story(TurnMode, GLASS, "r", |_, d| d.model.mode == Mode::Rotate),
        story(Rotate(Direction::Left, StepSize::Coarse), GLASS, "r Left", |_, d| {
            normal(d.scene())[0] < -0.2
        }),
        story(Rotate(Direction::Right, StepSize::Coarse), GLASS, "r Right", |_, d| {
            normal(d.scene())[0] > 0.2
        }),
        story(Rotate(Direction::Left, StepSize::Fine), GLASS, "r Shift-Left", |_, d| {
            (-0.02..-0.01).contains(&normal(d.scene())[0])
        }),
        story(Rotate(Direction::Right, StepSize::Fine), GLASS, "r Shift-Right", |_, d| {
            (0.01..0.02).contains(&normal(d.scene())[0])
        }),
        story(SnapToGround, BALL, "g", |_, d| ball(d.scene()) == [0.0, 0.5, 0.0]),
        story(OwnMaterial, BALL, "M", |a, d| {
            let own = &d.scene().objects[1].material;
            own != "red" && d.scene().materials[own] == a.materials["red"]
        }),
    ]
}

fn panel_stories() -> Vec<Story> {
    let c = || Target::Camera;
    vec![
        story(NextPanel, c(), "Tab", |_, d| d.model.focus == Focus::Outline),
        story(PreviousPanel, c(), "Shift-Tab", |_, d| d.model.focus == Focus::Inspector),
        story(Cancel, BALL, "m Esc", |_, d| d.model.mode == Mode::Orbit),
        story(Open, BALL, "Enter", |_, d| d.model.focus == Focus::Inspector),
        story(Cursor(Direction::Down), c(), "Tab Down", |_, d| {
            d.model.selection == Target::View("v1".into())
        }),
        story(Cursor(Direction::Up), c(), "Tab Down Down Up", |_, d| {
            d.model.selection == Target::View("v1".into())
        }),
        story(Page(Direction::Down), c(), "Tab PageDown", |_, d| {
            !matches!(d.model.selection, Target::Camera | Target::View(_))
        }),
        story(Page(Direction::Up), Target::IntegratorSettings, "Tab PageUp", |_, d| {
            !matches!(d.model.selection, Target::IntegratorSettings | Target::Film)
        }),
        story(First, Target::IntegratorSettings, "Tab Home", |_, d| {
            d.model.selection == Target::Camera
        }),
        story(Last, c(), "Tab End", |_, d| d.model.selection == Target::IntegratorSettings),
        story(Step(Delta::Up, StepSize::Coarse), c(), "Enter Right", |_, d| {
            eye(d.scene())[0] > 0.05
        }),
        story(Step(Delta::Down, StepSize::Coarse), c(), "Enter Left", |_, d| {
            eye(d.scene())[0] < -0.05
        }),
        story(Step(Delta::Up, StepSize::Fine), c(), "Enter Shift-Right", |_, d| {
            (0.001..0.05).contains(&eye(d.scene())[0])
        }),
        story(Step(Delta::Down, StepSize::Fine), c(), "Enter Shift-Left", |_, d| {
            (-0.05..-0.001).contains(&eye(d.scene())[0])
        }),
        story(ClearField, c(), "Enter `7` Enter Down Backspace", |_, d| {
            eye(d.scene()) == [0.0, 1.0, 5.0]
        }),
        story(ToggleFullscreen, c(), "z", |_, d| {
            d.model.only_picture && d.model.layout().unwrap().outline.is_none()
        }),
    ]
}

fn file_stories() -> Vec<Story> {
    let c = || Target::Camera;
    vec![
        story(Undo, c(), "Left u", |a, d| d.scene() == a && !d.model.is_unsaved()),
        story(Redo, c(), "Left u U", |_, d| eye(d.scene())[0] < 0.0),
        story(Save, c(), "Enter `7` Enter Ctrl-s", |_, d| {
            d.disk[Path::new(FILE)] == room_with_views().replacen("eye = [0.0", "eye = [7.0", 1)
                && !d.model.is_unsaved()
        }),
        story(SaveAs, c(), "W Ctrl-u `copy` Enter", |_, d| {
            d.disk.contains_key(Path::new("copy.toml")) && d.model.file.name == "copy.toml"
        }),
        story(Reload, c(), "Ctrl-o", |_, d| d.asked(|e| *e == Effect::Load)),
        story(Recover, c(), ":", |_, d| d.notice().contains("No session")),
        story(Suspend, c(), "Ctrl-z", |_, d| d.asked(|e| *e == Effect::Suspend)),
        story(Quit, c(), "q", |_, d| d.asked(|e| *e == Effect::Quit)),
    ]
}

fn picture_stories() -> Vec<Story> {
    let c = || Target::Camera;
    let probe = |d: &Desk| d.model.probe.unwrap();
    let fine = |way, keys, at: [usize; 2]| {
        story(MoveProbe(way, StepSize::Fine), c(), keys, move |_, d| probe(d) == at)
    };
    vec![
        story(ExportPng, c(), "p", |_, d| {
            d.asked(|e| *e == Effect::Export(Format::Png))
                && d.notice().contains("room-1.png  64x48  16 spp  noise 2.50")
        }),
        story(ExportExr, c(), "P", |_, d| d.asked(|e| *e == Effect::Export(Format::Exr))),
        story(ExportSized, c(), "Ctrl-e Ctrl-u `320x240 exr` Enter", |_, d| {
            d.asked(|e| matches!(e, Effect::ExportSized { scene, format: Format::Exr, .. } if scene.film.size == [320, 240])) && d.scene().film.size == [64, 48]
        }),
        story(CancelExport, c(), "Ctrl-e Enter Ctrl-x", |_, d| {
            d.asked(|e| *e == Effect::CancelExport) && d.model.export.is_none()
        }),
        story(Exposure(Delta::Up), c(), "=", |_, d| d.model.display.exposure_ev == 0.25),
        story(Exposure(Delta::Down), c(), "-", |_, d| d.model.display.exposure_ev == -0.25),
        story(ResetExposure, c(), "= = 0", |_, d| d.model.display.exposure_ev == 0.0),
        story(NextTone, c(), "t", |_, d| {
            d.model.display.tone == Tone::Neutral && d.asked(|e| matches!(e, Effect::Display(_)))
        }),
        story(NextChannel, c(), "v", |_, d| d.model.channel == DisplayChannel::Noise),
        story(PreviousChannel, c(), "V", |_, d| d.model.channel == DisplayChannel::Depth),
        story(Probe, c(), "i", |_, d| {
            d.asked(|e| *e == Effect::Probe(Some([32, 24]))) && d.model.mode == Mode::Probe
        }),
        story(MoveProbe(Direction::Left, StepSize::Coarse), c(), "i Left", move |_, d| {
            probe(d)[0] < 32
        }),
        story(MoveProbe(Direction::Right, StepSize::Coarse), c(), "i Right", move |_, d| {
            probe(d)[0] > 32
        }),
        story(MoveProbe(Direction::Up, StepSize::Coarse), c(), "i Up", move |_, d| {
            probe(d)[1] < 24
        }),
        story(CopyPath, c(), "p y", |_, d| d.asked(|e| matches!(e, Effect::Copy(_)))),
        story(ShowExport, c(), "p o", |_, d| d.asked(|e| matches!(e, Effect::Look { .. }))),
        story(MoveProbe(Direction::Down, StepSize::Coarse), c(), "i Down", move |_, d| {
            probe(d)[1] > 24
        }),
        fine(Direction::Left, "i Shift-Left", [31, 24]),
        fine(Direction::Right, "i Shift-Right", [33, 24]),
        fine(Direction::Up, "i Shift-Up", [32, 23]),
        fine(Direction::Down, "i Shift-Down", [32, 25]),
        story(Keep, c(), "k", |_, d| d.model.comparison.pinned.is_some()),
        story(Flip, c(), "k c", |_, d| d.model.comparison.shown == CompareView::Pinned),
        story(Difference, c(), "k C", |_, d| d.model.comparison.shown == CompareView::Difference),
        story(Pause, c(), "Space", |_, d| d.model.paused && d.asked(|e| *e == Effect::Pause(true))),
        story(Restart, c(), "R", |_, d| d.asked(|e| *e == Effect::Restart)),
        story(StopAt, c(), "T Ctrl-u `spp 100, time 5` Enter", |_, d| {
            d.model.stop.spp == Some(100)
                && d.model.stop.seconds == Some(5.0)
                && d.model.stop.noise_codes.is_none()
        }),
        story(Quality, c(), "N Down Enter", |_, d| {
            // From the target, half a code, to the next finer one.
            d.model.stop.noise_codes == Some(0.25) && d.model.overlay.is_none()
        }),
        story(Threads(Delta::Up), c(), ":", |_, d| d.asked(|e| *e == Effect::Threads(3))),
        story(Threads(Delta::Down), c(), ":", |_, d| d.asked(|e| *e == Effect::Threads(1))),
        story(Priority, c(), ":", |_, d| d.asked(|e| *e == Effect::LowPriority(true))),
        story(NextColors, c(), "#", |_, d| d.model.colors == Colors::Indexed),
        story(Help, c(), "?", |_, d| matches!(d.model.overlay, Some(Overlay::Help { .. }))),
        story(Palette, c(), ":", |_, d| matches!(d.model.overlay, Some(Overlay::Palette(_)))),
        story(Inventory, c(), ":", |_, d| {
            matches!(d.model.overlay, Some(Overlay::Inventory { .. }))
        }),
    ]
}

fn stories() -> Vec<Story> {
    let chapters = [
        camera_stories(),
        light_and_mirror_stories(),
        object_stories(),
        panel_stories(),
        file_stories(),
        picture_stories(),
    ];
    chapters.into_iter().flatten().collect()
}

#[test]
fn every_action_does_what_its_story_says() {
    let mut told = HashSet::new();
    let mut wrong = Vec::new();
    for Story { action, select, keys, expect } in stories() {
        let row = Row::of(action).unwrap();
        let mut desk = Desk::new(&room_with_views());
        desk.select(select);
        let before = desk.scene().clone();
        match keys.as_str() {
            ":" if action != Palette => drop(desk.palette(row.label)),
            keys => drop(desk.keys(keys)),
        }
        if !desk.fired.contains(&action) {
            wrong.push(format!("{}: {keys} does not fire it", row.label));
        }
        if !expect(&before, &desk) {
            let notice = desk.notice();
            wrong.push(format!("{}: after {keys}: {notice:?}", row.label));
        }
        assert!(desk.scene().faults().is_empty(), "{}", row.label);
        desk.undo_all();
        assert_eq!(desk.text(), room_with_views(), "{}: undone", row.label);
        told.insert(action);
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    KEYMAP.iter().for_each(|row| assert!(told.contains(&row.action), "no story: {}", row.label));
}

/// Whatever has a key can be found by its name too, and then does the same.
#[test]
fn the_palette_finds_every_action_by_its_label() {
    for row in KEYMAP {
        let mut desk = Desk::new(&room_with_views());
        desk.select(BALL);
        desk.palette(row.label);
        assert!(desk.fired.contains(&row.action), "{}", row.label);
        assert!(desk.scene().faults().is_empty(), "{}", row.label);
    }
}
