//! Error probe: traces a small part of the samples again, with the same random numbers, in double
//! precision and with longer paths. The differences are the errors of rounding and of cut paths.
//!
//! A packet of the probe has one pixel in each row of a tile, and one sample of each replicate in
//! each pixel. The tiles are spread evenly over the picture. Let a and b be the differences of the
//! samples of A and B. These are independent, so that the mean of a b is an unbiased estimate of
//! the squared systematic difference of a pixel, and that of (a - b)^2 / 2 one of the variance of a
//! sample's difference, which n samples divide by n. [`PairedDifference`] sums both over the
//! pixels. Differences are converted to levels by the slope of the display's secant from the pixel
//! of the film to the pixel without the error.
//!
//! Paths are traced to the limits of the scene, to two times and to four times these limits. If
//! the second doubling adds the share q of what the first has added, all further ones together add
//! q / (1 - q) of what the second has added: exact where path lengths follow a power law, too much
//! where they fall exponentially. There is no bound if q is above [`LARGEST_RATIO`].

use crate::RenderState;
use crate::film::{Display, Film, LightWeights, Replicates, TILE};
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use zerkalo_kernel::lanes::{Double, Float, SimdFloat};
use zerkalo_scene::value::Fnv1a64;
use zerkalo_world::{self as world, AnyWorld, CameraTracer, Precision, Radiance, World};

/// Largest ratio of two doublings at which the sum of all further ones has a bound.
const LARGEST_RATIO: f64 = 0.7;
/// Cost of a ray in double precision, relative to one in single precision.
const DOUBLE_COST: u64 = 2;

/// Largest radiance of a sample, far beyond white.
const BRIGHTEST: f64 = 1e30;

/// Differences between the pixels of two pictures with the same random numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PairedDifference {
    /// Sum of a b, in squared levels.
    pub product: f64,
    /// Sum of (a b)^2.
    pub product_squares: f64,
    /// Sum of (a - b)^2 / 2.
    pub variance: f64,
    /// Sum of (a + b) / 2.
    pub mean: f64,
}

impl PairedDifference {
    fn add(&mut self, other: Self) {
        self.product += other.product;
        self.product_squares += other.product_squares;
        self.variance += other.variance;
        self.mean += other.mean;
    }

    /// Returns the mean of a b over `pixels` pixels, and its standard error.
    fn systematic(&self, pixels: f64) -> (f64, f64) {
        let mean = self.product / pixels;
        (mean, (self.product_squares / pixels - mean * mean).max(0.0).sqrt() / pixels.sqrt())
    }
}

/// Results of a probe, summed over its pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ProbeSums {
    /// Number of packets that were traced.
    pub packets: u32,
    pub pixels: u32,
    /// Number of rays, those in double precision counted twice.
    pub cost: u64,
    pub rounding: PairedDifference,
    /// Light that four times longer paths add.
    pub cut: PairedDifference,
    /// Sums of the light that the first and the second doubling of the limits add.
    pub doublings: [f64; 2],
}

impl ProbeSums {
    pub fn add(&mut self, other: &Self) {
        self.packets += other.packets;
        self.pixels += other.pixels;
        self.cost += other.cost;
        self.rounding.add(other.rounding);
        self.cut.add(other.cut);
        (0..2).for_each(|i| self.doublings[i] += other.doublings[i]);
    }

    /// Returns the RMSE of rounding in a picture of `spp` samples per pixel. `None` before the
    /// first probe.
    pub fn rounding(&self, spp: f64) -> Option<f64> {
        let random = self.rounding.variance / f64::from(self.pixels) / spp.max(1.0);
        let systematic = self.systematic_rounding().unwrap_or(0.0);
        (self.pixels > 0).then(|| systematic.hypot(random.sqrt()))
    }

    /// Returns the RMSE of rounding that remains with any number of samples, if it is significant.
    pub fn systematic_rounding(&self) -> Option<f64> {
        let (square, standard_error) = self.rounding.systematic(f64::from(self.pixels));
        (square > 2.0 * standard_error).then(|| square.sqrt())
    }

