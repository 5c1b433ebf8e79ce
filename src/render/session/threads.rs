//! The pool of threads that trace.

use std::io;

/// A pool of `threads` threads. With a `niceness` above 0 they leave the processor to others: 19 only
/// takes what nobody else wants. On Linux, where threads have priorities of their own; elsewhere, and
/// if it is refused (it cannot rise above that of the process), it has no effect.
pub(super) fn pool(threads: usize, niceness: i32) -> io::Result<rayon::ThreadPool> {
    rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(|i| format!("tracer {i}"))
        .start_handler(move |_| lower_priority(niceness))
        .build()
        .map_err(io::Error::other)
}

#[cfg(target_os = "linux")]
fn lower_priority(niceness: i32) {
    if niceness > 0 {
        // Without the right to do so the threads stay as they are.
        let _ = rustix::process::setpriority_process(None, niceness.min(19));
    }
}

#[cfg(not(target_os = "linux"))]
fn lower_priority(_: i32) {}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    #[test]
    fn threads_are_as_nice_as_asked_for_and_others_stay() {
        let own = rustix::process::getpriority_process(None).unwrap();
        let wanted = (own + 3).min(19);
        let pool = super::pool(2, wanted).unwrap();
        let nice = pool.broadcast(|_| rustix::process::getpriority_process(None).unwrap());
        assert_eq!(nice, [wanted; 2]);
        assert_eq!(rustix::process::getpriority_process(None).unwrap(), own);
    }
}
