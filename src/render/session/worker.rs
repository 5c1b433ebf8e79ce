//! The session's thread.

use super::report::State;
use super::{Command, Report, Shared, Snapshot, Task, Traced};
use crate::film::Film;
use crate::render::schedule::{Schedule, Settings, Step};
use crate::render::wave::Wave;
use crate::scene::Scene;
use crossbeam_channel::{Receiver, Sender};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// A scene in work.
struct Work<T> {
    traced: T,
    schedule: Schedule,
    /// When the scene was taken up.
    begun: Instant,
    compiled_in: Duration,
    /// Time spent in waves.
    traced_for: Duration,
    first_picture: Option<Duration>,
}

pub(super) struct Worker<T: Traced> {
    inbox: Receiver<Command<T>>,
    ring: Sender<()>,
    shared: Arc<Shared>,
    pool: rayon::ThreadPool,
    options: T::Options,
    settings: Settings,
    /// The newest scene and its number, until it is compiled.
    newest: Option<(u64, Arc<Scene>)>,
    tasks: Vec<Task<T>>,
    paused: bool,
    view: Option<[usize; 2]>,
    generation: u64,
    work: Result<Option<Work<T>>, String>,
    /// What is going on, as far as the last step told.
    state: State,
}

impl<T: Traced> Worker<T> {
    pub fn new(
        inbox: Receiver<Command<T>>,
        ring: Sender<()>,
        shared: Arc<Shared>,
        pool: rayon::ThreadPool,
        options: T::Options,
        settings: Settings,
    ) -> Self {
        Self {
            inbox,
            ring,
            shared,
            pool,
            options,
            settings,
            newest: None,
            tasks: Vec::new(),
            paused: false,
            view: None,
            generation: 0,
            work: Ok(None),
            state: State::Idle,
        }
    }

    pub fn run(mut self) {
        while self.listen().is_continue() {
            if let Some((generation, scene)) = self.newest.take() {
                self.take_up(generation, &scene);
            }
            self.run_tasks();
            self.advance();
        }
    }

    /// Takes in all commands; waits for one if there is nothing to do.
    fn listen(&mut self) -> ControlFlow<()> {
        // The marks first, then the inbox: see the module's description.
        self.shared.interrupt.swap(false, Ordering::AcqRel);
        self.shared.abandon.swap(false, Ordering::AcqRel);
        if self.state != State::Tracing {
            match self.inbox.recv() {
                Ok(command) => self.apply(command)?,
                Err(_) => return ControlFlow::Break(()),
            }
        }
        while let Ok(command) = self.inbox.try_recv() {
            self.apply(command)?;
        }
        ControlFlow::Continue(())
    }

    fn apply(&mut self, command: Command<T>) -> ControlFlow<()> {
        match command {
            Command::Scene(generation, scene) => self.newest = Some((generation, scene)),
            Command::Pause(paused) => self.paused = paused,
            Command::View(view) => self.view = view,
            Command::Task(task) => self.tasks.push(task),
            Command::Quit => return ControlFlow::Break(()),
        }
        ControlFlow::Continue(())
    }

    fn take_up(&mut self, generation: u64, scene: &Scene) {
        let begun = Instant::now();
        let before = std::mem::replace(&mut self.work, Ok(None)).ok().flatten().map(|w| w.traced);
        self.generation = generation;
        self.work = T::begin(scene, &self.options, before).map(|traced| {
            Some(Work {
                schedule: traced.schedule(Settings {
                    rays_per_pixel: scene.film.rays_per_pixel,
                    ..self.settings
                }),
                traced,
                begun,
                compiled_in: begun.elapsed(),
                traced_for: Duration::ZERO,
                first_picture: None,
            })
        });
    }

    fn run_tasks(&mut self) {
        let report = self.report();
        for task in self.tasks.drain(..) {
            // Without a film the task is dropped, and its guest gets no answer.
            if let Ok(Some(work)) = &self.work {
                task(&work.traced, &report);
            }
        }
    }