    /// Returns an upper limit of the RMSE of cut paths in a picture of `spp` samples per pixel, four
    /// standard errors above the estimate; infinite without a bound. `None` before the first probe.
    pub fn cut_paths(&self, spp: f64) -> Option<f64> {
        if self.pixels == 0 {
            return None;
        }
        let [first, second] = self.doublings.map(f64::abs);
        if second == 0.0 && first == 0.0 {
            return Some(0.0);
        }
        if second > LARGEST_RATIO * first {
            return Some(f64::INFINITY);
        }
        let rest = second * second / (first - second) / (first + second);
        let pixels = f64::from(self.pixels);
        let (square, standard_error) = self.cut.systematic(pixels);
        let random = self.cut.variance / pixels / spp.max(1.0);
        Some((square.max(0.0) + 4.0 * standard_error + random).sqrt() * (1.0 + rest))
    }
}

/// Scene compiled for the probe.
pub struct ErrorProbe {
    world: World<Double>,
    pub compile_seconds: f64,
    pub seconds: f64,
}

/// Radiance of one pixel's samples in A and B.
type Pair = [[f64; 3]; 2];

/// Pixels of a tile that a packet probes.
struct Packet {
    tile: usize,
    /// Upper left corner of the tile in the picture.
    origin: [usize; 2],
    extent: [usize; 2],
    /// Columns and rows in the picture.
    pixels: Vec<(u32, u32)>,
}

impl Packet {
    /// Creates packet `number` of `film`; `None` if its tile has no samples.
    fn new(film: &Film, number: u32) -> Option<Self> {
        // Multiples of the golden ratio are spread evenly, however many there are.
        let place = (f64::from(number) * 0.618_033_988_749_894_9).fract();
        let tile = (place * film.tile_count() as f64) as usize;
        let extent = film.tile(tile)?.extent;
        let origin = [tile % film.tile_columns() * TILE, tile / film.tile_columns() * TILE];
        let pixel = |row: usize| {
            let mut hash = Fnv1a64::default();
            hash.update(&number.to_le_bytes());
            hash.update(&row.to_le_bytes());
            let column = (hash.value() >> 32) as usize % extent[0];
            ((origin[0] + column) as u32, (origin[1] + row) as u32)
        };
        let pixels = (0..extent[1]).map(pixel).collect();
        Some(Self { tile, origin, extent, pixels })
    }

    /// Traces the first sample of each replicate in each pixel. Returns the number of rays as well.
    fn trace<L: SimdFloat>(
        &self,
        tracer: &CameraTracer<L>,
        weights: &LightWeights,
    ) -> (Vec<Pair>, u64) {
        let (mut pairs, mut rays) = (vec![Pair::default(); self.pixels.len()], 0);
        let Some(culled) = tracer.tile(self.origin, self.extent) else { return (pairs, rays) };
        for replicate in [0, 1] {
            let mut tile = tracer.pixels(&culled, replicate, self.pixels.iter().copied());
            tile.radiance_shared::<1>(0, |packet, radiance| {
                for (lane, pixel) in packet.enumerate() {
                    pairs[pixel][replicate] = radiance_of(radiance, lane, weights);
                }
            });
            rays += tile.counts().rays;
        }
        (pairs, rays)
    }
}

/// Returns the radiance of a sample under `weights`; black in invalid channels.
pub(crate) fn radiance_of<L: SimdFloat>(
    radiance: &Radiance<L>,
    lane: usize,
    weights: &LightWeights,
) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (weight, group) in weights.weights.iter().zip(&radiance.groups) {
        let value = group.lane(lane);
        (0..3).for_each(|c| sum[c] += weight[c] * value[c].to_f64());
    }
    sum.map(|c| if c >= 0.0 { c.min(BRIGHTEST) } else { 0.0 })
}

