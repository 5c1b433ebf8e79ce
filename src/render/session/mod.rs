//! A thread that renders: guests send it scenes, it fills films and says how far it is.
//!
//! Commands are sent first, then the mark that interrupts the running wave is raised; the worker
//! lowers the mark first, then takes in all commands. In the other order a command could slip in
//! between and wait for a wave that nothing interrupts. Of several scenes only the newest is compiled.
//! An interrupted wave loses nothing: what was not traced is traced when the work goes on.

mod report;
#[cfg(test)]
mod tests;
mod worker;

use crate::film::Film;
use crate::render::schedule::{Schedule, Settings};
use crate::render::wave::{Wave, WaveReport};
use crate::scene::Scene;
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded, unbounded};
use report::Slot;
pub use report::{Report, Snapshot, State};
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::Duration;
use worker::Worker;

/// A scene that is being traced: what a session drives.
pub trait Traced: Sized + Send + 'static {
    /// How scenes are compiled and sampled.
    type Options: Send + 'static;

    /// Compiles `scene` and starts it with an empty film; may reuse what `before` has allocated.
    /// `Err`: why it cannot be rendered.
    fn begin(scene: &Scene, options: &Self::Options, before: Option<Self>) -> Result<Self, String>;

    /// Empties the film.
    fn restart(&mut self);

    /// Traces the wave that holds the first sample of every pixel, coarse to fine, and calls `shown`
    /// whenever the picture has become finer. Once `abandon` is raised the work ends, but not before
    /// `shown` has been called once; then the answer is `None`, and the film is only to be looked at.
    fn first(
        &mut self,
        wave: &Wave,
        pool: &rayon::ThreadPool,
        abandon: &AtomicBool,
        shown: &mut dyn FnMut(&Film),
    ) -> Option<WaveReport>;

    /// Traces a wave. Once raised, `interrupt` keeps further jobs from being begun.
    fn run(&mut self, wave: &Wave, pool: &rayon::ThreadPool, interrupt: &AtomicBool) -> WaveReport;

    /// The film.
    fn film(&self) -> &Film;

    /// A schedule for this film that follows `settings`.
    fn schedule(&self, settings: Settings) -> Schedule;
}

type Task<T> = Box<dyn FnOnce(&T, &Report) + Send>;

enum Command<T> {
    Scene(u64, Arc<Scene>),
    Pause(bool),
    View(Option<[usize; 2]>),
    Task(Task<T>),
    Quit,
}

/// What guests and worker share beside the channel.
#[derive(Default)]
struct Shared {
    /// The running wave should end: there are commands.
    interrupt: AtomicBool,
    /// The first picture should end too: there is a newer scene.
    abandon: AtomicBool,
    slot: Slot,
}

/// A rendering thread with its own pool of workers. Dropping it ends the work.
pub struct Session<T: Traced> {
    commands: Sender<Command<T>>,
    shared: Arc<Shared>,
    bell: Receiver<()>,
    generations: u64,
    thread: Option<JoinHandle<()>>,
}

impl<T: Traced> Session<T> {
    /// Starts a session that traces with `threads` threads. `Err`: no threads are to be had.
    pub fn new(threads: usize, options: T::Options, settings: Settings) -> io::Result<Self> {
        let pool = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|i| format!("tracer {i}"))
            .build()
            .map_err(io::Error::other)?;
        let (commands, inbox) = unbounded();
        // One place: a bell that has not been heard yet need not ring twice.
        let (ring, bell) = bounded(1);
        let shared = Arc::new(Shared::default());
        let worker = Worker::new(inbox, ring, Arc::clone(&shared), pool, options, settings);
        let thread = std::thread::Builder::new().name("session".into()).spawn(|| worker.run())?;
        Ok(Self { commands, shared, bell, generations: 0, thread: Some(thread) })
    }

    /// Renders `scene` from now on, whatever was rendered before. The number returned comes back in
    /// the reports about it; later scenes have larger numbers.
    pub fn set_scene(&mut self, scene: Arc<Scene>) -> u64 {
        self.generations += 1;
        self.send(Command::Scene(self.generations, scene));
        self.shared.abandon.store(true, Ordering::Release);
        self.generations
    }

    /// Stops tracing until [`Session::go_on`].
    pub fn pause(&self) {
        self.send(Command::Pause(true));
    }

    /// Goes on after a pause.
    pub fn go_on(&self) {
        self.send(Command::Pause(false));
    }

    /// Asks for snapshots with a picture of this many columns and rows of cells, or without one.
    pub fn set_view(&self, cells: Option<[usize; 2]>) {
        self.send(Command::View(cells));
    }

    /// Runs `task` where the film lives, between two waves, and waits for its result. `None`: there
    /// is no film, because there is no scene, or only one that cannot be rendered.
    pub fn with<R: Send + 'static>(
        &self,
        task: impl FnOnce(&T, &Report) -> R + Send + 'static,
    ) -> Option<R> {
        let (answer, result) = bounded(1);
        self.send(Command::Task(Box::new(move |traced, report| {
            // Nobody waits if the guest has gone.
            let _ = answer.send(task(traced, report));
        })));
        result.recv().ok()
    }

    /// Rings (receives a message) whenever there is a new snapshot to take.
    pub fn bell(&self) -> &Receiver<()> {
        &self.bell
    }

    /// Waits for the bell, at most for `limit`, and takes the snapshot.
    ///
    /// # Panics
    /// If the rendering thread has panicked.
    pub fn wait(&self, limit: Duration) -> Option<Snapshot> {
        match self.bell.recv_timeout(limit) {
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
        self.shared.interrupt.store(true, Ordering::Release);
    }
}

impl<T: Traced> Drop for Session<T> {
    fn drop(&mut self) {
        self.send(Command::Quit);
        self.shared.abandon.store(true, Ordering::Release);
        if let Some(Err(panic)) = self.thread.take().map(JoinHandle::join)
            && !std::thread::panicking()
        {
            std::panic::resume_unwind(panic);
        }
    }
}
