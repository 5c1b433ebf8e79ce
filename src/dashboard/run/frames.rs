//! From the model to the terminal's bytes: a frame is drawn, thinned out, encoded, sent.

use crate::dashboard::model::Model;
use crate::dashboard::overlay::Overlay;
use crate::dashboard::run::image_upload::ImageUpload;
use crate::dashboard::run::writer::{Writer, Written};
use crate::dashboard::view::{View, is_settled};
use crate::terminal::diff::{FrameDiff, TargetFrame};
use crate::terminal::flow::{FlowControl, FrameBudget, InitialLink, LinkStatus, TcpSendQueue};
use crate::terminal::{Capabilities, Tty, copied, cursor_request};
use crossbeam_channel::Receiver;
use ratatui::buffer::Buffer;
use ratatui::layout::{Position, Rect};
use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// What is shown at once by terminals that know this mode, and then.
const SYNCHRONISED: [&[u8]; 2] = [b"\x1b[?2026h", b"\x1b[?2026l"];

/// What a question takes.
const QUESTION_BYTES: usize = 16;

/// Frames on their way to the terminal.
pub struct FramePipeline {
    view: View,
    pacing: FrameDiff,
    link: FlowControl,
    queue: Option<TcpSendQueue>,
    synchronised: bool,
    writer: Writer,
    /// Bytes so far.
    sent: u64,
    wanted: Buffer,
    /// Where the cursor ought to be shown, if it ought to.
    cursor: Option<Position>,
    facts: FrameMeta,
    /// For the clipboard: goes out with the next frame.
    copied: String,
    tty: Arc<Tty>,
    /// The still that the model shows.
    sending: Option<ImageUpload>,
    /// What takes away one that it shows no more: goes out before the next frame.
    removal: Vec<u8>,
    /// It has gone out.
    removing: bool,
}

/// What a frame has to know of the model, as it was when it was drawn.
#[derive(Clone, Copy, Debug, Default)]
struct FrameMeta {
    version: u64,
    samples: f64,
    settled: bool,
}

/// What became of an attempt to draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DrawOutcome {
    /// Nothing may be sent now; nothing was drawn.
    Nothing,
    /// Only the picture differs, and has to wait.
    BranchStack,
    /// The screen is as it ought to be, in what matters.
    Same,
    /// A slice of a still was sent; nothing was drawn.
    Slice,
    /// A frame was sent without the picture.
    Text,
    /// A frame was sent.
    Picture,
}

impl FramePipeline {
    /// For a terminal that shows nothing. `bandwidth`: bytes a second that the user wants to be sent.
    pub fn new(tty: Arc<Tty>, terminal: &Capabilities, bandwidth: Option<f64>) -> io::Result<Self> {
        let queue = terminal.environment.ssh.as_deref().and_then(TcpSendQueue::find);
        Ok(Self {
            view: View::default(),
            pacing: FrameDiff::new(),
            link: FlowControl::new(InitialLink::of(terminal, queue.is_some(), bandwidth)),
            queue,
            synchronised: terminal.synchronised,
            writer: Writer::new(Arc::clone(&tty))?,
            sent: 0,
            wanted: Buffer::empty(Rect::ZERO),
            cursor: None,
            facts: FrameMeta::default(),
            copied: String::new(),
            tty,
            sending: None,
            removal: Vec::new(),
            removing: false,
        })
    }

    /// Puts `text` into the clipboard of the terminal, with the next frame.
    pub fn copy(&mut self, text: &str) {
        self.copied = copied(text);
    }

    /// Nothing is known any more of what the terminal shows.
    pub fn forget(&mut self) {
        self.pacing = FrameDiff::new();
        self.give_up();
    }

    /// How much of the still that is shown has been sent, 0..=1.
    pub fn still_sent(&self) -> Option<f64> {
        self.sending.as_ref().map(ImageUpload::share)
    }

