//! Event loop of the dashboard. One thread updates the model and draws it. Work that may block runs
//! in other threads, whose results come back through channels.

use crate::dashboard::run::effects::EffectRunner;
use crate::dashboard::run::exports::image_upload::ImageUpload;
use crate::dashboard::run::frames::{DrawOutcome, FramePipeline, FrameRequest};
use crate::dashboard::run::input::{self, Input};
use crate::dashboard::run::job_control::{ResizeDebounce, TerminalIo, stop_group};
use crate::dashboard::run::latency::LatencyRecorder;
use crate::dashboard::update::update;
use crate::dashboard::{Effect, Message, Model, Overlay};
use crossbeam_channel::{Receiver, after, never, select};
use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};
use zerkalo_render::session::{Snapshot, State};
use zerkalo_terminal::{ATTRIBUTES, Capabilities, Event, HUNG_UP, Reply, TimedEvent};

/// Shortest interval between updates of the displayed connection status or upload progress.
pub const STATUS_INTERVAL: Duration = Duration::from_millis(500);

/// Time after which a terminal that has never replied counts as one without replies.
const FIRST_REPLY: Duration = Duration::from_secs(5);
/// Longest wait for the last reply of the terminal, besides two round trips.
const LAST_REPLY: Duration = Duration::from_millis(400);

/// Dashboard on a terminal.
pub struct Dashboard {
    pub model: Model,
    pub effects: EffectRunner,
    pub done: Receiver<Message>,
    pub terminal_io: TerminalIo,
    pub frames: FramePipeline,
    pub latency: LatencyRecorder,
    pub began: Instant,
    /// Generation of the visible picture.
    pub shown: u64,
    /// Counter that increases when another picture replaces the present one, but not when more
    /// samples refine it.
    pub image_epoch: u64,
    /// Debounce of changes of the terminal's size that have not taken effect yet.
    pub resizing: ResizeDebounce,
    /// Time at which the model last received the connection's rate or upload progress.
    pub status_sent_at: Duration,
    /// `true` if rendering is paused, by the user or because the terminal does not reply.
    pub resting: bool,
    /// `true` if the model has changed since the last frame.
    pub changed: bool,
    /// `true` if the terminal has reported its attributes since [`Dashboard::suspend_terminal`].
    pub is_last_reply: bool,
    /// `true` if the program is to be suspended after the present messages.
    pub suspend: bool,
    /// `true` if the program is to quit after the present messages.
    pub quit: bool,
}

impl Dashboard {
    /// Runs the event loop. Returns the exit status if a signal or the loss of the terminal ends
    /// the program, and `None` if the user quits.
    pub fn event_loop(&mut self) -> io::Result<Option<u8>> {
        let TerminalIo { input, signals, left, .. } = self.terminal_io.clone();
        let snapshots = self.effects.session.snapshots.clone();
        let done = self.done.clone();
        let written = self.frames.writer.written.clone();
        let silence = never();
        let mut waiting = Vec::new();
        // Signals that arrived during the capability query are handled before the first frame.
        while let Ok(event) = signals.try_recv() {
            if let Some(status) = self.handle_signal(event) {
                return Ok(Some(status));
            }
        }
        while !self.quit {
            let wait = self.draw();
            // A snapshot is received only when the terminal can take another frame.
            let (snapshots, wants_snapshot) = match self.wants_snapshot() {
                None => (&silence, None),
                Some(Duration::ZERO) => (&snapshots, None),
                wait => (&silence, wait),
            };
            let timer = wait.into_iter().chain(wants_snapshot).min().map_or(never(), after);
            select! {
                recv(input) -> event => match event {
                    Ok(event) => self.enqueue(event, &mut waiting),
                    // The terminal is gone.
                    Err(_) => return Ok(Some(HUNG_UP)),
                },
                recv(snapshots) -> snapshot => match snapshot {
                    Ok(snapshot) => self.take_snapshot(snapshot),
                    // The renderer's panic has been reported already.
                    Err(_) => return Err(io::Error::other("the renderer has ended")),
                },
                recv(done) -> message => if let Ok(message) = message {
                    self.dispatch(message);
                },
                recv(written) -> at => match at {
                    Ok(at) => {
                        self.frames.record_written();
                        self.latency.written(at);
                    }
                    Err(_) => return Ok(Some(HUNG_UP)),
                },
                recv(signals) -> event => {
                    if let Some(status) = event.ok().and_then(|event| self.handle_signal(event)) {
                        return Ok(Some(status));
                    }
                }
                recv(left) -> _ => return Err(io::Error::other("the dashboard has failed")),
                recv(timer) -> _ => self.wake(),
            }
            while let Ok(event) = input.try_recv() {
                self.enqueue(event, &mut waiting);
            }
            if let Some(status) = self.handle(&mut waiting) {
                return Ok(Some(status));
            }
        }
        Ok(None)
    }

