//! Stories (scene, keys, expected result) of the command table, at least one for every command.

use super::*;
use zerkalo::dashboard::layout::Focus;
use zerkalo::dashboard::model::{Colors, Mode};
use zerkalo::dashboard::scene_source::SceneSource;
use zerkalo_scene::camera::Focus as LensFocus;
use zerkalo_scene::material::Preset;

const BALL: Target = Target::Object(1);
const GLASS: Target = Target::Object(2);
const TRACE: Target = Target::Settings(SceneSettings::Integrator);

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

/// Returns a story with the camera selected.
fn story(label: &str, keys: &str, expect: impl Fn(&Scene, &Desk) -> bool + 'static) -> Story {
    selected(label, Target::Camera, keys, expect)
}

fn selected(
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

/// Scene, or dashboard with a scene.
trait AsScene {
    fn as_scene(&self) -> &Scene;
}

impl AsScene for Scene {
    fn as_scene(&self) -> &Scene {
        self
    }
}

impl AsScene for Desk {
    fn as_scene(&self) -> &Scene {
        self.scene()
    }
}

fn eye(of: &impl AsScene) -> [f64; 3] {
    of.as_scene().camera.eye
}

fn target(of: &impl AsScene) -> [f64; 3] {
    of.as_scene().camera.target.unwrap()
}

fn mirror(desk: &Desk) -> &Material {
    &desk.scene().materials["mirror"]
}

fn lamp(desk: &Desk) -> &Light {
    &desk.scene().lights[0]
}

fn ball(desk: &Desk) -> [f64; 3] {
    let Shape::Sphere(sphere) = &desk.scene().objects[1].shape else { panic!("no ball") };
    sphere.center
}

fn normal(desk: &Desk) -> [f64; 3] {
    let Shape::Rectangle(rectangle) = &desk.scene().objects[2].shape else { panic!("no glass") };
    rectangle.normal
}

fn camera_stories() -> Vec<Story> {
    let mut stories = vec![
        story("orbit left", "Left", |a, d| eye(d)[0] < 0.0 && target(a) == target(d)),
        story("orbit right", "Right", |_, d| eye(d)[0] > 0.0),
        story("orbit up", "Up", |_, d| eye(d)[1] > 1.0),
        story("orbit down", "Down", |_, d| eye(d)[1] < 1.0),
        story("pan left", "Shift-Left", |_, d| eye(d)[0] < 0.0 && target(d)[0] < 0.0),
        story("pan right", "Shift-Right", |_, d| eye(d)[0] > 0.0 && target(d)[0] > 0.0),
        story("pan up", "Shift-Up", |_, d| eye(d)[1] > 1.0 && target(d)[1] > 1.0),
        story("pan down", "Shift-Down", |_, d| eye(d)[1] < 1.0 && target(d)[1] < 1.0),
        story("dolly in", "PageUp", |_, d| eye(d)[2] < 4.9),
        story("dolly out", "PageDown", |_, d| eye(d)[2] > 5.1),
        story("dolly in, fine", "Shift-PageUp", |_, d| (4.9..5.0).contains(&eye(d)[2])),
        story("dolly out, fine", "Shift-PageDown", |_, d| eye(d)[2] > 5.0 && eye(d)[2] < 5.1),
        story("look left", "Ctrl-Left", |a, d| eye(a) == eye(d) && target(d)[0] < 0.0),
        story("look right", "w Right", |a, d| eye(a) == eye(d) && target(d)[0] > 0.0),
        story("look up", "Ctrl-Up", |a, d| eye(a) == eye(d) && target(d)[1] > 1.0),
        story("look down", "w Down", |a, d| eye(a) == eye(d) && target(d)[1] < 1.0),
        story("roll left", "Alt-Left", |_, d| d.scene().camera.up[0] != 0.0),
        story("roll right", "Alt-Right Alt-Left", |a, d| a.camera == d.scene().camera),
        story("narrower view angle", "Alt-Up", |_, d| d.scene().camera.view_angle.degrees() < 40.0),
        story("wider view angle", "Alt-Down", |_, d| d.scene().camera.view_angle.degrees() > 40.0),
        story("fly the camera", "w", |_, d| d.model.mode == Mode::Fly),
        story("fly forward", "w w", |_, d| eye(d)[2] < 5.0 && target(d)[2] < 0.0),
        story("fly back", "w s", |_, d| eye(d)[2] > 5.0),
        story("fly left", "w a", |_, d| eye(d)[0] < 0.0),
        story("fly right", "w d", |_, d| eye(d)[0] > 0.0),
        story("fly up", "w r", |_, d| eye(d)[1] > 1.0),
        story("fly down", "w f", |_, d| eye(d)[1] < 1.0),
        selected("marks of lights and selection on or off", BALL, "Alt-m", |_, d| {
            !d.model.shows_marks() && d.notice() == "marks off"
        }),
        selected("frame the selection", BALL, "f", |_, d| {
            target(d) == [0.0, 1.0, 0.0] && eye(d)[2] < 3.0
        }),
        story("open the aperture", "Alt-o Alt-o", |_, d| {
            let notice = d.notice();
            d.scene().camera.lens_radius() == 0.12 && notice.contains("aperture 0.12")
        }),
        story("close the aperture", "Alt-o Alt-o Alt-c", |_, d| {
            d.scene().camera.lens_radius() == 0.088
        }),
        selected("focus on the probe or the selection", BALL, "F", |_, d| {
            d.scene().camera.focus == Some(LensFocus::Point([0.0, 1.0, 0.0]))
        }),
        selected("focus on the probe or the selection", BALL, "i F", |_, d| {
            // The probe shows the front of the ball, and the focus is there.
            (d.scene().camera.focus_depth() - 4.5).abs() < 0.01
        }),
        story("back to the camera of the scene", "Left Up h", |a, d| {
            a.camera == d.scene().camera && d.model.free_view.is_none()
        }),
        story("make this view the camera", "Left H", |_, d| {
            eye(d)[0] < 0.0 && d.model.scene().camera == d.scene().camera && d.model.is_unsaved()
        }),
        story("store this viewpoint", "Left n Ctrl-u `door` Enter", |a, d| {
            let scene = d.model.scene();
            scene.cameras["door"] == d.scene().camera && scene.camera == a.camera
        }),
    ];
    for n in 1..=9 {
        stories.push(story("go to viewpoint 1 to 9", &n.to_string(), move |_, d| {
            eye(d)[0] == f64::from(n)
        }));
    }
    stories
}

fn light_and_mirror_stories() -> Vec<Story> {
    vec![
        story("select the next light", "l", |_, d| d.model.selection == Target::Light(0)),
        story("light brighter", "'", |_, d| lamp(d).intensity > 1.05),
        story("light darker", ";", |_, d| lamp(d).intensity < 0.95),
        story("light brighter, fine", "Alt-'", |_, d| (1.04..1.06).contains(&lamp(d).intensity)),
        story("light darker, fine", "Alt-;", |_, d| (0.95..0.999).contains(&lamp(d).intensity)),
        story("light on or off", "L", |_, d| !lamp(d).on),
        story("light group alone, or all light", "Alt-l", |_, d| d.scene().film.solo == "lamp"),
        story("light group alone, or all light", "Alt-l Alt-l", |_, d| {
            d.scene().film.solo.is_empty()
        }),
        story("add a light", "A Enter Enter", |_, d| {
            d.scene().lights.len() == 2 && d.model.selection == Target::Light(1)
        }),
        story("mirror rougher", "]", |_, d| mirror(d).roughness > 0.0525),
        story("mirror smoother", ",", |_, d| mirror(d).roughness < 0.0475),
        story("mirror rougher, fine", "}", |_, d| (0.0501..0.0535).contains(&mirror(d).roughness)),
        story("mirror smoother, fine", "<", |_, d| (0.0475..0.0499).contains(&mirror(d).roughness)),
        story("mirror reflects more", ")", |_, d| mirror(d).reflection > 0.5),
        story("mirror reflects less", "(", |_, d| mirror(d).reflection < 0.5),
        story("next lobe of the mirror", "b", |_, d| mirror(d).lobe == Lobe::Square),
    ]
}

/// Returns keys that mark a copy of the ball, and the ball, before `keys`.
fn joined(keys: &str) -> String {
    format!("D Enter V / `object ball` Enter V {keys}")
}

/// Returns the kind of the selected object.
fn whole(desk: &Desk) -> &'static str {
    let Target::Object(i) = desk.model.selection else { return "" };
    desk.scene().objects[i].shape.key()
}

