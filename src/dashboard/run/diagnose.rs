//! Diagnostics of the terminal and its connection, without visible output.

use crate::dashboard::run::job_control::handle_signals;
use std::io;
use std::time::Duration;
use zerkalo_terminal::flow::{InitialLink, PacingMode, TcpSendQueue};
use zerkalo_terminal::{
    Capabilities, Environment, InputReader, Screen, SignalQueue, cell_px, query_capabilities,
    query_passthrough, size,
};

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
/// # Errors
/// Fails if there is no terminal, or the terminal is closed during the query.
pub fn diagnose(environment: Environment) -> io::Result<TerminalReport> {
    // The alternate screen hides text that a terminal prints for requests that it does not know.
    let signals = SignalQueue::of_terminal()?;
    let screen = Screen::enter()?;
    let tty = screen.tty.clone();
    handle_signals(signals, screen.tty.clone(), Duration::ZERO)?;
    let mut input = InputReader::new(&environment);
    let mut terminal = query_capabilities(&tty, &mut input, environment, &|_| false)?;
    if terminal.passthrough.is_none() {
        query_passthrough(&tty, &mut input, &mut terminal, &|_| false)?;
    }
    let queue = terminal.environment.ssh.as_deref().and_then(TcpSendQueue::find);
    let mode = InitialLink::of(&terminal, queue.is_some(), None).mode;
    terminal.cell_px = cell_px().or(terminal.cell_px);
    Ok(TerminalReport { terminal, mode, cells: size()? })
}
