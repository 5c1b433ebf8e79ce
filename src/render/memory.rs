//! Memory that a render needs, compared with the memory that is available.
//!
//! An allocation that fails ends the program without a picture, and with the edits of the dashboard
//! lost. The sum is therefore compared with every known limit before a film is created.

use crate::film::{Film, TILE};
use crate::value::{Available, available_memory, megabytes};

/// Memory for each pixel beside the film: a linear copy of the picture \[bytes\].
const COPY_BYTES: u64 = 16;
/// Memory for each tile beside its sums: tile, schedule, noise estimate \[bytes\].
const TILE_BYTES: u64 = 512;

/// Returns the memory that a render of `size` pixels with `groups` light groups needs \[bytes\].
pub fn needed(size: [u32; 2], groups: usize) -> u64 {
    let [width, height] = size.map(u64::from);
    let tiles = width.div_ceil(TILE as u64) * height.div_ceil(TILE as u64);
    Film::memory_bytes(size, groups) + COPY_BYTES * width * height + TILE_BYTES * tiles
}

/// Checks that a render of `size` pixels with `groups` light groups fits into the available memory.
/// `reusable` is the memory of the film that it replaces \[bytes\].
///
/// # Errors
/// Returns a message with both sums and the remedy.
pub fn check(size: [u32; 2], groups: usize, reusable: u64) -> Result<(), String> {
    match available_memory() {
        Some(available) => {
            let bytes = available.bytes.saturating_add(reusable);
            compare(size, groups, Available { bytes, ..available })
        }
        None => Ok(()),
    }
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
         ({}). Expected a smaller picture, such as size = [{fit_width}, {fit_height}]",
        megabytes(needed),
        megabytes(available.bytes),
        available.limit,
    ))
}

/// Returns the message for a film whose memory cannot be allocated, although the sum fits.
pub fn refused(size: [u32; 2], groups: usize) -> String {
    let [width, height] = size;
    format!(
        "film: the system refuses {} of memory for {width} x {height} pixels. Expected a smaller \
         picture, or less memory in use by other programs",
        megabytes(needed(size, groups)),
    )
}

/// Rounds down to a size that people would write.
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
             [5888, 1408]"
        );
        // The suggestion fits.
        assert_eq!(compare([5888, 1408], 2, available(1_000_000_000)), Ok(()));
        assert!(compare([65536, 65536], 16, available(0)).unwrap_err().contains("[1, 1]"));
    }
}
