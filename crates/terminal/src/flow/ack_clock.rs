//! Acknowledgements of frames by the terminal, and the rate of the connection that follows from
//! their times.

use crate::Multiplexer;
use crate::flow::{FRAME_SPAN, LOST_AFTER, SMALL};
use std::collections::VecDeque;
use std::time::Duration;

/// Longest interval between two acknowledgements that are combined into one measurement. The second
/// alone would give too high a rate if the first was delayed.
const ACKS_TOGETHER: Duration = Duration::from_millis(20);

/// Frames in flight, which the terminal acknowledges, and the last measurement of the rate.
#[derive(Debug, Default)]
pub(super) struct AckClock {
    /// Multiplexer through which requests and acknowledgements pass.
    pub multiplexer: Option<Multiplexer>,
    /// Frames in flight, oldest first.
    pub in_flight: VecDeque<InFlight>,
    last_acked: Option<AckedFrame>,
    /// Number of consecutive losses.
    pub losses: u32,
    /// Estimated time at which the frames in flight will have been transmitted.
    pub clear_at: Duration,
    /// Last measurement of the rate.
    sample: Option<AckSample>,
}

#[derive(Clone, Copy, Debug)]
pub(super) struct InFlight {
    pub sent: Duration,
    pub bytes: usize,
    /// `true` if the frame contains cells of the picture.
    pub picture: bool,
    /// `true` if no other frame was in flight when it was sent.
    pub alone: bool,
}

#[derive(Clone, Copy, Debug)]
struct AckedFrame {
    sent: Duration,
    at: Duration,
}

/// Measurement of the rate: `bytes` bytes, the last of them acknowledged at the time `at`. A reply
/// to the first byte could have arrived between `earliest_start` and `latest_start`.
#[derive(Clone, Copy, Debug)]
struct AckSample {
    earliest_start: Duration,
    latest_start: Duration,
    /// Time at which the previous frame was sent; `None` if the connection was idle in between.
    sent_from: Option<Duration>,
    at: Duration,
    bytes: usize,
}

impl AckClock {
    pub fn new(multiplexer: Option<Multiplexer>) -> Self {
        Self { multiplexer, ..Self::default() }
    }

    pub fn sent(&mut self, now: Duration, bytes: usize, picture: bool, duration: Duration) {
        self.clear_at = self.clear_at.max(now) + duration;
        let alone = self.in_flight.is_empty();
        self.in_flight.push_back(InFlight { sent: now, bytes, picture, alone });
    }

    /// Takes the oldest frame in flight, which the terminal has acknowledged at the time `at`.
    pub fn acknowledged(&mut self, at: Duration) -> Option<InFlight> {
        let frame = self.in_flight.pop_front()?;
        self.losses = 0;
        if self.in_flight.is_empty() {
            self.clear_at = self.clear_at.min(at);
        }
        Some(frame)
    }

    /// Measures the rate of the connection by the acknowledgement of `frame` at the time `at`.
    /// `round_trip` is the known round trip; `None` if it is unknown or longer than that of `frame`.
    /// `known_rate` is the average of earlier measurements, and `budget` the largest number of bytes
    /// of a frame. Returns `None` if `frame` is too small to show the rate.
    pub fn measure(
        &mut self,
        frame: InFlight,
        at: Duration,
        round_trip: Option<Duration>,
        known_rate: f64,
        budget: usize,
    ) -> Option<f64> {
        let last_acked = self.last_acked.replace(AckedFrame { sent: frame.sent, at });
        // The rate is the number of bytes divided by the time in which replies to them could
        // arrive. This time begins 0.9 to 1 round trips after the frame was sent, but not before
        // the previous acknowledgement. It ends with this acknowledgement.
        let idle_start =
            |round_trips: f64| frame.sent + round_trip.unwrap_or_default().mul_f64(round_trips);
        let previous = last_acked.filter(|last| last.at > idle_start(0.9));
        let start = |round_trips: f64| {
            let start = idle_start(round_trips);
            previous.map_or(start, |last| start.max(last.at))
        };
        let sample = match self.sample {
            Some(last) if at <= last.at + ACKS_TOGETHER => {
                AckSample { at, bytes: last.bytes + frame.bytes, ..last }
            }
            _ => AckSample {
                earliest_start: start(0.9),
                latest_start: if round_trip.is_some() { start(1.0) } else { at },
                sent_from: previous.map(|last| last.sent),
                at,
                bytes: frame.bytes,
            },
        };
        self.sample = Some(sample);
        // Two acknowledgements may arrive closer together than the frames were sent.
        let sending = sample.sent_from.map(|from| frame.sent.saturating_sub(from));
        let longest = at.saturating_sub(sample.earliest_start).max(sending.unwrap_or_default());
        let shortest = at.saturating_sub(sample.latest_start);
        let rate = |span: Duration| {
            sample.bytes as f64 / span.max(Duration::from_millis(10)).as_secs_f64()
        };
        // The known rate is kept if it is between both bounds; otherwise the nearer bound replaces
        // it.
        let rate = known_rate.clamp(rate(longest), rate(shortest.min(longest)));
        let is_full = 2 * sample.bytes >= budget || shortest > 2 * FRAME_SPAN;
        (rate > known_rate || sample.bytes >= SMALL && is_full).then_some(rate)
    }

    /// Returns the time at which the oldest frame in flight counts as lost.
    pub fn lost_at(&self) -> Option<Duration> {
        self.in_flight.front().map(|frame| frame.sent + LOST_AFTER)
    }

    pub fn forget_frames(&mut self) {
        self.in_flight.clear();
        self.last_acked = None;
    }

    /// Continues after an interruption of the connection.
    pub fn resumed(self) -> Self {
        Self { losses: 0, sample: None, ..self }
    }
}
