//! Estimates of round trip and rate of an SSH connection from the length of the kernel's TCP send
//! queue.
//!
//! A relay such as a jump host acknowledges bytes before it transmits them, so that the queue stays
//! empty until the buffer of the relay is full. The rate therefore grows step by step until the
//! queue becomes full. Between two times at which it becomes full, bytes leave it at the rate of the
//! connection. The bytes that the relay then holds follow from this rate and the frames sent; no
//! frame is sent until they have been transmitted.

use crate::flow::{BUDGET, DEFAULT_ROUND_TRIP, FRAME_SPAN, MIN_RATE, SMALL};
use std::collections::VecDeque;
use std::time::Duration;

/// Time after a frame was sent in which its bytes may not have reached the queue yet, because
/// another process, such as `sshd`, passes them on.
const SETTLING: Duration = Duration::from_millis(10);
/// Time from the start of a busy period in which measurements do not count if the round trip is
/// unknown.
const BELIEVED_AFTER: Duration = Duration::from_millis(50);
/// Shortest time over which the rate is measured.
const SHORTEST_SAMPLE: Duration = Duration::from_millis(100);
/// Longest time over which the rate is measured. After a longer time, the connection may have been
/// idle in between, because frames are sent at less than its rate.
const LONGEST_SAMPLE: Duration = Duration::from_secs(3);
/// Time over which a measured rate replaces the earlier estimate.
const CONVINCING_SAMPLE: Duration = Duration::from_millis(500);
/// Factors by which the rate grows in a round trip: before and after its first measurement.
const GROWTH: [f64; 2] = [1.12, 1.03];
/// Pauses of the growth after the queue became full: without a relay, and with one, which it fills.
const GROWTH_PAUSE: [Duration; 2] = [Duration::from_secs(1), Duration::from_secs(15)];
/// Time after the first measurement of the rate in which the capacity of a relay is measured.
const LEARNING_TIME: Duration = Duration::from_secs(6);
/// Share of the rate at which frames are sent, so that a relay becomes empty: without a known relay,
/// and with one. While the buffer of a relay grows, the measured rate is up to a half too high.
const PACE: [f64; 2] = [0.9, 0.6];
/// Largest delay of a frame after the time at which it could have been sent, for a connection that
/// counts as busy in between.
const LATENESS: Duration = Duration::from_millis(40);
/// Upper bound of the ratio of the bytes in the queue to those of frames. Encryption and a
/// multiplexer add bytes.
const OVERHEAD: f64 = 1.2;
/// Time for which sent frames are remembered.
const MEMORY: Duration = Duration::from_secs(10);

/// Estimate of the queue's length and of the rate at which bytes leave it.
#[derive(Debug, Default)]
pub struct SendQueueEstimate {
    /// Estimated bytes in the queue: the last measurement plus the bytes sent since.
    pub bytes: f64,
    pub measured_at: Option<Duration>,
    /// Bytes sent in total.
    sent: f64,
    /// Recently sent frames: times and numbers of bytes.
    frames: VecDeque<(Duration, f64)>,
    busy: Option<Busy>,
    is_full: bool,
    /// Times at which the queue was last full and last empty.
    full_at: Duration,
    empty_at: Duration,
    /// Times at which the queue became full since the connection may have been idle, and numbers of
    /// bytes that had left it in total. A relay may offer room before it is full, so that it holds
    /// fewer bytes at the first of these times than at the others.
    fills: Vec<(Duration, f64)>,
    /// Last measured rate, or the rate when the queue first became full; infinite before that.
    pub settled_rate: f64,
    /// Estimated largest number of bytes that a relay holds: a mean of estimates until
    /// `learns_until`.
    capacity: f64,
    learns_until: Duration,
    /// Earliest time at which the rate may grow.
    grows_at: Duration,
    /// Half of the rate when the round trip was last measured. If the rate falls below it, the
    /// round trip is measured again. It may have become longer, and the limit of the queue follows
    /// from it.
    pub doubtful_rate: f64,
}

/// Busy period, in which the queue is not empty.
#[derive(Debug)]
struct Busy {
    since: Duration,
    /// Bytes of the only frame of the period; `None` for several.
    alone: Option<usize>,
    /// Time at which bytes last left the queue.
    progress: Duration,
    /// Largest measured number of bytes that had left the queue in total.
    most_drained: f64,
}

