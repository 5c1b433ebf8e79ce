//! Jobs: the plans of all rounds of a render, and the parts beside them.

use crate::FileError;
use crate::film::Estimator;
use crate::film::file::FilmReader;
use crate::plan::share_report::RoundReport;
use crate::plan::{Part, Plan, PlanHead, Share};
use std::fs::File;
use std::io::BufReader;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use zerkalo_scene::disk;

/// Plan of the latest round of a render. The file of its first round is `job.plan`, those of the
/// later ones are `job.2.plan`, `job.3.plan` and so on, beside it; the parts of `job.2.plan` are
/// `job.2-1.zk`, `job.2-2.zk` and so on.
#[derive(Debug)]
pub struct Job {
    /// Path of the plan.
    pub path: PathBuf,
    pub plan: Plan,
    pub head: Arc<PlanHead>,
    /// Plan of the round before, if its file is there.
    previous: Option<(PathBuf, Plan)>,
}

impl Job {
    /// Opens the latest round of the job whose first plan, or a later one, is at `path`.
    pub fn open(path: &Path) -> Result<Self, FileError> {
        let mut job = Self::at(path)?;
        job.advance();
        Ok(job)
    }

    /// Opens the round whose plan is at `path`.
    pub fn at(path: &Path) -> Result<Self, FileError> {
        let plan = Plan::read(path)?;
        let round = plan.settings.round;
        let before = (round > 1).then(|| round_path(path, round, round - 1));
        let previous = before.and_then(|before| Some((before.clone(), Plan::read(&before).ok()?)));
        let base = plan.settings.base_plan;
        let previous = previous.filter(|(_, plan)| Some(plan.checksum()) == base);
        let head = Arc::new(plan.head());
        Ok(Self { path: path.to_path_buf(), plan, head, previous })
    }

    /// Goes on to the latest round, if others were planned. Returns `true` if there was one.
    pub fn advance(&mut self) -> bool {
        let before = self.head.settings.round;
        while let path = self.next_path()
            && path.exists()
            && let Ok(plan) = Plan::read(&path)
            && plan.settings.base_plan == Some(self.head.checksum)
        {
            self.head = Arc::new(plan.head());
            let previous = std::mem::replace(&mut self.plan, plan);
            self.previous = Some((std::mem::replace(&mut self.path, path), previous));
        }
        self.head.settings.round > before
    }

    pub fn next_path(&self) -> PathBuf {
        let round = self.head.settings.round;
        round_path(&self.path, round, round + 1)
    }

    pub fn part_path(&self, shard: u32) -> PathBuf {
        part_path(&self.path, shard)
    }

    /// Returns the paths of the parts of the round before.
    pub(super) fn previous_parts(&self) -> Vec<PathBuf> {
        let Some((path, plan)) = &self.previous else { return Vec::new() };
        (1..=plan.settings.shards).map(|shard| part_path(path, shard)).collect()
    }

    /// Opens the parts of the round before that hold tiles of `share`.
    pub fn base_of(&self, share: &Share) -> Vec<FilmReader<BufReader<File>>> {
        let Some((path, plan)) = &self.previous else { return Vec::new() };
        let shards = plan.shards_of(share.first..share.first + share.ranges.len());
        let open = |shard| {
            let path = part_path(path, shard);
            let reader = FilmReader::open(&path).ok()?;
            let part = Part::of_header(&path, &reader.header).ok()??;
            (Some(part.plan.checksum) == self.head.settings.base_plan).then_some(reader)
        };
        shards.filter_map(open).collect()
    }

    /// Plans the round after this one from the reports of its parts, which must be complete. Returns
    /// `None` if the noise meets the target `noise_levels`, or no tile can get samples.
    pub fn next_plan(&self, noise_levels: f64) -> Result<Option<Plan>, String> {
        let mut round = RoundReport::new(self.plan.tiles.len());
        let mut estimator = None;
        for shard in 1..=self.head.settings.shards {
            let path = self.part_path(shard);
            let header = FilmReader::open(&path).map_err(|error| error.to_string())?.header;
            let part = Part::of_header(&path, &header)?;
            let unusable = || {
                format!(
                    "cannot plan from {}: it is no complete part of {}",
                    path.display(),
                    self.path.display()
                )
            };
            part.filter(|part| part.is_complete() && part.plan.checksum == self.head.checksum)
                .ok_or_else(unusable)?;
            round.add(&header).ok_or_else(unusable)?;
            estimator = Some(Estimator::new(&header.film.scales, &header.weights, &header.display));
        }
        let estimator = estimator.ok_or("a plan without shards")?;
        self.plan.next(&round.finish(&estimator), noise_levels)
    }

    /// Returns `true` if [`Self::set_finished`] was called for the latest round.
    pub fn is_finished(&self) -> bool {
        let (path, text) = self.finished();
        std::fs::read_to_string(path).is_ok_and(|found| found == text)
    }

    /// Records that no round follows this one.
    pub fn set_finished(&self) -> Result<(), disk::WriteError> {
        let (path, text) = self.finished();
        disk::write(&path, text.as_bytes())
    }

    /// Returns path and contents of the file that records the end of the job.
    fn finished(&self) -> (PathBuf, String) {
        (self.path.with_extension("finished"), format!("plan {:016x}\n", self.head.checksum))
    }
}

/// Returns the path of the part with the samples of `shard` of the plan at `plan`.
fn part_path(plan: &Path, shard: u32) -> PathBuf {
    let stem = plan.file_stem().unwrap_or_default().to_string_lossy();
    plan.with_file_name(format!("{stem}-{shard}.zk"))
}

/// Returns the path of the plan of round `to`, given that of round `from`.
fn round_path(path: &Path, from: u32, to: u32) -> PathBuf {
    let stem = path.file_stem().unwrap_or_default().to_string_lossy();
    let suffix = |round: u32| if round > 1 { format!(".{round}") } else { String::new() };
    let name = stem.strip_suffix(&suffix(from)).unwrap_or(&stem);
    path.with_file_name(format!("{name}{}.plan", suffix(to)))
}
