//! The key table itself.

use std::collections::{HashMap, HashSet};
use std::path::Path;
use zerkalo::dashboard::action::{Action, Delta, Direction, StepSize};
use zerkalo::dashboard::hints::reference;
use zerkalo::dashboard::keymap::{KEYMAP, lookup};
use zerkalo::terminal::event::Key;

#[test]
fn every_key_has_one_meaning_in_its_context() {
    let mut seen = HashMap::new();
    for row in KEYMAP {
        for (context, names) in row.keys {
            for name in *names {
                let key: Key = name.parse().unwrap_or_else(|e| panic!("{}: {e}", row.label));
                assert_eq!(key.to_string(), *name);
                if let Some(other) = seen.insert((*context, key), row.label) {
                    panic!("{name} in {context:?} is both {other:?} and {:?}", row.label);
                }
                assert_eq!(lookup(*context, key), Some(row.action), "{name} in {context:?}");
            }
        }
    }
}

#[test]
fn every_action_has_one_row_and_a_label_of_its_own() {
    let mut actions = HashSet::new();
    let mut labels = HashSet::new();
    for row in KEYMAP {
        assert!(actions.insert(row.action), "{:?} twice", row.action);
        assert!(labels.insert(row.label), "{:?} twice", row.label);
    }
    for action in every_action() {
        assert!(actions.contains(&action), "{action:?} is not in the table");
    }
}

/// Every action there is. The match makes that a new one cannot be forgotten.
fn every_action() -> Vec<Action> {
    use Action::*;
    let ways = [Direction::Left, Direction::Right, Direction::Up, Direction::Down];
    let (changes, paces) = ([Delta::Up, Delta::Down], [StepSize::Coarse, StepSize::Fine]);
    let both = |f: fn(Delta, StepSize) -> Action| -> Vec<Action> {
        changes.iter().flat_map(|c| paces.map(|p| f(*c, p))).collect()
    };
    let one_of_each = [
        Orbit(Direction::Left),
        Pan(Direction::Left),
        Dolly(Direction::In, StepSize::Fine),
        ViewImage(Direction::Left),
        Fly(Direction::In),
        Roll(Direction::Left),
        ViewAngle(Delta::Up),
        Frame,
        ResetCamera,
        StoreView,
        RecallView(1),
        MoveMode,
        TurnMode,
        FlyMode,
        Move(Direction::In, StepSize::Fine),
        Rotate(Direction::Left, StepSize::Fine),
        Cancel,
        NextLight,
        Intensity(Delta::Up, StepSize::Fine),
        SwitchLight,
        AddLight,
        Roughness(Delta::Up, StepSize::Fine),
        Reflection(Delta::Up),
        NextLobe,
        AddObject,
        Duplicate,
        Delete,
        Rename,
        SnapToGround,
        OwnMaterial,
        NextPanel,
        PreviousPanel,
        ToggleFullscreen,
        Cursor(Direction::Up),
        First,
        Last,
        Page(Direction::Up),
        Open,
        Step(Delta::Up, StepSize::Fine),
        ClearField,
        Undo,
        Redo,
        Save,
        SaveAs,
        Reload,
        Recover,
        Suspend,
        Quit,
        Pause,
        Restart,
        StopAt,
        Quality,
        ExportPng,
        ExportExr,
        CopyPath,
        ShowExport,
        ExportSized,
        CancelExport,
        Exposure(Delta::Up),
        ResetExposure,
        NextTone,
        NextChannel,
        PreviousChannel,
        Probe,
        MoveProbe(Direction::Left, StepSize::Fine),
        Keep,
        Flip,
        Difference,
        Threads(Delta::Up),
        Priority,
        NextColors,
        Help,
        Palette,
        Inventory,
    ];
    let variants = |action: Action| -> Vec<Action> {
        match action {
            Orbit(_) => ways.map(Orbit).into(),
            Pan(_) => ways.map(Pan).into(),
            ViewImage(_) => ways.map(ViewImage).into(),
            Dolly(..) => [Direction::In, Direction::Out]
                .iter()
                .flat_map(|w| paces.map(|p| Dolly(*w, p)))
                .collect(),
            Fly(_) => ways.into_iter().chain([Direction::In, Direction::Out]).map(Fly).collect(),
            Move(..) => ways
                .into_iter()
                .chain([Direction::In, Direction::Out])
                .flat_map(|w| paces.map(|p| Move(w, p)))
                .collect(),
            MoveProbe(..) => ways.iter().flat_map(|w| paces.map(|p| MoveProbe(*w, p))).collect(),
            Roll(_) => [Direction::Left, Direction::Right].map(Roll).into(),
            Rotate(..) => [Direction::Left, Direction::Right]
                .iter()
                .flat_map(|w| paces.map(|p| Rotate(*w, p)))
                .collect(),
            Cursor(_) => [Direction::Up, Direction::Down].map(Cursor).into(),
            Page(_) => [Direction::Up, Direction::Down].map(Page).into(),
            RecallView(_) => (1..=9).map(RecallView).collect(),
            ViewAngle(_) => changes.map(ViewAngle).into(),
            Reflection(_) => changes.map(Reflection).into(),
            Exposure(_) => changes.map(Exposure).into(),
            Threads(_) => changes.map(Threads).into(),
            Intensity(..) => both(Intensity),
            Roughness(..) => both(Roughness),
            Step(..) => both(Step),
            Frame | ResetCamera | StoreView | MoveMode | TurnMode | FlyMode | Cancel
            | NextLight | SwitchLight | AddLight | NextLobe | AddObject | Duplicate | Delete
            | Rename | SnapToGround | OwnMaterial | NextPanel | PreviousPanel
            | ToggleFullscreen | First | Last | Open | ClearField | Undo | Redo | Save | SaveAs
            | Reload | Recover | Suspend | Quit | Pause | Restart | StopAt | Quality
            | ExportPng | ExportExr | CopyPath | ShowExport | ExportSized | CancelExport
            | ResetExposure | NextTone | NextChannel | PreviousChannel | Probe | Keep | Flip
            | Difference | Priority | NextColors | Help | Palette | Inventory => {
                vec![action]
            }
        }
    };
    one_of_each.into_iter().flat_map(variants).collect()
}

/// `ZERKALO_BLESS=1 cargo test --test stories` writes the page anew.
#[test]
fn the_page_about_keys_is_fresh() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/keys.md");
    let page = reference();
    if std::env::var_os("ZERKALO_BLESS").is_some() {
        std::fs::write(&path, &page).unwrap();
    }
    let written = std::fs::read_to_string(&path).unwrap_or_default();
    assert!(
        written == page,
        "docs/keys.md is not what the key table says: ZERKALO_BLESS=1 cargo test --test stories"
    );
}