/// Result of a measurement.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct QueueSample {
    /// Only frame of a busy period that has ended. `None` for several frames.
    pub alone: Option<LoneFrame>,
    /// `true` if the queue has become full.
    pub is_filled: bool,
    /// Bytes per second that left the queue, and the time of the measurement.
    pub rate: Option<(f64, Duration)>,
}

/// Frame that was sent when the queue was empty, and whose bytes have left it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoneFrame {
    pub bytes: usize,
    /// Time until the queue was empty again.
    pub round_trip: Duration,
}

impl SendQueueEstimate {
    pub fn new(doubtful_rate: f64) -> Self {
        Self { doubtful_rate, settled_rate: f64::INFINITY, ..Self::default() }
    }

    /// Records that a frame was sent. `free_at` is the time at which it could be sent earliest.
    /// Returns `true` if the frame has kept the connection busy.
    pub fn sent(&mut self, now: Duration, bytes: usize, free_at: Duration) -> bool {
        let alone = self.busy.is_none().then_some(bytes);
        let most_drained = self.sent;
        let busy = self.busy.get_or_insert(Busy { since: now, alone, progress: now, most_drained });
        busy.alone = alone;
        self.sent += bytes as f64;
        self.bytes += bytes as f64;
        self.frames.retain(|(at, _)| *at + MEMORY > now);
        self.frames.push_back((now, bytes as f64));
        let is_kept_busy = now <= free_at.max(self.full_at) + LATENESS;
        if !is_kept_busy {
            self.fills.clear();
        }
        is_kept_busy
    }

    /// Returns the factor by which `rate` grows now. It grows at most once in each `interval`, and
    /// fills a relay only if the user `is_idle`.
    pub fn growth(&mut self, now: Duration, rate: f64, interval: Duration, is_idle: bool) -> f64 {
        if now < self.grows_at || self.has_relay(rate) && !is_idle {
            return 1.0;
        }
        self.grows_at = now + interval;
        GROWTH[usize::from(self.settled_rate.is_finite())]
    }

    /// Returns `true` if a relay is known to hold bytes that delay others.
    fn has_relay(&self, rate: f64) -> bool {
        self.capacity > rate * SHORTEST_SAMPLE.as_secs_f64()
    }

    /// Returns the time at which the next frame may be sent if the rate is `rate`.
    pub fn free_at(&self, rate: f64) -> Duration {
        let pace = PACE[usize::from(self.has_relay(rate))];
        let paced =
            |(at, bytes): &(Duration, f64)| *at + Duration::from_secs_f64(bytes / pace / rate);
        self.frames.back().map_or(Duration::ZERO, paced).max(self.transmitted_at(rate))
    }

    /// Returns the time at which a connection of `rate` bytes per second has transmitted all frames.
    fn transmitted_at(&self, rate: f64) -> Duration {
        self.frames.iter().fold(Duration::ZERO, |free_at, (at, bytes)| {
            free_at.max(*at) + Duration::from_secs_f64(bytes / rate)
        })
    }

    /// Returns the bytes that a relay holds if the rate is `rate`: those that are neither
    /// transmitted nor in the queue.
    fn relayed(&self, now: Duration, rate: f64) -> f64 {
        let time = self.transmitted_at(rate).saturating_sub(now);
        (time.as_secs_f64() * rate - self.bytes).max(0.0)
    }

    /// Returns the new rate after `sample`, in which the queue became full. `rate` is the rate until
    /// now.
    pub fn settle(&mut self, now: Duration, rate: f64, sample: QueueSample) -> f64 {
        let Some((measured, span)) = sample.rate else {
            self.settled_rate = self.settled_rate.min(rate);
            return rate;
        };
        let is_first = self.learns_until == Duration::ZERO;
        if is_first {
            self.learns_until = now + LEARNING_TIME;
        }
        let share = span.as_secs_f64() / CONVINCING_SAMPLE.as_secs_f64();
        let weight = if is_first { 1.0 } else { share.min(1.0) };
        // The rate is kept if no more than its share was sent.
        let is_kept = (PACE[0] * rate..=rate).contains(&measured);
        let average = ((1.0 - weight) * rate + weight * measured).max(MIN_RATE);
        let settled = if is_kept { rate } else { average };
        self.settled_rate = settled;
        self.doubtful_rate = self.doubtful_rate.max(settled / 2.0);
        if now < self.learns_until {
            let relayed = self.relayed(now, settled).min(settled * MEMORY.as_secs_f64());
            self.capacity = if is_first { relayed } else { (self.capacity + relayed) / 2.0 };
        }
        // Earlier frames were transmitted at another rate.
        while self.relayed(now, settled) > self.capacity {
            self.frames.pop_front();
        }
        let has_relay = self.relayed(now, settled) > SMALL as f64;
        self.grows_at = now + GROWTH_PAUSE[usize::from(has_relay)];
        settled
    }