    /// Handles user input and the results of effects. Returns the exit status if the program is to
    /// end.
    fn handle(&mut self, waiting: &mut Vec<Input>) -> Option<u8> {
        for Input { at, message } in waiting.drain(..) {
            self.frames.flow.record_input(self.began.elapsed());
            let scene = self.dispatch(message);
            self.latency.event(at, scene);
        }
        while let Ok(message) = self.done.try_recv() {
            self.dispatch(message);
        }
        if std::mem::take(&mut self.suspend) { self.suspend(stop_group) } else { None }
    }

    /// Handles a terminal reply at once, and appends user input to `waiting`.
    fn enqueue(&mut self, TimedEvent { at, event }: TimedEvent, waiting: &mut Vec<Input>) {
        let message = match event {
            Event::Key(key) => Message::Key(key),
            Event::Mouse(mouse) => Message::Mouse(mouse),
            Event::Paste(text) => Message::Paste(text),
            Event::Reply(_) if self.frames.terminal.round_trip.is_none() => {
                self.frames.terminal.round_trip = Some(self.began.elapsed() + FIRST_REPLY);
                self.enqueue(TimedEvent { at, event }, waiting);
                return;
            }
            Event::Reply(Reply::Status) => {
                self.frames.flow.on_ack(at.saturating_duration_since(self.began));
                return;
            }
            Event::Reply(
                reply @ (Reply::Graphics(true)
                | Reply::Version(_)
                | Reply::CellSize(_)
                | Reply::Attributes(_)
                | Reply::SixelColors(_)
                | Reply::SixelSize(_)),
            ) => {
                // A terminal behind a multiplexer or a slow line may reply only after the capability
                // query has ended.
                self.is_last_reply |= matches!(reply, Reply::Attributes(_));
                self.frames.terminal.learn(&reply);
                let terminal = Box::new(self.frames.terminal.clone());
                self.dispatch(Message::Terminal(terminal));
                return;
            }
            Event::Reply(_) => return,
        };
        input::join(waiting, Input { at, message });
    }

    /// Restores the terminal after its last replies. Without the wait, the shell would read them as
    /// input.
    pub fn suspend_terminal(&mut self) {
        let tty = Arc::clone(&self.terminal_io.tty);
        tty.suspend_after(ATTRIBUTES, || self.await_replies());
    }

    /// Waits for the reply to the last request, and for other outstanding replies. Returns `false`
    /// if some may arrive later.
    fn await_replies(&mut self) -> bool {
        let Capabilities { round_trip, passthrough, .. } = self.frames.terminal;
        if round_trip.is_none() && self.began.elapsed() > FIRST_REPLY {
            return false;
        }
        let end = Instant::now() + LAST_REPLY + 2 * round_trip.max(passthrough).unwrap_or_default();
        self.is_last_reply = false;
        while !self.is_last_reply || self.frames.flow.awaits_replies() {
            let Ok(event) = self.terminal_io.input.recv_deadline(end) else { return false };
            self.enqueue(event, &mut Vec::new());
        }
        true
    }

    /// Updates the model and executes the effects. Returns the generation of the picture that
    /// responds to the message; `None` if it needs no new picture.
    pub fn dispatch(&mut self, message: Message) -> Option<u64> {
        let mut awaited = None;
        let is_snapshot = matches!(message, Message::Snapshot(_));
        let version = self.model.picture_version;
        for effect in update(&mut self.model, message, self.began.elapsed()) {
            self.suspend |= effect == Effect::Suspend;
            self.quit |= effect == Effect::Quit;
            let is_edit = matches!(effect, Effect::Show(_));
            if let Some(generation) = self.effects.run(effect, &mut self.frames) {
                // A change of lights alone needs no new picture: the snapshot has one picture per
                // light group.
                let snapshot = self.model.snapshot.as_deref();
                let weights = snapshot.and_then(|s| s.weights_for(self.model.seen()));
                if !is_edit || weights.is_none() {
                    awaited = Some(generation);
                }
            }
        }
        if version != self.model.picture_version && awaited.is_none() && !is_snapshot {
            self.image_epoch += 1;
        }
        self.changed = true;
        awaited
    }

