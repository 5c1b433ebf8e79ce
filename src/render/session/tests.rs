//! The session with a double in place of a scene: it counts what is asked of it and fills a film with
//! nothing.

use crate::film::{Header, Mse, Noise, TILE, TileNoise};
use crate::render::schedule::{Criterion, Spp, Stop, StoppedBy};
use crate::render::session::*;
use crate::render::wave::JobReport;
use crate::world::LightGroups;
use std::sync::atomic::AtomicUsize;
use std::time::{Duration, Instant};

/// Long enough for any machine; reached only on failure.
const PATIENCE: Duration = Duration::from_secs(20);

#[derive(Clone, Default)]
struct Log {
    compiled: Arc<AtomicUsize>,
    jobs: Arc<AtomicUsize>,
}

struct Options {
    log: Log,
    job: Duration,
    compile: Duration,
    display: Display,
}

struct Double {
    film: Film,
    lighting: Arc<Relighting>,
    mix: LightWeights,
    display: Display,
    estimator: Estimator,
    log: Log,
    job: Duration,
}

impl Double {
    fn job(&mut self, wave: &Wave, index: usize) -> JobReport {
        std::thread::sleep(self.job);
        self.log.jobs.fetch_add(1, Ordering::SeqCst);
        let job = wave.jobs[index];
        let slot = self.film.slots(&[job.tile as usize]).remove(0);
        let tile = slot.prepare();
        assert_eq!(tile.counts()[wave.replicate], job.first, "each index once, in order");
        tile.advance(wave.replicate, job.count);
        let mse = Mse { codes: 1.0 / f64::from(job.first + 1), linear: 0.0 };
        let error = TileNoise { reported: mse, allocation: mse, squares: Mse::SPREAD, pixels: 256 };
        JobReport { rays: 1, glossy: false, error: wave.estimate.then_some(error) }
    }
}

impl RenderBackend for Double {
    type Options = Options;

    fn begin(scene: &Arc<Scene>, options: &Options, before: Option<Self>) -> Result<Self, String> {
        std::thread::sleep(options.compile);
        options.log.compiled.fetch_add(1, Ordering::SeqCst);
        let [width, height] = scene.film.size.map(|n| n as usize);
        if width == 13 {
            return Err("13 brings bad luck".to_string());
        }
        let header =
            Header { width, height, scales: vec![1.0], seed: 0, precision: "none".to_string() };
        let film = match before.map(|b| b.film).filter(|f| *f.header() == header) {
            Some(mut film) => {
                film.restart();
                film
            }
            None => Film::new(header),
        };
        let groups = LightGroups::new(scene, false, false);
        let lighting = Arc::new(Relighting::new(Arc::clone(scene), groups));
        let mix = lighting.mix(scene).unwrap();
        let estimator = Estimator::new(film.scales(), &mix, &options.display);
        let Options { log, job, display, .. } = options;
        Ok(Self { film, lighting, mix, estimator, log: log.clone(), job: *job, display: *display })
    }

    fn try_reuse(&mut self, scene: &Arc<Scene>) -> bool {
        let Some(mix) = self.lighting.mix(scene) else { return false };
        self.mix = mix;
        true
    }

    fn display_of(options: &mut Options) -> &mut Display {
        &mut options.display
    }

    fn set_display(&mut self, display: Display) {
        self.display = display;
    }

    fn mix(&self) -> &LightWeights {
        &self.mix
    }

    fn display(&self) -> Display {
        self.display
    }

    fn estimator(&self) -> &Estimator {
        &self.estimator
    }

    fn lighting(&self) -> &Arc<Relighting> {
        &self.lighting
    }

    fn look(&self, points: &[[f64; 2]], seen: &mut [FirstHit]) {
        for (point, sight) in points.iter().zip(seen) {
            sight.depth = (point[0] + 1000.0 * point[1]) as f32;
        }
    }

    fn lanes(&self) -> &'static str {
        "none"
    }

    fn inventory(&self) -> String {
        format!("{} tiles", self.film.tile_count())
    }

    fn restart(&mut self) {
        self.film.restart();
    }

    fn first(
        &mut self,
        wave: &Wave,
        _: &rayon::ThreadPool,
        cancel_first_pass: &AtomicBool,
        shown: &mut dyn FnMut(&Film),
    ) -> Option<WaveReport> {
        shown(&self.film);
        let mut reports = Vec::new();
        for i in 0..wave.jobs.len() {
            if cancel_first_pass.load(Ordering::Acquire) {
                return None;
            }
            reports.push(Some(self.job(wave, i)));
        }
        Some(WaveReport { reports })
    }

    fn run(&mut self, wave: &Wave, _: &rayon::ThreadPool, cancel_wave: &AtomicBool) -> WaveReport {
        let job = |i| (!cancel_wave.load(Ordering::Acquire)).then(|| self.job(wave, i));
        WaveReport { reports: (0..wave.jobs.len()).map(job).collect() }
    }

    fn film(&self) -> &Film {
        &self.film
    }

    fn schedule(&self, settings: Settings) -> Schedule {
        let pixels = vec![(TILE * TILE) as u32; self.film.tile_count()];
        Schedule::new(&pixels, settings)
    }
}

