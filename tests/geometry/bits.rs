//! The width-1 instances and the packets give the same bits.

use crate::common::Numbers;
use crate::rays::{Line, ball, every_kind, packets, surface};
use glam::{DAffine3, DQuat, DVec3};
use zerkalo::lanes::{Double, Lanes, Mask, Real, Single, V3};
use zerkalo::shape::{Form, Geometry, Ray};

/// A ray of one kind or another around a form: through it, beside it, from inside, along the axes,
/// from points of its surface, with zeros of both signs.
pub fn any_line(numbers: &mut Numbers, form: &Form) -> Line {
    let (center, radius) = ball(form).unwrap_or((DVec3::ZERO, 2.0));
    let axis = |numbers: &mut Numbers| {
        let zero = if numbers.bits() & 1 == 0 { 0.0 } else { -0.0 };
        let mut d = DVec3::splat(zero);
        let at = numbers.below(3);
        d[at] = if numbers.bits() & 1 == 0 { 1.0 } else { -1.0 };
        if numbers.below(2) == 0 {
            d[(at + 1) % 3] = numbers.between(-1.0, 1.0);
        }
        d.normalize()
    };
    let target = center + numbers.in_cube(1.1 * radius);
    let (low, high) = form.bounds().unwrap_or((DVec3::splat(-1.0), DVec3::ONE));
    let corner = |numbers: &mut Numbers| {
        let pick = |n: &mut Numbers, l: f64, h: f64| [l, h, 0.5 * (l + h)][n.below(3)];
        DVec3::new(
            pick(numbers, low.x, high.x),
            pick(numbers, low.y, high.y),
            pick(numbers, low.z, high.z),
        )
    };
    match numbers.below(6) {
        0 => {
            let from = center + numbers.direction() * (3.0 * radius);
            (from, (target - from).normalize())
        }
        1 => (target, numbers.direction()),
        2 => {
            let d = axis(numbers);
            (target - d * (2.0 * radius), d)
        }
        3 => (corner(numbers), axis(numbers)),
        4 => {
            let d = axis(numbers);
            (corner(numbers) - d * (2.0 * radius), d)
        }
        _ => {
            let (from, to) = (corner(numbers), corner(numbers));
            let d = (to - from).try_normalize().unwrap_or(DVec3::Y);
            (from - d * if numbers.bits() & 1 == 0 { 0.0 } else { radius }, d)
        }
    }
}

/// Every kind as it is, turned, and scaled unevenly (spheres become ellipsoids).
pub fn forms() -> Vec<(String, Form)> {
    let mut out = Vec::new();
    let turn = DQuat::from_euler(glam::EulerRot::XYZ, 0.4, -1.1, 2.0);
    let place = DVec3::new(0.3, -2.0, 1.0);
    for (name, form) in every_kind() {
        let maps = [
            ("", DAffine3::IDENTITY),
            (" turned", DAffine3::from_rotation_translation(turn, place)),
            (
                " uneven",
                DAffine3::from_scale_rotation_translation(DVec3::new(1.0, -0.2, 3.0), turn, place),
            ),
        ];
        for (how, map) in maps {
            out.push((format!("{name}{how}"), form.clone().transformed(&map)));
        }
    }
    out
}

fn lane_of<L: Lanes<Scalar = S>, S: Real + Lanes<Scalar = S>>(v: V3<L>, i: usize) -> V3<S> {
    let [x, y, z] = v.lane(i);
    V3::new(x, y, z)
}

fn same(a: f64, b: f64) -> bool {
    a.to_bits() == b.to_bits()
}

fn same3<A: Lanes, B: Lanes>(a: V3<A>, b: V3<B>, lane: usize) -> bool {
    let (a, b) = (a.lane(lane).map(Real::to_f64), b.lane(0).map(Real::to_f64));
    (0..3).all(|i| same(a[i], b[i]))
}

/// Packets of `L` against rays of its scalar, in one geometry of all `forms`.
fn compare<L: Lanes<Scalar = S>, S: Real + Lanes<Scalar = S>>(
    name: &str,
    forms: &[Form],
    tree: bool,
    lines: &[Line],
) {
    let wide = Geometry::<L>::with_tree(forms, tree);
    let narrow = Geometry::<S>::with_tree(forms, tree);
    for (n, (packet, count)) in packets::<L>(lines).enumerate() {
        let hit = wide.closest(&packet, wide.all());
        let met = hit.t.lt(L::of(L::MAX));
        let here = surface(&wide, &packet, &hit);
        let limit = 2.0;
        let blocked = wide.blocked(&packet, L::of(limit), L::mask(true), wide.all());
        for i in 0..count {
            let ray =
                Ray { origin: lane_of(packet.origin, i), direction: lane_of(packet.direction, i) };
            let one = narrow.closest(&ray, narrow.all());
            let told = || {
                format!(
                    "{name}, {} against {}, tree {tree}: ray {} of the seed: {ray:?}: {:?}, not {:?}",
                    L::NAME,
                    S::NAME,
                    n * L::WIDTH + i,
                    hit.t.lane(i),
                    one.t
                )
            };
            assert!(same(hit.t.lane(i).to_f64(), one.t.lane(0).to_f64()), "{}", told());
            let limit = <S as Lanes>::of(limit);
            let b = narrow.blocked(&ray, limit, S::mask(true), narrow.all()).any();
            assert!(blocked.lane(i) == b, "blocked: {}", told());
            if !met.lane(i) {
                continue;
            }
            assert!(hit.item.tag_lane(i) == one.item.tag_lane(0), "item: {}", told());
            let s = surface(&narrow, &ray, &one);
            let equal = same3(here.point, s.point, i)
                && same3(here.normal, s.normal, i)
                && same(here.reach.lane(i).to_f64(), s.reach.lane(0).to_f64());
            assert!(equal, "surface {here:?}, not {s:?}: {}", told());
        }
    }
}

#[test]
fn packets_and_single_rays_give_the_same_bits() {
    for (i, (name, form)) in forms().into_iter().enumerate() {
        let mut numbers = Numbers::new(100 + i as u64);
        let lines: Vec<Line> = (0..40_000).map(|_| any_line(&mut numbers, &form)).collect();
        let forms = [form];
        compare::<Single, f32>(&name, &forms, false, &lines);
        compare::<Double, f64>(&name, &forms, false, &lines);
    }
}

/// All kinds in one place, packets whose lanes meet different things, and ties where surfaces lie on
/// each other: who wins may not depend on the company in the packet.
#[test]
fn packets_and_single_rays_agree_in_a_crowd() {
    let mut all: Vec<Form> = forms().into_iter().map(|f| f.1).collect();
    let again: Vec<Form> = all.iter().filter(|f| f.bounds().is_some()).cloned().collect();
    all.extend(again);
    let mut numbers = Numbers::new(99);
    let lines: Vec<Line> = (0..40_000)
        .map(|_| {
            let form = &all[numbers.below(all.len())];
            any_line(&mut numbers, form)
        })
        .collect();
    for tree in [false, true] {
        compare::<Single, f32>("crowd", &all, tree, &lines);
        compare::<Double, f64>("crowd", &all, tree, &lines);
    }
}
