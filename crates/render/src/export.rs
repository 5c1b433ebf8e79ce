//! Export of pictures as files, with metadata about their origin. The metadata hold no dates,
//! durations or numbers of threads, so that equal pictures have equal metadata.

use crate::film::Display;
use crate::film::file::FilmFileHeader;
use crate::image_file::{Depth, ImageData, ImageOutput, WholeFilm};
use crate::render_state::RenderState;
use crate::session::Report;
use zerkalo_kernel::sampling::SamplerKind;
use zerkalo_scene::Scene;
use zerkalo_scene::disk::WriteError;
use zerkalo_scene::value::Fnv1a64;

/// Origin of a picture: the metadata that its [`RenderState`] does not have.
#[derive(Clone, Debug, PartialEq)]
pub struct Provenance {
    /// Path of the scene file as the user gave it.
    pub source: String,
    /// Hash of the scene file's text and of the contents of meshes and images; see [`scene_hash`].
    pub scene_hash: String,
    /// Kind of the random numbers of samples.
    pub sampler: SamplerKind,
    /// `true` if the picture was rendered with adaptive sampling.
    pub adaptive: bool,
}

impl RenderState {
    /// Writes the current picture with its metadata to `output`. `report` is the latest report on
    /// the film; its sample counts and noise become metadata.
    ///
    /// # Errors
    /// Fails if the file cannot be written.
    pub fn write(
        &self,
        report: &Report,
        provenance: &Provenance,
        display: Display,
        depth: Depth,
        output: &ImageOutput,
    ) -> Result<(), WriteError> {
        let metadata = &metadata(self, report, provenance, &display);
        let group_names = &self.group_names();
        let picture =
            ImageData { size: self.scene().film.size, mix: &self.mix, group_names, display, depth };
        output.write(&picture, &mut WholeFilm { film: &self.film, metadata })
    }
}

/// Returns the hash that identifies the scene of a picture, preceded by the name of the hash
/// algorithm. The hash covers the text of the scene file and the contents of its meshes and images.
pub fn scene_hash(text: &str, scene: &Scene) -> String {
    let mut hash = Fnv1a64::default();
    hash.update(text.as_bytes());
    if let Some(contents) = scene.contents_hash() {
        hash.update(&contents.to_le_bytes());
    }
    format!("fnv1a64:{:016x}", hash.value())
}

/// Creates the header of a film file for the film of `state`. `report` is the latest report on this
/// film.
pub fn film_header(
    state: &RenderState,
    report: &Report,
    provenance: &Provenance,
    display: Display,
) -> FilmFileHeader {
    FilmFileHeader {
        film: state.film.header().clone(),
        weights: state.mix.clone(),
        group_names: state.group_names(),
        display,
        metadata: metadata(state, report, provenance, &display),
        chunks: Default::default(),
    }
}

/// Returns the metadata of a picture file as pairs of key and value.
pub fn metadata(
    rendering: &RenderState,
    report: &Report,
    provenance: &Provenance,
    display: &Display,
) -> Vec<(String, String)> {
    let biases = rendering.world.biases();
    let biased = if biases.is_empty() { "no".to_string() } else { biases.join("; ") };
    let header = rendering.film.header();
    let (sampler, adaptive) = (provenance.sampler.name(), provenance.adaptive);
    let origin = [
        ("Software", format!("zerkalo {}", env!("CARGO_PKG_VERSION"))),
        ("Source", provenance.source.clone()),
        ("Scene hash", provenance.scene_hash.clone()),
        ("Seed", header.seed.to_string()),
    ];
    let settings = settings_text(sampler, &header.precision, adaptive, display);
    let method = [("Biased", biased), (SETTINGS, settings)];
    let entries = origin.into_iter().chain(film_entries(report)).chain(method);
    entries.map(|(key, value)| (key.to_string(), value)).collect()
}

/// Formats the picture metadata entry `Settings`: sampler, precision, sample allocation, display
/// transform.
pub fn settings_text(sampler: &str, precision: &str, adaptive: bool, display: &Display) -> String {
    let allocation = if adaptive { "adaptive" } else { "uniform" };
    let display = display_text(display);
    format!("sampler {sampler}, {precision} precision, {allocation}{display}")
}

/// Formats the end of the metadata entry [`SETTINGS`]: the display transform.
fn display_text(display: &Display) -> String {
    format!("{DISPLAY}{} EV, tone {}", display.exposure_ev, display.tone)
}

/// Key of the metadata entry that holds sampler, precision, sample allocation and display
/// transform.
const SETTINGS: &str = "Settings";
/// Text before the display transform in the metadata entry [`SETTINGS`].
const DISPLAY: &str = ", exposure ";

/// Returns the metadata entries of a picture that depend on the film alone: samples per pixel,
/// noise, and the numbers of bad samples (NaN or negative) and of saturated samples (above the
/// film's limit).
fn film_entries(report: &Report) -> [(&'static str, String); 5] {
    let spp = &report.spp;
    let noise = match report.noise {
        Some(n) => format!(
            "{:.4} 8-bit levels, {:.4} in 95% of the tiles, linear RMSE {:.6e}",
            n.rmse_levels, n.p95_levels, n.rmse_linear
        ),
        None => "unknown".to_string(),
    };
    [
        ("Samples per pixel", format!("{:.2} ({}-{})", spp.mean, spp.min, spp.max)),
        ("Noise", noise),
        ("Bad samples", report.bad_samples.to_string()),
        ("Saturated samples", report.saturated_samples.to_string()),
        ("Saturated pixels", report.saturated_pixels.to_string()),
    ]
}

/// Replaces the entries about samples and noise in `metadata` by the values of `report`. They are
/// the entries that `film_entries` returns.
pub fn update_metadata(metadata: &mut [(String, String)], report: &Report) {
    for (key, value) in film_entries(report) {
        metadata.iter_mut().filter(|(k, _)| k == key).for_each(|(_, v)| v.clone_from(&value));
    }
}

/// Replaces the display transform in the metadata of a picture by `display`.
pub fn update_display(metadata: &mut [(String, String)], display: &Display) {
    for (_, settings) in metadata.iter_mut().filter(|(key, _)| key == SETTINGS) {
        if let Some(end) = settings.find(DISPLAY) {
            settings.truncate(end);
            *settings += &display_text(display);
        }
    }
}