fn endless() -> Stop {
    Stop { spp: Some(1 << 30), ..Stop::default() }
}

fn session(stop: Stop, job_us: u64, compile_ms: u64) -> (Session<Double>, Log) {
    let log = Log::default();
    let options = Options {
        log: log.clone(),
        job: Duration::from_micros(job_us),
        compile: Duration::from_millis(compile_ms),
        display: Display::default(),
    };
    let settings =
        Settings { adaptive: false, criterion: Criterion::Codes, rays_per_pixel: 0, stop };
    (Session::new(1, options, settings).unwrap(), log)
}

fn scene(width: u32) -> Arc<Scene> {
    let mut scene = Scene::default();
    scene.film.size = [width, 64];
    Arc::new(scene)
}

/// The first snapshot that `wanted` accepts.
fn wait_for(session: &Session<Double>, wanted: impl Fn(&Snapshot) -> bool) -> Snapshot {
    let end = Instant::now() + PATIENCE;
    loop {
        let left = end.checked_duration_since(Instant::now()).expect("a snapshot in time");
        if let Some(snapshot) = session.wait(left).filter(&wanted) {
            return snapshot;
        }
    }
}

#[test]
fn the_newest_scene_wins_and_the_others_are_not_compiled() {
    let (mut session, log) = session(endless(), 0, 20);
    let last = (0..50).map(|_| session.set_scene(scene(64))).last().unwrap();
    wait_for(&session, |s| s.report.generation == last && s.report.samples > 0);
    let compiled = log.compiled.load(Ordering::SeqCst);
    assert!(compiled <= 5, "{compiled} of 50 scenes compiled");
}

#[test]
fn the_last_edit_is_never_lost() {
    let (mut session, _) = session(endless(), 20, 0);
    for round in 0..300u64 {
        let mut last = 0;
        for _ in 0..=round % 4 {
            last = session.set_scene(scene(64));
            // Meets the worker in all its states.
            std::thread::sleep(Duration::from_micros(round * 37 % 500));
        }
        wait_for(&session, |s| s.report.generation == last && s.report.samples > 0);
    }
}

#[test]
fn a_new_scene_interrupts_a_long_wave() {
    // 4096 tiles at 100 us: a wave takes 0.4 s and more.
    let (mut session, log) = session(endless(), 100, 0);
    session.set_view(View::default());
    let first = session.set_scene(scene(16 * 1024));
    wait_for(&session, |s| s.report.generation == first && s.report.samples > 0);
    let before = log.jobs.load(Ordering::SeqCst);
    let second = session.set_scene(scene(64));
    wait_for(&session, |s| s.report.generation == second && s.report.samples > 0);
    let jobs = log.jobs.load(Ordering::SeqCst) - before;
    assert!(jobs < 1000, "{jobs} jobs between the edit and its first picture");
}

#[test]
fn a_pause_stops_the_work_and_loses_nothing() {
    let stop = Stop { spp: Some(64), ..Stop::default() };
    let (mut session, log) = session(stop, 200, 0);
    session.set_scene(scene(256));
    wait_for(&session, |s| s.report.samples > 0);
    session.pause();
    let paused = wait_for(&session, |s| s.report.state == State::Paused);
    let jobs = log.jobs.load(Ordering::SeqCst);
    std::thread::sleep(Duration::from_millis(30));
    assert_eq!(log.jobs.load(Ordering::SeqCst), jobs, "nothing is traced in a pause");
    // Work on the film is possible in a pause; the next report says that it still is one.
    assert_eq!(session.with(|_, report| report.samples), Some(paused.report.samples));
    session.resume();
    let end = wait_for(&session, |s| matches!(s.report.state, State::Finished(_)));
    assert_eq!(end.report.state, State::Finished(StoppedBy::Spp));
    assert_eq!(end.report.spp, Spp { min: 64, mean: 64.0, max: 64 });
    let counts = session.with(|d, _| d.film.touched().map(|(_, t)| t.counts()).collect::<Vec<_>>());
    assert_eq!(counts, Some(vec![[32, 32]; 64]));
}

