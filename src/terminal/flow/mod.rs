//! How much the line to the terminal carries, and so what may be sent now.
//!
//! A terminal that is far away takes everything at once, into buffers of a megabyte, and shows it many
//! seconds later. So after each frame the terminal is asked something: its answer tells that it has
//! come so far, how long that took and how fast the line is. A frame is at most what the line carries
//! in a tenth of a second, and only one or two are on their way. Where nobody answers, or somebody
//! does who is not the terminal, the kernel tells how much it has not got rid of yet; where that
//! cannot be known either, bytes go out at a fixed rate.
//!
//! Nothing here reads a clock or writes a byte: times and counts are arguments.

mod in_flight;
mod initial;
mod send_queue_estimate;
mod tcp_send_queue;
#[cfg(test)]
mod tests;

use crate::terminal::Multiplexer;
use in_flight::{FramesInFlight, InFlight};
pub use initial::InitialLink;
use send_queue_estimate::SendQueueEstimate;
use std::time::Duration;
pub use tcp_send_queue::TcpSendQueue;

/// Frames come no faster than this.
pub const FRAME_INTERVAL: Duration = Duration::from_millis(33);
/// Text that nobody waits for comes no faster than this over a line.
pub const TEXT_INTERVAL: Duration = Duration::from_millis(500);
/// A frame is at most what the line carries in this time.
const FRAME_SPAN: Duration = Duration::from_millis(100);
/// Fewest, first and most bytes of a frame.
const BUDGET: [f64; 3] = [2e3, 8e3, 200e3];
/// Most frames on their way.
const MOST_FLIGHTS: usize = 6;
/// Bytes of text that may be sent beside frames on their way.
const BESIDE: usize = 1500;
/// Bytes that are measured too roughly to say that a line has become slower.
const SMALL: usize = 1000;
/// How long an answer may take; so many questions without one and no more is asked.
const LOST_AFTER: Duration = Duration::from_secs(3);
const MOST_LOSSES: u32 = 3;
/// The shortest time an answer is known to take is learned anew so often.
const LEARN_INTERVAL: Duration = Duration::from_secs(30);
/// The share of a new measurement in the rate.
const NEWEST: f64 = 0.3;
/// How long somebody acts after the last key.
const ACTING: Duration = Duration::from_millis(500);
/// The least that the kernel may hold back before a frame waits.
const LEAST_QUEUE: f64 = 16e3;
/// How often the kernel is asked.
const QUEUE_INTERVAL: Duration = Duration::from_millis(20);
/// What a line carries of which nothing is known, bytes a second.
pub const DEFAULT_RATE: f64 = 30e3;
/// The share of the line that goes to differences which nobody sees.
const FLUSH_SHARE: f64 = 0.25;
/// How it is known what has arrived.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PacingMode {
    /// Whoever reads is here: what was written has arrived.
    Unlimited,
    /// The terminal answers; through a multiplexer, if there is one.
    AckClocked(Option<Multiplexer>),
    /// The kernel tells what it has not got rid of yet.
    SendQueue,
    /// It is not known.
    FixedRate,
}

/// What a frame may contain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameBudget {
    /// Bytes of everything; `usize::MAX`: as many as there are.
    pub bytes: usize,
    /// Whether parts of the picture may be among them.
    pub picture: bool,
    /// Of them, bytes of differences that cannot be seen.
    pub refinement: usize,
}

/// What the user is told about the line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkStatus {
    /// Bytes a second: measured, or fixed.
    pub rate: f64,
    /// How it is known what has arrived.
    pub mode: PacingMode,
}

/// The line to the terminal.
#[derive(Debug)]
pub struct FlowControl {
    mode: PacingMode,
    /// What to go back to when answers come again.
    silent: Option<PacingMode>,
    start: InitialLink,
    /// Bytes a second.
    rate: f64,
    round_trip: Option<Duration>,
    learned: Duration,
    flights: FramesInFlight,
    losses: u32,
    /// When the user began to act.
    acting_since: Duration,
    acting_until: Duration,
    last_frame: Option<Duration>,
    /// When what was sent at a known rate is through.
    free_at: Duration,
    /// When the line has done with what was sent, by its rate: a frame then finds it empty.
    clear_at: Duration,
    /// When the next slice of invisible differences may go.
    flush_at: Duration,
    held_back: SendQueueEstimate,
}

