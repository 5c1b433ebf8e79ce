//! Thread pool for tracing, with a lower priority if requested.

use std::fmt::Display;
use std::io;

/// Creates a pool of `threads` threads (0: one per processor). A `niceness` above 0 lowers their
/// priority, on Linux; with 19 they hardly run while other programs need the processors. Returns an
/// error for the user if a thread cannot be started.
pub(super) fn pool(threads: usize, niceness: i32) -> io::Result<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|i| format!("tracer {i}"))
        .start_handler(move |_| lower_priority(niceness))
        .build()
        .map_err(|error| error_of(threads, error))
}

pub(super) fn error_of(threads: usize, error: impl Display) -> io::Error {
    io::Error::other(format!("cannot start {threads} threads: {error}; try fewer by --threads"))
}

#[cfg(target_os = "linux")]
fn lower_priority(niceness: i32) {
    if niceness > 0 {
        // Without the necessary permission the threads keep their priority.
        let _ = rustix::process::setpriority_process(None, niceness.min(19));
    }
}

#[cfg(not(target_os = "linux"))]
fn lower_priority(_: i32) {}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    #[test]
    fn niceness_applies_to_the_threads_of_the_pool_only() {
        let inherited = rustix::process::getpriority_process(None).unwrap();
        let requested = (inherited + 3).min(19);
        let pool = super::pool(2, requested).unwrap();
        let nice = pool.broadcast(|_| rustix::process::getpriority_process(None).unwrap());
        assert_eq!(nice, [requested; 2]);
        assert_eq!(rustix::process::getpriority_process(None).unwrap(), inherited);
    }
}
