//! Bytes that a connection transmits, and errors of the screen, while a picture converges.

use crate::harness::*;
use crate::link::connection::Connection;
use crate::link::picture::{SCREEN, Work};
use zerkalo_terminal::diff::TargetFrame;

/// Scene seen in a rough mirror, whose picture is noisy everywhere.
const NOISY: &str = r#"
camera = { eye = [0.0, 1.0, 0.0], target = [0.0, 1.0, -1.0], view_angle.vertical = 60.0 }
ambient.color = [0.05, 0.05, 0.05]
materials.mirror = { diffuse = 0.0, reflection = 0.9, roughness = 0.4 }
materials.red.color = [0.9, 0.2, 0.1]
materials.white.color = [0.9, 0.9, 0.9]
materials.blue.color = [0.1, 0.3, 0.9]
[[light]]
point = { position = [1.0, 3.0, 1.0] }
intensity = 8.0
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
/// Rate of the connection in bytes per second: 1 Mbit/s.
const RATE: f64 = 125e3;
const ROUND_TRIP: Duration = Duration::from_millis(100);

/// Measurements of one picture's convergence.
struct Figures {
    frames: usize,
    total: usize,
    /// Number of bytes that were sent for differences too small to be visible.
    flushed: usize,
    first_64: usize,
    largest: usize,
    /// Mean OKLab distance between the screen and the picture, measured at the end of each wave.
    mean_error: f64,
    /// Seconds from the end of the last wave until the screen shows the picture exactly.
    exact_after: f64,
    /// Seconds during which visible differences waited to be sent.
    waited: f64,
    /// Share of the time with visible differences during which the connection was busy.
    busy: f64,
}

