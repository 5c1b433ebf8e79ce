//! A scene in work: the compiled world and the film that its samples go to.

use crate::film::{Display, Estimator, Film, Header, LightWeights, TILE};
use crate::render::pass::PassContext;
use crate::render::relighting::Relighting;
use crate::render::schedule::{Schedule, Settings};
use crate::render::session::RenderBackend;
use crate::render::wave::{Wave, WaveReport};
use crate::render::{first_pass, pass};
use crate::sampling::SampleSettings;
use crate::scene::Scene;
use crate::world::{self, AnyWorld, FirstHit};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// How scenes are compiled, sampled and judged.
#[derive(Clone, Debug)]
pub struct Options {
    /// How the scene becomes a world.
    pub world: world::Options,
    /// Where samples lie.
    pub sampling: SampleSettings,
    /// The display whose codes the noise is told in.
    pub display: Display,
}

/// A scene in work.
pub struct RenderState {
    /// The compiled scene.
    pub world: AnyWorld,
    /// The samples.
    pub film: Film,
    /// Colour and strength of the light groups, as the scene has them.
    pub mix: LightWeights,
    scene: Arc<Scene>,
    lighting: Arc<Relighting>,
    sampling: SampleSettings,
    display: Display,
    estimator: Estimator,
}

impl RenderState {
    /// Compiles `scene` and gives it an empty film, in the memory of that of `before`.
    pub fn new(scene: &Scene, options: &Options, before: Option<Self>) -> Self {
        Self::compiled(Arc::new(scene.clone()), options, before)
    }

    fn compiled(scene: Arc<Scene>, options: &Options, before: Option<Self>) -> Self {
        let world = AnyWorld::compile(&scene, &options.world);
        let [width, height] = scene.film.size.map(|n| n as usize);
        let header = Header {
            width,
            height,
            scales: world.group_scales(),
            seed: options.sampling.seed,
            precision: world.precision().to_string(),
        };
        let mix = LightWeights { weights: world.mix(&scene) };
        let estimator = Estimator::new(&header.scales, &mix, &options.display);
        let film = match before {
            Some(before) => before.film.reuse_for(header),
            None => Film::new(header),
        };
        let lighting = Relighting::new(Arc::clone(&scene), world.light_groups().clone());
        Self {
            world,
            film,
            mix,
            scene,
            lighting: Arc::new(lighting),
            sampling: options.sampling,
            display: options.display,
            estimator,
        }
    }

    /// The scene that the picture shows, which may differ from the compiled one in its lights' colours
    /// and strengths.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// A name for each light group.
    pub fn group_names(&self) -> Vec<String> {
        self.lighting.names(&self.scene)
    }

    fn new_estimator(&mut self) {
        self.estimator = Estimator::new(self.film.scales(), &self.mix, &self.display);
    }
}

impl RenderBackend for RenderState {
    type Options = Options;

    fn begin(scene: &Arc<Scene>, options: &Options, before: Option<Self>) -> Result<Self, String> {
        match scene.faults().first() {
            Some(fault) => Err(fault.to_string()),
            None => Ok(Self::compiled(Arc::clone(scene), options, before)),
        }
    }

    fn try_reuse(&mut self, scene: &Arc<Scene>) -> bool {
        let Some(mix) = self.lighting.mix(scene).filter(|_| scene.faults().is_empty()) else {
            return false;
        };
        self.mix = mix;
        self.scene = Arc::clone(scene);
        self.new_estimator();
        true
    }

    fn display_of(options: &mut Options) -> &mut Display {
        &mut options.display
    }

    fn set_display(&mut self, display: Display) {
        self.display = display;
        self.new_estimator();
    }

    fn restart(&mut self) {
        self.film.restart();
    }

    fn first(
        &mut self,
        wave: &Wave,
        pool: &rayon::ThreadPool,
        abandon: &AtomicBool,
        shown: &mut dyn FnMut(&Film),
    ) -> Option<WaveReport> {
        let context = PassContext { sampling: &self.sampling, pool, cancel: abandon };
        first_pass::run(&self.world, &mut self.film, wave, context, shown)
    }

    fn run(&mut self, wave: &Wave, pool: &rayon::ThreadPool, interrupt: &AtomicBool) -> WaveReport {
        let Self { world, film, sampling, estimator, .. } = self;
        pass::run(world, film, wave, estimator, PassContext { sampling, pool, cancel: interrupt })
    }

    fn film(&self) -> &Film {
        &self.film
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
        self.world.first_hit(points, seen);
    }

    fn lanes(&self) -> &'static str {
        self.world.lanes()
    }

    fn inventory(&self) -> String {
        self.world.inventory().to_string()
    }

    fn schedule(&self, settings: Settings) -> Schedule {
        let film = &self.film;
        let pixels_of = |tile: usize| {
            let [x, y] = film.tile_origin(tile);
            ((film.width() - x).min(TILE) * (film.height() - y).min(TILE)) as u32
        };
        let pixels: Vec<u32> = (0..film.tile_count()).map(pixels_of).collect();
        Schedule::new(&pixels, settings)
    }
}
