//! Stories (scene, keys, expected result) of the command table, at least one for every command.

use crate::harness::*;
use crate::stories::simulated_dashboard::{Desk, FILE, ROOM};
use zerkalo::dashboard::layout::Focus;
use zerkalo::dashboard::message::{DisplayChannel, Effect, Format};
use zerkalo::dashboard::model::{Colors, CompareView, Mode};
use zerkalo::dashboard::overlay::Overlay;
use zerkalo::dashboard::update::commands::COMMANDS;
use zerkalo_scene::camera::Focus as LensFocus;

const BALL: Target = Target::Object(1);
const GLASS: Target = Target::Object(2);

/// Expected result of a story: a function of the scene before the keys and of the dashboard after
/// them. It returns `true` if the story has gone as expected.
type Expect = dyn Fn(&Scene, &Desk) -> bool;

/// Story of a command: the selection, the keys that are pressed, and the expected result.
struct Story {
    /// Label of the command that the story tests.
    label: String,
    select: Target,
    /// Keys that are pressed. The text `:` alone means that the story runs the command from the
    /// command palette.
    keys: String,
    expect: Box<Expect>,
}

fn story(
    label: &str,
    select: Target,
    keys: &str,
    expect: impl Fn(&Scene, &Desk) -> bool + 'static,
) -> Story {
    Story { label: label.to_string(), select, keys: keys.to_string(), expect: Box::new(expect) }
}

/// Returns the text of the room with nine stored cameras, each a unit further to the right.
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
        story("orbit left", c(), "Left", |a, d| {
            eye(d.scene())[0] < 0.0 && target(a) == target(d.scene())
        }),
        story("orbit right", c(), "Right", |_, d| eye(d.scene())[0] > 0.0),
        story("orbit up", c(), "Up", |_, d| eye(d.scene())[1] > 1.0),
        story("orbit down", c(), "Down", |_, d| eye(d.scene())[1] < 1.0),
        story("pan left", c(), "Shift-Left", |_, d| {
            eye(d.scene())[0] < 0.0 && target(d.scene())[0] < 0.0
        }),
        story("pan right", c(), "Shift-Right", |_, d| {
            eye(d.scene())[0] > 0.0 && target(d.scene())[0] > 0.0
        }),
        story("pan up", c(), "Shift-Up", |_, d| {
            eye(d.scene())[1] > 1.0 && target(d.scene())[1] > 1.0
        }),
        story("pan down", c(), "Shift-Down", |_, d| {
            eye(d.scene())[1] < 1.0 && target(d.scene())[1] < 1.0
        }),
        story("dolly in", c(), "PageUp", |_, d| eye(d.scene())[2] < 4.9),
        story("dolly out", c(), "PageDown", |_, d| eye(d.scene())[2] > 5.1),
        story("dolly in, fine", c(), "Shift-PageUp", |_, d| {
            (4.9..5.0).contains(&eye(d.scene())[2])
        }),
        story("dolly out, fine", c(), "Shift-PageDown", |_, d| {
            eye(d.scene())[2] > 5.0 && eye(d.scene())[2] < 5.1
        }),
        story("look left", c(), "Ctrl-Left", |a, d| {
            eye(a) == eye(d.scene()) && target(d.scene())[0] < 0.0
        }),
        story("look right", c(), "w Right", |a, d| {
            eye(a) == eye(d.scene()) && target(d.scene())[0] > 0.0
        }),
        story("look up", c(), "Ctrl-Up", |a, d| {
            eye(a) == eye(d.scene()) && target(d.scene())[1] > 1.0
        }),
        story("look down", c(), "w Down", |a, d| {
            eye(a) == eye(d.scene()) && target(d.scene())[1] < 1.0
        }),
        story("roll left", c(), "Alt-Left", |_, d| camera(d.scene()).up[0] != 0.0),
        story("roll right", c(), "Alt-Right Alt-Left", |a, d| camera(a) == camera(d.scene())),
        story("narrower view angle", c(), "Alt-Up", |_, d| {
            camera(d.scene()).view_angle.key_degrees().1 < 40.0
        }),
        story("wider view angle", c(), "Alt-Down", |_, d| {
            camera(d.scene()).view_angle.key_degrees().1 > 40.0
        }),
        story("fly the camera", c(), "w", |_, d| d.model.mode == Mode::Fly),
        story("fly forward", c(), "w w", |_, d| {
            eye(d.scene())[2] < 5.0 && target(d.scene())[2] < 0.0
        }),
        story("fly back", c(), "w s", |_, d| eye(d.scene())[2] > 5.0),
        story("fly left", c(), "w a", |_, d| eye(d.scene())[0] < 0.0),
        story("fly right", c(), "w d", |_, d| eye(d.scene())[0] > 0.0),
        story("fly up", c(), "w r", |_, d| eye(d.scene())[1] > 1.0),
        story("fly down", c(), "w f", |_, d| eye(d.scene())[1] < 1.0),
        story("frame the selection", BALL, "f", |_, d| {
            target(d.scene()) == [0.0, 1.0, 0.0] && eye(d.scene())[2] < 3.0
        }),
        story("open the aperture", c(), "* *", |_, d| {
            let notice = d.notice();
            d.scene().camera.lens_radius() == 0.12 && notice.contains("aperture 0.12")
        }),
        story("close the aperture", c(), "* * /", |_, d| d.scene().camera.lens_radius() == 0.088),
        story("focus on the probe or the selection", BALL, "F", |_, d| {
            d.scene().camera.focus == Some(LensFocus::Point([0.0, 1.0, 0.0]))
        }),
        story("focus on the probe or the selection", BALL, "i F", |_, d| {
            // The probe shows the front of the ball, and the focus is there.
            (d.scene().camera.focus_depth() - 4.5).abs() < 0.01
        }),
        story("reset the camera to the file", c(), "Left Up Home", |a, d| {
            camera(a) == camera(d.scene())
        }),
        story("store this viewpoint", c(), "n Ctrl-u `door` Enter", |a, d| {
            d.scene().cameras["door"] == a.camera
        }),
    ];
    for n in 1..=9 {
        stories.push(story(&format!("go to viewpoint {n}"), c(), &n.to_string(), move |_, d| {
            eye(d.scene())[0] == f64::from(n)
        }));
    }
    stories
}

