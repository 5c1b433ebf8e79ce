use crate::terminal::flow::*;
use crate::terminal::{Capabilities, Environment};

fn ms(n: u64) -> Duration {
    Duration::from_millis(n)
}

fn start(mode: PacingMode) -> InitialLink {
    InitialLink { mode, round_trip: Some(ms(100)), queue: false, fixed_rate: DEFAULT_RATE }
}

/// Simulated connection of `rate` bytes per second to a terminal that replies after `round_trip`.
struct Wire {
    rate: f64,
    round_trip: Duration,
    free_at: Duration,
}

impl Wire {
    /// Sends bytes. Returns the time at which the reply comes.
    fn send(&mut self, now: Duration, bytes: usize) -> Duration {
        self.free_at = self.free_at.max(now) + Duration::from_secs_f64(bytes as f64 / self.rate);
        self.free_at + self.round_trip
    }
}

/// Sends frames for `seconds`, each as large as permitted. Returns two results for the second half
/// of this time: the share of the connection's rate that was used, and the longest time for which
/// bytes waited in the connection.
fn saturate(
    flow: &mut FlowControl,
    wire: &mut Wire,
    seconds: u64,
    is_active: bool,
) -> (f64, Duration) {
    let mut replies = std::collections::VecDeque::new();
    let (mut used, mut longest_wait) = (0, Duration::ZERO);
    for at in 0..seconds * 1000 {
        let now = ms(at);
        while replies.front().is_some_and(|at| *at <= now) {
            flow.on_ack(replies.pop_front().unwrap());
        }
        flow.expire(now);
        if is_active && at % 50 == 0 {
            flow.act(now);
        }
        if let Some(allowance) = flow.allowance(now, false) {
            let bytes = allowance.bytes;
            flow.sent(now, bytes, allowance.picture, 0);
            replies.push_back(wire.send(now, bytes));
            if at >= seconds * 500 {
                used += bytes;
                longest_wait = longest_wait.max(wire.free_at.saturating_sub(now));
            }
        }
    }
    (used as f64 / (wire.rate * seconds as f64 / 2.0), longest_wait)
}

#[test]
fn rate_is_measured_and_connection_kept_busy() {
    for (rate, round_trip) in [(125e3, 100), (125e3, 30), (1.25e6, 40), (20e3, 300), (12.5e6, 10)] {
        let mut flow = FlowControl::new(InitialLink {
            round_trip: None,
            ..start(PacingMode::AckClocked(None))
        });
        let mut wire = Wire { rate, round_trip: ms(round_trip), free_at: Duration::ZERO };
        let (busy, waited) = saturate(&mut flow, &mut wire, 70, false);
        let rate_found = flow.reading().unwrap().rate;
        let what =
            format!("{rate} B/s, {round_trip} ms: {rate_found:.0}, busy {busy:.2}, {waited:?}");
        // Frame size and interval are limited, so the fastest connections are not filled.
        let expected = (BUDGET[2] / 0.033 / rate).min(1.0);
        assert!(busy > 0.6 * expected, "{what}");
        assert!(rate_found > 0.6 * rate.min(8e6) && rate_found < 1.6 * rate, "{what}");
        assert!(waited < ms(400), "{what}");
    }
}

#[test]
fn input_waits_for_one_frame_only() {
    let mut flow = FlowControl::new(start(PacingMode::AckClocked(None)));
    let mut wire = Wire { rate: 125e3, round_trip: ms(100), free_at: Duration::ZERO };
    let (busy, waited) = saturate(&mut flow, &mut wire, 20, true);
    assert!(waited < ms(160) && busy > 0.8, "{waited:?}, busy {busy:.2}");
    let now = ms(20_000);
    flow.act(now);
    flow.in_flight = FramesInFlight::default();
    flow.sent(now, 9000, true, 0);
    // The effect of one key may be sent while that frame is in flight, but not the effect of the
    // next key.
    assert!(flow.allowance(now + ms(40), false).is_none());
    let effect = flow.allowance(now + ms(1), true).unwrap();
    assert!(effect.picture);
    flow.sent(now + ms(1), effect.bytes, true, 0);
    let text = flow.allowance(now + ms(2), true).unwrap();
    assert_eq!(text, FrameBudget { bytes: MAX_TEXT, picture: false, refinement: 0 });
    flow.sent(now + ms(2), MAX_TEXT, false, 0);
    assert_eq!(flow.allowance(now + ms(3), true), None);
}

#[test]
fn first_effect_of_input_does_not_wait_for_earlier_frames() {
    let mut flow = FlowControl::new(start(PacingMode::AckClocked(None)));
    (0..2).for_each(|i| flow.sent(ms(40 * i), 8000, true, 0));
    let now = ms(80);
    assert_eq!(flow.allowance(now, false), None);
    flow.act(now);
    assert!(flow.allowance(now, true).unwrap().picture);
    flow.sent(now, 8000, true, 0);
    // The effect of the next input waits.
    flow.act(ms(110));
    assert!(!flow.allowance(ms(110), true).is_some_and(|allowance| allowance.picture));
}

