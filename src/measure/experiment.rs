//! Experiments: each varies one setting that trades speed for accuracy.

use std::io;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use zerkalo_kernel::sampling::{SampleSettings, SamplerKind};
use zerkalo_render::film::Display;
use zerkalo_render::schedule::{Settings, Stop};
use zerkalo_render::{Options, SyncRender};
use zerkalo_scene::material::Lobe;
use zerkalo_scene::{Acceleration, RayTypes, Scene};
use zerkalo_world::{AnyWorld, Precision};

/// Experiment: variants of one setting that trades speed for accuracy, against its default.
#[derive(Debug)]
pub struct Experiment {
    /// Name on the command line.
    pub name: &'static str,
    /// Title in tables and plots.
    pub title: &'static str,
    /// `true` if the pictures of all variants differ in noise only.
    pub is_unbiased: bool,
    /// Function that returns the variants of the default settings, without any that equal them.
    vary: Vary,
}

type Vary = fn(&Variant) -> Vec<Variant>;

/// Default settings, as an experiment without variants.
pub static DEFAULT: Experiment = unbiased("default", "Default settings", |_| Vec::new());

pub static EXPERIMENTS: [Experiment; 10] = [
    unbiased("adaptivity", "Adaptive against uniform sampling", |base| {
        vec![base.with("uniform", |v| v.adaptive = false)]
    }),
    unbiased("precision", "Single against double precision", other_precision),
    unbiased("threads", "Scaling with threads", fewer_threads),
    unbiased("sampler", "Sobol points against independent random numbers", |base| {
        vec![base.with("random", |v| v.options.sampling.kind = SamplerKind::Random)]
    }),
    biased("lobe", "Square lobe against cone lobe", other_lobes),
    biased("ray-types", "Fewer ray types", fewer_ray_types),
    biased("max-depth", "Fewer reflections", smaller_depths),
    biased("min-throughput", "Termination of weak paths", larger_throughputs),
    biased("rays-per-pixel", "Cap on samples of glossy pixels", caps),
    unbiased("acceleration", "Acceleration structures", other_accelerations),
];

const fn unbiased(name: &'static str, title: &'static str, vary: Vary) -> Experiment {
    Experiment { name, title, is_unbiased: true, vary }
}

const fn biased(name: &'static str, title: &'static str, vary: Vary) -> Experiment {
    Experiment { name, title, is_unbiased: false, vary }
}

impl PartialEq for Experiment {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

/// Returns the variant in the precision that `auto` does not choose for the scene.
fn other_precision(base: &Variant) -> Vec<Variant> {
    let (name, precision) = match AnyWorld::compile(&base.scene, &base.options.world) {
        AnyWorld::Single(_) => ("double", Precision::Double),
        AnyWorld::Double(_) => ("single", Precision::Single),
    };
    vec![base.with(name, |v| v.options.world.precision = precision)]
}

fn fewer_threads(base: &Variant) -> Vec<Variant> {
    let counts = (0..).map(|k| 1 << k).take_while(|n| *n < base.threads);
    let name = |n| if n == 1 { "1 thread".to_string() } else { format!("{n} threads") };
    counts.map(|n| base.with(name(n), |v| v.threads = n)).collect()
}

fn fewer_ray_types(base: &Variant) -> Vec<Variant> {
    let fewer = RayTypes::ALL.into_iter().filter(|kind| *kind < base.scene.trace.ray_types);
    let name = |kind| RayTypes::CHOICES[kind as usize].name;
    fewer.map(|kind| base.with_scene(name(kind), |s| s.trace.ray_types = kind)).collect()
}

fn other_accelerations(base: &Variant) -> Vec<Variant> {
    let present = base.scene.trace.acceleration;
    let others = Acceleration::ALL.into_iter().filter(|kind| *kind != present);
    others.map(|kind| base.with_scene(kind.name(), |s| s.trace.acceleration = kind)).collect()
}

/// Returns a variant whose cone lobes are replaced by square lobes, their cheap approximation, and
/// a variant with the opposite replacement. Each exists only if the scene has such glossy lobes.
fn other_lobes(base: &Variant) -> Vec<Variant> {
    let exchanges = [
        (Lobe::Cone, Lobe::Square, "square for cone"),
        (Lobe::Square, Lobe::Cone, "cone for square"),
    ];
    let occurs =
        |from: Lobe| base.scene.materials.values().any(|m| m.lobe == from && m.roughness > 0.0);
    let variants = exchanges.into_iter().filter(|(from, ..)| occurs(*from));
    let variants = variants.map(|(from, to, name)| {
        base.with_scene(name, |s| {
            let matching = s.materials.values_mut().filter(|m| m.lobe == from);
            matching.for_each(|m| m.lobe = to);
        })
    });
    if_reflecting(base, variants)
}

fn smaller_depths(base: &Variant) -> Vec<Variant> {
    let depths = [0, 1, 2, 4, 8].into_iter().filter(|depth| *depth < base.scene.trace.max_depth);
    let name = |depth| format!("depth {depth}");
    let variants = depths.map(|depth| base.with_scene(name(depth), |s| s.trace.max_depth = depth));
    if_reflecting(base, variants)
}

fn larger_throughputs(base: &Variant) -> Vec<Variant> {
    let present = base.scene.trace.min_throughput;
    let larger = [0.001, 0.01, 0.1].into_iter().filter(|limit| *limit > present);
    let name = |limit| format!("throughput {limit}");
    let variants =
        larger.map(|limit| base.with_scene(name(limit), |s| s.trace.min_throughput = limit));
    if_reflecting(base, variants)
}

fn caps(base: &Variant) -> Vec<Variant> {
    let caps = [64, 256, 1024].into_iter();
    let name = |cap| format!("{cap} samples");
    let variants = caps.map(|cap| base.with_scene(name(cap), |s| s.film.rays_per_pixel = cap));
    if_reflecting(base, variants)
}

/// Collects `variants` of a setting that affects reflections only. Returns none if the scene has no
/// reflections.
fn if_reflecting(base: &Variant, variants: impl Iterator<Item = Variant>) -> Vec<Variant> {
    let Scene { trace, objects, materials, .. } = &*base.scene;
    let mut names = objects.iter().flat_map(|object| object.materials());
    let reflects = trace.ray_types == RayTypes::Full
        && trace.max_depth > 0
        && names.any(|name| materials.get(name).is_some_and(|m| m.reflection > 0.0));
    if reflects { variants.collect() } else { Vec::new() }
}

/// Settings of one render of an experiment.
#[derive(Clone, Debug)]
pub struct Variant {
    pub experiment: &'static Experiment,
    /// Value of the varied setting, such as `uniform` or `depth 4`.
    pub name: String,
    pub scene: Arc<Scene>,
    pub options: Options,
    pub adaptive: bool,
    pub threads: usize,
    /// Request to end the render.
    pub cancel: Arc<AtomicBool>,
}

impl Variant {
    /// Starts the render of this variant. It ends by itself only when every tile has its largest
    /// number of samples. Fails if a thread cannot be started.
    pub fn start(&self) -> io::Result<SyncRender> {
        let settings = Settings { adaptive: self.adaptive, ..Settings::until(Stop::default()) };
        let mut render = SyncRender::new(&self.scene, &self.options, settings, self.threads)?;
        render.cancel = Arc::clone(&self.cancel);
        Ok(render)
    }

