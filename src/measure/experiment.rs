//! What is measured: the settings that trade speed for accuracy, one at a time.

use crate::film::Display;
use crate::material::Lobe;
use crate::render::schedule::{Criterion, Settings, Stop};
use crate::render::{Options, SyncRender};
use crate::sampling::{SampleSettings, SamplerKind};
use crate::scene::{Acceleration, RayTypes, Scene};
use crate::world::{self, AnyWorld, Precision};
use std::io;
use std::str::FromStr;
use std::sync::Arc;

/// A setting.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Experiment {
    /// All settings as the program has them unless told otherwise.
    Default,
    /// Samples where they help most, or the same number everywhere.
    Adaptivity,
    /// Single or double precision.
    Precision,
    /// Threads that trace.
    Threads,
    /// Sobol's points or independent random numbers.
    Sampler,
    /// The cone or its cheap stand-in, the square.
    Lobe,
    /// What is traced at all.
    Level,
    /// The most reflections of a path.
    Depth,
    /// Paths end below a weight.
    MinWeight,
    /// The most samples of a glossy pixel.
    RaysPerPixel,
    /// How rays are kept from things that they cannot meet.
    Acceleration,
}

impl Experiment {
    /// Every setting, its name on the command line, and the question that it answers.
    pub const ALL: &'static [(Self, &'static str, &'static str)] = &[
        (Self::Default, "default", "As the program is set"),
        (Self::Adaptivity, "adaptivity", "What adaptive sampling gives"),
        (Self::Precision, "precision", "What double precision costs"),
        (Self::Threads, "threads", "How many threads pay"),
        (Self::Sampler, "sampler", "What Sobol's points give over independent random numbers"),
        (Self::Lobe, "lobe", "What the square gives over the cone, and gets wrong"),
        (Self::Level, "ray-types", "What less tracing gives, and gets wrong"),
        (Self::Depth, "max-depth", "What fewer reflections give, and get wrong"),
        (Self::MinWeight, "min-throughput", "What ending weak paths gives, and gets wrong"),
        (Self::RaysPerPixel, "rays-per-pixel", "What a cap on glossy pixels gives, and leaves"),
        (Self::Acceleration, "acceleration", "What boxes, rectangles and trees cost and save"),
    ];

    /// Its name on the command line.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(topic, ..)| *topic == self).map_or("", |(_, name, _)| name)
    }

    /// The question that it answers.
    pub fn question(self) -> &'static str {
        Self::ALL.iter().find(|(topic, ..)| *topic == self).map_or("", |(.., question)| question)
    }

    /// What the default is beside the variations: `adaptive, default`.
    pub fn of_default(self, single: bool, threads: usize) -> String {
        let own = match self {
            Self::Adaptivity => "adaptive".to_string(),
            Self::Precision => if single { "single" } else { "double" }.to_string(),
            Self::Threads if threads == 1 => "1 thread".to_string(),
            Self::Threads => format!("{threads} threads"),
            Self::Sampler => "Sobol".to_string(),
            _ => return "default".to_string(),
        };
        format!("{own}, default")
    }

    /// Whether all its variations have the same expectation: only their noise differs.
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
        // Names of earlier versions.
        let text = match text {
            "level" => "ray-types",
            "depth" => "max-depth",
            "min-weight" => "min-throughput",
            current => current,
        };
        let found = Self::ALL.iter().find(|(_, name, _)| *name == text);
        found.map(|(topic, ..)| *topic).ok_or_else(|| {
            let names: Vec<_> = Self::ALL.iter().map(|(_, name, _)| *name).collect();
            format!("setting `{text}` is not known; known: {}", names.join(", "))
        })
    }
}

/// One way to render the scene.
#[derive(Clone)]
pub struct Variant {
    /// Which setting differs from the default.
    pub topic: Experiment,
    /// How: `uniform`, `depth 4`.
    pub name: String,
    /// The scene, with the settings that it holds.
    pub scene: Arc<Scene>,
    /// How it is compiled and sampled.
    pub options: Options,
    /// Whether samples go where they help most.
    pub adaptive: bool,
    /// Threads that trace.
    pub threads: usize,
}

impl Variant {
    /// A render of it, not begun, that ends by itself only when there is nothing left to do.
    pub fn course(&self) -> io::Result<SyncRender> {
        let settings = Settings {
            adaptive: self.adaptive,
            criterion: Criterion::Codes,
            rays_per_pixel: 0,
            stop: Stop::default(),
        };
        SyncRender::new(&self.scene, &self.options, settings, self.threads)
    }
}

/// What to measure.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Noise to reach, in codes, falling.
    pub targets: Vec<f64>,
    /// The settings to compare, beside the default.
    pub topics: Vec<Experiment>,
    /// How often each way is timed, at least.
    pub repetitions: usize,
    /// About so many seconds in all.
    pub seconds: f64,
    /// Threads, unless they are what is compared.
    pub threads: usize,
    /// Number that the random choices follow from. The reference has another one.
    pub seed: u64,
    /// Exposure and tone curve that codes are told in.
    pub display: Display,
}

impl Plan {
    /// The default, then the variations of each topic that make a difference in this scene.
    pub fn variations(&self, scene: &Arc<Scene>) -> Vec<Variant> {
        let mut all = vec![self.default_of(scene)];
        for topic in &self.topics {
            all.extend(self.of_topic(*topic, scene));
        }
        all
    }

