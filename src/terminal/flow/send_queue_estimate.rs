//! Estimates from the bytes in the kernel's TCP send queue: round trip and rate.

use std::time::Duration;

/// Time after sending a frame in which the queue is not measured. Another process, such as `sshd`,
/// passes the bytes on, so that they may not have reached the queue.
const SETTLING: Duration = Duration::from_millis(10);
/// Shortest busy period that is measured while the round trip is unknown. A queue that is empty
/// earlier may not have received the bytes yet.
const BELIEVED_AFTER: Duration = Duration::from_millis(50);
/// Duration over which bytes are counted for a rate. The queue is measured every 20 ms.
const SAMPLE: Duration = Duration::from_millis(100);

/// Estimate of the send queue's length and of the rate at which bytes leave it.
#[derive(Debug, Default)]
pub struct SendQueueEstimate {
    /// Number of bytes in the queue: the last measurement plus the bytes sent since.
    pub bytes: f64,
    /// Time of the last measurement.
    pub measured_at: Option<Duration>,
    /// Number of bytes sent in total.
    sent: f64,
    /// Time of the last frame.
    sent_at: Duration,
    busy: Option<Busy>,
    /// Start of a rate sample that was too short when the queue became empty, and the number of
    /// bytes that had left the queue before. The next frames may continue it.
    short_sample: Option<(Duration, f64)>,
}

/// Period in which the queue is not empty.
#[derive(Debug)]
struct Busy {
    since: Duration,
    /// Start of the rate sample that ends with the period, and the number of bytes that had left
    /// the queue before. It may begin in an earlier period.
    whole: (Duration, f64),
    /// Size in bytes of the period's only frame; `None` for several frames.
    alone: Option<usize>,
    /// Start of the current rate sample, and the number of bytes that had left the queue before.
    sample: Option<(Duration, f64)>,
    /// `true` if the queue was full at some time in the sample, so that the sample's rate is that
    /// of the connection.
    is_full: bool,
    /// Time at which bytes last left the queue; initially the start of the period.
    progress: Duration,
    /// Largest number of bytes that had left the queue, over all measurements.
    most_drained: f64,
}

/// Result of a measurement of the queue.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct QueueSample {
    /// Time to the acknowledgement of a frame without other frames in flight, and the size of this
    /// frame.
    pub round_trip: Option<(Duration, usize)>,
    /// Bytes per second that left the queue.
    pub rate: Option<f64>,
    /// `true` if `rate` is the rate of the connection; `false` if the connection may be faster.
    pub is_full: bool,
}

impl SendQueueEstimate {
    /// Records a frame of `bytes` bytes. `limit` is the number of bytes at which the queue is full.
    pub fn sent(&mut self, now: Duration, bytes: usize, limit: f64) {
        match &mut self.busy {
            Some(busy) => busy.alone = None,
            None => {
                let continued = self.short_sample.take();
                self.busy = Some(Busy {
                    since: now,
                    whole: continued
                        .filter(|(start, _)| now < *start + SAMPLE)
                        .unwrap_or((now, self.sent)),
                    alone: Some(bytes),
                    sample: None,
                    is_full: false,
                    progress: now,
                    most_drained: self.sent,
                });
            }
        }
        self.sent += bytes as f64;
        self.bytes += bytes as f64;
        self.sent_at = now;
        if let Some(busy) = &mut self.busy {
            busy.is_full |= self.bytes >= limit;
        }
    }

    /// Returns the earliest time of the next measurement, `interval` after the last one. Returns
    /// `None` if the queue is empty.
    pub fn next_at(&self, interval: Duration) -> Option<Duration> {
        self.busy.as_ref()?;
        let settled = self.sent_at + SETTLING;
        Some(self.measured_at.map_or(settled, |at| settled.max(at + interval)))
    }

    /// Returns the time since which no bytes have left a queue that is not empty.
    pub fn stalled_since(&self) -> Option<Duration> {
        self.busy.as_ref().map(|busy| busy.progress)
    }

    /// Records the measured number of `bytes` in the queue. `limit` is the number of bytes at which
    /// the queue is full, and `round_trip` is the shortest known round trip.
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
        // Before this time no acknowledgement can have come.
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
        // Rate since the beginning of the period, which stalls lower but do not raise. The bytes of
        // a short time prove no rate: a relay, or the buffers of the other host, may have taken
        // them at once.
        let (start, before) = busy.whole;
        let span = now.saturating_sub(start);
        let whole = (span >= SAMPLE).then(|| (drained - before) / span.as_secs_f64());
        if bytes == 0 {
            let sample = QueueSample {
                round_trip: busy.alone.map(|bytes| (now - busy.since, bytes)),
                rate: whole,
                is_full: false,
            };
            self.short_sample = whole.is_none().then_some(busy.whole);
            self.busy = None;
            return sample;
        }
        let Some((start, before)) = busy.sample else {
            busy.sample = is_progress.then_some((now, drained));
            return QueueSample::default();
        };
        let span = now.saturating_sub(start);
        if span < SAMPLE {
            return QueueSample::default();
        }
        let is_full = std::mem::replace(&mut busy.is_full, self.bytes >= limit);
        let rate =
            if is_full { Some((drained - before).max(0.0) / span.as_secs_f64()) } else { whole };
        busy.sample = Some((now, drained));
        QueueSample { round_trip: None, rate, is_full }
    }
}
