//! Job control by the shell, resizing, and loss of the terminal.

use crate::dashboard::Message;
use crate::dashboard::run::event_loop::Dashboard;
use crossbeam_channel::Receiver;
use rustix::process::{Signal, getpid, kill_current_process_group, kill_process};
use std::sync::Arc;
use std::time::Duration;
use std::{io, thread};
use zerkalo_terminal::{
    HUNG_UP, SignalEvent, SignalQueue, Signals, TimedEvent, Tty, cell_px, size,
};

/// Grace period after a terminating signal, at whose end the program exits in any case.
pub const PATIENCE: Duration = Duration::from_secs(5);

/// Longest time from a terminating signal to the end of the dashboard. In the rest of the grace
/// period the program reports where unsaved edits are kept.
pub const ENDED_WITHIN: Duration = Duration::from_secs(4);

/// Time for which the terminal's size must stay unchanged before its last change takes effect.
const SETTLED: Duration = Duration::from_millis(90);
/// Longest time from the first of successive changes of the terminal's size until the last takes
/// effect.
const LONGEST: Duration = Duration::from_millis(400);
/// Longest wait for the write of the recovery file before the program is suspended.
const SECURED_WITHIN: Duration = Duration::from_secs(2);
/// Longest wait for a stop signal to stop the process. If it still runs then, the program resumes.
const STOPS_WITHIN: Duration = Duration::from_millis(500);

/// Terminal, and the receivers of its events.
#[derive(Clone)]
pub(super) struct TerminalIo {
    pub tty: Arc<Tty>,
    pub input: Receiver<TimedEvent>,
    pub signals: Receiver<SignalEvent>,
    /// Notification that the terminal has been restored for good, for example after a panic.
    pub left: Receiver<()>,
}

/// Debounce of changes of the terminal's size: the times of the first and of the last change.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ResizeDebounce(Option<(Duration, Duration)>);

impl ResizeDebounce {
    pub fn note(&mut self, now: Duration) {
        let first = self.0.map_or(now, |(first, _)| first);
        self.0 = Some((first, now));
    }

    /// Returns the time at which a pending change takes effect.
    pub fn due(&self) -> Option<Duration> {
        self.0.map(|(first, last)| (last + SETTLED).min(first + LONGEST))
    }
}

/// Handles signals. If the program is still running when `patience` has passed after a terminating
/// signal, restores the terminal and ends the program.
pub fn handle_signals(
    queue: SignalQueue,
    tty: Arc<Tty>,
    patience: Duration,
) -> io::Result<Signals> {
    queue.handle(move |status| {
        thread::sleep(patience);
        tty.leave();
        std::process::exit(status.into());
    })
}

/// Stops this process by SIGTTIN, because SIGTSTP has a handler. The process may still run for a
/// moment. The kernel ignores SIGTTIN in orphaned process groups, which no shell could continue.
pub fn stop_process() -> rustix::io::Result<()> {
    kill_process(getpid(), Signal::TTIN)
}

/// Stops the whole process group by the signal of [`stop_process`], as Ctrl-Z in a shell would.
pub fn stop_group() -> rustix::io::Result<()> {
    kill_current_process_group(Signal::TTIN)
}

impl Dashboard {
    /// Handles a signal. Returns the exit status if the program is to end.
    pub(super) fn handle_signal(&mut self, event: SignalEvent) -> Option<u8> {
        match event {
            SignalEvent::End(status) => Some(status),
            SignalEvent::Resized => {
                self.resizing.note(self.began.elapsed());
                None
            }
            SignalEvent::Stop => self.suspend(stop_process),
            // After a SIGSTOP, which has no handler, the terminal is set up again.
            SignalEvent::Continue => self.resume(),
        }
    }

    /// Restores the terminal and stops the process by `stop`, until the shell continues it. Returns
    /// the exit status if the program is to end instead.
    pub(super) fn suspend(&mut self, stop: fn() -> rustix::io::Result<()>) -> Option<u8> {
        // Unsaved edits are written first, because the program may never be resumed.
        self.effects.flush(SECURED_WITHIN);
        self.suspend_terminal();
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

    /// Sets up the terminal again and redraws the screen. Returns the exit status if the terminal
    /// is gone.
    fn resume(&mut self) -> Option<u8> {
        if self.terminal_io.tty.resume().is_err() {
            return Some(HUNG_UP);
        }
        self.resize();
        None
    }

    pub(super) fn resize(&mut self) {
        self.resizing = ResizeDebounce::default();
        self.frames.forget();
        // If the terminal is lost, the write of the next frame fails.
        let screen = size().unwrap_or(self.model.screen);
        // The user may have changed the size of cells.
        self.frames.terminal.cell_px = cell_px().or(self.frames.terminal.cell_px);
        self.dispatch(Message::Terminal(Box::new(self.frames.terminal.clone())));
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
