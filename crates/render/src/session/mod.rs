//! Sessions: a thread of its own traces scenes, or reads film files that other processes write, and
//! publishes snapshots.
//!
//! A client first sends a command and then raises the cancel flag of the running wave. The
//! session's thread first lowers the flag and then receives all commands. In the reverse order, it
//! could lower the flag without receiving the command, which would then wait until the wave ends.
//! If several scenes are waiting, only the newest is compiled. A cancelled wave loses no samples:
//! its remaining jobs are traced when the render resumes.
//!
//! A scene that differs from the active scene only in light weights (see [`Relighting`]) keeps the
//! film, its samples and the schedule; only the noise is estimated again. Long waves are traced in
//! pieces, so that clients see the picture improve. The pieces have no influence on the samples.
//!
//! No call blocks, except [`Session::with`], [`Session::wait`] and, for a moment, the drop of a
//! session that renders.
//!
//! [`Relighting`]: crate::Relighting

mod active_render;
mod picture;
mod report;
mod snapshot;
#[cfg(test)]
mod tests;
mod watch;
mod worker;

use crate::film::Display;
use crate::plan::FilmFiles;
pub use crate::plan::{WatchedShards, WatchedState};
use crate::schedule::{Settings, Stop};
use crate::{Checkpoint, Options, RenderState, threads};
use active_render::WorkContext;
use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded, unbounded};
pub use picture::Picture;
pub use report::{QUALITIES, Report, State};
pub use snapshot::{DETAIL_GROWTH, Snapshot, TileMaps, View};
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};
pub use watch::WatchReport;
use watch::Watcher;
use worker::Worker;
use zerkalo_scene::Scene;

/// Function that a client queues to run on the session's thread. The argument is the picture, or
/// `None` if there is no film.
type Task = Box<dyn FnOnce(Option<Picture>) + Send>;

/// Command to the session's thread. The numbers are generations of scenes.
enum Command {
    Scene(u64, Arc<Scene>),
    Resume(u64, Arc<Scene>, Box<Checkpoint>),
    Restart(u64),
    Pause(bool),
    View(View),
    Stop(Stop),
    Display(Display),
    Task(Task),
    Quit,
}

/// State that the handle and the thread share in addition to the command channel.
#[derive(Default)]
struct Shared {
    /// Request to cancel the running wave, because commands are waiting.
    cancel_wave: AtomicBool,
    /// Request to cancel the first pass, because a newer scene is waiting.
    cancel_first_pass: AtomicBool,
    /// Number of scenes compiled so far.
    #[cfg(test)]
    compilations: std::sync::atomic::AtomicUsize,
}

/// Time for which the end of a session waits for its thread, which may be compiling a large scene.
const END_PATIENCE: Duration = Duration::from_millis(200);

/// Handle of a thread that renders scenes or watches film files, with a thread pool of its own.
/// Dropping the handle ends the thread. A session that watches has no scene: it ignores commands
/// that edit, pause or stop a render.
pub struct Session {
    commands: Sender<Command>,
    shared: Arc<Shared>,
    /// Channel of the latest snapshot that has not been taken yet.
    pub snapshots: Receiver<Snapshot>,
    generations: u64,
    /// Rendering thread, which is joined when the handle is dropped, if it ends soon. `None` for a
    /// thread that watches: it may be reading from a slow disk.
    thread: Option<JoinHandle<()>>,
}

impl Session {
    /// Starts a thread that traces with a pool of `threads` threads (0: one per processor). Returns
    /// an error for the user if a thread cannot be started.
    pub fn new(threads: usize, options: Options, settings: Settings) -> io::Result<Self> {
        Self::start(threads, |inbox, context| {
            move || Worker::new(inbox, context, options, settings).run()
        })
    }

    /// Starts a thread that shows the sum of `films`. It calls `on_report` each time it has
    /// checked their files. Returns an error for the user if a thread cannot be started.
    pub fn watch(
        films: FilmFiles,
        threads: usize,
        on_report: impl Fn(WatchReport) + Send + 'static,
    ) -> io::Result<Self> {
        let mut session = Self::start(threads, |inbox, context| {
            move || Watcher::new(films, context).run(&inbox, &on_report)
        })?;
        session.thread = None;
        Ok(session)
    }

