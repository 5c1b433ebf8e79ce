//! Watched films: film files that other processes write. They are read again when they are
//! replaced, and their sum is kept.
//!
//! Complete files do not change, so that their sum is kept; the unfinished files are added to a
//! copy of it. The memory is that of two films, whatever the number of files.

use crate::film::Film;
use crate::film::file::{Fields, FilmFileHeader, FilmReader, ReadError};
use crate::render::checkpoint::CLOCK;
use crate::render::memory;
use crate::render::plan::members::{Member, Plans, join};
use crate::render::plan::merge::without_plan;
use crate::render::plan::part::{Part, PartShard, ranges};
use crate::render::plan::{BASE, Plan, is_plan_file};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, SystemTime};

/// Age at which an unfinished file is considered late. `zerkalo render` replaces its files every
/// minute.
const LATE: Duration = Duration::from_secs(180);

/// Film files that other processes write, and the sum of their films.
#[derive(Debug)]
pub struct WatchedFilms {
    files: Vec<WatchedFile>,
    plans: Plans,
    /// Plan file that the user named, as a member without shards. `None` if film files were named.
    named: Option<Member>,
    /// Plan that all files share. `None` for a checkpoint, or before the first file is read.
    plan: Option<Arc<Plan>>,
    /// Sum of the complete files, and the stamps of these files by their index in `files`.
    complete: Option<(BTreeMap<usize, FileStamp>, Film)>,
    /// Sum of all files. `None` if no file can be read, or if all files are complete and `complete`
    /// is this sum.
    all: Option<Film>,
    header: Option<FilmFileHeader>,
}

/// File that may be replaced by another process at any time.
#[derive(Debug)]
struct WatchedFile {
    path: PathBuf,
    /// Number of the shard that the file should hold. `None` if the user named film files instead
    /// of a plan.
    shard: Option<u32>,
    /// Stamp of the file when it was last read. `None` for a missing file.
    stamp: Option<FileStamp>,
    contents: Contents,
    /// Number of samples that the file contributes to the sum, over all pixels.
    samples: u64,
    /// Number of samples that the plan assigns to the shards of the file, over all pixels.
    total: Option<u64>,
}

/// Properties of a file that change when it is replaced: modification time, length, inode.
#[derive(Clone, Copy, Debug, PartialEq)]
struct FileStamp {
    modified: SystemTime,
    length: u64,
    inode: u64,
}

#[derive(Debug)]
enum Contents {
    Missing,
    /// The file cannot be used; the text is the reason.
    Refused(String),
    Part(Member),
    /// Checkpoint of a render without a plan. The number is its seconds of rendering.
    Checkpoint(f64),
}

/// State of a watched file, or of missing shards.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum WatchedState {
    /// The file holds all samples of its shards.
    Complete,
    /// The file is unfinished, and was replaced in the last three minutes.
    Running,
    /// The file is unfinished, and has not been replaced for three minutes.
    Late,
    /// There is no file.
    Missing,
    /// The file cannot be used; the text is the reason.
    Refused(String),
}

/// State of a watched file, or of shards of the plan that no file holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WatchedShards {
    /// Numbers of the shards, such as `3` or `5-7`; empty if they are unknown.
    pub shards: String,
    /// Path of the file. `None` for shards that no file holds.
    pub path: Option<PathBuf>,
    /// State of the file.
    pub state: WatchedState,
    /// Number of samples in the file, over all pixels.
    pub samples: u64,
    /// Number of samples that the plan assigns to the shards of the file. `None` if it is unknown.
    pub total: Option<u64>,
    /// Time since the file was written.
    pub age: Option<Duration>,
}

impl WatchedFilms {
    /// Reads the film files at `paths`, which may be missing. The path of a plan file means the
    /// film files of its shards: `job.plan` means `job-0.zk`, `job-1.zk` and so on.
    ///
    /// # Errors
    /// Fails if a plan file cannot be used, or if the films of two files cannot be added.
    pub fn open(paths: &[PathBuf]) -> Result<Self, String> {
        let mut films = Self {
            files: Vec::new(),
            plans: Plans::default(),
            named: None,
            plan: None,
            complete: None,
            all: None,
            header: None,
        };
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
        let member = self.plans.member(path, Part { plan, shards: Vec::new(), rays: 0 });
        if let Some(other) = self.named.replace(member) {
            let [one, two] = [other.path.display(), path.display()];
            return Err(format!("{one} and {two} are two plans; name one of them"));
        }
        // The base of a later round has a name of its own.
        let base_plan = self.named.as_ref().and_then(|member| member.plan.settings.base_plan);
        let shards = self.named.as_ref().map_or(0, |member| member.plan.settings.shards);
        let first = if base_plan.is_some() { BASE + 1 } else { BASE };
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let file = |shard| {
            WatchedFile::new(path.with_file_name(format!("{stem}-{shard}.zk")), Some(shard))
        };
        self.files.extend((first..=shards).map(file));
        Ok(())
    }

