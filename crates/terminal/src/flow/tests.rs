use crate::flow::*;
use crate::{Capabilities, Environment};

fn ms(n: u64) -> Duration {
    Duration::from_millis(n)
}

fn start(mode: PacingMode) -> InitialLink {
    InitialLink { mode, round_trip: Some(ms(100)), queue: false, fixed_rate: DEFAULT_RATE }
}

fn forget_frames(flow: &mut FlowControl) {
    let Pacing::AckClocked(clock) = &mut flow.pacing else { panic!("{flow:?}") };
    clock.forget_frames();
}

/// Simulated connection of `rate` bytes per second to a terminal. The terminal's reply arrives
/// `round_trip` after the end of the transmission.
struct Wire {
    rate: f64,
    round_trip: Duration,
    free_at: Duration,
}

impl Wire {
    /// Sends `bytes` bytes at the time `now`. Returns the time at which the terminal's reply
    /// arrives.
    fn send(&mut self, now: Duration, bytes: usize) -> Duration {
        self.free_at = self.free_at.max(now) + Duration::from_secs_f64(bytes as f64 / self.rate);
        self.free_at + self.round_trip
    }
}

/// Sends frames of the size that flow control permits, for `seconds`. If `is_active` is `true`,
/// user input is recorded every 50 ms. Returns `(share, wait)` for the second half of this time.
/// `share` is the ratio of the bytes sent to those that the connection could transmit. `wait` is
/// the longest time from the sending of a frame to the end of its transmission.
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
            flow.record_input(now);
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
        let rate_found = flow.rate().unwrap();
        let what =
            format!("{rate} B/s, {round_trip} ms: {rate_found:.0}, busy {busy:.2}, {waited:?}");
        // The byte budget and the interval of frames are limited, so that frames cannot fill the
        // fastest of these connections.
        let expected = (BUDGET[1] / 0.033 / rate).min(1.0);
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
    flow.record_input(now);
    forget_frames(&mut flow);
    flow.sent(now, 9000, true, 0);
    // While the frame of 9000 bytes is in flight, a frame with the effect of one key may be sent,
    // but not one with the effect of the next key.
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
    flow.record_input(now);
    assert!(flow.allowance(now, true).unwrap().picture);
    flow.sent(now, 8000, true, 0);
    // The frame with the effect of the next input waits for the frames in flight.
    flow.record_input(ms(110));
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
    assert_eq!((flow.ack_request(), flow.rate(), flow.threshold()), (None, None, 0.0));
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
    assert!(matches!(flow.pacing, Pacing::FixedRate));
    assert_eq!((flow.rate(), flow.ack_request()), (Some(DEFAULT_RATE), None));
    // Without replies, frames are still sent, at the fixed rate.
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
    assert!(matches!(flow.pacing, Pacing::AckClocked(_)));
}

#[test]
fn send_queue_replaces_lost_replies() {
    let mut flow =
        FlowControl::new(InitialLink { queue: true, ..start(PacingMode::AckClocked(None)) });
    for i in 0..u64::from(MAX_LOSSES) {
        flow.sent(LOST_AFTER * i as u32, 4000, true, 0);
        flow.expire(LOST_AFTER * (i as u32 + 1));
    }
    assert!(matches!(flow.pacing, Pacing::SendQueue(_)));
    let now = LOST_AFTER * MAX_LOSSES;
    // The kernel no longer lists the connection.
    flow.sent(now, 4000, true, 0);
    assert!(flow.measures_at(now).is_some_and(|at| flow.wants_queue_length(at)));
    flow.record_queue_length(now, None);
    assert!(matches!(flow.pacing, Pacing::FixedRate));
}

/// Simulated connection with a send queue. Bytes reach the queue `LAG` after they were sent, and
/// leave it when the other end acknowledges them.
struct MeasuredWire {
    wire: Wire,
    /// Frames that were sent: time of arrival in the send queue, start and end of transmission, and
    /// size in bytes.
    frames: std::collections::VecDeque<(Duration, Duration, Duration, f64)>,
}

impl MeasuredWire {
    const LAG: Duration = Duration::from_millis(6);

