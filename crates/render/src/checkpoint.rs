//! Checkpoints: film files from which a later process continues a render. The continued render
//! gives, bit for bit, the film of a render without interruption.
//!
//! A checkpoint has three chunks in addition to those of a film file. `SCEN` has the scene for
//! which the samples were traced, and the other inputs of samples. `SCHD` has the state of the
//! schedule. `TIME` has the seconds of rendering so far (f64). It is a chunk of its own, because
//! equal renders take different times, but have equal `SCHD` chunks.

use crate::export::{Provenance, film_header};
use crate::file_error::FileError;
use crate::film::Film;
use crate::film::file::{EncodedFilm, Fields, FilmFileHeader, FilmReader, SavedFilm, Tag, text};
use crate::schedule::{Schedule, Settings};
use crate::session::Report;
use crate::{Options, RenderState};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use zerkalo_kernel::sampling::{SampleSettings, SamplerKind};
use zerkalo_scene::Scene;
use zerkalo_world::{self as world, AnyWorld, Precision};

const SCENE: Tag = *b"SCEN";
const SCHEDULE: Tag = *b"SCHD";
const CLOCK: Tag = *b"TIME";

/// Version of this program. Another version may trace different samples.
const PROGRAM: &str = env!("CARGO_PKG_VERSION");

/// Inputs on which a film's samples depend, except those in the film's header (size, seed,
/// precision).
///
/// Encoding: hash of the contents of meshes and images (u64, 0 for none), then three texts, each
/// preceded by its length (u32): the program's version, the sampler's name, the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct SampleInputs {
    /// Value of [`Scene::contents_hash`].
    pub contents_hash: Option<u64>,
    /// Version of the program that traced the samples.
    pub program: String,
    /// Value of [`SamplerKind::name`].
    pub sampler: String,
    /// Scene as text of a scene file.
    pub scene: String,
}

impl SampleInputs {
    /// Creates the inputs of the samples that this program traces for `scene`.
    pub fn new(scene: &Scene, sampler: SamplerKind) -> Self {
        Self {
            contents_hash: scene.contents_hash(),
            program: PROGRAM.to_string(),
            sampler: sampler.name().to_string(),
            scene: scene.to_text(),
        }
    }

    /// Encodes the inputs as a chunk of a film file.
    pub fn encode(&self) -> (Tag, Vec<u8>) {
        let mut out = self.contents_hash.unwrap_or(0).to_le_bytes().to_vec();
        [&self.program, &self.sampler, &self.scene].into_iter().for_each(|t| text(t, &mut out));
        (SCENE, out)
    }

    /// Returns `true` if samples with these inputs are valid for `scene`, as
    /// [`LightGroups::can_reuse`](world::LightGroups::can_reuse) decides.
    pub fn fit(&self, scene: &Scene) -> bool {
        let resolver = scene.resolver.clone();
        let Ok(compiled) = Scene::parse_in(&self.scene, "checkpoint", resolver) else {
            return false;
        };
        self.contents_hash == compiled.contents_hash()
            && AnyWorld::compile(&compiled, &world::Options::default())
                .info()
                .groups
                .can_reuse(&compiled, scene)
    }

    /// Reads the inputs from the header of a film file. Returns `None` if the header has no inputs
    /// or damaged ones.
    pub fn of(header: &FilmFileHeader) -> Option<Self> {
        let mut fields = Fields::new(header.chunks.get(&SCENE)?);
        let hash = fields.u64()?;
        let [program, sampler, scene] = [fields.text()?, fields.text()?, fields.text()?];
        let contents_hash = (hash != 0).then_some(hash);
        fields.is_empty().then_some(Self { contents_hash, program, sampler, scene })
    }
}

/// Encodes a render as a checkpoint on the threads of `pool`. `report` is its latest report.
pub(super) fn encode(
    state: &RenderState,
    schedule: &Schedule,
    report: &Report,
    provenance: &Provenance,
    pool: &rayon::ThreadPool,
) -> EncodedFilm {
    let mut header = film_header(state, report, provenance);
    header.chunks.extend([
        SampleInputs::new(&state.lighting.compiled, provenance.sampler).encode(),
        (SCHEDULE, schedule.encode()),
        (CLOCK, report.seconds.to_le_bytes().to_vec()),
    ]);
    EncodedFilm::new(&header, &state.film, Some(pool))
}

/// Checkpoint that was read from a file.
#[derive(Debug)]
pub struct Checkpoint {
    path: PathBuf,
    /// Contents of the checkpoint's file except for the film.
    pub header: FilmFileHeader,
    pub inputs: SampleInputs,
    film: Film,
}