fn object_stories() -> Vec<Story> {
    vec![
        story("add an object", "a Enter Enter", |_, d| {
            d.scene().objects.len() == 4 && d.model.selection == Target::Object(3)
        }),
        selected("mark or unmark the selection", BALL, "V Tab Down V x", |_, d| {
            d.scene().objects.len() == 1 && d.model.marked.is_empty()
        }),
        selected("duplicate the selection", BALL, "D", |_, d| {
            d.scene().objects.len() == 4 && d.model.selection != BALL
        }),
        selected("union of the marked objects", BALL, &joined("|"), |_, d| whole(d) == "union"),
        selected("intersection of the marked objects", BALL, &joined("&"), |_, d| {
            whole(d) == "intersection"
        }),
        selected("difference: the first marked without the others", BALL, &joined("_"), |_, d| {
            whole(d) == "difference"
        }),
        selected(
            "add a part to the compound",
            BALL,
            &joined("| Alt-a Enter Home Enter"),
            |_, d| d.model.selection == Target::Part(2, vec![2]),
        ),
        selected("dissolve the compound into its parts", BALL, &joined("| B"), |_, d| {
            d.scene().objects.len() == 4
        }),
        selected("scale the selection", BALL, "Alt-s `2` Enter", |_, d| {
            d.scene().objects[1].transform.len() == 2
        }),
        selected("array of the selection", BALL, "Alt-d Enter", |_, d| {
            d.scene().objects.len() == 6
        }),
        selected("delete the selection", BALL, "x", |_, d| {
            d.scene().objects.iter().all(|o| o.name != "ball")
        }),
        selected("rename the selection", BALL, "e Ctrl-u `pearl` Enter", |_, d| {
            d.scene().objects[1].name == "pearl"
        }),
        selected("move the selection", BALL, "m", |_, d| d.model.mode == Mode::Move),
        selected("move left", BALL, "m Left", |_, d| ball(d)[0] < 0.0),
        selected("move right", BALL, "m Right", |_, d| ball(d)[0] > 0.0),
        selected("move away", BALL, "m Up", |_, d| ball(d)[2] < 0.0),
        selected("move nearer", BALL, "m Down", |_, d| ball(d)[2] > 0.0),
        selected("raise", BALL, "m PageUp", |_, d| ball(d)[1] > 1.0),
        selected("lower", BALL, "m PageDown", |_, d| ball(d)[1] < 1.0),
        selected("move left, fine", BALL, "m Right Shift-Left", |_, d| ball(d)[0] > 0.0),
        selected("move right, fine", BALL, "m Left Shift-Right", |_, d| ball(d)[0] < 0.0),
        selected("move away, fine", BALL, "m Down Shift-Up", |_, d| ball(d)[2] > 0.0),
        selected("move nearer, fine", BALL, "m Up Shift-Down", |_, d| ball(d)[2] < 0.0),
        selected("raise, fine", BALL, "m PageDown Shift-PageUp", |_, d| ball(d)[1] < 1.0),
        selected("lower, fine", BALL, "m PageUp Shift-PageDown", |_, d| ball(d)[1] > 1.0),
        selected("move by a typed distance", BALL, "m x `.5` Enter", |_, d| {
            ball(d) == [0.5, 1.0, 0.0] && d.model.mode == Mode::Orbit
        }),
        selected("move by a typed distance", BALL, "m `-1 0 2` Enter", |_, d| {
            ball(d) == [-1.0, 1.0, 2.0]
        }),
        selected("rotate by a typed angle", GLASS, "r `90` Enter", |_, d| {
            normal(d) == [1.0, 0.0, 0.0]
        }),
        selected("rotate the selection", GLASS, "r", |_, d| d.model.mode == Mode::Rotate),
        selected("rotate left", GLASS, "r Left", |_, d| normal(d)[0] < -0.2),
        selected("rotate right", GLASS, "r Right", |_, d| normal(d)[0] > 0.2),
        selected("rotate left, fine", GLASS, "r Shift-Left", |_, d| {
            (-0.02..-0.01).contains(&normal(d)[0])
        }),
        selected("rotate right, fine", GLASS, "r Shift-Right", |_, d| {
            (0.01..0.02).contains(&normal(d)[0])
        }),
        selected("snap the selection to ground", BALL, "g", |_, d| ball(d) == [0.0, 0.5, 0.0]),
        selected("make the selection gold, glass, …", BALL, "S `gold` Enter", |_, d| {
            let material = &d.scene().objects[1].material;
            material == "gold" && d.scene().materials["gold"].preset == Some(Preset::Gold)
        }),
        selected("remove unused materials", BALL, ":", |_, d| {
            d.notice().contains("every material is used")
        }),
        selected("give the object its own material", BALL, "M", |a, d| {
            let material = &d.scene().objects[1].material;
            material != "red" && d.scene().materials[material] == a.materials["red"]
        }),
    ]
}

