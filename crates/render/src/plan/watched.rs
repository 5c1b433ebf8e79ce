//! Watched films: film files that other processes write, and the sum of their films. A file is read
//! again when it is replaced.
//!
//! The sum of the complete files is kept in memory, because these files do not change. The
//! unfinished files are added to a copy of this sum. The memory is that of two films, whatever the
//! number of files.

use crate::checkpoint::seconds_of;
use crate::film::Film;
use crate::film::file::{FilmFileHeader, FilmReader, ReadError};
use crate::memory_budget;
use crate::plan::merge::without_plan;
use crate::plan::merge_inputs::{MergeInput, Plans, join};
use crate::plan::part::{Part, PartShard, ranges};
use crate::plan::{BASE, Plan, is_plan_file};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, SystemTime};
use zerkalo_scene::disk::FileStamp;
use zerkalo_scene::value::{sort_by_number, total_order};

/// Time since the last replacement of an unfinished film file after which the file counts as late.
/// It is three minutes, because `zerkalo render` replaces its files every minute.
const LATE: Duration = Duration::from_secs(180);

/// Film files that other processes write, and the sum of their films.
#[derive(Debug, Default)]
pub struct WatchedFilms {
    files: Vec<WatchedFile>,
    plans: Plans,
    /// Plan file that the user named, as an input of a merge; it holds no shards. `None` if the
    /// user named film files.
    named: Option<MergeInput>,
    /// Plan that all film files share. `None` if the only file is a checkpoint of a render without
    /// a plan, or before the first file is read.
    plan: Option<Arc<Plan>>,
    /// `(stamps, sum)` of the complete film files: their stamps (time, length, inode) by their
    /// index in `files`, and the sum of their films. `None` before a file is read.
    complete: Option<(BTreeMap<usize, FileStamp>, Film)>,
    /// Sum of all film files. `None` if no file can be read. Also `None` if all files are complete,
    /// because `complete` then has the sum.
    all: Option<Film>,
    header: Option<FilmFileHeader>,
}

/// Film file that another process may replace at any time.
#[derive(Debug)]
struct WatchedFile {
    path: PathBuf,
    /// Number of the shard that the film file should hold. `None` if the user named film files
    /// instead of a plan.
    shard: Option<u32>,
    /// Stamp of the film file (time, length, inode) when it was last read. `None` for a missing
    /// file.
    stamp: Option<FileStamp>,
    contents: Contents,
    /// Number of samples, over all pixels, that the film file contributes to the sum.
    samples: u64,
    /// Number of samples, over all pixels, that the plan assigns to the shards of the film file.
    /// `None` before the file is added to the sum, and for files without a plan.
    total: Option<u64>,
}

#[derive(Debug)]
enum Contents {
    Missing,
    /// Refused: the film file cannot be used. The text is the reason.
    Refused(String),
    Part(MergeInput),
    /// Checkpoint of a render without a plan. The number is its seconds of rendering.
    Checkpoint(f64),
}

/// State of a watched film file, or of shards (parts of the render) that no file holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum WatchedState {
    /// Complete: the film file holds all samples of its shards.
    Complete,
    /// Running: the film file is unfinished, and was replaced in the last three minutes.
    Running,
    /// Late: the film file is unfinished, and has not been replaced for three minutes.
    Late,
    /// Missing: no film file holds these shards.
    Missing,
    /// Refused: the film file cannot be used. The text is the reason.
    Refused(String),
}

/// State of a watched film file, or of shards of the plan that no file holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WatchedShards {
    /// Numbers of the shards (parts of the render) in the file, or of those that no file holds,
    /// such as `3` or `5-7`; empty if they are unknown.
    pub shards: String,
    /// Path of the film file. `None` for shards that no file holds.
    pub path: Option<PathBuf>,
    /// State of the watched film file: complete, unfinished, missing or unusable.
    pub state: WatchedState,
    /// Number of samples in the film file, over all pixels and both replicates (halves of the
    /// samples).
    pub samples: u64,
    /// Number of samples, over all pixels, that the plan assigns to the shards of the file. `None`
    /// if it is unknown.
    pub total: Option<u64>,
    /// Time from the last modification of the film file to the argument `now` of
    /// [`WatchedFilms::shards`]. `None` if there is no file.
    pub age: Option<Duration>,
}