    /// The model's still is the one that is sent.
    pub fn follow(&mut self, model: &Model) {
        let still = match &model.overlay {
            Some(Overlay::ViewerImage(looked)) => looked.still.as_ref(),
            _ => None,
        };
        let same = |sending: &ImageUpload| still.is_some_and(|still| sending.is_of(still));
        if !self.sending.as_ref().is_some_and(same) {
            self.give_up();
            self.sending = still.map(|still| ImageUpload::new(Arc::clone(still)));
        }
    }

    /// Takes away what was sent of a still.
    fn give_up(&mut self) {
        if let Some(sending) = self.sending.take() {
            let (removal, destroys) = sending.removal();
            self.removal.extend(removal);
            if destroys {
                self.pacing = FrameDiff::new();
            }
        }
    }

    /// Sends the next slice of a still.
    fn slice(&mut self, now: Duration, allowance: FrameBudget) -> DrawOutcome {
        let Some(sending) = self.sending.as_mut().filter(|_| allowance.picture) else {
            return DrawOutcome::Nothing;
        };
        if !sending.has_begun() {
            // Whatever happens from here on.
            self.tty.set_exit_sequence(&sending.any_removal());
            self.removing = false;
        }
        let mut bytes = self.writer.buffer();
        sending.next(allowance.bytes.saturating_sub(QUESTION_BYTES), &mut bytes);
        self.pacing.moved();
        if sending.is_open() {
            self.link.sent_unasked(now, bytes.len());
        } else {
            if let Some(through) = self.link.ack_request() {
                bytes.extend(cursor_request(through).as_bytes());
            }
            self.link.sent(now, bytes.len(), true, 0);
        }
        self.writer.send(bytes);
        DrawOutcome::Slice
    }

    /// Whether the last frame has been written.
    pub fn ready(&self) -> bool {
        self.writer.ready()
    }

    /// Whether differences of the picture wait that can be seen, and bytes of frames sent so far.
    pub fn load(&self) -> (bool, u64) {
        (self.pacing.pending().visible, self.sent)
    }

    /// What the user is told about the line.
    pub fn reading(&self) -> Option<LinkStatus> {
        self.link.reading()
    }

    /// The user has done something.
    pub fn act(&mut self, now: Duration) {
        self.link.act(now);
    }

    /// The terminal has answered the question after a frame.
    pub fn answered(&mut self, at: Duration) {
        self.link.on_ack(at);
    }

    /// How long to wait for answers at the end; nothing if there are none.
    pub fn awaits(&self) -> Option<Duration> {
        self.link.awaits()
    }

    /// Whether questions are still to be answered.
    pub fn is_waiting(&self) -> bool {
        self.link.is_waiting()
    }

    /// Takes note of how things stand with the line.
    pub fn look(&mut self, now: Duration) {
        self.link.expire(now);
        if self.link.asks_kernel(now) {
            self.link.held_back(now, self.queue.as_ref().and_then(TcpSendQueue::bytes));
        }
    }

    /// When a new picture could be sent, or at least a text about it.
    pub fn snapshot_due(&self, now: Duration, answers: bool) -> Duration {
        match self.link.allowance(now, answers) {
            Some(_) => now,
            None => self.link.wakes_at(now, true),
        }
    }

    /// When to draw again; `None`: when something happens. `changed`: the model is another one;
    /// `answers`: what is drawn shows what the user has just done.
    pub fn due(&self, now: Duration, changed: bool, answers: bool) -> Option<Duration> {
        let rest = self.pacing.pending();
        let text = changed || rest.text || !self.removal.is_empty();
        let may = || self.link.allowance(now, false).is_some_and(|allowance| allowance.picture);
        if let Some(sending) = &self.sending
            && (sending.is_open() || !text && sending.follows(rest.visible))
        {
            let slice = || if may() { now } else { self.link.wakes_at(now, false) };
            return sending.is_unfinished().then(slice);
        }
        if !text && !rest.visible {
            let hidden = rest.hidden?.max(self.link.refine_at());
            return Some(if may() { hidden } else { hidden.max(self.link.wakes_at(now, false)) });
        }
        match self.link.allowance(now, answers) {
            Some(allowance) if allowance.picture || text => Some(now),
            _ => Some(self.link.wakes_at(now, text)),
        }
    }