fn light_and_mirror_stories() -> Vec<Story> {
    let c = || Target::Camera;
    vec![
        story("select the next light", c(), "l", |_, d| d.model.selection == Target::Light(0)),
        story("light brighter", c(), "'", |_, d| lamp(d.scene()).intensity > 1.05),
        story("light darker", c(), ";", |_, d| lamp(d.scene()).intensity < 0.95),
        story("light brighter, fine", c(), "Alt-'", |_, d| {
            (1.001..1.05).contains(&lamp(d.scene()).intensity)
        }),
        story("light darker, fine", c(), "Alt-;", |_, d| {
            (0.95..0.999).contains(&lamp(d.scene()).intensity)
        }),
        story("light on or off", c(), "L", |_, d| !lamp(d.scene()).on),
        story("add a light", c(), "A Enter Enter", |_, d| {
            d.scene().lights.len() == 2 && d.model.selection == Target::Light(1)
        }),
        story("mirror rougher", c(), "]", |_, d| mirror(d.scene()).roughness > 0.0525),
        story("mirror smoother", c(), ",", |_, d| mirror(d.scene()).roughness < 0.0475),
        story("mirror rougher, fine", c(), "}", |_, d| {
            (0.0501..0.0525).contains(&mirror(d.scene()).roughness)
        }),
        story("mirror smoother, fine", c(), "<", |_, d| {
            (0.0475..0.0499).contains(&mirror(d.scene()).roughness)
        }),
        story("mirror reflects more", c(), ")", |_, d| mirror(d.scene()).reflection > 0.5),
        story("mirror reflects less", c(), "(", |_, d| mirror(d.scene()).reflection < 0.5),
        story("next lobe of the mirror", c(), "b", |_, d| mirror(d.scene()).lobe == Lobe::Square),
    ]
}

