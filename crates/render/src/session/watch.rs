//! Session that shows films of other processes. It traces nothing: a thread reads the film files
//! when they are replaced, and publishes snapshots of the sum of all films.

use crate::export::{update_display, update_metadata};
use crate::film::file::FilmFileHeader;
use crate::film::{Display, Estimator, Film, IncrementalDownsample, Noise, TileNoise};
use crate::plan::WatchedFilms;
pub use crate::plan::{WatchedShards, WatchedState};
use crate::session::report::Report;
use crate::session::snapshot::{Frame, Slot, Snapshot, View};
use crate::threads;
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, TryRecvError, bounded, unbounded};
use rayon::prelude::*;
use std::io;
use std::sync::Arc;
use std::time::{Duration, Instant, SystemTime};

/// Interval at which the watched film files are checked.
const POLL: Duration = Duration::from_secs(1);
/// Smallest pause after a check of the watched files, as a multiple of the duration of this check.
/// With 2, checks take at most a third of the time.
const REST: u32 = 2;

/// Function that a client queues to run on the thread of the watch session. Its argument is the
/// film, the film's header and the report on the film; `None` without a film. The header has the
/// metadata of the picture and its display transform.
type Task = Box<dyn FnOnce(Option<(&Film, &FilmFileHeader, &Report)>) + Send>;

enum Command {
    View(View),
    Display(Display),
    Task(Task),
}

/// State of the film files that a watch session shows.
#[derive(Clone, Debug, PartialEq)]
pub struct WatchReport {
    /// State of each film file, and of the shards (parts of the render) that no file holds. They
    /// are sorted by state: refused, missing, late, running, complete. The age of a file is the
    /// time since its last modification. It is rounded down, to seconds in the first minute and
    /// then to minutes.
    pub shards: Vec<WatchedShards>,
    /// `[number of complete shards, number of all shards]`, where a plan divides the render into
    /// shards. The base, which holds the samples that the plan started from, counts as a shard.
    /// `None` without a plan.
    pub complete: Option<[usize; 2]>,
    /// Number of samples in the picture, divided by the number of samples of the whole render that
    /// a plan divides into shards; 0..=1. `None` without a plan or a film.
    pub progress: Option<f64>,
    /// Noise target of the plan: RMSE of the displayed picture in 8-bit levels. `None` without a
    /// plan.
    pub target_levels: Option<f64>,
    /// Width and height of the picture in pixels, from the film files or else from the plan. `None`
    /// if there are neither.
    pub size: Option<[u32; 2]>,
    /// Display transform of the film files, or that of the plan before the first film.
    pub display: Display,
    /// Path of the scene file from which the films are rendered, as the film files or else the plan
    /// state it. Empty if there are neither.
    pub source: String,
}

/// Handle of the thread that shows films of other processes. The thread ends after the handle is
/// dropped.
pub struct WatchSession {
    commands: Sender<Command>,
    slot: Arc<Slot>,
    wakeup: Receiver<()>,
}

impl WatchSession {
    /// Starts the thread that shows `films`, with `threads` threads for its computations. The
    /// thread calls `on_report` with each report that differs from the previous one.
    ///
    /// # Errors
    /// Returns the operating system's error if a thread cannot be started.
    pub fn new(
        films: WatchedFilms,
        threads: usize,
        on_report: impl Fn(WatchReport) + Send + 'static,
    ) -> io::Result<Self> {
        let (commands, inbox) = unbounded();
        let (notify, wakeup) = bounded(1);
        let slot = Arc::new(Slot::default());
        let worker = Worker {
            films,
            pool: threads::pool(threads, 0)?,
            slot: Arc::clone(&slot),
            notify,
            view: View::default(),
            display: None,
            shown: None,
            downsample: None,
            reported: None,
        };
        let run = move || worker.run(&inbox, &on_report);
        std::thread::Builder::new().name("watch".into()).spawn(run)?;
        Ok(Self { commands, slot, wakeup })
    }