impl FlowControl {
    /// A line of which `start` is known.
    pub fn new(start: InitialLink) -> Self {
        let span = FRAME_SPAN.as_secs_f64();
        Self {
            mode: start.mode,
            silent: None,
            rate: if start.mode == PacingMode::FixedRate {
                start.fixed_rate
            } else {
                BUDGET[1] / span
            },
            round_trip: start.round_trip,
            learned: Duration::ZERO,
            start,
            flights: FramesInFlight::default(),
            losses: 0,
            acting_since: Duration::ZERO,
            acting_until: Duration::ZERO,
            last_frame: None,
            free_at: Duration::ZERO,
            clear_at: Duration::ZERO,
            flush_at: Duration::ZERO,
            held_back: SendQueueEstimate::default(),
        }
    }

    /// For the user; nothing about a terminal that is here.
    pub fn reading(&self) -> Option<LinkStatus> {
        (self.mode != PacingMode::Unlimited)
            .then_some(LinkStatus { rate: self.rate, mode: self.mode })
    }

    /// The OKLab distance from which on a difference is worth sending.
    pub fn threshold(&self) -> f32 {
        match self.mode {
            PacingMode::Unlimited => 0.0,
            // 10 Mbit/s and 300 kbit/s.
            _ if self.rate > 1.25e6 => 0.01,
            _ if self.rate < 37.5e3 => 0.04,
            _ => 0.02,
        }
    }

    /// The user has done something.
    pub fn act(&mut self, now: Duration) {
        if now >= self.acting_until {
            self.acting_since = now;
        }
        self.acting_until = now + ACTING;
    }

    /// How the question after a frame is asked; `None`: it is not.
    pub fn ack_request(&self) -> Option<Option<Multiplexer>> {
        match self.mode {
            PacingMode::AckClocked(through) => Some(through),
            _ => None,
        }
    }

    /// Whether the kernel is to be asked, with [`FlowControl::held_back`].
    pub fn asks_kernel(&self, now: Duration) -> bool {
        let asked = self.held_back.asked;
        self.mode == PacingMode::SendQueue
            && asked.is_none_or(|asked| asked + QUEUE_INTERVAL <= now)
    }

    /// What may be sent now; `answers`: it shows what the user has just done. `None`: nothing.
    pub fn allowance(&self, now: Duration, answers: bool) -> Option<FrameBudget> {
        // A small frame, because its answer is to tell how long the way is.
        let bytes = if self.is_learning(now) { SMALL } else { self.budget() };
        let due = |interval| self.last_frame.is_none_or(|last| answers || last + interval <= now);
        if due(FRAME_INTERVAL) && self.has_room(now, answers) {
            let refinement = if self.flush_at <= now { bytes / 2 } else { 0 };
            return Some(FrameBudget { bytes, picture: true, refinement });
        }
        let beside = BESIDE.saturating_sub(self.flights.text_bytes());
        let may_beside = self.mode != PacingMode::FixedRate || self.free_at <= now + 2 * FRAME_SPAN;
        let due = due(TEXT_INTERVAL) && may_beside && beside >= BESIDE / 4;
        due.then_some(FrameBudget { bytes: beside, picture: false, refinement: 0 })
    }

    /// When to ask for an [`FlowControl::allowance`] again if it is not given now, by time alone. `text`:
    /// there may be some to send.
    pub fn wakes_at(&self, now: Duration, text: bool) -> Duration {
        let after = |interval| self.last_frame.map_or(now, |last| last + interval);
        let frame = after(FRAME_INTERVAL);
        let room = match self.mode {
            PacingMode::Unlimited => frame,
            PacingMode::AckClocked(_) if self.has_room(now, false) => frame,
            PacingMode::AckClocked(_) if self.free_at > now => frame.max(self.free_at),
            PacingMode::AckClocked(_) if now < self.acting_until.min(self.clear_at) => {
                frame.max(self.clear_at)
            }
            // Before that an answer comes, or is lost.
            PacingMode::AckClocked(_) => self.lost_at().unwrap_or(frame),
            PacingMode::SendQueue => {
                let asked = self.held_back.asked.map_or(now, |asked| asked + QUEUE_INTERVAL);
                if self.has_room(now, false) { frame } else { frame.max(asked) }
            }
            PacingMode::FixedRate => frame.max(self.free_at),
        };
        let at = if text { room.min(after(TEXT_INTERVAL)) } else { room };
        if at > now { at } else { now + QUEUE_INTERVAL }
    }

