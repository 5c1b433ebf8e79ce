//! Commands that zoom the film in its panel, and that show or hide the loupe.

use crate::dashboard::graphics::Graphics;
use crate::dashboard::layout::{PixelGrid, Zoom};
use crate::dashboard::loupe::LoupeMode;
use crate::dashboard::update::{Direction, cycled};
use crate::dashboard::{Effect, Layout, Overlay, UpdateContext};
use zerkalo_render::film::Window;
use zerkalo_render::session::View;
use zerkalo_terminal::Capabilities;
use zerkalo_terminal::event::Mouse;
use zerkalo_terminal::image::GraphicsMode;

/// Largest zoom: a film pixel is eight half cells wide.
const LARGEST: i32 = 3;
/// Length of one step of panning, as a fraction of the window.
const PAN_SHARE: f64 = 0.125;

impl UpdateContext<'_> {
    /// Zooms by `steps` factors of two. The film pixel `at` stays in its place; without it, the
    /// probe or else the target of the loupe becomes the centre.
    pub(super) fn zoom(&mut self, steps: i32, at: Option<[f64; 2]>) {
        let Some(layout) = self.model.layout() else { return };
        let scale = layout.raster[0] as f64 / layout.window.size[0] as f64;
        let old = match self.model.zoom {
            Some(zoom) => zoom.steps,
            // The next power of two is a step away.
            None if steps > 0 => (self.model.fitting_scale().log2() + 0.1).floor() as i32,
            None => return self.say("The whole picture is visible already"),
        };
        let new = (old + steps).min(LARGEST);
        if f64::from(new).exp2() <= self.model.fitting_scale() {
            return self.zoom_fits();
        }
        let middle = |i: usize| layout.window.origin[i] as f64 + 0.5 * layout.window.size[i] as f64;
        let old_center = [middle(0), middle(1)];
        let loupe = self.model.loupe(&layout).and(self.model.loupe.target);
        let aim = self.model.probe.or(loupe.filter(|_| self.model.zoom.is_none()));
        let center = match (at, aim) {
            (Some(at), _) => {
                let factor = scale / f64::from(new).exp2();
                [0, 1].map(|i| at[i] + (old_center[i] - at[i]) * factor)
            }
            (None, Some(pixel)) => pixel.map(|n| n as f64 + 0.5),
            (None, None) => old_center,
        };
        self.model.zoom = Some(Zoom { steps: new, center });
        self.say(match new {
            ..0 => format!("zoom: {} pixels of the film across a half block", 1 << -new),
            0 => "zoom: one pixel of the film in a half block".to_string(),
            _ => format!("zoom: {} half blocks across a pixel of the film", 1 << new),
        });
    }

    pub(super) fn zoom_fits(&mut self) {
        self.model.zoom = None;
        self.say("zoom: the whole picture");
    }

    /// Orbits the camera, pans the picture if it is zoomed, or moves the border of a wipe.
    pub(super) fn orbit_or_pan(&mut self, direction: Direction) {
        if direction[0] != 0.0 && self.wipe(|border| border + direction[0] / 32.0) {
            return;
        }
        match (self.model.zoom, self.model.layout()) {
            (Some(_), Some(Layout { window, .. })) => {
                let [right, up, _] = direction;
                let [width, height] = window.size.map(|n| n as f64 * PAN_SHARE);
                self.pan_zoomed([right * width, -up * height]);
            }
            _ => self.orbit(direction),
        }
    }

    /// Moves the film with a drag in half cells. Returns `false` if the picture is not zoomed.
    pub(super) fn drag_zoomed(&mut self, right: f64, down: f64) -> bool {
        let scale = self.model.zoom.map(|zoom| f64::from(zoom.steps).exp2());
        scale.into_iter().for_each(|scale| self.pan_zoomed([-right / scale, -down / scale]));
        scale.is_some()
    }

    /// Moves the window by film pixels (right, down), as far as the film reaches.
    fn pan_zoomed(&mut self, by: [f64; 2]) {
        let film = self.scene().film.size.map(f64::from);
        let Some(Layout { window, .. }) = self.model.layout() else { return };
        let Some(zoom) = &mut self.model.zoom else { return };
        for i in 0..2 {
            let half = 0.5 * window.size[i] as f64;
            zoom.center[i] = (zoom.center[i] + by[i]).clamp(half, (film[i] - half).max(half));
        }
    }

    /// Moves the zoomed window to the probe if that has left it.
    pub(super) fn follow_probe(&mut self) {
        let layout = self.model.layout();
        if let (Some(zoom), Some(pixel), Some(layout)) =
            (&mut self.model.zoom, self.model.probe, layout)
            && !layout.window.contains(pixel)
        {
            zoom.center = pixel.map(|n| n as f64 + 0.5);
        }
    }

    /// Zooms by the wheel with Ctrl or Alt, or over the loupe. Returns `false` for any other event.
    pub(super) fn zoom_by_wheel(&mut self, ticks: i32, mouse: Mouse) -> bool {
        let Some(layout) = self.model.layout() else { return false };
        let at = (mouse.column, mouse.row).into();
        let loupe = self.model.loupe(&layout).filter(|loupe| loupe.frame.contains(at));
        if loupe.is_none() && !(mouse.modified && layout.image.contains(at)) {
            return false;
        }
        let pixel = layout.film_pixel(mouse.column, mouse.row).filter(|_| loupe.is_none());
        self.zoom(ticks.signum(), pixel.map(|pixel| pixel.map(|n| n as f64)));
        true
    }

    pub(super) fn next_loupe(&mut self) {
        let current = |(mode, _): &(LoupeMode, _)| *mode == self.model.loupe.mode;
        let (mode, name) = *cycled(&LoupeMode::NAMED, current, 1);
        self.model.loupe.mode = mode;
        self.repaint();
        self.say(format!("loupe: {name}"));
    }

    /// Limits the render to what is visible while zoomed, else to the selection, else to what the
    /// loupe shows; or ends the limit.
    pub(super) fn toggle_region(&mut self) {
        let Some(layout) = self.model.layout() else { return };
        if self.model.region.take().is_some() {
            return self.say("the whole picture is rendered");
        }
        let zoomed = self.model.zoom.map(|_| layout.window);
        let window = zoomed.or_else(|| self.model.selection_window());
        let loupe = || self.model.loupe(&layout).map(|loupe| loupe.window);
        self.model.region = window.or_else(loupe);
        match self.model.region {
            Some(_) => self.say("only this region is rendered, the rest stays · Alt-r: everything"),
            None => self.refuse("Zoom in (Z) or select an object: that becomes the region"),
        }
    }

    /// Takes over what the terminal reports of itself, or the next protocol for the picture.
    pub(super) fn set_graphics(&mut self, terminal: Capabilities) {
        self.model.graphics = Graphics::new(terminal, self.model.graphics.mode);
        self.repaint();
    }

    pub(super) fn next_graphics(&mut self) {
        let current = |(_, mode): &(_, GraphicsMode)| *mode == self.model.graphics.mode;
        let (name, mode) = *cycled(&GraphicsMode::NAMED, current, 1);
        self.model.graphics = Graphics::new(self.model.graphics.terminal.clone(), mode);
        self.repaint();
        self.say(format!("graphics {name}: {}", self.model.graphics.description()));
    }

    /// Requests the parts of snapshots that the screen shows, if they have changed.
    pub(super) fn request_view(&mut self) {
        let Some(layout) = self.model.layout() else { return };
        let loupe = self.model.loupe(&layout).map(|loupe| (loupe.window, loupe.window.size));
        let pixels = layout.pixels.map(|PixelGrid { window, size, .. }| {
            (window, [0, 1].map(|i| size[i].min(window.size[i])))
        });
        let is_viewer = matches!(self.model.overlay, Some(Overlay::ViewerImage(_)));
        // The film may have become smaller.
        let film = self.scene().film.size.map(|n| n as usize);
        let is_inside =
            |region: &Window| (0..2).all(|i| region.origin[i] + region.size[i] <= film[i]);
        self.model.region = self.model.region.filter(is_inside);
        let view = View {
            raster: Some([0, 1].map(|i| layout.texels[i].min(layout.window.size[i]))),
            window: Some(layout.window),
            // Outlines are smooth between the pixels of the mask.
            hits: pixels.map(|(_, size)| size.map(|n| n.div_ceil(2))),
            detail: pixels.or(loupe).or(self.model.requested.detail.filter(|_| is_viewer)),
            region: self.model.region,
            probe: self.model.probe,
        };
        let old = std::mem::replace(&mut self.model.requested, view);
        if old != view {
            self.emit(Effect::View(view));
        }
        let shown = |view: &View| (view.raster, view.window, view.region);
        if shown(&old) != shown(&view) {
            self.repaint();
        }
    }
}
