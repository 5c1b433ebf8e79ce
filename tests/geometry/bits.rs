//! Comparison of packets with vectors of width 1: their results must be equal in every bit.

use crate::harness::*;
pub use crate::harness::{any_line, forms};

fn lane_of<L: SimdFloat<Scalar = S>, S: Float + SimdFloat<Scalar = S>>(
    v: Vec3<L>,
    i: usize,
) -> Vec3<S> {
    let [x, y, z] = v.lane(i);
    Vec3::new(x, y, z)
}

fn same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits()
}

fn same3<A: SimdFloat, B: SimdFloat>(a: Vec3<A>, b: Vec3<B>, lane: usize) -> bool {
    let (a, b) = (a.lane(lane).map(Float::to_f64), b.lane(0).map(Float::to_f64));
    (0..3).all(|i| same(a[i], b[i]))
}

/// Compares packets of the SIMD type `L` with single rays of its scalar type `S`. Both intersect an
/// aggregate (list, or BVH if `tree` is `true`) of all `forms`.
fn compare<L: SimdFloat<Scalar = S>, S: Float + SimdFloat<Scalar = S>>(
    name: &str,
    forms: &[Form],
    tree: bool,
    lines: &[Line],
) {
    let wide = Aggregate::<L>::with_tree(forms, tree);
    let narrow = Aggregate::<S>::with_tree(forms, tree);
    for (n, (packet, count)) in packets::<L>(lines).enumerate() {
        let hit = wide.closest(&packet, wide.all());
        let hit_mask = hit.t.lt(L::from_f64(L::MAX));
        let packet_surface = surface(&wide, &packet, &hit);
        let limit = 2.0;
        let occluded = wide.occluded(&packet, L::from_f64(limit), L::mask(true), wide.all());
        for i in 0..count {
            let ray =
                Ray { origin: lane_of(packet.origin, i), direction: lane_of(packet.direction, i) };
            let ray_hit = narrow.closest(&ray, narrow.all());
            let context = || {
                format!(
                    "{name}, {} against {}, tree {tree}: ray {} of the seed: {ray:?}: {:?}, not {:?}",
                    L::NAME,
                    S::NAME,
                    n * L::WIDTH + i,
                    hit.t.lane(i),
                    ray_hit.t
                )
            };
            assert!(same(hit.t.lane(i).to_f64(), ray_hit.t.lane(0).to_f64()), "{}", context());
            let limit = <S as SimdFloat>::from_f64(limit);
            let b = narrow.occluded(&ray, limit, S::mask(true), narrow.all()).any();
            assert!(occluded.lane(i) == b, "occluded: {}", context());
            if !hit_mask.lane(i) {
                continue;
            }
            assert!(
                hit.primitive.id_lane(i) == ray_hit.primitive.id_lane(0),
                "primitive: {}",
                context()
            );
            let s = surface(&narrow, &ray, &ray_hit);
            let equal = same3(packet_surface.point, s.point, i)
                && same3(packet_surface.normal, s.normal, i)
                && same(
                    packet_surface.max_coordinate.lane(i).to_f64(),
                    s.max_coordinate.lane(0).to_f64(),
                );
            assert!(equal, "surface {packet_surface:?}, not {s:?}: {}", context());
        }
    }
}

#[test]
fn packets_and_single_rays_give_the_same_bits() {
    for (i, (name, form)) in forms().into_iter().enumerate() {
        let mut numbers = Numbers::new(100 + i as u64);
        let lines: Vec<Line> = (0..2_000).map(|_| any_line(&mut numbers, &form)).collect();
        let forms = [form];
        compare::<Single, f32>(&name, &forms, false, &lines);
        compare::<Double, f64>(&name, &forms, false, &lines);
    }
}

/// Compares packets with single rays among primitives of all kinds at the same place. The lanes of
/// a packet hit different primitives, and each bounded primitive occurs twice, so that equal
/// distances occur. The winner of a tie must not depend on the other lanes.
#[test]
fn packets_and_single_rays_agree_among_all_kinds() {
    let mut all: Vec<Form> = forms().into_iter().map(|f| f.1).collect();
    let again: Vec<Form> = all.iter().filter(|f| f.bounds().is_some()).cloned().collect();
    all.extend(again);
    let mut numbers = Numbers::new(99);
    let lines: Vec<Line> = (0..8_000)
        .map(|_| {
            let form = &all[numbers.below(all.len())];
            any_line(&mut numbers, form)
        })
        .collect();
    for tree in [false, true] {
        compare::<Single, f32>("all kinds", &all, tree, &lines);
        compare::<Double, f64>("all kinds", &all, tree, &lines);
    }
}
