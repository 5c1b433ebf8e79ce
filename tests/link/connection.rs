//! Simulated connection with a rate and a delay, and an emulated terminal that replies.

use std::collections::VecDeque;
use std::num::NonZeroU16;
use std::time::Duration;
use zerkalo::terminal::diff::{FrameDiff, TargetFrame};
use zerkalo::terminal::flow::{FRAME_INTERVAL, FlowControl, InitialLink, PacingMode};

/// Connection, terminal, and the program's flow control and frame difference.
pub struct Connection {
    pub flow: FlowControl,
    pub diff: FrameDiff,
    pub parser: vt100::Parser,
    pub now: Duration,
    /// Bytes per second.
    rate: f64,
    one_way: Duration,
    free_at: Duration,
    /// Frames in transmission with their times of arrival.
    in_transit: VecDeque<(Duration, Vec<u8>)>,
    replies: VecDeque<Duration>,
    /// `true` if the terminal replies.
    pub is_replying: bool,
    pub sent: Vec<Sent>,
    /// `true` if the user is always active.
    pub is_user_active: bool,
    /// Time in which visible differences waited, and the part of it in which the connection was busy.
    pub waited: [Duration; 2],
}

/// Sent frame.
#[derive(Clone, Copy, Debug)]
pub struct Sent {
    pub bytes: usize,
    /// Budget in bytes.
    pub budget: usize,
    pub flushed: usize,
}

const STEP: Duration = Duration::from_millis(1);

impl Connection {
    /// Creates a connection of `rate` bytes per second. `round_trip` is that of an empty connection.
    pub fn new([columns, rows]: [u16; 2], rate: f64, round_trip: Duration) -> Self {
        let start = InitialLink {
            mode: PacingMode::AckClocked(None),
            round_trip: Some(round_trip),
            queue: false,
            fixed_rate: 30e3,
        };
        let [columns, rows] = [columns, rows].map(|n| NonZeroU16::new(n).unwrap());
        Self {
            flow: FlowControl::new(start),
            diff: FrameDiff::new(),
            parser: vt100::Parser::new(rows, columns, 0),
            now: Duration::ZERO,
            rate,
            one_way: round_trip / 2,
            free_at: Duration::ZERO,
            in_transit: VecDeque::new(),
            replies: VecDeque::new(),
            is_replying: true,
            sent: Vec::new(),
            is_user_active: false,
            waited: [Duration::ZERO; 2],
        }
    }

    /// Simulates `time` while `target` is to be shown.
    pub fn pass(&mut self, target: &TargetFrame, time: Duration) {
        let end = self.now + time;
        // Frames are not checked more often than the frame interval.
        let mut next = self.now;
        while self.now < end {
            self.now += STEP;
            self.arrive();
            self.flow.expire(self.now);
            if self.is_user_active {
                self.flow.act(self.now);
            }
            let allowance = self.flow.allowance(self.now, false);
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
                    self.free_at = self.free_at.max(self.now) + duration;
                    self.in_transit.push_back((self.free_at + self.one_way, bytes));
                }
            }
            if self.diff.pending().visible {
                self.waited[0] += STEP;
                self.waited[1] += if self.free_at >= self.now { STEP } else { Duration::ZERO };
            }
        }
    }

    /// Delivers all frames in transmission.
    pub fn drain(&mut self) {
        for (_, bytes) in self.in_transit.drain(..) {
            self.parser.process(&bytes);
        }
    }

    /// Returns the share of the time with waiting visible differences in which the connection was busy.
    pub fn busy(&self) -> f64 {
        self.waited[1].as_secs_f64() / self.waited[0].as_secs_f64().max(1e-3)
    }

    /// Returns the bytes sent in total.
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
