//! Experiments: settings that trade speed for accuracy are varied one at a time.

use std::io;
use std::str::FromStr;
use std::sync::Arc;
use zerkalo_kernel::sampling::{SampleSettings, SamplerKind};
use zerkalo_render::film::Display;
use zerkalo_render::schedule::{Settings, Stop};
use zerkalo_render::{Options, SyncRender};
use zerkalo_scene::material::Lobe;
use zerkalo_scene::{Acceleration, RayTypes, Scene};
use zerkalo_world::{self as world, AnyWorld, Precision};

/// Setting of the renderer that an experiment varies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Experiment {
    Default,
    /// Adaptive or uniform sampling.
    Adaptivity,
    /// Single or double precision.
    Precision,
    Threads,
    /// Sobol points or independent random numbers.
    Sampler,
    /// Cone lobe of glossy reflection, or the square lobe, its cheap approximation.
    Lobe,
    /// Only camera rays, or camera and shadow rays.
    Level,
    /// Largest number of reflections of a path.
    Depth,
    /// Throughput below which a path ends.
    MinWeight,
    /// Largest number of samples per pixel in glossy tiles.
    RaysPerPixel,
    Acceleration,
}

impl Experiment {
    /// All experiments, each with its name on the command line and its title in tables and plots.
    pub const ALL: &'static [(Self, &'static str, &'static str)] = &[
        (Self::Default, "default", "Default settings"),
        (Self::Adaptivity, "adaptivity", "Adaptive against uniform sampling"),
        (Self::Precision, "precision", "Single against double precision"),
        (Self::Threads, "threads", "Scaling with threads"),
        (Self::Sampler, "sampler", "Sobol points against independent random numbers"),
        (Self::Lobe, "lobe", "Square lobe against cone lobe"),
        (Self::Level, "ray-types", "Fewer ray types"),
        (Self::Depth, "max-depth", "Fewer reflections"),
        (Self::MinWeight, "min-throughput", "Termination of weak paths"),
        (Self::RaysPerPixel, "rays-per-pixel", "Cap on samples of glossy pixels"),
        (Self::Acceleration, "acceleration", "Acceleration structures"),
    ];

    pub fn name(self) -> &'static str {
        self.words()[0]
    }

    pub fn title(self) -> &'static str {
        self.words()[1]
    }

    fn words(self) -> [&'static str; 2] {
        let found = Self::ALL.iter().find(|(experiment, ..)| *experiment == self);
        found.map_or([""; 2], |(_, name, title)| [name, title])
    }

    /// Returns the name of the setting's default in tables, such as `adaptive, default`. `single`
    /// is `true` for single precision; `threads` is the default number of threads.
    pub fn default_name(self, single: bool, threads: usize) -> String {
        let name = match self {
            Self::Adaptivity => "adaptive".to_string(),
            Self::Precision => if single { "single" } else { "double" }.to_string(),
            Self::Threads => thread_count(threads),
            Self::Sampler => "Sobol".to_string(),
            Self::Default
            | Self::Lobe
            | Self::Level
            | Self::Depth
            | Self::MinWeight
            | Self::RaysPerPixel
            | Self::Acceleration => return "default".to_string(),
        };
        format!("{name}, default")
    }

    /// Returns `true` if the pictures of all variants differ in noise only.
    pub fn unbiased(self) -> bool {
        matches!(
            self,
            Self::Default
                | Self::Adaptivity
                | Self::Precision
                | Self::Threads
                | Self::Sampler
                | Self::Acceleration
        )
    }
}

impl FromStr for Experiment {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let found = Self::ALL.iter().find(|(_, name, _)| *name == text);
        found.map(|(experiment, ..)| *experiment).ok_or_else(|| {
            let names: Vec<_> = Self::ALL.iter().map(|(_, name, _)| *name).collect();
            format!("setting `{text}` is not known; known: {}", names.join(", "))
        })
    }
}