fn object_stories() -> Vec<Story> {
    let c = || Target::Camera;
    vec![
        story("add an object", c(), "a Enter Enter", |_, d| {
            d.scene().objects.len() == 4 && d.model.selection == Target::Object(3)
        }),
        story("duplicate the selection", BALL, "D", |_, d| {
            d.scene().objects.len() == 4 && d.model.selection != BALL
        }),
        story("delete the selection", BALL, "x", |_, d| {
            d.scene().objects.iter().all(|o| o.name != "ball")
        }),
        story("rename the selection", BALL, "e Ctrl-u `pearl` Enter", |_, d| {
            d.scene().objects[1].name == "pearl"
        }),
        story("move the selection", BALL, "m", |_, d| d.model.mode == Mode::Move),
        story("move left", BALL, "m Left", |_, d| ball(d.scene())[0] < 0.0),
        story("move right", BALL, "m Right", |_, d| ball(d.scene())[0] > 0.0),
        story("move away", BALL, "m Up", |_, d| ball(d.scene())[2] < 0.0),
        story("move nearer", BALL, "m Down", |_, d| ball(d.scene())[2] > 0.0),
        story("raise", BALL, "m PageUp", |_, d| ball(d.scene())[1] > 1.0),
        story("lower", BALL, "m PageDown", |_, d| ball(d.scene())[1] < 1.0),
        story("move left, fine", BALL, "m Right Shift-Left", |_, d| ball(d.scene())[0] > 0.0),
        story("move right, fine", BALL, "m Left Shift-Right", |_, d| ball(d.scene())[0] < 0.0),
        story("move away, fine", BALL, "m Down Shift-Up", |_, d| ball(d.scene())[2] > 0.0),
        story("move nearer, fine", BALL, "m Up Shift-Down", |_, d| ball(d.scene())[2] < 0.0),
        story("raise, fine", BALL, "m PageDown Shift-PageUp", |_, d| ball(d.scene())[1] < 1.0),
        story("lower, fine", BALL, "m PageUp Shift-PageDown", |_, d| ball(d.scene())[1] > 1.0),
        story("turn the selection", GLASS, "r", |_, d| d.model.mode == Mode::Rotate),
        story("turn left", GLASS, "r Left", |_, d| normal(d.scene())[0] < -0.2),
        story("turn right", GLASS, "r Right", |_, d| normal(d.scene())[0] > 0.2),
        story("turn left, fine", GLASS, "r Shift-Left", |_, d| {
            (-0.02..-0.01).contains(&normal(d.scene())[0])
        }),
        story("turn right, fine", GLASS, "r Shift-Right", |_, d| {
            (0.01..0.02).contains(&normal(d.scene())[0])
        }),
        story("snap the selection to ground", BALL, "g", |_, d| ball(d.scene()) == [0.0, 0.5, 0.0]),
        story("give the object its own material", BALL, "M", |a, d| {
            let material = &d.scene().objects[1].material;
            material != "red" && d.scene().materials[material] == a.materials["red"]
        }),
    ]
}

fn panel_stories() -> Vec<Story> {
    let c = || Target::Camera;
    vec![
        story("next panel or field", c(), "Tab", |_, d| d.model.focus == Focus::Outline),
        story("previous panel or field", c(), "Shift-Tab", |_, d| {
            d.model.focus == Focus::Inspector
        }),
        story("leave, back to the picture", BALL, "m Esc", |_, d| d.model.mode == Mode::Orbit),
        story("inspect, type a value, choose", BALL, "Enter", |_, d| {
            d.model.focus == Focus::Inspector
        }),
        story("line below", c(), "Tab Down", |_, d| d.model.selection == Target::View("v1".into())),
        story("line above", c(), "Tab Down Down Up", |_, d| {
            d.model.selection == Target::View("v1".into())
        }),
        story("page down", c(), "Tab PageDown", |_, d| {
            !matches!(d.model.selection, Target::Camera | Target::View(_))
        }),
        story("page up", Target::IntegratorSettings, "Tab PageUp", |_, d| {
            !matches!(d.model.selection, Target::IntegratorSettings | Target::Film)
        }),
        story("first line", Target::IntegratorSettings, "Tab Home", |_, d| {
            d.model.selection == Target::Camera
        }),
        story("last line", c(), "Tab End", |_, d| d.model.selection == Target::IntegratorSettings),
        story("field up", c(), "Enter Right", |_, d| eye(d.scene())[0] > 0.05),
        story("field down", c(), "Enter Left", |_, d| eye(d.scene())[0] < -0.05),
        story("field up, fine", c(), "Enter Shift-Right", |_, d| {
            (0.001..0.05).contains(&eye(d.scene())[0])
        }),
        story("field down, fine", c(), "Enter Shift-Left", |_, d| {
            (-0.05..-0.001).contains(&eye(d.scene())[0])
        }),
        story("reset the field to its default", c(), "Enter `7` Enter Down Backspace", |_, d| {
            eye(d.scene()) == [0.0, 1.0, 5.0]
        }),
        story("only the picture", c(), "z", |_, d| {
            d.model.fullscreen && d.model.layout().unwrap().outline.is_none()
        }),
    ]
}

