//! `zerkalo check`: validates a scene and prints its contents.

use crate::command::args::CheckArgs;
use crate::command::load_progress::LoadReporter;
use crate::command::{Failure, print_line, warn};
use crate::film::{TILE, TILE_PIXELS};
use crate::scene::Document;
use crate::world::{self, AnyWorld};

pub fn run(args: &CheckArgs) -> Result<(), Failure> {
    let document = Document::read_with(&args.scene, LoadReporter::new().assets)
        .map_err(|e| Failure::Failed(e.to_string()))?;
    for warning in document.warnings() {
        warn(&format!("warning: {warning}"));
    }
    let scene = document.scene();
    let world = AnyWorld::compile(scene, &world::Options::default());
    let [width, height] = scene.film.size;
    let groups = world.group_names();
    let bytes = film_bytes(scene.film.size, groups.len());
    print_line(&format!("{}: valid", args.scene.display()))?;
    print_line(&format!("  contains  {}", world.inventory()))?;
    print_line(&format!("  picture   {width} x {height} pixels"))?;
    print_line(&format!("  lights    {} separate: {}", groups.len(), groups.join(", ")))?;
    print_line(&format!("  memory    {:.0} MB for the samples", (bytes as f64 * 1e-6).max(1.0)))?;
    for bias in world.biases() {
        print_line(&format!("  biased    {bias}"))?;
    }
    Ok(())
}

/// Returns the memory of a film in bytes. For each pixel the film holds a 64-bit sum for each of
/// two replicates (halves of the samples), each of `groups` light groups, and each of three
/// channels.
fn film_bytes(size: [u32; 2], groups: usize) -> u64 {
    let [columns, rows] = size.map(|n| u64::from(n).div_ceil(TILE as u64));
    columns * rows * (2 * TILE_PIXELS * groups * 3 * size_of::<i64>()) as u64
}

#[cfg(test)]
mod tests {
    use super::film_bytes;

    #[test]
    fn film_memory_counts_whole_tiles() {
        // The film has 40 x 30 complete tiles.
        assert_eq!(film_bytes([640, 480], 1), 640 * 480 * 48);
        assert_eq!(film_bytes([1, 1], 3), 256 * 48 * 3);
    }
}
