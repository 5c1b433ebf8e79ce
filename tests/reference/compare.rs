//! Statistical comparison of two pictures of a scene: one by the program, one by the reference
//! tracer.

use crate::harness::*;
use crate::reference::tracer::{Estimate, Mutation, Tracer};
use rayon::prelude::*;
use std::fmt;
use std::sync::{OnceLock, PoisonError};

/// Width and height of the compared pictures.
pub const SIZE: [u32; 2] = [32, 24];
/// Samples per pixel of the reference tracer.
pub const REFERENCE_SAMPLES: u32 = 96;
/// Samples per pixel and replicate of the program.
pub const SAMPLES: u32 = 128;
/// Side in pixels of the blocks whose means are compared.
const BLOCK: usize = 4;
/// Probability that any of the comparisons of one scene gives a false alarm. With a hundred scenes,
/// the probability of any false alarm is 1 / 1000.
const LEVEL: f64 = 1e-3 / 100.0;

/// Difference between two pictures of a scene, and the largest difference that chance explains.
#[derive(Debug)]
pub struct Difference {
    /// Largest difference between the means of a block in both pictures, in standard errors.
    pub worst_z: f64,
    pub allowed_z: f64,
    /// Chi-square: each block's difference in brightness, in standard errors, squared and summed
    /// over all blocks.
    pub chi2: f64,
    pub allowed_chi2: f64,
    pub picture: Vec<DVec3>,
    pub reference: Vec<DVec3>,
}

impl Difference {
    pub fn agree(&self) -> bool {
        self.worst_z <= self.allowed_z && self.chi2 <= self.allowed_chi2
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { worst_z, allowed_z, chi2, allowed_chi2, .. } = self;
        write!(f, "z {worst_z:.2} of {allowed_z:.2}, chi2 {chi2:.0} of {allowed_chi2:.0}")
    }
}

/// Cache that maps inputs to results. Tests that compare the same pictures share one cache.
pub struct Memo<K, V>(Mutex<Vec<(K, Slot<V>)>>);

/// Cached result, which is computed when a test first asks for it.
type Slot<V> = Arc<OnceLock<V>>;

impl<K: PartialEq, V: Clone> Memo<K, V> {
    pub const fn new() -> Self {
        Self(Mutex::new(Vec::new()))
    }

    pub fn get(&self, key: K, compute: impl FnOnce() -> V) -> V {
        let slot = {
            // A test that fails while it holds the lock leaves the table valid.
            let mut slots = self.0.lock().unwrap_or_else(PoisonError::into_inner);
            match slots.iter().find(|(known, _)| *known == key) {
                Some((_, slot)) => slot.clone(),
                None => {
                    slots.push((key, Slot::default()));
                    slots[slots.len() - 1].1.clone()
                }
            }
        };
        slot.get_or_init(compute).clone()
    }
}

/// Picture rendered by the program, with estimates of its noise.
pub struct Picture {
    size: [u32; 2],
    mean: Vec<DVec3>,
    /// Estimate of the noise of `mean`: half the difference of the two replicates of each pixel.
    half: Vec<DVec3>,
    /// Estimate of the noise of a second picture, which is rendered with independent random
    /// numbers: half the difference of its two replicates at each pixel.
    random: Vec<DVec3>,
    samples: u32,
}

impl Picture {
    pub fn new(scene: &Scene, samples: u32) -> Arc<Self> {
        static PICTURES: Memo<(Scene, u32), Arc<Picture>> = Memo::new();
        PICTURES.get((scene.clone(), samples), || {
            let (mean, half) = replicates(scene, samples, SamplerKind::Sobol);
            let (_, random) = replicates(scene, samples, SamplerKind::Random);
            Arc::new(Self { size: scene.film.size, mean, half, random, samples })
        })
    }