    /// Draws the model, if it has `changed`, and sends what the line has room for. `subject` counts up
    /// when the picture is another one than the same with more samples. Only when [`FramePipeline::ready`].
    pub fn draw(
        &mut self,
        model: &Model,
        now: Duration,
        changed: bool,
        answers: bool,
        subject: u64,
    ) -> DrawOutcome {
        let Some(whole) = self.link.allowance(now, answers) else { return DrawOutcome::Nothing };
        let mut allowance = whole;
        if let Some(sending) = &self.sending {
            if sending.is_open() {
                return self.slice(now, whole);
            }
            // What is crisp comes over the picture, or lies there already.
            allowance.picture &= !sending.follows(true);
        }
        if changed {
            self.redraw(model);
        }
        let (picture, uncovered) = self.view.place();
        let FrameMeta { version, samples, settled } = self.facts;
        let wanted = TargetFrame {
            cells: &self.wanted,
            cursor: self.cursor,
            picture,
            uncovered,
            subject,
            version,
            samples,
            settled,
        };
        let mut bytes = self.writer.buffer();
        bytes.extend(&self.removal);
        if self.synchronised {
            bytes.extend(SYNCHRONISED[0]);
        }
        let empty = bytes.len();
        let frame = self.pacing.frame(&wanted, now, allowance, self.link.threshold(), &mut bytes);
        if let Some(sending) = &mut self.sending {
            sending.seen |= frame.picture;
        }
        if bytes.len() == empty && self.copied.is_empty() && self.removal.is_empty() {
            bytes.clear();
            self.writer.keep(bytes);
            let rest = self.pacing.pending();
            let follows =
                |sending: &ImageUpload| sending.is_unfinished() && sending.follows(rest.visible);
            if !rest.text && self.sending.as_ref().is_some_and(follows) {
                return self.slice(now, whole);
            }
            return if self.pacing.pending().visible {
                DrawOutcome::BranchStack
            } else {
                DrawOutcome::Same
            };
        }
        if self.synchronised {
            bytes.extend(SYNCHRONISED[1]);
        }
        self.removing |= !std::mem::take(&mut self.removal).is_empty();
        bytes.extend(std::mem::take(&mut self.copied).as_bytes());
        if let Some(through) = self.link.ack_request() {
            bytes.extend(cursor_request(through).as_bytes());
        }
        self.sent += bytes.len() as u64;
        self.link.sent(now, bytes.len(), frame.picture, frame.flushed);
        self.writer.send(bytes);
        if frame.picture { DrawOutcome::Picture } else { DrawOutcome::Text }
    }

    /// Tells when the frame on its way has been written.
    pub fn written(&self) -> &Receiver<Written> {
        self.writer.written()
    }

    /// Takes note that the frame on its way has been written; when that was.
    pub fn written_at(&mut self, frame: Written) -> io::Result<Instant> {
        if std::mem::take(&mut self.removing) {
            self.tty.set_exit_sequence(&[]);
        }
        self.writer.done(frame)
    }

    fn redraw(&mut self, model: &Model) {
        let [width, height] = model.screen;
        self.wanted.resize(Rect { x: 0, y: 0, width, height });
        self.wanted.reset();
        self.cursor = self.view.draw(model, &mut self.wanted);
        self.facts = FrameMeta {
            version: model.picture_version,
            samples: model.snapshot.as_ref().map_or(0.0, |s| s.report.spp.mean),
            settled: is_settled(model),
        };
    }
}