fn file_stories() -> Vec<Story> {
    let c = || Target::Camera;
    vec![
        story("undo", c(), "Left u", |a, d| d.scene() == a && !d.model.is_unsaved()),
        story("redo", c(), "Left u U", |_, d| eye(d.scene())[0] < 0.0),
        story("save", c(), "Enter `7` Enter Ctrl-s", |_, d| {
            d.disk[Path::new(FILE)] == room_with_views().replacen("eye = [0.0", "eye = [7.0", 1)
                && !d.model.is_unsaved()
        }),
        story("write a checkpoint to continue later", c(), "K", |_, d| {
            d.asked(|e| matches!(e, Effect::Checkpoint(_))) && d.notice().contains("room-1.zk")
        }),
        story("save as", c(), "W Ctrl-u `copy` Enter", |_, d| {
            d.disk.contains_key(Path::new("copy.toml")) && d.model.file.name == "copy.toml"
        }),
        story("read the file again", c(), "Ctrl-o", |_, d| d.asked(|e| *e == Effect::Load)),
        story("recover edits of a crashed session", c(), ":", |_, d| {
            d.notice().contains("No session")
        }),
        story("suspend to the shell", c(), "Ctrl-z", |_, d| d.asked(|e| *e == Effect::Suspend)),
        story("quit", c(), "q", |_, d| d.asked(|e| *e == Effect::Quit)),
    ]
}

