//! Models of the dashboard in every state that looks different on the screen.

use crate::dashboard::model::{Notice, RunningExport, Tone};
use crate::dashboard::panel_lines::scrolled;
use crate::dashboard::testing::{mirror_room, report};
use crate::dashboard::update::update;
use crate::dashboard::{
    DisplayChannel, Editor, FieldList, Focus, Form, ListCursor, Message, Mode, Model,
    OrphanedEdits, Overlay, PanelLine, Prompt,
};
use std::sync::Arc;
use std::time::Duration;
use zerkalo_render::film::{Display, LightWeights, PixelProbe, Window};
use zerkalo_render::schedule::{Interval, Spp, Stop, StoppedBy};
use zerkalo_render::session::{
    Report, Snapshot, State, TileMaps, WatchReport, WatchedShards, WatchedState,
};
use zerkalo_scene::Scene;
use zerkalo_scene::edit::{self, Target};

/// Name of a state, and a function that brings a dashboard with a running render into this state.
pub type Named = (&'static str, fn(&mut Model));

/// Sends the keys with the given names.
fn press(model: &mut Model, keys: &str) {
    for key in keys.split(' ') {
        update(model, Message::Key(key.parse().unwrap()), Duration::ZERO);
    }
}

/// Creates the model of a dashboard of `screen` columns and rows that has rendered 212 samples per
/// pixel of `mirror-room.toml`.
pub fn tracing(screen: [u16; 2]) -> Model {
    let path = Some("scenes/mirror-room.toml".into());
    let stop = Stop { noise_levels: Some(0.5), ..Stop::default() };
    let mut model = Model::new(path, "", Ok(Arc::new(mirror_room())), stop);
    model.screen = screen;
    model.first_time = false;
    for spp in [2, 4, 8, 16, 32, 64, 96, 128, 160, 212] {
        let noise = 0.9 * (212.0 / spp as f64).powf(0.6);
        model.convergence.add(&with_spread(report(1, spp, Some(noise))));
    }
    let last = Report {
        eta_seconds: Some(Interval { low: 0.9, high: 1.6 }),
        quality_seconds: [(0.0, 0.0), (0.0, 0.0), (0.0, 0.0), (0.9, 1.6), (3.4, 5.8), (13.0, 25.0)]
            .map(|(low, high)| Some(Interval { low, high })),
        progress: Some(0.4),
        ..with_spread(report(1, 212, Some(0.9)))
    };
    model.snapshot = Some(Box::new(snapshot(last)));
    model
}

fn with_spread(mut report: Report) -> Report {
    report.spp = Spp { min: 32, mean: report.spp.mean, max: 900 };
    report.seconds *= 10.0;
    report
}

pub fn snapshot(report: Report) -> Snapshot {
    Snapshot {
        report,
        picture: None,
        weights: LightWeights { weights: Vec::new() },
        lighting: None,
        first_hits: None,
        window: Window::whole([640, 480]),
        detail: None,
        tiles: Arc::new(TileMaps {
            columns: 40,
            rows: 30,
            noise_levels: (0..1200).map(|i| 0.1 + i as f32 * 0.01).collect(),
            spp: (0..1200).map(|i| 32 + i % 900).collect(),
        }),
        probe: None,
    }
}

fn select(model: &mut Model, object: &str) {
    let scene = Arc::clone(model.scene());
    let found =
        (0..scene.objects.len()).map(Target::Object).find(|target| target.label(&scene) == object);
    model.selection = found.unwrap_or_else(|| panic!("{object} in the built-in scene"));
}

fn select_first(model: &mut Model) {
    let name = Target::Object(0).label(model.scene());
    select(model, &name);
}

fn field(model: &Model, key: &str) -> usize {
    let is = |line: &PanelLine| line.entry().is_some_and(|field| field.property.key == key);
    model.field_lines().iter().position(is).unwrap_or_else(|| panic!("a field {key}"))
}

fn inspecting(model: &mut Model, key: &str) {
    select_first(model);
    model.focus = Focus::Inspector;
    model.inspector = FieldList { cursor: field(model, key), ..FieldList::default() };
}

fn typing(model: &mut Model, text: &str, problem: Option<&str>) {
    inspecting(model, "color");
    let mut editor = Editor::new(text);
    editor.problem = problem.map(str::to_string);
    model.inspector.editor = Some(editor);
    if let Some((list, _)) = model.inspector_rows() {
        let (cursor, lines) = (model.inspector.cursor, model.field_lines().len());
        model.inspector.scroll = scrolled(0, Some(cursor), lines, list.height.into());
    }
}

fn resting(model: &mut Model, by: StoppedBy) {
    let snapshot = model.snapshot.as_mut().unwrap();
    snapshot.report.state = State::Finished(by);
    snapshot.report.eta_seconds = None;
    snapshot.report.noise.as_mut().unwrap().rmse.levels = 0.49;
}

fn notice(model: &mut Model, tone: Tone, text: &str) {
    model.notice = Some(Notice { text: text.to_string(), tone, until: None });
}

fn adding(model: &mut Model, problem: Option<&str>) {
    let edit = edit::add_object(model.scene(), "sphere", None).unwrap();
    let form = Form {
        title: "new sphere".to_string(),
        scene: Arc::new(edit.scene),
        target: edit.target,
        label: edit.label,
        fields: FieldList {
            cursor: 2,
            refusal: problem.map(str::to_string),
            ..FieldList::default()
        },
    };
    model.overlay = Some(Overlay::Form(form));
}

fn prompt(model: &mut Model, words: [&str; 3], problem: Option<&str>) {
    let [title, help, text] = words.map(str::to_string);
    let mut editor = Editor::new(text);
    editor.problem = problem.map(str::to_string);
    model.overlay = Some(Overlay::Prompt(Prompt {
        title,
        help,
        editor,
        takes_path: false,
        apply: |_, _| Ok(()),
    }));
}

fn probing(model: &mut Model) {
    model.mode = Mode::Probe;
    model.probe = Some([320, 240]);
    model.snapshot.as_mut().unwrap().probe = Some(PixelProbe {
        pixel: [320, 240],
        samples: [106, 106],
        radiance: [0.2123, 0.18, 0.0904],
        levels: [127.46, 118.2, 83.9],
        difference: Some([0.012, 0.01, 0.004]),
        tile_rmse_levels: Some(0.84),
        error_shares: Vec::new(),
        tile_errors: Vec::new(),
    });
}

fn watched(
    shards: &str,
    path: Option<&str>,
    state: WatchedState,
    [samples, total]: [u64; 2],
    age: Option<u64>,
) -> WatchedShards {
    let (path, age) = (path.map(Into::into), age.map(Duration::from_secs));
    WatchedShards { shards: shards.to_string(), path, state, samples, total: Some(total), age }
}

/// Returns a report on a render in nine shards, of which some are refused, missing or late.
fn watched_plan() -> WatchReport {
    let reason = "cannot use parts/job-6.zk: it ends in the middle of the part TILE: it was not \
                  copied as a whole; copy it again, or use an older one";
    let all = 4_812_345;
    WatchReport {
        shards: vec![
            watched(
                "",
                Some("parts/job-6.zk"),
                WatchedState::Refused(reason.into()),
                [0; 2],
                Some(4),
            ),
            watched("5", Some("parts/job-5.zk"), WatchedState::Missing, [0; 2], None),
            watched("7-8", None, WatchedState::Missing, [0; 2], None),
            watched("2", Some("parts/job-2.zk"), WatchedState::Late, [812_345, all], Some(720)),
            watched("3", Some("parts/job-3.zk"), WatchedState::Running, [1_912_345, all], Some(12)),
            watched("4", Some("parts/job-4.zk"), WatchedState::Running, [2_112_345, all], Some(55)),
            watched("0", Some("parts/job-0.zk"), WatchedState::Complete, [all; 2], Some(7260)),
            watched("1", Some("parts/job-1.zk"), WatchedState::Complete, [all; 2], Some(180)),
        ],
        complete: Some([2, 9]),
        progress: Some(0.345),
        target_levels: Some(0.25),
        size: Some([640, 480]),
        display: Display::default(),
        source: "scenes/mirror-room.toml".to_string(),
    }
}

fn watching(model: &mut Model, report: &WatchReport) {
    let report = Box::new(report.clone());
    update(model, Message::Watched(report), Duration::ZERO);
}

fn broken(model: &mut Model) {
    let text = "[film]\nsize = [640, 480]\n\n[[object]]\nname = \"queen\"\nmaterial = \"ivroy\"\n\
                shape.sphere = { center = [0, 0, 0], radius = -1.0 }\n";
    model.file.broken = Some(Scene::parse(text, "mirror-room.toml").unwrap_err());
}

/// States of the dashboard that look different on the screen, each with its name.
pub const STATES: &[Named] = &[
    ("first-time", |m| {
        m.first_time = true;
        m.snapshot = None;
        m.convergence = Default::default();
    }),
    ("tracing", |_| {}),
    ("converged", |m| resting(m, StoppedBy::Noise)),
    ("paused", |m| {
        m.paused = true;
        m.snapshot.as_mut().unwrap().report.state = State::Paused;
    }),
    ("failed", |m| {
        let why = "object \"cube\" is so far away that no precision is left there.";
        m.snapshot.as_mut().unwrap().report.state = State::Failed(why.to_string());
    }),
    ("unsaved-and-shown-otherwise", |m| {
        let edit = edit::delete(m.scene(), &Target::Object(0)).unwrap();
        m.history.record(Arc::new(edit.scene), "delete", false);
        m.display.exposure_ev = 0.75;
        m.display.tone = zerkalo_scene::Tone::Neutral;
        let size = [1920, 1080];
        m.export = Some(RunningExport { size, progress: 0.43, left: None });
    }),
    ("outline", |m| {
        m.focus = Focus::Outline;
        select_first(m);
    }),
    ("inspector", |m| inspecting(m, "material")),
    ("typing", |m| typing(m, "0.7", None)),
    ("typing-refused", |m| {
        typing(
            m,
            "bright red",
            Some(
                "`bright red` is no colour. Expected three numbers of at least 0, or \"#rrggbb\".",
            ),
        );
    }),
    ("moving", |m| {
        select_first(m);
        m.mode = Mode::Move;
    }),
    ("rotating", |m| {
        select_first(m);
        m.mode = Mode::Rotate;
    }),
    ("flying", |m| m.mode = Mode::Fly),
    ("probing", probing),
    ("noise", |m| m.channel = DisplayChannel::Noise),
    ("samples", |m| m.channel = DisplayChannel::Samples),
    ("objects", |m| m.channel = DisplayChannel::Objects),
    ("pinned", |m| m.channel = DisplayChannel::Pinned),
    ("fullscreen", |m| m.fullscreen = true),
    ("notice", |m| {
        notice(
            m,
            Tone::Good,
            "wrote mirror-room-1.png, 640×480, 212 spp, noise 0.9 levels — scp ada@sun:/home/ada/mirror-room-1.png .",
        );
    }),
    ("notice-of-a-refusal", |m| notice(m, Tone::Bad, "nothing is selected that can be deleted")),
    ("watching", |m| watching(m, &watched_plan())),
    ("watching-complete", |m| {
        let report = watched_plan();
        let mut shards = report.shards[3..].to_vec();
        shards.iter_mut().for_each(|row| {
            row.state = WatchedState::Complete;
            row.samples = row.total.unwrap_or(0);
        });
        let complete = Some([9, 9]);
        watching(m, &WatchReport { shards, complete, progress: Some(1.0), ..report });
    }),
    ("watching-checkpoint", |m| {
        let row =
            watched("", Some("mirror-room.zk"), WatchedState::Late, [1_234_567, 0], Some(7200));
        let shards = vec![WatchedShards { total: None, ..row }];
        let report = watched_plan();
        let (complete, progress, target_levels) = (None, None, None);
        watching(m, &WatchReport { shards, complete, progress, target_levels, ..report });
    }),
    ("watching-before-the-first-file", |m| {
        m.snapshot = None;
        m.convergence = Default::default();
        let shards = vec![watched("", Some("job-1.zk"), WatchedState::Missing, [0; 2], None)];
        let (complete, progress, target_levels) = (None, None, None);
        let report = watched_plan();
        let size = None;
        let source = String::new();
        watching(
            m,
            &WatchReport { shards, complete, progress, target_levels, size, source, ..report },
        );
    }),
    ("watching-help", |m| {
        watching(m, &watched_plan());
        press(m, "?");
    }),
    ("watching-refusal", |m| {
        watching(m, &watched_plan());
        press(m, "x");
    }),
    ("help", |m| press(m, "?")),
    ("help-scrolled", |m| press(m, "? PageDown PageDown")),
    ("noise-targets", |m| {
        m.overlay = Some(Overlay::NoiseTargets(ListCursor { index: 3, scroll: 0 }));
    }),
    ("palette", |m| press(m, ": l i g h t Down")),
    ("palette-empty", |m| press(m, ": t e a p o t")),
    ("kinds", |m| press(m, "a Down")),
    ("form", |m| adding(m, None)),
    ("form-refused", |m| {
        adding(m, Some("radius is -1. Expected a number greater than 0, at most 1e9."));
    }),
    ("save-as", |m| {
        let words = ["save as", "A file name ending in .toml.", "rooms/mirror-room-2.toml"];
        prompt(m, words, None);
    }),
    ("stop-at-refused", |m| {
        let help = "noise 0.5, spp 1000, time 60, or none.";
        let problem =
            "`noise low` is no number of levels. Type noise 0.5, spp 1000, time 60, or none.";
        prompt(m, ["stop at", help, "noise low"], Some(problem));
    }),
    ("quit", |m| {
        let mut scene = mirror_room();
        scene.trace.max_depth = 3;
        m.history.record(Arc::new(scene), "depth", false);
        press(m, "q");
    }),
    ("orphaned-edits", |m| {
        let age = Duration::from_secs(720);
        let left = OrphanedEdits { scene: Arc::new(mirror_room()), age, changed: true };
        update(m, Message::OrphanedEdits(left), Duration::ZERO);
    }),
    ("file-became-unreadable", broken),
    ("broken-file", |m| {
        broken(m);
        m.file.unreadable = true;
        m.snapshot = None;
        m.convergence = Default::default();
    }),
    ("names-from-elsewhere", |m| {
        let mut scene = mirror_room();
        scene.objects[0].name = "鏡の部屋\u{1b}[31m\u{202e} with a name that never ends".into();
        scene.lights[0].name = "\t\n\u{7}".into();
        m.file.name = zerkalo_scene::value::sanitized("鏡\u{1b}]0;evil\u{7}.toml");
        m.history.record(Arc::new(scene), "names", false);
        m.focus = Focus::Outline;
        m.selection = Target::Object(0);
    }),
];