    /// Reads the files that were replaced since the last call. Returns `true` if there are any.
    pub fn poll(&mut self) -> bool {
        let changed = self.read_changed();
        if changed.is_empty() {
            return false;
        }
        self.accept(&changed);
        self.add();
        true
    }

    /// Sum of the films. `None` if no file can be read.
    pub fn film(&self) -> Option<&Film> {
        self.all.as_ref().or(self.complete.as_ref().map(|(_, film)| film))
    }

    /// Header of the sum's film file, with plan and shards. `None` if no file can be read.
    pub fn header(&self) -> Option<&FilmFileHeader> {
        self.header.as_ref()
    }

    /// Plan that all files share. `None` for a checkpoint, or before the first file is read.
    pub fn plan(&self) -> Option<&Plan> {
        self.plan.as_deref()
    }

    /// Number of rays of all samples.
    pub fn rays(&self) -> u64 {
        self.members().map(|(_, member)| member.rays).sum()
    }

    /// Seconds of rendering: for a checkpoint those of its render, otherwise the time between the
    /// oldest and the newest file.
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

    /// Number of complete shards and number of all shards, the base included in both. `None`
    /// without a plan.
    pub fn complete_shards(&self) -> Option<[usize; 2]> {
        let plan = self.plan.as_ref()?;
        let shards = self.members().flat_map(|(_, member)| &member.shards);
        Some([shards.filter(|shard| shard.complete).count(), plan.settings.shards as usize + 1])
    }

