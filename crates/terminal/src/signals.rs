//! Signals to the process, as events in a channel.

use crossbeam_channel::{Receiver, unbounded};
use nix::unistd::{getpgrp, tcgetpgrp};
use signal_hook::consts::{
    SIGCONT, SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGTSTP, SIGUSR1, SIGWINCH, SIGXCPU, SIGXFSZ,
};
use signal_hook::iterator;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicU8, Ordering};
use std::{fs, thread};

/// Number that is added to the number of a signal to form the exit status, as in shells.
pub(super) const SIGNALLED: i32 = 128;

/// Exit status after the loss of the terminal, equal to the exit status after SIGHUP.
pub const HUNG_UP: u8 = (SIGNALLED + SIGHUP) as u8;
/// Exit status after SIGINT, the signal of Ctrl-C.
pub const INTERRUPTED: u8 = (SIGNALLED + SIGINT) as u8;

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
        let ends = [SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGUSR1, SIGXCPU];
        let others = [SIGTSTP, SIGCONT, SIGWINCH, SIGXFSZ];
        Ok(Self(iterator::Signals::new([&ends[..], &others].concat())?))
    }

    /// Registers handlers of the signals by which users and batch systems end a program that is not
    /// in raw mode. Signals that the parent process ignores stay ignored, as after `nohup`.
    pub fn of_batch_job() -> io::Result<Self> {
        let ignored = ignored_signals();
        let signals = [SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGUSR1, SIGXCPU, SIGXFSZ];
        let handled = signals.into_iter().filter(|signal| ignored >> (signal - 1) & 1 == 0);
        Ok(Self(iterator::Signals::new(handled)?))
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
                    // The write beyond the limit of file sizes fails, as on a full disk.
                    SIGXFSZ => continue,
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
    /// Returns the exit status for the last terminating signal; `None` before the first one.
    pub fn caught(&self) -> Option<u8> {
        Some(self.status.load(Ordering::Acquire)).filter(|status| *status != 0)
    }
}

/// Returns the set of ignored signals: bit `n - 1` is set for signal `n`. Empty on systems without
/// `/proc`.
fn ignored_signals() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let set = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    set.and_then(|set| u64::from_str_radix(set.trim(), 16).ok()).unwrap_or(0)
}

/// Returns `true` if the process receives the keys of a terminal: Ctrl-C sends SIGINT to the
/// foreground process group. A process group of another PID namespace has the ID 0.
pub fn is_in_foreground() -> bool {
    let own = getpgrp();
    let foreground = [tcgetpgrp(io::stdin()), tcgetpgrp(io::stdout()), tcgetpgrp(io::stderr())];
    foreground.into_iter().any(|group| group == Ok(own))
}