    /// When a slice of differences that nobody sees may go.
    pub fn flush_at(&self) -> Duration {
        self.flush_at
    }

    /// A frame was sent, `picture`: with parts of the picture, of which `flushed` were bytes of what
    /// cannot be seen.
    pub fn sent(&mut self, now: Duration, bytes: usize, picture: bool, flushed: usize) {
        let seconds = |bytes: usize, rate: f64| Duration::from_secs_f64(bytes as f64 / rate);
        self.last_frame = Some(now);
        if flushed > 0 {
            self.flush_at = now + seconds(flushed, FLUSH_SHARE * self.rate);
        }
        match self.mode {
            PacingMode::Unlimited => {}
            PacingMode::AckClocked(_) => {
                self.clear_at = self.clear_at.max(now) + seconds(bytes, self.rate);
                self.flights.add(InFlight { sent: now, bytes, picture });
            }
            PacingMode::SendQueue => {
                self.held_back.sent += bytes as f64;
                self.held_back.bytes += bytes as f64;
            }
            PacingMode::FixedRate => {
                self.free_at = self.free_at.max(now) + seconds(bytes, self.rate)
            }
        }
    }

    /// Bytes were sent that end in the midst of a sequence, where nothing can be asked: the line is
    /// taken to carry what it has carried so far.
    pub fn sent_unasked(&mut self, now: Duration, bytes: usize) {
        if let PacingMode::AckClocked(_) = self.mode {
            self.last_frame = Some(now);
            let took = Duration::from_secs_f64(bytes as f64 / self.rate);
            self.free_at = self.free_at.max(now) + took;
        } else {
            self.sent(now, bytes, true, 0);
        }
    }

    /// The terminal has answered. Whether something may have become possible by that.
    pub fn on_ack(&mut self, at: Duration) -> bool {
        if let Some(mode) = self.silent.take() {
            // After a tunnel: the answers have come after all.
            self.mode = mode;
            self.rate = self.rate.min(self.start.fixed_rate);
            self.flights = FramesInFlight::default();
            self.losses = 0;
            return true;
        }
        let Some((flight, arrived)) = self.flights.on_ack(at) else { return false };
        self.losses = 0;
        if self.flights.is_empty() {
            self.clear_at = self.clear_at.min(at);
        }
        let took = at.saturating_sub(flight.sent);
        if flight.alone && flight.bytes <= SMALL && self.is_learning(at) {
            self.round_trip = Some(took);
            self.learned = at;
        }
        self.round_trip = self.round_trip.map(|least| least.min(took));
        // The line begins with a frame when it is there, and has done with the one before.
        let there = flight.sent + self.round_trip.unwrap_or_default().mul_f64(0.9);
        let begun = arrived.map_or(there, |before| there.max(before));
        let span = at.saturating_sub(begun).max(Duration::from_millis(10));
        let rate = flight.bytes as f64 / span.as_secs_f64();
        // A small frame says little about a fast line, except that it is not slow.
        if flight.bytes >= SMALL || rate > self.rate {
            let full = 2 * flight.bytes >= self.budget() || span > 2 * FRAME_SPAN;
            if full || rate > self.rate {
                self.rate = (1.0 - NEWEST) * self.rate + NEWEST * rate;
            }
        }
        true
    }

    /// The kernel has got rid of all but so many bytes; `None`: it does not know (any more).
    pub fn held_back(&mut self, now: Duration, bytes: Option<usize>) {
        let Some(bytes) = bytes else {
            self.go_without_answers(PacingMode::FixedRate, now);
            return;
        };
        let held = &mut self.held_back;
        let gone = held.sent - bytes as f64;
        let before = held.asked.replace(now).map(|asked| (asked, held.drained));
        (held.bytes, held.drained) = (bytes as f64, gone);
        let (since, at_first) = match (before, held.busy_since) {
            // The line has nothing to do: it is at least as fast as what it has taken.
            (Some(before), _) if bytes == 0 => before,
            (_, Some(busy)) => busy,
            _ => {
                held.busy_since = Some((now, gone));
                return;
            }
        };
        let span = now.saturating_sub(since);
        let rate = (gone - at_first) / span.as_secs_f64().max(1e-3);
        if bytes == 0 {
            held.busy_since = None;
            if rate <= self.rate {
                return;
            }
        } else if span < FRAME_SPAN {
            return;
        } else {
            held.busy_since = Some((now, gone));
        }
        self.rate = (1.0 - NEWEST) * self.rate + NEWEST * rate.max(BUDGET[0]);
    }

