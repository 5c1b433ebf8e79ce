//! Stories of `zerkalo watch`. Reports must change the table of files, and no key may edit the
//! scene or start a render.

use super::*;
use zerkalo::dashboard::key_context::KeyContext;
use zerkalo_render::session::{WatchReport, WatchedShards, WatchedState};

fn shard(number: usize, state: WatchedState) -> WatchedShards {
    WatchedShards {
        shards: number.to_string(),
        path: Some(format!("job-{number}.zk").into()),
        state,
        samples: 10,
        total: Some(20),
        age: Some(Duration::from_secs(5)),
    }
}

fn report(shards: Vec<WatchedShards>) -> WatchReport {
    WatchReport {
        complete: Some([1, shards.len()]),
        shards,
        progress: Some(0.5),
        target_levels: Some(0.25),
        size: Some([320, 200]),
        display: Display { exposure_ev: 1.0, ..Display::default() },
        source: "rooms/blue.toml".to_string(),
    }
}

pub fn watching(rows: usize) -> Desk {
    let mut desk = Desk::new(MIRROR_ROOM);
    let rows = (0..rows).map(|number| shard(number, WatchedState::Running)).collect();
    desk.send(Message::Watched(Box::new(report(rows))));
    desk.effects.clear();
    desk
}

/// Returns `true` if the effect shows, exports or quits, and `false` for effects that edit the
/// scene or start a render.
fn only_shows(effect: &Effect) -> bool {
    matches!(
        effect,
        Effect::Display(_)
            | Effect::View(_)
            | Effect::Pin { .. }
            | Effect::Export(_)
            | Effect::ViewImage { .. }
            | Effect::Copy(_)
            | Effect::Suspend
            | Effect::Quit
    )
}

fn notice(desk: &Desk) -> &str {
    desk.model.notice.as_ref().map_or("", |notice| &notice.text)
}

#[test]
fn every_key_edits_and_renders_nothing() {
    for command in COMMANDS {
        for (context, names) in command.keys {
            if *context == KeyContext::Overlay {
                continue;
            }
            for name in names.split(' ') {
                for before in ["", "Tab", "i"] {
                    let mut desk = watching(3);
                    let scene = desk.scene().clone();
                    desk.keys(before).keys(name);
                    let label = command.label;
                    assert!(desk.effects.iter().all(only_shows), "{label}: {:?}", desk.effects);
                    assert!(*desk.scene() == scene && !desk.model.is_unsaved(), "{label}");
                    assert!(desk.model.watch.is_some(), "{label}");
                }
            }
        }
    }
    let mut desk = watching(3);
    for name in ["x", "Space", "K", "Ctrl-s", "N", "w"] {
        desk.keys(name);
        assert!(notice(&desk).starts_with("Read-only: "), "{name}: {}", notice(&desk));
    }
}

#[test]
fn palette_has_the_keys_that_work() {
    let mut desk = watching(3);
    desk.keys("?");
    let Some(Overlay::Pick(pick)) = &desk.model.overlay else { panic!("no palette") };
    let listed: Vec<_> = pick.entries.iter().map(|entry| (&*entry.keys, &*entry.name)).collect();
    for (keys, label) in &listed {
        let mut desk = watching(3);
        let first = keys.split([' ', ',']).next().unwrap();
        desk.keys(if keys.contains("probing") && first != "Esc" { "i" } else { "" }).keys(first);
        assert!(!notice(&desk).contains("Read-only"), "{label}: {}", notice(&desk));
        assert!(desk.fired.contains(label), "{first} does not run {label}");
    }
    for absent in ["pause or resume", "save", "add an object", "stop at …", "orbit left"] {
        assert!(listed.iter().all(|(_, label)| *label != absent), "{absent}");
        let mut desk = watching(3);
        desk.keys(&format!(": `{absent}` Enter"));
        assert!(!desk.fired.contains(absent), "{absent}");
    }
    let mut desk = watching(3);
    desk.keys(": `PNG` Enter");
    assert!(desk.effects.iter().any(|effect| matches!(effect, Effect::Export(_))));
}

