//! Screen of 160 x 45 cells: a picture that converges, and a row of text below.

use crate::harness::*;
use ratatui::buffer::Buffer;
use ratatui::layout::Rect;
use ratatui::style::{Color, Style};
use zerkalo_render::schedule::Schedule;
use zerkalo_terminal::cells::{Colors, Oklab, Raster, picture_cells};
use zerkalo_terminal::diff::TargetFrame;

pub const SCREEN: [u16; 2] = [160, 45];
/// Area of the picture on the screen: all rows except the last one, which shows text.
const PICTURE: Rect = Rect { x: 0, y: 0, width: SCREEN[0], height: SCREEN[1] - 1 };

/// Picture that converges. Its first wave has one sample per half cell (upper or lower half of a
/// terminal cell).
pub struct Work {
    rendering: RenderState,
    schedule: Schedule,
    pool: Pool,
    cells: Buffer,
    uncovered: Vec<bool>,
    subject: u64,
    version: u64,
    samples: f64,
    pub done: bool,
}

impl Work {
    /// Prepares a render of `scene` with up to `spp` samples per pixel.
    pub fn new(scene: &Scene, spp: u32) -> Self {
        let size = [PICTURE.width, 2 * PICTURE.height].map(u32::from);
        let scene = sized(scene.clone(), size);
        let rendering = begin(&scene, 0, Precision::Auto);
        let stop = spp_stop(spp);
        let schedule = rendering.schedule(settings(false, 0, stop));
        let [width, height] = SCREEN;
        Self {
            rendering,
            schedule,
            pool: pool(2),
            cells: Buffer::empty(Rect { x: 0, y: 0, width, height }),
            uncovered: vec![true; usize::from(PICTURE.width) * usize::from(PICTURE.height)],
            subject: 0,
            version: 0,
            samples: 0.0,
            done: false,
        }
    }

    /// Traces one wave, or sets `done` if the picture is complete.
    pub fn wave(&mut self) {
        match self.schedule.next(0.0) {
            Step::Finished(_) => self.done = true,
            Step::Trace(wave) => {
                let report = trace(&mut self.rendering, &wave, &self.pool);
                self.schedule.complete(&wave, &report);
            }
        }
        let film = &self.rendering.film;
        let counts = film.tile(0).map_or([0, 0], |tile| tile.counts);
        self.samples = f64::from(counts[0] + counts[1]);
        self.version += 1;
        let radiance = picture(&self.rendering, Replicates::Both);
        let to_8 = Display::default().to_8();
        let [width, height] = [PICTURE.width, 2 * PICTURE.height].map(usize::from);
        let raster = Raster::from_fn(width, height, |i| to_8(radiance[i]));
        self.cells.reset();
        let picture = picture_cells(&raster, Colors::True, self.done);
        for (cell, at) in picture.content.into_iter().zip(PICTURE.positions()) {
            self.cells[at] = cell;
        }
        let text = format!(" {} samples per pixel, wave {}", self.samples, self.version);
        self.cells.set_string(0, PICTURE.height, text, Style::new());
    }

    /// Replaces the scene by `scene` and prepares a render of it with up to `spp` samples per
    /// pixel.
    pub fn edit(&mut self, scene: &Scene, spp: u32) {
        let Self { subject, version, .. } = *self;
        *self = Self { subject: subject + 1, version, ..Self::new(scene, spp) };
    }

    /// Returns the frame that the terminal should show.
    pub fn target(&self) -> TargetFrame<'_> {
        TargetFrame {
            cells: &self.cells,
            cursor: None,
            picture: PICTURE,
            uncovered: &self.uncovered,
            subject: self.subject,
            version: self.version,
            samples: self.samples,
            settled: self.done,
        }
    }

    /// Returns the mean OKLab distance between the shown and the target colours, over the halves of
    /// all cells.
    pub fn error(&self, screen: &vt100::Screen) -> f64 {
        let distances = PICTURE.positions().map(|at| {
            let target = &self.cells[at];
            let target = halves(target.symbol(), [target.fg, target.bg].map(rgb));
            let cell = screen.cell(at.y, at.x).unwrap();
            let shown = halves(cell.contents(), [cell.fgcolor(), cell.bgcolor()].map(emulated));
            let distance = |i: usize| f64::from(Oklab::of(target[i]).distance(Oklab::of(shown[i])));
            distance(0) + distance(1)
        });
        distances.sum::<f64>() / (2.0 * f64::from(PICTURE.area()))
    }

    /// Returns `true` if the screen shows text and picture exactly.
    pub fn is_exact(&self, screen: &vt100::Screen) -> bool {
        let row = |y: u16| screen.contents_between(y, 0, y, SCREEN[0]);
        let text: String =
            (0..SCREEN[0]).map(|x| self.cells[(x, PICTURE.height)].symbol()).collect();
        self.error(screen) == 0.0 && row(PICTURE.height).trim_end() == text.trim_end()
    }
}

fn halves(glyph: &str, [fg, bg]: [[u8; 3]; 2]) -> [[u8; 3]; 2] {
    match glyph {
        "▀" => [fg, bg],
        "▄" => [bg, fg],
        " " | "" => [bg; 2],
        other => panic!("{other:?} is not a cell of the picture"),
    }
}

fn rgb(color: Color) -> [u8; 3] {
    match color {
        Color::Rgb(r, g, b) => [r, g, b],
        _ => [0; 3],
    }
}

fn emulated(color: vt100::Color) -> [u8; 3] {
    match color {
        vt100::Color::Rgb(r, g, b) => [r, g, b],
        _ => [0; 3],
    }
}
