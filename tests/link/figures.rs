//! Bytes and errors of whole convergences.

use crate::line::Line;
use crate::picture::{SCREEN, Work};
use crate::support;
use std::time::Duration;
use zerkalo::scene::Scene;

const SPP: u32 = 1024;
/// 1 Mbit/s, 100 ms.
const RATE: f64 = 125e3;
const ROUND_TRIP: Duration = Duration::from_millis(100);

/// What one convergence has cost.
struct Figures {
    frames: usize,
    total: usize,
    first_64: usize,
    largest: usize,
    /// Mean over the waves, at the end of each.
    mean_error: f64,
    /// Seconds from the last wave until everything is exact.
    exact_after: f64,
}

fn converge(scene: &Scene, per_wave: Duration) -> Figures {
    let mut work = Work::new(scene, SPP);
    let mut line = Line::new(SCREEN, RATE, ROUND_TRIP);
    let (mut errors, mut first_64) = (Vec::new(), 0);
    while !work.done {
        work.wave();
        line.pass(&work.wanted(), per_wave);
        errors.push(work.error(line.parser.screen()));
        if work.wanted().samples <= 64.0 {
            first_64 = line.total();
        }
    }
    let begun = line.now;
    while !work.is_exact(line.parser.screen()) {
        assert!(line.now < begun + Duration::from_secs(60), "it never becomes exact");
        line.pass(&work.wanted(), Duration::from_millis(100));
    }
    for sent in &line.sent {
        assert!(sent.bytes <= sent.budget, "{sent:?}");
    }
    Figures {
        frames: line.sent.len(),
        total: line.total(),
        first_64,
        largest: line.sent.iter().map(|sent| sent.bytes).max().unwrap(),
        mean_error: errors.iter().sum::<f64>() / errors.len() as f64,
        exact_after: (line.now - begun).as_secs_f64(),
    }
}

fn report(name: &str, per_wave: Duration, f: &Figures) {
    println!(
        "{name:24} {:5} ms/wave {:5} frames, largest {:6} B, first 64 {:8} B, total {:8} B, error \
         {:.5}, exact after {:.1} s",
        per_wave.as_millis(),
        f.frames,
        f.largest,
        f.first_64,
        f.total,
        f.mean_error,
        f.exact_after
    );
}

#[test]
fn explore() {
    for name in ["mirror-room.toml", "roughness-0.3.toml", "furnace.toml"] {
        for ms in [30, 100, 300, 1000] {
            let per_wave = Duration::from_millis(ms);
            report(name, per_wave, &converge(&support::shipped(name), per_wave));
        }
    }
}
