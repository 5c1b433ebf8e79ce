//! State of one progressive render: compiled scene, film and noise estimator.

use crate::error_probe::ErrorProbe;
use crate::film::{Display, Estimator, Film, Header, LightWeights, TILE};
use crate::pass::PassContext;
use crate::relighting::Relighting;
use crate::roughness_mix::RoughnessMix;
use crate::schedule::{Measurable, Schedule, Settings};
use crate::wave::{Wave, WaveReport};
use crate::{first_pass, memory_budget, pass};
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use zerkalo_kernel::sampling::SampleSettings;
use zerkalo_scene::Scene;
use zerkalo_world::{self as world, AnyWorld, Precision};

/// Options of a render: scene compilation, sampling and noise estimation.
#[derive(Clone, Debug)]
pub struct Options {
    pub world: world::Options,
    pub sampling: SampleSettings,
    /// Display transform for which the noise of the picture is estimated.
    pub display: Display,
}

impl Options {
    /// Creates options with which each light has a light group of its own, as far as possible.
    pub fn new(precision: Precision, sampling: SampleSettings, display: Display) -> Self {
        let world = world::Options { precision, ..world::Options::default() };
        Self { world, sampling, display }
    }
}

/// State of a progressive render: compiled scene, its film, and the estimator of the film's noise.
pub struct RenderState {
    pub world: AnyWorld,
    pub film: Film,
    pub weights: LightWeights,
    scene: Arc<Scene>,
    /// Light groups of the film, with the scene for which its samples were traced.
    pub lighting: Arc<Relighting>,
    sampling: SampleSettings,
    display: Display,
    estimator: Estimator,
    /// Scene compiled for the error probe; `None` before the first.
    pub(super) probe: Option<Box<ErrorProbe>>,
    /// Value of [`world::Options::merge_lights`].
    pub(super) merge_lights: bool,
    /// Picture of a smaller roughness, whose samples this render reuses.
    pub(super) mix: Option<Box<RoughnessMix>>,
}

impl RenderState {
    /// Compiles `scene` and creates an empty film, which reuses the memory of `previous`. Returns
    /// the first validation error, or an error if there is not enough memory.
    pub fn new(
        scene: &Arc<Scene>,
        options: &Options,
        previous: Option<Self>,
    ) -> Result<Self, String> {
        match scene.faults().first() {
            Some(fault) => Err(fault.to_string()),
            None => Self::compile(Arc::clone(scene), options, previous, 0..scene.film.size[1]),
        }
    }

    /// Compiles `scene` like [`Self::new`], with a film of the first row of tiles only.
    pub fn without_film(scene: &Arc<Scene>, options: &Options) -> Result<Self, String> {
        match scene.faults().first() {
            Some(fault) => Err(fault.to_string()),
            None => {
                let rows = 0..scene.film.size[1].min(TILE as u32);
                Self::compile(Arc::clone(scene), options, None, rows)
            }
        }
    }

    /// Replaces the film by an empty one for the rows `rows` of the picture, in the same memory. If
    /// there is not enough memory, the state is lost.
    pub(super) fn into_band(self, rows: Range<u32>) -> Result<Self, String> {
        let size = [self.film.header.width as u32, rows.len() as u32];
        let header = Header { height: rows.len(), ..self.film.header.clone() };
        let film = Film::try_new(header, Some(self.film));
        let film = film.map_err(|_| memory_budget::refused(size, self.weights.weights.len()))?;
        Ok(Self { film: film.starting_at(rows.start as usize), ..self })
    }

    /// Compiles `scene`, which must be valid, and creates an empty film for the rows `rows` of the
    /// picture, which reuses the memory of `previous`. The first row must be a multiple of
    /// [`TILE`](crate::film::TILE). Fails if there is not enough memory.
    pub(super) fn compile(
        scene: Arc<Scene>,
        options: &Options,
        previous: Option<Self>,
        rows: Range<u32>,
    ) -> Result<Self, String> {
        let world = AnyWorld::compile(&scene, &options.world);
        let (size, groups) =
            ([scene.film.size[0], rows.len() as u32], world.info().groups.members.len());
        let previous = previous.map(|previous| previous.film);
        // The memory of a band was checked when the picture was divided into bands.
        if size == scene.film.size {
            let memory = |film: &Film| Film::memory_bytes(film.header.size(), film.groups());
            memory_budget::check(size, groups, previous.as_ref().map_or(0, memory))?;
        }
        let [width, height] = size.map(|n| n as usize);
        let header = Header {
            width,
            height,
            scales: world.info().scales.clone(),
            seed: options.sampling.seed,
            precision: world.info().precision,
        };
        let weights = LightWeights { weights: world.info().groups.weights(&scene) };
        let estimator = Estimator::new(&header.scales, &weights, &options.display);
        let film = Film::try_new(header, previous);
        let film = film.map_err(|_| memory_budget::refused(size, groups))?;
        let film = film.starting_at(rows.start as usize);
        let groups = world.info().groups.clone();
        let lighting = Relighting { compiled: Arc::clone(&scene), groups };
        Ok(Self {
            world,
            film,
            weights,
            scene,
            lighting: Arc::new(lighting),
            sampling: options.sampling,
            display: options.display,
            estimator,
            probe: None,
            merge_lights: options.world.merge_lights,
            mix: None,
        })
    }

