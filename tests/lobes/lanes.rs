//! SIMD types: guarantees beyond the operations of IEEE 754.

use crate::harness::*;
use zerkalo_kernel::lanes::{MAX_WIDTH, SimdU32};

/// Returns pseudo-random 32-bit number `i`.
fn noise(i: u32) -> u32 {
    let x = (i ^ 0x9e37_79b9).wrapping_mul(0x85eb_ca6b);
    let x = (x ^ (x >> 13)).wrapping_mul(0xc2b2_ae35);
    (x ^ (x >> 16)).wrapping_mul(0x27d4_eb2f) ^ (x >> 15)
}

/// Returns pseudo-random number `i`, uniform in [0, 1).
fn uniform(i: u32) -> f64 {
    f64::from(noise(i)) / 4_294_967_296.0
}

/// Calls `check` for the SIMD types of the program and for the types of width 1.
macro_rules! for_every_instance {
    ($check:ident) => {
        $check::<f32>();
        $check::<f64>();
        $check::<Single>();
        $check::<Double>();
    };
}

/// Returns the largest error of `f` against `exact` over `inputs`, in ulps (spacings of numbers) at
/// 1 if `of_one` is `true`, otherwise at the exact result. `exact` gets the input rounded to the
/// precision of `L`.
fn worst_ulps<L: SimdFloat>(
    inputs: impl Fn(u32) -> f64,
    f: impl Fn(L) -> L,
    exact: impl Fn(f64) -> f64,
    of_one: bool,
) -> f64 {
    let mut worst: f64 = 0.0;
    for first in (0..400_000).step_by(L::WIDTH) {
        let x = L::from_fn(|lane| L::Scalar::from_f64(inputs(first + lane as u32)));
        let y = f(x);
        for lane in 0..L::WIDTH {
            let exact = exact(x.lane(lane).to_f64());
            let ulp = L::EPSILON * if of_one { 1.0 } else { exact.abs().log2().floor().exp2() };
            worst = worst.max((y.lane(lane).to_f64() - exact).abs() / ulp);
        }
    }
    worst
}

/// Checks sine and cosine of 2 pi u with u in [0, 1), as lobes use them. Their absolute error is at
/// most 1.5 ulps of 1, which is enough for a direction. Near a multiple of pi / 2 one of the two is
/// small, and its relative error is larger.
fn sine_and_cosine<L: SimdFloat>() {
    let angle = |i: u32| std::f64::consts::TAU * uniform(i);
    let sin = worst_ulps::<L>(angle, |x| x.sin_cos().0, f64::sin, true);
    let cos = worst_ulps::<L>(angle, |x| x.sin_cos().1, f64::cos, true);
    println!("{}: sin {sin:.2}, cos {cos:.2}", L::NAME);
    assert!(sin <= 1.5 && cos <= 1.5, "{}: sin {sin}, cos {cos}", L::NAME);
}

/// Checks the angles (atan2) of points in all directions. Their absolute error is at most three
/// ulps of 1. At the origin and on the positive x axis the angle is 0, not NaN.
fn arc_tangent<L: SimdFloat>() {
    let angle = |i: u32| std::f64::consts::PI * (2.0 * uniform(i) - 1.0);
    let rounded = |x: f64| L::from_f64(x).lane(0).to_f64();
    let mut worst: f64 = 0.0;
    for i in 0..100_000 {
        let (y, x) = angle(i).sin_cos();
        let (y, x) = (rounded(y * 3.0), rounded(x * 3.0));
        let found = L::from_f64(y).atan2(L::from_f64(x)).lane(0).to_f64();
        worst = worst.max((found - y.atan2(x)).abs() / L::EPSILON);
    }
    println!("{}: atan2 {worst:.2}", L::NAME);
    assert!(worst <= 3.0, "{}: atan2 {worst}", L::NAME);
    assert_eq!(L::from_f64(0.0).atan2(L::from_f64(0.0)).lane(0).to_f64(), 0.0);
    assert_eq!(L::from_f64(0.0).atan2(L::from_f64(2.0)).lane(0).to_f64(), 0.0);
}