fn panel_stories() -> Vec<Story> {
    vec![
        story("next panel, or complete, or next group of fields", "Tab", |_, d| {
            d.model.focus == Focus::Outline
        }),
        story("previous panel or group of fields", "Shift-Tab", |_, d| {
            d.model.focus == Focus::Inspector
        }),
        selected("leave, back to the picture", BALL, "m Esc", |_, d| d.model.mode == Mode::Orbit),
        selected("inspect, edit, confirm, choose", BALL, "Enter", |_, d| {
            d.model.focus == Focus::Inspector
        }),
        selected("list the parts of a compound", BALL, &joined("| Tab Right Down"), |_, d| {
            d.model.selection == Target::Part(2, vec![0])
        }),
        selected(
            "hide the parts, select the whole",
            BALL,
            &joined("| Tab Right Down Left Left"),
            |_, d| d.model.selection == Target::Object(2) && d.model.unfolded.is_empty(),
        ),
        story("line below", "Tab Down", |_, d| d.model.selection == Target::View("v1".into())),
        story("line above", "Tab Down Down Up", |_, d| {
            d.model.selection == Target::View("v1".into())
        }),
        story("page down", "Tab PageDown", |_, d| {
            !matches!(d.model.selection, Target::Camera | Target::View(_))
        }),
        selected("page up", TRACE, "Tab PageUp", |_, d| {
            ![&TRACE, &Target::Settings(SceneSettings::Film)].contains(&&d.model.selection)
        }),
        selected("first line", TRACE, "Tab Home", |_, d| d.model.selection == Target::Camera),
        story("last line", "Tab End", |_, d| d.model.selection == TRACE),
        story("field up", "Enter Right", |_, d| eye(d)[0] > 0.05),
        story("field down", "Enter Left", |_, d| eye(d)[0] < -0.05),
        story("field up, fine", "Enter Shift-Right", |_, d| (0.001..0.05).contains(&eye(d)[0])),
        story("field down, fine", "Enter Shift-Left", |_, d| (-0.05..-0.001).contains(&eye(d)[0])),
        story("reset the field to its default", "Enter `7` Enter Down Backspace", |_, d| {
            eye(d) == [0.0, 1.0, 5.0]
        }),
        story("find a field or a part of the scene", "/ `gla` Enter", |_, d| {
            d.model.selection == GLASS
        }),
        story("find a field or a part of the scene", "/ `rou` Enter Enter `.2` Enter", |_, d| {
            mirror(d).roughness == 0.2
        }),
        selected(
            "find a field or a part of the scene",
            GLASS,
            "Enter / `rou` Enter `.2` Enter",
            |_, d| mirror(d).roughness == 0.2,
        ),
        story("only the picture", "z", |_, d| {
            d.model.fullscreen && d.model.layout().unwrap().outline.is_none()
        }),
    ]
}

