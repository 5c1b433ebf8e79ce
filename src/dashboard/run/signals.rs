//! Handling of signals that end, stop or continue the program, and of the signal that the terminal
//! was resized. After a terminating signal the dashboard has a grace period to end by itself.

use crossbeam_channel::{Receiver, unbounded};
use rustix::process::{Signal, getpid, kill_current_process_group, kill_process};
use signal_hook::consts::{SIGCONT, SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGTSTP, SIGWINCH};
use signal_hook::iterator;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;
use zerkalo_terminal::Tty;

/// Grace period after a terminating signal. If the dashboard has not ended by then, the thread that
/// handles signals restores the terminal and ends the program.
pub(super) const PATIENCE: Duration = Duration::from_secs(5);

/// Longest time from a terminating signal to the end of the dashboard, even if the renderer is
/// busy. It is so much shorter than the grace period that the program can still report where
/// unsaved edits are kept.
pub(super) const ENDED_WITHIN: Duration = Duration::from_secs(4);

/// Number that is added to the number of a signal to form the exit status, as in shells.
const SIGNALLED: i32 = 128;

/// Exit status after the loss of the terminal, equal to that of SIGHUP.
pub(super) const HUNG_UP: u8 = (SIGNALLED + SIGHUP) as u8;

/// Meaning of a signal for the event loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SignalEvent {
    /// End of the program with this exit status: 128 plus the number of the terminating signal.
    End(u8),
    /// Possible change of the terminal's size (SIGWINCH).
    Resized,
    /// Suspension of the program until it is continued (SIGTSTP).
    Stop,
    /// Continuation of the program after a suspension (SIGCONT).
    Continue,
}

/// Signals to the process, as events.
pub(super) struct Signals {
    /// Receiver of the signal events, in the order of the signals.
    pub events: Receiver<SignalEvent>,
    /// `true` after a terminating signal has arrived.
    ending: Arc<AtomicBool>,
}

impl Signals {
    /// Returns `true` if a terminating signal has arrived.
    pub fn is_ending(&self) -> bool {
        self.ending.load(Ordering::Acquire)
    }
}

/// Registers signal handlers, which queue signals until [`watch`] handles them. Must be called
/// before the terminal enters raw mode, because the default handlers would end the program and
/// leave the terminal in raw mode.
pub(super) fn block() -> io::Result<iterator::Signals> {
    iterator::Signals::new([SIGHUP, SIGINT, SIGQUIT, SIGTERM, SIGTSTP, SIGCONT, SIGWINCH])
}

/// Starts the thread that handles signals. If the program is still running when `patience` has
/// passed after a terminating signal, the thread restores the terminal and ends the program.
pub(super) fn watch(
    mut signals: iterator::Signals,
    tty: Arc<Tty>,
    patience: Duration,
) -> io::Result<Signals> {
    let (sender, events) = unbounded();
    let ending = Arc::new(AtomicBool::new(false));
    let ending_flag = Arc::clone(&ending);
    thread::Builder::new().name("signals".into()).spawn(move || {
        for signal in signals.forever() {
            let event = match signal {
                SIGWINCH => SignalEvent::Resized,
                SIGTSTP => SignalEvent::Stop,
                SIGCONT => SignalEvent::Continue,
                _ => SignalEvent::End((SIGNALLED + signal) as u8),
            };
            // Sending fails only at the end of the program, when the receiver is gone.
            let _ = sender.send(event);
            ending_flag.fetch_or(matches!(event, SignalEvent::End(_)), Ordering::Release);
            if let SignalEvent::End(status) = event {
                thread::sleep(patience);
                tty.leave();
                std::process::exit(status.into());
            }
        }
    })?;
    Ok(Signals { events, ending })
}

/// Stops this process, which may still run for a moment after this function returns. The signal is
/// SIGTTIN, because SIGTSTP has a handler in this program. Nothing happens if no shell could
/// continue the process: the kernel ignores SIGTTIN in orphaned process groups.
pub(super) fn stop_process() -> rustix::io::Result<()> {
    kill_process(getpid(), Signal::TTIN)
}

/// Stops all processes in the group of this process as [`stop_process`] does. Ctrl-Z in a shell
/// suspends such a group.
pub(super) fn stop_group() -> rustix::io::Result<()> {
    kill_current_process_group(Signal::TTIN)
}
