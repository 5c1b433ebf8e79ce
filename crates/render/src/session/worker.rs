//! Worker of a session that renders: receives commands and chooses the next piece of work.

use crate::film::Display;
use crate::schedule::{Settings, Step};
use crate::session::active_render::{ActiveRender, WorkContext};
use crate::session::picture::{Picture, Source};
use crate::session::report::{Report, State};
use crate::session::snapshot::Snapshot;
use crate::session::{Command, Task};
use crate::{Checkpoint, Options};
use crossbeam_channel::Receiver;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use zerkalo_scene::Scene;

pub(super) struct Worker {
    inbox: Receiver<Command>,
    context: WorkContext,
    options: Options,
    settings: Settings,
    /// Newest scene that the client has set.
    newest: Option<Arc<Scene>>,
    /// `true` if the render of `newest` has not been started yet.
    pending: bool,
    /// `true` if the render of `newest` must start with an empty film, whatever samples there are.
    restart: bool,
    /// Scene of a waiting [`Command::Resume`], and the checkpoint from which its render continues.
    resume: Option<(Arc<Scene>, Box<Checkpoint>)>,
    tasks: Vec<Task>,
    paused: bool,
    /// Active render, or the reason why the newest scene cannot be rendered.
    work: Result<Option<ActiveRender>, String>,
    state: State,
    /// `true` if there is no work until the next command.
    idle: bool,
}

impl Worker {
    pub fn new(
        inbox: Receiver<Command>,
        context: WorkContext,
        options: Options,
        settings: Settings,
    ) -> Self {
        Self {
            inbox,
            context,
            options,
            settings,
            newest: None,
            pending: false,
            restart: false,
            resume: None,
            tasks: Vec::new(),
            paused: false,
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
            self.avoid_rounding();
            self.run_tasks();
            self.advance();
        }
    }

    /// Receives all queued commands, or waits for one if there is no work. Returns `Break` if the
    /// session ends.
    fn listen(&mut self) -> ControlFlow<()> {
        // The flags are lowered before commands are received; the module `session` gives the
        // reason.
        self.context.shared.cancel_wave.swap(false, Ordering::AcqRel);
        self.context.shared.cancel_first_pass.swap(false, Ordering::AcqRel);
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

    /// Executes a command, or records it for the next piece of work. Returns `Break` for `Quit`.
    fn apply(&mut self, command: Command) -> ControlFlow<()> {
        if matches!(command, Command::Scene(..) | Command::Resume(..) | Command::Restart(_)) {
            // Earlier tasks get the picture that this command replaces.
            self.run_tasks();
        }
        match command {
            Command::Scene(generation, scene) => {
                self.newest = Some(scene);
                (self.pending, self.context.generation) = (true, generation);
            }
            Command::Resume(generation, scene, checkpoint) => {
                self.resume = Some((Arc::clone(&scene), checkpoint));
                self.newest = Some(scene);
                (self.pending, self.context.generation) = (true, generation);
            }
            Command::Restart(generation) => {
                if self.newest.is_some() {
                    (self.pending, self.restart) = (true, true);
                    self.context.generation = generation;
                }
            }
            Command::Pause(paused) => self.paused = paused,
            Command::View(view) => self.context.view = view,
            Command::Stop(stop) => {
                self.settings.stop = stop;
                self.work().into_iter().for_each(|work| work.schedule.settings.stop = stop);
            }
            Command::Display(display) => self.set_display(display),
            Command::Task(task) => self.tasks.push(task),
            Command::Quit => return ControlFlow::Break(()),
        }
        ControlFlow::Continue(())
    }

    fn work(&mut self) -> Option<&mut ActiveRender> {
        self.work.as_mut().ok().and_then(Option::as_mut)
    }

    fn set_display(&mut self, display: Display) {
        self.options.display = display;
        if let Some(work) = self.work()
            && work.state.display() != display
        {
            work.state.set_display(display);
            work.invalidate_estimates();
        }
    }

    /// Starts the newest scene: from a checkpoint, with the present samples, or with an empty film.
    fn start_newest(&mut self) {
        let Some(scene) = &self.newest else { return };
        let restart = std::mem::take(&mut self.restart);
        if let Some((own, checkpoint)) = self.resume.take() {
            self.work = Ok(None);
            let resumed = ActiveRender::resume(&own, &self.options, self.settings, *checkpoint);
            self.work = resumed.map(Some);
            if Arc::ptr_eq(&own, scene) && !restart {
                return;
            }
        }
        if !restart
            && let Ok(Some(work)) = &mut self.work
            && work.try_reuse(scene)
        {
            return;
        }
        if !restart && let Some(work) = self.work.as_mut().ok().and_then(Option::take) {
            match work.turn(scene, &self.options) {
                Ok(turned) => return self.work = Ok(Some(turned)),
                Err(work) => self.work = Ok(Some(*work)),
            }
        }
        #[cfg(test)]
        self.context.shared.compilations.fetch_add(1, Ordering::SeqCst);
        let previous = std::mem::replace(&mut self.work, Ok(None)).ok().flatten();
        self.work = ActiveRender::start(scene, &self.options, self.settings, previous).map(Some);
    }

    /// Changes to double precision if the first error probe asks for it.
    fn avoid_rounding(&mut self) {
        if self.work().is_some_and(|work| work.schedule.excessive_rounding().is_some()) {
            let work = std::mem::replace(&mut self.work, Ok(None)).ok().flatten();
            self.work = work.map(|work| work.avoid_rounding(&self.options)).transpose();
        }
    }

    /// Runs the waiting tasks, unless the render has no picture yet.
    fn run_tasks(&mut self) {
        if self.work().is_some_and(|work| work.first_picture_after.is_none()) || self.pending {
            return;
        }
        let tasks = std::mem::take(&mut self.tasks);
        if tasks.is_empty() {
            return;
        }
        let work = self.work.as_ref().ok().and_then(Option::as_ref);
        let film = work.map(|work| (work, work.report(&self.context, self.state.clone())));
        let pool = &self.context.pool;
        for task in tasks {
            let picture = film.as_ref().map(|(work, report)| Picture {
                film: &work.state.film,
                weights: &work.state.weights,
                report,
                source: Source::Render(work, pool),
            });
            // The encoders of picture files use the threads of the pool in which they run.
            pool.install(|| task(picture));
        }
    }

    /// Does the next piece of rendering work: estimates the noise again if it is out of date,
    /// traces a piece of a wave, and publishes a snapshot.
    fn advance(&mut self) {
        let context = &self.context;
        self.idle = true;
        let work = match &mut self.work {
            Ok(Some(work)) => work,
            Ok(None) => return,
            Err(reason) => {
                self.state = State::Failed(reason.clone());
                let report = Report {
                    generation: context.generation,
                    state: self.state.clone(),
                    threads: context.pool.current_num_threads(),
                    ..Report::default()
                };
                context.put(Snapshot { report, ..Snapshot::default() });
                return;
            }
        };
        work.set_region(context.view.region);
        // The first picture of a scene is traced even during a pause.
        let paused = self.paused && work.first_picture_after.is_some();
        if work.estimates_stale {
            // The picture is published at once, before its noise is estimated.
            self.state = if paused { State::Paused } else { State::Tracing };
            work.publish(context, self.state.clone(), true);
            if !work.reestimate(&context.pool, &context.shared.cancel_wave) {
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
                    work.trace(wave, context);
                    self.idle = false;
                    State::Tracing
                }
            }
        };
        work.publish(context, self.state.clone(), self.idle);
    }
}
