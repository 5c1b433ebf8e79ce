//! Worker of a session that shows films of other processes: it reads film files when they are
//! replaced, and publishes snapshots of the sum of all films.

use crate::export::{update_display, update_metadata};
use crate::film::file::FilmFileHeader;
use crate::film::{Display, Estimator, Film, IncrementalDownsample, Noise, TileNoise};
use crate::plan::{WatchedFilms, WatchedShards};
use crate::session::active_render::WorkContext;
use crate::session::picture::{Picture, Source};
use crate::session::report::Report;
use crate::session::snapshot::{Frame, tile_estimates};
use crate::session::{Command, Task};
use crossbeam_channel::{Receiver, RecvTimeoutError};
use std::ops::ControlFlow;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant, SystemTime};

/// Interval at which the watched film files are checked.
const POLL: Duration = Duration::from_secs(1);
/// Smallest pause after a check of the watched files, as a multiple of the duration of this check.
/// With 2, checks take at most a third of the time.
const REST: u32 = 2;

/// State of the film files that a session watches. A film states size, display transform and scene
/// file; before the first film they are those of the plan.
#[derive(Clone, Debug, PartialEq)]
pub struct WatchReport {
    /// Rows of [`WatchedFilms::shards`], with ages in whole seconds below a minute, and else in
    /// whole minutes.
    pub shards: Vec<WatchedShards>,
    /// Value of [`WatchedFilms::complete_shards`].
    pub complete: Option<[usize; 2]>,
    /// Value of [`WatchedFilms::progress`].
    pub progress: Option<f64>,
    /// Noise target of the plan: RMSE of the displayed picture in 8-bit levels. `None` without a
    /// plan.
    pub target_levels: Option<f64>,
    /// Width and height of the picture in pixels. `None` if they are unknown.
    pub size: Option<[u32; 2]>,
    /// Display transform of the picture.
    pub display: Display,
    /// Path of the scene file; empty if it is unknown.
    pub source: String,
}

pub(super) struct Watcher {
    films: WatchedFilms,
    context: WorkContext,
    /// Display transform that the client has set in place of the one in the film files.
    display: Option<Display>,
    /// Report and noise estimates of the film that is shown. `None` without a film.
    shown: Option<(Report, Vec<Option<TileNoise>>)>,
    downsample: Option<IncrementalDownsample>,
    /// Latest report that was sent to the client.
    reported: Option<WatchReport>,
}

impl Watcher {
    pub fn new(films: WatchedFilms, context: WorkContext) -> Self {
        Self { films, context, display: None, shown: None, downsample: None, reported: None }
    }

    pub fn run(mut self, inbox: &Receiver<Command>, on_report: &dyn Fn(WatchReport)) {
        self.report(on_report);
        self.estimate();
        let mut due = Instant::now() + POLL;
        loop {
            match inbox.recv_deadline(due) {
                Ok(command) => {
                    if self.apply(command, inbox).is_break() {
                        return;
                    }
                }
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
    /// or the display transform changed. Returns `Break` if the session ends.
    fn apply(&mut self, command: Command, inbox: &Receiver<Command>) -> ControlFlow<()> {
        let mut changed = false;
        for command in std::iter::once(command).chain(inbox.try_iter()) {
            match command {
                Command::View(view) => {
                    changed |= std::mem::replace(&mut self.context.view, view) != view;
                }
                Command::Display(display) => {
                    self.display = Some(display);
                    self.estimate();
                    changed = true;
                }
                Command::Task(task) => self.run_task(task),
                Command::Quit => return ControlFlow::Break(()),
                Command::Scene(..)
                | Command::Resume(..)
                | Command::Restart(_)
                | Command::Pause(_)
                | Command::Stop(_)
                | Command::Pool(_) => {}
            }
        }
        if changed {
            self.publish();
        }
        ControlFlow::Continue(())
    }

    fn sum(&self) -> Option<(&Film, &FilmFileHeader)> {
        self.films.film().zip(self.films.header())
    }

    fn run_task(&self, task: Task) {
        let (Some((film, header)), Some((report, _))) = (self.sum(), &self.shown) else {
            return task(None);
        };
        let mut header = header.clone();
        header.display = self.display.unwrap_or(header.display);
        update_metadata(&mut header.metadata, report);
        update_display(&mut header.metadata, &header.display);
        let (mix, source) = (&header.weights, Source::Files(&header));
        task(Some(Picture { film, mix, report, source }));
    }

    /// Estimates the noise of the picture that the sum of all films shows.
    fn estimate(&mut self) {
        self.shown = self.sum().and_then(|(film, header)| {
            let display = self.display.unwrap_or(header.display);
            let estimator = Estimator::new(film.scales(), &header.weights, &display);
            let pool = &self.context.pool;
            let tiles = tile_estimates(film, &estimator, pool, &AtomicBool::new(false))?;
            let report = Report {
                generation: 1,
                rays: self.films.rays(),
                seconds: self.films.seconds(),
                noise: Noise::of_tiles(tiles.iter().copied()),
                progress: self.films.progress(),
                threads: pool.current_num_threads(),
                ..Report::of_samples(film)
            };
            Some((report, tiles))
        });
    }

    fn publish(&mut self) {
        let (Some(film), Some(header)) = (self.films.film(), self.films.header()) else { return };
        let Some((report, tiles)) = &self.shown else { return };
        let frame = Frame {
            view: self.context.view,
            mix: header.weights.clone(),
            display: self.display.unwrap_or(header.display),
            lighting: None,
            first_hits: None,
        };
        let (downsample, pool) = (&mut self.downsample, &self.context.pool);
        self.context.put(frame.snapshot(film, tiles, report.clone(), downsample, pool));
    }

    /// Sends a report to the client if it differs from the latest one.
    fn report(&mut self, on_report: &dyn Fn(WatchReport)) {
        let report = WatchReport::new(&self.films);
        if self.reported.as_ref() != Some(&report) {
            on_report(report.clone());
            self.reported = Some(report);
        }
    }
}

impl WatchReport {
    fn new(films: &WatchedFilms) -> Self {
        let mut shards = films.shards(SystemTime::now());
        for age in shards.iter_mut().filter_map(|row| row.age.as_mut()) {
            let seconds = age.as_secs();
            let unit = if seconds < 60 { 1 } else { 60 };
            *age = Duration::from_secs(seconds / unit * unit);
        }
        let settings = films.plan().map(|plan| &plan.settings);
        let (size, display, source) = match (films.header(), settings) {
            (Some(header), _) => {
                let size = [header.film.width, header.film.height].map(|n| n as u32);
                (Some(size), header.display, header.source().unwrap_or_default())
            }
            (None, Some(plan)) => (Some(plan.size), plan.display, plan.source.as_str()),
            (None, None) => (None, Display::default(), ""),
        };
        Self {
            shards,
            complete: films.complete_shards(),
            progress: films.progress(),
            target_levels: settings.map(|plan| plan.noise_levels),
            size,
            display,
            source: source.to_string(),
        }
    }
}
