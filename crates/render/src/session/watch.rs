//! Worker of a session that shows films of other processes: it reads film files when they are
//! replaced, and publishes snapshots of the sum of all films.

use crate::export::update_metadata;
use crate::film::file::{FilmFileHeader, SavedFilm};
use crate::film::{Display, Estimator, Noise, TileNoise};
use crate::plan::{FilmFiles, WatchedShards};
use crate::session::Command;
use crate::session::active_render::WorkContext;
use crate::session::picture::{Picture, Source};
use crate::session::report::Report;
use crate::session::snapshot::{Snapshot, ViewCache, tile_estimates};
use crossbeam_channel::{Receiver, RecvTimeoutError};
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant, SystemTime};

/// Interval at which the watched film files are checked.
const POLL: Duration = Duration::from_secs(1);
/// Shortest pause after a check of the watched files, in units of the duration of the check. With
/// 2, checks take at most a third of the time.
const REST: u32 = 2;

/// State of the film files that a session watches. Size, display transform and scene file come from
/// the films, or from the plan if there is no film yet.
#[derive(Clone, Debug, PartialEq)]
pub struct WatchReport {
    /// Rows of [`FilmFiles::shards`].
    pub shards: Vec<WatchedShards>,
    /// Value of [`FilmFiles::complete_shards`].
    pub complete: Option<[usize; 2]>,
    /// Value of [`FilmFiles::progress`].
    pub progress: Option<f64>,
    /// Noise target of the plan: RMSE of the displayed picture in 8-bit levels. `None` without a
    /// plan.
    pub target_levels: Option<f64>,
    /// Width and height of the picture in pixels. `None` if they are unknown.
    pub size: Option<[u32; 2]>,
    pub display: Display,
    /// Path of the scene file; empty if it is unknown.
    pub source: String,
}

pub(super) struct Watcher {
    films: FilmFiles,
    context: WorkContext,
    /// Display transform that the client has set in place of the one in the film files.
    display: Option<Display>,
    /// Picture of the sum of all films. `None` without a film.
    shown: Option<Shown>,
    cache: ViewCache,
}

/// Header, report and noise estimates of the sum of all films, under the present display transform.
struct Shown {
    header: FilmFileHeader,
    report: Report,
    tiles: Vec<Option<TileNoise>>,
}

impl Watcher {
    pub fn new(films: FilmFiles, context: WorkContext) -> Self {
        Self { films, context, display: None, shown: None, cache: ViewCache::default() }
    }

    /// Executes commands and checks the film files until the session ends.
    pub fn run(mut self, inbox: &Receiver<Command>, on_report: &dyn Fn(WatchReport)) {
        self.estimate();
        let mut changed = false;
        let mut due = Instant::now();
        loop {
            match inbox.recv_deadline(due) {
                Ok(Command::View(view)) => {
                    changed |= std::mem::replace(&mut self.context.view, view) != view;
                }
                Ok(Command::Display(display)) => {
                    self.display = Some(display);
                    self.estimate();
                    changed = true;
                }
                Ok(Command::Task(task)) => task(self.picture()),
                Ok(Command::Quit) | Err(RecvTimeoutError::Disconnected) => return,
                Ok(
                    Command::Scene(..)
                    | Command::Resume(..)
                    | Command::Restart(_)
                    | Command::Pause(_)
                    | Command::Stop(_),
                ) => {}
                Err(RecvTimeoutError::Timeout) => {
                    let start = Instant::now();
                    if self.films.poll() {
                        // The cache finds changed tiles by their sample counts. It is dropped,
                        // because equal counts in two sums of films do not mean equal samples.
                        self.cache = ViewCache::default();
                        self.estimate();
                        changed = true;
                    }
                    on_report(WatchReport::new(&self.films));
                    due = Instant::now() + POLL.max(REST * start.elapsed());
                }
            }
            if changed && inbox.is_empty() {
                self.publish();
                changed = false;
            }
        }
    }

    fn picture(&self) -> Option<Picture<'_>> {
        let (sum, Shown { header, report, .. }) =
            self.films.sum.as_ref().zip(self.shown.as_ref())?;
        Some(Picture {
            film: &sum.film,
            weights: &header.weights,
            report,
            source: Source::Files(header),
        })
    }

    /// Updates `shown`: estimates the noise of the sum of all films and reports on it.
    fn estimate(&mut self) {
        self.shown = self.films.sum.as_ref().and_then(|SavedFilm { header, film }| {
            let mut header = header.clone();
            header.display = self.display.unwrap_or(header.display);
            let estimator = Estimator::new(&film.header.scales, &header.weights, &header.display);
            let pool = &self.context.pool;
            let tiles = tile_estimates(film, &estimator, pool, &AtomicBool::new(false))?;
            let report = Report {
                generation: 1,
                rays: self.films.rays(),
                seconds: self.films.seconds(),
                // Tiles that no part holds yet do not count.
                noise: Noise::of_tiles(tiles.iter().copied().filter(|tile| tile.is_some())),
                progress: self.films.progress(),
                threads: pool.current_num_threads(),
                ..Report::of_samples(film)
            };
            update_metadata(&mut header, &report);
            Some(Shown { header, report, tiles })
        });
    }

    fn publish(&mut self) {
        let (Some(SavedFilm { film, .. }), Some(shown)) = (&self.films.sum, &self.shown) else {
            return;
        };
        let Shown { header, report, tiles } = shown;
        let (report, weights) = (report.clone(), header.weights.clone());
        let snapshot = Snapshot { report, weights, ..Snapshot::default() };
        let cache = &mut self.cache;
        self.context.put(snapshot.with_view(film, &header.display, tiles, &self.context, cache));
    }
}

impl WatchReport {
    fn new(films: &FilmFiles) -> Self {
        let settings = films.plan.as_ref().map(|plan| &plan.settings);
        let (size, display, source) = match (&films.sum, settings) {
            (Some(SavedFilm { header, .. }), _) => {
                (Some(header.film.size()), header.display, header.source().unwrap_or_default())
            }
            (None, Some(plan)) => (Some(plan.size), plan.display, plan.source.as_str()),
            (None, None) => (None, Display::default(), ""),
        };
        Self {
            shards: films.shards(SystemTime::now()),
            complete: films.complete_shards(),
            progress: films.progress(),
            target_levels: settings.map(|plan| plan.noise_levels),
            size,
            display,
            source: source.to_string(),
        }
    }
}
