//! Frame pipeline: draws the model, and sends the differences from the contents of the terminal.

use crate::dashboard::run::exports::image_upload::ImageUpload;
use crate::dashboard::run::exports::paths;
use crate::dashboard::run::tiles::PanelTiles;
use crate::dashboard::run::writer::{self, Writer};
use crate::dashboard::view::{View, is_settled};
use crate::dashboard::{Model, Overlay};
use ratatui::buffer::Buffer;
use ratatui::layout::{Position, Rect};
use std::io;
use std::sync::Arc;
use std::time::Duration;
use zerkalo_terminal::diff::{Frame, FrameDiff, TargetFrame};
use zerkalo_terminal::flow::{FlowControl, FrameBudget, InitialLink, TcpSendQueue};
use zerkalo_terminal::image::TileImage;
use zerkalo_terminal::{Capabilities, Multiplexer, Tty, copied, hyperlink};

/// Start and end of a synchronised update, which the terminal displays as a whole.
const SYNCHRONISED: [&[u8]; 2] = [b"\x1b[?2026h", b"\x1b[?2026l"];

/// Largest number of bytes of tiles in a frame, even if the connection has no limit.
const TILE_BYTES: usize = 1 << 16;
/// Upper bound of the length of an acknowledgement request, which has 14 bytes inside tmux.
const ACK_REQUEST_BYTES: usize = 16;

pub struct FramePipeline {
    view: View,
    pub diff: FrameDiff,
    pub flow: FlowControl,
    /// Send queue of the SSH connection in the kernel; `None` if there is none.
    queue: Option<TcpSendQueue>,
    /// Known capabilities of the terminal. Late replies add to them.
    pub terminal: Capabilities,
    /// Thread that writes frames. Each of its results must be reported to
    /// [`FramePipeline::record_written`].
    pub writer: Writer,
    /// Time since which a frame is being written; `None` if another one can be sent.
    pub writing_since: Option<Duration>,
    /// Last frame that was drawn, whose cells may not all have been sent.
    target: Buffer,
    cursor: Option<Position>,
    /// Escape sequence that sets the clipboard, to be sent with the next frame.
    clipboard: String,
    /// Escape sequence of the link to an exported file, and the last one that was sent.
    link: [Option<String>; 2],
    tty: Arc<Tty>,
    /// Upload of the viewed image.
    pub upload: Option<ImageUpload>,
    /// Tiles of the picture in its panel.
    tiles: PanelTiles,
    /// Escape sequence that removes images, to be sent before the next frame.
    removal: Vec<u8>,
    /// `true` if the frame that is being written removes an image.
    removing: bool,
}

/// Reason for the next frame.
#[derive(Clone, Copy)]
pub struct FrameRequest {
    /// `true` if the model has changed since the last frame.
    pub changed: bool,
    /// `true` if the frame responds to user input.
    pub answers: bool,
}

/// Outcome of an attempt to draw and send a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DrawOutcome {
    /// The connection has no room.
    Nothing,
    /// Visible differences remain in the picture, to be sent later.
    Deferred,
    /// No visible differences remain.
    Same,
    /// A part of a viewed image was sent instead of a frame.
    Slice,
    /// Parts of the picture's tiles were sent instead of a frame.
    Tiles,
    /// A frame without picture cells was sent.
    Text,
    /// A frame with picture cells was sent.
    Picture,
}

impl FramePipeline {
    /// Creates a pipeline for an empty screen. `bandwidth` is a fixed rate in bytes per second.
    pub fn new(tty: Arc<Tty>, terminal: Capabilities, bandwidth: Option<f64>) -> io::Result<Self> {
        let queue = terminal.environment.ssh.as_deref().and_then(TcpSendQueue::find);
        Ok(Self {
            view: View::default(),
            diff: FrameDiff::default(),
            flow: FlowControl::new(InitialLink::of(&terminal, queue.is_some(), bandwidth)),
            queue,
            terminal,
            writer: writer::start(Arc::clone(&tty))?,
            writing_since: None,
            target: Buffer::empty(Rect::ZERO),
            cursor: None,
            clipboard: String::new(),
            link: [None, None],
            tty,
            upload: None,
            tiles: PanelTiles::default(),
            removal: Vec::new(),
            removing: false,
        })
    }

