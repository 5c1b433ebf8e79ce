//! Frame pipeline: the model is drawn, diffed, encoded and sent.

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

/// Begin and end of a synchronised update.
const SYNCHRONISED: [&[u8]; 2] = [b"\x1b[?2026h", b"\x1b[?2026l"];

/// Bytes of an acknowledgement request.
const QUESTION_BYTES: usize = 16;

/// Pipeline of frames to the terminal.
pub struct FramePipeline {
    view: View,
    pacing: FrameDiff,
    link: FlowControl,
    queue: Option<TcpSendQueue>,
    synchronised: bool,
    writer: Writer,
    /// Bytes sent so far.
    sent: u64,
    wanted: Buffer,
    /// Position of the text cursor, if visible.
    cursor: Option<Position>,
    facts: FrameMeta,
    /// Clipboard sequence to send with the next frame.
    copied: String,
    tty: Arc<Tty>,
    /// Upload of the image in the viewer.
    sending: Option<ImageUpload>,
    /// Sequence that removes the previous image; sent before the next frame.
    removal: Vec<u8>,
    /// The removal has been sent.
    removing: bool,
}

/// Values of the model when the frame was drawn.
#[derive(Clone, Copy, Debug, Default)]
struct FrameMeta {
    version: u64,
    samples: f64,
    settled: bool,
}

/// Outcome of an attempt to draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DrawOutcome {
    /// The frame budget is empty; nothing was drawn.
    Nothing,
    /// Only the picture differs, and its transfer is deferred.
    Deferred,
    /// The screen is up to date in all visible differences.
    Same,
    /// A slice of an image was sent; nothing was drawn.
    Slice,
    /// A frame without picture cells was sent.
    Text,
    /// A frame with picture cells was sent.
    Picture,
}

impl FramePipeline {
    /// Creates a pipeline for an empty screen. `bandwidth` is a fixed rate in bytes per second.
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

    /// Copies `text` to the clipboard of the terminal, with the next frame.
    pub fn copy(&mut self, text: &str) {
        self.copied = copied(text);
    }

    /// Forgets the contents of the screen, so that the next frame redraws all of it.
    pub fn forget(&mut self) {
        self.pacing = FrameDiff::new();
        self.give_up();
    }

    /// Transferred share of the viewed image, 0..=1.
    pub fn uploaded(&self) -> Option<f64> {
        self.sending.as_ref().map(ImageUpload::share)
    }

    /// Follows the image in the model's viewer.
    pub fn follow(&mut self, model: &Model) {
        let still = match &model.overlay {
            Some(Overlay::ViewerImage(viewed)) => viewed.still.as_ref(),
            _ => None,
        };
        let same = |sending: &ImageUpload| still.is_some_and(|still| sending.is_of(still));
        if !self.sending.as_ref().is_some_and(same) {
            self.give_up();
            self.sending = still.map(|still| ImageUpload::new(Arc::clone(still)));
        }
    }

    /// Stops an upload and removes what was sent of it.
    fn give_up(&mut self) {
        if let Some(sending) = self.sending.take() {
            let (removal, destroys) = sending.removal();
            self.removal.extend(removal);
            if destroys {
                self.pacing = FrameDiff::new();
            }
        }
    }

    /// Sends the next slice of an image.
    fn slice(&mut self, now: Duration, allowance: FrameBudget) -> DrawOutcome {
        let Some(sending) = self.sending.as_mut().filter(|_| allowance.picture) else {
            return DrawOutcome::Nothing;
        };
        if !sending.has_begun() {
            // The image must be removed however the program ends.
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

    /// Returns `true` if the last frame has been written.
    pub fn ready(&self) -> bool {
        self.writer.ready()
    }

    /// Returns `true` if visible differences of the picture are pending, and the bytes of frames
    /// sent so far.
    pub fn load(&self) -> (bool, u64) {
        (self.pacing.rest().visible, self.sent)
    }

    /// Status of the connection, for display.
    pub fn reading(&self) -> Option<LinkStatus> {
        self.link.reading()
    }

    /// Records user input.
    pub fn act(&mut self, now: Duration) {
        self.link.act(now);
    }

    /// Records the acknowledgement of a frame.
    pub fn answered(&mut self, at: Duration) {
        self.link.on_ack(at);
    }

    /// Time to wait for acknowledgements at the end; `None` if none are outstanding.
    pub fn awaits(&self) -> Option<Duration> {
        self.link.awaits()
    }

    /// Returns `true` if acknowledgements are outstanding.
    pub fn is_waiting(&self) -> bool {
        self.link.is_waiting()
    }

    /// Updates flow control: expires acknowledgements and reads the send queue.
    pub fn look(&mut self, now: Duration) {
        self.link.expire(now);
        if self.link.asks_kernel(now) {
            self.link.held_back(now, self.queue.as_ref().and_then(TcpSendQueue::bytes));
        }
    }

    /// Time at which a new picture, or at least text, could be sent.
    pub fn snapshot_due(&self, now: Duration, answers: bool) -> Duration {
        match self.link.allowance(now, answers) {
            Some(_) => now,
            None => self.link.wakes_at(now, true),
        }
    }

    /// Time of the next draw; `None` until an event. `changed` is whether the model differs from
    /// the last frame, `answers` whether the frame responds to user input.
    pub fn due(&self, now: Duration, changed: bool, answers: bool) -> Option<Duration> {
        let rest = self.pacing.rest();
        let text = changed || rest.text || !self.removal.is_empty();
        let may = || self.link.allowance(now, false).is_some_and(|allowance| allowance.picture);
        if let Some(sending) = &self.sending
            && (sending.is_open() || !text && sending.follows(rest.visible))
        {
            let slice = || if may() { now } else { self.link.wakes_at(now, false) };
            return sending.is_unfinished().then(slice);
        }
        if !text && !rest.visible {
            let hidden = rest.hidden?.max(self.link.flush_at());
            return Some(if may() { hidden } else { hidden.max(self.link.wakes_at(now, false)) });
        }
        match self.link.allowance(now, answers) {
            Some(allowance) if allowance.picture || text => Some(now),
            _ => Some(self.link.wakes_at(now, text)),
        }
    }

    /// Draws the model if it has `changed` and sends as much as the connection has room for.
    /// `image_epoch` increases when the picture is replaced by one that is not a refinement.
    /// Requires [`FramePipeline::ready`].
    pub fn draw(
        &mut self,
        model: &Model,
        now: Duration,
        changed: bool,
        answers: bool,
        image_epoch: u64,
    ) -> DrawOutcome {
        let Some(whole) = self.link.allowance(now, answers) else { return DrawOutcome::Nothing };
        let mut allowance = whole;
        if let Some(sending) = &self.sending {
            if sending.is_open() {
                return self.slice(now, whole);
            }
            // The image covers the picture, or is about to.
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
            subject: image_epoch,
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
            let rest = self.pacing.rest();
            let follows =
                |sending: &ImageUpload| sending.is_unfinished() && sending.follows(rest.visible);
            if !rest.text && self.sending.as_ref().is_some_and(follows) {
                return self.slice(now, whole);
            }
            return if self.pacing.rest().visible {
                DrawOutcome::Deferred
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

    /// Receives the result of each written frame.
    pub fn written(&self) -> &Receiver<Written> {
        self.writer.written()
    }

    /// Records that the frame was written; returns when.
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