    fn new(rate: f64, round_trip: u64) -> Self {
        let wire = Wire { rate, round_trip: ms(round_trip), free_at: Duration::ZERO };
        Self { wire, frames: Default::default() }
    }

    fn send(&mut self, now: Duration, bytes: usize) {
        let queued_at = now + Self::LAG;
        let start = self.wire.free_at.max(queued_at);
        let end = self.wire.send(queued_at, bytes) - self.wire.round_trip;
        self.frames.push_back((queued_at, start, end, bytes as f64));
    }

    /// Returns the number of bytes in the send queue at the time `now`.
    fn queue(&mut self, now: Duration) -> usize {
        let acked_at = now.saturating_sub(self.wire.round_trip);
        while self.frames.front().is_some_and(|(_, _, end, _)| *end <= acked_at) {
            self.frames.pop_front();
        }
        let in_queue = |(queued_at, start, end, bytes): &(Duration, Duration, Duration, f64)| {
            let share =
                acked_at.saturating_sub(*start).as_secs_f64() / (*end - *start).as_secs_f64();
            if *queued_at <= now { bytes * (1.0 - share) } else { 0.0 }
        };
        self.frames.iter().map(in_queue).sum::<f64>().ceil() as usize
    }

    /// Simulates a dashboard that sends frames for `seconds`, beginning `from` seconds after the
    /// start of the simulation. `wants(time, limit)` returns the number of bytes that the dashboard
    /// sends; `time` is in milliseconds, and `limit` is the permitted number of bytes. Returns the
    /// longest time for which bytes waited to be transmitted, in the last quarter of the simulated
    /// time.
    fn run(
        &mut self,
        flow: &mut FlowControl,
        from: u64,
        seconds: u64,
        wants: impl Fn(u64, usize) -> usize,
    ) -> Duration {
        let mut longest = Duration::ZERO;
        for at in from * 1000..(from + seconds) * 1000 {
            let now = ms(at);
            if flow.wants_queue_length(now) {
                let queue = self.queue(now);
                flow.record_queue_length(now, Some(queue));
            }
            let Some(allowance) = flow.allowance(now, false) else { continue };
            let bytes = wants(at, allowance.bytes);
            if bytes > 0 {
                flow.sent(now, bytes, allowance.picture, 0);
                self.send(now, bytes);
                if at >= (from + seconds) * 1000 - seconds * 250 {
                    longest = longest.max(self.wire.free_at.saturating_sub(now));
                }
            }
        }
        longest
    }
}

#[test]
fn send_queue_holds_a_round_trip_and_a_frame() {
    for (rate, round_trip) in [(32e3, 300), (125e3, 100), (125e3, 30), (1.25e6, 40), (20e3, 300)] {
        let start = InitialLink { round_trip: None, ..start(PacingMode::SendQueue) };
        let mut flow = FlowControl::new(start);
        let mut wire = MeasuredWire::new(rate, round_trip);
        let waited = wire.run(&mut flow, 0, 60, |_, permitted| permitted);
        let found = flow.rate().unwrap();
        let what = format!("{rate} B/s, {round_trip} ms: {found:.0} B/s, {waited:?}");
        assert!((0.85..1.2).contains(&(found / rate)), "{what}");
        // At most two frames of 0.1 s wait: one in the queue, and the new one. Another 0.1 s is
        // allowed for the error of the estimated round trip and for the interval between
        // measurements.
        assert!(waited < ms(300), "{what}");
    }
}

