//! Threads that can be joined with a timeout.

use crossbeam_channel::{Receiver, RecvTimeoutError, bounded};
use std::io;
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// Handle of a thread that may wait for a disk or the renderer without end.
pub struct Worker {
    thread: JoinHandle<()>,
    /// Receiver that is disconnected at the end of the thread.
    ended: Receiver<()>,
}

impl Worker {
    pub fn spawn(name: &str, run: impl FnOnce() + Send + 'static) -> io::Result<Self> {
        let (running, ended) = bounded(0);
        let thread = thread::Builder::new().name(name.into()).spawn(move || {
            let _running = running;
            run();
        })?;
        Ok(Self { thread, ended })
    }

    /// Waits for the end of the thread, at most for `patience`, without limit for `Duration::MAX`.
    /// Returns `true` if it has ended, and propagates its panic.
    pub fn join_within(self, patience: Duration) -> bool {
        if self.ended.recv_timeout(patience) == Err(RecvTimeoutError::Timeout) {
            return false;
        }
        match self.thread.join() {
            Err(panic) if !thread::panicking() => std::panic::resume_unwind(panic),
            _ => true,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crossbeam_channel::unbounded;

    #[test]
    fn wait_for_a_thread_is_limited() {
        let (sender, receiver) = unbounded::<()>();
        let run = move || assert!(receiver.recv().is_err());
        let worker = Worker::spawn("blocked", run.clone()).unwrap();
        assert!(!worker.join_within(Duration::from_millis(1)));
        let worker = Worker::spawn("released", run).unwrap();
        drop(sender);
        assert!(worker.join_within(Duration::MAX));
    }
}