/// Checks logarithms and exponentials of the arguments that occur. Logarithms are taken of 1 - u
/// for Beckmann's lobe, and of a cosine of at least 1e-30 for Phong's highlight. Exponentials are
/// taken of the exponents of both models.
fn logarithm_and_exponential<L: SimdFloat>() {
    let small = |i: u32| 10f64.powf(-30.0 * uniform(i));
    let share = |i: u32| 1.0 - f64::from(noise(i) >> 8) / 16_777_216.0;
    let low = if L::EPSILON > 1e-10 { -87.0 } else { -700.0 };
    let ln = worst_ulps::<L>(small, L::ln, f64::ln, false);
    let ln_share = worst_ulps::<L>(share, L::ln, f64::ln, false);
    let exp = worst_ulps::<L>(|i| low * uniform(i), L::exp, f64::exp, false);
    let exp_near = worst_ulps::<L>(|i| -uniform(i).powi(4), L::exp, f64::exp, false);
    println!("{}: ln {ln:.2} {ln_share:.2}, exp {exp:.2} {exp_near:.2}", L::NAME);
    assert!(ln <= 1.5 && ln_share <= 1.5, "{}: ln {ln} {ln_share}", L::NAME);
    assert!(exp <= 1.5 && exp_near <= 1.5, "{}: exp {exp} {exp_near}", L::NAME);
    // ln 1 = 0 and exp 0 = 1 keep a mirror direction and the top of a highlight exact.
    assert_eq!(L::from_f64(1.0).ln().lane(0).to_f64(), 0.0);
    assert_eq!(L::from_f64(0.0).exp().lane(0).to_f64(), 1.0);
    // Underflow gives 0, neither a negative number nor NaN.
    for x in [-104.0, -800.0, -1e6, -1e30, -L::MAX, f64::NEG_INFINITY] {
        let y = L::from_f64(x).exp().lane(0).to_f64();
        assert!((0.0..1e-44).contains(&y), "{}: exp {x} = {y}", L::NAME);
    }
}

#[test]
fn elementary_functions_are_good_to_stated_ulps() {
    for_every_instance!(sine_and_cosine);
    for_every_instance!(arc_tangent);
    for_every_instance!(logarithm_and_exponential);
}

/// Checks the fixed-point sums of the film: rounded lanes add up exactly, and their sum equals the
/// sum of scalars that are rounded to nearest even.
fn fixed_point<L: SimdFloat>() {
    let halves = [0.5, 1.5, 2.5, -0.5, -1.5, -2.5, 0.0, -0.0];
    for i in 0..20_000u32 {
        // Powers of two as scales, as films have them, up to results of 2^50.
        let scale = f64::from((i % 60) as i32 - 20).exp2();
        let value = |lane: usize| {
            let at = i * MAX_WIDTH as u32 + lane as u32;
            let magnitude = 50.0 * uniform(at) - 10.0;
            let x = (2.0 * uniform(!at) - 1.0) * magnitude.exp2() / scale;
            if i % 7 == 0 { halves[lane % 8] / scale } else { x }
        };
        let x = L::from_fn(|lane| L::Scalar::from_f64(value(lane)));
        let exact = |lane| (x.lane(lane).to_f64() * scale).round_ties_even() as i64;
        for (lane, fixed) in x.fixed(scale).into_iter().enumerate() {
            let expected = if lane < L::WIDTH { exact(lane) } else { 0 };
            assert_eq!(fixed, expected, "{} {i} {lane}", L::NAME);
        }
        assert_eq!(x.fixed_sum(scale), (0..L::WIDTH).map(exact).sum::<i64>(), "{} {i}", L::NAME);
    }
    let most = 2f64.powi(51) * (1.0 - 2.0 * L::EPSILON);
    assert_eq!(L::from_f64(most).fixed_sum(1.0), most as i64 * L::WIDTH as i64);
    assert_eq!(L::from_f64(-most).fixed_sum(1.0), -(most as i64) * L::WIDTH as i64);
}

#[test]
fn fixed_point_sums_are_exact() {
    for_every_instance!(fixed_point);
}

/// Checks lookups in tables of one element, of as many as a register has lanes, and of more.
fn gathers<L: SimdFloat>() {
    for length in [1, 4, 8, 16, 17, 64] {
        let value = |i: usize| L::Scalar::from_f64(uniform(i as u32));
        let table: Vec<L::Scalar> = (0..length).map(value).collect();
        for i in 0..100 {
            let indices = std::array::from_fn(|lane| noise(i * 16 + lane as u32) % length as u32);
            let found = L::gather(&table, &indices);
            for (lane, index) in indices.into_iter().enumerate().take(L::WIDTH) {
                assert_eq!(found.lane(lane), table[index as usize], "{} {length}", L::NAME);
            }
        }
    }
}

#[test]
fn gather_reads_the_element_of_each_lane() {
    for_every_instance!(gathers);
}

