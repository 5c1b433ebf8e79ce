//! Merging: adds the films of the parts of a plan.

use crate::film::Film;
use crate::film::file::FilmFileHeader;
use crate::plan::merge_inputs::shard_name;
use crate::plan::part::{Part, ranges};
use crate::plan::{BASE, WatchedFilms};
use std::path::{Path, PathBuf};

/// Sum of the films of the parts of a plan.
pub struct Merged {
    pub film: Film,
    /// Header of the file with the lowest shard number, with `part` in place of its own.
    pub header: FilmFileHeader,
    pub part: Part,
}

impl Merged {
    /// Adds the films of the files at `paths`, in any order. Fails if a file cannot be read or has
    /// no shards of a plan, if the files belong to different plans, if two files hold the same
    /// shard, or, without `partial`, if shards are missing or unfinished.
    pub fn of_files(paths: &[PathBuf], partial: bool) -> Result<Self, String> {
        let mut films = WatchedFilms::parts(paths)?;
        let part = films.part().ok_or("no parts are named")?;
        if !partial {
            check_complete(&films, &part)?;
        }
        films.try_add().map_err(|(_, reason)| reason)?;
        let (header, film) = films.into_sum().ok_or("there is nothing to merge")?;
        if part.shards.iter().all(|shard| shard.complete) {
            let numbers: Vec<u32> = part.shards.iter().map(|shard| shard.number).collect();
            if let Some(tile) = part.plan.differing_tile(&film, &numbers) {
                return Err(format!(
                    "the parts do not hold the samples of their shards: tile {tile} differs from \
                     the plan; trace the shards again"
                ));
            }
        }
        Ok(Self { film, header, part })
    }
}

pub(super) fn without_plan(path: &Path) -> String {
    format!(
        "cannot add {} to other films: it belongs to no plan; name files that `zerkalo render \
         --plan` has written",
        path.display()
    )
}

fn check_complete(films: &WatchedFilms, part: &Part) -> Result<(), String> {
    let mut faults = Vec::new();
    for input in films.inputs() {
        for shard in input.shards.iter().filter(|shard| !shard.complete) {
            let (path, name) = (input.path.display(), shard_name(shard.number));
            faults.push(format!("{path} is an unfinished checkpoint of {name}"));
        }
    }
    let settings = &part.plan.settings;
    let held: Vec<u32> = part.shards.iter().map(|shard| shard.number).collect();
    let missing = part.plan.absent(&held);
    if let Some(first) = missing.first() {
        let base = if *first == BASE { " (0 is the base, which `zerkalo plan` wrote)" } else { "" };
        let (count, missing) = (settings.shards, ranges(&missing));
        faults.push(format!("of {count} shards these are missing: {missing}{base}"));
    }
    if faults.is_empty() {
        return Ok(());
    }
    Err(format!(
        "{}; trace them by `zerkalo render {} --plan PLAN --shard K -o FILE.zk`, or merge what is \
         there by --partial",
        faults.join("; "),
        settings.source,
    ))
}
