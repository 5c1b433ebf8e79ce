//! Keys that change the roughness of a mirror: they must change the pixels that show the mirror and
//! leave all others equal in every bit.

use super::*;
use ratatui::buffer::{Buffer, Cell};
use ratatui::layout::Rect;
use zerkalo::dashboard::view::View;
use zerkalo_render::FirstHitBuffer;
use zerkalo_render::film::Window;

const SIZE: [u32; 2] = [96, 72];
const SAMPLES: u32 = 16;

/// Renders a scene with uniform sampling and a fixed seed.
fn picture(scene: &Scene) -> RenderState {
    rendered(&sized(scene.clone(), SIZE), 0, Precision::Auto, SAMPLES)
}

/// Returns one value for each pixel: `true` if the pixel differs in any bit between `a` and `b`.
fn changed(a: &RenderState, b: &RenderState) -> Vec<bool> {
    let [width, height] = SIZE.map(|n| n as usize);
    let pixel = |r: &RenderState, i: usize| r.film.pixel(i % width, i / width, &r.weights);
    (0..width * height).map(|i| pixel(a, i) != pixel(b, i)).collect()
}

/// Renders the scene with changes to each material for whose name `of` returns `true`: another
/// colour and a higher ambient coefficient. Compared with [`picture`], this changes the pixels
/// whose paths hit one of these materials.
fn marked(scene: &Scene, of: impl Fn(&str) -> bool) -> RenderState {
    let mut scene = scene.clone();
    for (_, material) in scene.materials.iter_mut().filter(|(name, _)| of(name)) {
        material.color = Color([0.9, 0.8, 0.7]);
        material.ambient += 3.0;
    }
    picture(&scene)
}

#[test]
fn roughness_changes_only_pixels_of_the_mirror() {
    let mut desk = Desk::new(MIRROR_ROOM);
    let smooth = desk.scene().clone();
    // The roughness grows from 0.04 to about 0.1. Such a small blur leaves the centres of shadows
    // unchanged, because they are evenly lit.
    desk.keys("] ] ] ] ] ] ] ] ] ]");
    let rough = desk.scene().clone();
    let roughness = |scene: &Scene| scene.materials["mirror"].roughness;
    assert!(roughness(&rough) > 2.0 * roughness(&smooth), "{}", roughness(&rough));

    let before = picture(&smooth);
    let by_keys = changed(&before, &picture(&rough));
    let met_mirror = changed(&before, &marked(&smooth, |name| name == "mirror"));
    let unmet = |i: &usize| !met_mirror[*i];
    let (mut same, mut wrong) = (0, Vec::new());
    for i in (0..by_keys.len()).filter(unmet) {
        if by_keys[i] { wrong.push(i) } else { same += 1 }
    }
    assert!(wrong.is_empty(), "pixels whose paths never met the mirror changed: {wrong:?}");
    assert!(same > 1000, "only {same} pixels have nothing to do with the mirror");

    // Finds the pixels in which the mirror reflects an object, and not only the background.
    let [width, height] = SIZE.map(|n| n as usize);
    let size = [width, height];
    let look = |points: &[[f64; 2]], seen: &mut [FirstHit]| before.world.first_hit(points, seen);
    let seen = FirstHitBuffer::new(Window::whole(size), size, look, &pool(2));
    let mirror = smooth.objects.iter().position(|o| o.name == "mirror").unwrap() as u32;
    let others = changed(&before, &marked(&smooth, |name| name != "mirror"));
    let shows = |i: &usize| seen.texels[*i].object == Some(mirror) && others[*i];
    let reflections: Vec<usize> = (0..by_keys.len()).filter(shows).collect();
    let blurred = reflections.iter().filter(|i| by_keys[**i]).count();
    println!("{blurred} of {} reflections of objects changed", reflections.len());
    assert!(reflections.len() > 300, "{}", reflections.len());
    assert!(10 * blurred >= 9 * reflections.len(), "{blurred} of {}", reflections.len());
}

/// Checks that `]`, also held, begins with the samples of the smoother mirror, that `[` shows its picture
/// again, that `R` renders afresh, and that the screen says which picture is mixed.
#[test]
fn rougher_mirror_begins_with_samples_of_the_smoother_one() {
    let mut desk = Desk::new(ROOM);
    let mut session = new_session(2, 1, spp_stop(16), false);
    let mut shows_mixed = |keys: &str| {
        let mut generation = 0;
        for key in keys.split(' ') {
            desk.effects.clear();
            desk.keys(key);
            generation = match desk.asked(|effect| *effect == Effect::Restart) {
                true => session.restart(),
                false => session.set_scene(Arc::clone(desk.model.scene())),
            };
        }
        loop {
            let snapshot = session.wait(Duration::from_secs(60)).expect("a snapshot in time");
            let report = &snapshot.report;
            let finished = matches!(report.state, State::Finished(_));
            if finished && report.generation == generation {
                let mixed = report.mixed;
                desk.send(Message::Snapshot(Box::new(snapshot)));
                let mut screen = Buffer::empty(Rect::new(0, 0, 120, 36));
                View::default().draw(&desk.model, &mut screen);
                let text: String = screen.content().iter().map(Cell::symbol).collect();
                assert_eq!(text.contains("mixed"), mixed, "{text}");
                return mixed;
            }
        }
    };
    assert!(!shows_mixed(""), "the first picture");
    assert!(shows_mixed("] ] ]"), "a rougher mirror");
    assert!(!shows_mixed("[ [ ["), "the first picture again");
    assert!(shows_mixed("]") && !shows_mixed("R"), "rendered afresh");
}