fn integers<L: SimdFloat>() {
    for i in 0..10_000 {
        let x = L::SimdU32::from_fn(|lane| noise(i * 16 + lane as u32));
        for lane in 0..L::WIDTH {
            let one = noise(i * 16 + lane as u32);
            assert_eq!(x.lane(lane), one);
            assert_eq!(x.reverse().lane(lane), one.reverse_bits(), "{} {one:x}", L::NAME);
            let shift = i % 32;
            assert_eq!(x.shift_right(shift).lane(lane), one >> shift);
            assert_eq!((x * x + x).lane(lane), one.wrapping_mul(one).wrapping_add(one));
            // Uniform numbers are less than 1 and keep the top 24 bits of the integer.
            let unit = L::to_unit(x).lane(lane).to_f64();
            assert!((0.0..1.0).contains(&unit));
            assert_eq!((unit * 16_777_216.0) as u32, one >> 8);
        }
    }
    assert!(L::to_unit(L::SimdU32::splat(u32::MAX)).lane(0).to_f64() < 1.0);
    assert!(L::to_unit(L::SimdU32::splat(0)).lane(0).to_f64() >= 0.0);
}

#[test]
fn simd_integers_equal_scalar_integers() {
    for_every_instance!(integers);
}

/// Checks masks with every pattern of truth values.
fn masks<L: SimdFloat>() {
    let lane_of = |bits: u32| L::from_fn(|i| L::Scalar::from_f64(f64::from(bits >> i & 1)));
    for bits in 0..1u32 << L::WIDTH {
        let mask = lane_of(bits).gt(L::zero());
        assert_eq!(mask.bits(), bits);
        assert_eq!(mask.any(), bits != 0);
        assert_eq!(mask.none(), bits == 0);
        assert_eq!(mask.all(), bits == (1 << L::WIDTH) - 1);
        assert_eq!((!mask).bits(), !bits & ((1 << L::WIDTH) - 1));
        let other_bits = noise(bits) & ((1 << L::WIDTH) - 1);
        let other = lane_of(other_bits).gt(L::zero());
        assert_eq!((mask & other).bits(), bits & other_bits);
        assert_eq!((mask | other).bits(), bits | other_bits);
        assert_eq!(mask.and_not(other).bits(), bits & !other_bits);
        let (yes, no) = (L::from_f64(2.0), L::from_f64(-3.0));
        for lane in 0..L::WIDTH {
            let truth = bits >> lane & 1 == 1;
            assert_eq!(mask.lane(lane), truth);
            let chosen = L::select(mask, yes, no).lane(lane).to_f64();
            assert_eq!(chosen, if truth { 2.0 } else { -3.0 });
            // `masked` replaces lanes outside of the mask by 0, even if they are NaN.
            let nan = L::from_f64(f64::NAN).masked(mask).lane(lane).to_f64();
            assert_eq!(nan.is_nan(), truth);
            assert!(truth || nan == 0.0);
        }
    }
    assert!(L::mask(true).all() && L::mask(false).none());
}

/// Checks that ids in lanes pass through `select` unchanged, for any bit pattern.
fn tags<L: SimdFloat>() {
    let labels = [0, 1, 2, 0x7f80_0000, 0x7fa0_0001, 0x7fc0_0000, 0xff80_0001, u32::MAX];
    for a in labels {
        for b in labels {
            for i in 0..8 {
                let bits = noise(i ^ a ^ b.rotate_left(7)) & ((1 << L::WIDTH) - 1);
                let mask =
                    L::from_fn(|i| L::Scalar::from_f64(f64::from(bits >> i & 1))).gt(L::zero());
                let mixed = L::select(mask, L::from_id(a), L::from_id(b));
                for lane in 0..L::WIDTH {
                    let expected = if mask.lane(lane) { a } else { b };
                    assert_eq!(mixed.id_lane(lane), expected, "{} {a:x} {b:x}", L::NAME);
                }
                let has = if a == b { (1 << L::WIDTH) - 1 } else { bits };
                assert_eq!(mixed.id_eq(a).bits(), has, "{} {a:x} {b:x}", L::NAME);
            }
        }
    }
}

#[test]
fn masks_select_lanes_and_keep_labels() {
    for_every_instance!(masks);
    for_every_instance!(tags);
}