fn file_stories() -> Vec<Story> {
    vec![
        story("undo", "Enter Right u", |a, d| d.scene() == a && !d.model.is_unsaved()),
        story("list the undo steps", "] } = Alt-u Home Enter", |a, d| d.scene() == a),
        story("redo", "Enter Left u U", |_, d| eye(d)[0] < 0.0),
        story("save", "Enter `7` Enter Ctrl-s", |_, d| {
            d.disk[Path::new(FILE)] == room_with_views().replacen("eye = [0.0", "eye = [7.0", 1)
                && !d.model.is_unsaved()
        }),
        story("write a checkpoint to continue later", "K", |_, d| {
            d.asked(|e| matches!(e, Effect::Checkpoint(_))) && d.notice().contains("room-1.zk")
        }),
        story("save as", "W Ctrl-u `copy` Enter", |_, d| {
            d.disk.contains_key(Path::new("copy.toml")) && d.model.file.name == "copy.toml"
        }),
        story("read the file again", "Ctrl-o", |_, d| d.asked(|e| *e == Effect::Load)),
        story("recover edits of a crashed session", ":", |_, d| d.notice().contains("No session")),
        story("new scene", "] Ctrl-n", |_, d| d.model.next_scene == Some(SceneSource::New)),
        story(
            "open another scene",
            "O",
            |_, d| matches!(&d.model.overlay, Some(Overlay::Pick(pick)) if pick.entries.len() == 2),
        ),
        story("suspend to the shell", "Ctrl-z", |_, d| d.asked(|e| *e == Effect::Suspend)),
        story("quit", "q", |_, d| d.asked(|e| *e == Effect::Quit)),
    ]
}