/// One render of an experiment.
#[derive(Clone)]
pub struct Variant {
    pub experiment: Experiment,
    /// Value of the varied setting, such as `uniform` or `depth 4`.
    pub name: String,
    pub scene: Arc<Scene>,
    pub options: Options,
    pub adaptive: bool,
    pub threads: usize,
}

impl Variant {
    /// Creates a render of this variant, which ends by itself only when every tile is full. Returns
    /// the error of the system if a thread cannot be started.
    pub fn start(&self) -> io::Result<SyncRender> {
        let settings = Settings::new(self.adaptive, Stop::default());
        SyncRender::new(&self.scene, &self.options, settings, self.threads)
    }
}

/// Plan of a measurement.
#[derive(Clone, Debug)]
pub struct Plan {
    pub targets: Vec<f64>,
    pub experiments: Vec<Experiment>,
    /// Smallest number of timed renders of each variant.
    pub repetitions: usize,
    /// Approximate duration of all measurements, in seconds.
    pub seconds: f64,
    /// Number of tracing threads, except in [`Experiment::Threads`].
    pub threads: usize,
    pub seed: u64,
    pub display: Display,
}

impl Plan {
    /// Returns the default settings, then the changed settings of each experiment that differ from
    /// the default in this scene.
    pub fn variants(&self, scene: &Arc<Scene>) -> Vec<Variant> {
        let mut all = vec![self.default_of(scene)];
        for experiment in &self.experiments {
            all.extend(self.of_topic(*experiment, scene));
        }
        all
    }

    pub fn default_of(&self, scene: &Arc<Scene>) -> Variant {
        Variant {
            experiment: Experiment::Default,
            name: "default".to_string(),
            scene: Arc::clone(scene),
            options: Options {
                world: world::Options::default(),
                sampling: SampleSettings { seed: self.seed, kind: SamplerKind::Sobol },
                display: self.display,
            },
            adaptive: true,
            threads: self.threads,
        }
    }

    fn of_topic(&self, experiment: Experiment, scene: &Arc<Scene>) -> Vec<Variant> {
        let base = self.default_of(scene);
        let named = |name: &str| Variant { experiment, name: name.to_string(), ..base.clone() };
        match experiment {
            Experiment::Default => Vec::new(),
            Experiment::Adaptivity => vec![Variant { adaptive: false, ..named("uniform") }],
            Experiment::Precision => {
                // The precision that `auto` does not choose for this scene.
                let (name, precision) = match AnyWorld::compile(scene, &base.options.world) {
                    AnyWorld::Single(_) => ("double", Precision::Double),
                    AnyWorld::Double(_) => ("single", Precision::Single),
                };
                let mut variant = named(name);
                variant.options.world.precision = precision;
                vec![variant]
            }
            Experiment::Threads => {
                let counts = (0..).map(|k| 1 << k).take_while(|n| *n < self.threads);
                counts.map(|n| Variant { threads: n, ..named(&thread_count(n)) }).collect()
            }
            Experiment::Sampler => {
                let mut random = named("random");
                random.options.sampling.kind = SamplerKind::Random;
                vec![random]
            }
            Experiment::Lobe
            | Experiment::Level
            | Experiment::Depth
            | Experiment::MinWeight
            | Experiment::RaysPerPixel
            | Experiment::Acceleration => edited(experiment, scene)
                .into_iter()
                .map(|(name, scene)| Variant { scene: Arc::new(scene), ..named(&name) })
                .collect(),
        }
    }
}

fn thread_count(threads: usize) -> String {
    if threads == 1 { "1 thread".to_string() } else { format!("{threads} threads") }
}

