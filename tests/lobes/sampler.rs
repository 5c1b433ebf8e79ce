//! Random numbers of the samplers. The tests check four properties: Sobol points form nets (one
//! point in each elementary interval), pixels are independent, and the moments and the order of
//! convergence are correct.

use crate::harness::*;
use crate::lobes::stats::slope;
use zerkalo_kernel::lanes::SimdU32;
use zerkalo_kernel::sampling::CameraDimensions;

fn sampler<L: SimdFloat>(kind: SamplerKind, seed: u64, jitter: bool) -> Sampler<L> {
    let camera = CameraDimensions { pixel: jitter, lens: false };
    Sampler::new(SampleSettings { seed, kind }, camera)
}

/// Returns one pair of numbers for each of the first `count` samples of a pixel. If `bounce` is
/// `None`, the pair is the position in the pixel, otherwise it is for the direction sampled at this
/// bounce.
fn pairs<L: SimdFloat>(
    sampler: &Sampler<L>,
    (x, y): (u32, u32),
    replicate: usize,
    bounce: Option<u32>,
    count: u32,
) -> Vec<[f64; 2]> {
    let mut out = Vec::new();
    for first in (0..count).step_by(L::WIDTH) {
        let points = sampler.block(first, L::WIDTH);
        let draws = points.for_pixel(sampler.key((x, y), replicate));
        let (u, v) = bounce.map_or_else(|| draws.pixel(), |b| draws.lobe_2d(b));
        out.extend((0..L::WIDTH).map(|i| [u.lane(i).to_f64(), v.lane(i).to_f64()]));
    }
    out.truncate(count as usize);
    out
}

/// Checks that `points`, the first 2^m of a sequence, form a net. Each elementary interval of area
/// 2^-m, whatever its aspect ratio, contains exactly one of them.
fn assert_net(points: &[[f64; 2]], name: &str) {
    let m = points.len().ilog2();
    assert_eq!(points.len(), 1 << m);
    for split in 0..=m {
        let mut seen = vec![false; points.len()];
        for [u, v] in points {
            let (i, j) =
                ((u * f64::from(1u32 << split)) as usize, v * f64::from(1u32 << (m - split)));
            let cell = (i << (m - split)) + j as usize;
            assert!(!seen[cell], "{name}: two points in cell {cell} of split {split}");
            seen[cell] = true;
        }
    }
}

/// Checks that each pair of dimensions is still a net after scrambling: every elementary interval
/// contains one point. This must hold in the joint set (the first eight dimensions) and in the
/// padded sets (further dimensions), whose indices are also shuffled.
fn nets<L: SimdFloat>() {
    for seed in [0, 1, u64::MAX] {
        for replicate in 0..2 {
            for pixel in [(0, 0), (639, 479), (u32::MAX, 7)] {
                let sampler = sampler::<L>(SamplerKind::Sobol, seed, true);
                let plain = self::sampler::<L>(SamplerKind::Sobol, seed, false);
                for m in [4, 8, 10] {
                    let name = format!("{} seed {seed} pixel {pixel:?} m {m}", L::NAME);
                    assert_net(&pairs(&sampler, pixel, replicate, None, 1 << m), &name);
                    assert_net(&pairs(&plain, pixel, replicate, Some(0), 1 << m), &name);
                    // The first two bounces use the joint set, and the other eight the first two
                    // padded sets.
                    for bounce in 0..10 {
                        assert_net(&pairs(&sampler, pixel, replicate, Some(bounce), 1 << m), &name);
                    }
                }
            }
        }
    }
}

#[test]
fn scrambled_sets_remain_nets() {
    nets::<Double>();
    nets::<Single>();
}

