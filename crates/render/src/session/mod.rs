//! Background rendering: a thread that receives scenes, traces them and publishes snapshots.
//!
//! A client first sends a command and then raises the cancel flag of the running wave, a set of
//! jobs that are traced concurrently. The worker (the rendering thread) first lowers the flag and
//! then receives all commands. If the client or the worker reversed its two steps, the worker could
//! lower the flag without receiving the command, which would then wait until the wave ends. If
//! several scenes are waiting, only the newest is compiled. A cancelled wave loses no samples: its
//! remaining jobs are traced when the render resumes.
//!
//! A scene that differs from the active one only in light weights (see [`Relighting`]) keeps the
//! film, its samples and the schedule; only the noise is estimated again. Long waves are traced in
//! pieces, so that clients see the picture improve. The pieces have no influence on the samples.
//!
//! No call blocks, except [`Session::with`] and [`Session::wait`].
//!
//! [`Relighting`]: crate::Relighting

mod active_render;
mod report;
mod snapshot;
#[cfg(test)]
mod tests;
mod throughput;
mod watch;
mod worker;

use crate::export::Provenance;
use crate::film::Display;
use crate::schedule::{Settings, Stop};
use crate::{Checkpoint, EncodedCheckpoint, Options, RenderState, threads};
use active_render::WorkContext;
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded, unbounded};
pub use report::{QUALITIES, Report, State};
use snapshot::Slot;
pub use snapshot::{Snapshot, TileMaps, View};
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
pub use watch::{WatchReport, WatchSession, WatchedShards, WatchedState};
use worker::Worker;
use zerkalo_scene::Scene;

/// Function that a client queues to run on the rendering thread. It gets the state and the report
/// of the render; `None` if there is no film.
type Task = Box<dyn FnOnce(Option<(&RenderState, &Report)>) + Send>;

/// Function that gets an encoded checkpoint, or `None` if there is no picture yet.
type CheckpointTask = Box<dyn FnOnce(Option<EncodedCheckpoint>) + Send>;

enum Command {
    Scene(u64, Arc<Scene>),
    Resume(u64, Arc<Scene>, Box<Checkpoint>),
    Restart(u64),
    Pause(bool),
    View(View),
    Stop(Stop),
    Display(Display),
    Pool(rayon::ThreadPool),
    Task(Task),
    Checkpoint(Provenance, CheckpointTask),
    Quit,
}

/// State that the session's handle and its rendering thread share in addition to the command
/// channel.
#[derive(Default)]
struct Shared {
    /// Flag that cancels the wave being traced (a set of concurrent jobs), because commands are
    /// waiting.
    cancel_wave: AtomicBool,
    /// Flag that cancels the first pass over the picture, because a newer scene is waiting.
    cancel_first_pass: AtomicBool,
    slot: Slot,
    /// Number of scenes compiled so far. Tests read it to see which scenes were skipped.
    #[cfg(test)]
    compilations: std::sync::atomic::AtomicUsize,
}

/// Handle of a rendering thread with its own thread pool. Dropping the session ends the thread.
pub struct Session {
    commands: Sender<Command>,
    shared: Arc<Shared>,
    wakeup: Receiver<()>,
    generations: u64,
    thread: Option<JoinHandle<()>>,
}

impl Session {
    /// Starts a rendering thread that traces with a pool of `threads` threads (0: one per
    /// processor).
    ///
    /// # Errors
    /// Returns an error for the user if a thread cannot be started.
    pub fn new(threads: usize, options: Options, settings: Settings) -> io::Result<Self> {
        let pool = threads::pool(threads, 0)?;
        let (commands, inbox) = unbounded();
        // The channel holds one wake-up; a full channel means that one is pending.
        let (notify, wakeup) = bounded(1);
        let shared = Arc::new(Shared::default());
        let view = View::default();
        let context =
            WorkContext { pool, shared: Arc::clone(&shared), notify, view, generation: 0 };
        let worker = Worker::new(inbox, context, options, settings);
        let thread = std::thread::Builder::new().name("session".into()).spawn(|| worker.run());
        let thread = thread.map_err(|error| threads::error_of(threads, error))?;
        Ok(Self { commands, shared, wakeup, generations: 0, thread: Some(thread) })
    }

    /// Renders `scene` from now on. Returns the generation of the scene, a number that its reports
    /// contain; later scenes have larger generations. Samples are kept if they are valid for the
    /// new scene (see [`Relighting::mix`]).
    ///
    /// [`Relighting::mix`]: crate::Relighting::mix
    pub fn set_scene(&mut self, scene: Arc<Scene>) -> u64 {
        self.begin(|generation| Command::Scene(generation, scene))
    }