/// Returns the differences of the samples `from` and `to` of a pixel with the radiance `mean` of
/// `spp` samples.
fn difference(
    (from, to): (&Pair, &Pair),
    (mean, spp): ([f64; 3], f64),
    display: &Display,
) -> PairedDifference {
    let mut out = PairedDifference::default();
    let [a, b] = [0, 1].map(|r| [0, 1, 2].map(|c| to[r][c] - from[r][c]));
    if [a, b] == [[0.0; 3]; 2] {
        return out;
    }
    let half = [0, 1, 2].map(|c| 0.5 * (a[c] + b[c]));
    let levels =
        |share: f64| display.levels([0, 1, 2].map(|c| (mean[c] + share * half[c]).max(0.0)));
    let share = 2.0 / spp.max(2.0);
    let (start, end, near) = (levels(0.0), levels(1.0), levels(share));
    for c in 0..3 {
        if half[c] != 0.0 {
            let slope = (end[c] - start[c]) / half[c];
            let slope_near = (near[c] - start[c]) / (share * half[c]);
            out.product += a[c] * b[c] * slope * slope / 3.0;
            out.variance += (a[c] - b[c]).powi(2) / 2.0 * slope_near * slope_near / 3.0;
            out.mean += (end[c] - start[c]) / 3.0;
        }
    }
    out.product_squares = out.product * out.product;
    out
}

impl RenderState {
    /// Traces the packets `packets` of the probe. Returns `None` if `cancel` becomes `true` before
    /// the end.
    pub fn probe_errors(
        &mut self,
        packets: Range<u32>,
        pool: &rayon::ThreadPool,
        cancel: &AtomicBool,
    ) -> Option<ProbeSums> {
        let started = Instant::now();
        let mut probe = self.probe.take().unwrap_or_else(|| {
            let precision = Precision::Double;
            let options = world::Options { precision, merge_lights: self.merge_lights };
            let AnyWorld::Double(world) = AnyWorld::compile(&self.lighting.compiled, &options)
            else {
                unreachable!("the precision is double")
            };
            let compile_seconds = started.elapsed().as_secs_f64();
            Box::new(ErrorProbe { world, compile_seconds, seconds: -compile_seconds })
        });
        let sums = pool.install(|| self.trace_probe(&mut probe, packets, cancel));
        probe.seconds += started.elapsed().as_secs_f64();
        self.probe = Some(probe);
        sums
    }