    /// Sets the contents of snapshots: the size of the picture, and the pixel to probe.
    pub fn set_view(&self, view: View) {
        self.send(Command::View(view));
    }

    /// Sets the display transform of pictures and noise estimates. It replaces the one in the film
    /// files.
    pub fn set_display(&self, display: Display) {
        self.send(Command::Display(display));
    }

    /// Queues `task` to run on the thread of the watch session. Its argument is the film, the
    /// film's header and the report on the film; `None` without a film.
    pub fn submit(
        &self,
        task: impl FnOnce(Option<(&Film, &FilmFileHeader, &Report)>) + Send + 'static,
    ) {
        self.send(Command::Task(Box::new(task)));
    }

    /// Returns the channel that receives a message whenever a new snapshot is published.
    pub fn wakeup(&self) -> &Receiver<()> {
        &self.wakeup
    }

    /// Takes the latest snapshot. Returns `None` if it has been taken already.
    pub fn take(&self) -> Option<Snapshot> {
        self.slot.take()
    }

    /// Returns `true` if the thread of the watch session has ended by a panic.
    pub fn has_ended(&self) -> bool {
        matches!(self.wakeup.try_recv(), Err(TryRecvError::Disconnected))
    }

    fn send(&self, command: Command) {
        // Sending fails only if the thread has panicked, which `has_ended` reports. Otherwise the
        // thread runs until this handle is dropped.
        let _ = self.commands.send(command);
    }
}

struct Worker {
    films: WatchedFilms,
    pool: rayon::ThreadPool,
    slot: Arc<Slot>,
    notify: Sender<()>,
    view: View,
    /// Display transform that the client has set; it replaces the one in the film files. `None` if
    /// the client has set none.
    display: Option<Display>,
    /// Report and noise estimates of the film that is shown. `None` without a film.
    shown: Option<Shown>,
    downsample: Option<IncrementalDownsample>,
    /// Latest report that was sent to the client. `None` before the first.
    reported: Option<WatchReport>,
}

/// Report on the film that a watch session shows, and RMSE of the film's tiles in 8-bit levels.
struct Shown {
    report: Report,
    noise_levels: Vec<f32>,
}

impl Worker {
    fn run(mut self, inbox: &Receiver<Command>, on_report: &dyn Fn(WatchReport)) {
        self.report(on_report);
        self.estimate();
        let mut due = Instant::now() + POLL;
        loop {
            match inbox.recv_deadline(due) {
                Ok(command) => self.apply(command, inbox),
                Err(RecvTimeoutError::Disconnected) => return,
                Err(RecvTimeoutError::Timeout) => {}
            }
            if due <= Instant::now() {
                let start = Instant::now();
                if self.films.poll() {
                    // The cache finds changed tiles by their sample counts. It is dropped, because
                    // equal counts in two sums of films do not mean equal samples.
                    self.downsample = None;
                    self.estimate();
                    self.publish();
                }
                self.report(on_report);
                due = Instant::now() + POLL.max(REST * start.elapsed());
            }
        }
    }

    /// Executes `command` and those queued after it. Publishes a snapshot if the requested contents
    /// or the display transform changed.
    fn apply(&mut self, command: Command, inbox: &Receiver<Command>) {
        let mut changed = false;
        let mut next = Some(command);
        while let Some(command) = next {
            match command {
                Command::View(view) => {
                    changed |= self.view != view;
                    self.view = view;
                }
                Command::Display(display) => {
                    self.display = Some(display);
                    self.estimate();
                    changed = true;
                }
                Command::Task(task) => self.run_task(task),
            }
            next = inbox.try_recv().ok();
        }
        if changed {
            self.publish();
        }
    }

