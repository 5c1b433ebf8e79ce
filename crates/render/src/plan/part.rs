//! Parts: film files with the samples of shards of a plan, together with the head of the plan.

use crate::film::file::FilmFileHeader;
use crate::plan::share_report::{CUTS_TAG, REPORT_TAG};
use crate::plan::{Plan, PlanSettings};
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

/// Tag of the chunk with the head of the plan.
const PLAN_TAG: [u8; 4] = *b"PLAN";
/// Tag of the chunk that lists the shards: a line `rays N`, then a line `shard K DONE TOTAL STATE`
/// for each, with its samples so far and in the end; the state is `complete` or `unfinished`.
const PART_TAG: [u8; 4] = *b"PART";

/// Plan without its tiles.
#[derive(Clone, Debug, PartialEq)]
pub struct PlanHead {
    pub settings: PlanSettings,
    /// Value of [`Plan::predicted_levels`].
    pub predicted_levels: f64,
    pub slopes: [f64; 2],
    /// Number of samples of the merged picture, over all pixels and both replicates.
    pub samples: u64,
    /// Value of [`Plan::checksum`]. Plans with equal checksums count as equal.
    pub checksum: u64,
}

impl PlanHead {
    /// Returns the mean samples per pixel in the merged picture, over both replicates.
    pub fn spp(&self) -> f64 {
        let [width, height] = self.settings.size.map(u64::from);
        self.samples as f64 / (width * height) as f64
    }

    /// Quotes the first line that is not the same in the heads of two plans.
    pub(super) fn difference(&self, other: &Self) -> String {
        let [ours, theirs] = [self, other].map(Self::text);
        let different = ours.lines().zip(theirs.lines()).find(|(a, b)| a != b);
        different.map_or_else(|| "one is longer".to_string(), |(a, b)| format!("`{a}` and `{b}`"))
    }
}

/// Head of the plan that a film file contains, and the shards that its film holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    pub plan: Arc<PlanHead>,
    /// Shards in ascending order.
    pub shards: Vec<PartShard>,
    /// Number of rays of the samples in the film, without those of earlier rounds.
    pub rays: u64,
}

/// State of one shard in a film file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct PartShard {
    /// Number of the shard, from 1.
    pub number: u32,
    pub complete: bool,
    /// Samples so far and in the complete shard, over all pixels and both replicates.
    pub samples: [u64; 2],
}

impl Part {
    /// Adds the plan, the shards and the metadata entry `Shards` to the header of a film file.
    pub fn record(&self, header: &mut FilmFileHeader) {
        let mut text = format!("rays {}\n", self.rays);
        for PartShard { number, complete, samples: [done, total] } in &self.shards {
            let state = if *complete { "complete" } else { "unfinished" };
            let _ = writeln!(text, "shard {number} {done} {total} {state}");
        }
        header.metadata.retain(|(key, _)| key != "Shards");
        header.metadata.push(("Shards".to_string(), self.origin()));
        // The report of one shard is not that of a sum.
        [REPORT_TAG, CUTS_TAG].iter().for_each(|tag| drop(header.chunks.remove(tag)));
        header.chunks.insert(PLAN_TAG, self.plan.text().into_bytes());
        header.chunks.insert(PART_TAG, text.into_bytes());
    }

    /// Reads plan and shards from the header of the film file at `path`. Returns `None` if the film
    /// belongs to no plan. Fails if plan or shards are not valid, or do not fit the film.
    pub fn of_header(path: &Path, header: &FilmFileHeader) -> Result<Option<Self>, String> {
        let Some(plan) = header.chunks.get(&PLAN_TAG) else { return Ok(None) };
        let plan = PlanHead::parse(path, plan).map_err(|e| e.to_string())?;
        let damaged = |what: &str| {
            format!("cannot use {}: it is damaged: {what}; trace it again", path.display())
        };
        let part = header.chunks.get(&PART_TAG).and_then(|text| Self::parse(plan, text));
        let part = part.ok_or_else(|| damaged("its list of shards is not valid"))?;
        let settings = &part.plan.settings;
        if settings.size != header.film.size()
            || settings.seed != header.film.seed
            || settings.precision != header.film.precision
        {
            return Err(damaged("film and plan differ in size, seed or precision"));
        }
        Ok(Some(part))
    }

    /// Parses the chunk [`PART_TAG`] of a part of `plan`. Returns `None` if it is invalid.
    fn parse(plan: PlanHead, text: &[u8]) -> Option<Self> {
        let mut lines = std::str::from_utf8(text).ok()?.lines();
        let rays = lines.next()?.strip_prefix("rays ")?.parse().ok()?;
        let mut shards: Vec<PartShard> = Vec::new();
        for line in lines {
            let mut fields = line.strip_prefix("shard ")?.split(' ');
            let number = fields.next()?.parse().ok()?;
            let samples = [fields.next()?.parse().ok()?, fields.next()?.parse().ok()?];
            let complete = match fields.next()? {
                "complete" => true,
                "unfinished" => false,
                _ => return None,
            };
            let ascending = shards.last().map_or(0, |last| last.number) < number;
            if !ascending || number > plan.settings.shards || samples[0] > samples[1] {
                return None;
            }
            shards.push(PartShard { number, complete, samples });
        }
        (!shards.is_empty()).then_some(Self { plan: Arc::new(plan), shards, rays })
    }

    /// Returns the numbers of the shards for which `wanted` returns `true`.
    pub(super) fn numbers(&self, wanted: impl Fn(&PartShard) -> bool) -> Vec<u32> {
        self.shards.iter().filter(|shard| wanted(shard)).map(|shard| shard.number).collect()
    }

    pub fn is_complete(&self) -> bool {
        self.shards.iter().all(|shard| shard.complete)
    }

    /// Returns the numbers of the shards that are missing or incomplete, such as `3, 5-7`. `None`
    /// if the film holds all shards completely.
    pub fn missing(&self) -> Option<String> {
        let missing = self.plan.absent(&self.numbers(|shard| shard.complete));
        (!missing.is_empty()).then(|| ranges(&missing))
    }

    /// Returns the metadata entry `Shards`, such as `1-2, 4 of 5, unfinished 4, missing 3, 5, plan
    /// 0123456789abcdef`.
    fn origin(&self) -> String {
        let here = self.numbers(|_| true);
        let mut text = format!("{} of {}", ranges(&here), self.plan.settings.shards);
        let unfinished = self.numbers(|shard| !shard.complete);
        for (state, numbers) in [("unfinished", unfinished), ("missing", self.plan.absent(&here))] {
            if !numbers.is_empty() {
                text += &format!(", {state} {}", ranges(&numbers));
            }
        }
        format!("{text}, plan {:016x}", self.plan.checksum)
    }
}

impl Plan {
    /// Returns the plan without its tiles.
    pub fn head(&self) -> PlanHead {
        PlanHead {
            settings: self.settings.clone(),
            predicted_levels: self.predicted_levels,
            slopes: self.slopes,
            samples: self.samples(&self.whole()),
            checksum: self.checksum(),
        }
    }
}

impl PlanHead {
    /// Returns the numbers of the plan's shards that are not among the ascending `numbers`.
    pub(super) fn absent(&self, numbers: &[u32]) -> Vec<u32> {
        let all = 1..=self.settings.shards;
        all.filter(|number| numbers.binary_search(number).is_err()).collect()
    }
}

/// Formats ascending numbers as a list of ranges, such as `3, 5-7`.
pub(super) fn ranges(numbers: &[u32]) -> String {
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
