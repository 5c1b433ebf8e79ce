//! Film files that other processes write, and the sum of their films, for merging and watching.
//! After a change of a file, all films are added again, which takes the memory of one film only.

use crate::checkpoint::seconds_of;
use crate::film::file::{FilmFileHeader, FilmReader, SavedFilm};
use crate::film::{Film, Tile};
use crate::plan::merge::{join, without_plan};
use crate::plan::part::{Part, PartShard, PlanHead, ranges};
use crate::plan::{Job, is_plan_file};
use rayon::prelude::*;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, SystemTime};
use zerkalo_scene::disk::FileStamp;
use zerkalo_scene::value::{sort_by_number, total_order};

/// Largest number of files that are decoded at once.
const MOST_AT_ONCE: usize = 16;
/// Age from which on an unfinished file counts as late. `zerkalo render` replaces its files every
/// minute.
const LATE: Duration = Duration::from_secs(180);

/// Set of film files that other processes write, with the sum of their films.
#[derive(Debug, Default)]
pub struct FilmFiles {
    files: Vec<FilmFile>,
    /// Job whose plan was named, in its latest round.
    pub(super) named: Option<Job>,
    /// Plan that all files share. `None` before the first file, and for a checkpoint without a
    /// plan.
    pub plan: Option<Arc<PlanHead>>,
    /// Sum of the films, with a header that has the plan and all shards. `None` if no file can be
    /// read.
    pub sum: Option<SavedFilm>,
}

/// Film file that another process may replace at any time.
#[derive(Debug)]
struct FilmFile {
    path: PathBuf,
    /// Number of the shard that a plan on the command line expects in this file. `None` for a file
    /// that no such plan lists.
    shard: Option<u32>,
    /// Stamp of the file when it was last read. `None` for a missing file.
    stamp: Option<FileStamp>,
    contents: Contents,
    /// Samples, over all pixels, that the file contributes to the sum.
    samples: u64,
    /// Number of samples of the file's shards when they are complete. `None` before the film is
    /// added, and without a plan.
    total: Option<u64>,
}

#[derive(Debug)]
enum Contents {
    Missing,
    Refused(String),
    Part(Part),
    /// Checkpoint without a plan. The number is its seconds of rendering.
    Checkpoint(f64),
}

/// State of a watched film file, or of shards without a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum WatchedState {
    Complete,
    /// Unfinished, and replaced in the last three minutes.
    Running,
    /// Unfinished, and not replaced for three minutes.
    Late,
    Missing,
    /// Unusable, for the given reason.
    Refused(String),
}

/// Watched film file, or shards without a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WatchedShards {
    /// Numbers of the shards, such as `3` or `5-7`; empty if they are unknown.
    pub shards: String,
    pub path: Option<PathBuf>,
    pub state: WatchedState,
    /// Samples in the file, over all pixels and both replicates.
    pub samples: u64,
    /// Number of samples that the file will hold when it is complete; `None` if unknown.
    pub total: Option<u64>,
    /// Time since the last modification of the file. `None` without a file.
    pub age: Option<Duration>,
}

impl FilmFiles {
    /// Reads the film files at `paths`, which may be missing. A plan file stands for the film files
    /// of the latest round of its job: `job.plan` for `job-1.zk`, `job-2.zk` and so on. Fails if a
    /// plan file cannot be used, or if the films of two files cannot be added.
    pub fn open(paths: &[PathBuf]) -> Result<Self, String> {
        match Self::of_headers(paths)? {
            (_, Some(reason)) => Err(reason),
            (mut films, None) => {
                films.add();
                Ok(films)
            }
        }
    }

    /// Reads the headers of the film files at `paths`, as [`Self::open`] does. Also returns the
    /// reason for which it refuses the first file whose film cannot be added, if any.
    pub fn of_headers(paths: &[PathBuf]) -> Result<(Self, Option<String>), String> {
        let mut films = Self::default();
        films.name(paths)?;
        let changed = films.read_changed();
        let reason = films.accept(&changed);
        Ok((films, reason))
    }

    /// Reads the headers of the parts at `paths`. A plan file stands for the film files of its
    /// shards that exist. Fails if a file cannot be used, or if two films cannot be added.
    pub(super) fn of_parts(paths: &[PathBuf]) -> Result<Self, String> {
        let mut films = Self::default();
        films.name(paths)?;
        for file in &mut films.files {
            if file.shard.is_none() || file.path.exists() {
                file.contents = Contents::read(&file.path)?;
                if let Contents::Checkpoint(_) = file.contents {
                    return Err(without_plan(&file.path));
                }
            }
        }
        films.try_join().map(|()| films)
    }

    /// Returns the job whose plan was named.
    pub fn job(&self) -> Option<&Job> {
        self.named.as_ref()
    }

