//! `--stats`: statistics of a run as JSON.

use serde::Serialize;
use std::fs;
use std::path::Path;

/// Contents of the file of `--stats`. Scripts rely on the keys: they stay.
#[derive(Debug, Serialize)]
pub struct Stats {
    /// The scene file as named on the command line.
    pub scene: String,
    /// Hash of its contents, as in the picture's metadata.
    pub scene_hash: String,
    /// The picture file.
    pub output: String,
    /// Version of the program.
    pub version: &'static str,
    /// Width and height in pixels.
    pub size: [u32; 2],
    pub seed: u64,
    pub sampler: &'static str,
    /// The precision used: `single` or `double`.
    pub precision: &'static str,
    /// Lane type, such as `f32x8`.
    pub lanes: &'static str,
    pub threads: usize,
    pub adaptive: bool,
    /// Over all pixels.
    pub samples: u64,
    pub spp_min: u32,
    pub spp_mean: f64,
    pub spp_max: u32,
    /// Camera, shadow and reflected rays.
    pub rays: u64,
    /// Rendering alone, by a monotonic clock.
    pub seconds: f64,
    pub compile_seconds: f64,
    /// Encoding, writing and syncing the picture.
    pub write_seconds: f64,
    /// From the start of the program to the end of writing.
    pub total_seconds: f64,
    pub samples_per_second: f64,
    /// From the start of the program to one sample in every pixel.
    pub first_picture_seconds: Option<f64>,
    /// Estimated RMSE as displayed, in 8-bit levels; null if A and B never had equal counts.
    pub noise_codes: Option<f64>,
    /// 95th percentile of the tiles' RMSE, in 8-bit levels.
    pub noise_codes_p95: Option<f64>,
    pub rmse_linear: Option<f64>,
    /// Samples left out because they were NaN or negative.
    pub bad_samples: u64,
    /// Samples brighter than the film can hold; stored with its largest value.
    pub saturated_samples: u64,
    /// Pixels with a sum that has reached its limit.
    pub saturated_pixels: u64,
    /// Peak resident memory; null where the system does not report it.
    pub peak_rss_bytes: Option<u64>,
    /// `spp`, `noise`, `rmse`, `time`, `rays_per_pixel`, `full` or `signal`.
    pub stopped_by: &'static str,
}

impl Stats {
    /// Writes the file.
    pub fn write(&self, path: &Path) -> Result<(), String> {
        let json = serde_json::to_string_pretty(self).expect("plain numbers and strings");
        let shown = path.display();
        fs::write(path, json + "\n").map_err(|e| format!("cannot write {shown}: {e}"))
    }
}

/// Peak resident memory of the process in bytes, from Linux's `/proc`.
pub fn peak_rss_bytes() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kibibytes * 1024)
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    #[test]
    fn peak_memory_includes_a_large_block() {
        let before = super::peak_rss_bytes().unwrap();
        let block = std::hint::black_box(vec![1u8; 64 << 20]);
        assert!(super::peak_rss_bytes().unwrap() >= before.max(block.len() as u64));
    }
}
