//! Query of the terminal's capabilities (colours, graphics protocols, sizes), before the first
//! frame.
//!
//! All requests are sent in one write, and terminals reply in the order of the requests. The last
//! request is for the device attributes, to which every terminal replies. The reply to it ends the
//! query. A reply that arrives after the timeout is still decoded as a reply and not as keys.

use crate::capabilities::{Capabilities, Environment, Multiplexer};
use crate::cells::Colors;
use crate::input_reader::{InputReader, TimedEvent};
use crate::screen::Tty;
use crate::{Event, Reply};
use std::io;
use std::time::{Duration, Instant};

/// Longest wait for the terminal's replies to capability requests.
const PATIENCE: Duration = Duration::from_secs(1);
/// Longest wait for the terminal's replies to capability requests over SSH.
const PATIENCE_OVER_SSH: Duration = Duration::from_secs(2);

/// Interval at which the capability query checks if it should stop.
const CHECK_INTERVAL: Duration = Duration::from_millis(50);

/// Request of the device attributes (DA1), to which every terminal replies.
const ATTRIBUTES: &str = "\x1b[c";
/// Requests of the capability query, in this order:
/// - a 24-bit colour is set, the current colour is requested (DECRQSS), and the default is restored
/// - name and version of the terminal (XTVERSION)
/// - background colour (OSC 11)
/// - support of synchronised updates (mode 2026)
/// - test of kitty's graphics protocol by an image that is not shown
/// - largest number of colours of a sixel image
/// - largest width and height of a sixel image
/// - width and height of a cell in pixels
const REQUESTS: &str = "\x1b[48;2;1;2;3m\x1bP$qm\x1b\\\x1b[0m\x1b[>q\x1b]11;?\x1b\\\x1b[?2026$p\
                         \x1b_Gi=31,s=1,v=1,a=q,t=d,f=24;AAAA\x1b\\\x1b[?1;1;0S\x1b[?2;1;0S\x1b[16t";
/// Requests that tmux passes on to the terminal outside of tmux. The first tests kitty's graphics
/// protocol by an image that is not shown. The second is for the name and version of the terminal.
const REQUESTS_THROUGH_TMUX: &str = "\x1bPtmux;\x1b\x1b_Gi=31,s=1,v=1,a=q,t=d,f=24;AAAA\x1b\x1b\\\x1b\\\
                                      \x1bPtmux;\x1b\x1b[>q\x1b\\";
/// First version of the terminal kitty that supports Unicode placeholders: `[major, minor]`.
const PLACEHOLDERS_SINCE: [u32; 2] = [0, 28];
/// Forms in which terminals with 24-bit colour report red 1, green 2, blue 3 in a reply to DECRQSS.
const TRUE_COLOR: [&str; 3] = ["2::1:2:3", "2:1:2:3", "2;1;2;3"];
/// Number of the terminal's private mode for synchronised updates.
const SYNCHRONISED: u16 = 2026;

/// Returns the request of the cursor position. A terminal replies when it has processed all earlier
/// bytes. If `through` is a multiplexer, the request is wrapped, so that the multiplexer passes it
/// on. The terminal outside of the multiplexer then replies.
pub fn cursor_request(through: Option<Multiplexer>) -> &'static str {
    match through {
        None => "\x1b[6n",
        Some(Multiplexer::Tmux) => "\x1bPtmux;\x1b\x1b[6n\x1b\\",
        Some(Multiplexer::Screen) => "\x1bP\x1b[6n\x1b\\",
    }
}

/// Queries the capabilities of the terminal. This takes about one round trip, or two inside of a
/// multiplexer over SSH. Keys that are pressed during the query are kept in `input`. `is_ending`
/// returns `true` if the query should stop.
///
/// Inside of a local tmux, some requests are passed on to the terminal outside of tmux. The query
/// does not wait for the replies of this outer terminal, because it may never reply. If such a
/// reply arrives after the query, the caller passes it to [`Capabilities::learn`].
///
/// # Errors
/// Fails if the terminal is closed.
pub fn query_capabilities(
    tty: &Tty,
    input: &mut InputReader,
    environment: Environment,
    is_ending: &dyn Fn() -> bool,
) -> io::Result<Capabilities> {
    let patience = if environment.ssh.is_some() { PATIENCE_OVER_SSH } else { PATIENCE };
    let mut capabilities = Capabilities::from_environment(environment);
    let sent_at = Instant::now();
    let is_minimal =
        ["linux", "vt"].iter().any(|term| capabilities.environment.term.starts_with(term));
    let through = match capabilities.environment.multiplexer {
        Some(Multiplexer::Tmux) => REQUESTS_THROUGH_TMUX,
        _ => "",
    };
    let requests = if is_minimal { "" } else { REQUESTS };
    tty.write([through, requests, ATTRIBUTES].concat().as_bytes())?;
    listen(input, sent_at + patience, is_ending, |at, reply| {
        capabilities.round_trip.get_or_insert(at.saturating_duration_since(sent_at));
        capabilities.learn(reply);
        matches!(reply, Reply::Attributes(_))
    })?;
    if let (Some(_), Some(multiplexer)) =
        (&capabilities.environment.ssh, capabilities.environment.multiplexer)
    {
        let sent_at = Instant::now();
        tty.write(cursor_request(Some(multiplexer)).as_bytes())?;
        listen(input, sent_at + PATIENCE, is_ending, |at, reply| {
            capabilities.learn(reply);
            let is_reply = matches!(reply, Reply::Cursor { .. });
            if is_reply {
                capabilities.passthrough = Some(at.saturating_duration_since(sent_at));
            }
            is_reply
        })?;
    }
    Ok(capabilities)
}

/// Passes the terminal's replies to `take`, each with the time of its arrival. Ends when `take`
/// returns `true`, at `deadline`, or when `is_ending` returns `true`. Events other than replies are
/// kept in `input`.
fn listen(
    input: &mut InputReader,
    deadline: Instant,
    is_ending: &dyn Fn() -> bool,
    mut take: impl FnMut(Instant, &Reply) -> bool,
) -> io::Result<()> {
    let mut others = Vec::new();
    let mut done = false;
    while !done && !is_ending() && Instant::now() < deadline {
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
    /// Updates the capabilities according to `reply`, a reply of the terminal to one of the
    /// requests for capabilities.
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
            Reply::Cursor { .. } | Reply::Mode { .. } | Reply::Other => {}
        }
    }
}

/// Returns `true` if the terminal supports kitty's Unicode placeholders. `version` is its name and
/// version, as it reports them.
fn has_placeholders(version: &str) -> bool {
    let kitty = || {
        let numbers = version.strip_prefix("kitty(")?.split(['.', ')']);
        let mut numbers = numbers.map_while(|n| n.parse::<u32>().ok());
        Some([numbers.next()?, numbers.next()?])
    };
    version.starts_with("ghostty") || kitty().is_some_and(|version| version >= PLACEHOLDERS_SINCE)
}