    /// All settings as the program has them.
    pub fn default_of(&self, scene: &Arc<Scene>) -> Variant {
        Variant {
            topic: Experiment::Default,
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

    fn of_topic(&self, topic: Experiment, scene: &Arc<Scene>) -> Vec<Variant> {
        let base = self.default_of(scene);
        let named = |name: &str| Variant { topic, name: name.to_string(), ..base.clone() };
        let edited = |name: String, edit: &dyn Fn(&mut Scene)| {
            let mut scene = Scene::clone(scene);
            edit(&mut scene);
            Variant { topic, name, scene: Arc::new(scene), ..base.clone() }
        };
        let reflects = scene.trace.ray_types == RayTypes::Full
            && scene.trace.max_depth > 0
            && scene
                .objects
                .iter()
                .flat_map(|object| object.materials())
                .any(|name| scene.materials.get(name).is_some_and(|m| m.reflection > 0.0));
        match topic {
            Experiment::Default => Vec::new(),
            Experiment::Adaptivity => vec![Variant { adaptive: false, ..named("uniform") }],
            Experiment::Precision => {
                // The other one than the scene asks for.
                let (name, precision) = match AnyWorld::compile(scene, &base.options.world) {
                    AnyWorld::Single(_) => ("double", Precision::Double),
                    AnyWorld::Double(_) => ("single", Precision::Single),
                };
                let mut variation = named(name);
                variation.options.world.precision = precision;
                vec![variation]
            }
            Experiment::Threads => {
                // As many as there are is the default.
                let counts = (0..).map(|k| 1 << k).take_while(|n| *n < self.threads);
                let of = |n: usize| {
                    let name = if n == 1 { "1 thread".to_string() } else { format!("{n} threads") };
                    Variant { threads: n, ..named(&name) }
                };
                counts.map(of).collect()
            }
            Experiment::Sampler => {
                let mut random = named("random");
                random.options.sampling.kind = SamplerKind::Random;
                vec![random]
            }
            Experiment::Lobe => {
                let has =
                    |lobe| scene.materials.values().any(|m| m.lobe == lobe && m.roughness > 0.0);
                let swap = |from: Lobe, to: Lobe, name: &str| {
                    has(from).then(|| {
                        edited(name.to_string(), &|scene| {
                            let of = scene.materials.values_mut().filter(|m| m.lobe == from);
                            of.for_each(|m| m.lobe = to);
                        })
                    })
                };
                let square = swap(Lobe::Cone, Lobe::Square, "square for cone");
                let cone = swap(Lobe::Square, Lobe::Cone, "cone for square");
                square.into_iter().chain(cone).filter(|_| reflects).collect()
            }
            Experiment::Level => [("primary", RayTypes::Primary), ("shadows", RayTypes::Shadows)]
                .into_iter()
                .filter(|(_, level)| *level < scene.trace.ray_types)
                .map(|(name, level)| edited(name.to_string(), &|s| s.trace.ray_types = level))
                .collect(),
            Experiment::Depth => [0, 1, 2, 4, 8]
                .into_iter()
                .filter(|depth| reflects && *depth < scene.trace.max_depth)
                .map(|depth| edited(format!("depth {depth}"), &|s| s.trace.max_depth = depth))
                .collect(),
            Experiment::MinWeight => [0.001, 0.01, 0.1]
                .into_iter()
                .filter(|weight| reflects && *weight > scene.trace.min_throughput)
                .map(|weight| {
                    edited(format!("weight {weight}"), &|s| s.trace.min_throughput = weight)
                })
                .collect(),
            Experiment::RaysPerPixel => [64, 256, 1024]
                .into_iter()
                .filter(|_| reflects)
                .map(|cap| edited(format!("{cap} samples"), &|s| s.film.rays_per_pixel = cap))
                .collect(),
            Experiment::Acceleration => Acceleration::ALL
                .into_iter()
                .filter(|by| *by != scene.trace.acceleration)
                .map(|by| edited(by.name().to_string(), &|s| s.trace.acceleration = by))
                .collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::built_in;

    fn names(topic: Experiment, threads: usize) -> Vec<String> {
        let plan = Plan {
            targets: vec![0.5],
            topics: vec![topic],
            repetitions: 3,
            seconds: 1.0,
            threads,
            seed: 0,
            display: Display::default(),
        };
        let all = plan.variations(&Arc::new(built_in()));
        assert_eq!((all[0].topic, all[0].threads), (Experiment::Default, threads));
        all[1..].iter().map(|v| v.name.clone()).collect()
    }

    /// What would be the default again is left out.
    #[test]
    fn variations_differ_from_the_default() {
        assert_eq!(names(Experiment::Precision, 2), ["double"]);
        assert_eq!(names(Experiment::Threads, 1), [""; 0]);
        assert_eq!(names(Experiment::Threads, 2), ["1 thread"]);
        assert_eq!(names(Experiment::Threads, 6), ["1 thread", "2 threads", "4 threads"]);
        assert_eq!(names(Experiment::Adaptivity, 2), ["uniform"]);
        assert_eq!(Experiment::Threads.of_default(true, 6), "6 threads, default");
        assert_eq!(Experiment::Precision.of_default(true, 6), "single, default");
        assert_eq!(Experiment::Depth.of_default(true, 6), "default");
    }
}
