//! Tests of the camera's frame and of navigation.

use crate::features::row::*;
use crate::harness::*;
use crate::reference::*;

fn target(camera: &Camera) -> DVec3 {
    DVec3::from(camera.target.expect("the camera has a target"))
}

/// Returns the length of the chord that spans `degrees` of a circle.
fn chord(radius: f64, degrees: f64) -> f64 {
    2.0 * radius * (degrees.to_radians() / 2.0).sin()
}

/// Function that returns the camera after the motion with the given name.
type Motion<'a> = &'a dyn Fn(&Camera, &str) -> Camera;

/// Checks that each motion of the camera has the right length and direction and keeps its
/// invariants, and that the picture shows the room from the new viewpoint. `moved` returns the
/// camera after a named motion.
fn moves_correctly(room: &Scene, moved: Motion) -> Verdict {
    // Coordinates of the camera are rounded to about a millionth of the distance from the target.
    let near = |quantity: &str, a: f64, b: f64| {
        ensure((a - b).abs() < 2e-5, || format!("{quantity}: {a} instead of {b}"))
    };
    let old = &room.camera;
    let (eye, aim) = (DVec3::from(old.eye), target(old));
    let distance = eye.distance(aim);
    let ahead = (aim - eye) / distance;
    let right = ahead.cross(DVec3::Y).normalize();
    for motion in ["orbit", "fly", "dolly", "look"] {
        let new = moved(old, motion);
        let (new_eye, new_aim) = (DVec3::from(new.eye), target(&new));
        match motion {
            "orbit" => {
                near("the target moves by", new_aim.distance(aim), 0.0)?;
                near("orbit keeps the distance", new_eye.distance(aim), distance)?;
                near("orbit keeps the height", new_eye.y, eye.y)?;
                let across = (eye - aim).with_y(0.0).length();
                near("length of orbit's move", new_eye.distance(eye), chord(across, 20.0))?;
                ensure((new_eye - eye).dot(right) > 0.0, || "orbit goes new_eye the left".into())?;
            }
            "fly" => {
                let displacement = right * 0.3 + ahead * 0.5;
                near("fly misses by", (new_eye - eye).distance(displacement), 0.0)?;
                near("the target is off by", (new_aim - aim).distance(displacement), 0.0)?;
            }
            "dolly" => {
                near("the target moves by", new_aim.distance(aim), 0.0)?;
                near("dolly misses by", new_eye.distance(eye + ahead * (0.25 * distance)), 0.0)?;
            }
            _ => {
                near("the eye moves by", new_eye.distance(eye), 0.0)?;
                let view = (new_aim - new_eye).normalize();
                near("look keeps the height", view.y, ahead.y)?;
                let flat = |v: DVec3| v.with_y(0.0).normalize();
                near("look's angle", flat(view).dot(flat(ahead)).acos().to_degrees(), 15.0)?;
                ensure(view.dot(right) > 0.0, || "look turns new_eye the left".into())?;
            }
        }
        let scene = Scene { camera: new, ..room.clone() };
        hits_agree(&scene, &scene).map_err(|error| format!("after {motion}: {error}"))?;
    }
    Ok(())
}

fn move_camera(camera: &Camera, motion: &str) -> Camera {
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
    moves_correctly(&room, &move_camera).unwrap();
    let mutations: [(&str, Motion); 4] = [
        ("standing still", &|camera, _| camera.clone()),
        ("look for orbit", &|camera, motion| match motion {
            "orbit" => camera.look(20.0, 0.0),
            other => move_camera(camera, other),
        }),
        ("sideways for ahead", &|camera, motion| match motion {
            "fly" => camera.fly([0.5, 0.0, 0.3]),
            other => move_camera(camera, other),
        }),
        ("zoom for dolly", &|camera, motion| match motion {
            "dolly" => camera.zoom(0.75),
            other => move_camera(camera, other),
        }),
    ];
    for (name, moved) in mutations {
        let error = moves_correctly(&room, moved).expect_err(name);
        println!("{name}: {error}");
    }
}

#[test]
fn b3_camera_frame() {
    let original = shipped("near.toml");
    let by_width = |s: &mut Scene| s.camera.view_angle = ViewAngle::Horizontal(36.0);
    row(
        "near.toml",
        |tested| hits_agree(&original, tested),
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

/// Checks that circles of confusion in the picture of `tested` agree with those of `original`,
/// around two points: a bright bead on the right, and a ball in front of it.
fn discs_agree(original: &Scene, tested: &Scene) -> Verdict {
    [[0.9, 1.5, -6.5], [0.7, 0.35, 2.3]].into_iter().try_for_each(|point| {
        agrees(&zoomed(original, point, 6.0), &zoomed(tested, point, 6.0), 1536)
    })
}

#[test]
fn d1_thin_lens() {
    let original = shipped("depth-of-field.toml");
    let f_number = original.camera.focal_length() / (2.0 * original.camera.lens_radius());
    row(
        "depth-of-field.toml",
        |tested| discs_agree(&original, tested),
        &[
            ("a pinhole", &|s| s.camera.aperture = None),
            ("a smaller lens", &|s| s.camera.aperture = Some(Aperture::Radius(0.10))),
            ("a larger lens", &|s| s.camera.aperture = Some(Aperture::Radius(0.14))),
            ("an f-number", &|s| s.camera.aperture = Some(Aperture::FNumber(f_number))),
            ("focus behind", &|s| s.camera.focus = Some(Focus::Distance(6.0))),
            ("focus in front", &|s| s.camera.focus = Some(Focus::Point([0.7, 0.35, 2.3]))),
        ],
    );
    // The same lens, described by f-number and focus distance.
    let zoomed = zoomed(&original, [0.9, 1.5, -6.5], 6.0);
    let f_number = zoomed.camera.focal_length() / (2.0 * zoomed.camera.lens_radius());
    let mut reworded = zoomed.clone();
    reworded.camera.aperture = Some(Aperture::FNumber(f_number));
    reworded.camera.focus = Some(Focus::Distance(zoomed.camera.focus_depth()));
    agrees(&zoomed, &reworded, 1536).unwrap();
}

#[test]
fn d15_panorama() {
    let original = shipped("panorama.toml");
    row(
        "panorama.toml",
        |tested| hits_agree(&original, tested),
        &[
            ("a perspective", &|s| s.camera.projection = Projection::Perspective),
            ("looking elsewhere", &|s| s.camera.direction = Some([0.33, 0.1, -1.0])),
            ("looking level", &|s| s.camera.direction = Some([0.3, 0.0, -1.0])),
            ("upside down", &|s| s.camera.up = [0.0, -1.0, 0.0]),
            ("another eye", &|s| s.camera.eye[0] += 0.02),
        ],
    );
}
