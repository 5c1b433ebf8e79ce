//! The camera: its frame, and how it is moved and turned.

use crate::row::{Verdict, ensure, row};
use crate::sight::sees;
use crate::support::shipped;
use glam::DVec3;
use zerkalo::camera::{Camera, ViewAngle};
use zerkalo::scene::Scene;

fn target(camera: &Camera) -> DVec3 {
    DVec3::from(camera.target.expect("the camera has a target"))
}

/// The length of a chord that spans `degrees` of a circle.
fn chord(radius: f64, degrees: f64) -> f64 {
    2.0 * radius * (degrees.to_radians() / 2.0).sin()
}

/// A camera after the motion of a name.
type Moved<'a> = &'a dyn Fn(&Camera, &str) -> Camera;

/// Moves and turns go as far as they should, keep what they should keep, and the picture shows the room
/// from there. `moved` is the program's camera by the name of the motion.
fn goes_where_it_should(room: &Scene, moved: Moved) -> Verdict {
    // Numbers of cameras are rounded to about a millionth of the distance to the target.
    let near = |what: &str, a: f64, b: f64| {
        ensure((a - b).abs() < 2e-5, || format!("{what}: {a} instead of {b}"))
    };
    let old = &room.camera;
    let (eye, aim) = (DVec3::from(old.eye), target(old));
    let distance = eye.distance(aim);
    let ahead = (aim - eye) / distance;
    let right = ahead.cross(DVec3::Y).normalize();
    for motion in ["orbit", "fly", "dolly", "look"] {
        let new = moved(old, motion);
        let (to, aims) = (DVec3::from(new.eye), target(&new));
        match motion {
            "orbit" => {
                near("the target moves by", aims.distance(aim), 0.0)?;
                near("orbit keeps the distance", to.distance(aim), distance)?;
                near("orbit keeps the height", to.y, eye.y)?;
                let across = (eye - aim).with_y(0.0).length();
                near("orbit's way", to.distance(eye), chord(across, 20.0))?;
                ensure((to - eye).dot(right) > 0.0, || "orbit goes to the left".into())?;
            }
            "fly" => {
                let way = right * 0.3 + ahead * 0.5;
                near("fly misses by", (to - eye).distance(way), 0.0)?;
                near("the target is left behind by", (aims - aim).distance(way), 0.0)?;
            }
            "dolly" => {
                near("the target moves by", aims.distance(aim), 0.0)?;
                near("dolly misses by", to.distance(eye + ahead * (0.25 * distance)), 0.0)?;
            }
            _ => {
                near("the eye moves by", to.distance(eye), 0.0)?;
                let view = (aims - to).normalize();
                near("look keeps the height", view.y, ahead.y)?;
                let flat = |v: DVec3| v.with_y(0.0).normalize();
                near("look's turn", flat(view).dot(flat(ahead)).acos().to_degrees(), 15.0)?;
                ensure(view.dot(right) > 0.0, || "look turns to the left".into())?;
            }
        }
        let there = Scene { camera: new, ..room.clone() };
        sees(&there, &there).map_err(|found| format!("after {motion}: {found}"))?;
    }
    Ok(())
}

fn program(camera: &Camera, motion: &str) -> Camera {
    match motion {
        "orbit" => camera.orbit(20.0, 0.0, 1.0),
        "fly" => camera.fly([0.3, 0.0, 0.5]),
        "dolly" => camera.dolly(0.75, 1.0),
        _ => camera.look(15.0, 0.0),
    }
}

#[test]
fn a9_camera() {
    let room = shipped("mirror-room.toml");
    goes_where_it_should(&room, &program).unwrap();
    let neighbours: [(&str, Moved); 4] = [
        ("standing still", &|camera, _| camera.clone()),
        ("turning where it should go round", &|camera, motion| match motion {
            "orbit" => camera.look(20.0, 0.0),
            other => program(camera, other),
        }),
        ("moving across where it should fly ahead", &|camera, motion| match motion {
            "fly" => camera.fly([0.5, 0.0, 0.3]),
            other => program(camera, other),
        }),
        ("zooming where it should come nearer", &|camera, motion| match motion {
            "dolly" => camera.zoom(0.75),
            other => program(camera, other),
        }),
    ];
    for (name, moved) in neighbours {
        let found = goes_where_it_should(&room, moved).expect_err(name);
        println!("{name}: {found}");
    }
}

#[test]
fn b3_camera_frame() {
    let meant = shipped("near.toml");
    let by_width = |s: &mut Scene| s.camera.view_angle = ViewAngle::Horizontal(36.0);
    row(
        "near.toml",
        |shown| sees(&meant, shown),
        &[
            ("no near plane", &|s| s.camera.near = 0.0),
            ("a near plane further away", &|s| s.camera.near = 3.6),
            ("the angle across the width", &by_width),
            ("another aspect ratio", &|s| s.camera.view_angle = ViewAngle::Vertical(36.5)),
            ("upside down", &|s| s.camera.up = [0.0, -1.0, 0.0]),
            ("tilted", &|s| s.camera.up = [0.02, 1.0, 0.0]),
            ("looking elsewhere", &|s| s.camera.target = Some([0.0, 0.61, 0.0])),
        ],
    );
}
