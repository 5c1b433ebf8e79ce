//! Merging: adds the films of the parts of a plan. No shard may be in two of the files.

use crate::film::Film;
use crate::film::file::{FilmFileHeader, SavedFilm};
use crate::plan::FilmFiles;
use crate::plan::part::{Part, PlanHead, ranges};
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
    /// Adds the films of the files at `paths`, in any order. A plan file stands for the parts of the
    /// latest round of its job. Fails if a file cannot be read or has no shards of a plan, if the
    /// files belong to different plans, or if two files hold the same shard. Without `partial`, it
    /// also fails if shards are missing or unfinished, or if the job needs another round.
    pub fn of_files(paths: &[PathBuf], partial: bool) -> Result<Self, String> {
        let mut films = FilmFiles::of_parts(paths)?;
        let part = films.part().ok_or("there are no parts; trace them by `zerkalo work`")?;
        if !partial {
            check_complete(&films, &part)?;
        }
        films.try_add()?;
        let SavedFilm { header, film } = films.sum.ok_or("there is nothing to merge")?;
        if let Some(job) = &films.named
            && part.missing().is_none()
            && let Some(tile) = job.plan.differing_tile(&film)
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
        "cannot add {} to other films: it belongs to no plan; name files that `zerkalo work` has \
         written",
        path.display()
    )
}

/// Checks that no shard of the plan is missing or unfinished, and that the job needs no further
/// round.
fn check_complete(films: &FilmFiles, part: &Part) -> Result<(), String> {
    let mut faults = Vec::new();
    for (path, part) in films.parts() {
        for shard in part.shards.iter().filter(|shard| !shard.complete) {
            let (path, number) = (path.display(), shard.number);
            faults.push(format!("{path} is an unfinished checkpoint of shard {number}"));
        }
    }
    let settings = &part.plan.settings;
    let missing = part.plan.absent(&part.numbers(|_| true));
    if !missing.is_empty() {
        let (count, missing) = (settings.shards, ranges(&missing));
        faults.push(format!("of {count} shards these are missing: {missing}"));
    }
    if faults.is_empty()
        && let Some(job) = &films.named
        && !job.is_finished()
        && job.next_plan(settings.noise_levels)?.is_some()
    {
        faults.push(format!("the noise after round {} is above the target", settings.round));
    }
    if faults.is_empty() {
        return Ok(());
    }
    Err(format!(
        "{}; trace the rest by `zerkalo work {} PLAN`, or merge what is there by --partial",
        faults.join("; "),
        settings.source,
    ))
}

/// Checks that the films of `parts` can be added, and returns their common plan: that of `named`, if
/// there is one. `None` without parts.
///
/// # Errors
/// Fails if the parts belong to different plans, or if two of them hold the same shard.
pub(super) fn join(
    named: Option<(&Path, &Arc<PlanHead>)>,
    parts: &[(&Path, &Part)],
) -> Result<Option<Arc<PlanHead>>, String> {
    let first = parts.first().map(|(path, part)| (*path, &part.plan));
    let Some((first, plan)) = named.or(first) else { return Ok(None) };
    let mut holders: HashMap<u32, &Path> = HashMap::new();
    for (path, part) in parts {
        if part.plan.checksum != plan.checksum {
            return Err(format!(
                "{} and {} belong to different plans ({}); name parts of one plan",
                first.display(),
                path.display(),
                plan.difference(&part.plan)
            ));
        }
        for shard in &part.shards {
            if let Some(other) = holders.insert(shard.number, path) {
                return Err(format!(
                    "{} and {} both hold shard {}; name one of them",
                    other.display(),
                    path.display(),
                    shard.number
                ));
            }
        }
    }
    Ok(Some(Arc::clone(plan)))
}
