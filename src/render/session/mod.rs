//! Background rendering: a thread that receives scenes, fills films and publishes snapshots.
//!
//! A client sends the command first and raises the cancel flag of the running wave afterwards; the
//! worker lowers the flag first and takes in all commands afterwards. In the other order a command
//! could slip in between and wait for a wave that nothing cancels. Of several scenes only the newest
//! is compiled. A cancelled wave loses nothing: its remaining jobs run when the work resumes.
//!
//! A scene that differs from the active one only in light weights ([`Relighting`]) keeps the film,
//! its samples and the schedule; only the noise is estimated again. Long waves are traced in pieces,
//! so that clients see the film grow. The samples do not depend on the cuts.
//!
//! No call blocks, except [`Session::with`] and [`Session::wait`].
//!
//! [`Relighting`]: crate::render::Relighting

mod active_render;
mod report;
mod snapshot;
#[cfg(test)]
mod tests;
mod threads;
mod throughput;
mod worker;

use crate::film::Display;
use crate::render::schedule::{Settings, Stop};
use crate::render::{Options, RenderState};
use crate::scene::Scene;
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

/// Work on the film; its argument is `None` without a film.
type Task = Box<dyn FnOnce(Option<(&RenderState, &Report)>) + Send>;

enum Command {
    Scene(u64, Arc<Scene>),
    Restart(u64),
    Pause(bool),
    View(View),
    Stop(Stop),
    Display(Display),
    Pool(rayon::ThreadPool),
    Task(Task),
    Quit,
}

/// State that session and worker share besides the channel.
#[derive(Default)]
struct Shared {
    /// Ends the running wave, because there are commands.
    cancel_wave: AtomicBool,
    /// Ends the first pass, because there is a newer scene.
    cancel_first_pass: AtomicBool,
    slot: Slot,
    /// Number of compilations: skipped scenes leave no other trace outside the worker.
    #[cfg(test)]
    compilations: std::sync::atomic::AtomicUsize,
}

/// Rendering thread with its own thread pool. Dropping it ends the work.
pub struct Session {
    commands: Sender<Command>,
    shared: Arc<Shared>,
    wakeup: Receiver<()>,
    generations: u64,
    thread: Option<JoinHandle<()>>,
}

impl Session {
    /// Starts a session that traces with `threads` threads.
    ///
    /// # Errors
    /// Returns the error of the system that refuses to start a thread.
    pub fn new(threads: usize, options: Options, settings: Settings) -> io::Result<Self> {
        let pool = threads::pool(threads, 0)?;
        let (commands, inbox) = unbounded();
        // The channel holds one wake-up; a full channel means that one is pending.
        let (notify, wakeup) = bounded(1);
        let shared = Arc::new(Shared::default());
        let worker = Worker::new(inbox, notify, Arc::clone(&shared), pool, options, settings);
        let thread = std::thread::Builder::new().name("session".into()).spawn(|| worker.run())?;
        Ok(Self { commands, shared, wakeup, generations: 0, thread: Some(thread) })
    }

    /// Renders `scene` from now on. Returns its generation, which its reports quote; later scenes
    /// have larger generations. Samples that serve the new scene as well are kept (see
    /// [`Relighting::mix`]).
    ///
    /// [`Relighting::mix`]: crate::render::Relighting::mix
    pub fn set_scene(&mut self, scene: Arc<Scene>) -> u64 {
        self.generations += 1;
        self.send(Command::Scene(self.generations, scene));
        self.shared.cancel_first_pass.store(true, Ordering::Release);
        self.generations
    }

    /// Compiles the newest scene again and starts with an empty film. Returns the new generation, as
    /// [`Session::set_scene`] does.
    pub fn restart(&mut self) -> u64 {
        self.generations += 1;
        self.send(Command::Restart(self.generations));
        self.shared.cancel_first_pass.store(true, Ordering::Release);
        self.generations
    }

    /// Sets the stop criteria. A finished session resumes if they are not reached yet.
    pub fn set_stop(&self, stop: Stop) {
        self.send(Command::Stop(stop));
    }

    /// Estimates the noise for `display` from now on. Samples are kept.
    pub fn set_display(&self, display: Display) {
        self.send(Command::Display(display));
    }

    /// Traces with `threads` threads (0: one per processor) from now on. `niceness` is 0 for the
    /// priority of the calling thread, or 1 to 19 for a lower one (on Linux).
    ///
    /// # Errors
    /// Returns the error of the system that refuses to start a thread; the old threads stay.
    pub fn set_threads(&self, threads: usize, niceness: i32) -> io::Result<()> {
        self.send(Command::Pool(threads::pool(threads, niceness)?));
        Ok(())
    }

    /// Pauses tracing until [`Session::resume`].
    pub fn pause(&self) {
        self.send(Command::Pause(true));
    }

    /// Resumes tracing after a pause.
    pub fn resume(&self) {
        self.send(Command::Pause(false));
    }

    /// Sets the contents of snapshots; initially neither picture nor probe.
    pub fn set_view(&self, view: View) {
        self.send(Command::View(view));
    }

    /// Queues `task` to run on the rendering thread between two pieces of work, and returns at once.
    /// Its argument is `None` if there is no film: no scene yet, or one that cannot be rendered. A
    /// task that has not run when the session ends is dropped.
    pub fn submit(&self, task: impl FnOnce(Option<(&RenderState, &Report)>) + Send + 'static) {
        self.send(Command::Task(Box::new(task)));
    }

    /// Runs `task` as [`Session::submit`] does and waits for its result; `None` without a film.
    pub fn with<R: Send + 'static>(
        &self,
        task: impl FnOnce(&RenderState, &Report) -> R + Send + 'static,
    ) -> Option<R> {
        let (sender, receiver) = bounded(1);
        self.submit(move |film| {
            if let Some((state, report)) = film {
                // A closed channel means that the client has stopped waiting.
                let _ = sender.send(task(state, report));
            }
        });
        receiver.recv().ok()
    }

    /// Channel that receives a message whenever there is a new snapshot.
    pub fn wakeup(&self) -> &Receiver<()> {
        &self.wakeup
    }

    /// Waits for the next wake-up, for at most `limit`, and takes the snapshot.
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

    /// Takes the latest snapshot; `None` if it has been taken already.
    pub fn take(&self) -> Option<Snapshot> {
        self.shared.slot.take()
    }

    /// Sends the command first, then raises the flag: see the module's description.
    fn send(&self, command: Command) {
        // The worker ends only on `Quit`, or by a panic that `drop` passes on.
        let _ = self.commands.send(command);
        self.shared.cancel_wave.store(true, Ordering::Release);
    }
}

impl Drop for Session {
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
