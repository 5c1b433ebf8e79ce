//! What befalls a program in a terminal: it is stopped and goes on, the terminal changes its size, or
//! is gone.

use crate::dashboard::message::Message;
use crate::dashboard::run::Dashboard;
use crate::dashboard::run::signals::{HUNG_UP, SignalEvent, StopTarget, stop};
use crate::terminal::{Timed, Tty, size};
use crossbeam_channel::Receiver;
use std::io;
use std::sync::Arc;
use std::time::Duration;

/// A size counts when no other has come for so long,
const SETTLED: Duration = Duration::from_millis(90);
/// and while they go on coming, when the first has waited for so long.
const LONGEST: Duration = Duration::from_millis(400);
/// How long stopping waits for unsaved edits to be written.
const SECURED_WITHIN: Duration = Duration::from_secs(2);
/// Who has not been stopped by then will not be.
const STOPS_WITHIN: Duration = Duration::from_millis(500);

/// The terminal and what comes from outside.
pub(super) struct TerminalIo {
    /// What is written to.
    pub tty: Arc<Tty>,
    /// What comes from the terminal.
    pub input: Receiver<io::Result<Timed>>,
    /// What comes from others.
    pub signals: Receiver<SignalEvent>,
    /// Somebody has given the terminal back, for good.
    pub left: Receiver<()>,
}

/// A size that may change again at once.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ResizeDebounce(Option<(Duration, Duration)>);

impl ResizeDebounce {
    /// It has changed.
    pub fn note(&mut self, now: Duration) {
        let first = self.0.map_or(now, |(first, _)| first);
        self.0 = Some((first, now));
    }

    /// When it counts; `None`: it does not change.
    pub fn due(&self) -> Option<Duration> {
        self.0.map(|(first, last)| (last + SETTLED).min(first + LONGEST))
    }
}

impl Dashboard {
    /// Does what a signal says; the exit status if that is to end.
    pub(super) fn handle_signal(&mut self, told: SignalEvent, line: &TerminalIo) -> Option<u8> {
        match told {
            SignalEvent::End(status) => Some(status),
            SignalEvent::Resized => {
                self.resizing.note(self.began.elapsed());
                None
            }
            SignalEvent::Stop => self.suspend(StopTarget::Itself, line),
            // It was stopped without being asked: by SIGSTOP.
            SignalEvent::Continue => self.resume(line),
        }
    }

    /// Gives the terminal back, stops, and takes it again when told to go on; the exit status if the
    /// program is to end instead.
    pub(super) fn suspend(&mut self, whom: StopTarget, line: &TerminalIo) -> Option<u8> {
        // It may never go on.
        self.effects.flush(SECURED_WITHIN);
        self.await_answers(&line.input);
        line.tty.suspend();
        let mut stopped = stop(whom).is_ok();
        while stopped {
            match line.signals.recv_timeout(STOPS_WITHIN) {
                Ok(SignalEvent::End(status)) => return Some(status),
                Ok(SignalEvent::Continue) => break,
                Ok(SignalEvent::Resized | SignalEvent::Stop) => {}
                Err(_) => stopped = false,
            }
        }
        let end = self.resume(line);
        if !stopped {
            self.dispatch(Message::Warning("there is no shell to go back to".to_string()));
        }
        end
    }

    /// Takes the terminal, whatever has become of it, and draws everything anew.
    fn resume(&mut self, line: &TerminalIo) -> Option<u8> {
        if line.tty.resume().is_err() {
            return Some(HUNG_UP);
        }
        self.resize();
        None
    }

    /// The terminal may have another size; what it shows is not known.
    pub(super) fn resize(&mut self) {
        self.resizing = ResizeDebounce::default();
        self.frames.forget();
        // Whether there is a terminal at all the next frame will tell.
        let screen = size().unwrap_or(self.model.screen);
        self.dispatch(Message::Resize(screen));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_storm_of_sizes_counts_once_it_is_over_or_has_been_long() {
        let ms = Duration::from_millis;
        let mut resizing = ResizeDebounce::default();
        assert_eq!(resizing.due(), None);
        resizing.note(ms(1000));
        assert_eq!(resizing.due(), Some(ms(1090)));
        resizing.note(ms(1080));
        assert_eq!(resizing.due(), Some(ms(1170)));
        (0..100).for_each(|i| resizing.note(ms(1080 + 10 * i)));
        assert_eq!(resizing.due(), Some(ms(1400)));
    }
}
