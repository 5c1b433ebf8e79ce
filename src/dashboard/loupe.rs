//! Loupe: a small window over the picture in which a half cell shows one film pixel.

use crate::dashboard::{DisplayChannel, Layout, Mode, Model, Overlay};
use ratatui::layout::Rect;
use std::collections::BTreeMap;
use std::sync::Arc;
use zerkalo_render::film::{Detail, TILE, Window};
use zerkalo_render::session::{Snapshot, State};
use zerkalo_scene::edit;

/// Largest columns and rows of the loupe, without its border.
const LARGEST: [u16; 2] = [32, 16];
/// Smallest columns and rows of a loupe.
const SMALLEST: [u16; 2] = [12, 4];
/// Seconds of rendering after which the target of the loupe follows a new view.
const STILL_SECONDS: f64 = 0.2;

/// Largest difference in levels between neighbours that counts as contrast: an edge of a lamp must
/// not outweigh everything else.
const MOST_CONTRAST: f64 = 40.0;

/// Choice when the loupe is visible.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum LoupeMode {
    /// Until the picture has converged.
    #[default]
    Automatic,
    On,
    Off,
}

impl LoupeMode {
    /// All modes with their names for users, in the order in which a key cycles through them.
    pub const NAMED: [(Self, &'static str); 3] = [
        (Self::Automatic, "until the picture has converged"),
        (Self::On, "always"),
        (Self::Off, "never"),
    ];
}

#[derive(Clone, Debug, Default)]
pub struct Loupe {
    pub mode: LoupeMode,
    /// Film pixel (column, row) at the centre unless there is a probe. `None` before the first
    /// picture.
    pub target: Option<[usize; 2]>,
    pub aim: Aim,
    /// Latest pixels, which may be those of an earlier view.
    pub detail: Option<Arc<Detail>>,
}

/// Snapshot by which the target of the loupe was chosen.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Aim {
    generation: u64,
    /// `true` if it had an estimate of the errors.
    by_noise: bool,
}

/// Place and contents of the visible loupe.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoupeLayout {
    /// Area with the border.
    pub frame: Rect,
    pub window: Window,
}

impl Model {
    /// Returns the layout of the loupe; `None` if it is not visible.
    pub fn loupe(&self, layout: &Layout) -> Option<LoupeLayout> {
        let report = &self.snapshot.as_ref()?.report;
        let is_wanted = match self.loupe.mode {
            LoupeMode::Automatic => {
                matches!(report.state, State::Tracing | State::Paused) && !self.is_aiming()
            }
            LoupeMode::On => true,
            LoupeMode::Off => false,
        };
        let is_fine = layout.pixels.is_some() || 2 * layout.texels[0] >= layout.window.size[0];
        let is_hidden = matches!(self.overlay, Some(Overlay::ViewerImage(_)));
        if !is_wanted || is_fine || is_hidden || self.channel != DisplayChannel::Beauty {
            return None;
        }
        let target = self.probe.or(self.loupe.target)?;
        let image = layout.image;
        // Less than half of the picture is covered in each direction.
        let [width, height] = [image.width, image.height].map(|n| n * 3 / 8);
        let inside = [width.min(LARGEST[0]), height.min(LARGEST[1])];
        if inside[0] < SMALLEST[0] || inside[1] < SMALLEST[1] {
            return None;
        }
        let size = [usize::from(inside[0]), 2 * usize::from(inside[1])];
        let film = self.scene().film.size.map(|n| n as usize);
        if size[0] > film[0] || size[1] > film[1] {
            return None;
        }
        let origin = [0, 1].map(|i| target[i].saturating_sub(size[i] / 2).min(film[i] - size[i]));
        // The loupe is in a corner away from what it shows, and away from the box of the probe.
        let at = [0, 1].map(|i| {
            let [start, pixels] = [layout.window.origin[i], layout.window.size[i]];
            2 * (target[i].max(start) - start) < pixels
        });
        let (is_right, is_lower) = (at[0], at[1] != self.probe.is_some());
        let [width, height] = [inside[0] + 2, inside[1] + 2];
        let x = if is_right { image.right() - width } else { image.x };
        let y = if is_lower { image.bottom() - height } else { image.y };
        let frame = Rect { x, y, width, height };
        Some(LoupeLayout { frame, window: Window { origin, size } })
    }

