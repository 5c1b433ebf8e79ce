//! Reader of all terminal input.

use crate::decode::Decoder;
use crate::{Environment, Event};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::io::{self, Stdin};
use std::time::{Duration, Instant};

/// Longest pause inside an escape sequence.
const SEQUENCE_WAIT: Duration = Duration::from_millis(40);
/// Longest pause inside an escape sequence over SSH, where packets can divide it.
const SEQUENCE_WAIT_OVER_SSH: Duration = Duration::from_millis(120);

/// Terminal event with the time at which it was read.
#[derive(Debug)]
pub struct TimedEvent {
    pub at: Instant,
    pub event: Event,
}

/// Reader of events from stdin.
pub struct InputReader {
    stdin: Stdin,
    decoder: Decoder,
    buffer: Vec<u8>,
    /// Time from which the rest of a sequence is awaited. A single byte, which may be a key, does
    /// not extend the wait.
    waits_since: Instant,
    /// Events that were read early, as during the capability query, for the next
    /// [`InputReader::wait`].
    pub early: Vec<TimedEvent>,
}

impl InputReader {
    /// Creates a reader. Over SSH it waits longer for the rest of a sequence.
    pub fn new(environment: &Environment) -> Self {
        let wait = if environment.ssh.is_some() { SEQUENCE_WAIT_OVER_SSH } else { SEQUENCE_WAIT };
        Self {
            stdin: io::stdin(),
            decoder: Decoder::new(wait),
            buffer: vec![0; 1 << 14],
            waits_since: Instant::now(),
            early: Vec::new(),
        }
    }

    /// Waits for events until `deadline`. Returns an empty list if none came.
    ///
    /// # Errors
    /// Fails if the terminal is closed.
    pub fn wait(&mut self, deadline: Option<Instant>) -> io::Result<Vec<TimedEvent>> {
        if !self.early.is_empty() {
            return Ok(std::mem::take(&mut self.early));
        }
        loop {
            let now = Instant::now();
            let time_left = deadline.map(|deadline| deadline.saturating_duration_since(now));
            let waited = now.saturating_duration_since(self.waits_since);
            let patience = self.decoder.patience().map(|wait| wait.saturating_sub(waited));
            let gives_up = patience.is_some_and(|p| time_left.is_none_or(|left| p <= left));
            let wait = if gives_up { patience } else { time_left };
            let wait = wait.and_then(|wait| Timespec::try_from(wait).ok());
            let is_ready = match poll(&mut [PollFd::new(&self.stdin, PollFlags::IN)], wait.as_ref())
            {
                Ok(ready) => ready > 0,
                Err(rustix::io::Errno::INTR) => continue,
                Err(error) => return Err(error.into()),
            };
            let events = if is_ready {
                let read = match rustix::io::read(&self.stdin, &mut *self.buffer) {
                    Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                    Ok(read) => read,
                    Err(rustix::io::Errno::INTR | rustix::io::Errno::AGAIN) => continue,
                    Err(error) => return Err(error.into()),
                };
                if read > 1 || patience.is_none() {
                    self.waits_since = Instant::now();
                }
                self.decoder.take(&self.buffer[..read])
            } else if gives_up {
                self.decoder.give_up()
            } else {
                return Ok(Vec::new());
            };
            if !events.is_empty() {
                let at = Instant::now();
                return Ok(events.into_iter().map(|event| TimedEvent { at, event }).collect());
            }
        }
    }
}
