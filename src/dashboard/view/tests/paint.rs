//! Screens with rendered pictures, written to files of terminal sequences for visual inspection.
//! `ZERKALO_SCREENS=folder cargo test --release --test application paint -- --ignored` writes the
//! files.
//! `cat` shows such a file in a terminal that has the size of the screen.

use crate::dashboard::Model;
use crate::dashboard::model::Colors;
use crate::dashboard::view::tests::drawn;
use crate::dashboard::view::tests::states::{STATES, tracing};
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use zerkalo_kernel::sampling::{SampleSettings, SamplerKind};
use zerkalo_render::Options;
use zerkalo_render::film::Display;
use zerkalo_render::schedule::{Settings, Stop};
use zerkalo_render::session::{Session, Snapshot, State, View};
use zerkalo_terminal::diff::Encoder;
use zerkalo_world as world;

fn rendered(model: &Model, spp: u32) -> Snapshot {
    let options = Options {
        world: world::Options::default(),
        sampling: SampleSettings { seed: 0, kind: SamplerKind::Sobol },
        display: Display::default(),
    };
    let stop = Stop { spp: Some(spp), ..Stop::default() };
    let settings = Settings::until(stop);
    let mut session = Session::new(2, options, settings).unwrap();
    session.set_view(View {
        raster: Some(model.layout().unwrap().raster),
        probe: model.probe,
        ..View::default()
    });
    session.set_scene(Arc::clone(model.scene()));
    loop {
        let snapshot = session.wait(Duration::from_secs(60)).expect("a snapshot in time");
        if matches!(snapshot.report.state, State::Finished(_)) && snapshot.first_hits.is_some() {
            return snapshot;
        }
    }
}

#[test]
#[ignore = "for eyes"]
fn paint() {
    let folder = std::env::var_os("ZERKALO_SCREENS").expect("ZERKALO_SCREENS names a folder");
    let levels = [
        ("true", Colors::True),
        ("256", Colors::Indexed),
        ("16", Colors::Sixteen),
        ("mono", Colors::Mono),
    ];
    for screen in [[200, 60], [120, 36], [80, 24], [40, 12]] {
        let picture = rendered(&tracing(screen), 32);
        for (name, make) in STATES {
            let mut model = tracing(screen);
            make(&mut model);
            if let Some(before) = &model.snapshot {
                let mut snapshot = picture.clone();
                snapshot.probe = before.probe.clone();
                snapshot.report = before.report.clone();
                model.snapshot = Some(Box::new(snapshot));
            }
            for (level, colors) in levels {
                if colors != Colors::True && *name != "tracing" {
                    continue;
                }
                model.colors = colors;
                let (buffer, _) = drawn(&model);
                let mut bytes = Vec::new();
                let mut encoder = Encoder::new(buffer.area.width);
                encoder.clear(&mut bytes);
                for (i, cell) in buffer.content().iter().enumerate() {
                    let (x, y) = buffer.pos_of(i);
                    encoder.cell(&mut bytes, x, y, cell);
                }
                let file = format!("{name}-{}x{}-{level}.ans", screen[0], screen[1]);
                std::fs::write(Path::new(&folder).join(file), bytes).unwrap();
            }
        }
    }
}
