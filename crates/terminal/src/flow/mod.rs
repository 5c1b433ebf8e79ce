//! Flow control: measures the rate of the connection and limits the size of the next frame.
//!
//! A slow SSH connection accepts a megabyte at once, but the terminal shows it only many seconds
//! later. After each frame the program therefore requests the terminal's status. The reply
//! acknowledges the frame, and its time gives the round trip and the rate. A frame holds at most
//! what the connection carries in 100 ms, and only a few frames are in flight. Without replies from
//! the terminal, the length of the kernel's TCP send queue is measured instead. If the kernel does
//! not report it, bytes are sent at a fixed rate.
//!
//! The module does no I/O and reads no clock: times and byte counts are arguments.

mod ack_clock;
mod initial;
mod send_queue_estimate;
mod tcp_send_queue;
#[cfg(test)]
mod tests;

use crate::Multiplexer;
use crate::capability_query::status_request;
use ack_clock::AckClock;
pub use initial::InitialLink;
use send_queue_estimate::SendQueueEstimate;
use std::time::Duration;
pub use tcp_send_queue::TcpSendQueue;

/// Shortest interval between frames.
pub const FRAME_INTERVAL: Duration = Duration::from_millis(33);
/// Shortest interval between frames with text only, over SSH and without user input.
pub const TEXT_INTERVAL: Duration = Duration::from_millis(500);
/// Time in which the connection should transmit a frame.
const FRAME_SPAN: Duration = Duration::from_millis(100);
/// Smallest and largest byte budget of a frame.
const BUDGET: [f64; 2] = [2e3, 200e3];
/// Assumed rate in bytes per second before the first measurement.
const INITIAL_RATE: f64 = 80e3;
/// Assumed rate in bytes per second before the first measurement of the send queue. It grows until
/// the queue is full.
const INITIAL_QUEUE_RATE: f64 = 16e3;
/// Rate from which the rate of the send queue does not grow: that of the largest frames.
const MAX_GROWN_RATE: f64 = 6e6;
/// Smallest assumed rate in bytes per second, at which the smallest frame takes one second. Without
/// it, the next frame after a pause of the connection would not be due for minutes.
const MIN_RATE: f64 = 2e3;
/// Largest number of frames in flight, that is, not acknowledged.
const MAX_IN_FLIGHT: usize = 6;
/// Largest number of bytes in flight in frames that contain only text.
const MAX_TEXT: usize = 1500;
/// Number of bytes below which the time of a frame is mostly latency: its acknowledgement may raise
/// the measured rate, but not lower it.
const SMALL: usize = 1000;
/// Time after which a frame without acknowledgement counts as lost.
const LOST_AFTER: Duration = Duration::from_secs(3);
/// Number of consecutive losses after which acknowledgements are no longer requested.
const MAX_LOSSES: u32 = 3;
/// Interval at which the shortest round trip is measured again.
const ROUND_TRIP_INTERVAL: Duration = Duration::from_secs(30);
/// Weight of a new measurement in the moving average of the rate.
const NEW_WEIGHT: f64 = 0.3;
/// Time after input during which the user counts as active.
const ACTIVE_TIME: Duration = Duration::from_millis(500);
/// Longest time for which the effect of input waits because a relay may hold bytes.
const LONGEST_ANSWER: Duration = Duration::from_millis(300);
/// Time after the user was active from which a relay may be filled to measure its rate.
const IDLE_AFTER: Duration = Duration::from_secs(2);
/// Interval at which the send queue is measured.
const QUEUE_INTERVAL: Duration = Duration::from_millis(20);
/// Interval at which the send queue is measured once no byte has left it for [`LOST_AFTER`].
const STALLED_INTERVAL: Duration = Duration::from_millis(500);
/// Assumed round trip before the first measurement.
const DEFAULT_ROUND_TRIP: Duration = Duration::from_millis(100);
/// Time after which the connection counts as silent, if bytes wait, none is transmitted, and no
/// input arrives.
const SILENT_AFTER: Duration = Duration::from_secs(30);
/// Assumed rate of a connection that cannot be measured, in bytes per second.
pub const DEFAULT_RATE: f64 = 30e3;
/// Share of the rate that refinement, the sending of invisible differences, may use.
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

