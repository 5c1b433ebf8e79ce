//! Result of a check that a test expects to pass or to fail.

/// Result of a check: success, or a description of the failure.
pub type Verdict = Result<(), String>;

/// Returns `Err` with the text of `error` unless `condition` holds.
pub fn ensure(condition: bool, error: impl FnOnce() -> String) -> Verdict {
    if condition { Ok(()) } else { Err(error()) }
}
