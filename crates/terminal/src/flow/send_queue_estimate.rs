//! Estimates of round trip and rate of an SSH connection from the bytes in the kernel's TCP send
//! queue.

use std::time::Duration;

/// Time after the sending of a frame during which the TCP send queue is not measured. Another
/// process, such as `sshd`, passes the bytes of the frame on, and during this time they may not
/// have reached the queue.
const SETTLING: Duration = Duration::from_millis(10);
/// Time after the start of a busy period during which measurements of the TCP send queue are
/// ignored, if the round trip is unknown. A queue that is empty so soon may not have received the
/// bytes yet.
const BELIEVED_AFTER: Duration = Duration::from_millis(50);
/// Shortest time over which the rate is measured. The rate is the number of bytes that leave the
/// TCP send queue in this time, divided by the time.
const SAMPLE: Duration = Duration::from_millis(100);

/// Estimate of the TCP send queue's length and of the rate at which bytes leave it.
#[derive(Debug, Default)]
pub struct SendQueueEstimate {
    /// Estimated number of bytes in the send queue: the last measurement plus the bytes sent since.
    pub bytes: f64,
    /// Time of the last measurement of the send queue; `None` before the first one.
    pub measured_at: Option<Duration>,
    /// Number of bytes sent to the terminal in total.
    sent: f64,
    /// Time at which the last frame was sent.
    sent_at: Duration,
    busy: Option<Busy>,
    /// Beginning of the last measurement of the rate, if this measurement was too short: the queue
    /// became empty before [`SAMPLE`] had passed. The next busy period may continue it. The pair is
    /// `(time, total number of bytes that had left the queue until then)`.
    short_sample: Option<(Duration, f64)>,
}

/// Busy period: time in which the TCP send queue is not empty.
#[derive(Debug)]
struct Busy {
    since: Duration,
    /// Beginning of the measurement of the rate over the whole busy period. The pair is `(time,
    /// total number of bytes that had left the queue until then)`. Two busy periods count as one if
    /// the first was too short for a measurement and began less than [`SAMPLE`] before the second.
    /// The measurement then begins with the first.
    whole: (Duration, f64),
    /// Size in bytes of the only frame that was sent in the busy period; `None` for several frames.
    alone: Option<usize>,
    /// Beginning of the current measurement of the rate; `None` if none has begun. The pair is
    /// `(time, total number of bytes that had left the queue until then)`.
    sample: Option<(Duration, f64)>,
    /// `true` if the send queue was full at some time during the current measurement of the rate.
    /// The queue is full if it holds as many bytes as flow control permits. Bytes then leave it at
    /// the rate of the connection.
    is_full: bool,
    /// Time at which bytes last left the send queue; initially the start of the busy period.
    progress: Duration,
    /// Total number of bytes that have left the send queue: the largest value of all measurements
    /// so far.
    most_drained: f64,
}

/// Result of a measurement of the TCP send queue.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct QueueSample {
    /// Round trip of a frame that was the only one sent in a busy period of the queue. The pair is
    /// `(time from sending the frame until the queue was empty, size of the frame in bytes)`.
    /// `None` if no round trip was measured.
    pub round_trip: Option<(Duration, usize)>,
    /// Rate at which bytes left the send queue, in bytes per second; `None` if it was not measured.
    pub rate: Option<f64>,
    /// `true` if `rate` is the rate of the connection; `false` if the connection may be faster.
    pub is_full: bool,
}

impl SendQueueEstimate {
    /// Records that a frame of `bytes` bytes was sent. `limit` is the number of bytes at which the
    /// send queue is full.
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

    /// Returns the time of the next measurement of the send queue: `interval` after the last one,
    /// but at least `SETTLING` after the last frame was sent. Returns `None` if the queue is empty.
    pub fn next_at(&self, interval: Duration) -> Option<Duration> {
        self.busy.as_ref()?;
        let settled = self.sent_at + SETTLING;
        Some(self.measured_at.map_or(settled, |at| settled.max(at + interval)))
    }

    /// Returns the time since which no bytes have left the send queue; `None` if the queue is
    /// empty.
    pub fn stalled_since(&self) -> Option<Duration> {
        self.busy.as_ref().map(|busy| busy.progress)
    }

    /// Records that `bytes` bytes were measured in the send queue. `limit` is the number of bytes
    /// at which the queue is full, and `round_trip` is the shortest known round trip. Returns the
    /// round trip and the rate that follow from the measurement.
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
        // Measurements before `filled_at` are ignored, because the other host cannot have
        // acknowledged any bytes of this busy period yet.
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
        // Rate over the whole busy period. Pauses of the connection lower it but cannot raise it. A
        // busy period shorter than `SAMPLE` gives no rate. Its bytes may have been taken at once by
        // a relay or by the buffers of the other host, without being transmitted at the rate of the
        // connection.
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