    /// Returns the state of all files at the time `now`, and the shards without a file. They are
    /// ordered by urgency: missing and refused files, late, running, complete. Files of equal state
    /// are ordered by the fraction of their samples, smallest first.
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
        rows.sort_by(|a, b| {
            a.state.rank().cmp(&b.state.rank()).then(share(a).total_cmp(&share(b)))
        });
        rows
    }

    /// Returns the shards of the plan that no file holds, such as `3, 5-7`. Returns `None` if the
    /// plan file was named, because its files are then listed as missing.
    fn unnamed(&self) -> Option<String> {
        let plan = self.plan.as_ref().filter(|_| self.named.is_none())?;
        let mut held: Vec<u32> =
            self.members().flat_map(|(_, m)| &m.shards).map(|shard| shard.number).collect();
        held.sort_unstable();
        let absent = (BASE..=plan.settings.shards).filter(|n| held.binary_search(n).is_err());
        let absent: Vec<u32> = absent.collect();
        (!absent.is_empty()).then(|| ranges(&absent))
    }

    fn members(&self) -> impl Iterator<Item = (usize, &Member)> {
        self.files.iter().enumerate().filter_map(|(i, file)| match &file.contents {
            Contents::Part(member) => Some((i, member)),
            _ => None,
        })
    }

    /// Reads the files whose stamps have changed. Returns their indices.
    fn read_changed(&mut self) -> Vec<usize> {
        let mut changed = Vec::new();
        for (i, file) in self.files.iter_mut().enumerate() {
            // The stamp is taken before the file is read: a later replacement is read next time.
            let stamp = FileStamp::of(&file.path);
            if stamp != file.stamp {
                file.stamp = stamp;
                file.read(&mut self.plans);
                changed.push(i);
            }
        }
        changed
    }

    /// Refuses each of the `changed` files whose film cannot be added to the films of the other
    /// files. Returns the first reason.
    fn accept(&mut self, changed: &[usize]) -> Option<String> {
        let mut refused = None;
        let all: Vec<usize> = (0..self.files.len()).collect();
        if let Err(message) = self.try_join(&all) {
            let mut accepted: Vec<usize> =
                all.iter().copied().filter(|i| !changed.contains(i)).collect();
            for i in changed {
                accepted.push(*i);
                if let Err(message) = self.try_join(&accepted) {
                    accepted.pop();
                    self.files[*i].contents = Contents::Refused(message);
                }
            }
            refused = Some(message);
        }
        refused
    }

    /// Checks that the films of the files with the indices `numbers` can be added, and stores their
    /// plan.
    fn try_join(&mut self, numbers: &[usize]) -> Result<(), String> {
        let checkpoint = |i: &&usize| matches!(self.files[**i].contents, Contents::Checkpoint(_));
        let parts: Vec<usize> = numbers
            .iter()
            .copied()
            .filter(|i| matches!(self.files[*i].contents, Contents::Part(_)))
            .collect();
        if let Some(checkpoint) = numbers.iter().find(checkpoint)
            && self.files.len() + usize::from(self.named.is_some()) > 1
        {
            return Err(without_plan(&self.files[*checkpoint].path));
        }
        let mut members: Vec<Member> = self.named.iter().cloned().collect();
        members.extend(parts.iter().filter_map(|i| match &self.files[*i].contents {
            Contents::Part(member) => Some(member.clone()),
            _ => None,
        }));
        if members.is_empty() {
            return Ok(());
        }
        let (plan, _) = join(&mut members)?;
        self.plan = Some(plan);
        let joined = members.drain(usize::from(self.named.is_some())..);
        for (i, member) in parts.into_iter().zip(joined) {
            self.files[i].contents = Contents::Part(member);
        }
        Ok(())
    }

    /// Adds the films of all accepted files. If one of them cannot be added, refuses it and starts
    /// again.
    fn add(&mut self) {
        while let Err((i, message)) = self.try_add() {
            self.files[i].contents = Contents::Refused(message);
            self.complete = None;
        }
    }

    /// Adds the films of all accepted files. An error contains the index of the file that cannot be
    /// added, and the reason.
    fn try_add(&mut self) -> Result<(), (usize, String)> {
        (self.all, self.header) = (None, None);
        let mut order: Vec<(u32, usize)> =
            self.members().map(|(i, member)| (member.shards[0].number, i)).collect();
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
        let stamps: BTreeMap<usize, FileStamp> =
            complete.iter().filter_map(|i| Some((*i, self.files[*i].stamp?))).collect();
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

    /// Adds the film of the file with the index `i` to `film`. The error is that of `try_add`.
    fn add_file(&mut self, i: usize, film: &mut Film) -> Result<(), (usize, String)> {
        let before = film.samples();
        self.open_film(i)?.add_to(film).map_err(|error| (i, error.to_string()))?;
        let samples = film.samples() - before;
        let file = &mut self.files[i];
        file.samples = samples;
        if let (Contents::Part(member), None) = (&file.contents, file.total) {
            let samples = |shard: &PartShard| member.plan.samples(shard.number);
            file.total = Some(member.shards.iter().map(samples).sum());
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

    /// Returns `header` with the plan and the shards of all files.
    fn with_shards(&self, mut header: FilmFileHeader) -> FilmFileHeader {
        let mut shards: Vec<PartShard> =
            self.members().flat_map(|(_, member)| member.shards.clone()).collect();
        shards.sort_unstable();
        if let Some(plan) = self.plan.as_ref().filter(|_| !shards.is_empty()) {
            let plan = Plan::clone(plan);
            Part { plan, shards, rays: self.rays() }.record(&mut header);
        }
        header
    }
}

/// Creates a film without samples, with the size of `header`. Fails if there is not enough memory.
fn empty(header: &FilmFileHeader) -> Result<Film, String> {
    let film = &header.film;
    let (size, groups) = ([film.width, film.height].map(|n| n as u32), film.scales.len());
    memory::check(size, groups, 0)?;
    Film::try_new(film.clone()).map_err(|_| memory::refused(size, groups))
}

impl WatchedFile {
    fn new(path: PathBuf, shard: Option<u32>) -> Self {
        Self { path, shard, stamp: None, contents: Contents::Missing, samples: 0, total: None }
    }

    /// Reads and verifies the file, and updates its state.
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
            return Ok(Contents::Part(plans.member(&self.path, part)));
        }
        let seconds = header.chunks.get(&CLOCK).and_then(|clock| Fields::new(clock).f64());
        Ok(Contents::Checkpoint(seconds.filter(|s| s.is_finite() && *s >= 0.0).unwrap_or(0.0)))
    }

    fn is_complete(&self) -> bool {
        match &self.contents {
            Contents::Part(member) => member.shards.iter().all(|shard| shard.complete),
            _ => false,
        }
    }

    fn row(&self, now: SystemTime) -> WatchedShards {
        // The clocks of two machines may differ.
        let age = |stamp: FileStamp| now.duration_since(stamp.modified).unwrap_or_default();
        let age = self.stamp.map(age);
        let shards = match &self.contents {
            Contents::Part(member) => {
                ranges(&member.shards.iter().map(|shard| shard.number).collect::<Vec<_>>())
            }
            _ => self.shard.map_or(String::new(), |shard| shard.to_string()),
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
    /// Rank in the order of display; 0 is the most urgent.
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

impl FileStamp {
    /// Returns the stamp of the file at `path`, or `None` if there is no such file.
    fn of(path: &Path) -> Option<Self> {
        let metadata = fs::metadata(path).ok()?;
        #[cfg(unix)]
        let inode = std::os::unix::fs::MetadataExt::ino(&metadata);
        #[cfg(not(unix))]
        let inode = 0;
        Some(Self { modified: metadata.modified().ok()?, length: metadata.len(), inode })
    }
}
