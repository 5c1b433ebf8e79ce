//! Picture files of a rendering, and what they say about how it was made. Equal pictures say the
//! same: no dates, no times, no threads.

use crate::film::{Depth, Display, ImageData, ImageOutput, Tone, WriteError};
use crate::render::render_state::RenderState;
use crate::render::session::Report;
use crate::sampling::SamplerKind;
use crate::value::fnv1a64;

/// How a picture came to be, as far as its rendering does not know.
#[derive(Clone, Debug, PartialEq)]
pub struct Provenance {
    /// The scene file, as the user named it.
    pub source: String,
    /// [`scene_hash`] of its text.
    pub scene_hash: String,
    /// Where samples lie.
    pub sampler: SamplerKind,
    /// Whether noisy tiles got more samples than others.
    pub adaptive: bool,
}

impl RenderState {
    /// Writes the picture as it stands, with its metadata. `report`: about this very film.
    pub fn write(
        &self,
        report: &Report,
        origin: &Provenance,
        display: Display,
        depth: Depth,
        target: &ImageOutput,
    ) -> Result<(), WriteError> {
        target.write(&ImageData {
            film: &self.film,
            mix: &self.mix,
            group_names: &self.group_names(),
            display,
            depth,
            metadata: &metadata(self, report, origin, &display),
        })
    }
}

/// A hash of a scene's text, which tells whether a picture was made from it.
pub fn scene_hash(text: &str) -> String {
    format!("fnv1a64:{:016x}", fnv1a64(text.as_bytes()))
}

/// Keys and values for the file.
fn metadata(
    rendering: &RenderState,
    report: &Report,
    origin: &Provenance,
    display: &Display,
) -> Vec<(String, String)> {
    let spp = &report.spp;
    let noise = match report.noise {
        Some(n) => format!(
            "{:.4} codes, {:.4} codes in 95% of the tiles, linear RMSE {:.6e}",
            n.rmse_codes, n.p95_codes, n.rmse_linear
        ),
        None => "unknown".to_string(),
    };
    let biases = rendering.world.biases();
    let tone =
        Tone::NAMED.iter().find(|(_, tone)| *tone == display.tone).map_or("", |(name, _)| name);
    let header = rendering.film.header();
    let entries = [
        ("Software", format!("zerkalo {}", env!("CARGO_PKG_VERSION"))),
        ("Source", origin.source.clone()),
        ("Scene hash", origin.scene_hash.clone()),
        ("Seed", header.seed.to_string()),
        ("Samples per pixel", format!("{:.2} ({}-{})", spp.mean, spp.min, spp.max)),
        ("Noise", noise),
        ("Bad samples", report.bad_samples.to_string()),
        ("Saturated samples", report.saturated_samples.to_string()),
        ("Saturated pixels", report.saturated_pixels.to_string()),
        ("Biased", if biases.is_empty() { "no".to_string() } else { biases.join("; ") }),
        (
            "Settings",
            format!(
                "sampler {}, {} precision, {}, exposure {} EV, tone {}",
                origin.sampler.name(),
                header.precision,
                if origin.adaptive { "adaptive" } else { "uniform" },
                display.exposure_ev,
                tone,
            ),
        ),
    ];
    entries.into_iter().map(|(key, value)| (key.to_string(), value)).collect()
}
