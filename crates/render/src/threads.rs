//! Thread pool for tracing.

use std::fmt::Display;
use std::io;

/// Creates a pool of `threads` threads (0: one per processor). Returns an error for the user if a
/// thread cannot be started.
pub(super) fn pool(threads: usize) -> io::Result<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|i| format!("tracer {i}"))
        .build()
        .map_err(|error| error_of(threads, error))
}

pub(super) fn error_of(threads: usize, error: impl Display) -> io::Error {
    io::Error::other(format!("cannot start {threads} threads: {error}; try fewer by --threads"))
}
