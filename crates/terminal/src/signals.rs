//! Signals to the process, as events in a channel.

use crossbeam_channel::{Receiver, unbounded};
use signal_hook::consts::{SIGCONT, SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGTSTP, SIGWINCH};
use signal_hook::{flag, iterator};
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU8, Ordering};
use std::thread;

/// Number that is added to the number of a signal to form the exit status, as in shells.
const SIGNALLED: i32 = 128;

/// Exit status after the loss of the terminal, equal to the exit status after SIGHUP.
pub const HUNG_UP: u8 = (SIGNALLED + SIGHUP) as u8;

/// Meaning of a signal for the program.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SignalEvent {
    /// End with this exit status: 128 plus the number of the signal.
    End(u8),
    /// Possible change of the terminal's size.
    Resized,
    /// Suspension until [`SignalEvent::Continue`].
    Stop,
    Continue,
}

/// Signal handlers, which queue signals until [`SignalQueue::handle`].
pub struct SignalQueue(iterator::Signals);

/// Signals that have been handled.
pub struct Signals {
    /// Events in the order of the signals.
    pub events: Receiver<SignalEvent>,
    /// Exit status for the last terminating signal; 0 before the first one.
    status: Arc<AtomicU8>,
}

impl SignalQueue {
    /// Registers handlers of the signals that concern a program in raw mode. Must be called before
    /// raw mode begins: the default handlers would end the program without leaving raw mode.
    pub fn of_terminal() -> io::Result<Self> {
        let signals = [SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGTSTP, SIGCONT, SIGWINCH];
        Ok(Self(iterator::Signals::new(signals)?))
    }

    /// Starts the thread that handles signals. It calls `on_end` for each terminating signal, after
    /// its event has been sent.
    pub fn handle(mut self, mut on_end: impl FnMut(u8) + Send + 'static) -> io::Result<Signals> {
        let (sender, events) = unbounded();
        let signals = Signals { events, status: Arc::default() };
        let last_status = Arc::clone(&signals.status);
        thread::Builder::new().name("signals".into()).spawn(move || {
            for signal in self.0.forever() {
                let event = match signal {
                    SIGWINCH => SignalEvent::Resized,
                    SIGTSTP => SignalEvent::Stop,
                    SIGCONT => SignalEvent::Continue,
                    _ => SignalEvent::End((SIGNALLED + signal) as u8),
                };
                let _ = sender.send(event);
                if let SignalEvent::End(status) = event {
                    last_status.store(status, Ordering::Release);
                    on_end(status);
                }
            }
        })?;
        Ok(signals)
    }
}

impl Signals {
    /// Handles SIGINT and SIGTERM. The first of them is an event, so that the program can save its
    /// results; a second one ends the program at once.
    pub fn catch_end() -> io::Result<Self> {
        // Handlers run in the order of registration. The first queues the signal, so that none is
        // lost during the registration. The second ends the program if `armed` is set. Because the
        // third sets `armed` after that, the first signal does not end the program.
        let queue = SignalQueue(iterator::Signals::new([SIGINT, SIGTERM])?);
        let armed = Arc::new(AtomicBool::new(false));
        for signal in [SIGINT, SIGTERM] {
            flag::register_conditional_shutdown(signal, SIGNALLED + signal, Arc::clone(&armed))?;
            flag::register(signal, Arc::clone(&armed))?;
        }
        queue.handle(|_| ())
    }

    /// Returns the exit status for the last terminating signal; `None` before the first one.
    pub fn caught(&self) -> Option<u8> {
        Some(self.status.load(Ordering::Acquire)).filter(|status| *status != 0)
    }
}