fn picture_stories() -> Vec<Story> {
    let c = || Target::Camera;
    let probe = |d: &Desk| d.model.probe.unwrap();
    let fine =
        |label, keys, pixel: [usize; 2]| story(label, c(), keys, move |_, d| probe(d) == pixel);
    vec![
        story("write a PNG", c(), "p", |_, d| {
            d.asked(|e| *e == Effect::Export(Format::Png))
                && d.notice().contains("room-1.png  64x48  16 spp  noise 2.50")
        }),
        story("write an EXR", c(), "P", |_, d| d.asked(|e| *e == Effect::Export(Format::Exr))),
        story("render at another size", c(), "Ctrl-e Ctrl-u `320x240 exr` Enter", |_, d| {
            d.asked(|e| matches!(e, Effect::ExportSized { scene, format: Format::Exr, .. } if scene.film.size == [320, 240])) && d.scene().film.size == [64, 48]
        }),
        story("cancel the running export", c(), "Ctrl-e Enter Ctrl-x", |_, d| {
            d.asked(|e| *e == Effect::CancelExport) && d.model.export.is_none()
        }),
        story("exposure up", c(), "=", |_, d| d.model.display.exposure_ev == 0.25),
        story("exposure down", c(), "-", |_, d| d.model.display.exposure_ev == -0.25),
        story("exposure 0", c(), "= = 0", |_, d| d.model.display.exposure_ev == 0.0),
        story("next tone curve", c(), "t", |_, d| {
            d.model.display.tone == Tone::Neutral && d.asked(|e| matches!(e, Effect::Display(_)))
        }),
        story("next view: noise, samples, objects, …", c(), "v", |_, d| {
            d.model.channel == DisplayChannel::Noise
        }),
        story("view before", c(), "V", |_, d| d.model.channel == DisplayChannel::Depth),
        story("probe a pixel", c(), "i", |_, d| {
            d.asked(|e| matches!(e, Effect::View(view) if view.probe == Some([32, 24])))
                && d.model.mode == Mode::Probe
        }),
        story("probe left", c(), "i Left", move |_, d| probe(d)[0] < 32),
        story("probe right", c(), "i Right", move |_, d| probe(d)[0] > 32),
        story("probe up", c(), "i Up", move |_, d| probe(d)[1] < 24),
        story("copy the path of the last picture", c(), "p y", |_, d| {
            d.asked(|e| matches!(e, Effect::Copy(_)))
        }),
        story("view the last picture", c(), "p o", |_, d| {
            d.asked(|e| matches!(e, Effect::ViewImage { .. }))
        }),
        story("probe down", c(), "i Down", move |_, d| probe(d)[1] > 24),
        fine("probe left by one pixel", "i Shift-Left", [31, 24]),
        fine("probe right by one pixel", "i Shift-Right", [33, 24]),
        fine("probe up by one pixel", "i Shift-Up", [32, 23]),
        fine("probe down by one pixel", "i Shift-Down", [32, 25]),
        story("pin this picture", c(), "k", |_, d| d.model.comparison.pinned.is_some()),
        story("flip between pinned and live", c(), "k c", |_, d| {
            d.model.comparison.shown == CompareView::Pinned
        }),
        story("difference of pinned and live", c(), "k C", |_, d| {
            d.model.comparison.shown == CompareView::Difference
        }),
        story("pause or resume", c(), "Space", |_, d| {
            d.model.paused && d.asked(|e| *e == Effect::Pause(true))
        }),
        story("restart the picture", c(), "R", |_, d| d.asked(|e| *e == Effect::Restart)),
        story("stop at …", c(), "T Ctrl-u `spp 100, time 5` Enter", |_, d| {
            d.model.stop.spp == Some(100)
                && d.model.stop.seconds == Some(5.0)
                && d.model.stop.noise_levels.is_none()
        }),
        story("noise targets and their times", c(), "N Down Enter", |_, d| {
            // The noise target changes from 0.5 to the next finer one in the list.
            d.model.stop.noise_levels == Some(0.25) && d.model.overlay.is_none()
        }),
        story("more threads", c(), ":", |_, d| d.asked(|e| *e == Effect::Threads(3))),
        story("fewer threads", c(), ":", |_, d| d.asked(|e| *e == Effect::Threads(1))),
        story("low or normal priority", c(), ":", |_, d| {
            d.asked(|e| *e == Effect::LowPriority(true))
        }),
        story("next colour mode of the terminal", c(), "#", |_, d| {
            d.model.colors == Colors::Indexed
        }),
        story("all keys", c(), "?", |_, d| matches!(d.model.overlay, Some(Overlay::Help { .. }))),
        story("find an action", c(), ":", |_, d| {
            matches!(d.model.overlay, Some(Overlay::CommandPalette(_)))
        }),
        story("inventory of the scene", c(), ":", |_, d| {
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
fn every_command_does_what_its_story_expects() {
    let mut with_story = HashSet::new();
    let mut wrong = Vec::new();
    for Story { label, select, keys, expect } in stories() {
        let mut desk = Desk::new(&room_with_views());
        desk.select(select);
        let before = desk.scene().clone();
        match keys.as_str() {
            ":" if label != "find an action" => drop(desk.palette(&label)),
            keys => drop(desk.keys(keys)),
        }
        if !desk.fired.contains(label.as_str()) {
            wrong.push(format!("{label}: {keys} does not run it"));
        }
        if !expect(&before, &desk) {
            let notice = desk.notice();
            wrong.push(format!("{label}: after {keys}: {notice:?}"));
        }
        assert!(desk.scene().faults().is_empty(), "{label}");
        desk.undo_all();
        assert_eq!(desk.text(), room_with_views(), "{label}: undone");
        with_story.insert(label);
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    for command in COMMANDS {
        assert!(with_story.contains(command.label), "no story: {}", command.label);
    }
}

#[test]
fn palette_finds_every_command_by_its_label() {
    for command in COMMANDS {
        let mut desk = Desk::new(&room_with_views());
        desk.select(BALL);
        desk.palette(command.label);
        assert!(desk.fired.contains(command.label), "{}", command.label);
        assert!(desk.scene().faults().is_empty(), "{}", command.label);
    }
}
