//! Merging: adds the films of the parts of a plan. No shard may be in two of the files.

use crate::film::Film;
use crate::film::file::{FilmFileHeader, SavedFilm};
use crate::plan::part::{Part, PartShard, ranges};
use crate::plan::{BASE, FilmFiles, Plan};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Sum of the films of the parts of a plan.
pub struct Merged {
    pub film: Film,
    /// Header of the file with the lowest shard number, in which `part` replaces that of the file.
    pub header: FilmFileHeader,
    pub part: Part,
}

impl Merged {
    /// Adds the films of the files at `paths`, in any order. Fails if a file cannot be read or has
    /// no shards of a plan, if the files belong to different plans, or if two files hold the same
    /// shard. Without `partial`, it also fails if shards are missing or unfinished.
    pub fn of_files(paths: &[PathBuf], partial: bool) -> Result<Self, String> {
        let mut films = FilmFiles::of_parts(paths)?;
        let part =
            films.part().ok_or("there are no parts; trace them by `zerkalo render --plan`")?;
        if !partial {
            check_complete(&films, &part)?;
        }
        films.try_add()?;
        let SavedFilm { header, film } = films.sum.ok_or("there is nothing to merge")?;
        if part.shards.iter().all(|shard| shard.complete)
            && let Some(tile) = part.plan.differing_tile(&film, &part.numbers(|_| true))
        {
            return Err(format!(
                "the parts do not hold the samples of their shards: tile {tile} differs from the \
                 plan; trace the shards again"
            ));
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

/// Checks that no shard of the plan is missing or unfinished.
fn check_complete(films: &FilmFiles, part: &Part) -> Result<(), String> {
    let mut faults = Vec::new();
    for (path, part) in films.parts() {
        for shard in part.shards.iter().filter(|shard| !shard.complete) {
            let (path, name) = (path.display(), shard_name(shard.number));
            faults.push(format!("{path} is an unfinished checkpoint of {name}"));
        }
    }
    let settings = &part.plan.settings;
    let missing = part.plan.absent(&part.numbers(|_| true));
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

/// Part with the path of the file that holds it.
pub(super) struct SourcePart<'a> {
    pub path: &'a Path,
    pub part: &'a mut Part,
}

/// Checks that the films of `parts` can be added, and returns their common plan. One of the films
/// may be the merged film of an earlier plan, if the common plan has it as its base. Its part is
/// replaced by a part of the common plan that holds only the shard [`BASE`].
///
/// # Errors
/// Fails if there is no part, if the parts belong to different plans, if two of them hold the same
/// shard, or if the merged film lacks shards of its own plan.
pub(super) fn join(parts: &mut [SourcePart]) -> Result<Arc<Plan>, String> {
    let plan = common_plan(parts)?;
    let mut holders: HashMap<u32, &Path> = HashMap::new();
    for SourcePart { path, part } in parts.iter() {
        for shard in &part.shards {
            if let Some(other) = holders.insert(shard.number, path) {
                return Err(format!(
                    "{} and {} both hold {}; name one of them",
                    other.display(),
                    path.display(),
                    shard_name(shard.number)
                ));
            }
        }
    }
    Ok(plan)
}

/// Finds the common plan of `parts` for [`join`], and replaces the part of the plan's base.
fn common_plan(parts: &mut [SourcePart]) -> Result<Arc<Plan>, String> {
    let latest = parts.iter().map(|source| &source.part.plan).find(|latest| {
        let is_base = |plan: &Plan| latest.settings.base_plan == Some(plan.checksum());
        parts.iter().all(|SourcePart { part, .. }| part.plan == **latest || is_base(&part.plan))
    });
    let Some(plan) = latest.cloned() else {
        let Some(first) = parts.first() else { return Err("no parts are named".to_string()) };
        let plan = &first.part.plan;
        let other = parts.iter().find(|other| other.part.plan != *plan).unwrap_or(first);
        return Err(format!(
            "{} and {} belong to different plans ({}); name parts of one plan",
            first.path.display(),
            other.path.display(),
            plan.difference(&other.part.plan)
        ));
    };
    for SourcePart { path, part } in parts.iter_mut() {
        if part.plan != plan {
            if part.missing().is_some() {
                return Err(format!(
                    "cannot use {}: it is the base of a plan and lacks shards; merge it \
                     completely first",
                    path.display()
                ));
            }
            part.shards = vec![PartShard { number: BASE, complete: true }];
        }
        // All parts share one copy of the plan.
        part.plan = Arc::clone(&plan);
    }
    Ok(plan)
}

/// Returns the name of the shard `number` in messages, such as `shard 3`.
fn shard_name(number: u32) -> String {
    match number {
        BASE => "the base (shard 0)".to_string(),
        number => format!("shard {number}"),
    }
}
