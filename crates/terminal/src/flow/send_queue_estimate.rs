//! Estimates of round trip and rate of an SSH connection from the length of the kernel's TCP send
//! queue.

use std::time::Duration;

/// Time after a frame was sent in which its bytes may not have reached the queue yet, because
/// another process, such as `sshd`, passes them on.
const SETTLING: Duration = Duration::from_millis(10);
/// Time from the start of a busy period in which measurements do not count if the round trip is
/// unknown.
const BELIEVED_AFTER: Duration = Duration::from_millis(50);
/// Shortest time over which the rate is measured.
const SAMPLE: Duration = Duration::from_millis(100);

/// Estimate of the queue's length and of the rate at which bytes leave it.
#[derive(Debug, Default)]
pub struct SendQueueEstimate {
    /// Estimated bytes in the queue: the last measurement plus the bytes sent since.
    pub bytes: f64,
    pub measured_at: Option<Duration>,
    /// Bytes sent in total.
    sent: f64,
    /// Time at which the last frame was sent.
    sent_at: Duration,
    busy: Option<Busy>,
    /// Beginning of a measurement that was too short for a rate. The next busy period may continue
    /// it.
    short_sample: Option<SampleStart>,
    /// Half of the rate when the round trip was last measured. If the rate falls below it, the
    /// round trip is measured again. It may have become longer, and the limit of the queue follows
    /// from it.
    pub doubtful_rate: f64,
}

/// Beginning of a measurement of the rate.
#[derive(Clone, Copy, Debug)]
struct SampleStart {
    at: Duration,
    /// Bytes that had left the queue in total.
    drained: f64,
}

impl SampleStart {
    /// Returns the mean rate until `now`, when `drained` bytes have left the queue in total. `None`
    /// for a time shorter than [`SAMPLE`].
    fn rate(self, now: Duration, drained: f64) -> Option<f64> {
        let span = now.saturating_sub(self.at);
        (span >= SAMPLE).then(|| (drained - self.drained) / span.as_secs_f64())
    }
}

/// Busy period, in which the queue is not empty.
#[derive(Debug)]
struct Busy {
    since: Duration,
    /// Beginning of the measurement over the whole period. The measurement continues that of the
    /// previous period if that was too short and began less than [`SAMPLE`] before this period.
    whole: SampleStart,
    /// Bytes of the only frame of the period; `None` for several.
    alone: Option<usize>,
    /// Beginning of the current measurement.
    sample: Option<SampleStart>,
    /// `true` if the queue has held as many bytes as flow control permits since the current
    /// measurement began. Bytes then left the queue at the rate of the connection.
    is_full: bool,
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
    /// Bytes per second that left the queue; `None` if the measurement shows no rate.
    pub rate: Option<f64>,
    /// `true` if `rate` is the rate of the connection. If `false`, the connection may be faster.
    pub is_full: bool,
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
        Self { doubtful_rate, ..Self::default() }
    }

    /// Records that a frame was sent. `limit` is the number of bytes of a full queue.
    pub fn sent(&mut self, now: Duration, bytes: usize, limit: f64) {
        let alone = self.busy.is_none().then_some(bytes);
        let busy = self.busy.get_or_insert_with(|| {
            let continued = self.short_sample.take();
            let continued = continued.filter(|start| now < start.at + SAMPLE);
            Busy {
                since: now,
                whole: continued.unwrap_or(SampleStart { at: now, drained: self.sent }),
                alone,
                sample: None,
                is_full: false,
                progress: now,
                most_drained: self.sent,
            }
        });
        self.sent += bytes as f64;
        self.bytes += bytes as f64;
        self.sent_at = now;
        busy.alone = alone;
        busy.is_full |= self.bytes >= limit;
    }

    /// Returns the time of the next measurement: `interval` after the last one, but at least
    /// [`SETTLING`] after the last frame. Returns `None` if the queue is empty.
    pub fn next_at(&self, interval: Duration) -> Option<Duration> {
        self.busy.as_ref()?;
        let settled = self.sent_at + SETTLING;
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
        let is_progress = drained > busy.most_drained;
        if is_progress {
            busy.progress = now;
            busy.most_drained = drained;
        }
        busy.is_full |= self.bytes >= limit;
        // Pauses can lower the rate over the whole period, but not raise it. In a short period, a
        // relay or the buffers of the other host may have taken the bytes at once.
        let whole = busy.whole.rate(now, drained);
        if bytes == 0 {
            let sample = QueueSample {
                alone: busy.alone.map(|bytes| LoneFrame { bytes, round_trip: now - busy.since }),
                rate: whole,
                is_full: false,
            };
            self.short_sample = whole.is_none().then_some(busy.whole);
            self.busy = None;
            return sample;
        }
        let start = SampleStart { at: now, drained };
        let Some(before) = busy.sample else {
            busy.sample = is_progress.then_some(start);
            return QueueSample::default();
        };
        let Some(full_rate) = before.rate(now, drained) else { return QueueSample::default() };
        busy.sample = Some(start);
        let is_full = std::mem::replace(&mut busy.is_full, self.bytes >= limit);
        let rate = if is_full { Some(full_rate.max(0.0)) } else { whole };
        QueueSample { alone: None, rate, is_full }
    }
}
