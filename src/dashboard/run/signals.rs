//! Signals that end the program, with a grace period for the dashboard, and signals for resizing,
//! stopping and continuing.

use crate::terminal::Tty;
use crossbeam_channel::{Receiver, unbounded};
use rustix::process::{Signal, getpid, kill_current_process_group, kill_process};
use signal_hook::consts::{SIGCONT, SIGHUP, SIGINT, SIGTERM, SIGTSTP, SIGWINCH};
use signal_hook::iterator;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::Duration;

/// Grace period after a signal that ends the program.
pub(super) const PATIENCE: Duration = Duration::from_secs(5);

/// Offset between a signal's number and the exit status in shells.
const SIGNALLED: i32 = 128;

/// Exit status after losing the terminal, as for SIGHUP.
pub(super) const HUNG_UP: u8 = (SIGNALLED + SIGHUP) as u8;

/// Meaning of a signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum SignalEvent {
    /// Terminate with this exit status: 129, 130 or 143.
    End(u8),
    /// The terminal may have a new size.
    Resized,
    /// Stop until continued.
    Stop,
    /// Continue.
    Continue,
}

/// Stream of signal events.
pub(super) struct Signals {
    /// Events in order.
    pub events: Receiver<SignalEvent>,
    /// A terminating signal has arrived.
    ending: Arc<AtomicBool>,
}

impl Signals {
    /// Returns `true` if a terminating signal has arrived.
    pub fn is_ending(&self) -> bool {
        self.ending.load(Ordering::Acquire)
    }
}

/// Processes to stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum StopTarget {
    /// This process.
    Itself,
    /// The process group, as for Ctrl-Z in a shell.
    Group,
}

/// Registers handlers, which queue signals until [`watch`]. To be called before the terminal is
/// taken, because a default handler would not restore it.
pub(super) fn block() -> io::Result<iterator::Signals> {
    iterator::Signals::new([SIGHUP, SIGINT, SIGTERM, SIGTSTP, SIGCONT, SIGWINCH])
}

/// Starts the thread that handles signals. If the program is still running `patience` after a
/// terminating signal, the thread restores the terminal and exits.
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
            // At the end of the program the receiver is gone.
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

/// Stops the processes; the stop may take effect with a delay. It has no effect without a shell
/// that could continue them: the kernel ignores every stop signal but SIGSTOP for orphaned process
/// groups. SIGTSTP has a handler here, so SIGTTIN is sent.
pub(super) fn stop(target: StopTarget) -> io::Result<()> {
    match target {
        StopTarget::Itself => kill_process(getpid(), Signal::TTIN)?,
        StopTarget::Group => kill_current_process_group(Signal::TTIN)?,
    }
    Ok(())
}
