//! Measurement of input latency: from reading an event until the frame that responds has been
//! written.

use std::io;
use std::path::Path;
use std::time::Instant;
use zerkalo_scene::disk;

/// Input event to which no frame has responded yet.
#[derive(Clone, Copy, Debug)]
struct Awaiting {
    read: Instant,
    /// Lowest generation whose picture responds to the event. 0: any frame responds.
    scene: u64,
}

/// Recorder of input latencies. It always knows the events that await a response: the event loop
/// sends a frame at once if it responds to one. It stores latencies only on request.
#[derive(Debug)]
pub struct LatencyRecorder {
    began: Instant,
    awaiting: Vec<Awaiting>,
    /// Events to which the frame that is being written responds.
    in_flight: Vec<Awaiting>,
    /// CSV table of the events to which a frame has responded; `None` if no table is requested.
    table: Option<String>,
}

impl LatencyRecorder {
    /// Creates a recorder, which stores latencies if `remember` is `true`.
    pub fn new(remember: bool) -> Self {
        Self {
            began: Instant::now(),
            awaiting: Vec::new(),
            in_flight: Vec::new(),
            table: remember.then(|| "read_seconds,answer,milliseconds\n".to_string()),
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
        for Awaiting { read, scene } in self.in_flight.drain(..) {
            if let Some(table) = &mut self.table {
                let answer = if scene > 0 { "picture" } else { "screen" };
                let seconds = read.saturating_duration_since(self.began).as_secs_f64();
                let milliseconds = 1e3 * at.saturating_duration_since(read).as_secs_f64();
                *table += &format!("{seconds:.6},{answer},{milliseconds:.3}\n");
            }
        }
    }

    /// Writes a CSV file with one line per event: seconds from the start until it was read, kind of
    /// response (`picture` or `screen`), latency in milliseconds.
    pub fn write(&self, path: &Path) -> io::Result<()> {
        let table = self.table.as_deref().unwrap_or_default();
        disk::write(path, table.as_bytes()).map_err(io::Error::other)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

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
        let table = "read_seconds,answer,milliseconds\n0.006000,screen,1.000\n\
                     0.000000,picture,20.000\n0.005000,picture,25.000\n0.009000,screen,21.000\n";
        assert_eq!(recorder.table.as_deref(), Some(table));
        let path = tempfile::tempdir().unwrap().path().join("trace.csv");
        assert!(recorder.write(&path).is_err(), "no such folder");
    }

    #[test]
    fn nothing_is_stored_without_request() {
        let mut recorder = LatencyRecorder::new(false);
        recorder.event(recorder.began, None);
        recorder.sent(0);
        recorder.written(recorder.began);
        assert_eq!(recorder.table, None);
    }
}