    /// Adds the files at `paths`, and those of the plan among them.
    fn name(&mut self, paths: &[PathBuf]) -> Result<(), String> {
        for path in paths {
            if is_plan_file(path) {
                self.name_plan(path)?;
            } else {
                self.files.push(FilmFile::new(path.clone(), None));
            }
        }
        Ok(())
    }

    /// Adds the film files of the plan at `path`. Fails if another plan was named before.
    fn name_plan(&mut self, path: &Path) -> Result<(), String> {
        if let Some(other) = &self.named {
            let [one, two] = [other.path.display(), path.display()];
            return Err(format!("{one} and {two} are two plans; name one of them"));
        }
        let job = Job::open(path).map_err(|error| error.to_string())?;
        self.named = Some(job);
        self.name_parts();
        Ok(())
    }

    /// Replaces the film files of the named plan by those of its latest round.
    fn name_parts(&mut self) {
        let Some(job) = &self.named else { return };
        self.files.retain(|file| file.shard.is_none());
        let shards = 1..=job.head.settings.shards;
        self.files.extend(shards.map(|shard| FilmFile::new(job.part_path(shard), Some(shard))));
    }

    /// Reads the files that were replaced since the last call, and goes on to the latest round.
    /// Returns `true` if any were replaced.
    pub fn poll(&mut self) -> bool {
        let advanced = self.named.as_mut().is_some_and(Job::advance);
        if advanced {
            self.name_parts();
        }
        let changed = self.read_changed();
        let differs = advanced || !changed.is_empty();
        if differs {
            self.accept(&changed);
            self.add();
        }
        differs
    }

    /// Returns the rays of all rounds so far.
    pub fn rays(&self) -> u64 {
        let earlier = self.plan.as_ref().map_or(0, |plan| plan.settings.base_rays);
        earlier + self.parts().map(|(_, part)| part.rays).sum::<u64>()
    }

    /// Returns the seconds of rendering that a checkpoint states, or the time from the earliest to
    /// the latest modification of a part.
    pub fn seconds(&self) -> f64 {
        if let [FilmFile { contents: Contents::Checkpoint(seconds), .. }] = self.files[..] {
            return seconds;
        }
        let times = || self.files.iter().filter_map(|file| Some(file.stamp?.modified));
        let between = times().max().zip(times().min());
        let between = between.and_then(|(last, first)| last.duration_since(first).ok());
        between.unwrap_or_default().as_secs_f64()
    }

    /// Returns the share, 0..=1, of the plan's samples that the films hold. `None` without a film
    /// or a plan.
    pub fn progress(&self) -> Option<f64> {
        let (film, plan) = (&self.sum.as_ref()?.film, self.plan.as_ref()?);
        Some(film.samples() as f64 / plan.samples.max(1) as f64)
    }

    /// Counts the complete shards and all shards. `None` without a plan.
    pub fn complete_shards(&self) -> Option<[usize; 2]> {
        let all = self.plan.as_ref()?.settings.shards as usize;
        Some([self.shards_held().filter(|shard| shard.complete).count(), all])
    }

    /// Returns the state at the time `now` of all files, and of shards without a file. The most
    /// urgent states are first: refused, missing, late, running, complete. Unfinished files are in
    /// ascending order of the share of their samples that is traced.
    pub fn shards(&self, now: SystemTime) -> Vec<WatchedShards> {
        let mut rows: Vec<_> = self.files.iter().map(|file| file.row(now)).collect();
        // A named plan has a file for each missing shard.
        if let Some(plan) = self.plan.as_ref().filter(|_| self.named.is_none()) {
            let mut held: Vec<u32> = self.shards_held().map(|shard| shard.number).collect();
            held.sort_unstable();
            let absent = plan.absent(&held);
            if !absent.is_empty() {
                let missing = FilmFile::new(PathBuf::new(), None).row(now);
                rows.push(WatchedShards { shards: ranges(&absent), path: None, ..missing });
            }
        }
        let share = |row: &WatchedShards| match row.total {
            Some(total) if total > 0 => row.samples as f64 / total as f64,
            Some(_) | None => 0.0,
        };
        sort_by_number(&mut rows, |row| {
            total_order(match row.state {
                WatchedState::Refused(_) => 0.0,
                WatchedState::Missing => 1.0,
                WatchedState::Late => 2.0 + share(row),
                WatchedState::Running => 4.0 + share(row),
                WatchedState::Complete => 6.0,
            })
        });
        rows
    }

    /// Iterates over the parts, with the paths of their files.
    pub(super) fn parts(&self) -> impl Iterator<Item = (&Path, &Part)> {
        self.files.iter().filter_map(|file| Some((&*file.path, file.part()?)))
    }