/// Checks that the sampler's numbers have the same bits at every vector width and with any number
/// of pixels in a packet.
fn packets_equal_singles<One: SimdFloat, Many: SimdFloat>() {
    let bits = |x: f64| x.to_bits();
    for kind in [SamplerKind::Sobol, SamplerKind::Random] {
        for (jitter, seed) in [(true, 7), (false, u64::MAX)] {
            let one = sampler::<One>(kind, seed, jitter);
            let many = sampler::<Many>(kind, seed, jitter);
            for replicate in 0..2 {
                for first in [0u32, 16, 256, 65_536, 0x00ff_fff0, u32::MAX - 15] {
                    for bounce in (0..10).map(Some).chain([None]) {
                        let pair = |d: &zerkalo_kernel::sampling::PacketSampler<'_, Many>| {
                            bounce.map_or_else(|| d.pixel(), |b| d.lobe_2d(b))
                        };
                        let single = |d: &zerkalo_kernel::sampling::PacketSampler<'_, One>| {
                            let (u, v) = bounce.map_or_else(|| d.pixel(), |b| d.lobe_2d(b));
                            (bits(u.lane(0).to_f64()), bits(v.lane(0).to_f64()))
                        };
                        let lane_of = |p: (Many, Many), lane| {
                            (bits(p.0.lane(lane).to_f64()), bits(p.1.lane(lane).to_f64()))
                        };
                        let mut count = Many::WIDTH;
                        while count > 0 {
                            let points = many.block(first, count);
                            let at =
                                |lane| ((lane / count) as u32 * 77, 1000 - (lane / count) as u32);
                            let key = |lane| many.key(at(lane), replicate);
                            let field = pair(&points.for_pixels(Many::SimdU32::from_fn(key)));
                            let row = pair(&points.for_pixel(key(0)));
                            for lane in 0..Many::WIDTH {
                                let index = first + (lane % count) as u32;
                                let points = one.block(index, 1);
                                let name = format!("{kind:?} {index} {count} {bounce:?}");
                                let expected =
                                    single(&points.for_pixel(one.key(at(lane), replicate)));
                                assert_eq!(lane_of(field, lane), expected, "{name}");
                                let expected = single(&points.for_pixel(one.key(at(0), replicate)));
                                assert_eq!(lane_of(row, lane), expected, "{name}");
                            }
                            count /= 2;
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn packet_sampler_equals_scalar_sampler() {
    packets_equal_singles::<f32, Single>();
    packets_equal_singles::<f64, Double>();
}

fn numbers(sampler: &Sampler<f64>, pixel: (u32, u32), replicate: usize, index: u32) -> Vec<f64> {
    let points = sampler.block(index, 1);
    let draws = points.for_pixel(sampler.key(pixel, replicate));
    let place = draws.pixel();
    let lobes = (0..10).flat_map(|b| <[f64; 2]>::from(draws.lobe_2d(b)));
    [place.0, place.1].into_iter().chain(lobes).collect()
}

/// Checks the independence of pixels and replicates. Over all pixels, each dimension of a sample is
/// uniform in mean and variance. It is uncorrelated with the next dimension, the other replicate,
/// the neighbouring pixel and another seed. The limit is 4.8 sigma. With 792 comparisons this gives
/// about one false alarm in 800 seeds.
#[test]
fn pixels_and_replicates_are_independent() {
    const SIGMAS: f64 = 4.8;
    let n: u32 = 64 * 64;
    for kind in [SamplerKind::Sobol, SamplerKind::Random] {
        for index in [0, 1, 37] {
            let sampler = sampler::<f64>(kind, 20, true);
            let other = self::sampler::<f64>(kind, 21, true);
            let (mut mean, mut square) = ([0.0; 22], [0.0; 22]);
            let mut product = [[0.0; 22]; 4];
            for pixel in (0..64).flat_map(|y| (0..64).map(move |x| (x, y))) {
                let a = numbers(&sampler, pixel, 0, index);
                let b = numbers(&sampler, pixel, 1, index);
                let beside = numbers(&sampler, (pixel.0 + 1, pixel.1), 0, index);
                let seeded = numbers(&other, pixel, 0, index);
                for d in 0..22 {
                    let x = a[d] - 0.5;
                    mean[d] += x;
                    square[d] += x * x - 1.0 / 12.0;
                    product[0][d] += x * (b[d] - 0.5);
                    product[1][d] += x * (beside[d] - 0.5);
                    product[2][d] += x * (seeded[d] - 0.5);
                    product[3][d] += x * (a[(d + 1) % 22] - 0.5);
                }
            }
            let n = f64::from(n);
            for d in 0..22 {
                let name = format!("{kind:?}, index {index}, dimension {d}");
                let z = mean[d] / (n / 12.0).sqrt();
                assert!(z.abs() < SIGMAS, "{name}: mean {z} sigma");
                let z = square[d] / (n * (1.0 / 80.0 - 1.0 / 144.0)).sqrt();
                assert!(z.abs() < SIGMAS, "{name}: variance {z} sigma");
                for (what, product) in
                    ["replicate", "pixel beside", "seed", "next dimension"].iter().zip(&product)
                {
                    let z = product[d] / (n / 144.0).sqrt();
                    assert!(z.abs() < SIGMAS, "{name}: {what} {z} sigma");
                }
            }
        }
    }
}

/// Integrand over the film plane and the first lobe, with its exact integral. Both are functions of
/// a parameter k, which differs between pixels.
struct Integrand {
    value: fn([f64; 4], f64) -> f64,
    exact: fn(f64) -> f64,
}

const SMOOTH: Integrand = Integrand {
    value: |x, k| x.iter().map(|x| 1.0 + 0.5 * (PI * x * (1.0 + k)).sin()).product(),
    exact: |k| {
        let w = PI * (1.0 + k);
        (1.0 + 0.5 * (1.0 - w.cos()) / w).powi(4)
    },
};

/// Integrand with a straight edge of slope k / 2 through the pixel.
const EDGE: Integrand = Integrand {
    value: |x, k| f64::from(u8::from(x[1] < 0.25 + 0.5 * k * x[0])),
    exact: |k| 0.25 + 0.25 * k,
};

/// Returns the errors of the estimated integrals in 400 pixels, from the first `count` samples of
/// one replicate.
fn errors(kind: SamplerKind, f: &Integrand, replicate: usize, count: u32) -> Vec<f64> {
    let sampler = sampler::<Double>(kind, 4, true);
    (0..400)
        .map(|i| {
            let k = (f64::from(i) * 0.618_034) % 1.0;
            let places = pairs(&sampler, (i, 3), replicate, None, count);
            let lobes = pairs(&sampler, (i, 3), replicate, Some(0), count);
            let sum: f64 = places
                .iter()
                .zip(&lobes)
                .map(|(p, l)| (f.value)([p[0], p[1], l[0], l[1]], k))
                .sum();
            sum / f64::from(count) - (f.exact)(k)
        })
        .collect()
}

fn rmse_slope(kind: SamplerKind, f: &Integrand) -> f64 {
    let point = |m: i32| {
        let errors = errors(kind, f, 0, 1 << m);
        let mean = errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64;
        (f64::from(m), 0.5 * mean.log2())
    };
    slope(&(4..=10).map(point).collect::<Vec<_>>())
}

/// Checks the rates at which the error falls with the number N of samples. Sobol points give nearly
/// 1 / N for a smooth integrand in four dimensions, and N^-3/4 for an edge in two dimensions.
/// Random numbers give N^-1/2.
#[test]
fn errors_fall_at_the_known_rates() {
    let smooth = rmse_slope(SamplerKind::Sobol, &SMOOTH);
    assert!(smooth < -0.95, "{smooth}");
    let edge = rmse_slope(SamplerKind::Sobol, &EDGE);
    assert!((-0.9..-0.7).contains(&edge), "{edge}");
    for integrand in [SMOOTH, EDGE] {
        let random = rmse_slope(SamplerKind::Random, &integrand);
        assert!((random + 0.5).abs() < 0.05, "{random}");
    }
}

#[test]
fn errors_of_the_replicates_are_uncorrelated() {
    for integrand in [SMOOTH, EDGE] {
        for count in [4, 16, 64, 256] {
            let a = errors(SamplerKind::Sobol, &integrand, 0, count);
            let b = errors(SamplerKind::Sobol, &integrand, 1, count);
            let sum = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
            let correlation = sum(&a, &b) / (sum(&a, &a) * sum(&b, &b)).sqrt();
            let z = correlation * (a.len() as f64).sqrt();
            assert!(z.abs() < 4.0, "{count}: correlation {correlation}");
        }
    }
}
