use crate::terminal::flow::*;
use crate::terminal::{Capabilities, Environment};

fn ms(n: u64) -> Duration {
    Duration::from_millis(n)
}

fn start(mode: PacingMode) -> InitialLink {
    InitialLink { mode, round_trip: Some(ms(100)), queue: false, fixed_rate: DEFAULT_RATE }
}

/// A line of `rate` bytes a second with a terminal at its end that answers after `round_trip`.
struct Wire {
    rate: f64,
    round_trip: Duration,
    free_at: Duration,
}

impl Wire {
    /// When the answer to what is sent now comes back.
    fn send(&mut self, now: Duration, bytes: usize) -> Duration {
        self.free_at = self.free_at.max(now) + Duration::from_secs_f64(bytes as f64 / self.rate);
        self.free_at + self.round_trip
    }
}

/// Sends as much as it may for `seconds`: the share of the line that was used in the second half, and
/// the longest time that bytes waited for the line.
fn saturate(
    link: &mut FlowControl,
    wire: &mut Wire,
    seconds: u64,
    acting: bool,
) -> (f64, Duration) {
    let mut answers = std::collections::VecDeque::new();
    let (mut used, mut waited) = (0, Duration::ZERO);
    for at in 0..seconds * 1000 {
        let now = ms(at);
        while answers.front().is_some_and(|at| *at <= now) {
            link.on_ack(answers.pop_front().unwrap());
        }
        link.expire(now);
        if acting && at % 50 == 0 {
            link.act(now);
        }
        if let Some(allowance) = link.allowance(now, false) {
            let bytes = allowance.bytes;
            link.sent(now, bytes, allowance.picture, 0);
            answers.push_back(wire.send(now, bytes));
            if at >= seconds * 500 {
                used += bytes;
                waited = waited.max(wire.free_at.saturating_sub(now));
            }
        }
    }
    (used as f64 / (wire.rate * seconds as f64 / 2.0), waited)
}

#[test]
fn the_rate_is_found_and_the_line_is_kept_busy() {
    for (rate, round_trip) in [(125e3, 100), (125e3, 30), (1.25e6, 40), (20e3, 300), (12.5e6, 10)] {
        let mut link = FlowControl::new(InitialLink {
            round_trip: None,
            ..start(PacingMode::AckClocked(None))
        });
        let mut wire = Wire { rate, round_trip: ms(round_trip), free_at: Duration::ZERO };
        let (busy, waited) = saturate(&mut link, &mut wire, 70, false);
        let found = link.reading().unwrap().rate;
        let what = format!("{rate} B/s, {round_trip} ms: {found:.0}, busy {busy:.2}, {waited:?}");
        // Frames have a most size and a least distance, so the fastest lines are not filled.
        let expected = (BUDGET[2] / 0.033 / rate).min(1.0);
        assert!(busy > 0.6 * expected, "{what}");
        assert!(found > 0.6 * rate.min(8e6) && found < 1.6 * rate, "{what}");
        assert!(waited < ms(400), "{what}");
    }
}

#[test]
fn who_acts_waits_for_one_frame_only() {
    let mut link = FlowControl::new(start(PacingMode::AckClocked(None)));
    let mut wire = Wire { rate: 125e3, round_trip: ms(100), free_at: Duration::ZERO };
    let (busy, waited) = saturate(&mut link, &mut wire, 20, true);
    assert!(waited < ms(160) && busy > 0.8, "{waited:?}, busy {busy:.2}");
    let now = ms(20_000);
    link.act(now);
    link.flights = FramesInFlight::default();
    link.sent(now, 9000, true, 0);
    // The answer to a key may go beside that, the next one not.
    assert!(link.allowance(now + ms(40), false).is_none());
    let answer = link.allowance(now + ms(1), true).unwrap();
    assert!(answer.picture);
    link.sent(now + ms(1), answer.bytes, true, 0);
    let beside = link.allowance(now + ms(2), true).unwrap();
    assert_eq!(beside, FrameBudget { bytes: BESIDE, picture: false, refinement: 0 });
    link.sent(now + ms(2), BESIDE, false, 0);
    assert_eq!(link.allowance(now + ms(3), true), None);
}

#[test]
fn the_first_answer_does_not_wait_for_what_was_sent_before() {
    let mut link = FlowControl::new(start(PacingMode::AckClocked(None)));
    (0..2).for_each(|i| link.sent(ms(40 * i), 8000, true, 0));
    let now = ms(80);
    assert_eq!(link.allowance(now, false), None);
    link.act(now);
    assert!(link.allowance(now, true).unwrap().picture);
    link.sent(now, 8000, true, 0);
    // The next one does.
    link.act(ms(110));
    assert!(!link.allowance(ms(110), true).is_some_and(|allowance| allowance.picture));
}

#[test]
fn a_terminal_that_is_here_takes_everything() {
    let mut link = FlowControl::new(start(PacingMode::Unlimited));
    let all = FrameBudget { bytes: usize::MAX, picture: true, refinement: usize::MAX / 2 };
    assert_eq!(link.allowance(ms(5), false), Some(all));
    link.sent(ms(5), 100_000, true, 0);
    assert_eq!(link.allowance(ms(6), true), Some(all));
    assert_eq!(link.allowance(ms(6), false), None);
    assert_eq!(link.wakes_at(ms(6), false), ms(38));
    assert_eq!(link.allowance(ms(38), false), Some(all));
    assert_eq!((link.ack_request(), link.reading(), link.threshold()), (None, None, 0.0));
}

