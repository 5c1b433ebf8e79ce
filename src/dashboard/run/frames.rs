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
    diff: FrameDiff,
    flow: FlowControl,
    queue: Option<TcpSendQueue>,
    synchronised: bool,
    writer: Writer,
    /// Bytes sent so far.
    sent: u64,
    target: Buffer,
    /// Position of the text cursor, if visible.
    cursor: Option<Position>,
    meta: FrameMeta,
    /// Clipboard sequence to send with the next frame.
    clipboard: String,
    tty: Arc<Tty>,
    /// Upload of the image in the viewer.
    upload: Option<ImageUpload>,
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
            diff: FrameDiff::new(),
            flow: FlowControl::new(InitialLink::of(terminal, queue.is_some(), bandwidth)),
            queue,
            synchronised: terminal.synchronised,
            writer: Writer::new(Arc::clone(&tty))?,
            sent: 0,
            target: Buffer::empty(Rect::ZERO),
            cursor: None,
            meta: FrameMeta::default(),
            clipboard: String::new(),
            tty,
            upload: None,
            removal: Vec::new(),
            removing: false,
        })
    }

    /// Copies `text` to the clipboard of the terminal, with the next frame.
    pub fn copy(&mut self, text: &str) {
        self.clipboard = copied(text);
    }

    /// Forgets the contents of the screen, so that the next frame redraws all of it.
    pub fn forget(&mut self) {
        self.diff = FrameDiff::new();
        self.give_up();
    }

    /// Transferred share of the viewed image, 0..=1.
    pub fn uploaded(&self) -> Option<f64> {
        self.upload.as_ref().map(ImageUpload::share)
    }

    /// Follows the image in the model's viewer.
    pub fn follow(&mut self, model: &Model) {
        let image = match &model.overlay {
            Some(Overlay::ViewerImage(viewed)) => viewed.image.as_ref(),
            _ => None,
        };
        let same = |upload: &ImageUpload| image.is_some_and(|image| upload.is_of(image));
        if !self.upload.as_ref().is_some_and(same) {
            self.give_up();
            self.upload = image.map(|image| ImageUpload::new(Arc::clone(image)));
        }
    }

    /// Stops an upload and removes what was sent of it.
    fn give_up(&mut self) {
        if let Some(upload) = self.upload.take() {
            let (removal, destroys) = upload.removal();
            self.removal.extend(removal);
            if destroys {
                self.diff = FrameDiff::new();
            }
        }
    }

    /// Sends the next slice of an image.
    fn slice(&mut self, now: Duration, budget: FrameBudget) -> DrawOutcome {
        let Some(upload) = self.upload.as_mut().filter(|_| budget.picture) else {
            return DrawOutcome::Nothing;
        };
        if !upload.has_begun() {
            // The image must be removed however the program ends.
            self.tty.set_exit_sequence(&upload.any_removal());
            self.removing = false;
        }
        let mut bytes = self.writer.buffer();
        upload.next(budget.bytes.saturating_sub(QUESTION_BYTES), &mut bytes);
        self.diff.moved();
        if upload.is_open() {
            self.flow.sent_unasked(now, bytes.len());
        } else {
            if let Some(through) = self.flow.ack_request() {
                bytes.extend(cursor_request(through).as_bytes());
            }
            self.flow.sent(now, bytes.len(), true, 0);
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
        (self.diff.pending().visible, self.sent)
    }

    /// Status of the connection, for display.
    pub fn reading(&self) -> Option<LinkStatus> {
        self.flow.reading()
    }

    /// Records user input.
    pub fn act(&mut self, now: Duration) {
        self.flow.act(now);
    }

    /// Records the acknowledgement of a frame.
    pub fn answered(&mut self, at: Duration) {
        self.flow.on_ack(at);
    }

    /// Time to wait for acknowledgements at the end; `None` if none are outstanding.
    pub fn awaits(&self) -> Option<Duration> {
        self.flow.awaits()
    }

    /// Returns `true` if acknowledgements are outstanding.
    pub fn is_waiting(&self) -> bool {
        self.flow.is_waiting()
    }

    /// Updates flow control: expires acknowledgements and reads the send queue.
    pub fn look(&mut self, now: Duration) {
        self.flow.expire(now);
        if self.flow.asks_kernel(now) {
            self.flow.held_back(now, self.queue.as_ref().and_then(TcpSendQueue::bytes));
        }
    }

    /// Time at which a new picture, or at least text, could be sent.
    pub fn snapshot_due(&self, now: Duration, answers: bool) -> Duration {
        match self.flow.allowance(now, answers) {
            Some(_) => now,
            None => self.flow.wakes_at(now, true),
        }
    }

    /// Time of the next draw; `None` until an event. `changed` is whether the model differs from
    /// the last frame, `answers` whether the frame responds to user input.
    pub fn due(&self, now: Duration, changed: bool, answers: bool) -> Option<Duration> {
        let pending = self.diff.pending();
        let text = changed || pending.text || !self.removal.is_empty();
        let may = || self.flow.allowance(now, false).is_some_and(|budget| budget.picture);
        if let Some(upload) = &self.upload
            && (upload.is_open() || !text && upload.follows(pending.visible))
        {
            let slice = || if may() { now } else { self.flow.wakes_at(now, false) };
            return upload.is_unfinished().then(slice);
        }
        if !text && !pending.visible {
            let hidden = pending.hidden?.max(self.flow.refine_at());
            return Some(if may() { hidden } else { hidden.max(self.flow.wakes_at(now, false)) });
        }
        match self.flow.allowance(now, answers) {
            Some(budget) if budget.picture || text => Some(now),
            _ => Some(self.flow.wakes_at(now, text)),
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
        let Some(whole) = self.flow.allowance(now, answers) else { return DrawOutcome::Nothing };
        let mut budget = whole;
        if let Some(upload) = &self.upload {
            if upload.is_open() {
                return self.slice(now, whole);
            }
            // The image covers the picture, or is about to.
            budget.picture &= !upload.follows(true);
        }
        if changed {
            self.redraw(model);
        }
        let (picture, uncovered) = self.view.place();
        let FrameMeta { version, samples, settled } = self.meta;
        let target = TargetFrame {
            cells: &self.target,
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
        let frame = self.diff.frame(&target, now, budget, self.flow.threshold(), &mut bytes);
        if let Some(upload) = &mut self.upload {
            upload.seen |= frame.picture;
        }
        if bytes.len() == empty && self.clipboard.is_empty() && self.removal.is_empty() {
            bytes.clear();
            self.writer.keep(bytes);
            let pending = self.diff.pending();
            let follows =
                |upload: &ImageUpload| upload.is_unfinished() && upload.follows(pending.visible);
            if !pending.text && self.upload.as_ref().is_some_and(follows) {
                return self.slice(now, whole);
            }
            return if self.diff.pending().visible {
                DrawOutcome::Deferred
            } else {
                DrawOutcome::Same
            };
        }
        if self.synchronised {
            bytes.extend(SYNCHRONISED[1]);
        }
        self.removing |= !std::mem::take(&mut self.removal).is_empty();
        bytes.extend(std::mem::take(&mut self.clipboard).as_bytes());
        if let Some(through) = self.flow.ack_request() {
            bytes.extend(cursor_request(through).as_bytes());
        }
        self.sent += bytes.len() as u64;
        self.flow.sent(now, bytes.len(), frame.picture, frame.flushed);
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
        self.target.resize(Rect { x: 0, y: 0, width, height });
        self.target.reset();
        self.cursor = self.view.draw(model, &mut self.target);
        self.meta = FrameMeta {
            version: model.picture_version,
            samples: model.snapshot.as_ref().map_or(0.0, |s| s.report.spp.mean),
            settled: is_settled(model),
        };
    }
}
