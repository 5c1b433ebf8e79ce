//! Bytes and errors of whole convergences.

use crate::line::Line;
use crate::picture::{SCREEN, Work};
use crate::support;
use std::time::Duration;
use zerkalo::scene::Scene;

/// Everything is seen in a rough mirror.
const NOISY: &str = r#"
[camera]
eye = [0.0, 1.0, 0.0]
target = [0.0, 1.0, -1.0]
view_angle.vertical = 60.0
[ambient]
color = [0.05, 0.05, 0.05]
[[light]]
point = { position = [1.0, 3.0, 1.0] }
intensity = 8.0
[materials.mirror]
diffuse = 0.0
reflection = 0.9
roughness = 0.4
[materials.red]
color = [0.9, 0.2, 0.1]
[materials.white]
color = [0.9, 0.9, 0.9]
[materials.blue]
color = [0.1, 0.3, 0.9]
[[object]]
material = "mirror"
shape.rectangle = { center = [0.0, 1.0, -2.0], size = [40.0, 40.0], normal = [0.0, 0.0, 1.0] }
[[object]]
material = "red"
shape.sphere = { center = [-1.5, 1.0, 2.0], radius = 0.9 }
[[object]]
material = "white"
shape.rectangle = { center = [0.0, 0.0, 5.0], size = [40.0, 40.0], normal = [0.0, 0.0, -1.0] }
[[object]]
material = "blue"
shape.sphere = { center = [1.5, 1.4, 1.5], radius = 0.8 }
"#;

const SPP: u32 = 1024;
/// 1 Mbit/s, 100 ms.
const RATE: f64 = 125e3;
const ROUND_TRIP: Duration = Duration::from_millis(100);

/// What one convergence has cost.
struct Figures {
    frames: usize,
    total: usize,
    /// Of those, for differences that cannot be seen.
    flushed: usize,
    first_64: usize,
    largest: usize,
    /// Mean over the waves, at the end of each.
    mean_error: f64,
    /// Seconds from the last wave until everything is exact.
    exact_after: f64,
    /// Seconds in which visible differences waited, and the share of them in which the line was busy.
    waited: f64,
    busy: f64,
}

/// One wave at a time: the next one is traced when nothing that can be seen waits any more.
fn converge(scene: &Scene) -> Figures {
    let mut work = Work::new(scene, SPP);
    let mut line = Line::new(SCREEN, RATE, ROUND_TRIP);
    let (mut errors, mut first_64) = (Vec::new(), 0);
    while !work.done {
        work.wave();
        let begun = line.now;
        loop {
            line.pass(&work.wanted(), Duration::from_millis(200));
            let waits = line.pacing.pending().visible || line.pacing.pending().text;
            if !waits {
                break;
            }
            assert!(line.now < begun + Duration::from_secs(20), "it never catches up");
        }
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
        flushed: line.sent.iter().map(|sent| sent.flushed).sum(),
        first_64,
        largest: line.sent.iter().map(|sent| sent.bytes).max().unwrap(),
        mean_error: errors.iter().sum::<f64>() / errors.len() as f64,
        exact_after: (line.now - begun).as_secs_f64(),
        waited: line.waited[0].as_secs_f64(),
        busy: line.busy(),
    }
}

fn report(name: &str, f: &Figures) {
    println!(
        "{name:20} {:4} frames, largest {:6} B, first 64 samples {:8} B, total {:8} B of which {:7} \
         B at rest, mean OKLab error {:.5}, exact after {:.1} s; line busy for {:.0} % of the {:.1} \
         s in which visible differences waited",
        f.frames,
        f.largest,
        f.first_64,
        f.total,
        f.flushed,
        f.mean_error,
        f.exact_after,
        100.0 * f.busy,
        f.waited,
    );
}