    fn trace_probe(
        &self,
        probe: &mut ErrorProbe,
        packets: Range<u32>,
        cancel: &AtomicBool,
    ) -> Option<ProbeSums> {
        let (film, sampling) = (&self.film, self.sampling());
        let mut sums = ProbeSums { packets: packets.len() as u32, ..ProbeSums::default() };
        let packets: Vec<Packet> = packets.filter_map(|number| Packet::new(film, number)).collect();
        let per_unit = self.weights.radiance_per_step(&film.header.scales);
        let traced = |trace: &(dyn Fn(&Packet) -> (Vec<Pair>, u64) + Sync)| {
            let one = |packet| (!cancel.load(Ordering::Relaxed)).then(|| trace(packet));
            packets.par_iter().with_max_len(1).map(one).collect::<Option<Vec<_>>>()
        };
        let mut limits = Vec::new();
        for doublings in 0..if self.measurable().cut_paths { 3 } else { 1 } {
            probe.world.lengthen_paths(&self.lighting.compiled.trace, doublings);
            let tracer = probe.world.camera_tracer(sampling);
            limits.push(traced(&|packet| packet.trace(&tracer, &self.weights))?);
        }
        let single = match &self.world {
            AnyWorld::Single(world) => {
                let tracer = world.camera_tracer(sampling);
                Some(traced(&|packet| packet.trace(&tracer, &self.weights))?)
            }
            AnyWorld::Double(_) => None,
        };
        for (i, packet) in packets.iter().enumerate() {
            let tile = film.tile(packet.tile)?;
            let [x, y] = packet.origin;
            for (j, pixel) in packet.pixels.iter().enumerate() {
                let number = (pixel.1 as usize - y) * TILE + pixel.0 as usize - x;
                let pixel = tile.sums(number);
                let spp = f64::from(pixel.count(Replicates::Both));
                let shown = (pixel.mean(Replicates::Both, &per_unit), spp);
                let from_to = |from: &[(Vec<Pair>, u64)], to: &[(Vec<Pair>, u64)]| {
                    difference((&from[i].0[j], &to[i].0[j]), shown, &self.display())
                };
                if let Some(single) = &single {
                    sums.rounding.add(from_to(single, &limits[0]));
                }
                if let [short, longer, longest] = &limits[..] {
                    sums.cut.add(from_to(short, longest));
                    sums.doublings[0] += from_to(short, longer).mean;
                    sums.doublings[1] += from_to(longer, longest).mean;
                }
                sums.pixels += 1;
            }
            sums.cost += single.as_ref().map_or(0, |single| single[i].1);
            sums.cost += limits.iter().map(|traced| DOUBLE_COST * traced[i].1).sum::<u64>();
        }
        Some(sums)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schedule::{Settings, Stop};
    use crate::{Options, SyncRender};
    use zerkalo_kernel::sampling::{SampleSettings, SamplerKind};
    use zerkalo_scene::Scene;

    /// Renders `scene` with 32 samples per pixel. Returns the displayed pixels and the render.
    fn render(scene: &Scene, precision: Precision) -> (Vec<[f64; 3]>, SyncRender) {
        let sampling = SampleSettings { seed: 0, kind: SamplerKind::Sobol };
        let options = Options::new(precision, sampling, Display::default());
        let stop = Stop { spp: Some(32), ..Stop::default() };
        let settings = Settings { adaptive: false, ..Settings::until(stop) };
        let mut render = SyncRender::new(scene, &options, settings, 2).unwrap();
        while render.step().is_none() {}
        let RenderState { film, weights, .. } = &render.state;
        let rows = (0..film.header.height).flat_map(|y| film.row(y, Replicates::Both, weights));
        (rows.map(|radiance| Display::default().levels(radiance)).collect(), render)
    }

    fn rmse(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
        let square =
            |(a, b): (&[f64; 3], &[f64; 3])| -> f64 { (0..3).map(|c| (a[c] - b[c]).powi(2)).sum() };
        (a.iter().zip(b).map(square).sum::<f64>() / (3 * a.len()) as f64).sqrt()
    }

    fn probe(render: &mut SyncRender) -> ProbeSums {
        let pool = crate::threads::pool(2).unwrap();
        render.state.probe_errors(0..64, &pool, &AtomicBool::new(false)).unwrap()
    }

    /// Checks the error of single precision in a scene whose extent requires double, against the
    /// difference of whole pictures.
    #[test]
    fn probe_measures_rounding() {
        let text = include_str!("../../../scenes/mirror-room.toml");
        let far = "\n[[object]]\nshape.sphere = { center = [0.0, -1e6, 0.0], radius = 1e4 }\n";
        let mut scene = Scene::parse(&format!("{text}{far}"), "test").unwrap();
        scene.film.size = [96, 72];
        let (single, mut rendered) = render(&scene, Precision::Single);
        let (double, _) = render(&scene, Precision::Double);
        let (measured, true_error) = (probe(&mut rendered).rounding(32.0), rmse(&single, &double));
        let ratio = measured.unwrap() / true_error;
        assert!((0.5..2.0).contains(&ratio), "{measured:?}, true {true_error}");
        assert!(rendered.schedule.excessive_rounding().is_none(), "there is no target");
    }

    /// Checks the bound of cut paths between two mirrors that face each other.
    #[test]
    fn probe_bounds_cut_paths() {
        let text = include_str!("../../../scenes/features/facing-mirrors.toml");
        let mut scene = Scene::parse(text, "facing-mirrors.toml").unwrap();
        scene.film.size = [64, 48];
        scene.materials.values_mut().for_each(|m| m.reflection = m.reflection.min(0.7));
        (scene.trace.max_depth, scene.trace.min_throughput) = (3, 0.0);
        let (short, mut rendered) = render(&scene, Precision::Auto);
        let sums = probe(&mut rendered);
        scene.trace.max_depth = 200;
        let (long, _) = render(&scene, Precision::Auto);
        let (bound, true_error) = (sums.cut_paths(32.0).unwrap(), rmse(&short, &long));
        assert!((0.9..2.5).contains(&(bound / true_error)), "{bound}, true {true_error}");
    }
}
