//! Loading of a scene or of films before the dashboard starts. If it takes long, the terminal is in
//! full-screen use already, so that the user can quit.

use crate::dashboard::run::job_control::{PATIENCE, handle_signals};
use crossbeam_channel::{Receiver, TryRecvError, bounded};
use std::io;
use std::time::{Duration, Instant};
use zerkalo_scene::value::sanitized;
use zerkalo_terminal::{Environment, Event, HUNG_UP, InputReader, Screen, SignalQueue, Signals};

/// Time after which the terminal shows that something is being loaded.
const AT_ONCE: Duration = Duration::from_millis(200);
/// Interval at which the end of loading is polled.
const POLL: Duration = Duration::from_millis(50);

/// Terminal in full-screen use, with its signals and its input.
pub(super) struct OpenTerminal {
    pub screen: Screen,
    pub signals: Signals,
    pub input: InputReader,
}

impl OpenTerminal {
    pub fn new(environment: &Environment) -> io::Result<Self> {
        let signals = SignalQueue::of_terminal()?;
        let screen = Screen::enter()?;
        let signals = handle_signals(signals, screen.tty.clone(), PATIENCE)?;
        Ok(Self { screen, signals, input: InputReader::new(environment) })
    }
}

/// Loaded value, with the terminal if it is in full-screen use by then; or, if the user has quit or
/// a signal has arrived, the exit status of the signal.
type Loaded<T> = Result<(T, Option<OpenTerminal>), Option<u8>>;

/// Name of the scene or films being loaded, and messages, for the terminal.
pub struct Loading {
    pub name: String,
    /// Messages about large files.
    pub stages: Receiver<String>,
}

impl Loading {
    /// Runs `load` in a thread of its own, until it returns, the user quits or a signal arrives.
    pub(super) fn run<T: Send + 'static>(
        self,
        load: impl FnOnce() -> T + Send + 'static,
        environment: &Environment,
    ) -> io::Result<Loaded<T>> {
        let (sender, loaded) = bounded(1);
        let load = move || drop(sender.send(load()));
        std::thread::Builder::new().name("load".into()).spawn(load)?;
        if let Ok(loaded) = loaded.recv_timeout(AT_ONCE) {
            return Ok(Ok((loaded, None)));
        }
        let mut terminal = OpenTerminal::new(environment)?;
        let tty = terminal.screen.tty.clone();
        let name = sanitized(&self.name);
        tty.write(format!("\x1b[HReading {name}  ·  q quits").as_bytes())?;
        let mut early = Vec::new();
        let loaded = loop {
            match loaded.try_recv() {
                Ok(loaded) => break loaded,
                Err(TryRecvError::Empty) => {}
                Err(TryRecvError::Disconnected) => {
                    return Err(io::Error::other("loading has failed"));
                }
            }
            if let Some(status) = terminal.signals.caught() {
                return Ok(Err(Some(status)));
            }
            for stage in self.stages.try_iter() {
                tty.write(format!("\r\n{}", sanitized(&stage)).as_bytes())?;
            }
            let Ok(events) = terminal.input.wait(Some(Instant::now() + POLL)) else {
                return Ok(Err(Some(HUNG_UP)));
            };
            if events.iter().any(|timed| quits(&timed.event)) {
                return Ok(Err(None));
            }
            early.extend(events);
        };
        terminal.input.early = early;
        Ok(Ok((loaded, Some(terminal))))
    }
}

/// Returns `true` for the keys that quit the dashboard.
pub(super) fn quits(event: &Event) -> bool {
    matches!(event, Event::Key(key) if ["q", "Ctrl-c"].contains(&&*key.to_string()))
}