impl WatchedFilms {
    /// Reads the film files at `paths`, which may be missing. A plan file stands for the film files
    /// of its shards: `job.plan` for `job-0.zk`, `job-1.zk` and so on.
    ///
    /// # Errors
    /// Fails if a plan file cannot be used, or if the films of two files cannot be added.
    pub fn open(paths: &[PathBuf]) -> Result<Self, String> {
        let mut films = Self::default();
        for path in paths {
            if is_plan_file(path) {
                films.name_plan(path)?;
            } else {
                films.files.push(WatchedFile::new(path.clone(), None));
            }
        }
        let changed = films.read_changed();
        if let Some(reason) = films.accept(&changed) {
            return Err(reason);
        }
        films.add();
        Ok(films)
    }

    fn name_plan(&mut self, path: &Path) -> Result<(), String> {
        let plan = Plan::read(path).map_err(|error| error.to_string())?;
        let input = self.plans.input(path, Part { plan, shards: Vec::new(), rays: 0 });
        if let Some(other) = self.named.replace(input) {
            let [one, two] = [other.path.display(), path.display()];
            return Err(format!("{one} and {two} are two plans; name one of them"));
        }
        // If the plan continues an earlier plan, its base is the merged film of the earlier plan.
        // That film has a name of its own, which the name of the plan does not determine.
        let base_plan = self.named.as_ref().and_then(|input| input.plan.settings.base_plan);
        let shards = self.named.as_ref().map_or(0, |input| input.plan.settings.shards);
        let first = if base_plan.is_some() { BASE + 1 } else { BASE };
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let file = |shard| {
            WatchedFile::new(path.with_file_name(format!("{stem}-{shard}.zk")), Some(shard))
        };
        self.files.extend((first..=shards).map(file));
        Ok(())
    }

    /// Reads the film files that were replaced since the last call. Returns `true` if there were
    /// any.
    pub fn poll(&mut self) -> bool {
        let changed = self.read_changed();
        if changed.is_empty() {
            return false;
        }
        self.accept(&changed);
        self.add();
        true
    }

    /// Returns the sum of all films. Returns `None` if no file can be read.
    pub fn film(&self) -> Option<&Film> {
        self.all.as_ref().or(self.complete.as_ref().map(|(_, film)| film))
    }

    /// Returns the header of a film file that would hold the sum of all films. The header contains
    /// the plan and the list of shards. Returns `None` if no file can be read.
    pub fn header(&self) -> Option<&FilmFileHeader> {
        self.header.as_ref()
    }

    /// Returns the plan that all files share. Returns `None` if the only file is a checkpoint of a
    /// render without a plan, or before the first file is read.
    pub fn plan(&self) -> Option<&Plan> {
        self.plan.as_deref()
    }

    /// Returns the number of rays of all samples in the films.
    pub fn rays(&self) -> u64 {
        self.inputs().map(|(_, input)| input.rays).sum()
    }

    /// Returns the seconds of rendering. For a checkpoint they are those of its render. For the
    /// files of a plan they are the time from the earliest to the latest modification of a file.
    pub fn seconds(&self) -> f64 {
        if let [WatchedFile { contents: Contents::Checkpoint(seconds), .. }] = self.files[..] {
            return seconds;
        }
        let times = || self.files.iter().filter_map(|file| Some(file.stamp?.modified));
        let between = times().max().zip(times().min());
        between
            .and_then(|(last, first)| last.duration_since(first).ok())
            .map_or(0.0, |d| d.as_secs_f64())
    }

