//! Flow control: measures the rate of the connection and limits the size of the next frame.
//!
//! A slow SSH connection accepts a megabyte at once, but the terminal shows it only many seconds
//! later. After each frame the program therefore requests the cursor position. The reply
//! acknowledges the frame, and its time gives the round trip and the rate. A frame holds at most
//! what the connection carries in 100 ms, and only a few frames are in flight. Without replies from
//! the terminal, the length of the kernel's TCP send queue is measured instead. If the kernel does
//! not report it, bytes are sent at a fixed rate.
//!
//! The module does no I/O and reads no clock: times and byte counts are arguments.

mod initial;
mod send_queue_estimate;
mod tcp_send_queue;
#[cfg(test)]
mod tests;

use crate::Multiplexer;
use crate::capability_query::cursor_request;
pub use initial::InitialLink;
use send_queue_estimate::SendQueueEstimate;
use std::collections::VecDeque;
use std::time::Duration;
pub use tcp_send_queue::TcpSendQueue;

/// Shortest interval between frames.
pub const FRAME_INTERVAL: Duration = Duration::from_millis(33);
/// Shortest interval between frames with text only, over SSH and without user input.
pub const TEXT_INTERVAL: Duration = Duration::from_millis(500);
/// Time in which the connection should transmit a frame.
const FRAME_SPAN: Duration = Duration::from_millis(100);
/// Byte budgets of a frame: `[smallest, initial, largest]`. The initial one applies before the
/// first measurement.
const BUDGET: [f64; 3] = [2e3, 8e3, 200e3];
/// Smallest assumed rate in bytes per second. At it a frame of the smallest budget takes one second;
/// at a rate near 0, after a pause of the connection, the next frame would not be due for minutes.
const MIN_RATE: f64 = 2e3;
/// Largest number of frames in flight, that is, not acknowledged.
const MAX_IN_FLIGHT: usize = 6;
/// Largest sum of bytes of the frames in flight that contain only text.
const MAX_TEXT: usize = 1500;
/// Number of bytes below which the time of a frame is mostly latency: its acknowledgement may raise
/// the measured rate, but not lower it.
const SMALL: usize = 1000;
/// Time after which a missing acknowledgement counts as lost.
const LOST_AFTER: Duration = Duration::from_secs(3);
/// Number of consecutive losses after which no acknowledgements are requested.
const MAX_LOSSES: u32 = 3;
/// Interval at which the shortest round trip is measured again.
const ROUND_TRIP_INTERVAL: Duration = Duration::from_secs(30);
/// Weight of a new measurement in the moving average of the rate.
const NEW_WEIGHT: f64 = 0.3;
/// Time after input during which the user counts as active.
const ACTIVE_TIME: Duration = Duration::from_millis(500);
/// Interval at which the send queue is measured.
const QUEUE_INTERVAL: Duration = Duration::from_millis(20);
/// Interval at which the send queue is measured after no byte has left it for [`LOST_AFTER`].
const STALLED_INTERVAL: Duration = Duration::from_millis(500);
/// Assumed round trip before the first measurement.
const DEFAULT_ROUND_TRIP: Duration = Duration::from_millis(100);
/// Time after which the connection is silent, if bytes wait, none is transmitted, and no input
/// arrives.
const SILENT_AFTER: Duration = Duration::from_secs(30);
/// Longest interval between two acknowledgements that are combined into one measurement. If the
/// first was delayed, the second alone would give too high a rate.
const ACKS_TOGETHER: Duration = Duration::from_millis(20);
/// Assumed rate of a connection that cannot be measured, in bytes per second.
pub const DEFAULT_RATE: f64 = 30e3;
/// Share of the rate that refinement may use: the sending of invisible differences.
const REFINEMENT_SHARE: f64 = 0.25;

/// Method that limits the rate of frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum PacingMode {
    /// The terminal is local.
    #[default]
    Unlimited,
    /// The terminal acknowledges each frame, through this multiplexer.
    AckClocked(Option<Multiplexer>),
    /// The kernel reports the length of the TCP send queue.
    SendQueue,
    /// Frames are sent at a fixed rate.
    FixedRate,
}