/// Renders a scene in waves. The next wave starts when no visible difference and no text waits to
/// be sent.
fn converge(scene: &Scene) -> Figures {
    let mut work = Work::new(scene, SPP);
    let mut connection = Connection::new(SCREEN, RATE, ROUND_TRIP);
    let (mut errors, mut first_64) = (Vec::new(), 0);
    while !work.done {
        work.wave();
        let start = connection.now;
        loop {
            connection.pass(&work.target(), Duration::from_millis(200));
            let is_pending = connection.diff.pending.visible || connection.diff.pending.text;
            if !is_pending {
                break;
            }
            assert!(connection.now < start + Duration::from_secs(20), "it never catches up");
        }
        errors.push(work.error(connection.parser.screen()));
        if work.target().samples <= 64.0 {
            first_64 = connection.total();
        }
    }
    let start = connection.now;
    while !work.is_exact(connection.parser.screen()) {
        assert!(connection.now < start + Duration::from_secs(60), "it never becomes exact");
        connection.pass(&work.target(), Duration::from_millis(100));
    }
    for sent in &connection.sent {
        assert!(sent.bytes <= sent.budget, "{sent:?}");
    }
    Figures {
        frames: connection.sent.len(),
        total: connection.total(),
        flushed: connection.sent.iter().map(|sent| sent.flushed).sum(),
        first_64,
        largest: connection.sent.iter().map(|sent| sent.bytes).max().unwrap(),
        mean_error: errors.iter().sum::<f64>() / errors.len() as f64,
        exact_after: (connection.now - start).as_secs_f64(),
        waited: connection.waited[0].as_secs_f64(),
        busy: connection.busy(),
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
fn mirror_room_stays_within_bytes_and_error() {
    let figures = converge(&shipped("mirror-room.toml"));
    report("mirror room", &figures);
    assert!(figures.total <= 2_500_000, "{} bytes", figures.total);
    assert!(figures.mean_error <= 0.0065, "{}", figures.mean_error);
    assert!(figures.exact_after < 30.0);
    assert!(figures.busy >= 0.6, "{}", figures.busy);
}

#[test]
fn noisy_scene_stays_within_bytes() {
    let figures = converge(&parsed(NOISY));
    report("noisy everywhere", &figures);
    assert!(figures.total <= 4_000_000, "{} bytes", figures.total);
    assert!(figures.busy >= 0.6, "{}", figures.busy);
}

/// Checks that frames depend only on the shown cells and on the simulated time.
#[test]
fn frames_are_deterministic() {
    let scene = shipped("roughness-0.3.toml");
    let sent = |_| {
        let mut work = Work::new(&scene, 16);
        let mut connection = Connection::new(SCREEN, RATE, ROUND_TRIP);
        while !work.done {
            work.wave();
            connection.pass(&work.target(), Duration::from_millis(300));
        }
        connection.sent.iter().map(|sent| sent.bytes).collect::<Vec<_>>()
    };
    let [first, second] = [0, 1].map(sent);
    assert!(first.len() > 10);
    assert_eq!(first, second);
}

#[test]
fn new_picture_shows_in_its_first_frame() {
    let scene = shipped("mirror-room.toml");
    let mut work = Work::new(&scene, 8);
    let mut connection = Connection::new(SCREEN, RATE, ROUND_TRIP);
    while !work.done {
        work.wave();
        connection.pass(&work.target(), Duration::from_secs(3));
    }
    let other = shipped("viewpoint-left.toml");
    work.edit(&other, 8);
    work.wave();
    let before = work.error(connection.parser.screen());
    let frames = connection.sent.len();
    while connection.sent.len() == frames {
        connection.pass(&work.target(), Duration::from_millis(5));
    }
    let first = connection.sent[frames];
    connection.drain();
    let after = work.error(connection.parser.screen());
    println!("{} of {} B: error {before:.3} -> {after:.3}", first.bytes, first.budget);
    assert!(first.bytes <= first.budget && after < 0.6 * before, "{before} {after}");
}

/// Checks that the connection is busy for at least 60 % of the time in which visible differences
/// wait to be sent. Also checks that no frame is so long that user input would wait for more than
/// 0.15 s.
#[test]
fn connection_is_busy_while_differences_wait() {
    let scenes = ["mirror-room.toml", "viewpoint-left.toml"].map(shipped);
    for acting in [false, true] {
        let mut work = Work::new(&scenes[0], 8);
        let mut connection = Connection::new(SCREEN, RATE, ROUND_TRIP);
        connection.is_user_active = acting;
        for edit in 1..9 {
            while !work.done {
                work.wave();
                connection.pass(&work.target(), Duration::from_millis(120));
            }
            work.edit(&scenes[edit % 2], 8);
        }
        let [waited, busy] = [connection.waited[0].as_secs_f64(), connection.busy()];
        println!("acting: {acting}; busy for {:.0} % of {waited:.1} s", 100.0 * busy);
        assert!(waited > 2.0 && busy >= 0.6, "{acting} {waited} {busy}");
        let longest = connection.sent.iter().map(|sent| sent.bytes).max().unwrap();
        assert!(longest as f64 <= 0.15 * RATE, "{longest} bytes");
    }
}

/// Checks the latency of key presses while the effects of earlier ones are being sent. The bound of
/// the median is the sum of the round-trip time, 0.1 s for the frame in transmission, 0.05 s for
/// the error of the measured round-trip time, and the transmission time of a kilobyte. At 1 Mbit/s
/// and a round trip of 0.1 s this is about 0.25 s, the required latency.
#[test]
fn keys_wait_for_one_frame_only() {
    use zerkalo_terminal::flow::PacingMode::{AckClocked, SendQueue};
    let scenes = ["mirror-room.toml", "viewpoint-left.toml"].map(shipped);
    let works = scenes.map(|scene| {
        let mut work = Work::new(&scene, 16);
        while !work.done {
            work.wave();
        }
        work
    });
    let mut numbers = 0x2545_f491_u32;
    // The measured rate of a slow connection takes more keys to settle.
    for (rate, round_trip, keys, limit) in [(RATE, 100, 24, 0.25), (32e3, 300, 40, 0.48)] {
        for mode in [AckClocked(None), SendQueue] {
            let round_trip = Duration::from_millis(round_trip);
            let mut connection = Connection::with_mode(SCREEN, rate, round_trip, mode);
            let target = |key: u64| {
                let work = &works[key as usize % 2];
                TargetFrame { subject: key, version: key, ..work.target() }
            };
            connection.pass(&target(0), Duration::from_secs(20));
            let mut latencies = Vec::new();
            for key in 1..=keys {
                latencies.push(connection.press(&target(key - 1), &target(key)).as_secs_f64());
                numbers = numbers.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
                let pause = 250 + u64::from(numbers >> 23);
                connection.pass(&target(key), Duration::from_millis(pause));
            }
            latencies.sort_by(f64::total_cmp);
            let [median, p95] = [latencies.len() / 2, latencies.len() - 2].map(|at| latencies[at]);
            let found = connection.flow.rate().unwrap();
            let what = format!(
                "{mode:?}, {rate} B/s, {round_trip:?}: median {median:.3} s, p95 {p95:.3} s, rate {found:.0}"
            );
            println!("{what}");
            assert!(median <= limit && p95 <= 1.3 * limit, "{what}");
            assert!((0.7..1.3).contains(&(found / rate)), "{what}");
        }
    }
}

#[test]
fn picture_becomes_exact_without_replies() {
    let mut work = Work::new(&shipped("mirror-room.toml"), 16);
    let mut connection = Connection::new(SCREEN, RATE, ROUND_TRIP);
    connection.is_replying = false;
    while !work.done {
        work.wave();
        connection.pass(&work.target(), Duration::from_secs(2));
    }
    let start = connection.now;
    while !work.is_exact(connection.parser.screen()) {
        assert!(connection.now < start + Duration::from_secs(120), "it never becomes exact");
        connection.pass(&work.target(), Duration::from_millis(500));
    }
}
