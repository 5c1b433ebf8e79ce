//! Memory that a render needs, compared with the memory that is available.
//!
//! A failed allocation ends the program; the picture and the edits made in the dashboard are then
//! lost. The needed memory is therefore compared with every known limit before a film is created.

use crate::film::{Film, TILE};
use zerkalo_scene::process_memory::{
    Available, ResidentMemory, available_memory, megabytes, resident_memory,
};

/// Memory for a linear copy of the picture, in addition to the film \[bytes per pixel\].
const COPY_BYTES: u64 = 16;
/// Memory \[bytes\] of a tile in addition to its sums: its entry in the schedule and its estimate.
const TILE_BYTES: u64 = 512;

/// Returns the memory \[bytes\] that a render needs.
pub fn needed(size: [u32; 2], groups: usize) -> u64 {
    let [width, height] = size.map(u64::from);
    let tiles = width.div_ceil(TILE as u64) * height.div_ceil(TILE as u64);
    Film::memory_bytes(size, groups) + COPY_BYTES * width * height + TILE_BYTES * tiles
}

/// Checks that a render fits into the available memory, and otherwise returns a message with a
/// remedy. `reusable` is the memory \[bytes\] of an earlier film, which the new film takes over.
pub fn check(size: [u32; 2], groups: usize, reusable: u64) -> Result<(), String> {
    let Some(available) = available_memory() else { return Ok(()) };
    let bytes = available.bytes.saturating_add(reusable);
    compare(size, groups, Available { bytes, ..available })
}

fn compare(size: [u32; 2], groups: usize, available: Available) -> Result<(), String> {
    let needed = needed(size, groups);
    if needed <= available.bytes {
        return Ok(());
    }
    let [width, height] = size;
    let fitting = (available.bytes as f64 / needed as f64).sqrt();
    let [fit_width, fit_height] = size.map(|side| round_down((f64::from(side) * fitting) as u32));
    let lights = match groups {
        1 => "1 light group".to_string(),
        n => format!("{n} light groups"),
    };
    Err(format!(
        "film: {width} x {height} pixels with {lights} need {} of memory, and {} are available \
         ({}). Expected a smaller picture, such as size = [{fit_width}, {fit_height}], or \
         `zerkalo render --memory SIZE`, which renders it in regions",
        megabytes(needed),
        megabytes(available.bytes),
        available.limit,
    ))
}

/// Returns the message for a film whose allocation fails although enough memory is available in
/// total.
pub fn refused(size: [u32; 2], groups: usize) -> String {
    let [width, height] = size;
    format!(
        "film: the system refuses {} of memory for {width} x {height} pixels. Expected a smaller \
         picture, or less memory in use by other programs",
        megabytes(needed(size, groups)),
    )
}

/// Memory \[bytes\] of a tile while its region is rendered, in addition to its sums: its entry in
/// the schedule, its estimates, jobs and reports.
const REGION_TILE_BYTES: u64 = 2048;
/// Memory \[bytes\] for each tile of the whole picture, while regions are rendered: its entry in the
/// list for percentiles, which doubles when it is full.
const PICTURE_TILE_BYTES: u64 = 3 * size_of::<f64>() as u64;
/// Memory \[bytes per pixel column and layer\] while a row of OpenEXR tiles is encoded. The layers
/// are the picture, its two replicates, and the light groups.
const ROW_BYTES: u64 = 256;
/// Memory of the program's buffers and allocator, in addition to scene and film \[bytes\].
const PROGRAM_BYTES: u64 = 3 << 20;
/// Memory of one tracing thread for its stack and its paths \[bytes\].
const THREAD_BYTES: u64 = 1 << 20;
/// Assumed memory of program and scene \[bytes\] on systems that do not report it.
const UNKNOWN_RESIDENT: ResidentMemory = ResidentMemory { now: 64 << 20, peak: 64 << 20 };

/// Bands of rows into which a picture is divided.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Regions {
    /// Number of rows of each region except the last; a multiple of [`TILE`].
    pub rows: u32,
    pub count: u32,
    /// Expected peak of the memory of this process \[bytes\].
    pub bytes: u64,
}

/// Divides a picture into the fewest regions such that this process uses at most `cap` bytes for
/// the program, the compiled scene and one region at a time. If not even one row of tiles fits, or
/// the process has already used more than `cap`, returns the smallest possible `cap` as the error.
pub fn divide(size: [u32; 2], groups: usize, threads: usize, cap: u64) -> Result<Regions, u64> {
    divide_from(resident_memory().unwrap_or(UNKNOWN_RESIDENT), size, groups, threads, cap)
}

