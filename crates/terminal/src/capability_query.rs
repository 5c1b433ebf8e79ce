//! Query of the terminal's capabilities before the first frame.
//!
//! All requests are sent in one write, and terminals reply in the order of the requests. The last
//! request asks for the device attributes. Every terminal replies to it, and this reply ends the
//! query. A later reply is still decoded as a reply and not as keys.

use crate::capabilities::{Capabilities, Environment, Multiplexer};
use crate::cells::Colors;
use crate::input_reader::{InputReader, TimedEvent};
use crate::screen::Tty;
use crate::{Event, Reply};
use std::io;
use std::time::{Duration, Instant};

/// Longest wait for replies.
const PATIENCE: Duration = Duration::from_secs(1);
/// Longest wait for replies over SSH.
const PATIENCE_OVER_SSH: Duration = Duration::from_secs(2);

/// Interval at which the query checks if it should stop.
const CHECK_INTERVAL: Duration = Duration::from_millis(50);

/// Request for the device attributes (DA1), to which every terminal replies.
pub const ATTRIBUTES: &str = "\x1b[c";
/// Requests of the capability query, in this order:
/// - a 24-bit colour is set, the current colour is requested (DECRQSS), and the default is restored
/// - name and version of the terminal (XTVERSION)
/// - background colour (OSC 11)
/// - support of synchronised updates (mode 2026)
/// - largest number of colours of a sixel image
/// - largest width and height of a sixel image
/// - width and height of a cell in pixels
const REQUESTS: &str = "\x1b[48;2;1;2;3m\x1bP$qm\x1b\\\x1b[0m\x1b[>q\x1b]11;?\x1b\\\x1b[?2026$p\
                         \x1b[?1;1;0S\x1b[?2;1;0S\x1b[16t";
/// Test of kitty's graphics protocol by an image that is not shown. A multiplexer would take it for
/// a title.
const GRAPHICS_REQUEST: &str = "\x1b_Gi=31,s=1,v=1,a=q,t=d,f=24;AAAA\x1b\\";
/// Requests that tmux passes on to the terminal: a test of kitty's graphics protocol, and
/// XTVERSION.
const REQUESTS_THROUGH_TMUX: &str = "\x1bPtmux;\x1b\x1b_Gi=31,s=1,v=1,a=q,t=d,f=24;AAAA\x1b\x1b\\\x1b\\\
                                      \x1bPtmux;\x1b\x1b[>q\x1b\\";
/// First version of kitty with Unicode placeholders: `[major, minor]`.
const PLACEHOLDERS_SINCE: [u32; 2] = [0, 28];
/// Forms in which terminals with 24-bit colour report the colour that [`REQUESTS`] sets.
const TRUE_COLOR: [&str; 3] = ["2::1:2:3", "2:1:2:3", "2;1;2;3"];
/// Number of the private mode for synchronised updates.
const SYNCHRONISED: u16 = 2026;

/// Returns the request for the terminal's status (DSR 5), to which every terminal replies when it
/// has processed all earlier bytes. The request is wrapped to pass through the multiplexer
/// `through`.
pub fn status_request(through: Option<Multiplexer>) -> &'static str {
    match through {
        None => "\x1b[5n",
        Some(Multiplexer::Tmux) => "\x1bPtmux;\x1b\x1b[5n\x1b\\",
        Some(Multiplexer::Screen) => "\x1bP\x1b[5n\x1b\\",
    }
}

/// Queries the capabilities, in about one round trip, or two inside a multiplexer over SSH. Keys
/// that are pressed during the query are kept in `input`. `is_ending` returns `true` for events after
/// which the query should stop.
///
/// Inside a local tmux, the query does not wait for the terminal outside tmux, which may never
/// reply. The caller passes a late reply to [`Capabilities::learn`].
///
/// # Errors
/// Fails if the terminal is closed.
pub fn query_capabilities(
    tty: &Tty,
    input: &mut InputReader,
    environment: Environment,
    is_ending: &dyn Fn(&[TimedEvent]) -> bool,
) -> io::Result<Capabilities> {
    let patience = if environment.ssh.is_some() { PATIENCE_OVER_SSH } else { PATIENCE };
    let mut capabilities = Capabilities::from_environment(environment);
    let sent_at = Instant::now();
    let is_minimal =
        ["linux", "vt"].iter().any(|term| capabilities.environment.term.starts_with(term));
    let graphics = match capabilities.environment.multiplexer {
        None if is_minimal => "",
        None => GRAPHICS_REQUEST,
        Some(Multiplexer::Tmux) => REQUESTS_THROUGH_TMUX,
        Some(Multiplexer::Screen) => "",
    };
    let requests = if is_minimal { "" } else { REQUESTS };
    tty.write([graphics, requests, ATTRIBUTES].concat().as_bytes())?;
    listen(input, sent_at + patience, is_ending, |at, reply| {
        capabilities.round_trip.get_or_insert(at.saturating_duration_since(sent_at));
        capabilities.learn(reply);
        matches!(reply, Reply::Attributes(_))
    })?;
    if capabilities.environment.ssh.is_some() {
        query_passthrough(tty, input, &mut capabilities, is_ending)?;
    }
    Ok(capabilities)
}