    /// Compares the block means of this picture with those of `reference`, a far noisier picture
    /// with `samples` samples per pixel. The variance of single samples in the reference is
    /// estimated twice: from the reference, and from the program's picture with independent random
    /// numbers. The larger estimate is used, because few samples underestimate the variance of rare
    /// events.
    pub fn beside(&self, reference: &[Estimate], samples: u32) -> Difference {
        let (mut worst_z, mut chi2, mut count) = (0f64, 0.0, 0.0);
        let per_reference = 2.0 * f64::from(self.samples) / f64::from(samples);
        let blocks = blocks(self.size);
        for pixels in &blocks {
            let n = pixels.len() as f64;
            let sum =
                |value: &dyn Fn(usize) -> DVec3| pixels.iter().map(|p| value(*p)).sum::<DVec3>();
            let difference = sum(&|p| self.mean[p] - reference[p].mean) / n;
            let reference_variance = sum(&|p| reference[p].variance);
            let random_variance = sum(&|p| self.random[p] * self.random[p]) * per_reference;
            let picture_variance = sum(&|p| self.half[p] * self.half[p]);
            // Allowance for rounding errors: those of the film, and those of formulas that differ
            // between the two programs.
            let floor = 1e-7 * (sum(&|p| reference[p].mean).abs() / n + 1e-3);
            let variance = (reference_variance.max(random_variance) + picture_variance) / (n * n)
                + floor * floor;
            let z = difference.abs() / variance.map(f64::sqrt);
            worst_z = worst_z.max(z.max_element());
            // The sum of the channels is compared separately, because the channels of a block are
            // correlated.
            let z = difference.element_sum() / variance.map(f64::sqrt).element_sum();
            chi2 += z * z;
            count += 1.0;
        }
        let allowed_z = two_sided_z(1.0 - (1.0 - LEVEL).powf(1.0 / (3.0 * count)));
        Difference {
            worst_z,
            allowed_z,
            chi2,
            allowed_chi2: chi2_quantile(count, two_sided_z(2.0 * LEVEL)),
            picture: self.mean.clone(),
            reference: reference.iter().map(|e| e.mean).collect(),
        }
    }
}

/// Returns a quantile of the chi-square distribution with `n` degrees of freedom. `z` is the normal
/// quantile of the same probability (Wilson and Hilferty 1931).
fn chi2_quantile(n: f64, z: f64) -> f64 {
    n * (1.0 - 2.0 / (9.0 * n) + z * (2.0 / (9.0 * n)).sqrt()).powi(3)
}

/// Compares the program's picture of `tested` statistically with the reference tracer's picture of
/// `original`, which has `samples` samples per pixel. A scene other than the original deviates by
/// many standard errors; half of the samples show it.
pub fn agrees(original: &Scene, tested: &Scene, samples: u32) -> Verdict {
    let reference = reference(&small(original.clone()), samples, Mutation::None);
    let reference = reference.expect("the reference tracer supports the scene");
    let of_picture = if tested == original { SAMPLES } else { SAMPLES / 2 };
    let verdict = Picture::new(&small(tested.clone()), of_picture).beside(&reference, samples);
    ensure(verdict.agree(), || verdict.to_string())
}

/// Returns `scene` with the picture size of the comparison, [`SIZE`].
pub fn small(scene: Scene) -> Scene {
    sized(scene, SIZE)
}

/// Returns `scene` with its camera directed at `point` and with a vertical view angle of `degrees`.
/// If the camera has a focus point, the plane in focus still contains the focus point.
pub fn zoomed(scene: &Scene, point: [f64; 3], degrees: f64) -> Scene {
    let mut scene = scene.clone();
    scene.camera.target = Some(point);
    scene.camera.view_angle = ViewAngle::Vertical(degrees);
    scene
}

/// Picture by the reference tracer, or the name of a feature that it does not support.
pub type Reference = Result<Arc<Vec<Estimate>>, String>;

/// Renders `scene` with the reference tracer. `mutation` is a deliberate error of the tracer.
///
/// # Errors
///
/// Names a feature of the scene that the reference tracer does not support.
pub fn reference(scene: &Scene, samples: u32, mutation: Mutation) -> Reference {
    static REFERENCES: Memo<(Scene, u32, Mutation), Reference> = Memo::new();
    let key = (scene.clone(), samples, mutation);
    REFERENCES.get(key, || traced(scene, samples, mutation).map(Arc::new))
}

