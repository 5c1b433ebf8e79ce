//! Statistics of a render as JSON, written for `--stats`.

use serde::Serialize;

/// Contents of the statistics file (JSON). The keys must not change, because scripts rely on them.
#[derive(Debug, Serialize)]
pub struct Stats {
    /// Path of the scene file as given on the command line.
    pub scene: String,
    /// Hash of the scene file and of the meshes and images that it names, as in the metadata of the
    /// picture.
    pub scene_hash: String,
    /// Path of the picture file.
    pub output: String,
    /// Version of the program.
    pub version: &'static str,
    /// Width and height of the picture in pixels.
    pub size: [u32; 2],
    pub seed: u64,
    pub sampler: &'static str,
    /// Floating-point precision of the render: `single` or `double`.
    pub precision: &'static str,
    /// Number type and width of SIMD lanes, such as `f32x8`.
    pub lanes: &'static str,
    pub threads: usize,
    pub adaptive: bool,
    /// Number of samples of the picture, summed over all pixels.
    pub samples: u64,
    pub spp_min: u32,
    pub spp_mean: f64,
    pub spp_max: u32,
    /// Number of all traced rays: camera rays, shadow rays, and rays that continue a path.
    pub rays: u64,
    /// Seconds of rendering by a monotonic clock, without the compilation of the scene and without
    /// the writing of the picture.
    pub seconds: f64,
    pub compile_seconds: f64,
    /// Seconds of encoding, writing and syncing the picture.
    pub write_seconds: f64,
    /// Seconds from the start of the program until the picture was written.
    pub total_seconds: f64,
    pub samples_per_second: f64,
    /// Seconds from the start of the program until every pixel has a sample. Null if some pixel has
    /// none.
    pub first_picture_seconds: Option<f64>,
    /// Estimated RMSE of the displayed picture, in 8-bit levels. It is estimated from the
    /// difference between two halves of the samples, the replicates A and B. Null if A and B have
    /// never had equal numbers of samples.
    pub noise_levels: Option<f64>,
    /// 95th percentile of the tiles' estimated RMSE, in 8-bit levels.
    pub noise_levels_p95: Option<f64>,
    pub rmse_linear: Option<f64>,
    /// Number of samples that are not in the picture because they were NaN or negative.
    pub bad_samples: u64,
    /// Number of samples that were clamped to the largest value that the film can hold.
    pub saturated_samples: u64,
    /// Number of pixels whose sum of samples was clamped to the largest value of the film.
    pub saturated_pixels: u64,
    /// One sentence for each limit that ends paths early, such as `max_depth`, as in the picture's
    /// metadata. Empty if no path ends early; the picture is unbiased then.
    pub biased: Vec<String>,
    /// Peak resident memory in bytes. Null on systems that do not report it.
    pub peak_rss_bytes: Option<u64>,
    /// Stop criterion that ended the render: `spp`, `noise`, `rmse`, `time`, `rays_per_pixel`,
    /// `full` (the film can hold no more samples) or `signal`.
    pub stopped_by: &'static str,
}

impl Stats {
    /// Serialises the statistics as JSON.
    pub fn json(&self) -> String {
        serde_json::to_string_pretty(self).expect("plain numbers and strings") + "\n"
    }
}
