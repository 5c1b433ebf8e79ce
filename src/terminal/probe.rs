//! Asks the terminal what it can do, once, before anything is shown.
//!
//! All questions go out in one write. The last one, for the device attributes, is answered by every
//! terminal, and terminals answer in order: its answer says that nothing more will come. What comes
//! later than anybody waits for is passed over by whoever reads then.

use crate::terminal::capabilities::{Capabilities, Environment, Multiplexer};
use crate::terminal::cells::Colors;
use crate::terminal::keyboard::{Keyboard, Timed};
use crate::terminal::screen::Tty;
use crate::terminal::{Event, Reply};
use std::io;
use std::time::{Duration, Instant};

/// How long the answers may take.
const PATIENCE: Duration = Duration::from_secs(1);
/// The same over SSH.
const PATIENCE_OVER_SSH: Duration = Duration::from_secs(2);

/// How often it is asked whether to go on waiting.
const LOOK: Duration = Duration::from_millis(50);

/// The device attributes: the question that every terminal answers.
const ATTRIBUTES: &str = "\x1b[c";
/// A colour of 24 bits, the question how it was taken, and the colour back; name and version;
/// background; mode 2026; a picture by kitty's protocol (tried, not shown); colours and size of sixel
/// pictures; the size of a cell.
const QUESTIONS: &str = "\x1b[48;2;1;2;3m\x1bP$qm\x1b\\\x1b[0m\x1b[>q\x1b]11;?\x1b\\\x1b[?2026$p\
                         \x1b_Gi=31,s=1,v=1,a=q,t=d,f=24;AAAA\x1b\\\x1b[?1;1;0S\x1b[?2;1;0S\x1b[16t";
/// A picture by kitty's protocol, and name and version, of the terminal behind tmux.
const QUESTIONS_THROUGH_TMUX: &str = "\x1bPtmux;\x1b\x1b_Gi=31,s=1,v=1,a=q,t=d,f=24;AAAA\x1b\x1b\\\x1b\\\
                                      \x1bPtmux;\x1b\x1b[>q\x1b\\";
/// Since when kitty's pictures can stand among text.
const PLACEHOLDERS_SINCE: [u32; 2] = [0, 28];
/// How 1, 2, 3 comes back from who has 24 bits of colour.
const TRUE_COLOR: [&str; 3] = ["2::1:2:3", "2:1:2:3", "2;1;2;3"];
/// The private mode in which frames are shown at once.
const SYNCHRONISED: u16 = 2026;

/// The question for the cursor's place, which makes a terminal answer when it has come so far; inside
/// a multiplexer wrapped so that the outermost terminal answers it.
pub(crate) fn cursor_question(through: Option<Multiplexer>) -> &'static str {
    match through {
        None => "\x1b[6n",
        Some(Multiplexer::Tmux) => "\x1bPtmux;\x1b\x1b[6n\x1b\\",
        Some(Multiplexer::Screen) => "\x1bP\x1b[6n\x1b\\",
    }
}

/// Asks. Takes about a round trip; two inside a multiplexer over SSH. Keys that come meanwhile are
/// kept for later, and answers from behind a tmux on this machine, which may never come, are not
/// waited for: pass them to [`Capabilities::learn`]. `ending`: nothing is waited for any more.
///
/// # Errors
/// If the terminal is gone.
pub fn probe(
    tty: &Tty,
    keyboard: &mut Keyboard,
    surroundings: Environment,
    ending: &dyn Fn() -> bool,
) -> io::Result<Capabilities> {
    let patience = if surroundings.ssh.is_some() { PATIENCE_OVER_SSH } else { PATIENCE };
    let mut found = Capabilities::from_environment(surroundings);
    let asked = Instant::now();
    let few = ["linux", "vt"].iter().any(|term| found.surroundings.term.starts_with(term));
    let through = match found.surroundings.multiplexer {
        Some(Multiplexer::Tmux) => QUESTIONS_THROUGH_TMUX,
        _ => "",
    };
    let questions = if few { "" } else { QUESTIONS };
    tty.write([through, questions, ATTRIBUTES].concat().as_bytes())?;
    listen(keyboard, asked + patience, ending, |at, reply| {
        found.round_trip.get_or_insert(at.saturating_duration_since(asked));
        found.learn(reply);
        matches!(reply, Reply::Attributes(_))
    })?;
    if let (Some(_), Some(multiplexer)) = (&found.surroundings.ssh, found.surroundings.multiplexer)
    {
        let asked = Instant::now();
        tty.write(cursor_question(Some(multiplexer)).as_bytes())?;
        listen(keyboard, asked + PATIENCE, ending, |at, reply| {
            found.learn(reply);
            let is_answer = matches!(reply, Reply::Cursor { .. });
            if is_answer {
                found.passthrough = Some(at.saturating_duration_since(asked));
            }
            is_answer
        })?;
    }
    Ok(found)
}

/// Hands replies to `take` until it says that it is done, until the `deadline`, or while not `ending`.
fn listen(
    keyboard: &mut Keyboard,
    deadline: Instant,
    ending: &dyn Fn() -> bool,
    mut take: impl FnMut(Instant, &Reply) -> bool,
) -> io::Result<()> {
    let mut others = Vec::new();
    let mut done = false;
    while !done && !ending() && Instant::now() < deadline {
        let came = keyboard.wait(Some(deadline.min(Instant::now() + LOOK)))?;
        for Timed { at, event } in came {
            match event {
                Event::Reply(reply) => done |= take(at, &reply),
                event => others.push(Timed { at, event }),
            }
        }
    }
    keyboard.keep(others);
    Ok(())
}

impl Capabilities {
    /// Takes an answer into account.
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
                let behind = self.surroundings.multiplexer == Some(Multiplexer::Tmux)
                    && !version.starts_with("tmux");
                if behind {
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

/// Whether a terminal of this name and version shows kitty's pictures among text.
fn has_placeholders(version: &str) -> bool {
    let kitty = || {
        let numbers = version.strip_prefix("kitty(")?.split(['.', ')']);
        let mut numbers = numbers.map_while(|n| n.parse::<u32>().ok());
        Some([numbers.next()?, numbers.next()?])
    };
    version.starts_with("ghostty") || kitty().is_some_and(|known| known >= PLACEHOLDERS_SINCE)
}