#[test]
fn rate_stays_true_after_convergence() {
    for (rate, round_trip) in [(125e3, 100), (32e3, 300)] {
        let mut flow = FlowControl::new(start(PacingMode::SendQueue));
        let mut wire = MeasuredWire::new(rate, round_trip);
        wire.run(&mut flow, 0, 30, |_, permitted| permitted);
        // Every 450 ms one or two small frames are sent. They do not fill the connection.
        wire.run(
            &mut flow,
            30,
            60,
            |at, permitted| {
                if at % 450 < 40 { permitted.min(1400) } else { 0 }
            },
        );
        let found = flow.rate().unwrap();
        assert!((0.7..1.2).contains(&(found / rate)), "{found:.0} of {rate}");
    }
    // Two acknowledgements that arrive at the same time must not change the estimated rate much.
    let mut flow = FlowControl::new(start(PacingMode::AckClocked(None)));
    let mut wire = Wire { rate: 125e3, round_trip: ms(100), free_at: Duration::ZERO };
    saturate(&mut flow, &mut wire, 40, false);
    forget_frames(&mut flow);
    for i in 41..60 {
        let now = ms(1000 * i);
        flow.sent(now, 900, false, 0);
        flow.sent(now + ms(40), 3600, true, 0);
        flow.on_ack(now + ms(175));
        flow.on_ack(now + ms(175));
    }
    let found = flow.rate().unwrap();
    assert!((0.7..1.2).contains(&(found / 125e3)), "{found:.0}");
}

/// Checks that late replies do not lower the estimated rate of the connection. Some replies of the
/// simulated terminal are late: those that measure the round trip, and the acknowledgement of the
/// first of two frames.
#[test]
fn late_replies_prove_no_rate() {
    for (rate, round_trip) in [(125e3, 100), (32e3, 300)] {
        let link = InitialLink { round_trip: None, ..start(PacingMode::AckClocked(None)) };
        let mut flow = FlowControl::new(link);
        let mut wire = Wire { rate, round_trip: ms(round_trip), free_at: Duration::ZERO };
        saturate(&mut flow, &mut wire, 25, false);
        forget_frames(&mut flow);
        let is_true = |flow: &FlowControl| {
            let found = flow.rate().unwrap();
            assert!((0.7..1.3).contains(&(found / rate)), "{found:.0} of {rate}");
        };
        for i in 10..30 {
            let at = |after| ms(3000 * i + after);
            // The reply that measures the round trip arrives after four times the true round trip.
            flow.round_trip_at = Duration::ZERO;
            flow.sent(at(0), 500, false, 0);
            flow.on_ack(at(4 * round_trip));
            assert_eq!(flow.round_trip, Some(ms(4 * round_trip)));
            let bytes = (rate * 0.1) as usize;
            flow.sent(at(1500), bytes, true, 0);
            flow.on_ack(wire.send(at(1500), bytes));
            is_true(&flow);
            flow.sent(at(2000), 300, false, 0);
            flow.on_ack(wire.send(at(2000), 300));
            // The acknowledgement of the first of two frames is held back.
            let [first, second] = [2500, 2560].map(|after| {
                flow.sent(at(after), bytes / 2, true, 0);
                wire.send(at(after), bytes / 2)
            });
            flow.on_ack(first.max(second - ms(25)));
            flow.on_ack(second);
            is_true(&flow);
        }
    }
}

/// Simulated relay between the program and a slow connection. It acknowledges at once the bytes
/// that fit into its buffer, and transmits them at the rate of the connection. As a TCP receiver
/// does, it offers room again when half of the buffer is free.
struct Relay {
    rate: f64,
    round_trip: Duration,
    capacity: f64,
    /// Capacity to which the buffer grows, by eight bytes a millisecond while it is in use. The kernel
    /// enlarges its receive buffers so.
    final_capacity: f64,
    /// Ratio of the bytes that a multiplexer sends to those of frames.
    overhead: f64,
    /// Bytes that the relay accepts before it next offers room.
    window: f64,
    /// Bytes in the buffer of the relay, and in the send queue before it.
    buffered: f64,
    queued: f64,
    now: u64,
}

impl Relay {
    fn new(rate: f64, round_trip: u64, capacity: f64) -> Self {
        let (round_trip, final_capacity) = (ms(round_trip), capacity);
        let [overhead, window, buffered, queued] = [1.0, 0.0, 0.0, 0.0];
        Self {
            rate,
            round_trip,
            capacity,
            final_capacity,
            overhead,
            window,
            buffered,
            queued,
            now: 0,
        }
    }