    /// Returns `true` while the user moves the view or the selection, which the loupe must not cover.
    fn is_aiming(&self) -> bool {
        let moves = matches!(self.mode, Mode::Move | Mode::Rotate) || self.drag.is_some();
        moves || self.free_view.is_some() && self.marks_until.is_some()
    }

    /// Takes target and pixels of the loupe from the new snapshot.
    pub(super) fn refresh_loupe(&mut self) {
        let Some(snapshot) = &self.snapshot else { return };
        if let Some(detail) = &snapshot.detail {
            self.loupe.detail = Some(Arc::clone(detail));
        }
        let report = &snapshot.report;
        let aim = Aim { generation: report.generation, by_noise: report.noise.is_some() };
        let is_still = report.seconds >= STILL_SECONDS || self.loupe.target.is_none();
        if self.zoom.is_none() && report.spp.min > 0 && is_still && self.loupe.aim != aim {
            let is_new = self.loupe.aim.generation != aim.generation;
            if let Some(target) = self.noisiest(snapshot, is_new) {
                (self.loupe.target, self.loupe.aim) = (Some(target), aim);
            }
        }
        let center = self.scene().film.size.map(|n| n as usize / 2);
        self.loupe.target.get_or_insert(center);
    }

    /// Returns the film pixel at the middle of the window with the largest error in the scene's mirror
    /// (see [`edit::mirror`]), else in the largest reflecting object, else in the whole picture. Before
    /// the first estimate of errors, it is the window with most contrast. Unless `is_new`, the present
    /// target is kept if its window has half as much.
    fn noisiest(&self, snapshot: &Snapshot, is_new: bool) -> Option<[usize; 2]> {
        let (hits, picture) = (snapshot.first_hits.as_deref()?, snapshot.picture.as_ref()?);
        if hits.window != snapshot.window {
            return None;
        }
        let [columns, rows] = [picture.cols, picture.rows];
        let film_pixel = |i: usize| {
            let pixel = [(0, i % columns, columns), (1, i / columns, rows)];
            pixel.map(|(axis, at, cells)| hits.window.pixel(axis, at, cells))
        };
        let mut counts = BTreeMap::new();
        let mirrors = hits.texels.iter().filter(|hit| hit.reflects);
        mirrors.for_each(|hit| *counts.entry(hit.object).or_insert(0) += 1);
        let mirror = edit::mirror(self.scene(), None);
        let is_the_mirror = |object: Option<u32>| {
            let object = object.and_then(|i| self.scene().objects.get(i as usize));
            object.zip(mirror.as_ref()).is_some_and(|(object, name)| object.names_material(name))
        };
        let largest = counts.into_iter().max_by_key(|(o, count)| (is_the_mirror(*o), *count));
        let largest = largest.map(|(object, _)| object);
        let object = |i: usize| hits.at_pixel(film_pixel(i)).and_then(|hit| hit.object);
        let is_mirror = |i: usize| largest.is_none_or(|mirror| object(i) == mirror);
        let (to_8, radiance) = (self.display.to_8(), picture.mixed(&snapshot.weights));
        let levels: Vec<_> = radiance.iter().map(|c| to_8(c.map(f64::from))[1]).collect();
        let (tiles, size) = (&snapshot.tiles, LARGEST.map(usize::from));
        let window_of = |[x, y]: [usize; 2]| [x / size[0], y / (2 * size[1])];
        let mut windows: BTreeMap<[usize; 2], f64> = BTreeMap::new();
        for i in (0..levels.len()).filter(|i| is_mirror(*i)) {
            let pixel = film_pixel(i);
            let [x, y] = pixel.map(|n| n / TILE);
            let beside = [i + 1, i + columns].into_iter();
            let beside = beside.filter(|n| *n < levels.len() && is_mirror(*n));
            let step = |n: usize| f64::from(levels[i].abs_diff(levels[n])).min(MOST_CONTRAST);
            *windows.entry(window_of(pixel)).or_default() +=
                match tiles.noise_levels.get(y * tiles.columns + x) {
                    Some(noise) => f64::from(*noise).powi(2),
                    None => beside.map(step).sum(),
                };
        }
        let (best, most) = windows.iter().max_by(|a, b| a.1.total_cmp(b.1))?;
        let is_kept = |target: &[usize; 2]| {
            !is_new && windows.get(&window_of(*target)).is_some_and(|now| 2.0 * now >= *most)
        };
        let middle = [best[0] * size[0] + size[0] / 2, best[1] * 2 * size[1] + size[1]];
        Some(self.loupe.target.filter(is_kept).unwrap_or(middle))
    }
}