    /// Returns the time of the next measurement: `interval` after the last one, but at least
    /// [`SETTLING`] after the last frame. Returns `None` if the queue is empty.
    pub fn next_at(&self, interval: Duration) -> Option<Duration> {
        self.busy.as_ref()?;
        let settled = self.frames.back().map_or(SETTLING, |(at, _)| *at + SETTLING);
        Some(self.measured_at.map_or(settled, |at| settled.max(at + interval)))
    }

    /// Returns the time since which no bytes have left the queue; `None` if the queue is empty.
    pub fn stalled_since(&self) -> Option<Duration> {
        self.busy.as_ref().map(|busy| busy.progress)
    }

    /// Records the measured length of the queue. `limit` is the number of bytes of a full queue,
    /// and `round_trip` the shortest known round trip.
    pub fn measured(
        &mut self,
        now: Duration,
        bytes: usize,
        limit: f64,
        round_trip: Option<Duration>,
    ) -> QueueSample {
        self.measured_at = Some(now);
        let Some(busy) = &mut self.busy else {
            self.bytes = bytes as f64;
            return QueueSample::default();
        };
        // Before this time, the other host cannot have acknowledged any bytes of this period.
        let filled_at = busy.since + round_trip.map_or(BELIEVED_AFTER, |time| time.mul_f64(0.9));
        if now < filled_at {
            return QueueSample::default();
        }
        self.bytes = bytes as f64;
        let drained = self.sent - self.bytes;
        let since = now.saturating_sub(round_trip.unwrap_or(DEFAULT_ROUND_TRIP) + FRAME_SPAN);
        let recent: f64 =
            self.frames.iter().filter(|(at, _)| *at >= since).map(|(_, bytes)| bytes).sum();
        let recent = (OVERHEAD * recent).max(BUDGET[0]);
        let is_progress = drained > busy.most_drained;
        if is_progress {
            busy.progress = now;
            busy.most_drained = drained;
        }
        let progress = busy.progress;
        let alone = busy.alone.filter(|_| bytes == 0);
        let alone = alone.map(|bytes| LoneFrame { bytes, round_trip: now - busy.since });
        if bytes == 0 {
            self.busy = None;
            self.empty_at = now;
        }
        // At first, the limit follows from the frames: the queue should empty in a round trip.
        let limit = if self.settled_rate.is_finite() { limit } else { limit.min(recent) };
        let was_full = self.is_full;
        self.is_full = self.bytes > limit || was_full && !is_progress;
        if was_full || self.is_full {
            self.full_at = now;
        }
        let is_filled = self.is_full && !was_full;
        let rate = if is_filled { self.filled(progress, drained) } else { None };
        QueueSample { alone, is_filled, rate }
    }

    /// Records that the queue has become full when `drained` bytes had left it. Returns the rate
    /// since the queue became full before, and the time over which it is measured.
    fn filled(&mut self, now: Duration, drained: f64) -> Option<(f64, Duration)> {
        self.grows_at = self.grows_at.max(now + GROWTH_PAUSE[0]);
        self.fills.push((now, drained));
        // Before the first measurement, more is sent than the connection can carry: it is not idle.
        let is_first = self.learns_until == Duration::ZERO;
        let longest = if is_first { MEMORY } else { LONGEST_SAMPLE };
        self.fills.retain(|(at, _)| now <= *at + longest);
        let &(since, before) = self.fills.get(usize::from(is_first || self.fills.len() > 2))?;
        let span = now - since;
        let rate = (drained - before) / span.as_secs_f64();
        // Without a relay, an empty queue means that the frames, not the connection, limit the rate.
        let has_relay = now < self.learns_until || self.has_relay(self.settled_rate);
        let is_idle = self.empty_at > since && !is_first && !has_relay;
        (span >= SHORTEST_SAMPLE && !(is_idle && rate < self.settled_rate)).then_some((rate, span))
    }
}