    /// Advances the simulation by a millisecond, and reports the send queue to `flow`.
    fn step(&mut self, flow: &mut FlowControl) -> Duration {
        self.now += 1;
        self.buffered = (self.buffered - self.rate / 1e3).max(0.0);
        if self.queued > 0.0 && 2.0 * self.buffered > self.capacity {
            self.capacity = self.final_capacity.min(self.capacity + 8.0);
        }
        let room = self.capacity - self.buffered;
        if 2.0 * room >= self.capacity {
            self.window = room;
        }
        let accepted = self.queued.min(self.window);
        self.window -= accepted;
        self.buffered += accepted;
        self.queued -= accepted;
        let now = ms(self.now);
        if flow.wants_queue_length(now) {
            flow.record_queue_length(now, Some(self.queued.ceil() as usize));
        }
        now
    }

    /// Sends all that `flow` permits, for this number of milliseconds. Returns the time.
    fn fill(&mut self, flow: &mut FlowControl, milliseconds: u64) -> Duration {
        for _ in 0..milliseconds {
            self.step(flow);
            self.send(flow, usize::MAX, false);
        }
        ms(self.now)
    }

    /// Sends a frame of up to `wanted` bytes if `flow` permits one with cells of the picture.
    /// Returns the time from now until its first kilobyte arrives at the terminal.
    fn send(&mut self, flow: &mut FlowControl, wanted: usize, answers: bool) -> Option<Duration> {
        let now = ms(self.now);
        let allowance = flow.allowance(now, answers).filter(|allowance| allowance.picture)?;
        let ahead = self.buffered + self.queued;
        let bytes = allowance.bytes.min(wanted);
        flow.sent(now, bytes, true, 0);
        self.queued += self.overhead * bytes as f64;
        let transmission = (ahead + self.overhead * bytes.min(1000) as f64) / self.rate;
        Some(Duration::from_secs_f64(transmission) + self.round_trip / 2)
    }
}

/// Checks the estimated rate of the connection behind a relay.
#[test]
fn rate_is_true_behind_a_relay_that_buffers() {
    for (rate, frames, capacity) in [
        (125e3, 6000, 8e3),
        (125e3, 1400, 8e3),
        (32e3, 1500, 8e3),
        (32e3, 1500, 48e3),
        (125e3, 6000, 48e3),
        (1.25e6, 6000, 48e3),
    ] {
        let mut flow =
            FlowControl::new(InitialLink { round_trip: None, ..start(PacingMode::SendQueue) });
        let mut relay = Relay::new(rate, 0, capacity);
        let mut pass = |seconds: u64, wants: &dyn Fn(u64) -> usize| {
            for at in 0..seconds * 1000 {
                relay.step(&mut flow);
                if wants(at) > 0 {
                    relay.send(&mut flow, wants(at), false);
                }
            }
            flow.rate().unwrap()
        };
        let busy = pass(30, &|_| usize::MAX);
        let converged = pass(60, &|at| if at % 240 < 35 { frames } else { 0 });
        let what = format!("{rate}, {capacity}, {frames}: {busy:.0}, then {converged:.0}");
        assert!((0.7..1.3).contains(&(busy / rate)), "{what}");
        assert!((0.7..1.3).contains(&(converged / rate)), "{what}");
    }
}

/// Checks that the rate follows an interruption of the connection for five seconds, a fall to a
/// quarter, and the return. The last takes longer behind a relay, which must be filled to measure it.
#[test]
fn rate_follows_the_connection() {
    for (rate, capacity) in [(125e3, 2e3), (32e3, 2e3), (125e3, 48e3), (32e3, 48e3)] {
        let mut flow =
            FlowControl::new(InitialLink { round_trip: None, ..start(PacingMode::SendQueue) });
        let mut relay = Relay::new(rate, 0, capacity);
        let mut pass = |seconds: u64, rate: f64| {
            relay.rate = rate;
            relay.fill(&mut flow, seconds * 1000);
            flow.rate().unwrap() / rate
        };
        let start = pass(30, rate);
        pass(5, 1.0);
        let later = [pass(4, rate), pass(30, rate / 4.0), pass(60, rate)];
        let what = format!("{rate} B/s, {capacity} B: {start:.2}, {later:.2?}");
        assert!((0.7..1.4).contains(&start), "{what}");
        assert!(later.iter().all(|share| (0.5..2.0).contains(share)), "{what}");
    }
}

