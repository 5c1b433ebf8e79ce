//! Merging: adds the partial films of a distributed render. Each film holds one or more shards of
//! the same plan.

use crate::film::Film;
use crate::film::file::{FilmFileHeader, FilmReader};
use crate::plan::merge_inputs::{Plans, ShardFiles, join, shard_name};
use crate::plan::part::{Part, PartShard, ranges};
use crate::plan::{BASE, Plan};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use zerkalo_scene::value::sort_by_number;

/// Merged film: the sum of the partial films of a distributed render.
pub struct Merged {
    /// Film with the samples of all merged files.
    pub film: Film,
    /// Header of the merged film. It is the header of the file with the lowest shard number; the
    /// plan and the list of all merged shards are added.
    pub header: FilmFileHeader,
    /// Plan of the film, and the numbers of the shards (parts of the planned render) that are in
    /// it.
    pub part: Part,
}

impl Merged {
    /// Adds the films of the files at `paths`, in any order. If `partial` is `true`, shards (parts
    /// of the planned render) may be missing or unfinished.
    ///
    /// # Errors
    /// Fails if a file cannot be read or has no shards of a plan, if the files belong to different
    /// plans, if two files hold the same shard, or if shards are missing or unfinished without
    /// `partial`.
    pub fn of_files(paths: &[PathBuf], partial: bool) -> Result<Self, String> {
        let (mut plans, mut inputs, mut readers) = (Plans::default(), Vec::new(), Vec::new());
        for path in paths {
            let reader = FilmReader::open(path).map_err(|e| e.to_string())?;
            let part = Part::of_header(path, reader.header())?;
            let part = part.ok_or_else(|| without_plan(path))?;
            inputs.push(plans.input(path, part));
            readers.push(reader);
        }
        let (plan, shards) = join(&mut inputs)?;
        if !partial {
            check_complete(&plan, &shards)?;
        }
        let rays = inputs.iter().map(|input| input.rays).sum();
        let mut files: Vec<_> = inputs.iter().zip(readers).collect();
        sort_by_number(&mut files, |(input, _)| input.shards[0].number.into());
        let shards: Vec<PartShard> = shards.into_values().map(|(_, shard)| shard).collect();
        let mut readers = files.into_iter().map(|(_, reader)| reader);
        let first = readers.next().ok_or("there is nothing to merge")?;
        let (mut header, mut film) = first.read().map_err(|e| e.to_string())?;
        for reader in readers {
            reader.add_to(&mut film).map_err(|e| e.to_string())?;
        }
        if shards.iter().all(|shard| shard.complete) {
            let numbers: Vec<u32> = shards.iter().map(|shard| shard.number).collect();
            if let Some(tile) = plan.differing_tile(&film, &numbers) {
                return Err(format!(
                    "the parts do not hold the samples of their shards: tile {tile} differs from \
                     the plan; trace the shards again"
                ));
            }
        }
        let part = Part { plan: Arc::unwrap_or_clone(plan), shards, rays };
        part.record(&mut header);
        Ok(Self { film, header, part })
    }
}

/// Returns the error message about the film file at `path`, which belongs to no plan.
pub(super) fn without_plan(path: &Path) -> String {
    format!(
        "cannot add {} to other films: it belongs to no plan; name files that `zerkalo render \
         --plan` has written",
        path.display()
    )
}

fn check_complete(plan: &Plan, shards: &ShardFiles) -> Result<(), String> {
    let count = plan.settings.shards;
    let missing: Vec<u32> = (BASE..=count).filter(|n| !shards.contains_key(n)).collect();
    let unfinished = shards.values().filter(|(_, shard)| !shard.complete);
    let mut faults: Vec<String> = unfinished
        .map(|(path, shard)| {
            format!(
                "{} is an unfinished checkpoint of {}",
                path.display(),
                shard_name(shard.number)
            )
        })
        .collect();
    if !missing.is_empty() {
        let base =
            if missing[0] == BASE { " (0 is the base, which `zerkalo plan` wrote)" } else { "" };
        faults.push(format!("of {count} shards these are missing: {}{base}", ranges(&missing)));
    }
    if faults.is_empty() {
        return Ok(());
    }
    Err(format!(
        "{}; trace them by `zerkalo render {} --plan PLAN --shard K -o FILE.zk`, or merge what is \
         there by --partial",
        faults.join("; "),
        plan.settings.source,
    ))
}