/// Checks that `min` and `max` ignore a NaN in the left operand, and that comparisons with NaN are
/// false.
fn not_a_number<L: SimdFloat>() {
    let nan = L::from_f64(f64::NAN);
    for x in [-1.0, 0.0, 2.5, f64::INFINITY, f64::NEG_INFINITY] {
        let x = L::from_f64(x);
        let value = x.lane(0).to_f64();
        assert_eq!(nan.min(x).lane(0).to_f64(), value, "{}", L::NAME);
        assert_eq!(nan.max(x).lane(0).to_f64(), value, "{}", L::NAME);
        for mask in [nan.lt(x), nan.le(x), nan.gt(x), nan.ge(x), x.lt(nan), x.le(nan), x.gt(nan)] {
            assert!(mask.none());
        }
        for y in [-4.0, 0.5, 1e30] {
            assert_eq!(
                x.min(L::from_f64(y)).lane(0).to_f64(),
                value.min(L::from_f64(y).lane(0).to_f64())
            );
            assert_eq!(
                x.max(L::from_f64(y)).lane(0).to_f64(),
                value.max(L::from_f64(y).lane(0).to_f64())
            );
        }
    }
    assert!(L::from_f64(-1.0).sqrt().lane(0).to_f64().is_nan());
    assert_eq!(L::from_f64(3.0).copysign(L::from_f64(-0.0)).lane(0).to_f64(), -3.0);
    assert_eq!((-L::from_f64(0.0)).lane(0).to_f64().to_bits(), (-0.0f64).to_bits());
}

#[test]
fn nan_follows_the_stated_rule() {
    for_every_instance!(not_a_number);
}

/// Checks that the smallest and the largest lane are found in any position, with NaN in any other
/// lanes.
fn ends_of_lanes<L: SimdFloat>() {
    for i in 0..2000u32 {
        let numbers: Vec<f64> = (0..L::WIDTH as u32)
            .map(|lane| match i.wrapping_mul(0x9e37_79b9) >> lane & 3 {
                0 => f64::NAN,
                _ => f64::from(L::from_f64(uniform(16 * i + lane) - 0.5).lane(0).to_f64() as f32),
            })
            .collect();
        let known = || numbers.iter().copied().filter(|x| !x.is_nan());
        let (low, high) = L::from_fn(|lane| Float::from_f64(numbers[lane])).min_max();
        assert_eq!(low.to_f64(), known().fold(L::MAX, f64::min), "{}: {numbers:?}", L::NAME);
        assert_eq!(high.to_f64(), known().fold(-L::MAX, f64::max), "{}: {numbers:?}", L::NAME);
    }
}

#[test]
fn min_max_ignores_nan_lanes() {
    for_every_instance!(ends_of_lanes);
}

/// Checks that arithmetic, square root and fused multiply-add give the same bits at every width.
fn same_bits<One: SimdFloat, Many: SimdFloat<Scalar = One::Scalar>>() {
    let value =
        |i: u32| One::Scalar::from_f64((uniform(i) - 0.5) * (60.0 * uniform(!i) - 30.0).exp2());
    let bits = |x: One::Scalar| x.to_f64().to_bits();
    for i in 0..20_000u32 {
        let at = |k: u32| Many::from_fn(|lane| value(i * 64 + k * 16 + lane as u32));
        let (a, b, c) = (at(0), at(1), at(2));
        let results = [a + b, a - b, a * b, a / b, a.mul_add(b, c), a.abs().sqrt(), -a];
        for lane in 0..Many::WIDTH {
            let one = |x: Many| One::splat(x.lane(lane));
            let (a, b, c) = (one(a), one(b), one(c));
            let singles = [a + b, a - b, a * b, a / b, a.mul_add(b, c), a.abs().sqrt(), -a];
            for (k, (many, single)) in results.iter().zip(singles).enumerate() {
                assert_eq!(bits(many.lane(lane)), bits(single.lane(0)), "operation {k}");
            }
        }
    }
}

#[test]
fn ieee_operations_are_the_same_bits_at_every_width() {
    same_bits::<f32, Single>();
    same_bits::<f64, Double>();
}

/// Checks that the frame of a lobe about any horizontal direction has one horizontal and one
/// vertical axis. The lobes of upright mirrors are then aligned with the horizon.
#[test]
fn frames_around_horizontal_vectors_are_upright() {
    for i in 0..360 {
        let angle = f64::from(i).to_radians();
        let frame = Frame::around(Vec3::<f64>::of([angle.sin(), 0.0, angle.cos()]));
        assert!(frame.b.x.abs() < 1e-15 && frame.b.z.abs() < 1e-15, "{i} degrees: {frame:?}");
        assert!((frame.b.y.abs() - 1.0).abs() < 1e-15 && frame.t.y.abs() < 1e-15, "{i}: {frame:?}");
    }
}
