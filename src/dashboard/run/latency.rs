//! Measurement of input latency: from reading an event until the frame that responds has been
//! written.

use std::io;
use std::path::Path;
use std::time::{Duration, Instant};
use zerkalo_scene::disk;

/// Input event to which no frame has responded yet.
#[derive(Clone, Copy, Debug)]
struct Awaiting {
    read: Instant,
    /// Lowest generation whose picture responds to the event. 0: any frame responds.
    scene: u64,
}

/// Input event to which a frame has responded.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Answered {
    /// Time at which the event was read, since the start of the recorder.
    read: Duration,
    /// `true` if the response is a new picture.
    picture: bool,
    /// Time until the response was written.
    after: Duration,
}

/// Recorder of input latencies. It always knows the events that await a response, because the event
/// loop sends such a frame at once; it stores latencies only on request.
#[derive(Debug)]
pub struct LatencyRecorder {
    began: Instant,
    awaiting: Vec<Awaiting>,
    /// Events to which the frame that is being written responds.
    in_flight: Vec<Awaiting>,
    answered: Option<Vec<Answered>>,
    load: Load,
}

/// Traffic while the terminal differs visibly from the picture that it should show.
#[derive(Clone, Copy, Debug, Default)]
struct Load {
    /// Time of the last update, `true` if the terminal differed visibly then, and the bytes sent
    /// until then.
    last: (Duration, bool, u64),
    waited: Duration,
    bytes: u64,
}

impl LatencyRecorder {
    /// Creates a recorder, which stores latencies if `remember` is `true`.
    pub fn new(remember: bool) -> Self {
        Self {
            began: Instant::now(),
            awaiting: Vec::new(),
            in_flight: Vec::new(),
            answered: remember.then(Vec::new),
            load: Load::default(),
        }
    }

    /// Records an event that has been handled. `scene` is the generation that the response must
    /// show; `None` if any frame is a response.
    pub fn event(&mut self, read: Instant, scene: Option<u64>) {
        self.awaiting.push(Awaiting { read, scene: scene.unwrap_or(0) });
    }

    /// Returns `true` if a frame with the picture of generation `scene` would respond to an event.
    pub fn replies(&self, scene: u64) -> bool {
        self.awaiting.iter().any(|waiting| waiting.scene <= scene)
    }

    /// Records that a frame with the picture of generation `scene` (0: without picture) is being
    /// written.
    pub fn sent(&mut self, scene: u64) {
        self.in_flight.extend(self.awaiting.extract_if(.., |waiting| waiting.scene <= scene));
    }

    /// Records that the frame was written.
    pub fn written(&mut self, at: Instant) {
        for waiting in self.in_flight.drain(..) {
            if let Some(answered) = &mut self.answered {
                answered.push(Answered {
                    read: waiting.read.saturating_duration_since(self.began),
                    picture: waiting.scene > 0,
                    after: at.saturating_duration_since(waiting.read),
                });
            }
        }
    }

    /// Records the traffic after a frame. `waits` is `true` if the terminal still differs visibly.
    /// `sent` is the number of bytes since the start.
    pub fn line(&mut self, now: Duration, waits: bool, sent: u64) {
        let Load { last: (before, waited, known), .. } = self.load;
        if waited {
            self.load.waited += now.saturating_sub(before);
        }
        if waits {
            self.load.bytes += sent - known;
        }
        self.load.last = (now, waits, sent);
    }

    /// Writes a CSV file with one line per event: seconds from the start until it was read, kind of
    /// response (`picture` or `screen`), latency in milliseconds.
    pub fn write(&self, path: &Path) -> io::Result<()> {
        let mut table = "read_seconds,answer,milliseconds\n".to_string();
        for Answered { read, picture, after } in self.answered.iter().flatten() {
            let answer = if *picture { "picture" } else { "screen" };
            let (read, after) = (read.as_secs_f64(), 1e3 * after.as_secs_f64());
            table += &format!("{read:.6},{answer},{after:.3}\n");
        }
        disk::write(path, table.as_bytes()).map_err(io::Error::other)
    }