    fn shards_held(&self) -> impl Iterator<Item = &PartShard> {
        self.parts().flat_map(|(_, part)| &part.shards)
    }

    /// Reads the headers of the files whose stamps have changed. Returns their indices.
    fn read_changed(&mut self) -> Vec<usize> {
        let mut changed = Vec::new();
        for (i, file) in self.files.iter_mut().enumerate() {
            // If the file is replaced while it is read, the stamps differ at the next call.
            let stamp = FileStamp::of(&file.path);
            if stamp != file.stamp {
                let contents = match stamp {
                    Some(_) => Contents::read(&file.path),
                    None => Ok(Contents::Missing),
                };
                let contents = contents.unwrap_or_else(Contents::Refused);
                let path = std::mem::take(&mut file.path);
                *file = FilmFile { stamp, contents, ..FilmFile::new(path, file.shard) };
                file.count_samples();
                changed.push(i);
            }
        }
        changed
    }

    /// Refuses each of the `changed` files whose film cannot be added to the unchanged files and to
    /// the changed files that were accepted before. Returns the first reason.
    fn accept(&mut self, changed: &[usize]) -> Option<String> {
        let reason = self.try_join().err()?;
        let new: Vec<Contents> = changed
            .iter()
            .map(|i| std::mem::replace(&mut self.files[*i].contents, Contents::Missing))
            .collect();
        for (i, contents) in changed.iter().zip(new) {
            self.files[*i].contents = contents;
            if let Err(reason) = self.try_join() {
                self.files[*i].contents = Contents::Refused(reason);
            }
        }
        Some(reason)
    }

    /// Checks that all usable films can be added, and stores their common plan.
    fn try_join(&mut self) -> Result<(), String> {
        let is_alone = self.files.len() + usize::from(self.named.is_some()) == 1;
        let mut parts = Vec::new();
        for file in &self.files {
            match &file.contents {
                Contents::Part(part) => parts.push((&*file.path, part)),
                Contents::Checkpoint(_) if !is_alone => return Err(without_plan(&file.path)),
                Contents::Checkpoint(_) | Contents::Missing | Contents::Refused(_) => {}
            }
        }
        let named = self.named.as_ref().map(|job| (&*job.path, &job.head));
        self.plan = join(named, &parts)?.or(self.plan.take().filter(|_| named.is_none()));
        Ok(())
    }

    /// Computes the sum of all films that can be added, and refuses the others.
    fn add(&mut self) {
        while self.try_add().is_err() {}
    }

    /// Computes the sum of all usable films. Refuses the first file that cannot be added, and fails
    /// with the reason.
    pub(super) fn try_add(&mut self) -> Result<(), String> {
        self.sum = None;
        let mut order: Vec<_> =
            self.files.iter_mut().filter(|file| file.first_shard().is_some()).collect();
        order.sort_by_key(|file| file.first_shard());
        let mut sum: Option<SavedFilm> = None;
        // The decoded files at once are a fraction of a film.
        let at_once = (order.len() / 8).clamp(1, MOST_AT_ONCE);
        for files in order.chunks_mut(at_once) {
            let decoded: Vec<_> = files.par_iter().map(|file| file.decode()).collect();
            for (file, decoded) in files.iter_mut().zip(decoded) {
                if let Err(reason) = decoded.and_then(|decoded| file.add_to(&mut sum, decoded)) {
                    file.contents = Contents::Refused(reason.clone());
                    return Err(reason);
                }
            }
        }
        self.add_round_before(&mut sum);
        if let (Some(sum), Some(part)) = (&mut sum, self.part()) {
            part.record(&mut sum.header);
        }
        self.sum = sum;
        Ok(())
    }

    /// Fills the tiles that the named plan's parts do not hold yet with those of the round before.
    fn add_round_before(&self, sum: &mut Option<SavedFilm>) {
        if self.files.iter().all(FilmFile::is_complete) {
            return;
        }
        let mut missing: Option<Vec<bool>> = None;
        for path in self.named.iter().flat_map(Job::previous_parts) {
            let Ok(reader) = FilmReader::open(&path) else { continue };
            let Ok(SavedFilm { film, .. }) = sum_with(&reader.header, sum, &path) else {
                return;
            };
            let empty = |film: &Film| {
                (0..film.tile_count()).map(|tile| film.counts(tile) == [0; 2]).collect()
            };
            let missing = missing.get_or_insert_with(|| empty(film));
            // The picture lacks the tiles of a part that cannot be read.
            let _ = reader.add_tiles(film, |tile| missing[tile]);
        }
    }