/// State of the method that limits the rate of frames.
#[derive(Debug, Default)]
enum Pacing {
    #[default]
    Unlimited,
    AckClocked(AckClock),
    SendQueue(SendQueueEstimate),
    FixedRate,
}

impl Pacing {
    fn start(mode: PacingMode) -> Self {
        match mode {
            PacingMode::Unlimited => Self::Unlimited,
            PacingMode::AckClocked(multiplexer) => Self::AckClocked(AckClock::new(multiplexer)),
            PacingMode::SendQueue => Self::SendQueue(SendQueueEstimate::new(INITIAL_RATE / 2.0)),
            PacingMode::FixedRate => Self::FixedRate,
        }
    }
}

/// Flow control of the connection.
#[derive(Debug, Default)]
pub struct FlowControl {
    pacing: Pacing,
    /// Acknowledgements that are suspended because the terminal did not reply; a reply resumes
    /// them.
    suspended: Option<AckClock>,
    start: InitialLink,
    /// Bytes per second, measured or fixed.
    rate: f64,
    /// Shortest round trip since the latest measurement, which ended at the time `round_trip_at`.
    round_trip: Option<Duration>,
    round_trip_at: Duration,
    /// Time at which the last period of user activity began.
    active_since: Duration,
    /// Time at which the last period of user activity ends.
    active_until: Duration,
    last_frame: Option<Duration>,
    /// Estimated time at which the bytes without acknowledgement request will have been
    /// transmitted.
    free_at: Duration,
    /// Earliest time of the next refinement.
    pub refine_at: Duration,
}

impl FlowControl {
    pub fn new(start: InitialLink) -> Self {
        let rate = match start.mode {
            PacingMode::Unlimited | PacingMode::AckClocked(_) => INITIAL_RATE,
            PacingMode::SendQueue => INITIAL_QUEUE_RATE,
            PacingMode::FixedRate => start.fixed_rate,
        };
        Self {
            pacing: Pacing::start(start.mode),
            rate,
            round_trip: start.round_trip,
            start,
            ..Self::default()
        }
    }

    /// Returns the bytes per second, measured or fixed; `None` for a local terminal.
    pub fn rate(&self) -> Option<f64> {
        (!matches!(self.pacing, Pacing::Unlimited)).then(|| self.proven_rate())
    }

    /// Returns the OKLab distance above which a difference is visible, larger for slower
    /// connections.
    pub fn threshold(&self) -> f32 {
        match self.pacing {
            Pacing::Unlimited => 0.0,
            // The limits are 10 Mbit/s and 300 kbit/s.
            _ if self.rate > 1.25e6 => 0.01,
            _ if self.rate < 37.5e3 => 0.04,
            _ => 0.02,
        }
    }

    /// Records user input. For `ACTIVE_TIME` from then on, the round trip is measured only if the
    /// rate is doubtful.
    pub fn record_input(&mut self, now: Duration) {
        if now >= self.active_until {
            self.active_since = now;
        }
        self.active_until = now + ACTIVE_TIME;
    }