    fn take_snapshot(&mut self, snapshot: Snapshot) {
        let failed = matches!(snapshot.report.state, State::Failed(_));
        let raster = |s: &Snapshot| s.picture.as_ref().map(|p| ([p.cols, p.rows], s.window));
        if snapshot.picture.is_some() || failed {
            let old = self.model.snapshot.as_deref().and_then(raster);
            let is_new_scene = self.shown != snapshot.report.generation;
            self.image_epoch += u64::from(is_new_scene || old != raster(&snapshot));
            self.shown = snapshot.report.generation;
        }
        self.dispatch(Message::Snapshot(Box::new(snapshot)));
    }

    /// Returns the time until a frame with a new picture may be sent. Returns `None` while the last
    /// frame is being written.
    fn wants_snapshot(&self) -> Option<Duration> {
        let now = self.began.elapsed();
        let flow = &self.frames.flow;
        let may_send = flow.allowance(now, self.latency.replies(u64::MAX)).is_some();
        let due = if may_send { now } else { flow.wakes_at(now, true) };
        self.frames.writing_since.is_none().then(|| due.saturating_sub(now))
    }

    fn wake(&mut self) {
        if self.model.next_timeout().is_some_and(|at| at <= self.began.elapsed()) {
            self.dispatch(Message::Tick);
        }
    }

    /// Draws a frame if one is due and the connection has room for it. Returns the time until this
    /// method must be called again; `None` means not before the next event.
    fn draw(&mut self) -> Option<Duration> {
        let now = self.began.elapsed();
        if let Some(due) = self.resizing.due() {
            if due > now {
                return Some(due - now);
            }
            self.resize();
        }
        self.frames.poll_connection(now);
        if self.changed && self.status_sent_at + STATUS_INTERVAL <= now {
            self.status_sent_at = now;
            self.dispatch(Message::ConnectionRate(self.frames.flow.rate()));
        }
        self.report_upload(now);
        self.frames.follow(&self.model);
        let mut due = None;
        if self.frames.writing_since.is_none() && !self.quit {
            let request = self.frame_request();
            due = self.frames.due(now, request);
            if due.is_some_and(|at| at <= now) {
                let drawn = self.frames.draw(&self.model, now, request, self.image_epoch);
                self.changed &= matches!(drawn, DrawOutcome::Nothing | DrawOutcome::Slice);
                match drawn {
                    DrawOutcome::Nothing
                    | DrawOutcome::Deferred
                    | DrawOutcome::Slice
                    | DrawOutcome::Tiles => {}
                    DrawOutcome::Same => {
                        // The screen already shows the response, so the latency ends now.
                        self.latency.sent(self.shown);
                        self.latency.written(Instant::now());
                    }
                    // Generations begin at 1; 0 means a frame without picture.
                    DrawOutcome::Text => self.latency.sent(0),
                    DrawOutcome::Picture => self.latency.sent(self.shown),
                }
                due = match self.frames.writing_since {
                    None => self.frames.due(now, self.frame_request()),
                    Some(_) => None,
                };
            }
        }
        let measures_at = self.frames.flow.measures_at(now);
        let silent_at = self.rest(now);
        let times = [self.model.next_timeout(), due, measures_at, silent_at];
        times.into_iter().flatten().min().map(|at| at.saturating_sub(now))
    }

    fn frame_request(&self) -> FrameRequest {
        FrameRequest { changed: self.changed, answers: self.latency.replies(self.shown) }
    }

    /// Reports the progress of an image transfer to the model, at most once per
    /// [`STATUS_INTERVAL`], and its end at once.
    fn report_upload(&mut self, now: Duration) {
        let Some(sent) = self.frames.upload.as_ref().map(ImageUpload::share) else { return };
        let Some(Overlay::ViewerImage(viewed)) = &self.model.overlay else { return };
        if sent != viewed.sent && (sent == 1.0 || self.status_sent_at + STATUS_INTERVAL <= now) {
            self.status_sent_at = now;
            self.dispatch(Message::ImageSent(sent));
        }
    }

    /// Pauses rendering while the user requests a pause or the terminal does not reply. Returns the
    /// time at which the terminal will count as silent unless a reply arrives before.
    fn rest(&mut self, now: Duration) -> Option<Duration> {
        let silent_at = self.frames.flow.silent_at(self.frames.writing_since);
        let is_silent = silent_at.is_some_and(|at| at <= now);
        let rests = is_silent || self.model.paused;
        if std::mem::replace(&mut self.resting, rests) != rests {
            self.effects.session.set_paused(rests);
        }
        silent_at.filter(|_| !is_silent)
    }
}
