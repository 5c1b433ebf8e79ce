//! Reader of all terminal input: keys, mouse events, pasted text and replies. If the rest of an
//! escape sequence does not arrive in time, the reader ends the sequence.

use crate::decode::Decoder;
use crate::{Environment, Event};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::io::{self, Stdin};
use std::time::{Duration, Instant};

/// Longest pause between ESC and the next byte of its sequence. After a longer pause, ESC is the
/// key Escape.
const ESCAPE_WAIT: Duration = Duration::from_millis(40);
/// Longest pause between ESC and the next byte of its sequence over SSH, where a sequence can be
/// split between packets.
const ESCAPE_WAIT_OVER_SSH: Duration = Duration::from_millis(120);

/// Terminal event with the time at which it was read.
#[derive(Debug)]
pub struct TimedEvent {
    /// Time at which the event was read.
    pub at: Instant,
    /// Key, mouse event, pasted text or reply.
    pub event: Event,
}

/// Reader of keys, mouse events, pasted text and replies from stdin.
pub struct InputReader {
    stdin: Stdin,
    decoder: Decoder,
    buffer: Vec<u8>,
    /// Events that were read during the query of the terminal's capabilities. The next
    /// [`InputReader::wait`] returns them.
    pub(super) early: Vec<TimedEvent>,
}

impl InputReader {
    /// Creates a reader of stdin. `environment` describes the terminal. If the terminal is
    /// connected by SSH, the reader waits longer for the byte after an ESC.
    pub fn new(environment: &Environment) -> Self {
        let wait = if environment.ssh.is_some() { ESCAPE_WAIT_OVER_SSH } else { ESCAPE_WAIT };
        Self {
            stdin: io::stdin(),
            decoder: Decoder::new(wait),
            buffer: vec![0; 1 << 14],
            early: Vec::new(),
        }
    }

    /// Waits for terminal events until `deadline`; `None` means without limit. Returns an empty
    /// list at the deadline.
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
            let patience = self.decoder.patience();
            let gives_up = patience.is_some_and(|p| time_left.is_none_or(|left| p <= left));
            let wait = if gives_up { patience } else { time_left };
            let Some(ready) = self.is_ready(wait)? else { continue };
            let events = if ready {
                let read = match rustix::io::read(&self.stdin, &mut *self.buffer) {
                    Ok(0) => return Err(io::ErrorKind::UnexpectedEof.into()),
                    Ok(read) => read,
                    Err(rustix::io::Errno::INTR | rustix::io::Errno::AGAIN) => continue,
                    Err(error) => return Err(error.into()),
                };
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

    /// Waits at most `wait` for input; `None` means without limit. Returns `Some(true)` if input
    /// has arrived, `Some(false)` if the time is over, and `None` if a signal interrupted the wait.
    fn is_ready(&self, wait: Option<Duration>) -> io::Result<Option<bool>> {
        let wait = wait.and_then(|wait| Timespec::try_from(wait).ok());
        let mut stdin = [PollFd::new(&self.stdin, PollFlags::IN)];
        match poll(&mut stdin, wait.as_ref()) {
            Ok(ready) => Ok(Some(ready > 0)),
            Err(rustix::io::Errno::INTR) => Ok(None),
            Err(error) => Err(error.into()),
        }
    }
}
