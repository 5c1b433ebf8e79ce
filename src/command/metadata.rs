//! What a picture file says about how it was made. Equal pictures say the same: no dates, no times,
//! no threads.

use super::args::RenderArgs;
use crate::film::Tone;
use crate::render::Rendering;
use crate::render::session::Report;

/// 64-bit FNV-1a hash of a scene's text, which tells whether a picture was made from it.
/// Fowler, Noll, Vo: offset basis and prime as in draft-eastlake-fnv.
pub fn scene_hash(text: &str) -> String {
    const OFFSET_BASIS: u64 = 0xcbf2_9ce4_8422_2325;
    const PRIME: u64 = 0x0000_0100_0000_01b3;
    let hash =
        text.bytes().fold(OFFSET_BASIS, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(PRIME));
    format!("fnv1a64:{hash:016x}")
}

/// Keys and values for the file.
pub fn of_picture(
    args: &RenderArgs,
    scene_hash: &str,
    rendering: &Rendering,
    report: &Report,
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
    let tone = Tone::NAMED.iter().find(|(_, tone)| *tone == args.tone).map_or("", |(name, _)| name);
    let header = rendering.film.header();
    let entries = [
        ("Software", format!("zerkalo {}", env!("CARGO_PKG_VERSION"))),
        ("Source", args.scene.display().to_string()),
        ("Scene hash", scene_hash.to_string()),
        ("Seed", header.seed.to_string()),
        ("Samples per pixel", format!("{:.2} ({}-{})", spp.mean, spp.min, spp.max)),
        ("Noise", noise),
        ("Bad samples", report.bad_samples.to_string()),
        ("Biased", if biases.is_empty() { "no".to_string() } else { biases.join("; ") }),
        (
            "Settings",
            format!(
                "sampler {}, lanes {}, {}, exposure {} EV, tone {}",
                args.sampler.kind().name(),
                header.precision,
                if args.uniform { "uniform" } else { "adaptive" },
                args.exposure,
                tone,
            ),
        ),
    ];
    entries.into_iter().map(|(key, value)| (key.to_string(), value)).collect()
}

#[cfg(test)]
mod tests {
    /// Test vectors of the FNV draft.
    #[test]
    fn the_hash_is_fnv_1a() {
        assert_eq!(super::scene_hash(""), "fnv1a64:cbf29ce484222325");
        assert_eq!(super::scene_hash("a"), "fnv1a64:af63dc4c8601ec8c");
        assert_eq!(super::scene_hash("foobar"), "fnv1a64:85944171f73967e8");
    }
}
