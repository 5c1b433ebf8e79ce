//! A scene in work: the compiled world and the film that its samples go to.

use crate::film::{Display, Estimator, Film, Header, Mix, TILE};
use crate::render::schedule::{Schedule, Settings};
use crate::render::session::Traced;
use crate::render::wave::{Wave, WaveReport};
use crate::render::{first, pass};
use crate::sampling::SampleSettings;
use crate::scene::Scene;
use crate::world::{self, AnyWorld};
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
pub struct Rendering {
    /// The compiled scene.
    pub world: AnyWorld,
    /// The samples.
    pub film: Film,
    /// Colour and strength of the light groups, as the scene has them.
    pub mix: Mix,
    sampling: SampleSettings,
    estimator: Estimator,
}

impl Rendering {
    /// Compiles `scene` and gives it an empty film: that of `before` if it is the same size, else a
    /// new one.
    pub fn new(scene: &Scene, options: &Options, before: Option<Self>) -> Self {
        let world = AnyWorld::compile(scene, &options.world);
        let [width, height] = scene.film.size.map(|n| n as usize);
        let header = Header {
            width,
            height,
            scales: world.group_scales(),
            seed: options.sampling.seed,
            precision: world.lanes().to_string(),
        };
        let mix = Mix { weights: world.mix(scene) };
        let estimator = Estimator::new(&header.scales, &mix, &options.display);
        let film = match before.map(|b| b.film).filter(|film| *film.header() == header) {
            Some(mut film) => {
                film.restart();
                film
            }
            None => Film::new(header),
        };
        Self { world, film, mix, sampling: options.sampling, estimator }
    }
}

impl Traced for Rendering {
    type Options = Options;

    fn begin(scene: &Scene, options: &Options, before: Option<Self>) -> Result<Self, String> {
        match scene.faults().first() {
            Some(fault) => Err(fault.to_string()),
            None => Ok(Self::new(scene, options, before)),
        }
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
        first::run(&self.world, &mut self.film, wave, &self.sampling, pool, abandon, shown)
    }

    fn run(&mut self, wave: &Wave, pool: &rayon::ThreadPool, interrupt: &AtomicBool) -> WaveReport {
        let Self { world, film, sampling, estimator, .. } = self;
        pass::run(world, film, wave, sampling, estimator, pool, interrupt)
    }

    fn film(&self) -> &Film {
        &self.film
    }

    fn schedule(&self, settings: Settings) -> Schedule {
        let film = &self.film;
        let pixels_of = |tile: usize| {
            let [x, y] = film.tile_origin(tile);
            ((film.width() - x).min(TILE) * (film.height() - y).min(TILE)) as u32
        };
        let pixels: Vec<u32> = (0..film.tile_count()).map(pixels_of).collect();
        Schedule::new(&pixels, film.tile_columns(), settings)
    }
}
