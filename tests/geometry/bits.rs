//! Comparison of packets with single rays, each in all lanes of a packet: their results must be equal
//! in every bit.

use crate::harness::*;
pub use crate::harness::{any_line, forms};

/// Returns a vector whose lanes are all equal to lane `i` of `v`.
fn repeated<L: SimdFloat>(v: Vec3<L>, i: usize) -> Vec3<L> {
    let lane = v.lane(i);
    Vec3::from_fn(|_| lane)
}

fn same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits()
}

fn same3<L: SimdFloat>(a: Vec3<L>, b: Vec3<L>, lane: usize) -> bool {
    let (a, b) = (a.lane(lane).map(Float::to_f64), b.lane(0).map(Float::to_f64));
    (0..3).all(|i| same(a[i], b[i]))
}

/// Compares packets of the SIMD type `L` with single rays. Both intersect an aggregate (list, or BVH
/// if `tree` is `true`) of all `forms`.
fn compare<L: SimdFloat>(name: &str, forms: &[Form], tree: bool, lines: &[Line]) {
    let geometry = Aggregate::<L>::with_bvh(forms, tree);
    for (n, (packet, count)) in packets::<L>(lines).enumerate() {
        let hit = geometry.closest(&packet, geometry.all());
        let hit_mask = hit.t.lt(L::from_f64(L::MAX));
        let packet_surface = surface(&geometry, &packet, &hit);
        let (limit, all) = (L::from_f64(2.0), L::mask(true));
        let occluded = geometry.occluded(&packet, limit, all, geometry.all());
        for i in 0..count {
            let (origin, direction) = (repeated(packet.origin, i), repeated(packet.direction, i));
            let ray = Ray { origin, direction };
            let ray_hit = geometry.closest(&ray, geometry.all());
            let context = || {
                format!(
                    "{name}, {}, tree {tree}: ray {} of the seed: {:?}, {:?}: {:?}, not {:?}",
                    L::NAME,
                    n * L::WIDTH + i,
                    origin.lane(0),
                    direction.lane(0),
                    hit.t.lane(i),
                    ray_hit.t.lane(0)
                )
            };
            assert!(same(hit.t.lane(i).to_f64(), ray_hit.t.lane(0).to_f64()), "{}", context());
            let alone = geometry.occluded(&ray, limit, all, geometry.all());
            assert!(occluded.lane(i) == alone.lane(0), "occluded: {}", context());
            if !hit_mask.lane(i) {
                continue;
            }
            assert!(
                hit.primitive.id_lane(i) == ray_hit.primitive.id_lane(0),
                "primitive: {}",
                context()
            );
            let s = surface(&geometry, &ray, &ray_hit);
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
        compare::<Single>(&name, &forms, false, &lines);
        compare::<Double>(&name, &forms, false, &lines);
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
        compare::<Single>("all kinds", &all, tree, &lines);
        compare::<Double>("all kinds", &all, tree, &lines);
    }
}