#[test]
fn the_mirror_room_costs_little_and_stays_near() {
    let figures = converge(&support::shipped("mirror-room.toml"));
    report("mirror room", &figures);
    assert!(figures.total <= 2_500_000, "{} bytes", figures.total);
    assert!(figures.mean_error <= 0.0065, "{}", figures.mean_error);
    assert!(figures.exact_after < 30.0);
    assert!(figures.busy >= 0.6, "{}", figures.busy);
}

#[test]
fn a_scene_that_is_noisy_everywhere() {
    let figures = converge(&support::parsed(NOISY));
    report("noisy everywhere", &figures);
    assert!(figures.total <= 4_000_000, "{} bytes", figures.total);
    assert!(figures.busy >= 0.6, "{}", figures.busy);
}

/// What is sent follows what is shown, not the clock: the same bytes each time.
#[test]
fn the_same_picture_costs_the_same() {
    let scene = support::shipped("roughness-0.3.toml");
    let sent = |_| {
        let mut work = Work::new(&scene, 16);
        let mut line = Line::new(SCREEN, RATE, ROUND_TRIP);
        while !work.done {
            work.wave();
            line.pass(&work.wanted(), Duration::from_millis(300));
        }
        line.sent.iter().map(|sent| sent.bytes).collect::<Vec<_>>()
    };
    let [first, second] = [0, 1].map(sent);
    assert!(first.len() > 10);
    assert_eq!(first, second);
}

/// After an edit the first frame shows another picture everywhere, whatever the line carries.
#[test]
fn another_picture_shows_in_its_first_frame() {
    let scene = support::shipped("mirror-room.toml");
    let mut work = Work::new(&scene, 8);
    let mut line = Line::new(SCREEN, RATE, ROUND_TRIP);
    while !work.done {
        work.wave();
        line.pass(&work.wanted(), Duration::from_secs(3));
    }
    let other = support::shipped("viewpoint-left.toml");
    work.edit(&other, 8);
    work.wave();
    let before = work.error(line.parser.screen());
    let frames = line.sent.len();
    while line.sent.len() == frames {
        line.pass(&work.wanted(), Duration::from_millis(5));
    }
    let first = line.sent[frames];
    line.drain();
    let after = work.error(line.parser.screen());
    println!("{} of {} B: error {before:.3} -> {after:.3}", first.bytes, first.budget);
    assert!(first.bytes <= first.budget && after < 0.6 * before, "{before} {after}");
}

/// Edit after edit, the line is kept at work as long as something is to be seen, and whoever presses
/// the next key does not wait for more than a frame.
#[test]
fn the_line_is_busy_while_differences_wait() {
    let scenes = ["mirror-room.toml", "viewpoint-left.toml"].map(support::shipped);
    for acting in [false, true] {
        let mut work = Work::new(&scenes[0], 8);
        let mut line = Line::new(SCREEN, RATE, ROUND_TRIP);
        line.acting = acting;
        for edit in 1..9 {
            while !work.done {
                work.wave();
                line.pass(&work.wanted(), Duration::from_millis(120));
            }
            work.edit(&scenes[edit % 2], 8);
        }
        let [waited, busy] = [line.waited[0].as_secs_f64(), line.busy()];
        println!("acting: {acting}; busy for {:.0} % of {waited:.1} s", 100.0 * busy);
        assert!(waited > 2.0 && busy >= 0.6, "{acting} {waited} {busy}");
        let longest = line.sent.iter().map(|sent| sent.bytes).max().unwrap();
        assert!(longest as f64 <= 0.15 * RATE, "{longest} bytes");
    }
}

#[test]
fn without_answers_it_goes_on() {
    let mut work = Work::new(&support::shipped("mirror-room.toml"), 16);
    let mut line = Line::new(SCREEN, RATE, ROUND_TRIP);
    line.answering = false;
    while !work.done {
        work.wave();
        line.pass(&work.wanted(), Duration::from_secs(2));
    }
    let begun = line.now;
    while !work.is_exact(line.parser.screen()) {
        assert!(line.now < begun + Duration::from_secs(120), "it never becomes exact");
        line.pass(&work.wanted(), Duration::from_millis(500));
    }
}
