//! `zerkalo render --memory`: division of a picture that does not fit into the given memory.

use crate::command::args::RenderArgs;
use crate::command::{Failure, warn};
use zerkalo_render::memory_budget::{Regions, check, divide};
use zerkalo_scene::Scene;
use zerkalo_scene::process_memory::{available_memory, megabytes, resident_memory};
use zerkalo_world::{self as world, AnyWorld};

/// Name of the memory limit in messages, unless the machine has less memory.
const OPTION: &str = "--memory";

/// Division of a picture into regions, bands of rows.
#[derive(Clone, Copy, Debug)]
pub struct Division {
    /// `true` if all lights share one light group, to save memory.
    pub merge_lights: bool,
    /// Regions of the picture; a single one if the whole picture fits.
    pub regions: Regions,
}

impl Division {
    /// Divides the picture so that the process uses at most `cap` bytes. The first choice is a
    /// whole film with all light groups, the second a whole film with merged light groups, the
    /// third a division into regions.
    ///
    /// # Errors
    /// Fails if the smallest regions do not fit, or if a checkpoint is requested or resumed and a
    /// film with all light groups does not fit.
    pub fn new(
        scene: &Scene,
        options: &world::Options,
        args: &RenderArgs,
        cap: u64,
    ) -> Result<Self, Failure> {
        // While `world` exists, the measured memory of the process includes the scene.
        let world = AnyWorld::compile(scene, options);
        let groups = world.info().groups.members.len();
        let merged = world.info().groups.merged_count();
        let (size, threads) = (scene.film.size, args.compute.threads());
        let (cap, limit) = usable(cap);
        // `check` may refuse a picture that `divide` accepts, because it demands more memory.
        let refused = |groups| check(size, groups, 0).is_err();
        let divided = |groups| match divide(size, groups, threads, cap) {
            Ok(whole) if whole.count == 1 && refused(groups) => {
                divide(size, groups, threads, whole.bytes - 1)
            }
            divided => divided,
        };
        let separate = divided(groups).ok().filter(|regions| regions.count == 1);
        drop(world);
        let division = match separate {
            Some(regions) => Self { merge_lights: false, regions },
            None => Self {
                merge_lights: merged < groups,
                regions: divided(merged).map_err(|least| too_little(least, cap, limit))?,
            },
        };
        if separate.is_none() && (args.checkpoint.is_some() || args.resume.is_some()) {
            let needed = divide(size, groups, threads, u64::MAX).map_or(0, |whole| whole.bytes);
            return Err(Failure::Failed(format!(
                "a checkpoint has the whole film, which needs {} of memory, and {limit} allows {}; \
                 expected more memory, a smaller picture, or no --checkpoint and --resume",
                megabytes(needed),
                megabytes(cap),
            )));
        }
        division.announce(groups, merged, cap);
        Ok(division)
    }

    fn announce(&self, groups: usize, merged: usize, cap: u64) {
        let Regions { rows, count, bytes } = self.regions;
        let regions = match count {
            1 => "the picture as a whole".to_string(),
            n => format!("{n} regions of {rows} rows"),
        };
        let merging = match self.merge_lights {
            true => format!(", {groups} light groups merged into {merged}"),
            false => String::new(),
        };
        warn(&format!(
            "memory: {} expected, at most {}: {regions}{merging}",
            megabytes(bytes),
            megabytes(cap)
        ));
    }
}

/// Returns the number of bytes that the process may use, and the name of this limit.
fn usable(cap: u64) -> (u64, &'static str) {
    let now = resident_memory().map_or(0, |resident| resident.now);
    match available_memory() {
        Some(available) if available.bytes.saturating_add(now) < cap => {
            (available.bytes + now, available.limit)
        }
        _ => (cap, OPTION),
    }
}

/// Returns the error for a picture that needs at least `least` bytes of memory, where `limit`, an
/// option or a property of the machine, permits only `cap` bytes.
fn too_little(least: u64, cap: u64, limit: &'static str) -> Failure {
    // The resident memory differs by up to a megabyte from run to run.
    let least = (least + 1_000_000).div_ceil(1_000_000);
    let expected = match limit {
        OPTION => format!("expected at least {OPTION} {least}MB"),
        _ => "expected that much memory, or a smaller scene".to_string(),
    };
    let allowed = match cap {
        0..1_000_000 => format!("{} KB", cap / 1000),
        _ => megabytes(cap),
    };
    Failure::Failed(format!(
        "{limit} allows {allowed}, but the scene and a region of the least size need {least} MB; \
         {expected}"
    ))
}