#[test]
fn a_paused_session_still_shows_a_new_scene() {
    let (mut session, _) = session(endless(), 0, 0);
    session.pause();
    let generation = session.set_scene(scene(64));
    let shown = wait_for(&session, |s| s.report.state == State::Paused);
    assert_eq!(shown.report.generation, generation);
    assert_eq!(shown.report.samples, 64 * 64);
}

#[test]
fn tasks_interrupt_waves_and_change_no_result() {
    let stop = Stop { spp: Some(48), ..Stop::default() };
    let (mut session, log) = session(stop, 50, 0);
    assert_eq!(session.with(|_, _| ()), None, "there is no film yet");
    session.set_scene(scene(512));
    let mut tasks = 0;
    while session.take().is_none_or(|s| s.report.state == State::Tracing) {
        assert!(session.with(|d, _| d.film.tile_count()) == Some(128));
        tasks += 1;
    }
    assert!(tasks > 20, "{tasks} tasks");
    let counts = session.with(|d, _| d.film.touched().map(|(_, t)| t.counts()).collect::<Vec<_>>());
    assert_eq!(counts, Some(vec![[24, 24]; 128]));
    // Waves 1, 1, 2, 4, 8, 8 of A and of B over 128 tiles, each job once; but the first wave may be begun twice,
    // if the mark of the scene's arrival is raised late.
    let again = log.jobs.load(Ordering::SeqCst) - 12 * 128;
    assert!(again < 128, "{again} jobs too many");
}

#[test]
fn a_scene_that_does_not_compile_says_why_and_the_next_one_works() {
    let (mut session, _) = session(endless(), 0, 0);
    let bad = session.set_scene(scene(13));
    let failed = wait_for(&session, |s| matches!(s.report.state, State::Failed(_)));
    assert_eq!(failed.report.generation, bad);
    assert_eq!(failed.report.state, State::Failed("13 brings bad luck".to_string()));
    assert_eq!(session.with(|_, _| ()), None);
    let good = session.set_scene(scene(64));
    wait_for(&session, |s| s.report.generation == good && s.report.samples > 0);
}

#[test]
fn snapshots_hold_what_the_guest_asks_for() {
    let (mut session, _) = session(endless(), 0, 0);
    session.set_view(View { raster: Some([8, 4]), probe: None });
    session.set_scene(scene(64));
    let noisy = wait_for(&session, |s| s.report.noise.is_some());
    let picture = noisy.picture.expect("a picture");
    assert_eq!((picture.cols, picture.rows), (8, 4));
    assert_eq!(noisy.tiles.noise_codes.len(), 16);
    assert!(noisy.tiles.noise_codes.iter().all(|n| *n > 0.0 && *n < 1.0));
    session.set_view(View::default());
    wait_for(&session, |s| s.picture.is_none());
}

#[test]
fn reports_tell_noise_and_time_left() {
    let stop = Stop { spp: Some(200), ..Stop::default() };
    let (mut session, _) = session(stop, 100, 5);
    session.set_scene(scene(64));
    let running = wait_for(&session, |s| s.report.noise.is_some()).report;
    let Noise { rmse_codes: codes, .. } = running.noise.unwrap();
    assert!(codes > 0.0 && codes < 1.0);
    let (low, high) = running.eta_seconds.expect("a time");
    assert!(low > 0.0 && high >= low);
    assert!(running.progress.is_some_and(|p| p > 0.0 && p < 1.0));
    assert!(running.samples_per_second() > 0.0);
    assert!(running.compile_seconds >= 0.005);
    assert!(running.first_picture_seconds.is_some_and(|s| s > running.compile_seconds));
    let end = wait_for(&session, |s| s.report.state != State::Tracing).report;
    assert_eq!(end.progress, Some(1.0));
    assert!(end.seconds >= running.seconds);
}

#[test]
fn dropping_a_session_ends_it_at_once() {
    let (mut session, log) = session(endless(), 100, 0);
    session.set_scene(scene(16 * 1024));
    wait_for(&session, |s| s.report.samples > 0);
    let before = log.jobs.load(Ordering::SeqCst);
    drop(session);
    let jobs = log.jobs.load(Ordering::SeqCst) - before;
    assert!(jobs < 1000, "{jobs} jobs after the end");
}

#[test]
#[should_panic(expected = "the rendering thread has ended")]
fn a_panic_of_the_worker_reaches_the_guest() {
    let (mut session, _) = session(endless(), 0, 0);
    session.set_scene(scene(64));
    session.with(|_, _| panic!("a task gone wrong"));
    wait_for(&session, |_| false);
}