#[test]
fn report_sets_size_name_display_and_target() {
    let desk = watching(3);
    assert_eq!(desk.scene().film.size, [320, 200]);
    assert_eq!(desk.model.file.name, "blue.toml");
    assert_eq!(desk.model.display.exposure_ev, 1.0);
    assert_eq!(desk.model.stop.noise_levels, Some(0.25));
}

#[test]
fn exposure_of_the_user_outlives_reports() {
    let mut desk = watching(3);
    desk.keys("= =");
    desk.send(Message::Watched(Box::new(report(vec![shard(1, WatchedState::Complete)]))));
    assert_eq!(desk.model.display.exposure_ev, 1.5);
}

#[test]
fn cursor_follows_its_row() {
    let mut desk = watching(30);
    let cursor = |desk: &Desk| desk.model.watch.as_ref().unwrap().at.index;
    desk.keys("Down Down");
    assert_eq!(cursor(&desk), 2);
    let mut rows: Vec<_> = (0..30).map(|n| shard(n, WatchedState::Running)).collect();
    rows.rotate_right(5);
    desk.send(Message::Watched(Box::new(report(rows))));
    assert_eq!(cursor(&desk), 7);
    desk.keys("End");
    assert_eq!(cursor(&desk), 29);
    assert!(desk.model.watch.as_ref().unwrap().at.scroll > 0);
    // The cursor moves to the last row if the table becomes shorter.
    desk.send(Message::Watched(Box::new(report(vec![shard(1, WatchedState::Complete)]))));
    assert_eq!(cursor(&desk), 0);
    // A cursor on the first row stays there, whatever file the row shows, because the first row is
    // the most urgent one.
    let rows = (0..9).rev().map(|n| shard(n, WatchedState::Running)).collect();
    desk.send(Message::Watched(Box::new(report(rows))));
    assert_eq!(cursor(&desk), 0);
    desk.send(Message::Watched(Box::new(report(Vec::new()))));
    desk.keys("Down Up PageDown Home Enter");
}

#[test]
fn channels_are_those_of_a_film() {
    let mut desk = watching(3);
    let mut seen = Vec::new();
    for _ in 0..3 {
        desk.keys("v");
        seen.push(desk.model.channel);
    }
    use DisplayChannel::{Beauty, Noise, Samples};
    assert_eq!(seen, [Noise, Samples, Beauty]);
}

#[test]
fn mouse_selects_rows_and_moves_the_probe() {
    let mut desk = watching(30);
    let (rows, _) = desk.model.watch_rows().unwrap();
    let image = desk.model.layout().unwrap().image;
    let at = |column, row, kind| Message::Mouse(Mouse { column, row, modified: false, kind });
    let click = |desk: &mut Desk, column, row| {
        desk.send(at(column, row, MouseKind::Press(Button::Left)));
        desk.send(at(column, row, MouseKind::Release(Button::Left)));
    };
    click(&mut desk, rows.x + 2, rows.y + 3);
    assert_eq!(desk.model.watch.as_ref().unwrap().at.index, 3);
    desk.send(at(rows.x, rows.y, MouseKind::Scroll(-2)));
    assert_eq!(desk.model.watch.as_ref().unwrap().at.index, 9);
    let scene = desk.scene().clone();
    click(&mut desk, image.x + 4, image.y + 4);
    desk.send(at(image.x, image.y, MouseKind::Scroll(3)));
    desk.send(at(image.x, image.y, MouseKind::Press(Button::Left)));
    desk.send(at(image.x + 9, image.y, MouseKind::Drag(Button::Left)));
    desk.send(at(image.x + 9, image.y, MouseKind::Release(Button::Left)));
    assert!(*desk.scene() == scene && desk.effects.iter().all(only_shows), "{:?}", desk.effects);
    desk.keys("i");
    click(&mut desk, image.x, image.y);
    let near = desk.model.probe.unwrap();
    assert!(near[0] < 8 && near[1] < 8, "{near:?}");
}