impl Checkpoint {
    /// Reads the checkpoint at `path`. Fails if the file cannot be read, is no checkpoint, or is
    /// damaged.
    pub fn read(path: &Path) -> Result<Self, FileError> {
        let SavedFilm { header, film } = FilmReader::open(path)?.read()?;
        let inputs = SampleInputs::of(&header).filter(|_| header.chunks.contains_key(&SCHEDULE));
        let Some(inputs) = inputs else {
            let what = "it is a film without the state of a render";
            let remedy = "name a file that `zerkalo render --checkpoint` has written";
            return Err(FileError::new(path, what, remedy));
        };
        Ok(Self { path: path.to_path_buf(), header, inputs, film })
    }

    /// Returns the random seed and the kind of random numbers of the samples.
    pub fn sampling(&self) -> SampleSettings {
        let kind = SamplerKind::from_name(&self.inputs.sampler).unwrap_or(SamplerKind::Sobol);
        SampleSettings { seed: self.header.film.seed, kind }
    }

    /// Compiles the checkpoint's scene, restores the render, and changes its lights to those of
    /// `scene`. The restored noise estimates are for the light weights and display transform of the
    /// checkpoint. Fails if the samples are not valid for `scene` and `options`.
    pub(super) fn resume(
        self,
        scene: &Arc<Scene>,
        options: &Options,
        settings: Settings,
    ) -> Result<(RenderState, Schedule), FileError> {
        self.check_options(scene, options)?;
        let foreign = "name the scene and its files as they were, or render without --resume";
        let same = scene.to_text() == self.inputs.scene;
        let compiled = if same {
            Arc::clone(scene)
        } else {
            let read = Scene::parse_in(&self.inputs.scene, "checkpoint", scene.resolver.clone());
            Arc::new(
                read.map_err(|e| self.error(format!("its scene cannot be used: {e}"), foreign))?,
            )
        };
        if compiled.contents_hash() != self.inputs.contents_hash {
            let what = "the meshes or images of the scene have other contents now";
            return Err(self.error(what, foreign));
        }
        let mut options = options.clone();
        // A render that has changed to double precision stays in it.
        if options.world.precision == Precision::Auto {
            options.world.precision = self.header.film.precision;
        }
        let mut state = RenderState::new(&compiled, &options, None)
            .map_err(|fault| self.error(fault, "correct the scene"))?;
        let (ours, theirs) = (&state.film.header, &self.header.film);
        if ours.precision != theirs.precision {
            let [ours, theirs] = [ours, theirs].map(|header| header.precision.name());
            let what = format!("its precision is {theirs}, not {ours}");
            return Err(self.error(what, &format!("add --precision {theirs}")));
        }
        state.film.check_header(theirs).map_err(|what| self.error(what, foreign))?;
        if !same && !state.try_reuse(scene) {
            let what = "it is of another scene, which differs in more than its lights";
            return Err(self.error(what, foreign));
        }
        let encoded = self.header.chunks.get(&SCHEDULE).map_or(&[][..], Vec::as_slice);
        let counts: Vec<_> = (0..self.film.tile_count()).map(|i| self.film.counts(i)).collect();
        let mut schedule = state.schedule(settings);
        schedule.restore(encoded, &counts).ok_or_else(|| {
            let what = "the state of its schedule does not belong to its samples";
            self.error(what, "copy it again, or use an older one")
        })?;
        state.film = self.film;
        Ok((state, schedule))
    }

    /// Checks that size, seed, sampler and program version are those of the checkpoint.
    fn check_options(&self, scene: &Scene, options: &Options) -> Result<(), FileError> {
        let film = &self.header.film;
        let [width, height] = scene.film.size.map(|n| n as usize);
        let size = format!("{}x{}", film.width, film.height);
        let sampler = options.sampling.kind.name();
        let comparisons = [
            ("size", size, format!("{width}x{height}"), "--size"),
            ("seed", film.seed.to_string(), options.sampling.seed.to_string(), "--seed"),
            ("sampler", self.inputs.sampler.clone(), sampler.to_string(), "--sampler"),
        ];
        for (name, theirs, ours, option) in comparisons {
            if theirs != ours {
                let what = format!("its {name} is {theirs}, not {ours}");
                return Err(self.error(what, &format!("add {option} {theirs}")));
            }
        }
        if self.inputs.program != PROGRAM {
            let program = &self.inputs.program;
            let what = format!("zerkalo {program} wrote it, and this is {PROGRAM}");
            let remedy = format!("use zerkalo {program}, whose samples may differ");
            return Err(self.error(what, &remedy));
        }
        Ok(())
    }

    fn error(&self, what: impl Into<String>, remedy: &str) -> FileError {
        FileError::new(&self.path, what, remedy)
    }
}

/// Returns the seconds of rendering in a film file, over all runs of the program; 0 if they are
/// missing or invalid.
pub(super) fn seconds_of(header: &FilmFileHeader) -> f64 {
    let seconds = header.chunks.get(&CLOCK).and_then(|clock| Fields::new(clock).f64());
    seconds.filter(|seconds| *seconds >= 0.0 && seconds.is_finite()).unwrap_or(0.0)
}
