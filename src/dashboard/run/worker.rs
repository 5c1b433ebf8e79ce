//! Threads that can be joined with a timeout.

use crossbeam_channel::{Receiver, RecvTimeoutError, bounded};
use std::io;
use std::thread::{self, JoinHandle};
use std::time::Duration;

/// Handle of a thread that may wait indefinitely for a disk or the renderer.
pub struct Worker<T> {
    thread: JoinHandle<T>,
    /// Receiver that is disconnected at the end of the thread.
    ended: Receiver<()>,
}

impl<T: Send + 'static> Worker<T> {
    pub fn spawn(name: &str, run: impl FnOnce() -> T + Send + 'static) -> io::Result<Self> {
        let (running, ended) = bounded(0);
        let thread = thread::Builder::new().name(name.into()).spawn(move || {
            let _running = running;
            run()
        })?;
        Ok(Self { thread, ended })
    }

    /// Waits for the end of the thread, at most for `patience`, without limit for `Duration::MAX`.
    /// Returns the result of the thread, or `None` if it has not ended. Propagates a panic of the
    /// thread.
    pub fn join_within(self, patience: Duration) -> Option<T> {
        if self.ended.recv_timeout(patience) == Err(RecvTimeoutError::Timeout) {
            return None;
        }
        match self.thread.join() {
            Err(panic) if !thread::panicking() => std::panic::resume_unwind(panic),
            result => result.ok(),
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
        assert_eq!(worker.join_within(Duration::from_millis(1)), None);
        let worker = Worker::spawn("released", run).unwrap();
        drop(sender);
        assert_eq!(worker.join_within(Duration::MAX), Some(()));
    }
}