    /// Returns a copy with the name `name` to which `change` is applied.
    fn with(&self, name: impl Into<String>, change: impl FnOnce(&mut Self)) -> Self {
        let mut variant = Self { name: name.into(), ..self.clone() };
        change(&mut variant);
        variant
    }

    /// Returns a copy with the name `name` to whose scene `change` is applied.
    fn with_scene(&self, name: impl Into<String>, change: impl FnOnce(&mut Scene)) -> Self {
        self.with(name, |variant| change(Arc::make_mut(&mut variant.scene)))
    }
}

/// Noise targets, experiments and duration of a measurement.
#[derive(Clone, Debug, Default)]
pub struct Plan {
    pub targets: Vec<f64>,
    pub experiments: Vec<&'static Experiment>,
    /// Smallest number of timed renders of each variant, at least 1.
    pub repetitions: usize,
    /// Approximate duration of the whole measurement, in seconds.
    pub seconds: f64,
    /// Number of tracing threads, except in the experiment `threads`.
    pub threads: usize,
    pub seed: u64,
    pub display: Display,
    /// Request to end the measurement with the results so far.
    pub cancel: Arc<AtomicBool>,
}

impl Plan {
    /// Returns the variant with default settings, then the variants of each experiment that differ
    /// from it in this scene.
    pub fn variants(&self, scene: &Arc<Scene>) -> Vec<Variant> {
        let sampling = SampleSettings { seed: self.seed, kind: SamplerKind::Sobol };
        let base = Variant {
            experiment: &DEFAULT,
            name: DEFAULT.name.to_string(),
            scene: Arc::clone(scene),
            options: Options::new(Precision::Auto, sampling, self.display),
            adaptive: true,
            threads: self.threads,
            cancel: Arc::clone(&self.cancel),
        };
        let mut all = vec![base.clone()];
        for experiment in self.experiments.iter().copied() {
            all.extend((experiment.vary)(&Variant { experiment, ..base.clone() }));
        }
        all
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use zerkalo_scene::Scene;

    fn names(experiment: &str, threads: usize) -> Vec<String> {
        let experiments = EXPERIMENTS.iter().filter(|e| e.name == experiment).collect();
        let plan = Plan { experiments, threads, ..Plan::default() };
        let text = include_str!("../../scenes/mirror-room.toml");
        let all = plan.variants(&Arc::new(Scene::parse(text, "mirror-room.toml").unwrap()));
        assert_eq!((all[0].experiment.name, all[0].threads), (DEFAULT.name, threads));
        all[1..].iter().map(|v| v.name.clone()).collect()
    }

    #[test]
    fn variants_differ_from_the_default() {
        assert_eq!(names("precision", 2), ["double"]);
        assert_eq!(names("threads", 1), [""; 0]);
        assert_eq!(names("threads", 2), ["1 thread"]);
        assert_eq!(names("threads", 6), ["1 thread", "2 threads", "4 threads"]);
        assert_eq!(names("adaptivity", 2), ["uniform"]);
    }
}