    pub fn copy(&mut self, text: &str) {
        self.clipboard = copied(text);
    }

    /// Treats the contents of the terminal as unknown: the next frame redraws the whole screen.
    pub fn forget(&mut self) {
        self.diff = FrameDiff::default();
        self.removal.extend(self.tiles.clear().as_bytes());
        self.give_up();
    }

    /// Begins the upload of the image that the viewer shows, and gives up the upload of any other.
    pub fn follow(&mut self, model: &Model) {
        let image = match &model.overlay {
            Some(Overlay::ViewerImage(viewed)) => viewed.image.as_ref(),
            _ => None,
        };
        let same =
            |upload: &ImageUpload| image.is_some_and(|image| Arc::ptr_eq(&upload.image, image));
        if !self.upload.as_ref().is_some_and(same) {
            self.give_up();
            self.upload = image.map(|image| ImageUpload::new(Arc::clone(image)));
        }
    }

    fn give_up(&mut self) {
        if let Some(upload) = self.upload.take().filter(ImageUpload::has_begun) {
            self.removal.extend(upload.removal());
            if upload.image.transfer.is_divisible {
                self.diff = FrameDiff::default();
            }
        }
    }

    /// Sends the next part of the viewed image.
    fn slice(&mut self, now: Duration, budget: FrameBudget) -> DrawOutcome {
        let Some(upload) = self.upload.as_mut().filter(|_| budget.picture) else {
            return DrawOutcome::Nothing;
        };
        if !upload.has_begun() {
            // The sequence that a signal or panic sends must also remove the image from now on.
            self.tty.set_exit_sequence(&upload.any_removal());
            self.removing = false;
        }
        let mut bytes = Vec::new();
        upload.next(budget.bytes.saturating_sub(ACK_REQUEST_BYTES), &mut bytes);
        self.diff.moved();
        if upload.open {
            self.flow.sent_unasked(now, bytes.len());
        } else {
            bytes.extend(self.flow.ack_request().unwrap_or_default().as_bytes());
            self.flow.sent(now, bytes.len(), true, 0);
        }
        self.send(bytes, now);
        DrawOutcome::Slice
    }

    /// Passes a frame to the writing thread, which must not be writing.
    fn send(&mut self, frame: Vec<u8>, now: Duration) {
        debug_assert!(self.writing_since.is_none(), "one frame at a time");
        let _ = self.writer.frames.send(frame);
        self.writing_since = Some(now);
    }

    /// Gives up overdue acknowledgements, and reads the kernel's send queue if a reading is due.
    pub fn poll_connection(&mut self, now: Duration) {
        self.flow.expire(now);
        if self.flow.wants_queue_length(now) {
            self.flow.record_queue_length(now, self.queue.as_ref().and_then(TcpSendQueue::bytes));
        }
    }

    /// Returns the time at which [`FramePipeline::draw`] must be called next; `None` if not before
    /// the next event.
    pub fn due(&self, now: Duration, request: FrameRequest) -> Option<Duration> {
        let pending = self.diff.pending;
        let text = request.changed || pending.text || !self.removal.is_empty();
        let may = || self.flow.allowance(now, false).is_some_and(|budget| budget.picture);
        if let Some(upload) = &self.upload
            && (upload.open || !text && upload.follows(pending.visible))
        {
            let slice = || if may() { now } else { self.flow.wakes_at(now, false) };
            return upload.is_unfinished().then(slice);
        }
        if self.tiles.is_open() || self.tiles.waits() && !text && !pending.visible {
            return Some(if may() { now } else { self.flow.wakes_at(now, false) });
        }
        if !text && !pending.visible {
            let hidden = pending.hidden?.max(self.flow.refine_at);
            return Some(if may() { hidden } else { hidden.max(self.flow.wakes_at(now, false)) });
        }
        match self.flow.allowance(now, request.answers) {
            Some(budget) if budget.picture || text => Some(now),
            _ => Some(self.flow.wakes_at(now, text)),
        }
    }