fn traced(scene: &Scene, samples: u32, mutation: Mutation) -> Result<Vec<Estimate>, String> {
    let tracer = Tracer::new(scene, mutation)?;
    let [width, height] = scene.film.size;
    let row = |y: u32| {
        let mut numbers = Numbers::new(u64::from(y) + 1);
        (0..width).map(|x| tracer.pixel(x, y, samples, &mut numbers)).collect::<Vec<_>>()
    };
    let rows: Vec<Vec<Estimate>> = (0..height).into_par_iter().map(row).collect();
    Ok(rows.concat())
}

/// Renders `scene` with the program, with `samples` samples per pixel in each replicate. Returns
/// the picture, and half the difference of the replicates.
pub fn replicates(scene: &Scene, samples: u32, kind: SamplerKind) -> (Vec<DVec3>, Vec<DVec3>) {
    let mut rendering = begin_with(scene, SampleSettings { seed: 1, kind }, Precision::Double);
    uniform(&mut rendering, 0, samples, &pool(2));
    let part = |part| picture(&rendering, part).into_iter().map(DVec3::from).collect::<Vec<_>>();
    let (a, b) = (part(Replicates::A), part(Replicates::B));
    let mean = a.iter().zip(&b).map(|(a, b)| 0.5 * (*a + *b)).collect();
    (mean, a.iter().zip(&b).map(|(a, b)| 0.5 * (*a - *b)).collect())
}

/// Returns the pixel indices of each block whose mean is compared.
fn blocks([width, height]: [u32; 2]) -> Vec<Vec<usize>> {
    let [width, height] = [width as usize, height as usize];
    let block = |x0: usize, y0: usize| {
        let ys = y0..(y0 + BLOCK).min(height);
        ys.flat_map(|y| (x0..(x0 + BLOCK).min(width)).map(move |x| y * width + x)).collect()
    };
    let corners = (0..height).step_by(BLOCK);
    corners.flat_map(|y| (0..width).step_by(BLOCK).map(move |x| block(x, y))).collect()
}

/// Compares the variance of single samples in two pictures of a scene. The picture `reference` by
/// the reference tracer has `reference_samples` samples per pixel. This program's picture is given
/// by `half`, half the difference of its two replicates, which have `samples` samples per pixel
/// each. Returns the magnitude of the difference of the variances, averaged over blocks, in
/// standard errors.
pub fn variances_differ_by(
    reference: &[Estimate],
    reference_samples: u32,
    half: &[DVec3],
    samples: u32,
    size: [u32; 2],
) -> f64 {
    let differences: Vec<f64> = blocks(size)
        .iter()
        .map(|pixels| {
            let reference_variance =
                pixels.iter().map(|p| reference[*p].variance.element_sum()).sum::<f64>();
            let squares = pixels.iter().map(|p| half[*p].length_squared()).sum::<f64>();
            // Half the difference of two means of n samples has the variance of a mean of 2 n
            // samples.
            squares * 2.0 * f64::from(samples) - reference_variance * f64::from(reference_samples)
        })
        .collect();
    let n = differences.len() as f64;
    let mean = differences.iter().sum::<f64>() / n;
    let spread = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0);
    mean.abs() / (spread / n).sqrt()
}

/// Writes the program's picture, the picture of the reference tracer, and their difference to
/// files. Returns the folder of the files.
pub fn keep(name: &str, verdict: &Difference) -> PathBuf {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("agreement");
    std::fs::create_dir_all(&folder).unwrap();
    let difference: Vec<DVec3> = verdict
        .picture
        .iter()
        .zip(&verdict.reference)
        .map(|(a, b)| (*a - *b).abs() * 10.0)
        .collect();
    let three = [
        ("picture", &verdict.picture),
        ("reference", &verdict.reference),
        ("difference", &difference),
    ];
    for (what, pixels) in three {
        // Portable float map: text header, then rows from the bottom up.
        let [width, height] = SIZE.map(|n| n as usize);
        let mut bytes = format!("PF\n{width} {height}\n-1.0\n").into_bytes();
        for row in pixels.chunks(width).rev() {
            for c in row.iter().flat_map(|p| p.to_array()) {
                bytes.extend((c as f32).to_le_bytes());
            }
        }
        std::fs::write(folder.join(format!("{name}-{what}.pfm")), bytes).unwrap();
    }
    folder
}