    /// Starts a thread that executes the function that `run` returns.
    fn start<F: FnOnce() + Send + 'static>(
        threads: usize,
        run: impl FnOnce(Receiver<Command>, WorkContext) -> F,
    ) -> io::Result<Self> {
        let pool = threads::pool(threads)?;
        let (commands, inbox) = unbounded();
        let (publisher, snapshots) = bounded(1);
        let shared = Arc::new(Shared::default());
        let context = WorkContext {
            pool,
            shared: Arc::clone(&shared),
            publisher,
            published: snapshots.clone(),
            view: View::default(),
            generation: 0,
        };
        let thread = std::thread::Builder::new().name("session".into());
        let thread = thread.spawn(run(inbox, context));
        let thread = thread.map_err(|error| threads::error_of(threads, error))?;
        Ok(Self { commands, shared, snapshots, generations: 0, thread: Some(thread) })
    }

    /// Renders `scene` from now on, with the present samples if they are valid for it (see
    /// [`Relighting::weights`]). Returns the generation of the scene, which its reports contain.
    ///
    /// [`Relighting::weights`]: crate::Relighting::weights
    pub fn set_scene(&mut self, scene: Arc<Scene>) -> u64 {
        self.begin(|generation| Command::Scene(generation, scene))
    }

    /// Continues the render of `checkpoint` as a picture of `scene`, and returns the generation of
    /// `scene`. If this is not possible, reports have the state [`State::Failed`].
    pub fn continue_from(&mut self, scene: Arc<Scene>, checkpoint: Checkpoint) -> u64 {
        self.begin(|generation| Command::Resume(generation, scene, Box::new(checkpoint)))
    }

    /// Compiles the newest scene again and starts with an empty film. Returns a new generation.
    pub fn restart(&mut self) -> u64 {
        self.begin(Command::Restart)
    }

    /// Sets the stop criteria. A finished render resumes if the new criteria are not reached yet.
    pub fn set_stop(&self, stop: Stop) {
        self.send(Command::Stop(stop));
    }

    /// Sets the display transform in which the noise of the picture is estimated.
    pub fn set_display(&self, display: Display) {
        self.send(Command::Display(display));
    }

    pub fn set_paused(&self, paused: bool) {
        self.send(Command::Pause(paused));
    }

    /// Sets the contents of snapshots; initially neither picture nor probe.
    pub fn set_view(&self, view: View) {
        self.send(Command::View(view));
    }

    /// Queues `task` and returns at once. The session's thread runs it between two pieces of work.
    /// The argument is `None` if there is no film: no scene has been set yet, the scene cannot be
    /// rendered, or no watched file can be read. Tasks that are queued when the session ends are
    /// dropped.
    pub fn submit(&self, task: impl FnOnce(Option<Picture>) + Send + 'static) {
        self.send(Command::Task(Box::new(task)));
    }

    /// Runs `task` as [`Session::submit`] does and waits for its result. Returns `None` if the
    /// session has no render.
    pub fn with<R: Send + 'static>(
        &self,
        task: impl FnOnce(&RenderState, &Report) -> R + Send + 'static,
    ) -> Option<R> {
        let (sender, receiver) = bounded(1);
        self.submit(move |picture| {
            if let Some(picture) = picture
                && let Some(state) = picture.state()
            {
                let _ = sender.send(task(state, picture.report));
            }
        });
        receiver.recv().ok()
    }

    /// Waits at most `limit` for a snapshot that has not been taken yet; `None` after this time.
    /// Panics if the rendering thread has panicked.
    pub fn wait(&self, limit: Duration) -> Option<Snapshot> {
        match self.snapshots.recv_timeout(limit) {
            Ok(snapshot) => Some(snapshot),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => panic!("the rendering thread has ended"),
        }
    }

    /// Sends a command with a new generation, cancels the first pass, and returns the generation.
    fn begin(&mut self, command: impl FnOnce(u64) -> Command) -> u64 {
        self.generations += 1;
        self.send(command(self.generations));
        self.shared.cancel_first_pass.store(true, Ordering::Release);
        self.generations
    }

    /// Ends the thread without waiting for it. Queued tasks are dropped.
    pub fn stop(&self) {
        self.send(Command::Quit);
        self.shared.cancel_first_pass.store(true, Ordering::Release);
    }

    fn send(&self, command: Command) {
        // Sending fails after `Quit`, or after a panic, which `drop` propagates.
        let _ = self.commands.send(command);
        self.shared.cancel_wave.store(true, Ordering::Release);
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.stop();
        let end = Instant::now() + END_PATIENCE;
        let is_over = |thread: &JoinHandle<()>| {
            while !thread.is_finished() && Instant::now() < end {
                std::thread::sleep(Duration::from_millis(1));
            }
            thread.is_finished()
        };
        if let Some(Err(panic)) = self.thread.take().filter(is_over).map(JoinHandle::join)
            && !std::thread::panicking()
        {
            std::panic::resume_unwind(panic);
        }
    }
}