    /// Time has passed: answers that have not come by now are not waited for.
    pub fn expire(&mut self, now: Duration) {
        if self.lost_at().is_none_or(|at| at > now) {
            return;
        }
        self.flights = FramesInFlight::default();
        self.rate = (self.rate / 2.0).max(BUDGET[0] / FRAME_SPAN.as_secs_f64());
        self.losses += 1;
        if self.losses >= MOST_LOSSES {
            let otherwise =
                if self.start.queue { PacingMode::SendQueue } else { PacingMode::FixedRate };
            self.go_without_answers(otherwise, now);
        }
    }

    /// How long to wait for answers that are still to come, at the end; nothing if there are none.
    pub fn awaits(&self) -> Option<Duration> {
        let waiting = !self.flights.is_empty() || self.silent.is_some();
        waiting.then(|| 2 * self.round_trip.unwrap_or_default() + 2 * FRAME_SPAN)
    }

    /// Whether questions are still to be answered.
    pub fn is_waiting(&self) -> bool {
        !self.flights.is_empty()
    }

    /// Bytes of a frame.
    fn budget(&self) -> usize {
        match self.mode {
            PacingMode::Unlimited => usize::MAX,
            _ => (self.rate * FRAME_SPAN.as_secs_f64()).clamp(BUDGET[0], BUDGET[2]) as usize,
        }
    }

    fn has_room(&self, now: Duration, answers: bool) -> bool {
        match self.mode {
            PacingMode::Unlimited => true,
            PacingMode::AckClocked(_) if self.free_at > now => false,
            PacingMode::AckClocked(_) => {
                if self.is_learning(now) {
                    return self.flights.is_empty();
                }
                let acting = now < self.acting_until;
                // Who acts waits for no more than the frame that the line is at.
                let most = match acting && self.clear_at > now {
                    true => 1 + usize::from(answers),
                    false => self.flights_at_once(),
                };
                // The first answer does not wait for what was sent when nobody did anything.
                let newest = self.flights.newest();
                let first = acting && answers && newest.is_some_and(|at| at < self.acting_since);
                first || self.flights.pictures() < most
            }
            PacingMode::SendQueue => {
                let most = LEAST_QUEUE.max(self.rate * FRAME_SPAN.as_secs_f64());
                self.held_back.bytes < most
            }
            PacingMode::FixedRate => {
                let early = if answers { FRAME_SPAN } else { Duration::ZERO };
                self.free_at <= now + early
            }
        }
    }

    /// Frames on their way that keep the line busy: one that it carries, and what the way holds.
    fn flights_at_once(&self) -> usize {
        let way = self.round_trip.unwrap_or_default().as_secs_f64() / FRAME_SPAN.as_secs_f64();
        (1 + way.round() as usize).clamp(2, MOST_FLIGHTS)
    }

    /// Whether the next frame is to tell how long the way is: not while somebody acts.
    fn is_learning(&self, now: Duration) -> bool {
        let known = self.round_trip.is_some() && now < self.learned + LEARN_INTERVAL;
        matches!(self.mode, PacingMode::AckClocked(_)) && !known && now >= self.acting_until
    }

    fn lost_at(&self) -> Option<Duration> {
        self.flights.oldest().map(|sent| sent + LOST_AFTER)
    }

    fn go_without_answers(&mut self, mode: PacingMode, now: Duration) {
        if matches!(self.mode, PacingMode::AckClocked(_)) {
            self.silent = Some(self.mode);
        }
        self.mode = mode;
        self.free_at = now;
        self.held_back = SendQueueEstimate::default();
        if mode == PacingMode::FixedRate {
            self.rate = self.start.fixed_rate;
        }
    }
}