    /// Returns the common plan with all shards that the files hold. `None` without such a shard.
    pub(super) fn part(&self) -> Option<Part> {
        let mut shards: Vec<PartShard> = self.shards_held().copied().collect();
        shards.sort_unstable();
        let plan = self.plan.as_ref().filter(|_| !shards.is_empty())?;
        let rays = self.rays() - plan.settings.base_rays;
        Some(Part { plan: Arc::clone(plan), shards, rays })
    }
}

impl Contents {
    fn read(path: &Path) -> Result<Self, String> {
        let reader = FilmReader::open(path).map_err(|error| error.to_string())?;
        let part = Part::of_header(path, &reader.header)?;
        Ok(part.map_or_else(|| Self::Checkpoint(seconds_of(&reader.header)), Self::Part))
    }
}

impl FilmFile {
    fn new(path: PathBuf, shard: Option<u32>) -> Self {
        let contents = Contents::Missing;
        Self { path, shard, stamp: None, contents, samples: 0, total: None }
    }

    fn part(&self) -> Option<&Part> {
        match &self.contents {
            Contents::Part(part) => Some(part),
            Contents::Missing | Contents::Refused(_) | Contents::Checkpoint(_) => None,
        }
    }

    /// Returns the lowest number of a shard in a usable file. `None` for other files.
    fn first_shard(&self) -> Option<u32> {
        match &self.contents {
            Contents::Part(part) => Some(part.shards[0].number),
            Contents::Checkpoint(_) => Some(0),
            Contents::Missing | Contents::Refused(_) => None,
        }
    }

    /// Takes the numbers of samples from the header of a part.
    fn count_samples(&mut self) {
        if let Some(part) = self.part() {
            let count = |i: usize| part.shards.iter().map(|shard| shard.samples[i]).sum();
            (self.samples, self.total) = (count(0), Some(count(1)));
        }
    }

    fn decode(&self) -> Result<(FilmFileHeader, Vec<(usize, Tile)>), String> {
        let decoded = FilmReader::open(&self.path).and_then(FilmReader::tiles);
        decoded.map_err(|error| error.to_string())
    }

    /// Adds the `tiles` of this file to `sum`, which becomes an empty film with the header of the file
    /// if it is `None`. Fails if the number of samples does not fit the shards.
    fn add_to(
        &mut self,
        sum: &mut Option<SavedFilm>,
        (header, tiles): (FilmFileHeader, Vec<(usize, Tile)>),
    ) -> Result<(), String> {
        let SavedFilm { film, .. } = sum_with(&header, sum, &self.path)?;
        let unusable = |what: &str| format!("cannot use {}: {what}", self.path.display());
        film.check_header(&header.film).map_err(|what| unusable(&what))?;
        let before = film.samples();
        tiles.into_iter().for_each(|(number, tile)| film.add_at(number, tile));
        let after = film.samples();
        self.count_samples();
        self.samples = after - before;
        let (samples, expected) = (self.samples, self.total.unwrap_or(self.samples));
        if samples > expected || self.is_complete() && samples != expected {
            let path = self.path.display();
            let what = format!("its {samples} samples are not the {expected} of its shards");
            return Err(format!("cannot use {path}: {what}; trace it again"));
        }
        Ok(())
    }

    fn is_complete(&self) -> bool {
        self.part().is_some_and(Part::is_complete)
    }

    /// Returns the state of the file at the time `now`.
    fn row(&self, now: SystemTime) -> WatchedShards {
        // The clocks of two machines may differ: a modification in the future has the age 0.
        let age = |stamp: FileStamp| now.duration_since(stamp.modified).unwrap_or_default();
        let age = self.stamp.map(age);
        let shards = match self.part() {
            Some(part) => ranges(&part.numbers(|_| true)),
            None => self.shard.map_or(String::new(), |shard| shard.to_string()),
        };
        let state = match &self.contents {
            Contents::Missing => WatchedState::Missing,
            Contents::Refused(reason) => WatchedState::Refused(reason.clone()),
            Contents::Part(_) if self.is_complete() => WatchedState::Complete,
            Contents::Part(_) | Contents::Checkpoint(_) => match age {
                Some(age) if age >= LATE => WatchedState::Late,
                _ => WatchedState::Running,
            },
        };
        let path = Some(self.path.clone());
        WatchedShards { shards, path, state, samples: self.samples, total: self.total, age }
    }
}

/// Returns `sum`, which becomes an empty film with `header`, that of the file at `path`, if it is
/// `None`.
fn sum_with<'a>(
    header: &FilmFileHeader,
    sum: &'a mut Option<SavedFilm>,
    path: &Path,
) -> Result<&'a mut SavedFilm, String> {
    match sum {
        Some(sum) => Ok(sum),
        None => {
            let film = header.empty_film(path).map_err(|error| error.to_string())?;
            Ok(sum.insert(SavedFilm { header: header.clone(), film }))
        }
    }
}