    /// One wave, or none if there is nothing to do.
    fn advance(&mut self) {
        let (generation, paused) = (self.generation, self.paused);
        let shown = Shown { shared: &self.shared, ring: &self.ring, view: self.view, generation };
        let work = match &mut self.work {
            Ok(Some(work)) => work,
            Ok(None) => return,
            Err(why) => {
                self.state = State::Failed(why.clone());
                let report = Report { generation, state: self.state.clone(), ..Report::idle() };
                shown.put(Snapshot { report, picture: None, tile_noise: Vec::new() });
                return;
            }
        };
        // The first picture of a scene is shown even in a pause.
        self.state = if paused && work.first_picture.is_some() {
            State::Paused
        } else {
            match work.schedule.next(work.traced_for.as_secs_f64()) {
                Step::Rest(reason) => State::Resting(reason),
                Step::Trace(wave) => {
                    work.trace(&wave, &self.pool, &shown);
                    State::Tracing
                }
            }
        };
        let report = work.report(generation, self.state.clone());
        let noise = work.schedule.tile_noise_codes();
        shown.publish(work.traced.film(), noise, report, self.state != State::Tracing);
    }

    fn report(&self) -> Report {
        match &self.work {
            Ok(Some(work)) => work.report(self.generation, self.state.clone()),
            _ => Report::idle(),
        }
    }
}

impl<T: Traced> Work<T> {
    fn trace(&mut self, wave: &Wave, pool: &rayon::ThreadPool, shown: &Shown) {
        let start = Instant::now();
        let marks = shown.shared;
        let report = if self.first_picture.is_some() {
            Some(self.traced.run(wave, pool, &marks.interrupt))
        } else {
            let coarse = self.report(shown.generation, State::Tracing);
            self.traced.first(wave, pool, &marks.abandon, &mut |film| {
                shown.publish(film, Vec::new(), coarse.clone(), true);
            })
        };
        self.traced_for += start.elapsed();
        match report {
            Some(report) => {
                self.schedule.complete(wave, &report);
                self.first_picture.get_or_insert_with(|| self.begun.elapsed());
            }
            // Abandoned for a newer scene; or by a mark that was raised late, for this very scene.
            None => self.traced.restart(),
        }
    }

    fn report(&self, generation: u64, state: State) -> Report {
        let seconds = self.traced_for.as_secs_f64();
        Report {
            generation,
            state,
            spp: self.schedule.spp(),
            samples: self.schedule.samples(),
            rays: self.schedule.rays(),
            seconds,
            compile_seconds: self.compiled_in.as_secs_f64(),
            first_picture_seconds: self.first_picture.map(|t| t.as_secs_f64()),
            noise: self.schedule.noise(),
            eta_seconds: self.schedule.eta_seconds(seconds),
            progress: self.schedule.progress(seconds),
            bad_samples: self.traced.film().bad_samples().count,
        }
    }
}

/// Where snapshots go.
struct Shown<'a> {
    shared: &'a Shared,
    ring: &'a Sender<()>,
    view: Option<[usize; 2]>,
    generation: u64,
}

impl Shown<'_> {
    /// Publishes where the work stands, with a picture if the guest wants one. Between waves
    /// (`newest`: false) the guest first has to take the last picture: it would only be replaced
    /// before it is seen, and making it costs time.
    fn publish(&self, film: &Film, tile_noise: Vec<f32>, report: Report, newest: bool) {
        if self.view.is_some() && !newest && !self.shared.slot.is_empty() {
            return;
        }
        let picture = self.view.map(|[columns, rows]| film.thumbnail(columns, rows));
        self.put(Snapshot { report, picture, tile_noise });
    }

    fn put(&self, snapshot: Snapshot) {
        self.shared.slot.put(snapshot);
        // A bell that is ringing already will do.
        let _ = self.ring.try_send(());
    }
}