    /// Draws the model if it has changed, and sends as many changed cells as the connection has
    /// room for. Must be called only if no frame is being written.
    pub fn draw(
        &mut self,
        model: &Model,
        now: Duration,
        request: FrameRequest,
        image_epoch: u64,
    ) -> DrawOutcome {
        let Some(whole) = self.flow.allowance(now, request.answers) else {
            return DrawOutcome::Nothing;
        };
        let mut budget = whole;
        if let Some(upload) = &self.upload {
            if upload.open {
                return self.slice(now, whole);
            }
            // No picture cells are sent while the viewed image covers them or is about to.
            budget.picture &= !upload.follows(true);
        }
        if self.tiles.is_open() {
            return self.send_tiles(model, now, whole, image_epoch);
        }
        if request.changed {
            self.redraw(model);
        }
        if self.tiles.waits() {
            budget.refinement = 0;
        }
        let mut bytes = self.removal.clone();
        if self.terminal.synchronised {
            bytes.extend(SYNCHRONISED[0]);
        }
        let empty = bytes.len();
        let frame = self.encode(model, now, budget, image_epoch, &mut bytes);
        if let Some(upload) = &mut self.upload {
            upload.seen |= frame.picture;
        }
        if bytes.len() == empty && self.clipboard.is_empty() && self.removal.is_empty() {
            let pending = self.diff.pending;
            let follows =
                |upload: &ImageUpload| upload.is_unfinished() && upload.follows(pending.visible);
            if !pending.text && self.upload.as_ref().is_some_and(follows) {
                return self.slice(now, whole);
            }
            if self.tiles.waits() && whole.picture && !pending.text && !pending.visible {
                return self.send_tiles(model, now, whole, image_epoch);
            }
            return if pending.visible { DrawOutcome::Deferred } else { DrawOutcome::Same };
        }
        if self.terminal.synchronised {
            bytes.extend(SYNCHRONISED[1]);
        }
        self.removing |= !std::mem::take(&mut self.removal).is_empty();
        bytes.extend(std::mem::take(&mut self.clipboard).as_bytes());
        if self.link[0] != self.link[1] {
            if let Some(link) = &self.link[0] {
                bytes.extend(link.as_bytes());
                self.diff.pen_reset();
            }
            self.link[1] = self.link[0].clone();
        }
        bytes.extend(self.flow.ack_request().unwrap_or_default().as_bytes());
        self.flow.sent(now, bytes.len(), frame.picture, frame.flushed);
        self.send(bytes, now);
        if frame.picture { DrawOutcome::Picture } else { DrawOutcome::Text }
    }

    pub fn record_written(&mut self) {
        if std::mem::take(&mut self.removing) {
            self.tty.set_exit_sequence(&self.exit_sequence());
        }
        self.writing_since = None;
    }

    /// Returns the sequence that removes the tiles at any progress of their transfer, and clears the
    /// screen if they have overwritten cells.
    fn exit_sequence(&self) -> Vec<u8> {
        let clear = if self.tiles.is_sixel() { "\x1b\\\x1b[2J" } else { "" };
        [self.tiles.removal().as_bytes(), clear.as_bytes()].concat()
    }

