//! The session's thread: takes in commands, decides what is done next.

use crate::film::Display;
use crate::render::schedule::{Settings, Step, Stop};
use crate::render::session::active_render::{ActiveRender, WorkContext};
use crate::render::session::report::{Report, State};
use crate::render::session::snapshot::{Snapshot, View};
use crate::render::session::{Command, RenderBackend, Shared, Task};
use crate::scene::Scene;
use crossbeam_channel::{Receiver, Sender};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::Ordering;

pub(super) struct Worker<T: RenderBackend> {
    inbox: Receiver<Command<T>>,
    notify: Sender<()>,
    shared: Arc<Shared>,
    pool: rayon::ThreadPool,
    options: T::Options,
    settings: Settings,
    /// The newest scene and its number.
    newest: Option<(u64, Arc<Scene>)>,
    /// The newest scene has not been taken up yet.
    pending: bool,
    /// It is to begin with an empty film.
    afresh: bool,
    tasks: Vec<Task<T>>,
    paused: bool,
    view: View,
    work: Result<Option<ActiveRender<T>>, String>,
    /// What is going on, as far as the last step told.
    state: State,
    /// There is nothing to do before the next command.
    idle: bool,
}

impl<T: RenderBackend> Worker<T> {
    pub fn new(
        inbox: Receiver<Command<T>>,
        notify: Sender<()>,
        shared: Arc<Shared>,
        pool: rayon::ThreadPool,
        options: T::Options,
        settings: Settings,
    ) -> Self {
        Self {
            inbox,
            notify,
            shared,
            pool,
            options,
            settings,
            newest: None,
            pending: false,
            afresh: false,
            tasks: Vec::new(),
            paused: false,
            view: View::default(),
            work: Ok(None),
            state: State::Idle,
            idle: true,
        }
    }

    pub fn run(mut self) {
        while self.listen().is_continue() {
            if std::mem::take(&mut self.pending) {
                self.start_newest();
            }
            self.run_tasks();
            self.advance();
        }
    }

    /// Takes in all commands; waits for one if there is nothing to do.
    fn listen(&mut self) -> ControlFlow<()> {
        // The marks first, then the inbox: see the module's description.
        self.shared.cancel_wave.swap(false, Ordering::AcqRel);
        self.shared.cancel_first_pass.swap(false, Ordering::AcqRel);
        if self.idle {
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
            Command::Scene(generation, scene) => {
                self.newest = Some((generation, scene));
                self.pending = true;
            }
            Command::Restart(number) => {
                if let Some((generation, _)) = &mut self.newest {
                    *generation = number;
                    (self.pending, self.afresh) = (true, true);
                }
            }
            Command::Pause(paused) => self.paused = paused,
            Command::View(view) => self.view = view,
            Command::Stop(stop) => self.set_stop(stop),
            Command::Display(display) => self.set_display(display),
            Command::Pool(pool) => {
                self.pool = pool;
                if let Ok(Some(work)) = &mut self.work {
                    work.forget_pace();
                }
            }
            Command::Task(task) => self.tasks.push(task),
            Command::Quit => return ControlFlow::Break(()),
        }
        ControlFlow::Continue(())
    }

    fn set_stop(&mut self, stop: Stop) {
        self.settings.stop = stop;
        if let Ok(Some(work)) = &mut self.work {
            work.schedule.set_stop(stop);
        }
    }

    fn set_display(&mut self, display: Display) {
        *T::display_of(&mut self.options) = display;
        if let Ok(Some(work)) = &mut self.work
            && work.traced.display() != display
        {
            work.traced.set_display(display);
            work.invalidate_estimates();
        }
    }

    fn start_newest(&mut self) {
        let Some((_, scene)) = &self.newest else { return };
        let afresh = std::mem::take(&mut self.afresh);
        if let Ok(Some(work)) = &mut self.work
            && !afresh
            && work.try_reuse(scene)
        {
            return;
        }
        let before = std::mem::replace(&mut self.work, Ok(None)).ok().flatten();
        self.work = ActiveRender::begin(scene, &self.options, self.settings, before).map(Some);
    }

    fn run_tasks(&mut self) {
        if self.tasks.is_empty() {
            return;
        }
        let tasks = std::mem::take(&mut self.tasks);
        let film = match &self.work {
            Ok(Some(work)) => Some((&work.traced, work.report(&self.site(), self.state.clone()))),
            _ => None,
        };
        for task in tasks {
            task(film.as_ref().map(|(traced, report)| (*traced, report)));
        }
    }

    fn generation(&self) -> u64 {
        self.newest.as_ref().map_or(0, |(generation, _)| *generation)
    }

    fn site(&self) -> WorkContext<'_> {
        WorkContext {
            pool: &self.pool,
            shared: &self.shared,
            notify: &self.notify,
            view: self.view,
            generation: self.generation(),
        }
    }

    /// One piece of work, or none if there is nothing to do.
    fn advance(&mut self) {
        let generation = self.generation();
        let site = WorkContext {
            pool: &self.pool,
            shared: &self.shared,
            notify: &self.notify,
            view: self.view,
            generation,
        };
        self.idle = true;
        let work = match &mut self.work {
            Ok(Some(work)) => work,
            Ok(None) => return,
            Err(why) => {
                self.state = State::Failed(why.clone());
                let idle = Report::idle(self.pool.current_num_threads());
                let report = Report { generation, state: self.state.clone(), ..idle };
                site.put(Snapshot::without_film(report));
                return;
            }
        };
        // The first picture of a scene is shown even in a pause.
        let paused = self.paused && work.first_picture.is_some();
        if work.misjudged {
            // The new look is shown at once, its noise as soon as it is known.
            self.state = if paused { State::Paused } else { State::Tracing };
            work.publish(&site, self.state.clone(), true);
            if !work.reestimate(&self.pool, &self.shared.cancel_wave) {
                self.idle = false;
                return;
            }
        }
        self.state = if paused {
            State::Paused
        } else {
            match work.schedule.next(work.seconds()) {
                Step::Finished(reason) => State::Finished(reason),
                Step::Trace(wave) => {
                    work.trace(wave, &site);
                    self.idle = false;
                    State::Tracing
                }
            }
        };
        work.publish(&site, self.state.clone(), self.idle);
    }
}
