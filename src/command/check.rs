//! `zerkalo check`: validates a scene and prints its contents.

use crate::command::{Failure, print_line, read_scene_and_warn, warn};
use std::path::Path;
use zerkalo_render::memory_budget;
use zerkalo_world::{self as world, AnyWorld};

pub fn run(path: &Path) -> Result<(), Failure> {
    let document = read_scene_and_warn(path)?;
    let scene = document.scene();
    let world = AnyWorld::compile(scene, &world::Options::default());
    let [width, height] = scene.film.size;
    let groups = world.info().groups.names(scene);
    let bytes = memory_budget::needed(scene.film.size, groups.len());
    print_line(&format!("{}: valid", path.display()))?;
    print_line(&format!("  contains  {}", world.info().inventory))?;
    print_line(&format!("  picture   {width} x {height} pixels"))?;
    print_line(&format!("  lights    {} separate: {}", groups.len(), groups.join(", ")))?;
    print_line(&format!("  memory    {:.0} MB for the samples", (bytes as f64 * 1e-6).max(1.0)))?;
    if let Err(reason) = memory_budget::check(scene.film.size, groups.len(), 0) {
        warn(&format!("warning: {reason}."));
    }
    for bias in &world.info().biases {
        print_line(&format!("  biased    {bias}"))?;
    }
    Ok(())
}
