//! Random sequences of all operations that edit a scene.

use super::LAYOUTS;
use crate::harness::*;
use proptest::prelude::*;
use std::cell::RefCell;
use zerkalo_scene::History;
use zerkalo_scene::edit::{Edit, EditError, Widget};

const TRANSFORMS: &str = include_str!("../../scenes/features/transform.toml");

/// Random numbers that select an edit operation, its target, its parameter and its amount.
type Act = (u8, usize, usize, f64);

fn act() -> impl Strategy<Value = Act> {
    let amount =
        prop_oneof![prop::sample::select(vec![1.0, -1.0, 0.1, -0.1, 3.0, 0.0]), -90.0..90.0f64,];
    (0..24u8, 0..1000usize, 0..1000usize, amount)
}

const TEXTS: [&str; 12] =
    ["0.5", "", "-1", "1 2 3", "0 0 0", "#80ff01", "on", "rotate_y", "sphere", "1e9", "a b", "nan"];

fn pick<T: Clone>(list: &[T], at: usize) -> Option<T> {
    list.get(at.checked_rem(list.len())?).cloned()
}

fn perform(
    scene: &Scene,
    (what, at, other, amount): Act,
) -> (&'static str, Result<Edit, EditError>) {
    let subjects: Vec<_> = edit::outline(scene).into_iter().map(|(_, s)| s).collect();
    let subject = pick(&subjects, at).unwrap_or(Target::Camera);
    let row = pick(&edit::rows(scene, &subject).expect("it is in the outline"), other);
    let row = row.expect("every subject has rows");
    let kinds = edit::object_kinds();
    let text = TEXTS[other % TEXTS.len()];
    let component = (!row.components.is_empty() && amount > 0.0).then(|| at % row.components.len());
    let by = [amount * 0.1, if other % 2 == 0 { 0.05 } else { 0.0 }, -amount * 0.01];
    match what {
        0 | 1 => ("step", edit::step(scene, &subject, &row.key, component, amount.trunc())),
        2 => ("fine step", edit::step(scene, &subject, &row.key, component, amount * 0.1 + 0.05)),
        3 => ("set", edit::set(scene, &subject, &row.key, text)),
        4 => ("set number", edit::set_component(scene, &subject, &row.key, at % 3, text)),
        5 => match row.widget {
            Widget::Switch | Widget::Choice | Widget::Kind => {
                ("toggle", edit::toggle(scene, &subject, &row.key, amount > 0.0))
            }
            _ => ("toggle refused", edit::toggle(scene, &subject, &row.key, amount > 0.0)),
        },
        6 if scene.objects.len() < 12 => {
            let materials: Vec<_> = scene.materials.keys().map(String::as_str).collect();
            let shared = pick(&materials, at).filter(|_| other % 3 == 0);
            let kind = &kinds[other % kinds.len()].name;
            ("add object", edit::add_object(scene, kind, shared))
        }
        7 if scene.lights.len() < 6 => {
            let kind = ["point", "directional", "spot"][at % 3];
            ("add light", edit::add_light(scene, kind))
        }
        8 => ("move", edit::move_by(scene, &subject, by)),
        9 => ("rotate", edit::rotate(scene, &subject, amount)),
        10 => ("drop", edit::snap_to_ground(scene, &subject)),
        11 if subjects.len() < 30 => ("duplicate", edit::duplicate(scene, &subject)),
        12 => ("delete", edit::delete(scene, &subject)),
        13 => {
            let names = ["new", "cube", "red", "", "a\"b\\c", "ключ", "x.y"];
            ("rename", edit::rename(scene, &subject, names[other % names.len()]))
        }
        14 => ("own material", edit::own_material(scene, &subject)),
        15 => ("store camera", edit::store_view(scene, (at % 2 == 0).then_some("left"))),
        16 => ("roughen", edit::step_mirror(scene, Some(&subject), "roughness", amount.trunc())),
        17 => ("reflect", edit::step_mirror(scene, Some(&subject), "reflection", amount.trunc())),
        18 => {
            let objects: Vec<_> = (0..scene.objects.len()).map(Target::Object).collect();
            let [a, b] = [at, at + 1 + other].map(|n| pick(&objects, n).unwrap_or_default());
            let kind = ["union", "intersection", "difference"][other % 3];
            (
                "join",
                if a == b {
                    edit::join(scene, &[], kind)
                } else {
                    edit::join(scene, &[a, b], kind)
                },
            )
        }
        19 => ("dissolve", edit::dissolve(scene, &subject)),
        20 => ("add part", edit::add_part(scene, &subject, &edit::part_kinds()[other % 13].name)),
        21 => ("scale", edit::scale(scene, &subject, amount.abs() * 0.1 + 0.5, glam::DVec3::ONE)),
        _ => ("next lobe", edit::step_mirror(scene, None, "lobe", amount)),
    }
}

/// Numbers of calls of each operation: those that gave an edit, and refused ones.
type Tally = BTreeMap<&'static str, [u32; 2]>;

fn check_sequence(text: &str, acts: &[Act], tally: &mut Tally) -> Result<(), TestCaseError> {
    let mut document = Document::parse(text.to_string(), "scene.toml").unwrap();
    let mut history = History::new(Arc::new(document.scene().clone()));
    for (i, act) in acts.iter().enumerate() {
        let before = Arc::clone(history.scene());
        let (name, result) = perform(&before, *act);
        let counts = tally.entry(name).or_default();
        counts[usize::from(result.is_err())] += 1;
        match result {
            Ok(edit) => {
                prop_assert_eq!(edit.scene.faults(), [], "{} {:?}", name, act);
                prop_assert!(edit.target.exists(&edit.scene), "{} {:?}", name, edit.target);
                history.record(Arc::new(edit.scene), &edit.label, act.1 % 2 == 0);
            }
            Err(refusal) => prop_assert!(!refusal.found.is_empty() && !name.contains("add m")),
        }
        if act.2 % 7 == 0 {
            history.undo();
        }
        if act.2 % 11 == 0 {
            history.redo();
        }
        if i % 4 == 0 {
            document.apply(history.scene());
            let again = Scene::parse(document.text(), "scene.toml");
            prop_assert!(again.is_ok(), "{}\n{}", again.unwrap_err(), document.text());
            prop_assert_eq!(&again.unwrap(), &**history.scene(), "{}", document.text());
        }
    }
    while history.undo().is_some() {}
    document.apply(history.scene());
    prop_assert_eq!(document.text(), text);
    prop_assert!(history.is_saved());
    Ok(())
}

#[test]
fn random_edits_leave_valid_scenes_and_can_be_undone() {
    let tally = RefCell::new(Tally::new());
    let mut runner = proptest::test_runner::TestRunner::new(ProptestConfig {
        cases: 120,
        ..ProptestConfig::default()
    });
    let sequences = (0..3usize, prop::collection::vec(act(), 1..60));
    let result = runner.run(&sequences, |(which, acts)| {
        let text = [MIRROR_ROOM, LAYOUTS[1], TRANSFORMS][which];
        check_sequence(text, &acts, &mut tally.borrow_mut())
    });
    result.unwrap_or_else(|e| panic!("{e}"));
    let tally = tally.into_inner();
    println!("done and refused: {tally:?}");
    // An operation missing in the tally would go untested.
    for name in
        "step|fine step|set|set number|toggle|add object|add light|move|rotate|drop|duplicate|\
         delete|rename|own material|store camera|roughen|reflect|next lobe|join|dissolve|\
         add part|scale"
            .split('|')
    {
        assert!(tally.get(name).is_some_and(|[done, _]| *done > 0), "{name}: {tally:?}");
    }
}
