//! BVHs, and bounding boxes in object or scene space, against a linear list: their hits must be
//! equal.

use crate::geometry::bits::{any_line, forms};
use crate::harness::*;
use zerkalo_kernel::primitive::AccelerationStructure;

/// Returns `count` random primitives of every kind, crowded in a cube of half-width 10. In half of
/// the cases they are on a lattice, where many faces are coplanar.
fn crowd(numbers: &mut Numbers, count: usize) -> Vec<Form> {
    let kinds = forms();
    let lattice = numbers.below(2) == 0;
    (0..count)
        .map(|_| {
            let form = &kinds[numbers.below(kinds.len())].1;
            if matches!(form, Form::Plane(_)) && numbers.below(50) != 0 {
                return kinds[0]
                    .1
                    .clone()
                    .transformed(&DAffine3::from_translation(numbers.in_cube(10.0)));
            }
            let place = numbers.in_cube(10.0);
            let map = if lattice {
                DAffine3::from_translation(place.round())
            } else {
                let size = 10f64.powf(numbers.between(-2.0, 0.3));
                let turn = DQuat::from_axis_angle(numbers.direction(), numbers.between(0.0, 3.0));
                DAffine3::from_scale_rotation_translation(DVec3::splat(size), turn, place)
            };
            form.clone().transformed(&map)
        })
        .collect()
}

fn compare<L: SimdFloat>(seed: u64, count: usize, forms: &[Form], lines: &[Line]) {
    let list = Aggregate::<L>::with_bvh(forms, false);
    for structure in [
        AccelerationStructure::Bvh,
        AccelerationStructure::Boxes { oriented: true },
        AccelerationStructure::Boxes { oriented: false },
    ] {
        let other = Aggregate::<L>::with_structure(forms, structure);
        compare_with(seed, (structure, count), (&list, &other), lines);
    }
}

fn compare_with<L: SimdFloat>(
    seed: u64,
    (structure, count): (AccelerationStructure, usize),
    (list, tree): (&Aggregate<L>, &Aggregate<L>),
    lines: &[Line],
) {
    let mut numbers = Numbers::new(seed);
    for (packet, lanes) in packets::<L>(lines) {
        let (a, b) = (list.closest(&packet, list.all()), tree.closest(&packet, tree.all()));
        let limits: Vec<f64> = (0..L::WIDTH).map(|_| numbers.between(0.0, 20.0)).collect();
        let wanted = L::from_fn(|_| L::Scalar::from_f64(numbers.unit())).lt(L::from_f64(0.8));
        let limit = L::from_fn(|i| L::Scalar::from_f64(limits[i]));
        let (c, d) = (
            list.occluded(&packet, limit, wanted, list.all()) & wanted,
            tree.occluded(&packet, limit, wanted, tree.all()) & wanted,
        );
        for i in 0..lanes {
            let context = || {
                let (o, d) = (packet.origin.lane(i), packet.direction.lane(i));
                format!(
                    "{} {structure:?}, seed {seed}, {count} primitives, ray {o:?} {d:?}",
                    L::NAME
                )
            };
            let (s, t) = (a.t.lane(i).to_f64(), b.t.lane(i).to_f64());
            assert!(s == t, "{}: list {s}, tree {t}", context());
            assert!(
                s >= L::MAX || a.primitive.id_lane(i) == b.primitive.id_lane(i),
                "{}: at {s} list hits {}, tree {}",
                context(),
                a.primitive.id_lane(i),
                b.primitive.id_lane(i)
            );
        }
        assert_eq!(
            c.bits(),
            d.bits(),
            "{} {structure:?}, seed {seed}, {count} primitives: occluded",
            L::NAME
        );
    }
}

#[test]
fn trees_boxes_and_lists_give_identical_hits() {
    for (seed, count) in
        [5, 8, 13, 24, 25, 40, 64, 100, 100, 200, 400, 2000].into_iter().enumerate()
    {
        let seed = seed as u64;
        let mut numbers = Numbers::new(seed);
        let forms = crowd(&mut numbers, count);
        let rays = if count > 300 { 2_000 } else { 5_000 };
        let lines: Vec<Line> = (0..rays)
            .map(|_| {
                if numbers.below(2) == 0 {
                    let form = &forms[numbers.below(forms.len())];
                    any_line(&mut numbers, form)
                } else {
                    (numbers.in_cube(15.0), numbers.direction())
                }
            })
            .collect();
        compare::<Single>(seed, count, &forms, &lines);
        compare::<Double>(seed, count, &forms, &lines);
    }
}

/// Compares BVH and linear list by rays that graze the outermost points of spheres along an axis.
/// There the rounding of the sphere test decides whether a ray hits.
#[test]
fn tree_and_list_agree_at_limbs() {
    let mut numbers = Numbers::new(77);
    let forms: Vec<Form> = (0..60)
        .map(|_| {
            Form::Sphere(SphereForm {
                center: numbers.in_cube(10.0),
                radius: numbers.between(0.1, 1.0),
            })
        })
        .collect();
    let mut line = || {
        let Form::Sphere(SphereForm { center, radius }) = forms[numbers.below(forms.len())] else {
            unreachable!("all are spheres")
        };
        let (axis, along) = (numbers.below(3), 1 + numbers.below(2));
        let mut side = DVec3::ZERO;
        side[axis] = if numbers.bits() & 1 == 0 { radius } else { -radius };
        let mut d = numbers.direction() * 1e-3;
        d[axis] = 0.0;
        d[(axis + along) % 3] = 1.0;
        let d = d.normalize();
        let factor = 1.0 + (numbers.below(9) as f64 - 4.0) * f64::from(f32::EPSILON) / 4.0;
        (center + side * factor - d * 30.0, d)
    };
    let lines: Vec<Line> = (0..100_000).map(|_| line()).collect();
    compare::<Single>(77, 60, &forms, &lines);
    compare::<Double>(77, 60, &forms, &lines);
}
