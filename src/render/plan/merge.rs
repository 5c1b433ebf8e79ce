//! Merging of parts: adds the films of a plan's shards.

use crate::film::file::{FilmFileHeader, FilmReader};
use crate::film::{Film, Noise};
use crate::render::plan::part::{Part, PartShard};
use crate::render::plan::{BASE, Plan};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};

/// Sum of the parts of a plan.
pub struct Merged {
    /// Sum of the films.
    pub film: Film,
    /// Header of the part with the lowest shard, with the plan and all shards.
    pub header: FilmFileHeader,
    /// Plan and shards of the film.
    pub part: Part,
}

/// Opened part file.
struct PartFile {
    path: PathBuf,
    reader: FilmReader<BufReader<File>>,
    part: Part,
}

impl Merged {
    /// Adds the films of the files at `paths`, in any order. With `partial` shards may be missing
    /// or unfinished.
    ///
    /// # Errors
    /// Fails if a file cannot be read or is no part, if the files belong to different plans, if two
    /// files hold the same shard, or if shards are missing or unfinished without `partial`.
    pub fn of_files(paths: &[PathBuf], partial: bool) -> Result<Self, String> {
        let files = paths.iter().map(|path| PartFile::open(path));
        let mut files = files.collect::<Result<Vec<_>, String>>()?;
        let plan = common_plan(&mut files)?;
        let mut shards: BTreeMap<u32, (PathBuf, PartShard)> = BTreeMap::new();
        for file in &files {
            for shard in &file.part.shards {
                let entry = (file.path.clone(), *shard);
                if let Some((other, _)) = shards.insert(shard.number, entry) {
                    return Err(format!(
                        "{} and {} both hold {}; name one of them",
                        other.display(),
                        file.path.display(),
                        shard_name(shard.number)
                    ));
                }
            }
        }
        if !partial {
            check_complete(&plan, &shards)?;
        }
        files.sort_by_key(|file| file.part.shards[0].number);
        let rays = files.iter().map(|file| file.part.rays).sum();
        let shards: Vec<PartShard> = shards.into_values().map(|(_, shard)| shard).collect();
        let mut sum: Option<(Film, FilmFileHeader)> = None;
        for file in files {
            match &mut sum {
                Some((film, _)) => {
                    file.reader.add_to(film).map_err(|e| e.to_string())?;
                }
                None => {
                    let (header, film) = file.reader.read().map_err(|e| e.to_string())?;
                    sum = Some((film, header));
                }
            }
        }
        let (film, mut header) = sum.ok_or_else(|| "there is nothing to merge".to_string())?;
        if shards.iter().all(|shard| shard.complete) {
            let numbers: Vec<u32> = shards.iter().map(|shard| shard.number).collect();
            if let Some(tile) = plan.differing_tile(&film, &numbers) {
                return Err(format!(
                    "the parts do not hold the samples of their shards: tile {tile} differs from \
                     the plan; trace the shards again"
                ));
            }
        }
        let part = Part { plan, shards, rays };
        part.record(&mut header);
        Ok(Self { film, header, part })
    }

    /// Estimated error of the merged picture. `None` if a tile has no samples.
    pub fn noise(&self) -> Option<Noise> {
        self.film.noise(&self.header.weights, &self.header.display)
    }

    /// Returns the shards that the film does not hold completely, such as `3, 5-7`. `None` if it
    /// holds all.
    pub fn missing(&self) -> Option<String> {
        let complete = |number: &u32| {
            let found = self.part.shards.binary_search_by_key(number, |shard| shard.number);
            found.is_ok_and(|i| self.part.shards[i].complete)
        };
        let missing = (BASE..=self.part.plan.settings.shards).filter(|number| !complete(number));
        let missing: Vec<u32> = missing.collect();
        (!missing.is_empty()).then(|| ranges(&missing))
    }
}

impl PartFile {
    fn open(path: &Path) -> Result<Self, String> {
        let reader = FilmReader::open(path).map_err(|e| e.to_string())?;
        let part = Part::of_header(path, reader.header())?.ok_or_else(|| {
            format!(
                "cannot merge {}: it belongs to no plan; name files that `zerkalo render --plan` \
                 has written",
                path.display()
            )
        })?;
        Ok(Self { path: path.to_path_buf(), reader, part })
    }
}

/// Returns the plan of all files. A file whose plan is the base of the others becomes the base.
fn common_plan(files: &mut [PartFile]) -> Result<Plan, String> {
    let checksums: Vec<u64> = files.iter().map(|file| file.part.plan.checksum()).collect();
    let latest = (0..files.len()).find(|i| {
        let base = files[*i].part.plan.settings.base_plan;
        checksums.iter().all(|sum| *sum == checksums[*i] || Some(*sum) == base)
    });
    let Some(latest) = latest else {
        let [a, b] =
            [&files[0], &files[checksums.iter().position(|c| *c != checksums[0]).unwrap_or(0)]];
        return Err(format!(
            "{} and {} belong to different plans ({}); merge parts of one plan",
            a.path.display(),
            b.path.display(),
            a.part.plan.difference(&b.part.plan)
        ));
    };
    let plan = files[latest].part.plan.clone();
    for (file, checksum) in files.iter_mut().zip(&checksums) {
        if *checksum != checksums[latest] {
            if !file.part.is_whole() {
                return Err(format!(
                    "cannot merge {}: it is the base of a plan and lacks shards; merge it \
                     completely first",
                    file.path.display()
                ));
            }
            file.part.shards = vec![PartShard { number: BASE, complete: true }];
        }
    }
    Ok(plan)
}

fn check_complete(plan: &Plan, shards: &BTreeMap<u32, (PathBuf, PartShard)>) -> Result<(), String> {
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

fn shard_name(number: u32) -> String {
    match number {
        BASE => "the base (shard 0)".to_string(),
        number => format!("shard {number}"),
    }
}

/// Formats ascending numbers: `3, 5-7`.
fn ranges(numbers: &[u32]) -> String {
    let mut text = Vec::new();
    for run in numbers.chunk_by(|a, b| a + 1 == *b) {
        match run {
            [one] => text.push(one.to_string()),
            [first, .., last] => text.push(format!("{first}-{last}")),
            [] => {}
        }
    }
    text.join(", ")
}
