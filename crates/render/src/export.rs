//! Export of pictures as files, with metadata about their origin. The metadata hold no dates,
//! durations or numbers of threads, so that equal pictures have equal metadata.

use crate::film::file::FilmFileHeader;
use crate::film::{ByMeasure, Display};
use crate::render_state::RenderState;
use crate::session::Report;
use zerkalo_kernel::sampling::SamplerKind;
use zerkalo_scene::value::Fnv1a64;
use zerkalo_scene::{Scene, Tone};
use zerkalo_world::Precision;

/// Origin of a picture: the part of its metadata that is not in its [`RenderState`].
#[derive(Clone, Debug, PartialEq)]
pub struct Provenance {
    /// Path of the scene file as the user gave it.
    pub source: String,
    /// Value of [`scene_hash`].
    pub scene_hash: String,
    pub sampler: SamplerKind,
    pub adaptive: bool,
}

/// Returns the hash of a scene file's text and of the contents of its meshes and images: `fnv1a64:`
/// and 16 hexadecimal digits.
pub fn scene_hash(text: &str, scene: &Scene) -> String {
    let mut hash = Fnv1a64::default();
    hash.update(text.as_bytes());
    if let Some(contents) = scene.contents_hash() {
        hash.update(&contents.to_le_bytes());
    }
    format!("fnv1a64:{:016x}", hash.value())
}

/// Creates the header of a film file. `report` is the latest report on the film of `state`.
pub fn film_header(
    state: &RenderState,
    report: &Report,
    provenance: &Provenance,
) -> FilmFileHeader {
    FilmFileHeader {
        film: state.film.header.clone(),
        weights: state.weights.clone(),
        group_names: state.group_names(),
        display: state.display(),
        metadata: metadata(state, report, provenance),
        chunks: Default::default(),
    }
}

/// Returns keys and values of the metadata of a picture.
pub fn metadata(
    state: &RenderState,
    report: &Report,
    provenance: &Provenance,
) -> Vec<(String, String)> {
    let biases = &state.world.info().biases;
    let biased = if biases.is_empty() { "no".to_string() } else { biases.join("; ") };
    let header = &state.film.header;
    let (sampler, adaptive) = (provenance.sampler.name(), provenance.adaptive);
    let origin = [
        ("Software", format!("zerkalo {}", env!("CARGO_PKG_VERSION"))),
        ("Source", provenance.source.clone()),
        ("Scene hash", provenance.scene_hash.clone()),
        ("Camera", state.scene().camera.to_inline_table()),
        ("Seed", header.seed.to_string()),
    ];
    let settings = settings_text(sampler, header.precision, adaptive, &state.display());
    let method = [("Biased", biased), (SETTINGS, settings)];
    let entries = origin.into_iter().chain(film_entries(report)).chain(method);
    entries.map(|(key, value)| (key.to_string(), value)).collect()
}

/// Formats the value of the metadata entry `Settings`.
pub fn settings_text(
    sampler: &str,
    precision: Precision,
    adaptive: bool,
    display: &Display,
) -> String {
    let allocation = if adaptive { "adaptive" } else { "uniform" };
    let display = display_text(display);
    format!("sampler {sampler}, {} precision, {allocation}{display}", precision.name())
}

fn display_text(display: &Display) -> String {
    format!("{DISPLAY}{} EV, tone {}", display.exposure_ev, display.tone.name())
}

/// Key of the metadata entry with sampler, precision, sample allocation and display transform.
const SETTINGS: &str = "Settings";
/// Key of the metadata entry of a picture that contains samples of another roughness.
const MIXED: &str = "Roughness mix";
/// Text that precedes the display transform in the value of [`SETTINGS`].
const DISPLAY: &str = ", exposure ";

/// Returns the metadata entries about samples and noise. Only a render that ends at its error
/// states it: parts of it are not measured in regions, in merged parts and after other targets, and
/// equal pictures have equal files.
fn film_entries(report: &Report) -> impl Iterator<Item = (&'static str, String)> {
    let spp = &report.spp;
    let noise = match report.noise {
        Some(n) => format!(
            "{:.4} 8-bit levels, {:.4} in 95% of the tiles, linear RMSE {:.6e}",
            n.rmse.levels, n.p95_levels, n.rmse.linear
        ),
        None => "unknown".to_string(),
    };
    let error = report.error.as_ref().filter(|error| error.is_target);
    [("Samples per pixel", format!("{:.2} ({}-{})", spp.mean, spp.min, spp.max)), ("Noise", noise)]
        .into_iter()
        .chain(error.map(|error| ("Error", error.to_string())))
        .chain(report.mixed.then(|| (MIXED, "samples of a smaller roughness are included".into())))
        .chain([
            ("Bad samples", report.bad_samples.to_string()),
            ("Saturated samples", report.saturated_samples.to_string()),
            ("Saturated pixels", report.saturated_pixels.to_string()),
        ])
}

/// Parses the display transform in the value of the metadata entry `Settings`.
pub fn display_of_text(settings: &str) -> Option<Display> {
    let (_, display) = settings.split_once(DISPLAY)?;
    let (exposure, tone) = display.split_once(" EV, tone ")?;
    Some(Display { exposure_ev: exposure.parse().ok()?, tone: Tone::from_name(tone)? })
}

/// Parses the value of the metadata entry `Noise`; `None` if the noise is unknown.
pub fn noise_of_text(text: &str) -> Option<ByMeasure> {
    let (levels, rest) = text.split_once(" 8-bit levels")?;
    let (_, linear) = rest.split_once("linear RMSE ")?;
    Some(ByMeasure { levels: levels.parse().ok()?, linear: linear.parse().ok()? })
}

/// Updates the metadata of `header`: samples and noise from `report`, the display transform from
/// `header` itself.
pub fn update_metadata(header: &mut FilmFileHeader, report: &Report) {
    for (key, value) in film_entries(report) {
        header
            .metadata
            .iter_mut()
            .filter(|(k, _)| k == key)
            .for_each(|(_, v)| v.clone_from(&value));
    }
    for (_, settings) in header.metadata.iter_mut().filter(|(key, _)| key == SETTINGS) {
        if let Some(end) = settings.find(DISPLAY) {
            settings.truncate(end);
            *settings += &display_text(&header.display);
        }
    }
}
