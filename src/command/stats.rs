//! Statistics of a render as JSON, written for `--stats`.

use serde::Serialize;

/// Contents of the file. Scripts rely on the keys.
#[derive(Debug, Serialize)]
pub struct Stats {
    /// Path as given on the command line.
    pub scene: String,
    /// Hash of the scene file and of the files that it names.
    pub scene_hash: String,
    pub output: String,
    pub version: &'static str,
    /// Width and height in pixels.
    pub size: [u32; 2],
    pub seed: u64,
    pub sampler: &'static str,
    /// `single` or `double`.
    pub precision: &'static str,
    /// Number type and width of SIMD lanes, such as `f32x8`.
    pub lanes: &'static str,
    pub threads: usize,
    pub adaptive: bool,
    /// Number of samples of all pixels.
    pub samples: u64,
    pub spp_min: u32,
    pub spp_mean: f64,
    pub spp_max: u32,
    /// Number of camera rays, shadow rays, and rays that continue a path.
    pub rays: u64,
    /// Seconds of rendering, without compilation and without writing.
    pub seconds: f64,
    pub compile_seconds: f64,
    /// Seconds of encoding, writing and syncing.
    pub write_seconds: f64,
    /// Seconds from the start of the program until the picture was written.
    pub total_seconds: f64,
    pub samples_per_second: f64,
    /// Seconds from the start of the program until every pixel has a sample.
    pub first_picture_seconds: Option<f64>,
    /// Estimated RMSE of the displayed picture. Null if the replicates A and B have never had equal
    /// numbers of samples.
    pub noise_levels: Option<f64>,
    /// 95th percentile of the tiles' estimated RMSE.
    pub noise_levels_p95: Option<f64>,
    pub rmse_linear: Option<f64>,
    /// Number of samples that were NaN or negative, and left out.
    pub bad_samples: u64,
    /// Number of samples that were clamped to the largest value of the film.
    pub saturated_samples: u64,
    /// Number of pixels whose sum was clamped to the largest value of the film.
    pub saturated_pixels: u64,
    /// One sentence for each limit that ends paths early, such as `max_depth`; empty for an
    /// unbiased picture.
    pub biased: Vec<String>,
    /// Peak resident memory. Null if the system does not report it.
    pub peak_rss_bytes: Option<u64>,
    /// `spp`, `noise`, `rmse`, `time`, `rays_per_pixel`, `full` (the film can hold no more samples)
    /// or `signal`.
    pub stopped_by: &'static str,
}

impl Stats {
    pub fn json(&self) -> String {
        serde_json::to_string_pretty(self).expect("plain numbers and strings") + "\n"
    }
}