/// Returns the variants of an experiment that edits the scene, by name.
fn edited(experiment: Experiment, scene: &Scene) -> Vec<(String, Scene)> {
    let mut variants = Vec::new();
    let mut edit = |name: String, edit: &dyn Fn(&mut Scene)| {
        let mut scene = scene.clone();
        edit(&mut scene);
        variants.push((name, scene));
    };
    let trace = &scene.trace;
    let reflects = trace.ray_types == RayTypes::Full
        && trace.max_depth > 0
        && scene
            .objects
            .iter()
            .flat_map(|object| object.materials())
            .any(|name| scene.materials.get(name).is_some_and(|m| m.reflection > 0.0));
    match experiment {
        Experiment::Level => {
            for (name, level) in [("primary", RayTypes::Primary), ("shadows", RayTypes::Shadows)] {
                if level < trace.ray_types {
                    edit(name.to_string(), &|s| s.trace.ray_types = level);
                }
            }
        }
        Experiment::Acceleration => {
            for kind in Acceleration::ALL.into_iter().filter(|kind| *kind != trace.acceleration) {
                edit(kind.name().to_string(), &|s| s.trace.acceleration = kind);
            }
        }
        Experiment::Lobe if reflects => {
            for (from, to, name) in [
                (Lobe::Cone, Lobe::Square, "square for cone"),
                (Lobe::Square, Lobe::Cone, "cone for square"),
            ] {
                if scene.materials.values().any(|m| m.lobe == from && m.roughness > 0.0) {
                    edit(name.to_string(), &|s| {
                        let matching = s.materials.values_mut().filter(|m| m.lobe == from);
                        matching.for_each(|m| m.lobe = to);
                    });
                }
            }
        }
        Experiment::Depth if reflects => {
            for depth in [0, 1, 2, 4, 8].into_iter().filter(|depth| *depth < trace.max_depth) {
                edit(format!("depth {depth}"), &|s| s.trace.max_depth = depth);
            }
        }
        Experiment::MinWeight if reflects => {
            for weight in [0.001, 0.01, 0.1].into_iter().filter(|w| *w > trace.min_throughput) {
                edit(format!("weight {weight}"), &|s| s.trace.min_throughput = weight);
            }
        }
        Experiment::RaysPerPixel if reflects => {
            for cap in [64, 256, 1024] {
                edit(format!("{cap} samples"), &|s| s.film.rays_per_pixel = cap);
            }
        }
        Experiment::Lobe
        | Experiment::Depth
        | Experiment::MinWeight
        | Experiment::RaysPerPixel
        | Experiment::Default
        | Experiment::Adaptivity
        | Experiment::Precision
        | Experiment::Threads
        | Experiment::Sampler => {}
    }
    variants
}

#[cfg(test)]
mod tests {
    use super::*;
    use zerkalo_scene::Scene;

    fn names(experiment: Experiment, threads: usize) -> Vec<String> {
        let plan = Plan {
            targets: vec![0.5],
            experiments: vec![experiment],
            repetitions: 3,
            seconds: 1.0,
            threads,
            seed: 0,
            display: Display::default(),
        };
        let text = include_str!("../../scenes/mirror-room.toml");
        let all = plan.variants(&Arc::new(Scene::parse(text, "mirror-room.toml").unwrap()));
        assert_eq!((all[0].experiment, all[0].threads), (Experiment::Default, threads));
        all[1..].iter().map(|v| v.name.clone()).collect()
    }

    #[test]
    fn variants_differ_from_the_default() {
        assert_eq!(names(Experiment::Precision, 2), ["double"]);
        assert_eq!(names(Experiment::Threads, 1), [""; 0]);
        assert_eq!(names(Experiment::Threads, 2), ["1 thread"]);
        assert_eq!(names(Experiment::Threads, 6), ["1 thread", "2 threads", "4 threads"]);
        assert_eq!(names(Experiment::Adaptivity, 2), ["uniform"]);
        assert_eq!(Experiment::Threads.default_name(true, 6), "6 threads, default");
        assert_eq!(Experiment::Precision.default_name(true, 6), "single, default");
        assert_eq!(Experiment::Depth.default_name(true, 6), "default");
    }
}