/// Checks the latency of 40 keys that are pressed while the picture converges, behind a relay, in
/// several courses. The bounds are the required ones. At 1 Mbit/s they are those of the same
/// connection with replies.
#[test]
fn keys_do_not_wait_for_bytes_in_a_relay() {
    for (rate, round_trip, limits) in [(32e3, 300, [0.55, 0.8]), (125e3, 100, [0.2, 0.35])] {
        let grown = [(40e3, 80e3), (48e3, 96e3), (80e3, 80e3)];
        let capacities = [2e3, 8e3, 24e3, 48e3, 64e3].map(|c| (c, c)).into_iter().chain(grown);
        for ((capacity, final_capacity), course) in
            capacities.flat_map(|c| (0..12_u32).map(move |i| (c, i)))
        {
            let mut flow =
                FlowControl::new(InitialLink { round_trip: None, ..start(PacingMode::SendQueue) });
            let mut relay = Relay::new(rate, round_trip, capacity);
            relay.final_capacity = final_capacity;
            relay.overhead = 1.0 + 0.05 * f64::from(course % 4);
            let mut latencies = Vec::new();
            for key in 0..40 {
                let first = 4500 + 800 * u64::from(course / 4);
                let pause = if key == 0 { first } else { 1500 + 37 * (key % 11) };
                let pressed = relay.fill(&mut flow, pause);
                let now = relay.fill(&mut flow, round_trip / 2);
                flow.record_input(now);
                let arrived = loop {
                    let now = relay.step(&mut flow);
                    if let Some(time) = relay.send(&mut flow, usize::MAX, true) {
                        break now + time;
                    }
                };
                latencies.push((arrived - pressed).as_secs_f64());
            }
            latencies.sort_by(f64::total_cmp);
            let found = [latencies[20], latencies[37]];
            let what = format!("{rate} B/s, {capacity} B in the relay, {course}: {found:.2?} s");
            assert!(found[0] <= limits[0] && found[1] <= limits[1], "{what}");
        }
    }
}

#[test]
fn unknown_round_trip_is_measured_by_a_small_frame() {
    let mut flow =
        FlowControl::new(InitialLink { round_trip: None, ..start(PacingMode::SendQueue) });
    let mut wire = MeasuredWire::new(125e3, 200);
    assert_eq!(flow.allowance(ms(0), false).unwrap().bytes, SMALL);
    wire.run(&mut flow, 0, 5, |_, permitted| permitted);
    let found = flow.round_trip.unwrap();
    assert!((ms(200)..ms(260)).contains(&found), "{found:?}");
}

#[test]
fn connection_without_acknowledgements_becomes_silent() {
    let mut flow = FlowControl::new(start(PacingMode::SendQueue));
    assert_eq!(flow.silent_at(None), None, "nothing is under way");
    flow.sent(ms(0), 5000, true, 0);
    let mut now = ms(0);
    while flow.silent_at(None).unwrap() > now {
        assert!(now < ms(60_000));
        now += ms(20);
        if flow.wants_queue_length(now) {
            flow.record_queue_length(now, Some(5000));
        }
    }
    let Pacing::SendQueue(queue) = &flow.pacing else { panic!("{flow:?}") };
    assert_eq!(flow.measures_at(now), Some(queue.measured_at.unwrap() + STALLED_INTERVAL));
    // Input delays the time at which the connection is treated as silent. When all bytes are
    // acknowledged, there is no such time.
    flow.record_input(now);
    assert!(flow.silent_at(None).unwrap() > now);
    flow.record_queue_length(now, Some(0));
    assert_eq!(flow.silent_at(None), None);
    // At a fixed rate, without acknowledgements, only a write that does not return shows that the
    // connection is silent.
    let flow = FlowControl::new(start(PacingMode::FixedRate));
    assert_eq!(flow.silent_at(Some(ms(7))), Some(ms(7) + SILENT_AFTER));
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
fn acknowledgement_source_follows_capabilities() {
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