/// Limits of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameBudget {
    /// Largest number of bytes; `usize::MAX` means no limit.
    pub bytes: usize,
    /// `true` if the frame may contain cells of the picture.
    pub picture: bool,
    /// Largest number of bytes for refinement.
    pub refinement: usize,
}

/// State of the connection, for display.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkStatus {
    /// Bytes per second, measured or fixed.
    pub rate: f64,
    pub mode: PacingMode,
}

/// Flow control of the connection.
#[derive(Debug, Default)]
pub struct FlowControl {
    mode: PacingMode,
    /// Method that was suspended because the terminal did not reply, until a reply arrives.
    suspended_mode: Option<PacingMode>,
    start: InitialLink,
    /// Bytes per second, measured or fixed.
    rate: f64,
    /// Shortest round trip since its latest measurement, at `round_trip_at`.
    round_trip: Option<Duration>,
    round_trip_at: Duration,
    /// Half of the rate at the last measurement of the round trip. With [`PacingMode::SendQueue`],
    /// a lower rate causes a new measurement: a longer round trip may have lowered the rate,
    /// because the limit of the queue is derived from the round trip.
    doubtful_rate: f64,
    /// Frames in flight, oldest first.
    in_flight: VecDeque<InFlight>,
    /// `[time of sending, time of acknowledgement]` of the last acknowledged frame.
    last_acked: Option<[Duration; 2]>,
    losses: u32,
    /// Time at which the last period of user activity began.
    active_since: Duration,
    /// Time at which the last period of user activity ends.
    active_until: Duration,
    last_frame: Option<Duration>,
    /// Estimated time at which the bytes without acknowledgement request will have been
    /// transmitted.
    free_at: Duration,
    /// Estimated time at which the frames with acknowledgement request will have been transmitted.
    clear_at: Duration,
    /// Earliest time of the next refinement.
    pub refine_at: Duration,
    send_queue: SendQueueEstimate,
    /// Last measurement of the rate by acknowledgements.
    ack_sample: Option<AckSample>,
}

#[derive(Clone, Copy, Debug)]
struct InFlight {
    sent: Duration,
    bytes: usize,
    /// `true` if the frame contains cells of the picture.
    picture: bool,
    /// `true` if no other frame was in flight when it was sent.
    alone: bool,
}

/// Measurement of the rate by acknowledgements: a number of bytes, the time of the last
/// acknowledgement, and bounds of the time at which a reply to the first byte could have arrived.
#[derive(Clone, Copy, Debug)]
struct AckSample {
    earliest_start: Duration,
    latest_start: Duration,
    /// Time at which the previous frame was sent; `None` if the connection was idle in between.
    sent_from: Option<Duration>,
    at: Duration,
    bytes: usize,
}

impl FlowControl {
    pub fn new(start: InitialLink) -> Self {
        let assumed_rate = BUDGET[1] / FRAME_SPAN.as_secs_f64();
        Self {
            mode: start.mode,
            rate: match start.mode {
                PacingMode::FixedRate => start.fixed_rate,
                _ => assumed_rate,
            },
            round_trip: start.round_trip,
            doubtful_rate: assumed_rate / 2.0,
            start,
            ..Self::default()
        }
    }

    /// Returns the state of the connection; `None` for a local terminal.
    pub fn reading(&self) -> Option<LinkStatus> {
        let status = LinkStatus { rate: self.rate, mode: self.mode };
        (self.mode != PacingMode::Unlimited).then_some(status)
    }

    /// Returns the OKLab distance above which a difference is visible, larger for slower
    /// connections.
    pub fn threshold(&self) -> f32 {
        match self.mode {
            PacingMode::Unlimited => 0.0,
            // 10 Mbit/s and 300 kbit/s.
            _ if self.rate > 1.25e6 => 0.01,
            _ if self.rate < 37.5e3 => 0.04,
            _ => 0.02,
        }
    }