    /// Returns `[number of complete shards, number of all shards of the plan]`. A shard is the
    /// share of the plan's samples that one process traces. The base, which holds the samples that
    /// the plan started from, counts as a shard. Returns `None` without a plan.
    pub fn complete_shards(&self) -> Option<[usize; 2]> {
        let plan = self.plan.as_ref()?;
        let shards = self.inputs().flat_map(|(_, input)| &input.shards);
        Some([shards.filter(|shard| shard.complete).count(), plan.settings.shards as usize + 1])
    }

    /// Returns the state of all files at the time `now`, and of the shards (parts of the render)
    /// without a file. The most urgent states are first: refused, missing, late, running, complete.
    /// Late files are in ascending order of the fraction of their samples that is traced; so are
    /// running files.
    pub fn shards(&self, now: SystemTime) -> Vec<WatchedShards> {
        let mut rows: Vec<_> = self.files.iter().map(|file| file.row(now)).collect();
        rows.extend(self.unnamed().map(|shards| WatchedShards {
            shards,
            path: None,
            state: WatchedState::Missing,
            samples: 0,
            total: None,
            age: None,
        }));
        let share = |row: &WatchedShards| match (row.state.rank(), row.total) {
            (2 | 3, Some(total)) if total > 0 => row.samples as f64 / total as f64,
            _ => 0.0,
        };
        sort_by_number(&mut rows, |row| total_order(share(row)));
        sort_by_number(&mut rows, |row| row.state.rank().into());
        rows
    }

    /// Returns the shards of the plan that no file holds, such as `3, 5-7`; `None` if there are
    /// none. Also returns `None` if the user named the plan file, because the film file of each
    /// missing shard then has an entry of its own.
    fn unnamed(&self) -> Option<String> {
        let plan = self.plan.as_ref().filter(|_| self.named.is_none())?;
        let mut held: Vec<u32> =
            self.inputs().flat_map(|(_, m)| &m.shards).map(|shard| shard.number).collect();
        held.sort_unstable();
        let absent = plan.absent(&held);
        (!absent.is_empty()).then(|| ranges(&absent))
    }

    fn inputs(&self) -> impl Iterator<Item = (usize, &MergeInput)> {
        self.files.iter().enumerate().filter_map(|(i, file)| Some((i, file.input()?)))
    }

    /// Reads the film files whose stamps have changed. Returns their indices.
    fn read_changed(&mut self) -> Vec<usize> {
        let mut changed = Vec::new();
        for (i, file) in self.files.iter_mut().enumerate() {
            // The stamp is taken before the file is read. If the file is replaced in the meantime,
            // the stamps differ at the next call, and the file is read again.
            let stamp = FileStamp::of(&file.path);
            if stamp != file.stamp {
                file.stamp = stamp;
                file.read(&mut self.plans);
                changed.push(i);
            }
        }
        changed
    }

    /// Checks that the films of all files can be added. Returns `None` if they can. Otherwise tests
    /// the `changed` files one by one. A file is refused if its film cannot be added to the films
    /// of the unchanged files and of the `changed` files accepted before it. Returns the reason for
    /// which the check of all files failed.
    fn accept(&mut self, changed: &[usize]) -> Option<String> {
        let all: Vec<usize> = (0..self.files.len()).collect();
        let refused = self.try_join(&all).err()?;
        let mut accepted: Vec<usize> =
            all.iter().copied().filter(|i| !changed.contains(i)).collect();
        for i in changed {
            accepted.push(*i);
            if let Err(message) = self.try_join(&accepted) {
                accepted.pop();
                self.files[*i].contents = Contents::Refused(message);
            }
        }
        Some(refused)
    }