    /// Continues the render of `checkpoint`, whose samples are shown as a picture of `scene`.
    /// Returns the generation of the scene as [`Session::set_scene`] does. If the checkpoint cannot
    /// be used for this scene, reports have the state [`State::Failed`].
    pub fn continue_from(&mut self, scene: Arc<Scene>, checkpoint: Checkpoint) -> u64 {
        self.begin(|generation| Command::Resume(generation, scene, Box::new(checkpoint)))
    }

    /// Queues the encoding of the render as a checkpoint. The rendering thread encodes it between
    /// two pieces of tracing work, and then calls `task` with it. The argument of `task` is `None`
    /// if there is no picture yet.
    pub fn checkpoint(
        &self,
        provenance: Provenance,
        task: impl FnOnce(Option<EncodedCheckpoint>) + Send + 'static,
    ) {
        self.send(Command::Checkpoint(provenance, Box::new(task)));
    }

    /// Compiles the newest scene again and starts with an empty film. Returns a new generation
    /// (number of a version of the scene), as [`Session::set_scene`] does.
    pub fn restart(&mut self) -> u64 {
        self.begin(Command::Restart)
    }

    /// Sets the stop criteria of the render. A finished render resumes if the new criteria are not
    /// reached yet.
    pub fn set_stop(&self, stop: Stop) {
        self.send(Command::Stop(stop));
    }

    /// Sets the display transform for the noise estimate, which is the RMSE of the displayed
    /// picture. Samples are kept.
    pub fn set_display(&self, display: Display) {
        self.send(Command::Display(display));
    }

    /// Sets the number of tracing threads (0: one per processor) and their priority. `niceness` 0
    /// is the priority of the calling thread; 1 to 19 are lower priorities (on Linux).
    ///
    /// # Errors
    /// Returns the operating system's error if a thread cannot be started. The old threads are then
    /// kept.
    pub fn set_threads(&self, threads: usize, niceness: i32) -> io::Result<()> {
        self.send(Command::Pool(threads::pool(threads, niceness)?));
        Ok(())
    }

    /// Pauses the render until [`Session::resume`].
    pub fn pause(&self) {
        self.send(Command::Pause(true));
    }

    /// Resumes the render after a pause.
    pub fn resume(&self) {
        self.send(Command::Pause(false));
    }

    /// Sets the contents of snapshots. Initially they contain neither picture nor pixel probe.
    pub fn set_view(&self, view: View) {
        self.send(Command::View(view));
    }

    /// Queues `task` and returns at once. The rendering thread runs the task between two pieces of
    /// tracing work. The argument of the task is the state and the report of the render. It is
    /// `None` if there is no film: no scene has been set yet, or the scene cannot be rendered.
    /// Tasks that are still queued when the session ends are dropped.
    pub fn submit(&self, task: impl FnOnce(Option<(&RenderState, &Report)>) + Send + 'static) {
        self.send(Command::Task(Box::new(task)));
    }

    /// Runs `task` as [`Session::submit`] does and waits for its result. Returns `None` if there is
    /// no film.
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

    /// Returns the channel that receives a message whenever a new snapshot is published.
    pub fn wakeup(&self) -> &Receiver<()> {
        &self.wakeup
    }

    /// Waits at most `limit` for a snapshot that has not been taken yet. Returns `None` if there is
    /// none after this time.
    ///
    /// # Panics
    /// Panics if the rendering thread has panicked.
    pub fn wait(&self, limit: Duration) -> Option<Snapshot> {
        let deadline = Instant::now() + limit;
        loop {
            match self.wakeup.recv_deadline(deadline) {
                // After the message of one snapshot is received, a second snapshot may replace the
                // first one before `take`. The message of the second snapshot then finds no
                // snapshot.
                Ok(()) => match self.take() {
                    Some(snapshot) => return Some(snapshot),
                    None => continue,
                },
                Err(RecvTimeoutError::Timeout) => return None,
                Err(RecvTimeoutError::Disconnected) => panic!("the rendering thread has ended"),
            }
        }
    }

    /// Takes the latest snapshot. Returns `None` if it has been taken already, or if there is none
    /// yet.
    pub fn take(&self) -> Option<Snapshot> {
        self.shared.slot.take()
    }

    /// Sends a command to the rendering thread and cancels the first pass over the picture.
    /// `command` creates the command from a new generation (number of a version of the scene).
    /// Returns the generation.
    fn begin(&mut self, command: impl FnOnce(u64) -> Command) -> u64 {
        self.generations += 1;
        self.send(command(self.generations));
        self.shared.cancel_first_pass.store(true, Ordering::Release);
        self.generations
    }

    fn send(&self, command: Command) {
        // Sending fails only after the worker has ended: by `Quit`, or by a panic, which `drop`
        // propagates.
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
