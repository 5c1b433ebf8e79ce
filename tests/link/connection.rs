//! Simulated connection with a rate and a delay, and a simulated terminal that replies.

use crate::harness::*;
use std::collections::VecDeque;
use std::num::NonZeroU16;
use zerkalo_terminal::diff::{FrameDiff, TargetFrame};
use zerkalo_terminal::flow::{FRAME_INTERVAL, FlowControl, InitialLink, PacingMode};

/// Simulated connection and terminal. Flow control and the computation of frame differences are the
/// program's own.
pub struct Connection {
    pub flow: FlowControl,
    pub diff: FrameDiff,
    pub parser: vt100::Parser,
    pub now: Duration,
    /// Rate of the connection in bytes per second.
    rate: f64,
    one_way: Duration,
    free_at: Duration,
    /// Frames in transmission to the terminal, with their times of arrival.
    in_transit: VecDeque<(Duration, Vec<u8>)>,
    replies: VecDeque<Duration>,
    /// `true` if the terminal replies to requests.
    pub is_replying: bool,
    /// Frames in the kernel's send queue: the start and the end of the transmission of each, and
    /// its number of bytes. The bytes of a frame leave the queue one round trip after their
    /// transmission, when they are acknowledged.
    queue: VecDeque<(Duration, Duration, usize)>,
    /// `true` if the next frame shows the effect of user input.
    is_answering: bool,
    pub sent: Vec<Sent>,
    /// `true` if the user presses keys all the time.
    pub is_user_active: bool,
    /// Two durations. The first is the time during which the terminal differed visibly from the
    /// target frame, and the second the part of this time in which the connection was busy.
    pub waited: [Duration; 2],
}

/// Sizes of a frame that was sent. `flushed` of its bytes are for differences too small to be
/// visible.
#[derive(Clone, Copy, Debug)]
pub struct Sent {
    pub bytes: usize,
    /// Largest allowed size of the frame in bytes.
    pub budget: usize,
    pub flushed: usize,
}

const STEP: Duration = Duration::from_millis(1);

impl Connection {
    /// Creates a connection of `rate` bytes per second to a terminal that replies. `round_trip` is
    /// the round-trip time while the connection is idle.
    pub fn new(size: [u16; 2], rate: f64, round_trip: Duration) -> Self {
        Self::with_mode(size, rate, round_trip, PacingMode::AckClocked(None))
    }

    /// Creates a connection whose frames are paced by `mode`. If `mode` is `SendQueue`, the
    /// terminal does not reply, and the program does not know the round-trip time.
    pub fn with_mode(
        [columns, rows]: [u16; 2],
        rate: f64,
        round_trip: Duration,
        mode: PacingMode,
    ) -> Self {
        let is_replying = mode != PacingMode::SendQueue;
        let start = InitialLink {
            mode,
            round_trip: is_replying.then_some(round_trip),
            queue: !is_replying,
            fixed_rate: 30e3,
        };
        let [columns, rows] = [columns, rows].map(|n| NonZeroU16::new(n).unwrap());
        Self {
            flow: FlowControl::new(start),
            diff: FrameDiff::default(),
            parser: vt100::Parser::new(rows, columns, 0),
            now: Duration::ZERO,
            rate,
            one_way: round_trip / 2,
            free_at: Duration::ZERO,
            in_transit: VecDeque::new(),
            replies: VecDeque::new(),
            is_replying,
            queue: VecDeque::new(),
            is_answering: false,
            sent: Vec::new(),
            is_user_active: false,
            waited: [Duration::ZERO; 2],
        }
    }

    pub fn pass(&mut self, target: &TargetFrame, time: Duration) {
        let end = self.now + time;
        // At most one frame is computed in each frame interval.
        let mut next = self.now;
        while self.now < end {
            self.now += STEP;
            self.arrive();
            self.flow.expire(self.now);
            if self.flow.wants_queue_length(self.now) {
                let queued = self.queued();
                self.flow.record_queue_length(self.now, Some(queued));
            }
            if self.is_user_active {
                self.flow.record_input(self.now);
            }
            let allowance = self.flow.allowance(self.now, self.is_answering);
            if let Some(allowance) = allowance.filter(|_| next <= self.now) {
                next = self.now + FRAME_INTERVAL;
                let mut bytes = Vec::new();
                let threshold = self.flow.threshold();
                let frame = self.diff.frame(target, self.now, allowance, threshold, &mut bytes);
                if !bytes.is_empty() {
                    self.flow.sent(self.now, bytes.len(), frame.picture, frame.flushed);
                    let [size, budget] = [bytes.len(), allowance.bytes];
                    self.sent.push(Sent { bytes: size, budget, flushed: frame.flushed });
                    let duration = Duration::from_secs_f64(size as f64 / self.rate);
                    let start = self.free_at.max(self.now);
                    self.free_at = start + duration;
                    self.queue.push_back((start, self.free_at, size));
                    self.is_answering &= !frame.picture;
                    self.in_transit.push_back((self.free_at + self.one_way, bytes));
                }
            }
            if self.diff.pending.visible {
                self.waited[0] += STEP;
                self.waited[1] += if self.free_at >= self.now { STEP } else { Duration::ZERO };
            }
        }
    }

    /// Simulates a key press. Until the key reaches the program, the target frame is `old`. Then it
    /// is `new`, which shows the effect of the key. Returns the time from the key press until the
    /// first kilobyte of the first new frame arrives.
    pub fn press(&mut self, old: &TargetFrame, new: &TargetFrame) -> Duration {
        let pressed = self.now;
        self.pass(old, self.one_way);
        self.flow.record_input(self.now);
        self.is_answering = true;
        while self.is_answering {
            self.pass(new, STEP);
        }
        let (start, end, bytes) = *self.queue.back().expect("the frame");
        let share = (1000.0 / bytes as f64).min(1.0);
        start + (end - start).mul_f64(share) + self.one_way - pressed
    }

    /// Returns the number of bytes in the kernel's send queue.
    fn queued(&mut self) -> usize {
        let acked_at = self.now.saturating_sub(2 * self.one_way);
        while self.queue.front().is_some_and(|(_, end, _)| *end <= acked_at) {
            self.queue.pop_front();
        }
        let in_queue = |(start, end, bytes): &(Duration, Duration, usize)| {
            let acked = acked_at.saturating_sub(*start).as_secs_f64();
            *bytes as f64 * (1.0 - acked / (*end - *start).as_secs_f64())
        };
        self.queue.iter().map(in_queue).sum::<f64>().ceil() as usize
    }

    /// Delivers to the terminal all frames that are still in transmission.
    pub fn drain(&mut self) {
        for (_, bytes) in self.in_transit.drain(..) {
            self.parser.process(&bytes);
        }
    }

    /// Returns the share of the time with visible differences during which the connection was busy.
    pub fn busy(&self) -> f64 {
        self.waited[1].as_secs_f64() / self.waited[0].as_secs_f64().max(1e-3)
    }

    /// Returns the total number of bytes that were sent.
    pub fn total(&self) -> usize {
        self.sent.iter().map(|sent| sent.bytes).sum()
    }

    fn arrive(&mut self) {
        while self.in_transit.front().is_some_and(|(at, _)| *at <= self.now) {
            let (at, bytes) = self.in_transit.pop_front().unwrap();
            self.parser.process(&bytes);
            if self.is_replying && self.flow.ack_request().is_some() {
                self.replies.push_back(at + self.one_way);
            }
        }
        while self.replies.front().is_some_and(|at| *at <= self.now) {
            let at = self.replies.pop_front().unwrap();
            self.flow.on_ack(at);
        }
    }
}