    /// Checks that the films of the files with the indices `numbers` can be added, and stores their
    /// common plan. Returns an error message if they cannot be added.
    fn try_join(&mut self, numbers: &[usize]) -> Result<(), String> {
        let checkpoint = |i: &&usize| matches!(self.files[**i].contents, Contents::Checkpoint(_));
        let parts = numbers.iter().copied().filter(|i| self.files[*i].input().is_some());
        let parts: Vec<usize> = parts.collect();
        if let Some(checkpoint) = numbers.iter().find(checkpoint)
            && self.files.len() + usize::from(self.named.is_some()) > 1
        {
            return Err(without_plan(&self.files[*checkpoint].path));
        }
        let mut inputs: Vec<MergeInput> = self.named.iter().cloned().collect();
        inputs.extend(parts.iter().filter_map(|i| self.files[*i].input().cloned()));
        if inputs.is_empty() {
            return Ok(());
        }
        let (plan, _) = join(&mut inputs)?;
        self.plan = Some(plan);
        let joined = inputs.drain(usize::from(self.named.is_some())..);
        for (i, input) in parts.into_iter().zip(joined) {
            self.files[i].contents = Contents::Part(input);
        }
        Ok(())
    }

    /// Adds the films of all accepted files to the sum. If a film cannot be added, its file is
    /// refused, and the sum is computed again.
    fn add(&mut self) {
        while let Err((i, message)) = self.try_add() {
            self.files[i].contents = Contents::Refused(message);
            self.complete = None;
        }
    }

    /// Adds the films of all accepted files to the sum of films.
    ///
    /// # Errors
    ///
    /// Returns the index of the file that cannot be added, and the reason.
    fn try_add(&mut self) -> Result<(), (usize, String)> {
        (self.all, self.header) = (None, None);
        let mut order: Vec<(u32, usize)> =
            self.inputs().map(|(i, input)| (input.shards[0].number, i)).collect();
        order.sort_unstable();
        let (complete, unfinished): (Vec<usize>, Vec<usize>) =
            order.iter().map(|(_, i)| *i).partition(|i| self.files[*i].is_complete());
        let checkpoint = |file: &WatchedFile| matches!(file.contents, Contents::Checkpoint(_));
        let checkpoint = self.files.iter().position(checkpoint);
        let Some(first) = order.first().map(|(_, i)| *i).or(checkpoint) else {
            self.complete = None;
            return Ok(());
        };
        let header = self.open_film(first)?.header().clone();
        let mut stamps: BTreeMap<usize, FileStamp> = BTreeMap::new();
        stamps.extend(complete.iter().filter_map(|i| Some((*i, self.files[*i].stamp?))));
        let (mut added, mut film) = match self.complete.take() {
            Some((old, film))
                if film.check_header(&header.film).is_ok()
                    && old.iter().all(|(i, stamp)| stamps.get(i) == Some(stamp)) =>
            {
                (old, film)
            }
            _ => (BTreeMap::new(), empty(&header).map_err(|message| (first, message))?),
        };
        for (i, stamp) in stamps {
            if added.insert(i, stamp).is_none() {
                self.add_file(i, &mut film)?;
            }
        }
        let unfinished = [unfinished, checkpoint.into_iter().collect()].concat();
        if !unfinished.is_empty() {
            let mut all = empty(&header).map_err(|message| (first, message))?;
            all.add(&film).map_err(|error| (first, error.to_string()))?;
            for i in unfinished {
                self.add_file(i, &mut all)?;
            }
            self.all = Some(all);
        }
        self.complete = Some((added, film));
        self.header = Some(self.with_shards(header));
        Ok(())
    }

    /// Adds the film of the file with the index `i` to `film`.
    ///
    /// # Errors
    ///
    /// Returns the index `i` and the reason why the film cannot be added.
    fn add_file(&mut self, i: usize, film: &mut Film) -> Result<(), (usize, String)> {
        let before = film.samples();
        self.open_film(i)?.add_to(film).map_err(|error| (i, error.to_string()))?;
        let samples = film.samples() - before;
        let file = &mut self.files[i];
        file.samples = samples;
        if let (Contents::Part(input), None) = (&file.contents, file.total) {
            let samples = |shard: &PartShard| input.plan.samples(shard.number);
            file.total = Some(input.shards.iter().map(samples).sum());
        }
        let expected = file.total.unwrap_or(samples);
        if samples > expected || file.is_complete() && samples != expected {
            let path = file.path.display();
            let what = format!("its {samples} samples are not the {expected} of its shards");
            return Err((i, format!("cannot use {path}: {what}; trace it again")));
        }
        Ok(())
    }

