//! A thread that renders: guests send it scenes, it fills films and says how far it is.
//!
//! Commands are sent first, then the mark that interrupts the running wave is raised; the worker
//! lowers the mark first, then takes in all commands. In the other order a command could slip in
//! between and wait for a wave that nothing interrupts. Of several scenes only the newest is compiled.
//! An interrupted wave loses nothing: what was not traced is traced when the work goes on.

//!
//! A scene that differs from the one in work only in what a [`Relighting`] can mix keeps the film, its
//! samples and the schedule; only the noise is judged anew. Long waves are traced in pieces, so that
//! guests see the film grow; what is traced does not depend on where they were cut.
//!
//! Who calls a session is never kept waiting, except by [`Session::with`] and [`Session::wait`].

mod active_render;
mod report;
mod snapshot;
#[cfg(test)]
mod tests;
mod threads;
mod throughput;
mod worker;

use crate::film::{Display, Estimator, Film, LightWeights};
use crate::render::relighting::Relighting;
use crate::render::schedule::{Schedule, Settings, Stop};
use crate::render::wave::{Wave, WaveReport};
use crate::scene::Scene;
use crate::world::FirstHit;
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded, unbounded};
pub use report::{QUALITIES, Report, State};
use snapshot::Slot;
pub use snapshot::{Snapshot, TileMaps, View};
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;
use worker::Worker;

/// A scene that is being traced: what a session drives.
pub trait RenderBackend: Sized + Send + Sync + 'static {
    /// How scenes are compiled and sampled.
    type Options: Send + 'static;

    /// Compiles `scene` and starts it with an empty film; may reuse what `before` has allocated.
    /// `Err`: why it cannot be rendered.
    fn begin(
        scene: &Arc<Scene>,
        options: &Self::Options,
        before: Option<Self>,
    ) -> Result<Self, String>;

    /// Takes `scene` over if the samples at hand are samples of it, too; else changes nothing and
    /// returns false.
    fn try_reuse(&mut self, scene: &Arc<Scene>) -> bool;

    /// The display in the options.
    fn display_of(options: &mut Self::Options) -> &mut Display;

    /// Judges the noise as seen on `display` from now on.
    fn set_display(&mut self, display: Display);

    /// Empties the film.
    fn restart(&mut self);

    /// Traces the wave that holds the first sample of every pixel, coarse to fine, and calls `shown`
    /// whenever the picture has become finer. Once `cancel_first_pass` is raised the work ends, but not before
    /// `shown` has been called once; then the answer is `None`, and the film is only to be looked at.
    fn first(
        &mut self,
        wave: &Wave,
        pool: &rayon::ThreadPool,
        cancel_first_pass: &AtomicBool,
        shown: &mut dyn FnMut(&Film),
    ) -> Option<WaveReport>;

    /// Traces a wave. Once raised, `cancel_wave` keeps further jobs from being begun.
    fn run(
        &mut self,
        wave: &Wave,
        pool: &rayon::ThreadPool,
        cancel_wave: &AtomicBool,
    ) -> WaveReport;

    /// The film.
    fn film(&self) -> &Film;

    /// The mix of lights that the scene has.
    fn mix(&self) -> &LightWeights;

    /// The display on which the noise is judged.
    fn display(&self) -> Display;

    /// Estimates errors under this mix and display.
    fn estimator(&self) -> &Estimator;

    /// Which scenes the samples serve.
    fn lighting(&self) -> &Arc<Relighting>;

    /// What the camera sees through `points` of the film, in pixels; `seen` is as long.
    fn look(&self, points: &[[f64; 2]], seen: &mut [FirstHit]);

    /// Name of the lane type.
    fn lanes(&self) -> &'static str;

    /// What the compiled scene contains, in one line.
    fn inventory(&self) -> String;

    /// A schedule for this film that follows `settings`.
    fn schedule(&self, settings: Settings) -> Schedule;
}

type Task<T> = Box<dyn FnOnce(Option<(&T, &Report)>) + Send>;

enum Command<T> {
    Scene(u64, Arc<Scene>),
    Restart(u64),
    Pause(bool),
    View(View),
    Stop(Stop),
    Display(Display),
    Pool(rayon::ThreadPool),
    Task(Task<T>),
    Quit,
}

/// What guests and worker share beside the channel.
#[derive(Default)]
struct Shared {
    /// The running wave should end: there are commands.
    cancel_wave: AtomicBool,
    /// The first picture should end too: there is a newer scene.
    cancel_first_pass: AtomicBool,
    slot: Slot,
}

/// A rendering thread with its own pool of workers. Dropping it ends the work.
pub struct Session<T: RenderBackend> {
    commands: Sender<Command<T>>,
    shared: Arc<Shared>,
    wakeup: Receiver<()>,
    generations: u64,
    thread: Option<JoinHandle<()>>,
}

