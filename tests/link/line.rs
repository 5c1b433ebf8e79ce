//! A line of some rate and delay with a terminal at its end that answers, in counted time.

use std::collections::VecDeque;
use std::num::NonZeroU16;
use std::time::Duration;
use zerkalo::terminal::diff::{FrameDiff, TargetFrame};
use zerkalo::terminal::flow::{FRAME_INTERVAL, FlowControl, InitialLink, PacingMode};

/// The line, the terminal, and the program's idea of both.
pub struct Line {
    pub link: FlowControl,
    pub pacing: FrameDiff,
    pub parser: vt100::Parser,
    pub now: Duration,
    /// Bytes a second.
    rate: f64,
    one_way: Duration,
    free_at: Duration,
    /// Frames on the line: when they are there.
    coming: VecDeque<(Duration, Vec<u8>)>,
    answers: VecDeque<Duration>,
    /// Answers come back.
    pub answering: bool,
    pub sent: Vec<Sent>,
    /// The user acts all the time.
    pub acting: bool,
    /// How long differences that can be seen have waited, and how long of that the line was busy.
    pub waited: [Duration; 2],
}

/// A frame that was sent.
#[derive(Clone, Copy, Debug)]
pub struct Sent {
    pub bytes: usize,
    /// What it was allowed to be.
    pub budget: usize,
    pub flushed: usize,
}

const STEP: Duration = Duration::from_millis(1);

impl Line {
    /// `round_trip`: of an empty line.
    pub fn new([columns, rows]: [u16; 2], rate: f64, round_trip: Duration) -> Self {
        let start = InitialLink {
            mode: PacingMode::AckClocked(None),
            round_trip: Some(round_trip),
            queue: false,
            fixed_rate: 30e3,
        };
        let [columns, rows] = [columns, rows].map(|n| NonZeroU16::new(n).unwrap());
        Self {
            link: FlowControl::new(start),
            pacing: FrameDiff::new(),
            parser: vt100::Parser::new(rows, columns, 0),
            now: Duration::ZERO,
            rate,
            one_way: round_trip / 2,
            free_at: Duration::ZERO,
            coming: VecDeque::new(),
            answers: VecDeque::new(),
            answering: true,
            sent: Vec::new(),
            acting: false,
            waited: [Duration::ZERO; 2],
        }
    }

    /// Lets so much time pass while `wanted` is to be shown.
    pub fn pass(&mut self, wanted: &TargetFrame, time: Duration) {
        let end = self.now + time;
        // Nothing becomes different without an answer, or in less time.
        let mut next = self.now;
        while self.now < end {
            self.now += STEP;
            self.arrive();
            self.link.expire(self.now);
            if self.acting {
                self.link.act(self.now);
            }
            let allowance = self.link.allowance(self.now, false);
            if let Some(allowance) = allowance.filter(|_| next <= self.now) {
                next = self.now + FRAME_INTERVAL;
                let mut bytes = Vec::new();
                let threshold = self.link.threshold();
                let frame = self.pacing.frame(wanted, self.now, allowance, threshold, &mut bytes);
                if !bytes.is_empty() {
                    self.link.sent(self.now, bytes.len(), frame.picture, frame.flushed);
                    let [size, budget] = [bytes.len(), allowance.bytes];
                    self.sent.push(Sent { bytes: size, budget, flushed: frame.flushed });
                    let took = Duration::from_secs_f64(size as f64 / self.rate);
                    self.free_at = self.free_at.max(self.now) + took;
                    self.coming.push_back((self.free_at + self.one_way, bytes));
                }
            }
            if self.pacing.pending().visible {
                self.waited[0] += STEP;
                self.waited[1] += if self.free_at >= self.now { STEP } else { Duration::ZERO };
            }
        }
    }

    /// Lets everything arrive that is on the line.
    pub fn drain(&mut self) {
        for (_, bytes) in self.coming.drain(..) {
            self.parser.process(&bytes);
        }
    }

    /// The share of the time in which differences waited that could be seen, in which the line was
    /// busy.
    pub fn busy(&self) -> f64 {
        self.waited[1].as_secs_f64() / self.waited[0].as_secs_f64().max(1e-3)
    }

    /// Bytes sent in all.
    pub fn total(&self) -> usize {
        self.sent.iter().map(|sent| sent.bytes).sum()
    }

    fn arrive(&mut self) {
        while self.coming.front().is_some_and(|(at, _)| *at <= self.now) {
            let (at, bytes) = self.coming.pop_front().unwrap();
            self.parser.process(&bytes);
            if self.answering && self.link.ack_request().is_some() {
                self.answers.push_back(at + self.one_way);
            }
        }
        while self.answers.front().is_some_and(|at| *at <= self.now) {
            let at = self.answers.pop_front().unwrap();
            self.link.on_ack(at);
        }
    }
}
