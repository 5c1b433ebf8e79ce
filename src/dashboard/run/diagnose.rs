//! Diagnostics of the terminal and its connection, without visible output.

use crate::dashboard::run::job_control::handle_signals;
use std::io;
use std::time::{Duration, Instant};
use zerkalo_terminal::flow::{InitialLink, PacingMode, TcpSendQueue};
use zerkalo_terminal::{
    Capabilities, Environment, Event, InputReader, Multiplexer, Reply, Screen, SignalQueue, Tty,
    cell_px, cursor_request, query_capabilities, size,
};

/// Timeout for a reply to a request that the terminal may not support.
const PATIENCE: Duration = Duration::from_secs(1);
/// Timeout for a reply from a terminal that has replied before.
const LONG_PATIENCE: Duration = Duration::from_secs(10);
/// Shortest duration of a test transfer, round trip excluded, that gives a precise rate.
const MEASURED: Duration = Duration::from_millis(300);
/// Number of bytes of the largest test transfer.
const MOST_BYTES: usize = 1 << 20;

/// Capabilities of the terminal and of its connection, for `zerkalo doctor`.
#[derive(Clone, Debug, PartialEq)]
pub struct TerminalReport {
    pub terminal: Capabilities,
    /// Method by which a dashboard would limit the rate of its output.
    pub mode: PacingMode,
    /// Columns and rows.
    pub cells: [u16; 2],
    /// Measured transfer rate in bytes per second. `None` if it was not requested or cannot be
    /// measured.
    pub rate: Option<f64>,
}

/// Queries the capabilities of the terminal at stdin and stdout. If `measure` is `true`, also
/// measures the transfer rate, which takes a second or more.
///
/// # Errors Fails if there is no terminal, or the terminal is closed during the query.
pub fn diagnose(environment: Environment, measure: bool) -> io::Result<TerminalReport> {
    // The alternate screen hides text that a terminal prints for requests that it does not know.
    let signals = SignalQueue::of_terminal()?;
    let screen = Screen::enter()?;
    let tty = screen.tty();
    handle_signals(signals, screen.tty(), Duration::ZERO)?;
    let mut input = InputReader::new(&environment);
    let mut terminal = query_capabilities(&tty, &mut input, environment, &|| false)?;
    let multiplexer = terminal.environment.multiplexer;
    if multiplexer.is_some() && terminal.passthrough.is_none() {
        terminal.passthrough = answer(&tty, &mut input, multiplexer, &[], PATIENCE)?;
    }
    let queue = terminal.environment.ssh.as_deref().and_then(TcpSendQueue::find);
    let mode = InitialLink::of(&terminal, queue.is_some(), None).mode;
    // Without a wrapper, a multiplexer would reply itself. `through` is `None` if no transfer can
    // be measured.
    let through = match mode {
        PacingMode::Unlimited => Some(None),
        PacingMode::AckClocked(through) => Some(through),
        PacingMode::SendQueue | PacingMode::FixedRate => None,
    };
    let round_trip = match through {
        Some(Some(_)) => terminal.passthrough,
        _ => terminal.round_trip,
    };
    let rate = match (through, round_trip) {
        (Some(through), Some(round_trip)) if measure => {
            rate(&tty, &mut input, through, round_trip)?
        }
        _ => None,
    };
    terminal.cell_px = cell_px().or(terminal.cell_px);
    let cells = size()?;
    Ok(TerminalReport { terminal, mode, cells, rate })
}

/// Writes `before` and a request of the cursor position, wrapped for the multiplexer `through`.
/// Returns the time until the reply, or `None` after `patience`.
fn answer(
    tty: &Tty,
    input: &mut InputReader,
    through: Option<Multiplexer>,
    before: &[u8],
    patience: Duration,
) -> io::Result<Option<Duration>> {
    let requested_at = Instant::now();
    tty.write(&[before, cursor_request(through).as_bytes()].concat())?;
    loop {
        let events = input.wait(Some(requested_at + patience))?;
        let is_answer = |event: &Event| matches!(event, Event::Reply(Reply::Cursor { .. }));
        if let Some(answer) = events.iter().find(|event| is_answer(&event.event)) {
            return Ok(Some(answer.at.saturating_duration_since(requested_at)));
        }
        if events.is_empty() {
            return Ok(None);
        }
    }
}

/// Measures the transfer rate in bytes per second by larger and larger transfers. `round_trip` is
/// the time of a request without a transfer. Returns `None` if a reply does not arrive.
fn rate(
    tty: &Tty,
    input: &mut InputReader,
    through: Option<Multiplexer>,
    round_trip: Duration,
) -> io::Result<Option<f64>> {
    let mut bytes = 1 << 12;
    loop {
        let text = hidden_text(bytes);
        let Some(took) = answer(tty, input, through, &text, LONG_PATIENCE)? else {
            return Ok(None);
        };
        let span = took.saturating_sub(round_trip);
        if span >= MEASURED || bytes >= MOST_BYTES {
            let seconds = span.max(Duration::from_millis(1)).as_secs_f64();
            return Ok(Some(text.len() as f64 / seconds));
        }
        bytes *= 4;
    }
}

/// Returns escape sequences that hide text, followed by `bytes` pseudo-random characters, which SSH
/// cannot compress.
fn hidden_text(bytes: usize) -> Vec<u8> {
    let mut text = b"\x1b[8m\x1b[H".to_vec();
    let mut state = 0x9e37_79b9_7f4a_7c15_u64;
    for _ in 0..bytes {
        // xorshift64 (Marsaglia 2003).
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        text.push(b'!' + (state % 94) as u8);
    }
    text.extend(b"\x1b[0m");
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn measurement_text_has_no_control_characters() {
        let text = hidden_text(4096);
        let inner = text.strip_prefix(b"\x1b[8m\x1b[H").unwrap().strip_suffix(b"\x1b[0m").unwrap();
        assert_eq!(inner.len(), 4096);
        assert!(inner.iter().all(u8::is_ascii_graphic));
    }
}