fn picture_stories() -> Vec<Story> {
    let probe = |d: &Desk| d.model.probe.unwrap();
    let fine = |label, keys, pixel: [usize; 2]| story(label, keys, move |_, d| probe(d) == pixel);
    vec![
        story("write a PNG", "p", |_, d| {
            d.asked(|e| *e == Effect::Export(Format::Png))
                && d.notice().contains("room-1.png  64x48  16 spp  noise 2.50")
        }),
        story("write a PNG when converged", "Alt-p", |_, d| {
            d.model.export_when_done && d.notice().contains("when the picture has converged")
        }),
        story("write an EXR", "P", |_, d| d.asked(|e| *e == Effect::Export(Format::Exr))),
        story("render at another size", "Ctrl-e Ctrl-u `320x240 exr` Enter", |_, d| {
            d.asked(|e| matches!(e, Effect::ExportSized { scene, format: Format::Exr, .. } if scene.film.size == [320, 240])) && d.scene().film.size == [64, 48]
        }),
        story("cancel the running export", "Ctrl-e Enter Ctrl-x", |_, d| {
            d.asked(|e| *e == Effect::CancelExport) && d.model.export.is_none()
        }),
        story("exposure up", "=", |_, d| d.model.display.exposure_ev == 0.25),
        story("exposure down", "-", |_, d| d.model.display.exposure_ev == -0.25),
        story("exposure 0", "= = 0", |_, d| d.model.display.exposure_ev == 0.0),
        story("exposure from the picture", "E", |_, d| d.notice().contains("picture is black")),
        story("next tone curve", "t", |_, d| {
            d.model.display.tone == Tone::Neutral && d.asked(|e| matches!(e, Effect::Display(_)))
        }),
        story("next view: noise, samples, objects, …", "v", |_, d| {
            d.model.channel == DisplayChannel::Noise
        }),
        story("view before", "Alt-v", |_, d| d.model.channel == DisplayChannel::Depth),
        story("zoom in", "Z", |_, d| d.model.zoom.is_some_and(|zoom| zoom.steps == 1)),
        story("zoom out", "Z Z X", |_, d| d.model.zoom.is_some_and(|zoom| zoom.steps == 1)),
        story("zoom fits: the whole picture", "Z Alt-0", |_, d| d.model.zoom.is_none()),
        story("loupe: automatic, always, never", "G", |_, d| d.notice() == "loupe: always"),
        story("next protocol or blocks of the picture", "Alt-#", |_, d| {
            d.notice() == "graphics quadrants: quadrants, as chosen"
        }),
        story("probe a pixel", "i", |_, d| {
            d.asked(|e| matches!(e, Effect::View(view) if view.probe == Some([32, 24])))
                && d.model.mode == Mode::Probe
        }),
        story("probe left", "i Left", move |_, d| probe(d)[0] < 32),
        story("probe right", "i Right", move |_, d| probe(d)[0] > 32),
        story("probe up", "i Up", move |_, d| probe(d)[1] < 24),
        story("copy the path of the last picture", "p y", |_, d| {
            d.asked(|e| matches!(e, Effect::Copy(_)))
        }),
        story("view the last picture", "p o", |_, d| {
            d.asked(|e| matches!(e, Effect::ViewImage { .. }))
        }),
        story("download the last picture", "p Y", |_, d| d.notice().contains("y copies the path")),
        story("probe down", "i Down", move |_, d| probe(d)[1] > 24),
        fine("probe left by one pixel", "i Shift-Left", [31, 24]),
        fine("probe right by one pixel", "i Shift-Right", [33, 24]),
        fine("probe up by one pixel", "i Shift-Up", [32, 23]),
        fine("probe down by one pixel", "i Shift-Down", [32, 25]),
        story("pin this picture", "k", |_, d| d.model.compared().is_some()),
        story("flip between pinned and live", "k c", |_, d| {
            d.model.channel == DisplayChannel::Pinned
        }),
        story("compare: difference, side by side, wipe", "k C C C Left", |_, d| {
            d.model.channel == DisplayChannel::Wipe && d.model.pictures.border < 0.0
        }),
        story("compare with an earlier picture", "k k j Down Enter", |_, d| {
            d.model.channel == DisplayChannel::Pinned && d.model.pictures.chosen == Some(1)
        }),
        story("histogram or convergence", "Alt-h", |_, d| d.model.histogram),
        story("pause or resume", "Space", |_, d| d.model.paused),
        story("restart the picture", "R", |_, d| d.asked(|e| *e == Effect::Restart)),
        story("stop at …", "T Ctrl-u `spp 100, time 5` Enter", |_, d| {
            d.model.stop.spp == Some(100)
                && d.model.stop.seconds == Some(5.0)
                && d.model.stop.noise_levels.is_none()
        }),
        story("noise targets and their times", "N Down Enter", |_, d| {
            // The noise target changes from 0.5 to the next finer one in the list.
            d.model.stop.noise_levels == Some(0.25) && d.model.overlay.is_none()
        }),
        story("measure the noise by bounce", "Alt-n", |_, d| {
            d.asked(|e| matches!(e, Effect::MeasureBounces(_)))
        }),
        story("render only a region, or everything", "Z Z Z Alt-r", |_, d| {
            d.model.region == Some(d.model.layout().unwrap().window)
        }),
        selected("fold or unfold a group of fields", BALL, "Enter / `rad` Enter Alt-f", |_, d| {
            d.model.folded.contains("shape")
        }),
        story("next colour mode of the terminal", "#", |_, d| d.model.colors == Colors::Indexed),
        story("find an action, field or part", ": `mirror sm` Enter", |_, d| {
            mirror(d).roughness < 0.0475
        }),
        story(
            "keys that work here",
            "?",
            |_, d| matches!(&d.model.overlay, Some(Overlay::Pick(pick)) if pick.entries.len() == COMMANDS.len()),
        ),
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
            ":" => drop(desk.palette(&label)),
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