impl<T: RenderBackend> Session<T> {
    /// Starts a session that traces with `threads` threads. `Err`: no threads are to be had.
    pub fn new(threads: usize, options: T::Options, settings: Settings) -> io::Result<Self> {
        let pool = threads::pool(threads, 0)?;
        let (commands, inbox) = unbounded();
        // One place: a bell that has not been heard yet need not ring twice.
        let (notify, wakeup) = bounded(1);
        let shared = Arc::new(Shared::default());
        let worker = Worker::new(inbox, notify, Arc::clone(&shared), pool, options, settings);
        let thread = std::thread::Builder::new().name("session".into()).spawn(|| worker.run())?;
        Ok(Self { commands, shared, wakeup, generations: 0, thread: Some(thread) })
    }

    /// Renders `scene` from now on, whatever was rendered before. The number returned comes back in
    /// the reports about it; later scenes have larger numbers. Samples that serve the new scene, too,
    /// are kept (see [`Relighting::mix`]).
    pub fn set_scene(&mut self, scene: Arc<Scene>) -> u64 {
        self.generations += 1;
        self.send(Command::Scene(self.generations, scene));
        self.shared.cancel_first_pass.store(true, Ordering::Release);
        self.generations
    }

    /// Compiles the newest scene again and begins with an empty film. The number returned is as that
    /// of [`Session::set_scene`].
    pub fn restart(&mut self) -> u64 {
        self.generations += 1;
        self.send(Command::Restart(self.generations));
        self.shared.cancel_first_pass.store(true, Ordering::Release);
        self.generations
    }

    /// When to stop from now on. A session that rests goes on if that is not reached yet.
    pub fn set_stop(&self, stop: Stop) {
        self.send(Command::Stop(stop));
    }

    /// Judges the noise as seen on `display` from now on. Samples are kept.
    pub fn set_display(&self, display: Display) {
        self.send(Command::Display(display));
    }

    /// Traces with `threads` threads (0: one per processor) from now on. With a `niceness` of 1 to 19
    /// they run at a lower priority, on Linux; 0: at that of the calling thread. `Err`: no threads are
    /// to be had, the old ones stay.
    pub fn set_threads(&self, threads: usize, niceness: i32) -> io::Result<()> {
        self.send(Command::Pool(threads::pool(threads, niceness)?));
        Ok(())
    }

    /// Stops tracing until [`Session::resume`].
    pub fn pause(&self) {
        self.send(Command::Pause(true));
    }

    /// Goes on after a pause.
    pub fn resume(&self) {
        self.send(Command::Pause(false));
    }

    /// What snapshots contain from now on; at first neither picture nor probe.
    pub fn set_view(&self, view: View) {
        self.send(Command::View(view));
    }

    /// Has `task` run where the film lives, between two pieces of work, and returns at once. It gets
    /// `None` if there is no film, because there is no scene, or only one that cannot be rendered.
    /// It is dropped without being run only if the session ends before.
    pub fn submit(&self, task: impl FnOnce(Option<(&T, &Report)>) + Send + 'static) {
        self.send(Command::Task(Box::new(task)));
    }

    /// Runs `task` as [`Session::submit`] does, but waits for its result. `None`: there is no film.
    pub fn with<R: Send + 'static>(
        &self,
        task: impl FnOnce(&T, &Report) -> R + Send + 'static,
    ) -> Option<R> {
        let (answer, result) = bounded(1);
        self.submit(move |film| {
            if let Some((traced, report)) = film {
                // Nobody waits if the guest has gone.
                let _ = answer.send(task(traced, report));
            }
        });
        result.recv().ok()
    }

    /// Rings (receives a message) whenever there is a new snapshot to take.
    pub fn wakeup(&self) -> &Receiver<()> {
        &self.wakeup
    }

    /// Waits for the bell, at most for `limit`, and takes the snapshot.
    ///
    /// # Panics
    /// If the rendering thread has panicked.
    pub fn wait(&self, limit: Duration) -> Option<Snapshot> {
        match self.wakeup.recv_timeout(limit) {
            Ok(()) => self.take(),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => panic!("the rendering thread has ended"),
        }
    }

    /// The latest snapshot, if it has not been taken yet.
    pub fn take(&self) -> Option<Snapshot> {
        self.shared.slot.take()
    }

    /// Sends first, then raises the mark.
    fn send(&self, command: Command<T>) {
        // The worker ends only when it is told to, or by a panic that `drop` passes on.
        let _ = self.commands.send(command);
        self.shared.cancel_wave.store(true, Ordering::Release);
    }
}

impl<T: RenderBackend> Drop for Session<T> {
    fn drop(&mut self) {
        self.send(Command::Quit);
        self.shared.cancel_first_pass.store(true, Ordering::Release);
        if let Some(Err(panic)) = self.thread.take().map(JoinHandle::join)
            && !std::thread::panicking()
        {
            std::panic::resume_unwind(panic);
        }
    }
}