/// Measures the round trip to the terminal outside the multiplexer, by a request for its status.
/// Does nothing without a multiplexer.
///
/// # Errors
/// Fails if the terminal is closed.
pub fn query_passthrough(
    tty: &Tty,
    input: &mut InputReader,
    capabilities: &mut Capabilities,
    is_ending: &dyn Fn(&[TimedEvent]) -> bool,
) -> io::Result<()> {
    let Some(multiplexer) = capabilities.environment.multiplexer else { return Ok(()) };
    let sent_at = Instant::now();
    tty.write(status_request(Some(multiplexer)).as_bytes())?;
    listen(input, sent_at + PATIENCE, is_ending, |at, reply| {
        capabilities.learn(reply);
        let is_reply = *reply == Reply::Status;
        if is_reply {
            capabilities.passthrough = Some(at.saturating_duration_since(sent_at));
        }
        is_reply
    })
}

/// Passes replies and their times to `take` until it returns `true`, `deadline` has come, or
/// `is_ending` returns `true` for the other events, which are kept in `input`.
fn listen(
    input: &mut InputReader,
    deadline: Instant,
    is_ending: &dyn Fn(&[TimedEvent]) -> bool,
    mut take: impl FnMut(Instant, &Reply) -> bool,
) -> io::Result<()> {
    let mut others = Vec::new();
    let mut done = false;
    while !done && !is_ending(&others) && Instant::now() < deadline {
        let events = input.wait(Some(deadline.min(Instant::now() + CHECK_INTERVAL)))?;
        for TimedEvent { at, event } in events {
            match event {
                Event::Reply(reply) => done |= take(at, &reply),
                event => others.push(TimedEvent { at, event }),
            }
        }
    }
    input.early.extend(others);
    Ok(())
}

impl Capabilities {
    /// Updates the capabilities from a reply.
    pub fn learn(&mut self, reply: &Reply) {
        match reply {
            Reply::Attributes(attributes) => {
                self.sixel = attributes.iter().skip(1).any(|a| *a == 4)
            }
            Reply::Mode { mode: SYNCHRONISED, setting } => {
                self.synchronised = [1, 2, 3].contains(setting);
            }
            Reply::Background(rgb) => self.background = Some(*rgb),
            Reply::Version(version) => {
                let is_behind_tmux = self.environment.multiplexer == Some(Multiplexer::Tmux)
                    && !version.starts_with("tmux");
                if is_behind_tmux {
                    self.placeholders = has_placeholders(version);
                } else {
                    self.version = Some(version.clone());
                }
            }
            Reply::Setting(setting) => {
                let is_true = TRUE_COLOR.iter().any(|form| setting.contains(form));
                if is_true && self.colors == Colors::Indexed {
                    self.colors = Colors::True;
                }
            }
            Reply::Graphics(ok) => self.kitty_graphics = *ok,
            Reply::SixelColors(colors) => self.sixel_colors = Some(*colors),
            Reply::SixelSize(size) => self.sixel_px = Some(*size).filter(|px| !px.contains(&0)),
            Reply::CellSize(size) => self.cell_px = Some(*size).filter(|px| !px.contains(&0)),
            Reply::Status | Reply::Mode { .. } | Reply::Other => {}
        }
    }
}

/// Returns `true` if a terminal of this name and version supports Unicode placeholders.
fn has_placeholders(version: &str) -> bool {
    let kitty = || {
        let numbers = version.strip_prefix("kitty(")?.split(['.', ')']);
        let mut numbers = numbers.map_while(|n| n.parse::<u32>().ok());
        Some([numbers.next()?, numbers.next()?])
    };
    version.starts_with("ghostty") || kitty().is_some_and(|version| version >= PLACEHOLDERS_SINCE)
}
