//! What the terminal sends, as it comes.

use crate::terminal::decode::Decoder;
use crate::terminal::{Environment, Event};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::io::{self, Stdin};
use std::time::{Duration, Instant};

/// How long after ESC a byte may come that belongs to it.
const ESCAPE_WAIT: Duration = Duration::from_millis(40);
/// The same over SSH, where a sequence may come in two pieces.
const ESCAPE_WAIT_OVER_SSH: Duration = Duration::from_millis(120);

/// Something that came, and when.
#[derive(Debug)]
pub struct Timed {
    /// When it was read.
    pub at: Instant,
    /// What.
    pub event: Event,
}

/// The terminal that stdin comes from.
pub struct Keyboard {
    stdin: Stdin,
    decoder: Decoder,
    buffer: Vec<u8>,
    early: Vec<Timed>,
}

impl Keyboard {
    /// Of a terminal in such surroundings.
    pub fn new(surroundings: &Environment) -> Self {
        let wait = if surroundings.ssh.is_some() { ESCAPE_WAIT_OVER_SSH } else { ESCAPE_WAIT };
        Self {
            stdin: io::stdin(),
            decoder: Decoder::new(wait),
            buffer: vec![0; 1 << 14],
            early: Vec::new(),
        }
    }

    /// Waits for something to come, at most until `deadline`; then nothing may have come.
    ///
    /// # Errors
    /// If the terminal is gone.
    pub fn wait(&mut self, deadline: Option<Instant>) -> io::Result<Vec<Timed>> {
        if !self.early.is_empty() {
            return Ok(std::mem::take(&mut self.early));
        }
        loop {
            let now = Instant::now();
            let left = deadline.map(|deadline| deadline.saturating_duration_since(now));
            let patience = self.decoder.patience();
            let gives_up = patience.is_some_and(|p| left.is_none_or(|left| p <= left));
            let wait = if gives_up { patience } else { left };
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
                return Ok(events.into_iter().map(|event| Timed { at, event }).collect());
            }
        }
    }

    /// What came before anybody was there to act on it: the next [`Keyboard::wait`] returns it.
    pub fn keep(&mut self, early: Vec<Timed>) {
        self.early.extend(early);
    }

    /// Whether there is something to read within `wait`; `None`: a signal came between.
    fn is_ready(&self, wait: Option<Duration>) -> io::Result<Option<bool>> {
        let wait = wait.map(|wait| Timespec {
            tv_sec: wait.as_secs() as _,
            tv_nsec: wait.subsec_nanos() as _,
        });
        let mut stdin = [PollFd::new(&self.stdin, PollFlags::IN)];
        match poll(&mut stdin, wait.as_ref()) {
            Ok(ready) => Ok(Some(ready > 0)),
            Err(rustix::io::Errno::INTR) => Ok(None),
            Err(error) => Err(error.into()),
        }
    }
}