    /// Appends the bytes of the next frame to `out`.
    fn encode(
        &mut self,
        model: &Model,
        now: Duration,
        budget: FrameBudget,
        image_epoch: u64,
        out: &mut Vec<u8>,
    ) -> Frame {
        let target = TargetFrame {
            cells: &self.target,
            cursor: self.cursor,
            picture: self.view.place,
            uncovered: &self.view.uncovered,
            subject: image_epoch,
            version: model.picture_version,
            samples: model.snapshot.as_ref().map_or(0.0, |s| s.report.spp.mean),
            settled: is_settled(model),
        };
        self.diff.frame(&target, now, budget, self.flow.threshold(), out)
    }

    /// Sends the next parts of tiles, and the cells that a complete tile replaces.
    fn send_tiles(
        &mut self,
        model: &Model,
        now: Duration,
        budget: FrameBudget,
        image_epoch: u64,
    ) -> DrawOutcome {
        if !budget.picture {
            return DrawOutcome::Nothing;
        }
        let room = budget.bytes.saturating_sub(ACK_REQUEST_BYTES).min(TILE_BYTES);
        let mut bytes = Vec::new();
        let is_closed = !self.tiles.is_open() && self.terminal.synchronised;
        while self.tiles.waits() && bytes.len() < room {
            let before = bytes.len();
            let complete = self.tiles.next(room - before, &mut bytes);
            self.diff.moved();
            if let Some(cells) = complete {
                if self.tiles.replace_cells() {
                    self.diff.overwritten(cells, &TileImage::pixels());
                }
                let View { place, uncovered, .. } = &mut self.view;
                self.tiles.paint(&mut self.target, *place, uncovered);
                let text = FrameBudget { bytes: TILE_BYTES, picture: false, refinement: 0 };
                self.encode(model, now, text, image_epoch, &mut bytes);
            }
            if self.tiles.is_open() || bytes.len() == before {
                break;
            }
        }
        if bytes.is_empty() {
            return DrawOutcome::Same;
        }
        // The sequence that a signal or panic sends must also remove the tiles from now on.
        self.tty.set_exit_sequence(&self.exit_sequence());
        if self.tiles.is_open() {
            self.flow.sent_unasked(now, bytes.len());
        } else {
            if is_closed {
                bytes = [SYNCHRONISED[0], &bytes[..], SYNCHRONISED[1]].concat();
            }
            bytes.extend(self.flow.ack_request().unwrap_or_default().as_bytes());
            self.flow.sent(now, bytes.len(), true, 0);
        }
        self.send(bytes, now);
        DrawOutcome::Tiles
    }

    fn redraw(&mut self, model: &Model) {
        let [width, height] = model.screen;
        self.target.resize(Rect { x: 0, y: 0, width, height });
        self.target.reset();
        self.cursor = self.view.draw(model, &mut self.target);
        let View { place, uncovered, .. } = &mut self.view;
        let removal = self.tiles.update(model, &self.target, *place, uncovered);
        self.removal.extend(removal.as_bytes());
        self.tiles.paint(&mut self.target, *place, uncovered);
        self.link[0] = self.link_to_export(model);
    }

    /// Returns the sequence that makes the path in the notice of an export a link; `None` without
    /// such a notice. It resets the colours.
    fn link_to_export(&self, model: &Model) -> Option<String> {
        let environment = &self.terminal.environment;
        let is_able =
            environment.term != "linux" && environment.multiplexer != Some(Multiplexer::Screen);
        let path = model.last_export.as_ref().filter(|_| is_able)?;
        let text = path.display().to_string();
        model.notice.as_ref().filter(|notice| notice.text.starts_with(&text))?;
        // The notice begins with a space, a mark and a space.
        let (x, y) = (3, model.layout()?.hints.y);
        let mut cells = text.chars().zip(x..);
        let is_shown = cells.all(|(c, x)| {
            self.target.cell((x, y)).is_some_and(|cell| cell.symbol().chars().eq([c]))
        });
        let link = is_shown.then(|| hyperlink(&paths::url(path), &text))?;
        Some(format!("\x1b[{};{}H\x1b[0;4m{link}\x1b[m", y + 1, x + 1))
    }
}