fn divide_from(
    resident: ResidentMemory,
    size: [u32; 2],
    groups: usize,
    threads: usize,
    cap: u64,
) -> Result<Regions, u64> {
    let [columns, tile_rows] = size.map(|n| u64::from(n.div_ceil(TILE as u32)));
    let fixed = resident.now
        + PROGRAM_BYTES
        + THREAD_BYTES * threads as u64
        + PICTURE_TILE_BYTES * columns * tile_rows
        + ROW_BYTES * u64::from(size[0]) * (groups as u64 + 3);
    let band = Film::memory_bytes([size[0], 1], groups) + REGION_TILE_BYTES * columns;
    let fitting = cap.saturating_sub(fixed) / band;
    if fitting == 0 || resident.peak > cap {
        return Err(resident.peak.max(fixed + band));
    }
    let count = tile_rows.div_ceil(fitting);
    let rows_each = tile_rows.div_ceil(count);
    Ok(Regions {
        rows: rows_each as u32 * TILE as u32,
        count: tile_rows.div_ceil(rows_each) as u32,
        bytes: resident.peak.max(fixed + rows_each * band),
    })
}

/// Rounds a side in pixels down to a multiple of 16, or of 128 from 1024 on. Below 16, returns 1.
fn round_down(side: u32) -> u32 {
    match side {
        0..16 => 1,
        16..1024 => side / 16 * 16,
        _ => side / 128 * 128,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_of_a_render_counts_tiles_copies_and_sums() {
        // 40 x 30 tiles of 256 pixels.
        assert_eq!(needed([640, 480], 1), 640 * 480 * (48 + 16) + 1200 * 512);
        assert_eq!(needed([1, 1], 2), 256 * 96 + 16 + 512);
    }

    #[test]
    fn render_that_does_not_fit_is_refused_with_sums_and_remedy() {
        let available = |bytes| Available { bytes, limit: "the limit of the control group" };
        assert_eq!(compare([640, 480], 1, available(30_000_000)), Ok(()));
        let error = compare([16384, 4096], 2, available(1_000_000_000)).unwrap_err();
        assert_eq!(
            error,
            "film: 16384 x 4096 pixels with 2 light groups need 7.7 GB of memory, and 1.0 GB are \
             available (the limit of the control group). Expected a smaller picture, such as size = \
             [5888, 1408], or `zerkalo render --memory SIZE`, which renders it in regions"
        );
        // The error message suggests this size. A picture of this size fits into the memory.
        assert_eq!(compare([5888, 1408], 2, available(1_000_000_000)), Ok(()));
        assert!(compare([65536, 65536], 16, available(0)).unwrap_err().contains("[1, 1]"));
    }

    #[test]
    fn picture_is_divided_into_the_fewest_regions_that_fit() {
        let resident = ResidentMemory { now: 20_000_000, peak: 25_000_000 };
        let divide = |size, cap| divide_from(resident, size, 1, 4, cap);
        let whole = divide([16384, 16384], 1 << 40).unwrap();
        assert_eq!((whole.rows, whole.count), (16384, 1));
        assert!(whole.bytes > 48 << 28, "{whole:?}");
        for cap in [200_000_000, 1_000_000_000, 4_000_000_000, whole.bytes - 1, whole.bytes] {
            let regions = divide([16384, 16384], cap).unwrap();
            assert!(regions.bytes <= cap, "{cap}: {regions:?}");
            assert!(regions.rows.is_multiple_of(16), "{regions:?}");
            assert_eq!(16384u32.div_ceil(regions.rows), regions.count, "{regions:?}");
            // One region fewer would not fit.
            let rows = 16384u32.div_ceil(regions.count.max(2) - 1).next_multiple_of(16);
            let band = Film::memory_bytes([16384, rows], 1) + 2048 * 1024 * u64::from(rows / 16);
            assert!(regions.count == 1 || resident.now + band > cap - 200_000_000, "{regions:?}");
        }
        // The last region may be smaller, and no region is empty.
        for height in [1, 16, 17, 100, 1000] {
            for cap in (32_000_000..200_000_000).step_by(1_000_000) {
                let Ok(regions) = divide([4096, height], cap) else { continue };
                assert_eq!(height.div_ceil(regions.rows), regions.count, "{height} {cap}");
            }
        }
    }

    #[test]
    fn least_memory_suffices_and_less_does_not() {
        let resident = ResidentMemory { now: 20_000_000, peak: 25_000_000 };
        let divide = |cap| divide_from(resident, [640, 480], 2, 4, cap);
        let least = divide(1000).unwrap_err();
        assert_eq!(divide(least).unwrap().rows, 16);
        assert_eq!(divide(least - 1), Err(least));
        let peak = ResidentMemory { peak: 90_000_000, ..resident };
        assert_eq!(divide_from(peak, [640, 480], 2, 4, 89_999_999), Err(90_000_000));
        assert_eq!(divide_from(peak, [640, 480], 2, 4, 90_000_000).unwrap().count, 1);
    }
}
