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

/// Capabilities of the terminal and of its connection, for `zerkalo doctor`.
#[derive(Clone, Debug, PartialEq)]
pub struct TerminalReport {
    pub terminal: Capabilities,
    /// Method by which a dashboard would limit the rate of its output.
    pub mode: PacingMode,
    /// Columns and rows.
    pub cells: [u16; 2],
}

/// Queries the capabilities of the terminal at stdin and stdout.
///
/// # Errors Fails if there is no terminal, or the terminal is closed during the query.
pub fn diagnose(environment: Environment) -> io::Result<TerminalReport> {
    // The alternate screen hides text that a terminal prints for requests that it does not know.
    let signals = SignalQueue::of_terminal()?;
    let screen = Screen::enter()?;
    let tty = screen.tty();
    handle_signals(signals, screen.tty(), Duration::ZERO)?;
    let mut input = InputReader::new(&environment);
    let mut terminal = query_capabilities(&tty, &mut input, environment, &|| false)?;
    if let Some(multiplexer) = terminal.environment.multiplexer
        && terminal.passthrough.is_none()
    {
        terminal.passthrough = round_trip(&tty, &mut input, multiplexer)?;
    }
    let queue = terminal.environment.ssh.as_deref().and_then(TcpSendQueue::find);
    let mode = InitialLink::of(&terminal, queue.is_some(), None).mode;
    terminal.cell_px = cell_px().or(terminal.cell_px);
    Ok(TerminalReport { terminal, mode, cells: size()? })
}

/// Requests the cursor position through `multiplexer`. Returns the time until the reply of the
/// terminal outside, or `None` after [`PATIENCE`].
fn round_trip(
    tty: &Tty,
    input: &mut InputReader,
    multiplexer: Multiplexer,
) -> io::Result<Option<Duration>> {
    let requested_at = Instant::now();
    tty.write(cursor_request(Some(multiplexer)).as_bytes())?;
    loop {
        let events = input.wait(Some(requested_at + PATIENCE))?;
        let is_answer = |event: &Event| matches!(event, Event::Reply(Reply::Cursor { .. }));
        if let Some(answer) = events.iter().find(|event| is_answer(&event.event)) {
            return Ok(Some(answer.at.saturating_duration_since(requested_at)));
        }
        if events.is_empty() {
            return Ok(None);
        }
    }
}