    fn open_film(
        &self,
        i: usize,
    ) -> Result<FilmReader<std::io::BufReader<fs::File>>, (usize, String)> {
        FilmReader::open(&self.files[i].path).map_err(|error| (i, error.to_string()))
    }

    /// Returns `header` with the plan that all files share and the list of all shards in the files.
    fn with_shards(&self, mut header: FilmFileHeader) -> FilmFileHeader {
        let mut shards: Vec<PartShard> =
            self.inputs().flat_map(|(_, input)| input.shards.clone()).collect();
        shards.sort_unstable();
        if let Some(plan) = self.plan.as_ref().filter(|_| !shards.is_empty()) {
            let plan = Plan::clone(plan);
            Part { plan, shards, rays: self.rays() }.record(&mut header);
        }
        header
    }
}

/// Creates an empty film that has the size, scales, seed and precision of `header`.
///
/// # Errors
///
/// Fails if there is not enough memory.
fn empty(header: &FilmFileHeader) -> Result<Film, String> {
    let film = &header.film;
    let (size, groups) = ([film.width, film.height].map(|n| n as u32), film.scales.len());
    memory_budget::check(size, groups, 0)?;
    Film::try_new(film.clone()).map_err(|_| memory_budget::refused(size, groups))
}

impl WatchedFile {
    fn new(path: PathBuf, shard: Option<u32>) -> Self {
        Self { path, shard, stamp: None, contents: Contents::Missing, samples: 0, total: None }
    }

    /// Reads and verifies the film file, and updates its state.
    fn read(&mut self, plans: &mut Plans) {
        (self.samples, self.total) = (0, None);
        self.contents = if self.stamp.is_none() {
            Contents::Missing
        } else {
            self.try_read(plans).unwrap_or_else(Contents::Refused)
        };
    }

    fn try_read(&self, plans: &mut Plans) -> Result<Contents, String> {
        let text = |error: ReadError| error.to_string();
        let header = FilmReader::open(&self.path).and_then(FilmReader::verify).map_err(text)?;
        if let Some(part) = Part::of_header(&self.path, &header)? {
            return Ok(Contents::Part(plans.input(&self.path, part)));
        }
        Ok(Contents::Checkpoint(seconds_of(&header)))
    }

    /// Returns the file as an input of a merge; `None` if it has no plan or cannot be used.
    fn input(&self) -> Option<&MergeInput> {
        match &self.contents {
            Contents::Part(input) => Some(input),
            _ => None,
        }
    }

    fn is_complete(&self) -> bool {
        self.input().is_some_and(|input| input.shards.iter().all(|shard| shard.complete))
    }

    fn row(&self, now: SystemTime) -> WatchedShards {
        // The modification time may be in the future, because the clocks of two machines may
        // differ. The age is then 0.
        let age = |stamp: FileStamp| now.duration_since(stamp.modified).unwrap_or_default();
        let age = self.stamp.map(age);
        let shards = match self.input() {
            Some(input) => {
                ranges(&input.shards.iter().map(|shard| shard.number).collect::<Vec<_>>())
            }
            None => self.shard.map_or(String::new(), |shard| shard.to_string()),
        };
        let state = match &self.contents {
            Contents::Missing => WatchedState::Missing,
            Contents::Refused(reason) => WatchedState::Refused(reason.clone()),
            _ if self.is_complete() => WatchedState::Complete,
            _ if age.is_some_and(|age| age >= LATE) => WatchedState::Late,
            _ => WatchedState::Running,
        };
        let path = Some(self.path.clone());
        WatchedShards { shards, path, state, samples: self.samples, total: self.total, age }
    }
}

impl WatchedState {
    /// Returns the rank of this state in the list that users see; 0, the most urgent, is first.
    fn rank(&self) -> u8 {
        match self {
            Self::Refused(_) => 0,
            Self::Missing => 1,
            Self::Late => 2,
            Self::Running => 3,
            Self::Complete => 4,
        }
    }
}
