//! Output of films that belong to a plan.

use crate::command::Failure;
use crate::command::progress::{counts, noise};
use std::fs::File;
use std::path::{Path, PathBuf};
use zerkalo_render::export::{Provenance, film_header};
use zerkalo_render::film::Film;
use zerkalo_render::film::file::{EncodedFilm, FilmFileHeader};
use zerkalo_render::image_file::{Depth, ImageOutput};
use zerkalo_render::plan::{Part, ShardRender};
use zerkalo_render::session::Report;
use zerkalo_scene::disk::{Existing, Replacement, WriteError};

/// Output of a film: a film file or a picture file.
pub enum FilmOutput {
    Film(PathBuf, Existing),
    /// Picture file with the bits per channel of a PNG.
    Picture(ImageOutput, Depth),
}

impl FilmOutput {
    /// Chooses the format by the extension of `path`, and checks that the file can be written.
    pub fn new(path: &Path, depth: Depth, existing: Existing) -> Result<Self, Failure> {
        if is_film(path) {
            Replacement::begin(path, existing)?;
            return Ok(Self::Film(path.to_path_buf(), existing));
        }
        let mut output = ImageOutput::from_path(path)
            .map_err(|error| Failure::Usage(format!("{error}; a film has the extension .zk")))?;
        output.existing = existing;
        output.check_writable()?;
        Ok(Self::Picture(output, depth))
    }

    /// Writes `film`. A picture uses the light weights, the display transform and the metadata of
    /// `header`. Returns the file with its lock.
    pub fn write(&self, film: &Film, header: &FilmFileHeader) -> Result<File, WriteError> {
        match self {
            Self::Film(path, existing) => {
                EncodedFilm::new(header, film, None).write(path, *existing)
            }
            Self::Picture(output, depth) => output.write(header, *depth, &mut &*film),
        }
    }
}

pub fn is_film(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("zk"))
}

/// File of a part that was written.
pub struct Written {
    /// The file with its lock.
    pub file: File,
    pub report: Report,
}

/// Writes the film of `render`, which holds the samples of `part`.
pub fn write(
    output: &FilmOutput,
    render: &ShardRender,
    part: &Part,
) -> Result<Written, WriteError> {
    let state = &render.state;
    let settings = &part.plan.settings;
    let provenance = Provenance {
        source: settings.source.clone(),
        scene_hash: settings.scene_hash.clone(),
        sampler: settings.sampler,
        adaptive: true,
    };
    let report = Report::of_film(&state.film, &state.weights, &settings.display);
    let mut header = film_header(state, &report, &provenance);
    part.record(&mut header);
    render.record(&mut header, part.is_complete());
    output.write(&state.film, &header).map(|file| Written { file, report })
}

/// Formats sample counts and noise, such as `212 spp (32-900) noise 0.250 8-bit levels`.
pub fn summary(report: &Report) -> String {
    format!("{}  {}", counts(report), noise(report))
}
