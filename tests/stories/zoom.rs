//! Stories of the zoomed picture and of the loupe.

use super::*;
use zerkalo_render::film::{Detail, Window};
use zerkalo_render::session::View;

/// Returns the dashboard on the room with a film of 640 x 480 pixels.
fn large() -> Desk {
    Desk::new(&ROOM.replace("[64, 48]", "[640, 480]"))
}

fn window(desk: &Desk) -> Window {
    desk.model.layout().unwrap().window
}

#[test]
fn zoom_shows_a_window_of_the_film() {
    let mut desk = large();
    let whole = Window::whole([640, 480]);
    assert_eq!(window(&desk), whole);
    desk.keys("Z Z Z Z");
    let layout = desk.model.layout().unwrap();
    assert!(layout.raster == layout.window.size.map(|n| 2 * n), "{layout:?}");
    let size = layout.window.size;
    assert_eq!(window(&desk).origin, [320 - size[0] / 2, 240 - size[1] / 2]);
    assert!(desk.asked(|e| matches!(e, Effect::View(view) if view.window == Some(layout.window)
        && view.raster == Some(size))));
    // What is in the middle of the film is still picked there.
    let [x, y] =
        [layout.image.x + layout.image.width / 2, layout.image.y + layout.image.height / 2];
    desk.click(x, y);
    assert_eq!(desk.model.selection, Target::Object(1), "the ball");
    // Drags and arrows pan, and leave the camera alone.
    desk.select(Target::Camera);
    desk.drag(Button::Left, [x, y], [8, -4]);
    let moved = window(&desk).origin;
    assert_eq!(moved, [320 - size[0] / 2 - 4, 240 - size[1] / 2 + 4]);
    desk.keys("Left Up");
    assert!(window(&desk).origin[0] < moved[0] && window(&desk).origin[1] < moved[1]);
    for _ in 0..90 {
        desk.keys("Right Down");
    }
    assert_eq!(window(&desk).origin, [640 - size[0], 480 - size[1]], "as far as the film reaches");
    // The window follows the probe.
    desk.keys("i");
    assert!(window(&desk).contains([320, 240]), "{:?}", window(&desk));
    desk.keys("Esc Esc");
    assert_eq!(window(&desk), whole);
    desk.keys("Z X X");
    assert_eq!(window(&desk), whole);
    assert!(desk.notice().contains("whole picture"), "{}", desk.notice());
    assert_eq!(desk.model.history.undo(), None, "the scene has not changed");
}

#[test]
fn wheel_zooms_about_the_mouse() {
    let mut desk = large();
    let image = desk.model.layout().unwrap().image;
    let (column, row) = (image.x + image.width / 4, image.y + image.height / 4);
    let pixel = |desk: &Desk| desk.model.layout().unwrap().film_pixel(column, row).unwrap();
    let before = pixel(&desk);
    let kind = MouseKind::Scroll(1);
    for _ in 0..3 {
        desk.send(Message::Mouse(Mouse { kind, column, row, modified: true }));
    }
    let after = pixel(&desk);
    assert!((0..2).all(|i| after[i].abs_diff(before[i]) <= 8), "{before:?} {after:?}");
    assert!(window(&desk).size[0] < 320);
}

#[test]
fn region_is_what_is_zoomed_or_selected() {
    let mut desk = large();
    let region = |desk: &Desk| desk.model.requested.region;
    desk.keys("Alt-r");
    assert!(desk.notice().contains("Zoom in"), "{}", desk.notice());
    desk.keys("Z Z Z");
    let zoomed = window(&desk);
    desk.keys("Alt-r Esc");
    assert_eq!((region(&desk), desk.model.zoom), (Some(zoomed), None));
    desk.keys("Alt-r");
    assert_eq!(region(&desk), None);
    desk.keys("Z Z Z Alt-r Esc : `set size 32x24` Enter");
    assert_eq!(region(&desk), None, "it is outside of the smaller film");
    let mut desk = rendered(8);
    let (ball, hits) =
        (Target::Object(0), desk.model.snapshot.as_ref().unwrap().first_hits.clone());
    desk.select(ball);
    desk.keys("Alt-r");
    let Window { origin, size } = region(&desk).unwrap();
    let hits = hits.unwrap();
    let object = |x, y| hits.at_pixel([x, y]).unwrap().object;
    assert!((origin[0]..origin[0] + size[0]).any(|x| object(x, origin[1]) == Some(0)));
    assert!((0..240).all(|x| origin[1] < 4 || object(x, origin[1] - 4) != Some(0)));
    assert_eq!(desk.model.outlined().len(), 2);
}

/// Renders the scene that opens by itself, with a film of fewer pixels, until it has `spp` samples per pixel.
/// Returns the dashboard with the final snapshot.
fn rendered(spp: u32) -> Desk {
    let mut desk = Desk::new(&sized(shipped("lamp-and-mirror.toml"), [240, 180]).to_text());
    desk.keys("G");
    let mut session = new_session(2, 1, spp_stop(spp), false);
    session.set_scene(Arc::clone(desk.model.scene()));
    let mut view = View::default();
    for _ in 0..4000 {
        if std::mem::replace(&mut view, desk.model.requested) != desk.model.requested {
            session.set_view(desk.model.requested);
        }
        let snapshot = session.wait(Duration::from_secs(60)).expect("a snapshot in time");
        let finished = matches!(snapshot.report.state, State::Finished(_));
        let window = snapshot.detail.as_ref().map(|detail| detail.window);
        desk.send(Message::Snapshot(Box::new(snapshot)));
        let wanted = desk.model.requested.detail.map(|(window, _)| window);
        if finished && window.is_some() && window == wanted {
            return desk;
        }
    }
    panic!("no loupe: {:?}", desk.model.requested);
}

/// Checks that grain is seen to dissolve in the loupe, which shows the mirror.
#[test]
fn loupe_shows_the_grain_of_the_mirror() {
    let [early, later, last] = [8, 32, 512].map(|spp| {
        let desk = rendered(spp);
        let hits = desk.model.snapshot.as_ref().unwrap().first_hits.clone().unwrap();
        let target = desk.model.loupe.target.unwrap();
        assert!(hits.at_pixel(target).unwrap().reflects, "{target:?}");
        desk.model.loupe.detail.clone().unwrap()
    });
    let rms = |detail: &Detail| {
        let pairs = detail.pixels.as_flattened().iter().zip(last.pixels.as_flattened());
        let sum: f64 = pairs.map(|(a, b)| f64::from(a.abs_diff(*b)).powi(2)).sum();
        (sum / (3 * last.pixels.len()) as f64).sqrt()
    };
    let [early, later] = [rms(&early), rms(&later)];
    println!("{:?}: {early:.1} levels after 8 samples, {later:.1} after 32", last.window);
    assert!(early >= 12.0 && later >= 4.0, "{early} {later}");
}
