//! Job control by the shell (suspend and resume), resizing, and loss of the terminal.

use crate::dashboard::message::Message;
use crate::dashboard::run::Dashboard;
use crate::dashboard::run::signals::{HUNG_UP, SignalEvent, stop_process};
use crossbeam_channel::Receiver;
use std::io;
use std::sync::Arc;
use std::time::Duration;
use zerkalo_terminal::{TimedEvent, Tty, size};

/// Time for which the terminal's size must stay unchanged before its last change takes effect.
const SETTLED: Duration = Duration::from_millis(90);
/// Longest delay of changes of the terminal's size, measured from the first of several changes.
const LONGEST: Duration = Duration::from_millis(400);
/// Longest wait for the write of the recovery file before the program is suspended.
const SECURED_WITHIN: Duration = Duration::from_secs(2);
/// Longest wait until the stop signal has stopped the process. If the process has not stopped by
/// then, the program resumes.
const STOPS_WITHIN: Duration = Duration::from_millis(500);

/// Terminal, and the receivers of its events.
#[derive(Clone)]
pub(super) struct TerminalIo {
    /// Terminal, for output.
    pub tty: Arc<Tty>,
    /// Receiver of the terminal's input events.
    pub input: Receiver<io::Result<TimedEvent>>,
    /// Receiver of signals to the process.
    pub signals: Receiver<SignalEvent>,
    /// Receiver of the notification that the terminal has been restored and will not be set up
    /// again, for example because of a panic.
    pub left: Receiver<()>,
}

/// Debounce of changes of the terminal's size: several changes in quick succession take effect
/// once. The fields are the times of the first and of the last of these changes. `None` if no
/// change is pending.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ResizeDebounce(Option<(Duration, Duration)>);

impl ResizeDebounce {
    /// Records a change of the terminal's size at time `now`.
    pub fn note(&mut self, now: Duration) {
        let first = self.0.map_or(now, |(first, _)| first);
        self.0 = Some((first, now));
    }

    /// Returns the time at which a pending change of the terminal's size takes effect. Returns
    /// `None` if no change is pending.
    pub fn due(&self) -> Option<Duration> {
        self.0.map(|(first, last)| (last + SETTLED).min(first + LONGEST))
    }
}

impl Dashboard {
    /// Handles a signal. Returns the exit status if the program is to end, otherwise `None`.
    pub(super) fn handle_signal(&mut self, event: SignalEvent) -> Option<u8> {
        match event {
            SignalEvent::End(status) => Some(status),
            SignalEvent::Resized => {
                self.resizing.note(self.began.elapsed());
                None
            }
            SignalEvent::Stop => self.suspend(stop_process),
            // The process may have been stopped by SIGSTOP, which it cannot handle. The terminal is
            // therefore set up again.
            SignalEvent::Continue => self.resume(),
        }
    }

    /// Restores the terminal and stops the process by `stop`. Sets up the terminal again when the
    /// shell continues the process. Returns the exit status if the program is to end instead,
    /// otherwise `None`.
    pub(super) fn suspend(&mut self, stop: fn() -> rustix::io::Result<()>) -> Option<u8> {
        // Unsaved edits are written first, because the program may never be resumed.
        self.effects.flush(SECURED_WITHIN);
        self.await_answers();
        self.terminal_io.tty.suspend();
        let mut stopped = stop().is_ok();
        while stopped {
            match self.terminal_io.signals.recv_timeout(STOPS_WITHIN) {
                Ok(SignalEvent::End(status)) => return Some(status),
                Ok(SignalEvent::Continue) => break,
                Ok(SignalEvent::Resized | SignalEvent::Stop) => {}
                Err(_) => stopped = false,
            }
        }
        let end = self.resume();
        if !stopped {
            self.dispatch(Message::Warning("there is no shell to go back to".to_string()));
        }
        end
    }

    /// Sets up the terminal again after a suspension and redraws the whole screen. Returns the exit
    /// status [`HUNG_UP`] if the terminal is gone, otherwise `None`.
    fn resume(&mut self) -> Option<u8> {
        if self.terminal_io.tty.resume().is_err() {
            return Some(HUNG_UP);
        }
        self.resize();
        None
    }

    /// Adopts the current terminal size and redraws the whole screen.
    pub(super) fn resize(&mut self) {
        self.resizing = ResizeDebounce::default();
        self.frames.forget();
        // An error of `size` is ignored. If its cause is the loss of the terminal, the write of the
        // next frame fails.
        let screen = size().unwrap_or(self.model.screen);
        self.dispatch(Message::Resize(screen));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn resize_takes_effect_after_pause_or_limit() {
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