    /// Returns a summary: a line for events with a picture as response, one for others, and one for
    /// the traffic.
    pub fn summary(&self) -> Vec<String> {
        let summary_of = |wanted: bool, name: &str| {
            let of_kind = self.answered.iter().flatten().filter(|a| a.picture == wanted);
            let mut after: Vec<_> = of_kind.map(|a| a.after).collect();
            after.sort_unstable();
            let [median, p99] = [0.5, 0.99].map(|share| quantile(&after, share));
            let ms = |time: Duration| format!("{:.1} ms", 1e3 * time.as_secs_f64());
            let last = *after.last()?;
            Some(format!(
                "{name}: {} events, median {}, p99 {}, max {}",
                after.len(),
                ms(median),
                ms(p99),
                ms(last)
            ))
        };
        let kinds = [(true, "event to picture"), (false, "event to screen")];
        let replies = kinds.into_iter().filter_map(|(picture, name)| summary_of(picture, name));
        let Load { waited, bytes, .. } = self.load;
        let load = (self.answered.is_some() && !waited.is_zero()).then(|| {
            let seconds = waited.as_secs_f64();
            format!(
                "visible differences waited for {seconds:.3} s, in which {bytes} bytes were sent"
            )
        });
        replies.chain(load).collect()
    }
}

/// Returns the smallest element that at least the fraction `share` of `sorted` does not exceed; 0
/// if it is empty.
fn quantile(sorted: &[Duration], share: f64) -> Duration {
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.saturating_sub(1)).copied().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn picture_responds_to_its_generation_and_earlier() {
        let mut recorder = LatencyRecorder::new(true);
        let start = recorder.began;
        let at = |ms| start + Duration::from_millis(ms);
        assert!(!recorder.replies(0));
        recorder.event(at(0), Some(1));
        recorder.event(at(5), Some(2));
        recorder.event(at(6), None);
        assert!(recorder.replies(0));
        recorder.sent(0);
        recorder.written(at(7));
        assert!(!recorder.replies(0));
        assert!(recorder.replies(1));
        recorder.sent(1);
        assert!(!recorder.replies(1), "it is on its way");
        // An event that is read while a frame is being written waits for the next frame.
        recorder.event(at(9), None);
        recorder.written(at(20));
        recorder.sent(7);
        recorder.written(at(30));
        let replies: Vec<_> = recorder
            .answered
            .as_ref()
            .unwrap()
            .iter()
            .map(|a| (a.read.as_millis(), a.picture, a.after.as_millis()))
            .collect();
        assert_eq!(replies, [(6, false, 1), (0, true, 20), (5, true, 25), (9, false, 21)]);
        assert_eq!(
            recorder.summary(),
            [
                "event to picture: 2 events, median 20.0 ms, p99 25.0 ms, max 25.0 ms",
                "event to screen: 2 events, median 1.0 ms, p99 21.0 ms, max 21.0 ms",
            ]
        );
        let path = tempfile::tempdir().unwrap().path().join("trace.csv");
        assert!(recorder.write(&path).is_err(), "no such folder");
    }

    #[test]
    fn quantiles() {
        let ms = |n: u64| Duration::from_millis(n);
        let sorted: Vec<_> = (1..=100).map(ms).collect();
        assert_eq!(quantile(&sorted, 0.5), ms(50));
        assert_eq!(quantile(&sorted, 0.99), ms(99));
        assert_eq!(quantile(&sorted[..3], 0.5), ms(2));
        assert_eq!(quantile(&[], 0.5), ms(0));
    }

    #[test]
    fn traffic_counts_while_differences_are_pending() {
        let mut recorder = LatencyRecorder::new(true);
        let ms = Duration::from_millis;
        for (at, waits, sent) in
            [(0, false, 100), (1000, true, 1100), (1100, true, 2100), (1200, false, 3000)]
        {
            recorder.line(ms(at), waits, sent);
        }
        recorder.line(ms(9000), false, 3500);
        let summary = "visible differences waited for 0.200 s, in which 2000 bytes were sent";
        assert_eq!(recorder.summary(), [summary]);
    }

    #[test]
    fn nothing_is_stored_without_request() {
        let mut recorder = LatencyRecorder::new(false);
        recorder.event(recorder.began, None);
        recorder.sent(0);
        recorder.written(recorder.began);
        assert!(recorder.summary().is_empty());
    }
}