#[test]
fn lost_answers_end_the_questions_and_late_ones_bring_them_back() {
    let mut link = FlowControl::new(start(PacingMode::AckClocked(None)));
    let mut now = ms(0);
    for _ in 0..MOST_LOSSES {
        assert!(link.ack_request().is_some());
        link.sent(now, 4000, true, 0);
        link.sent(now, 4000, true, 0);
        assert!(link.wakes_at(now, false) <= now + LOST_AFTER);
        now += LOST_AFTER;
        link.expire(now);
    }
    let reading = link.reading().unwrap();
    assert_eq!((reading.mode, reading.rate), (PacingMode::FixedRate, DEFAULT_RATE));
    assert_eq!(link.ack_request(), None);
    // It goes on at that rate.
    let mut sent = 0;
    for _ in 0..10_000 {
        now += ms(1);
        link.expire(now);
        if let Some(allowance) = link.allowance(now, false) {
            link.sent(now, allowance.bytes, true, 0);
            sent += allowance.bytes;
        }
    }
    assert!((0.9..1.1).contains(&(sent as f64 / 10.0 / DEFAULT_RATE)), "{sent}");
    assert!(link.on_ack(now));
    assert_eq!(link.reading().unwrap().mode, PacingMode::AckClocked(None));
}

#[test]
fn the_kernel_is_the_second_choice() {
    let mut link =
        FlowControl::new(InitialLink { queue: true, ..start(PacingMode::AckClocked(None)) });
    for i in 0..u64::from(MOST_LOSSES) {
        link.sent(LOST_AFTER * i as u32, 4000, true, 0);
        link.expire(LOST_AFTER * (i as u32 + 1));
    }
    assert_eq!(link.reading().unwrap().mode, PacingMode::SendQueue);
    // A line of 100 kB/s: the rate is learned from what the kernel holds back.
    let (mut queue, mut most) = (0.0f64, 0.0f64);
    for at in 9_001..20_000 {
        let now = ms(at);
        queue = (queue - 100.0).max(0.0);
        if link.asks_kernel(now) {
            link.held_back(now, Some(queue as usize));
        }
        if let Some(allowance) = link.allowance(now, false) {
            link.sent(now, allowance.bytes, true, 0);
            queue += allowance.bytes as f64;
            most = most.max(queue);
        }
    }
    let rate = link.reading().unwrap().rate;
    assert!((80e3..120e3).contains(&rate), "{rate}");
    assert!(most < 32e3, "{most}");
    // The connection has gone.
    link.held_back(ms(20_000), None);
    assert_eq!(link.reading().unwrap().mode, PacingMode::FixedRate);
}

#[test]
fn differences_that_nobody_sees_take_a_quarter_of_the_line() {
    let mut link = FlowControl::new(start(PacingMode::FixedRate));
    let mut flushed = 0;
    for at in 0..20_000 {
        let Some(allowance) = link.allowance(ms(at), false) else { continue };
        if allowance.refinement > 0 {
            link.sent(ms(at), allowance.refinement, true, allowance.refinement);
            flushed += allowance.refinement;
        }
    }
    let share = flushed as f64 / 20.0 / DEFAULT_RATE;
    assert!((0.2..=0.26).contains(&share), "{share}");
}

#[test]
fn slow_and_fast_lines_have_thresholds_of_their_own() {
    let at = |rate| {
        FlowControl { rate, ..FlowControl::new(start(PacingMode::AckClocked(None))) }.threshold()
    };
    assert_eq!([at(30e3), at(125e3), at(2e6)], [0.04, 0.02, 0.01]);
}

#[test]
fn who_answers_is_found_out() {
    let ssh = |multiplexer, round_trip, passthrough| {
        let surroundings = Environment {
            ssh: Some("10.0.0.1 5000 10.0.0.2 22".into()),
            multiplexer,
            ..Environment::default()
        };
        let asked = Capabilities::from_environment(surroundings);
        Capabilities { round_trip, passthrough, ..asked }
    };
    let tmux = Some(Multiplexer::Tmux);
    for (terminal, queue, rate, expected) in [
        (ssh(None, Some(ms(100)), None), true, None, PacingMode::AckClocked(None)),
        (ssh(None, Some(ms(1)), None), true, None, PacingMode::SendQueue),
        (ssh(None, Some(ms(1)), None), false, None, PacingMode::FixedRate),
        (ssh(None, None, None), false, None, PacingMode::FixedRate),
        (ssh(tmux, Some(ms(1)), Some(ms(100))), true, None, PacingMode::AckClocked(tmux)),
        (ssh(tmux, Some(ms(1)), None), true, None, PacingMode::SendQueue),
        (ssh(tmux, Some(ms(1)), None), false, None, PacingMode::FixedRate),
        (ssh(None, Some(ms(100)), None), true, Some(5e3), PacingMode::FixedRate),
        (
            Capabilities::from_environment(Environment::default()),
            false,
            None,
            PacingMode::Unlimited,
        ),
    ] {
        let start = InitialLink::of(&terminal, queue, rate);
        assert_eq!(start.mode, expected, "{terminal:?}");
        assert_eq!(start.fixed_rate, rate.unwrap_or(DEFAULT_RATE));
    }
}