    /// Shows `scene` by a change of light weights and returns `true`. Returns `false`, without a
    /// change, if `scene` has faults or needs new samples.
    pub fn try_reuse(&mut self, scene: &Arc<Scene>) -> bool {
        let Some(weights) = self.lighting.weights(scene).filter(|_| scene.faults().is_empty())
        else {
            return false;
        };
        self.weights = weights;
        self.scene = Arc::clone(scene);
        self.rebuild_estimator();
        true
    }

    /// Returns the scene of the picture. Its lights may differ from those of the compiled scene.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    pub fn group_names(&self) -> Vec<String> {
        self.world.info().groups.names(&self.scene)
    }

    pub fn display(&self) -> Display {
        self.display
    }

    pub fn set_display(&mut self, display: Display) {
        self.display = display;
        self.rebuild_estimator();
    }

    /// Returns the estimator for the current light weights and display transform.
    pub fn estimator(&self) -> &Estimator {
        &self.estimator
    }

    fn rebuild_estimator(&mut self) {
        self.estimator = Estimator::new(&self.film.header.scales, &self.weights, &self.display);
    }

    pub fn schedule(&self, settings: Settings) -> Schedule {
        let film = &self.film;
        let pixels = (0..film.tile_count()).map(|tile| film.tile_pixels(tile) as u32);
        let pixels: Vec<u32> = pixels.collect();
        let mut schedule = Schedule::new(&pixels, settings);
        schedule.light_period = self.world.info().light_period;
        schedule.measurable = self.measurable();
        schedule
    }

    /// Returns the parts of the error that probes measure.
    pub(super) fn measurable(&self) -> Measurable {
        let info = self.world.info();
        Measurable {
            rounding: matches!(self.world, AnyWorld::Single(_)),
            cut_paths: !info.biases.is_empty(),
            primitives: info.primitives,
        }
    }

    /// Returns the seconds of error probes, and of compiling the scene for them.
    pub(super) fn probe_seconds(&self) -> [f64; 2] {
        self.probe.as_ref().map_or([0.0; 2], |probe| [probe.seconds, probe.compile_seconds])
    }

    pub(super) fn sampling(&self) -> &SampleSettings {
        &self.sampling
    }

    /// Traces the jobs of the first pass, as `first_pass::run` does. The film of a cancelled pass
    /// may only be displayed; no further samples may be added to it.
    pub fn trace_first_pass(
        &mut self,
        wave: &Wave,
        pool: &rayon::ThreadPool,
        cancel_first_pass: &AtomicBool,
        on_refined: &mut dyn FnMut(&Film),
    ) -> Option<WaveReport> {
        let context = PassContext { sampling: &self.sampling, pool, cancel: cancel_first_pass };
        let film = &mut self.film;
        match &self.world {
            AnyWorld::Single(world) => first_pass::run(world, film, wave, context, on_refined),
            AnyWorld::Double(world) => first_pass::run(world, film, wave, context, on_refined),
        }
    }

    /// Traces a wave. Once `cancel_wave` is `true`, no further job starts.
    pub fn trace_wave(
        &mut self,
        wave: &Wave,
        pool: &rayon::ThreadPool,
        cancel_wave: &AtomicBool,
    ) -> WaveReport {
        if let Some(mut mix) = self.mix.take() {
            let report = mix.trace_wave(self, wave, pool, cancel_wave);
            self.mix = Some(mix);
            return report;
        }
        let Self { world, film, sampling, estimator, .. } = self;
        pass::run(world, film, wave, estimator, PassContext { sampling, pool, cancel: cancel_wave })
    }
}
