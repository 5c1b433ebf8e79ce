//! Picture of a session at the moment at which a task runs.

use crate::export::{Provenance, film_header};
use crate::film::file::{EncodedFilm, FilmFileHeader};
use crate::film::{Film, LightWeights, TileNoise};
use crate::session::active_render::ActiveRender;
use crate::session::report::Report;
use crate::{BOUNCE_SHARES, RenderState, checkpoint};
use zerkalo_scene::Scene;

/// Film of a session with its report.
pub struct Picture<'a> {
    pub film: &'a Film,
    pub weights: &'a LightWeights,
    pub report: &'a Report,
    pub(super) source: Source<'a>,
}

/// Source of a session's samples.
pub(super) enum Source<'a> {
    /// The session's render, and the threads that encode its checkpoints.
    Render(&'a ActiveRender, &'a rayon::ThreadPool),
    /// Watched film files. The header is that of their sum.
    Files(&'a FilmFileHeader),
}

impl<'a> Picture<'a> {
    /// Creates the header of a film file or image of the picture. `provenance` returns the origin
    /// of a rendered scene; watched films state their own origin.
    pub fn header(&self, provenance: impl FnOnce(&Scene) -> Provenance) -> FilmFileHeader {
        match self.source {
            Source::Render(render, _) => {
                film_header(&render.state, self.report, &provenance(render.state.scene()))
            }
            Source::Files(header) => header.clone(),
        }
    }

    /// Returns the state of the render. Returns `None` if the session watches films.
    pub(super) fn state(&self) -> Option<&'a RenderState> {
        match self.source {
            Source::Render(render, _) => Some(&render.state),
            Source::Files(_) => None,
        }
    }

    /// Traces the noisiest tiles for about `seconds`. Returns the shares in their noise of paths
    /// without a bounce, with one, with two, and with more. Returns `None` without noise, and if the
    /// session watches films.
    pub fn bounce_shares(&self, seconds: f64) -> Option<[f64; BOUNCE_SHARES]> {
        let Source::Render(render, pool) = self.source else { return None };
        let noise = |estimate: Option<TileNoise>| {
            estimate.map_or(0.0, |noise| noise.of_all().levels * f64::from(noise.pixels))
        };
        let noise: Vec<_> = render.schedule.tile_estimates().map(noise).collect();
        let mut tiles: Vec<_> = (0..noise.len()).filter(|tile| noise[*tile] > 0.0).collect();
        tiles.sort_by(|a, b| noise[*b].total_cmp(&noise[*a]));
        render.state.bounce_shares(&tiles, seconds, pool)
    }

    /// Encodes the render as a checkpoint. Returns `None` before the first picture, or if the
    /// session watches films.
    pub fn checkpoint(&self, provenance: &Provenance) -> Option<EncodedFilm> {
        match self.source {
            Source::Render(ActiveRender { state, schedule, first_picture_after, .. }, pool) => {
                first_picture_after
                    .map(|_| checkpoint::encode(state, schedule, self.report, provenance, pool))
            }
            Source::Files(_) => None,
        }
    }
}