    /// Returns the acknowledgement request to send after a frame, if there is one.
    pub fn ack_request(&self) -> Option<&'static str> {
        let Pacing::AckClocked(clock) = &self.pacing else { return None };
        Some(status_request(clock.multiplexer))
    }

    /// Returns `true` if the caller should now measure the send queue for
    /// [`FlowControl::record_queue_length`].
    pub fn wants_queue_length(&self, now: Duration) -> bool {
        self.measures_at(now).is_some_and(|at| at <= now)
    }

    /// Returns the time of the next measurement of the send queue. Returns `None` if the queue is
    /// empty, or frames are not limited by it.
    pub fn measures_at(&self, now: Duration) -> Option<Duration> {
        let Pacing::SendQueue(queue) = &self.pacing else { return None };
        let is_stalled = queue.stalled_since().is_some_and(|at| at + LOST_AFTER <= now);
        queue.next_at(if is_stalled { STALLED_INTERVAL } else { QUEUE_INTERVAL })
    }

    /// Returns the time from which the connection is silent, unless bytes are transmitted or input
    /// arrives before; `None` if no bytes wait. `blocked_since` is the start of a write that has
    /// not returned.
    pub fn silent_at(&self, blocked_since: Option<Duration>) -> Option<Duration> {
        let stalled_since = match &self.pacing {
            Pacing::SendQueue(queue) => queue.stalled_since(),
            Pacing::Unlimited | Pacing::AckClocked(_) | Pacing::FixedRate => None,
        };
        let since = stalled_since.into_iter().chain(blocked_since).min()?;
        Some(since.max(self.active_until) + SILENT_AFTER)
    }

    /// Returns the limits of a frame that may be sent now; `None` if none may be sent. `answers` is
    /// `true` if the frame shows the effect of user input; such a frame need not keep the usual
    /// interval.
    pub fn allowance(&self, now: Duration, answers: bool) -> Option<FrameBudget> {
        // The round trip is measured by a small frame.
        let bytes = if self.needs_round_trip(now) { SMALL } else { self.budget() };
        let due = |interval| self.last_frame.is_none_or(|last| answers || last + interval <= now);
        if due(FRAME_INTERVAL) && self.has_room(now, answers) {
            let refinement = if self.refine_at <= now { bytes / 2 } else { 0 };
            return Some(FrameBudget { bytes, picture: true, refinement });
        }
        let text_bytes = match &self.pacing {
            Pacing::AckClocked(clock) => {
                let texts = clock.in_flight.iter().filter(|frame| !frame.picture);
                MAX_TEXT.saturating_sub(texts.map(|frame| frame.bytes).sum())
            }
            Pacing::FixedRate if self.free_at > now + 2 * FRAME_SPAN => 0,
            Pacing::Unlimited | Pacing::SendQueue(_) | Pacing::FixedRate => MAX_TEXT,
        };
        let due = due(TEXT_INTERVAL) && text_bytes >= MAX_TEXT / 4;
        due.then_some(FrameBudget { bytes: text_bytes, picture: false, refinement: 0 })
    }

    /// Returns the next time at which [`FlowControl::allowance`] may permit a frame if neither a
    /// reply nor input arrives before. `text` is `true` if text may remain to be sent.
    pub fn wakes_at(&self, now: Duration, text: bool) -> Duration {
        let after = |interval| self.last_frame.map_or(now, |last| last + interval);
        let frame = after(FRAME_INTERVAL);
        let room = match &self.pacing {
            _ if self.has_room(now, false) => frame,
            Pacing::Unlimited => frame,
            Pacing::AckClocked(_) if self.free_at > now => frame.max(self.free_at),
            Pacing::AckClocked(clock) if now < self.active_until.min(clock.clear_at) => {
                frame.max(clock.clear_at)
            }
            // By this time the oldest frame is acknowledged or lost.
            Pacing::AckClocked(clock) => clock.lost_at().unwrap_or(frame),
            Pacing::SendQueue(_) => {
                let free_at = self.free_at.min(after(LONGEST_ANSWER));
                frame.max(self.measures_at(now).unwrap_or(now)).max(free_at)
            }
            Pacing::FixedRate => frame.max(self.free_at),
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
        let (duration, is_large) = (seconds(bytes, self.rate), 2 * bytes >= self.budget());
        let is_idle = now >= self.active_until + IDLE_AFTER;
        let round_trip = self.round_trip.unwrap_or(DEFAULT_ROUND_TRIP).max(FRAME_SPAN);
        match &mut self.pacing {
            Pacing::Unlimited => {}
            Pacing::AckClocked(clock) => clock.sent(now, bytes, picture, duration),
            Pacing::SendQueue(queue) => {
                if !queue.sent(now, bytes, self.free_at) {
                    self.rate = self.rate.min(queue.settled_rate);
                } else if is_large && self.rate < MAX_GROWN_RATE {
                    self.rate *= queue.growth(now, self.rate, round_trip, is_idle);
                }
                self.free_at = queue.free_at(self.rate);
            }
            Pacing::FixedRate => self.free_at = self.free_at.max(now) + duration,
        }
    }

    /// Records sent bytes that end inside an escape sequence, where no acknowledgement can be
    /// requested. The time of their transmission is estimated.
    pub fn sent_unasked(&mut self, now: Duration, bytes: usize) {
        if let Pacing::AckClocked(_) = self.pacing {
            self.last_frame = Some(now);
            let duration = Duration::from_secs_f64(bytes as f64 / self.rate);
            self.free_at = self.free_at.max(now) + duration;
        } else {
            self.sent(now, bytes, true, 0);
        }
    }

    /// Records a status reply, which acknowledges the oldest frame in flight or resumes suspended
    /// acknowledgements. Returns `false` if there was nothing to acknowledge or resume.
    pub fn on_ack(&mut self, at: Duration) -> bool {
        if let Some(clock) = self.suspended.take() {
            self.pacing = Pacing::AckClocked(clock.resumed());
            self.rate = self.rate.min(self.start.fixed_rate);
            return true;
        }
        let (needs_round_trip, budget) = (self.needs_round_trip(at), self.budget());
        let Pacing::AckClocked(clock) = &mut self.pacing else { return false };
        let Some(frame) = clock.acknowledged(at) else { return false };
        let elapsed = at.saturating_sub(frame.sent);
        if frame.alone && frame.bytes <= SMALL && needs_round_trip {
            self.round_trip = Some(elapsed);
            self.round_trip_at = at;
        }
        let known = self.round_trip.filter(|least| *least <= elapsed);
        self.round_trip = self.round_trip.map(|least| least.min(elapsed));
        if let Some(rate) = clock.measure(frame, at, known, self.rate, budget) {
            let average = (1.0 - NEW_WEIGHT) * self.rate + NEW_WEIGHT * rate;
            self.rate = average.max(MIN_RATE);
        }
        true
    }

    /// Records the number of bytes in the send queue; `None` if the kernel no longer reports it.
    pub fn record_queue_length(&mut self, now: Duration, bytes: Option<usize>) {
        let Some(bytes) = bytes else { return self.fall_back(PacingMode::FixedRate, now) };
        let (limit, needs_round_trip) = (self.max_queue(), self.needs_round_trip(now));
        let Pacing::SendQueue(queue) = &mut self.pacing else { return };
        let sample = queue.measured(now, bytes, limit, self.round_trip);
        if let Some(alone) = sample.alone {
            if alone.bytes <= SMALL && needs_round_trip {
                self.round_trip = Some(alone.round_trip);
                self.round_trip_at = now;
                queue.doubtful_rate = self.rate / 2.0;
            }
            self.round_trip = self.round_trip.map(|least| least.min(alone.round_trip));
        }
        if sample.is_filled {
            self.rate = queue.settle(now, self.rate, sample);
            self.free_at = queue.free_at(self.rate);
        }
    }

    /// Treats all frames in flight as lost if the oldest acknowledgement is overdue.
    pub fn expire(&mut self, now: Duration) {
        let Pacing::AckClocked(clock) = &mut self.pacing else { return };
        if clock.lost_at().is_none_or(|at| at > now) {
            return;
        }
        clock.forget_frames();
        clock.losses += 1;
        let is_interrupted = clock.losses >= MAX_LOSSES;
        self.rate = (self.rate / 2.0).max(MIN_RATE);
        if is_interrupted {
            let has_queue = self.start.queue;
            let mode = if has_queue { PacingMode::SendQueue } else { PacingMode::FixedRate };
            self.fall_back(mode, now);
        }
    }

    /// Returns `true` if the terminal has not replied to all requests.
    pub fn awaits_replies(&self) -> bool {
        match &self.pacing {
            Pacing::AckClocked(clock) => !clock.in_flight.is_empty(),
            Pacing::Unlimited | Pacing::SendQueue(_) | Pacing::FixedRate => {
                self.suspended.is_some()
            }
        }
    }

    /// Returns the largest number of bytes of the next frame.
    fn budget(&self) -> usize {
        match self.pacing {
            Pacing::Unlimited => usize::MAX,
            _ => (self.rate * FRAME_SPAN.as_secs_f64()).clamp(BUDGET[0], BUDGET[1]) as usize,
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
        match &self.pacing {
            Pacing::Unlimited => true,
            Pacing::AckClocked(_) if self.free_at > now => false,
            Pacing::AckClocked(clock) if self.needs_round_trip(now) => clock.in_flight.is_empty(),
            Pacing::AckClocked(clock) => {
                // While the user is active and the connection busy, the effect of an input waits
                // for at most the frame in transmission.
                let limit = match is_active && clock.clear_at > now {
                    true => 1 + usize::from(answers),
                    false => self.target_in_flight(),
                };
                let pictures = clock.in_flight.iter().filter(|frame| frame.picture).count();
                is_first(clock.in_flight.back().map(|frame| frame.sent)) || pictures < limit
            }
            Pacing::SendQueue(queue) if self.needs_round_trip(now) => queue.bytes == 0.0,
            Pacing::SendQueue(queue) => {
                // The first effect also does not wait for bytes that a relay may hold.
                let extra = if is_first(self.last_frame) { self.budget() as f64 } else { 0.0 };
                // With a shorter queue, the effect of user input waits for fewer bytes.
                let spare = if is_active { self.budget() as f64 / 2.0 } else { 0.0 };
                let lead = if answers { FRAME_SPAN } else { Duration::ZERO };
                // Later effects wait for them, but not so long that a wrong estimate delays them much.
                let is_rare = answers
                    && queue.bytes == 0.0
                    && self.last_frame.is_none_or(|at| at + LONGEST_ANSWER <= now);
                let is_free = extra > 0.0 || is_rare || self.free_at <= now + lead;
                is_free && queue.bytes < self.max_queue() + extra - spare
            }
            Pacing::FixedRate => {
                let lead = if answers { FRAME_SPAN } else { Duration::ZERO };
                self.free_at <= now + lead
            }
        }
    }

    /// Returns the number of bytes in the send queue above which no frame is sent: those that the
    /// connection transmits in one round trip plus [`FRAME_SPAN`], and at least two of the smallest
    /// frames. A single one would fill the queue until it is acknowledged.
    fn max_queue(&self) -> f64 {
        let time = self.round_trip.unwrap_or(DEFAULT_ROUND_TRIP) + FRAME_SPAN;
        (self.proven_rate() * time.as_secs_f64()).max(2.0 * BUDGET[0])
    }

    /// Returns the rate without the growth of the send queue's rate since its last measurement.
    fn proven_rate(&self) -> f64 {
        match &self.pacing {
            Pacing::SendQueue(queue) => self.rate.min(queue.settled_rate),
            Pacing::Unlimited | Pacing::AckClocked(_) | Pacing::FixedRate => self.rate,
        }
    }

    /// Returns the number of frames in flight that keeps the connection busy.
    fn target_in_flight(&self) -> usize {
        let round_trips =
            self.round_trip.unwrap_or_default().as_secs_f64() / FRAME_SPAN.as_secs_f64();
        (1 + round_trips.round() as usize).clamp(2, MAX_IN_FLIGHT)
    }

    /// Returns `true` if the next frame should measure the round trip: if the last measurement is
    /// missing or old and the user is inactive, or if the rate of the send queue is doubtful.
    fn needs_round_trip(&self, now: Duration) -> bool {
        let is_known = self.round_trip.is_some() && now < self.round_trip_at + ROUND_TRIP_INTERVAL;
        let is_due = !is_known && now >= self.active_until;
        match &self.pacing {
            Pacing::Unlimited | Pacing::FixedRate => false,
            Pacing::AckClocked(_) => is_due,
            Pacing::SendQueue(queue) => is_due || self.rate < queue.doubtful_rate,
        }
    }

    /// Changes to `mode`, which requests no acknowledgements. A late acknowledgement changes back.
    fn fall_back(&mut self, mode: PacingMode, now: Duration) {
        let before = std::mem::replace(&mut self.pacing, Pacing::start(mode));
        if let Pacing::AckClocked(clock) = before {
            self.suspended = Some(clock);
        }
        self.free_at = now;
        if mode == PacingMode::FixedRate {
            self.rate = self.start.fixed_rate;
        }
    }
}
