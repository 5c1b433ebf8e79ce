//! Stories of unsaved edits: autosave, and recovery at the next start.

use super::*;

/// Returns the autosave requests since the last call. Each is a scene to be saved, or `None` if the
/// recovery file is to be removed.
fn kept(desk: &mut Desk) -> Vec<Option<Arc<Scene>>> {
    let effects = std::mem::take(&mut desk.effects);
    let kept = effects.into_iter().filter_map(|effect| match effect {
        Effect::Autosave(scene) => Some(scene),
        _ => None,
    });
    kept.collect()
}

fn orphaned_edits(desk: &Desk, changed: bool) -> OrphanedEdits {
    let mut scene = desk.scene().clone();
    scene.trace.max_depth = 7;
    OrphanedEdits { scene: Arc::new(scene), age: Duration::from_secs(720), changed }
}

#[test]
fn edits_are_autosaved_until_saved_or_undone() {
    let mut desk = Desk::new(ROOM);
    desk.keys("Tab Down p v Esc");
    assert!(kept(&mut desk).is_empty(), "nothing was edited");
    desk.keys("] ]");
    let scenes = kept(&mut desk);
    assert_eq!(scenes.len(), 2);
    assert_eq!(scenes[1].as_ref(), Some(desk.model.history.scene()));
    desk.keys("u");
    assert_eq!(kept(&mut desk).last(), Some(&None), "two steps of one gesture were undone");
    desk.keys("] Ctrl-s");
    assert_eq!(kept(&mut desk).last(), Some(&None));
    desk.keys("u");
    assert!(matches!(&kept(&mut desk)[..], [Some(_)]), "the file has what was undone");
    desk.keys("q `d`");
    let end: Vec<_> = desk.effects.iter().rev().take(2).collect();
    assert_eq!(end, [&Effect::Quit, &Effect::Autosave(None)]);
}

#[test]
fn form_is_autosaved_when_confirmed() {
    let mut desk = Desk::new(ROOM);
    desk.keys("a Enter");
    assert!(matches!(desk.model.overlay, Some(Overlay::Form(_))) && kept(&mut desk).is_empty());
    desk.keys("Enter");
    assert_eq!(kept(&mut desk).len(), 1);
}

#[test]
fn orphaned_edits_are_offered_and_recovered() {
    let mut desk = Desk::new(ROOM);
    let left = orphaned_edits(&desk, false);
    desk.send(Message::OrphanedEdits(left.clone()));
    let Some(Overlay::Question(question)) = &desk.model.overlay else { panic!() };
    assert!(question.text.contains("12 min ago") && !question.text.contains("changed"));
    desk.effects.clear();
    desk.keys("Enter");
    assert_eq!(**desk.model.history.scene(), *left.scene);
    assert!(desk.model.is_unsaved() && desk.asked(|e| *e == Effect::Recover));
    assert!(desk.asked(|e| matches!(e, Effect::Show(_))));
    assert!(matches!(&kept(&mut desk)[..], [Some(_)]));
    desk.keys("u");
    assert_eq!(desk.text(), ROOM, "undo leads back to the file");
    desk.keys("U Ctrl-s");
    assert!(desk.text().contains("max_depth = 7") && !desk.model.is_unsaved());
}

#[test]
fn orphaned_edits_can_be_recovered_later() {
    let mut desk = Desk::new(ROOM);
    desk.send(Message::OrphanedEdits(orphaned_edits(&desk, true)));
    let Some(Overlay::Question(question)) = &desk.model.overlay else { panic!() };
    assert!(question.text.contains("changed since"), "{}", question.text);
    desk.keys("`f` ]");
    assert!(!desk.asked(|e| matches!(e, Effect::Recover | Effect::Discard)));
    desk.palette("recover edits of a crashed session").keys("`d`");
    assert!(desk.asked(|e| *e == Effect::Discard) && desk.model.is_unsaved());
    desk.palette("recover edits of a crashed session");
    assert!(desk.model.overlay.is_none() && desk.notice().contains("No session"));
}

#[test]
fn orphaned_edits_do_not_interrupt_typing() {
    let mut desk = Desk::new(ROOM);
    desk.keys("a");
    desk.send(Message::OrphanedEdits(orphaned_edits(&desk, false)));
    assert!(matches!(desk.model.overlay, Some(Overlay::Pick(_))));
    assert!(desk.notice().contains("recover"));
    desk.keys("Esc");
    desk.palette("recover edits of a crashed session").keys("`r`");
    assert_eq!(desk.scene().trace.max_depth, 7);
}

#[test]
fn orphaned_edits_equal_to_file_are_discarded() {
    let mut desk = Desk::new(ROOM);
    let same =
        OrphanedEdits { scene: Arc::clone(desk.model.scene()), ..orphaned_edits(&desk, true) };
    desk.send(Message::OrphanedEdits(same));
    desk.keys("Enter");
    assert!(desk.asked(|e| *e == Effect::Discard) && !desk.asked(|e| *e == Effect::Recover));
    assert!(!desk.model.is_unsaved());
}

#[test]
fn suspend_emits_no_other_effect() {
    let mut desk = Desk::new(ROOM);
    desk.keys("]");
    desk.effects.clear();
    desk.keys("Ctrl-z");
    assert_eq!(desk.effects, [Effect::Suspend]);
    desk.keys("? Ctrl-z");
    assert_eq!(desk.effects, [Effect::Suspend, Effect::Suspend]);
}

#[test]
fn discarded_edits_are_not_kept_by_later_messages() {
    for keys in ["] q `d`", "] : `q!` Enter"] {
        let mut desk = Desk::new(ROOM);
        desk.keys(keys).send(Message::ConnectionRate(None));
        let last = desk.effects.iter().rfind(|effect| matches!(effect, Effect::Autosave(_)));
        assert_eq!(last, Some(&Effect::Autosave(None)), "{keys}");
    }
}