    fn run_task(&self, task: Task) {
        let (Some(film), Some(shown)) = (self.films.film(), &self.shown) else { return task(None) };
        let Some(mut header) = self.films.header().cloned() else { return task(None) };
        header.display = self.display.unwrap_or(header.display);
        update_metadata(&mut header.metadata, &shown.report);
        update_display(&mut header.metadata, &header.display);
        task(Some((film, &header, &shown.report)));
    }

    /// Estimates the noise of the picture that the sum of all films shows.
    fn estimate(&mut self) {
        self.shown = None;
        let (Some(film), Some(header)) = (self.films.film(), self.films.header()) else { return };
        let display = self.display.unwrap_or(header.display);
        let estimator = Estimator::new(film.scales(), &header.weights, &display);
        // `tile_so_far` permits that A and B (the halves of the samples) have different counts, as
        // they may have in a checkpoint.
        let noise = |tile| film.tile(tile).and_then(|tile| estimator.tile_so_far(tile));
        let tiles: Vec<Option<TileNoise>> =
            self.pool.install(|| (0..film.tile_count()).into_par_iter().map(noise).collect());
        let levels =
            |tile: &Option<TileNoise>| tile.map_or(0.0, |t| t.of_all().levels.sqrt() as f32);
        let noise_levels = tiles.iter().map(levels).collect();
        let report = Report {
            generation: 1,
            rays: self.films.rays(),
            seconds: self.films.seconds(),
            noise: Noise::of_tiles(tiles),
            progress: self.progress(),
            threads: self.pool.current_num_threads(),
            ..Report::of_samples(film)
        };
        self.shown = Some(Shown { report, noise_levels });
    }

    fn progress(&self) -> Option<f64> {
        let (film, plan) = (self.films.film()?, self.films.plan()?);
        let pixels = (film.width() * film.height()) as f64;
        Some(film.samples() as f64 / (plan.spp() * pixels).max(1.0))
    }

    fn publish(&mut self) {
        let (Some(film), Some(header)) = (self.films.film(), self.films.header()) else { return };
        let Some(Shown { report, noise_levels }) = &self.shown else { return };
        let frame = Frame {
            view: self.view,
            mix: header.weights.clone(),
            display: self.display.unwrap_or(header.display),
            lighting: None,
            first_hits: None,
        };
        let downsample = &mut self.downsample;
        let snapshot =
            frame.snapshot(film, noise_levels.clone(), report.clone(), downsample, &self.pool);
        self.slot.put(snapshot);
        // A full channel means that a wake-up is pending.
        let _ = self.notify.try_send(());
    }

    /// Sends a report to the client if it differs from the latest one.
    fn report(&mut self, on_report: &dyn Fn(WatchReport)) {
        let report = WatchReport::new(&self.films, self.progress());
        if self.reported.as_ref() != Some(&report) {
            on_report(report.clone());
            self.reported = Some(report);
        }
    }
}

impl WatchReport {
    fn new(films: &WatchedFilms, progress: Option<f64>) -> Self {
        let mut shards = films.shards(SystemTime::now());
        for age in shards.iter_mut().filter_map(|row| row.age.as_mut()) {
            let seconds = age.as_secs();
            let unit = if seconds < 60 { 1 } else { 60 };
            *age = Duration::from_secs(seconds / unit * unit);
        }
        let settings = films.plan().map(|plan| &plan.settings);
        let header = films.header();
        let source = header.and_then(FilmFileHeader::source);
        let source = source.or(settings.map(|settings| settings.source.as_str()));
        let film_size = header.map(|h| [h.film.width, h.film.height].map(|n| n as u32));
        let display = header.map(|header| header.display).or(settings.map(|s| s.display));
        Self {
            shards,
            complete: films.complete_shards(),
            progress,
            target_levels: settings.map(|settings| settings.noise_levels),
            size: film_size.or(settings.map(|settings| settings.size)),
            display: display.unwrap_or_default(),
            source: source.unwrap_or_default().to_string(),
        }
    }
}
