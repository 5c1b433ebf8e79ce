//! Statistics of a render as JSON, written for `--stats`.

use crate::command::args::RenderArgs;
use crate::command::render::Rendered;
use serde_json::json;
use std::time::Duration;
use zerkalo_render::ErrorParts;
use zerkalo_render::schedule::StoppedBy;
use zerkalo_scene::process_memory::resident_memory;

/// Returns the contents of the `--stats` file. Scripts rely on the keys.
///
/// `scene_hash` is the hash of the scene file and of the files that it names, `total` the time from
/// the start of the program until the picture was written.
pub fn json(
    args: &RenderArgs,
    scene_hash: &str,
    size: [u32; 2],
    rendered: &Rendered,
    total: Duration,
) -> String {
    let report = &rendered.report;
    let error = report.error.as_ref();
    let first_picture = report.first_picture_seconds;
    let stats = json!({
        "scene": args.scene.display().to_string(),
        "scene_hash": scene_hash,
        "output": args.output.display().to_string(),
        "version": env!("CARGO_PKG_VERSION"),
        "size": size,
        "seed": args.compute.seed,
        "sampler": args.sampler.name(),
        "precision": rendered.precision.name(),
        "lanes": report.lanes,
        "threads": args.compute.threads(),
        "adaptive": !args.uniform,
        "samples": report.samples,
        "spp_min": report.spp.min,
        "spp_mean": report.spp.mean,
        "spp_max": report.spp.max,
        "rays": report.rays,
        "seconds": report.seconds,
        "compile_seconds": report.compile_seconds,
        // Seconds of encoding, writing and syncing.
        "write_seconds": rendered.write_seconds,
        "total_seconds": total.as_secs_f64(),
        "samples_per_second": report.samples_per_second(),
        // Seconds from the start of the program until every pixel has a sample.
        "first_picture_seconds": first_picture.map(|s| s + rendered.set_after.as_secs_f64()),
        // Null if the replicates A and B have never had equal numbers of samples.
        "noise_levels": report.noise.map(|n| n.rmse.levels),
        "noise_levels_p95": report.noise.map(|n| n.p95_levels),
        "rmse_linear": report.noise.map(|n| n.rmse.linear),
        // Parts of the error in 8-bit levels. Null if they have no bound or were not measured.
        "error_levels": error.filter(|e| !e.is_open()).map(ErrorParts::total),
        "rounding_levels": error.and_then(|e| e.rounding),
        "cut_paths_levels": error.and_then(|e| e.cut_paths).filter(|levels| levels.is_finite()),
        "quantization_levels": error.map(|e| e.quantization),
        "left_out": error.map(|e| &e.left_out),
        "probe_seconds": report.probe_seconds[0],
        // Seconds of compiling the scene in double precision for the error probes.
        "probe_compile_seconds": report.probe_seconds[1],
        "bad_samples": report.bad_samples,
        "saturated_samples": report.saturated_samples,
        "saturated_pixels": report.saturated_pixels,
        "biased": rendered.biased,
        // Null if the system does not report it.
        "peak_rss_bytes": resident_memory().map(|resident| resident.peak),
        "stopped_by": rendered.end.map_or("signal", StoppedBy::name),
    });
    format!("{stats:#}\n")
}
