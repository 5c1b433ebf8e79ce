//! Whether other programs disturbed a measurement: how long this program's threads stood ready and had
//! to wait for a processor. Linux tells that of each thread (`/proc/PID/task/TID/schedstat`); elsewhere
//! nothing is known.

use std::collections::HashMap;
use std::fs;
use std::time::Duration;

/// How long each thread of this program has waited for a processor since it began.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RunQueueDelay(HashMap<String, Duration>);

impl RunQueueDelay {
    /// Until now; `None`: the system does not tell.
    pub fn now() -> Option<Self> {
        let mut all = HashMap::new();
        for task in fs::read_dir("/proc/self/task").ok()?.flatten() {
            // A thread may end meanwhile.
            let Ok(text) = fs::read_to_string(task.path().join("schedstat")) else { continue };
            all.insert(task.file_name().to_string_lossy().into_owned(), waited(&text)?);
        }
        (!all.is_empty()).then_some(Self(all))
    }

    /// Seconds that all threads together have waited since `before`.
    pub fn seconds_since(&self, before: &Self) -> f64 {
        let since = |(thread, now): (&String, &Duration)| {
            now.saturating_sub(before.0.get(thread).copied().unwrap_or_default())
        };
        self.0.iter().map(since).sum::<Duration>().as_secs_f64()
    }
}

/// Out of a line of three numbers: nanoseconds run, nanoseconds waited, times begun.
fn waited(schedstat: &str) -> Option<Duration> {
    schedstat.split_whitespace().nth(1)?.parse().ok().map(Duration::from_nanos)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn waits(of: &[(&str, u64)]) -> RunQueueDelay {
        RunQueueDelay(of.iter().map(|(t, s)| (t.to_string(), Duration::from_secs(*s))).collect())
    }

    #[test]
    fn threads_that_begin_count_and_those_that_end_do_not() {
        let before = waits(&[("1", 5), ("2", 7)]);
        let after = waits(&[("1", 6), ("3", 2)]);
        assert_eq!(after.seconds_since(&before), 3.0);
        assert_eq!(before.seconds_since(&before), 0.0);
    }

    #[test]
    fn the_second_number_is_the_wait() {
        assert_eq!(waited("370908324 2628202197 104\n"), Some(Duration::from_nanos(2_628_202_197)));
        assert_eq!(waited(""), None);
        assert_eq!(waited("1 x 2"), None);
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn this_program_has_threads() {
        if let Some(now) = RunQueueDelay::now() {
            assert!(now.0.len() >= 2, "the test's own thread and the first one: {now:?}");
        }
    }
}
