//! Marks in the picture: cells of the lights, masks of what is outlined.

use crate::dashboard::{DisplayChannel, Layout, Mode, Model, Overlay};
use glam::DVec3;
use zerkalo_render::FirstHitBuffer;
use zerkalo_render::film::Window;
use zerkalo_scene::camera::CompiledCamera;
use zerkalo_scene::edit::{Target, bounds};
use zerkalo_scene::light::Light;
use zerkalo_terminal::cells::Raster;
use zerkalo_world::FirstHit;

/// Mark of a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightMark {
    /// Index of the light.
    pub light: usize,
    /// Column and row of the cell.
    pub cell: [u16; 2],
    /// Arrow in the direction of the light, and its cell.
    pub arrow: Option<(char, [u16; 2])>,
}

/// Arrows to the right and, by steps of 45 degrees, clockwise.
const ARROWS: [(char, [i16; 2]); 8] = [
    ('→', [1, 0]),
    ('↘', [1, 1]),
    ('↓', [0, 1]),
    ('↙', [-1, 1]),
    ('←', [-1, 0]),
    ('↖', [-1, -1]),
    ('↑', [0, -1]),
    ('↗', [1, -1]),
];

/// Length of the vector along the light, as a fraction of its distance from the eye, whose
/// projection gives the arrow.
const ARROW_SHARE: f64 = 0.05;

/// Image of a window of the film that is white where something is outlined.
pub type Mask = (Raster, Window);

/// Returns a function that returns `true` if the first hit of a camera ray is on the selection.
fn is_selected(model: &Model) -> impl Fn(&FirstHit) -> bool {
    let all = match &model.selection {
        Target::Part(i, _) => Target::Object(*i).solids(model.scene()),
        _ => Vec::new(),
    };
    let own = model.selection.solids(model.scene());
    let is_own = move |part: u32| all.get(part as usize).is_some_and(|solid| own.contains(solid));
    move |hit| is_on(model, hit, &is_own)
}

fn is_on(model: &Model, hit: &FirstHit, is_own_part: impl Fn(u32) -> bool) -> bool {
    let Some(index) = hit.object.map(|object| object as usize) else { return false };
    match &model.selection {
        Target::Object(selected) => *selected == index,
        Target::Part(selected, _) => *selected == index && is_own_part(hit.part),
        Target::Material(name) => {
            model.scene().objects.get(index).is_some_and(|object| object.names_material(name))
        }
        Target::Camera
        | Target::View(_)
        | Target::Group(_)
        | Target::Light(_)
        | Target::Settings(_) => false,
    }
}

impl Model {
    /// Returns what is outlined in the picture: the selection while it is marked, and the region that
    /// is rendered.
    pub fn outlined(&self) -> Vec<Mask> {
        let selected = self.selection_mask().filter(|_| self.shows_marks());
        let region = self.region.and_then(|region| {
            self.mask(|hits, i| {
                let [column, row] = [i % hits.columns, i / hits.columns];
                region.contains([
                    hits.window.pixel(0, column, hits.columns),
                    hits.window.pixel(1, row, hits.rows),
                ])
            })
        });
        selected.into_iter().chain(region).collect()
    }

    fn selection_mask(&self) -> Option<Mask> {
        let is_selected = is_selected(self);
        self.mask(|hits, i| is_selected(&hits.texels[i]))
    }

    /// Returns an image of the first hits that is white where `is_in` is `true`.
    fn mask(&self, is_in: impl Fn(&FirstHitBuffer, usize) -> bool) -> Option<Mask> {
        let hits = self.snapshot.as_ref()?.first_hits.as_deref()?;
        let white_if = |inside: bool| [if inside { 255 } else { 0 }; 3];
        Some((Raster::from_fn(hits.columns, hits.rows, |i| white_if(is_in(hits, i))), hits.window))
    }

    /// Returns the window of the film in which the selection is visible.
    pub fn selection_window(&self) -> Option<Window> {
        let (mask, window) = self.selection_mask()?;
        let inside = (0..mask.pixels.len()).filter(|i| mask.pixels[*i] == [255; 3]);
        let pixels = inside.map(|i| {
            let [column, row] = [i % mask.width, i / mask.width];
            [window.pixel(0, column, mask.width), window.pixel(1, row, mask.height)]
        });
        let ends = pixels.map(|pixel| [pixel, pixel]);
        let [low, high] = ends.reduce(|[low, high], [pixel, _]| {
            [[0, 1].map(|i| low[i].min(pixel[i])), [0, 1].map(|i| high[i].max(pixel[i]))]
        })?;
        Some(Window { origin: low, size: [0, 1].map(|i| high[i] - low[i] + 1) })
    }

    /// Returns `true` if the selection and the lights are marked: while the user works on something
    /// that has a place in the picture.
    pub fn shows_marks(&self) -> bool {
        let is_placed =
            !matches!(self.selection, Target::Camera | Target::View(_) | Target::Settings(_));
        let is_at_work =
            self.marks_until.is_some() || matches!(self.mode, Mode::Move | Mode::Rotate);
        let is_picture = self.channel == DisplayChannel::Beauty && self.mode != Mode::Probe;
        let is_covered = !matches!(self.overlay, None | Some(Overlay::Form(_)));
        is_placed && is_at_work && is_picture && !is_covered && !self.marks_off
    }

    /// Returns the marks of all lights that have a place in the picture; none while marks are
    /// hidden.
    pub fn light_marks(&self, layout: &Layout) -> Vec<LightMark> {
        let scene = self.seen();
        let camera = CompiledCamera::new(&scene.camera, scene.film.size, DVec3::ZERO);
        let cell = |point: DVec3| {
            let is_seen = camera.is_panorama() || (point - camera.eye).dot(camera.frame[2]) > 0.0;
            is_seen.then(|| camera.project(point))
        };
        let mark = |(light, desc): (usize, &Light)| {
            let direction = desc.direction().and_then(|d| DVec3::from(d).try_normalize());
            // A directional light has its mark where it comes from.
            let at = match desc.position() {
                Some(position) => DVec3::from(position),
                None => camera.eye - direction?,
            };
            let [from, to] =
                [Some(at), direction.map(|d| at + d * ARROW_SHARE * (at - camera.eye).length())];
            let place = cell(from?)?;
            let at = layout.cell_of(place)?;
            let arrow = to.and_then(cell).map(|to| arrow(at, [to[0] - place[0], to[1] - place[1]]));
            Some(LightMark { light, cell: at, arrow })
        };
        let lights = scene.lights.iter().enumerate().filter(|_| self.shows_marks());
        lights.filter_map(mark).collect()
    }

    /// Returns the position of the selected object or light, such as `0.50 0.33 -1.20`.
    pub fn place_of_selection(&self) -> Option<DVec3> {
        match &self.selection {
            Target::Light(i) => self.scene().lights.get(*i)?.position().map(DVec3::from),
            selection => Some(bounds(self.scene(), selection)?.center),
        }
    }
}

/// Returns the arrow in the direction \[pixels\] from the mark at `cell`, and the arrow's cell.
fn arrow([column, row]: [u16; 2], [right, down]: [f64; 2]) -> (char, [u16; 2]) {
    let octant = (4.0 * down.atan2(right) / std::f64::consts::PI).round().rem_euclid(8.0);
    let (arrow, [x, y]) = ARROWS[octant as usize % 8];
    (arrow, [column.saturating_add_signed(x), row.saturating_add_signed(y)])
}