    /// Records user input. For `ACTIVE_TIME` the round trip is then measured only if the rate is
    /// doubtful.
    pub fn record_input(&mut self, now: Duration) {
        if now >= self.active_until {
            self.active_since = now;
        }
        self.active_until = now + ACTIVE_TIME;
    }

    /// Returns the acknowledgement request to send after a frame, if there is one.
    pub fn ack_request(&self) -> Option<&'static str> {
        match self.mode {
            PacingMode::AckClocked(multiplexer) => Some(cursor_request(multiplexer)),
            _ => None,
        }
    }

    /// Returns `true` if the caller should now measure the send queue for
    /// [`FlowControl::on_queue_length`].
    pub fn wants_queue_length(&self, now: Duration) -> bool {
        self.measures_at(now).is_some_and(|at| at <= now)
    }

    /// Returns the time of the next measurement of the send queue; `None` if it is empty or does
    /// not limit the frames.
    pub fn measures_at(&self, now: Duration) -> Option<Duration> {
        if self.mode != PacingMode::SendQueue {
            return None;
        }
        let is_stalled = self.send_queue.stalled_since().is_some_and(|at| at + LOST_AFTER <= now);
        self.send_queue.next_at(if is_stalled { STALLED_INTERVAL } else { QUEUE_INTERVAL })
    }

    /// Returns the time from which the connection is silent, unless bytes are transmitted or input
    /// arrives before; `None` if no bytes wait. `blocked_since` is the start of a write that has
    /// not returned.
    pub fn silent_at(&self, blocked_since: Option<Duration>) -> Option<Duration> {
        let is_measured = self.mode == PacingMode::SendQueue;
        let stalled_since = self.send_queue.stalled_since().filter(|_| is_measured);
        let since = stalled_since.into_iter().chain(blocked_since).min()?;
        Some(since.max(self.active_until) + SILENT_AFTER)
    }

    /// Returns the limits of a frame that may be sent now; `None` if none may be sent. `answers` is
    /// `true` if the frame shows the effect of user input: it need not keep the usual interval.
    pub fn allowance(&self, now: Duration, answers: bool) -> Option<FrameBudget> {
        // The round trip is measured by a small frame.
        let bytes = if self.needs_round_trip(now) { SMALL } else { self.budget() };
        let due = |interval| self.last_frame.is_none_or(|last| answers || last + interval <= now);
        if due(FRAME_INTERVAL) && self.has_room(now, answers) {
            let refinement = if self.refine_at <= now { bytes / 2 } else { 0 };
            return Some(FrameBudget { bytes, picture: true, refinement });
        }
        let texts = self.in_flight.iter().filter(|frame| !frame.picture);
        let text_bytes = MAX_TEXT.saturating_sub(texts.map(|frame| frame.bytes).sum());
        let may_send_text =
            self.mode != PacingMode::FixedRate || self.free_at <= now + 2 * FRAME_SPAN;
        let due = due(TEXT_INTERVAL) && may_send_text && text_bytes >= MAX_TEXT / 4;
        due.then_some(FrameBudget { bytes: text_bytes, picture: false, refinement: 0 })
    }

    /// Returns the next time at which [`FlowControl::allowance`] may permit a frame without a reply
    /// or input. `text` is `true` if text may remain to be sent.
    pub fn wakes_at(&self, now: Duration, text: bool) -> Duration {
        let after = |interval| self.last_frame.map_or(now, |last| last + interval);
        let frame = after(FRAME_INTERVAL);
        let room = match self.mode {
            PacingMode::Unlimited => frame,
            PacingMode::AckClocked(_) if self.has_room(now, false) => frame,
            PacingMode::AckClocked(_) if self.free_at > now => frame.max(self.free_at),
            PacingMode::AckClocked(_) if now < self.active_until.min(self.clear_at) => {
                frame.max(self.clear_at)
            }
            // By this time the oldest frame is acknowledged or lost.
            PacingMode::AckClocked(_) => self.lost_at().unwrap_or(frame),
            PacingMode::SendQueue => {
                let due = self.measures_at(now).unwrap_or(now);
                if self.has_room(now, false) { frame } else { frame.max(due) }
            }
            PacingMode::FixedRate => frame.max(self.free_at),
        };
        let at = if text { room.min(after(TEXT_INTERVAL)) } else { room };
        if at > now { at } else { now + QUEUE_INTERVAL }
    }

    /// Records that a frame was sent. `flushed` is the number of bytes of refinement.
    pub fn sent(&mut self, now: Duration, bytes: usize, picture: bool, flushed: usize) {
        let seconds = |bytes: usize, rate: f64| Duration::from_secs_f64(bytes as f64 / rate);
        self.last_frame = Some(now);
        if flushed > 0 {
            self.refine_at = now + seconds(flushed, REFINEMENT_SHARE * self.rate);
        }
        match self.mode {
            PacingMode::Unlimited => {}
            PacingMode::AckClocked(_) => {
                self.clear_at = self.clear_at.max(now) + seconds(bytes, self.rate);
                let alone = self.in_flight.is_empty();
                self.in_flight.push_back(InFlight { sent: now, bytes, picture, alone });
            }
            PacingMode::SendQueue => self.send_queue.sent(now, bytes, self.max_queue()),
            PacingMode::FixedRate => {
                self.free_at = self.free_at.max(now) + seconds(bytes, self.rate)
            }
        }
    }

    /// Records bytes that end inside an escape sequence, where no request can be inserted. The time
    /// of their transmission is estimated.
    pub fn sent_unasked(&mut self, now: Duration, bytes: usize) {
        if let PacingMode::AckClocked(_) = self.mode {
            self.last_frame = Some(now);
            let duration = Duration::from_secs_f64(bytes as f64 / self.rate);
            self.free_at = self.free_at.max(now) + duration;
        } else {
            self.sent(now, bytes, true, 0);
        }
    }

    /// Records a reply, which acknowledges the oldest frame in flight or resumes a suspended mode.
    /// Returns `false` if there was neither.
    pub fn on_ack(&mut self, at: Duration) -> bool {
        if let Some(mode) = self.suspended_mode.take() {
            // The connection has been interrupted.
            self.mode = mode;
            self.rate = self.rate.min(self.start.fixed_rate);
            self.forget_frames();
            self.losses = 0;
            return true;
        }
        let Some(frame) = self.in_flight.pop_front() else { return false };
        let last_acked = self.last_acked.replace([frame.sent, at]);
        self.losses = 0;
        if self.in_flight.is_empty() {
            self.clear_at = self.clear_at.min(at);
        }
        let elapsed = at.saturating_sub(frame.sent);
        if frame.alone && frame.bytes <= SMALL && self.needs_round_trip(at) {
            self.round_trip = Some(elapsed);
            self.round_trip_at = at;
        }
        let known = self.round_trip.filter(|least| *least <= elapsed);
        self.round_trip = self.round_trip.map(|least| least.min(elapsed));
        self.measure_rate(frame, at, last_acked, known);
        true
    }

    /// Updates the rate by the acknowledgement of `frame` at `at`. `last_acked` has the times of
    /// the frame acknowledged before. `known` is the known round trip; `None` if it is unknown or
    /// longer than that of `frame`.
    fn measure_rate(
        &mut self,
        frame: InFlight,
        at: Duration,
        last_acked: Option<[Duration; 2]>,
        known: Option<Duration>,
    ) {
        // The rate is the number of bytes divided by the time in which replies to them could
        // arrive. This time begins 0.9 to 1 round trips after the frame was sent, but not before
        // the previous acknowledgement. It ends with this acknowledgement.
        let idle_start =
            |round_trips: f64| frame.sent + known.unwrap_or_default().mul_f64(round_trips);
        let previous = last_acked.filter(|[_, acked_at]| *acked_at > idle_start(0.9));
        let start = |round_trips: f64| {
            let start = idle_start(round_trips);
            previous.map_or(start, |[_, acked_at]| start.max(acked_at))
        };
        let sample = match self.ack_sample {
            Some(last) if at <= last.at + ACKS_TOGETHER => {
                AckSample { at, bytes: last.bytes + frame.bytes, ..last }
            }
            _ => AckSample {
                earliest_start: start(0.9),
                latest_start: if known.is_some() { start(1.0) } else { at },
                sent_from: previous.map(|[sent, _]| sent),
                at,
                bytes: frame.bytes,
            },
        };
        self.ack_sample = Some(sample);
        // Two acknowledgements may arrive closer together than the frames were sent.
        let sending = sample.sent_from.map(|from| frame.sent.saturating_sub(from));
        let longest = at.saturating_sub(sample.earliest_start).max(sending.unwrap_or_default());
        let shortest = at.saturating_sub(sample.latest_start);
        let rate = |span: Duration| {
            sample.bytes as f64 / span.max(Duration::from_millis(10)).as_secs_f64()
        };
        // The known rate is kept if it is between both bounds; otherwise the nearer bound replaces
        // it.
        let rate = self.rate.clamp(rate(longest), rate(shortest.min(longest)));
        if sample.bytes >= SMALL || rate > self.rate {
            let is_full = 2 * sample.bytes >= self.budget() || shortest > 2 * FRAME_SPAN;
            if is_full || rate > self.rate {
                self.average_rate(rate);
            }
        }
    }

    /// Includes `rate`, just measured, in the average.
    fn average_rate(&mut self, rate: f64) {
        let average = (1.0 - NEW_WEIGHT) * self.rate + NEW_WEIGHT * rate;
        self.rate = average.max(MIN_RATE);
    }

    /// Records the number of bytes in the send queue; `None` if the kernel no longer reports it.
    pub fn on_queue_length(&mut self, now: Duration, bytes: Option<usize>) {
        let Some(bytes) = bytes else {
            self.stop_requests(PacingMode::FixedRate, now);
            return;
        };
        let (limit, round_trip) = (self.max_queue(), self.round_trip);
        let sample = self.send_queue.measured(now, bytes, limit, round_trip);
        if let Some((elapsed, bytes)) = sample.round_trip {
            if bytes <= SMALL && self.needs_round_trip(now) {
                self.round_trip = Some(elapsed);
                self.round_trip_at = now;
                self.doubtful_rate = self.rate / 2.0;
            }
            self.round_trip = self.round_trip.map(|least| least.min(elapsed));
        }
        if let Some(rate) = sample.rate
            && (sample.is_full || rate > self.rate)
        {
            self.average_rate(rate);
        }
    }

    /// Treats all frames in flight as lost if the oldest acknowledgement is overdue.
    pub fn expire(&mut self, now: Duration) {
        if self.lost_at().is_none_or(|at| at > now) {
            return;
        }
        self.forget_frames();
        self.rate = (self.rate / 2.0).max(MIN_RATE);
        self.losses += 1;
        if self.losses >= MAX_LOSSES {
            let fallback =
                if self.start.queue { PacingMode::SendQueue } else { PacingMode::FixedRate };
            self.stop_requests(fallback, now);
        }
    }

    /// Returns the longest time to wait for outstanding replies at the end of the program; `None` if
    /// there are none.
    pub fn awaits(&self) -> Option<Duration> {
        let is_waiting = !self.in_flight.is_empty() || self.suspended_mode.is_some();
        is_waiting.then(|| 2 * self.round_trip.unwrap_or_default() + 2 * FRAME_SPAN)
    }

    /// Returns the largest number of bytes of the next frame.
    fn budget(&self) -> usize {
        match self.mode {
            PacingMode::Unlimited => usize::MAX,
            _ => (self.rate * FRAME_SPAN.as_secs_f64()).clamp(BUDGET[0], BUDGET[2]) as usize,
        }
    }

    /// Returns `true` if the connection can take another frame with cells of the picture.
    fn has_room(&self, now: Duration, answers: bool) -> bool {
        let is_active = now < self.active_until;
        // The first frame that shows the effect of input does not wait for frames sent before the
        // input, the last of them at `last`.
        let is_first = |last: Option<Duration>| {
            is_active && answers && last.is_some_and(|at| at < self.active_since)
        };
        match self.mode {
            PacingMode::Unlimited => true,
            PacingMode::AckClocked(_) if self.free_at > now => false,
            PacingMode::AckClocked(_) => {
                if self.needs_round_trip(now) {
                    return self.in_flight.is_empty();
                }
                // While the user is active and the connection busy, the effect of an input waits
                // for at most the frame in transmission.
                let limit = match is_active && self.clear_at > now {
                    true => 1 + usize::from(answers),
                    false => self.target_in_flight(),
                };
                let pictures = self.in_flight.iter().filter(|frame| frame.picture).count();
                is_first(self.in_flight.back().map(|frame| frame.sent)) || pictures < limit
            }
            PacingMode::SendQueue if self.needs_round_trip(now) => self.send_queue.bytes == 0.0,
            PacingMode::SendQueue => {
                let extra = if is_first(self.last_frame) { self.budget() as f64 } else { 0.0 };
                // With a shorter queue, the effect of an input waits for fewer bytes.
                let spare = if is_active { self.budget() as f64 / 2.0 } else { 0.0 };
                self.send_queue.bytes < self.max_queue() + extra - spare
            }
            PacingMode::FixedRate => {
                let lead = if answers { FRAME_SPAN } else { Duration::ZERO };
                self.free_at <= now + lead
            }
        }
    }

    /// Returns the number of bytes in the send queue above which no frame is sent: the bytes that
    /// are transmitted in one round trip and [`FRAME_SPAN`].
    fn max_queue(&self) -> f64 {
        let time = self.round_trip.unwrap_or(DEFAULT_ROUND_TRIP) + FRAME_SPAN;
        (self.rate * time.as_secs_f64()).max(BUDGET[0])
    }

    /// Returns the number of frames in flight that keeps the connection busy.
    fn target_in_flight(&self) -> usize {
        let round_trips =
            self.round_trip.unwrap_or_default().as_secs_f64() / FRAME_SPAN.as_secs_f64();
        (1 + round_trips.round() as usize).clamp(2, MAX_IN_FLIGHT)
    }

    /// Returns `true` if the next frame should measure the round trip. It should if the rate is
    /// below `doubtful_rate`, or if the last measurement is missing or old and the user inactive.
    fn needs_round_trip(&self, now: Duration) -> bool {
        let is_known = self.round_trip.is_some() && now < self.round_trip_at + ROUND_TRIP_INTERVAL;
        let is_measurable = matches!(self.mode, PacingMode::AckClocked(_) | PacingMode::SendQueue);
        let is_doubtful = self.mode == PacingMode::SendQueue && self.rate < self.doubtful_rate;
        is_measurable && (is_doubtful || !is_known && now >= self.active_until)
    }

    fn lost_at(&self) -> Option<Duration> {
        self.in_flight.front().map(|frame| frame.sent + LOST_AFTER)
    }

    fn forget_frames(&mut self) {
        self.in_flight.clear();
        self.last_acked = None;
    }

    /// Changes to `mode`, which requests no acknowledgements. A mode that requests them is
    /// suspended.
    fn stop_requests(&mut self, mode: PacingMode, now: Duration) {
        if matches!(self.mode, PacingMode::AckClocked(_)) {
            self.suspended_mode = Some(self.mode);
        }
        self.mode = mode;
        self.free_at = now;
        self.ack_sample = None;
        self.send_queue = SendQueueEstimate::default();
        if mode == PacingMode::FixedRate {
            self.rate = self.start.fixed_rate;
        }
    }
}
