//! Run-queue delay: the time for which threads of this program were ready to run but waited for a
//! processor. A long delay shows that other programs disturbed a measurement. Linux reports the
//! delay of each thread (`/proc/PID/task/TID/schedstat`). On other systems it is unknown.

use std::collections::HashMap;
use std::fs;
use std::time::Duration;

/// Run-queue delay of each thread, by its system's id, since its start.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunQueueDelay(HashMap<String, Duration>);

impl RunQueueDelay {
    /// Reads the delays of all threads. Returns `None` on systems that do not report them.
    pub fn now() -> Option<Self> {
        let mut all = HashMap::new();
        for task in fs::read_dir("/proc/self/task").ok()?.flatten() {
            // The read fails if the thread has ended meanwhile.
            let Ok(text) = fs::read_to_string(task.path().join("schedstat")) else { continue };
            all.insert(task.file_name().to_string_lossy().into_owned(), parse_delay(&text)?);
        }
        (!all.is_empty()).then_some(Self(all))
    }

    /// Returns the seconds that all threads together have waited since `before`.
    pub fn seconds_since(&self, before: &Self) -> f64 {
        let since = |(thread, now): (&String, &Duration)| {
            now.saturating_sub(before.0.get(thread).copied().unwrap_or_default())
        };
        self.0.iter().map(since).sum::<Duration>().as_secs_f64()
    }
}

/// Parses a file `schedstat`: nanoseconds run, nanoseconds waited, number of times scheduled.
fn parse_delay(schedstat: &str) -> Option<Duration> {
    schedstat.split_whitespace().nth(1)?.parse().ok().map(Duration::from_nanos)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn delays(threads: &[(&str, u64)]) -> RunQueueDelay {
        RunQueueDelay(
            threads.iter().map(|(t, s)| (t.to_string(), Duration::from_secs(*s))).collect(),
        )
    }

    #[test]
    fn delay_counts_new_threads_and_ignores_ended_ones() {
        let before = delays(&[("1", 5), ("2", 7)]);
        let after = delays(&[("1", 6), ("3", 2)]);
        assert_eq!(after.seconds_since(&before), 3.0);
        assert_eq!(before.seconds_since(&before), 0.0);
    }

    #[test]
    fn delay_is_the_second_number() {
        assert_eq!(
            parse_delay("370908324 2628202197 104\n"),
            Some(Duration::from_nanos(2_628_202_197))
        );
        assert_eq!(parse_delay(""), None);
        assert_eq!(parse_delay("1 x 2"), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn delays_cover_the_threads_of_this_program() {
        if let Some(now) = RunQueueDelay::now() {
            assert!(now.0.len() >= 2, "the test's own thread and the first one: {now:?}");
        }
    }
}