#[test]
fn local_terminal_has_no_byte_limit() {
    let mut flow = FlowControl::new(start(PacingMode::Unlimited));
    let all = FrameBudget { bytes: usize::MAX, picture: true, refinement: usize::MAX / 2 };
    assert_eq!(flow.allowance(ms(5), false), Some(all));
    flow.sent(ms(5), 100_000, true, 0);
    assert_eq!(flow.allowance(ms(6), true), Some(all));
    assert_eq!(flow.allowance(ms(6), false), None);
    assert_eq!(flow.wakes_at(ms(6), false), ms(38));
    assert_eq!(flow.allowance(ms(38), false), Some(all));
    assert_eq!((flow.ack_request(), flow.reading(), flow.threshold()), (None, None, 0.0));
}

#[test]
fn lost_replies_stop_requests_and_late_ones_resume_them() {
    let mut flow = FlowControl::new(start(PacingMode::AckClocked(None)));
    let mut now = ms(0);
    for _ in 0..MAX_LOSSES {
        assert!(flow.ack_request().is_some());
        flow.sent(now, 4000, true, 0);
        flow.sent(now, 4000, true, 0);
        assert!(flow.wakes_at(now, false) <= now + LOST_AFTER);
        now += LOST_AFTER;
        flow.expire(now);
    }
    let reading = flow.reading().unwrap();
    assert_eq!((reading.mode, reading.rate), (PacingMode::FixedRate, DEFAULT_RATE));
    assert_eq!(flow.ack_request(), None);
    // Frames are still sent, at the fixed rate.
    let mut sent = 0;
    for _ in 0..10_000 {
        now += ms(1);
        flow.expire(now);
        if let Some(allowance) = flow.allowance(now, false) {
            flow.sent(now, allowance.bytes, true, 0);
            sent += allowance.bytes;
        }
    }
    assert!((0.9..1.1).contains(&(sent as f64 / 10.0 / DEFAULT_RATE)), "{sent}");
    assert!(flow.on_ack(now));
    assert_eq!(flow.reading().unwrap().mode, PacingMode::AckClocked(None));
}

#[test]
fn send_queue_replaces_lost_replies() {
    let mut flow =
        FlowControl::new(InitialLink { queue: true, ..start(PacingMode::AckClocked(None)) });
    for i in 0..u64::from(MAX_LOSSES) {
        flow.sent(LOST_AFTER * i as u32, 4000, true, 0);
        flow.expire(LOST_AFTER * (i as u32 + 1));
    }
    assert_eq!(flow.reading().unwrap().mode, PacingMode::SendQueue);
    // The connection carries 100 kB/s. The rate is estimated from the send queue.
    let (mut queue, mut longest_queue) = (0.0f64, 0.0f64);
    for at in 9_001..20_000 {
        let now = ms(at);
        queue = (queue - 100.0).max(0.0);
        if flow.asks_kernel(now) {
            flow.held_back(now, Some(queue as usize));
        }
        if let Some(allowance) = flow.allowance(now, false) {
            flow.sent(now, allowance.bytes, true, 0);
            queue += allowance.bytes as f64;
            longest_queue = longest_queue.max(queue);
        }
    }
    let rate = flow.reading().unwrap().rate;
    assert!((80e3..120e3).contains(&rate), "{rate}");
    assert!(longest_queue < 32e3, "{longest_queue}");
    // The kernel no longer lists the connection.
    flow.held_back(ms(20_000), None);
    assert_eq!(flow.reading().unwrap().mode, PacingMode::FixedRate);
}

#[test]
fn refinement_takes_a_quarter_of_the_rate() {
    let mut flow = FlowControl::new(start(PacingMode::FixedRate));
    let mut refined = 0;
    for at in 0..20_000 {
        let Some(allowance) = flow.allowance(ms(at), false) else { continue };
        if allowance.refinement > 0 {
            flow.sent(ms(at), allowance.refinement, true, allowance.refinement);
            refined += allowance.refinement;
        }
    }
    let share = refined as f64 / 20.0 / DEFAULT_RATE;
    assert!((0.2..=0.26).contains(&share), "{share}");
}

#[test]
fn threshold_depends_on_rate() {
    let threshold = |rate| {
        FlowControl { rate, ..FlowControl::new(start(PacingMode::AckClocked(None))) }.threshold()
    };
    assert_eq!([threshold(30e3), threshold(125e3), threshold(2e6)], [0.04, 0.02, 0.01]);
}

#[test]
fn acknowledgement_source_follows_probe() {
    let ssh = |multiplexer, round_trip, passthrough| {
        let environment = Environment {
            ssh: Some("10.0.0.1 5000 10.0.0.2 22".into()),
            multiplexer,
            ..Environment::default()
        };
        let defaults = Capabilities::from_environment(environment);
        Capabilities { round_trip, passthrough, ..defaults }
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
